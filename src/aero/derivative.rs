//! A derivative: one coefficient's slope along one regressor, e.g. `CN_alpha`.

use serde::{Deserialize, Serialize};

use crate::flight::signal;
use crate::schema::words;
use crate::units::{DEG, Unit};

words! {
    /// Set of equations: chapter 2 or chapter 3 of the paper.
    pub enum Axis {
        /// Chapter 2: pitch, normal and axial force.
        Longitudinal = "longitudinal",
        /// Chapter 3: roll, yaw and side force.
        Lateral = "lateral",
    }
}

impl Axis {
    /// Coefficients that act in this axis, in the order of the equations.
    #[must_use]
    pub fn coefficients(self) -> [Coefficient; 3] {
        match self {
            Axis::Longitudinal => [Coefficient::CN, Coefficient::Cm, Coefficient::CA],
            Axis::Lateral => [Coefficient::CY, Coefficient::Cl, Coefficient::Cn],
        }
    }

    /// Outputs that are matched, in the order of Tables 2 and 4.
    #[must_use]
    pub fn outputs(self) -> [Output; 5] {
        match self {
            Axis::Longitudinal => [
                Output::Alpha,
                Output::Q,
                Output::Theta,
                Output::An,
                Output::Ax,
            ],
            Axis::Lateral => [Output::Beta, Output::P, Output::R, Output::Phi, Output::Ay],
        }
    }
}

/// Force or moment coefficient: normal and axial force, side force, and the three moments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Coefficient {
    CN,
    Cm,
    CA,
    CY,
    Cl,
    Cn,
}

impl Coefficient {
    #[must_use]
    pub fn axis(self) -> Axis {
        match self {
            Coefficient::CN | Coefficient::Cm | Coefficient::CA => Axis::Longitudinal,
            Coefficient::CY | Coefficient::Cl | Coefficient::Cn => Axis::Lateral,
        }
    }

    /// Index among the coefficients of its axis.
    #[must_use]
    pub fn index(self) -> usize {
        self.axis()
            .coefficients()
            .iter()
            .position(|c| *c == self)
            .unwrap_or(0)
    }

    #[must_use]
    pub fn is_moment(self) -> bool {
        matches!(self, Coefficient::Cm | Coefficient::Cl | Coefficient::Cn)
    }
}

words! {
    /// Measured response that the estimation matches.
    pub enum Output {
        /// Angle of attack at the vane.
        Alpha = "alpha",
        /// Pitch rate.
        Q = "q",
        /// Pitch attitude.
        Theta = "theta",
        /// Normal acceleration.
        An = "an",
        /// Longitudinal acceleration.
        Ax = "ax",
        /// Sideslip at the vane.
        Beta = "beta",
        /// Roll rate.
        P = "p",
        /// Yaw rate.
        R = "r",
        /// Roll attitude.
        Phi = "phi",
        /// Lateral acceleration.
        Ay = "ay",
    }
}

impl Output {
    /// Signal that measures it.
    #[must_use]
    pub fn signal(self) -> &'static str {
        match self {
            Output::Alpha => signal::ALPHA_VANE,
            Output::Q => signal::Q,
            Output::Theta => signal::THETA,
            Output::An => signal::AN,
            Output::Ax => signal::AX,
            Output::Beta => signal::BETA_VANE,
            Output::P => signal::P,
            Output::R => signal::R,
            Output::Phi => signal::PHI,
            Output::Ay => signal::AY,
        }
    }

    #[must_use]
    pub fn axis(self) -> Axis {
        if Axis::Longitudinal.outputs().contains(&self) {
            Axis::Longitudinal
        } else {
            Axis::Lateral
        }
    }
}

/// Factor of a derivative.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Regressor {
    /// One: the coefficient at zero of everything else.
    Constant,
    /// Angle of attack, deg.
    Alpha,
    /// Sideslip, deg.
    Beta,
    /// p b/2V, rad.
    RollRate,
    /// q c̄/2V, rad.
    PitchRate,
    /// r b/2V, rad.
    YawRate,
    /// A control surface or any other recorded signal, in its own unit (deg).
    Surface(String),
    /// A thrust-vectoring vane, deg; the derivative is a force in lbf/deg over q̄S or a moment in
    /// ft·lbf/deg over q̄S and the reference length (the bracketed terms of 2.10, 2.12, 2.13, 3.9,
    /// 3.12, 3.13).
    Vane(String),
}

