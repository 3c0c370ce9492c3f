//! Units of derivatives and biases, and the spellings of tunnel databases.

use crate::schema::words;
use crate::units::{DEG, Unit};

words! {
    /// Unit of a derivative or bias, spelled as in the wind-tunnel tables.
    pub enum DerivativeUnit {
        /// A coefficient, without a unit.
        Number = "-",
        /// Per degree: static and control derivatives.
        PerDeg = "per_deg",
        /// Per radian of p b/2V, q c̄/2V or r b/2V: rate derivatives.
        PerRad = "per_rad",
        /// Per foot per second of airspeed.
        PerFtS = "per_ft_s",
        /// Per product of two angles in degrees.
        PerDeg2 = "per_deg2",
        /// Per product of two reduced rates.
        PerRad2 = "per_rad2",
        /// Per product of an angle in degrees and a reduced rate.
        PerDegRad = "per_deg_rad",
        /// Per product of an angle in degrees and an airspeed.
        PerDegFtS = "per_deg_ft_s",
        /// Per product of a reduced rate and an airspeed.
        PerRadFtS = "per_rad_ft_s",
        /// Force of a thrust-vectoring vane, lbf per degree.
        LbfPerDeg = "lbf_per_deg",
        /// Moment of a thrust-vectoring vane, ft·lbf per degree.
        FtLbfPerDeg = "ftlbf_per_deg",
        /// Bias of an accelerometer.
        G = "g",
        /// Bias of a rate gyro, deg/s.
        DegPerS = "deg_s",
        /// Bias of an attitude or a vane, deg.
        Deg = "deg",
    }
}

impl DerivativeUnit {
    /// The unit in words, as pages have it; empty for a pure number.
    #[must_use]
    pub fn typeset(self) -> &'static str {
        match self {
            DerivativeUnit::Number => "",
            DerivativeUnit::PerDeg => "per deg",
            DerivativeUnit::PerRad => "per rad",
            DerivativeUnit::PerFtS => "per ft s",
            DerivativeUnit::PerDeg2 => "per deg2",
            DerivativeUnit::PerRad2 => "per rad2",
            DerivativeUnit::PerDegRad => "per deg rad",
            DerivativeUnit::PerDegFtS => "per deg ft s",
            DerivativeUnit::PerRadFtS => "per rad ft s",
            DerivativeUnit::LbfPerDeg => "lbf/deg",
            DerivativeUnit::FtLbfPerDeg => "ft·lbf/deg",
            DerivativeUnit::G => "g",
            DerivativeUnit::DegPerS => "deg/s",
            DerivativeUnit::Deg => "deg",
        }
    }

    /// Factor that converts values from the unit `written`, as a database spells it (`per_rad`,
    /// `1/deg`, `N_per_deg`, `nd`), to this unit.
    ///
    /// Exactly 1 if `written` is this unit's name; `None` for a unit of another quantity.
    #[must_use]
    pub fn factor_from(self, written: &str) -> Option<f64> {
        if written.trim() == self.name() {
            return Some(1.0);
        }
        let (from, to) = (ParsedUnit::parse(written)?, ParsedUnit::parse(self.name())?);
        let per_angle = match (from.per, to.per) {
            (None, None) => 1.0,
            (Some(a), Some(b)) if a == b => 1.0,
            (Some(a), Some(b)) => a.per_degree() / b.per_degree(),
            _ => return None,
        };
        (from.quantity == to.quantity).then_some(from.factor / to.factor * per_angle)
    }
}

/// Quantity of a derivative, besides the angle.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Numerator {
    Number,
    Force,
    Moment,
}

/// Unit of angle below the line of a derivative's unit.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Angle {
    Degree,
    Radian,
}

impl Angle {
    /// Factor from a value per unit of this angle to a value per degree.
    fn per_degree(self) -> f64 {
        match self {
            Angle::Degree => 1.0,
            Angle::Radian => 1.0 / DEG,
        }
    }
}

/// A unit as a database spells it, in parts.
struct ParsedUnit {
    quantity: Numerator,
    /// Factor to the quantity's own unit: lbf, ft·lbf.
    factor: f64,
    per: Option<Angle>,
}

impl ParsedUnit {
    fn parse(written: &str) -> Option<ParsedUnit> {
        let plain: String = written
            .trim()
            .chars()
            .filter(|c| !matches!(c, ' ' | '*' | '·' | '^'))
            .collect();
        let (of, per) = split_angle(&plain);
        let per = match per {
            None => None,
            Some("deg") => Some(Angle::Degree),
            Some("rad") => Some(Angle::Radian),
            Some(_) => return None,
        };
        let (quantity, factor) = quantity(of)?;
        Some(ParsedUnit {
            quantity,
            factor,
            per,
        })
    }
}

/// Splits `lbf_per_deg`, `lbf/deg` or `deg-1` into quantity and angle.
fn split_angle(plain: &str) -> (&str, Option<&str>) {
    if let Some((of, per)) = plain.split_once("per_").or_else(|| plain.split_once('/')) {
        return (of.trim_matches('_'), Some(per));
    }
    let of = plain
        .strip_suffix("deg-1")
        .or(plain.strip_suffix("rad-1"))
        .unwrap_or(plain);
    let per = plain
        .strip_suffix("-1")
        .and_then(|p| p.get(p.len().saturating_sub(3)..));
    (of, per)
}

/// Quantity of a unit, with the factor to the quantity's own unit.
fn quantity(of: &str) -> Option<(Numerator, f64)> {
    let factor = |name: &str, own: &str| Unit::parse(name).ok()?.factor_to(Unit::parse(own).ok()?);
    match of {
        "" | "1" | "-" | "nd" | "ND" => Some((Numerator::Number, 1.0)),
        "lbf" => Some((Numerator::Force, 1.0)),
        "N" => Some((Numerator::Force, factor("N", "lbf")?)),
        "ftlbf" | "ft_lbf" | "ft-lbf" => Some((Numerator::Moment, 1.0)),
        "Nm" | "N_m" | "N-m" => Some((Numerator::Moment, factor("N", "lbf")? * factor("m", "ft")?)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_unit_converts_into_another_of_the_same_quantity_and_into_no_other() {
        use DerivativeUnit::{FtLbfPerDeg, LbfPerDeg, Number, PerDeg, PerRad};
        let degree = std::f64::consts::PI / 180.0;
        for (unit, written, factor) in [
            (PerDeg, "per_rad", degree),
            (PerDeg, "1/rad", degree),
            (PerDeg, "rad^-1", degree),
            (PerRad, "1/deg", 1.0 / degree),
            (LbfPerDeg, "lbf_per_rad", degree),
            (LbfPerDeg, "N/deg", 1.0 / 4.448_221_615_260_5),
            (FtLbfPerDeg, "N_m/deg", 1.0 / 4.448_221_615_260_5 / 0.3048),
            (Number, "nd", 1.0),
        ] {
            assert_relative_eq!(
                unit.factor_from(written).expect(written),
                factor,
                max_relative = 1e-12
            );
        }
        for unit in [Number, PerDeg, PerRad, LbfPerDeg, FtLbfPerDeg] {
            assert_eq!(unit.factor_from(unit.name()), Some(1.0));
        }
        for (unit, written) in [
            (PerDeg, "-"),
            (Number, "per_deg"),
            (PerDeg, "lbf_per_deg"),
            (PerDeg, "per_ft"),
            (PerDeg, "x"),
        ] {
            assert_eq!(unit.factor_from(written), None, "{written}");
        }
    }
}