impl Regressor {
    /// Signal of the surface or vane; `None` for other regressors.
    #[must_use]
    pub fn surface(&self) -> Option<&str> {
        match self {
            Regressor::Surface(signal) | Regressor::Vane(signal) => Some(signal),
            _ => None,
        }
    }
}

words! {
    /// Unit of a derivative or bias, spelled as in the wind-tunnel tables.
    pub enum DerivativeUnit {
        /// A coefficient, without a unit.
        Number = "-",
        /// Per degree: static and control derivatives.
        PerDeg = "per_deg",
        /// Per radian of p b/2V, q c̄/2V or r b/2V: rate derivatives.
        PerRad = "per_rad",
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
    /// Factor from values in a unit as a database spells it (`per_rad`, `1/deg`, `N_per_deg`, `nd`)
    /// to values in this one.
    ///
    /// Exactly one for its own name; `None` for a unit of another quantity.
    #[must_use]
    pub fn factor_from(self, written: &str) -> Option<f64> {
        let (quantity, factor, angle) = spelled(written)?;
        let (own_quantity, own_factor, own_angle) = spelled(self.name())?;
        let per_angle = match (angle, own_angle) {
            (None, None) => 1.0,
            (Some(a), Some(b)) if a == b => 1.0,
            (Some(a), Some(b)) => per_degree(a) / per_degree(b),
            _ => return None,
        };
        (quantity == own_quantity).then_some(factor / own_factor * per_angle)
    }
}

/// Factor from a value per this angle to a value per degree.
fn per_degree(angle: &str) -> f64 {
    if angle == "rad" { 1.0 / DEG } else { 1.0 }
}

/// Parts of a derivative's unit: quantity, factor to that quantity's own unit, and angle.
fn spelled(written: &str) -> Option<(&'static str, f64, Option<&'static str>)> {
    let plain: String = written
        .trim()
        .chars()
        .filter(|c| !matches!(c, ' ' | '*' | '·' | '^'))
        .collect();
    let (of, per) = match plain.split_once("per_").or_else(|| plain.split_once('/')) {
        Some((of, per)) => (of.trim_matches('_'), Some(per)),
        None => (
            plain
                .strip_suffix("deg-1")
                .or(plain.strip_suffix("rad-1"))
                .unwrap_or(&plain),
            None,
        ),
    };
    let per = per.or_else(|| {
        plain
            .strip_suffix("-1")
            .map(|p| &p[p.len().saturating_sub(3)..])
    });
    let angle = match per {
        None => None,
        Some("deg") => Some("deg"),
        Some("rad") => Some("rad"),
        Some(_) => return None,
    };
    let factor = |name: &str, own: &str| Unit::parse(name).ok()?.factor_to(Unit::parse(own).ok()?);
    match of {
        "" | "1" | "-" | "nd" | "ND" => Some(("number", 1.0, angle)),
        "lbf" => Some(("force", 1.0, angle)),
        "N" => Some(("force", factor("N", "lbf")?, angle)),
        "ftlbf" | "ft_lbf" | "ft-lbf" => Some(("moment", 1.0, angle)),
        "Nm" | "N_m" | "N-m" => Some(("moment", factor("N", "lbf")? * factor("m", "ft")?, angle)),
        _ => None,
    }
}

/// One term of the build-up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Derivative {
    pub name: String,
    pub coefficient: Coefficient,
    pub regressor: Regressor,
}

impl Derivative {
    #[must_use]
    pub fn unit(&self) -> DerivativeUnit {
        match self.regressor {
            Regressor::Constant => DerivativeUnit::Number,
            Regressor::Alpha | Regressor::Beta | Regressor::Surface(_) => DerivativeUnit::PerDeg,
            Regressor::RollRate | Regressor::PitchRate | Regressor::YawRate => {
                DerivativeUnit::PerRad
            }
            Regressor::Vane(_) if self.coefficient.is_moment() => DerivativeUnit::FtLbfPerDeg,
            Regressor::Vane(_) => DerivativeUnit::LbfPerDeg,
        }
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
