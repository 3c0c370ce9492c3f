//! Factor of a derivative, as the model file spells it: `alpha`, `de_deg`, `alpha * q`, `abs(beta)`.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::derivative_unit::DerivativeUnit;
use crate::flight::signal;
use crate::units::{Quantity, Unit};

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
    /// α̇ c̄/2V, rad, as the measured motion implies it: the lag of the flow at the tail.
    AlphaRate,
    /// A control surface or any other recorded signal, in its own unit.
    Surface(String),
    /// A thrust-vectoring vane, deg. The derivative is a force in lbf/deg over q̄S, or a moment in
    /// ft·lbf/deg over q̄S and the reference length: the bracketed terms of 2.10, 2.12, 2.13, 3.9,
    /// 3.12, 3.13.
    Vane(String),
    /// Magnitude of a regressor.
    Magnitude(Box<Regressor>),
    /// Product of two regressors. Where one is a state of the equations, the other is as measured.
    Product(Box<[Regressor; 2]>),
}

/// Exponents of deg, rad and ft/s in the unit of a regressor.
type Powers = [usize; 3];

impl Regressor {
    /// Reads a regressor.
    ///
    /// # Errors
    /// The message, for more than two factors or a product without a unit of its own.
    pub fn parse(written: &str) -> Result<Regressor, String> {
        let factors: Vec<Regressor> = written.split('*').map(factor).collect::<Result<_, _>>()?;
        let regressor = match <[Regressor; 2]>::try_from(factors) {
            Ok(both) => Regressor::Product(Box::new(both)),
            Err(mut factors) if factors.len() == 1 => factors.remove(0),
            Err(_) => return Err("a regressor has at most two factors".to_owned()),
        };
        if !regressor.is_linear_in_alpha_rate() {
            return Err(format!(
                "`{written}` is not linear in `alpha_dot`, which stands for a lag; `alpha_dot` alone and its product with another factor are"
            ));
        }
        match regressor.unit() {
            Some(_) => Ok(regressor),
            None => Err(format!(
                "`{written}` is in no unit of a derivative; angles, reduced rates, Mach number, airspeed and products of two of them are"
            )),
        }
    }

    /// `true` if the regressor is at most linear in α̇: no magnitude contains α̇, and no product
    /// has it in both factors. The motion then follows from the loads by a linear equation.
    fn is_linear_in_alpha_rate(&self) -> bool {
        match self {
            Regressor::Magnitude(of) => !of.has_alpha_rate(),
            Regressor::Product(both) => {
                both.iter().all(Regressor::is_linear_in_alpha_rate)
                    && !both.iter().all(Regressor::has_alpha_rate)
            }
            _ => true,
        }
    }

    /// `true` if any part of the regressor is α̇.
    #[must_use]
    pub fn has_alpha_rate(&self) -> bool {
        self.leaves().contains(&&Regressor::AlphaRate)
    }

    /// Signal of the surface or vane that the regressor is; `None` for other regressors.
    #[must_use]
    pub fn surface(&self) -> Option<&str> {
        match self {
            Regressor::Surface(signal) | Regressor::Vane(signal) => Some(signal),
            _ => None,
        }
    }

    /// `true` for the airspeed. A build-up, and its key in the store, has it as the signal that it is.
    #[must_use]
    pub fn is_velocity(&self) -> bool {
        self.surface() == Some(signal::VELOCITY)
    }

    /// `true` for the Mach number, likewise.
    #[must_use]
    pub fn is_mach(&self) -> bool {
        self.surface() == Some(signal::MACH)
    }

    /// Signals of surfaces, vanes and others in the regressor.
    pub fn signals(&self) -> impl Iterator<Item = &str> {
        self.leaves().into_iter().filter_map(Regressor::surface)
    }

    /// Value of a function at the first part of the regressor for which it has one.
    pub fn find<T>(&self, of: impl Fn(&Regressor) -> Option<T>) -> Option<T> {
        self.leaves().into_iter().find_map(of)
    }

    /// Value of the regressor, from the values of its parts.
    pub fn value(&self, of: &impl Fn(&Regressor) -> f64) -> f64 {
        match self {
            Regressor::Magnitude(of_what) => of_what.value(of).abs(),
            Regressor::Product(both) => both[0].value(of) * both[1].value(of),
            part => of(part),
        }
    }

    /// Slope of the regressor along one of its parts, from the values of all parts.
    pub fn slope(&self, along: &Regressor, of: &impl Fn(&Regressor) -> f64) -> f64 {
        match self {
            Regressor::Magnitude(inner) => {
                let value = inner.value(of);
                let sign = if value == 0.0 { 0.0 } else { value.signum() };
                sign * inner.slope(along, of)
            }
            Regressor::Product(both) => {
                let [first, second] = &**both;
                first.slope(along, of) * second.value(of)
                    + first.value(of) * second.slope(along, of)
            }
            part if part == along => 1.0,
            _ => 0.0,
        }
    }

    /// Factor of proportion to the first part that has one, computed from the factors and measured
    /// values of the parts. `None` if no part has one.
    pub fn factor(
        &self,
        factor_of: &impl Fn(&Regressor) -> Option<f64>,
        measured: &impl Fn(&Regressor) -> f64,
    ) -> Option<f64> {
        match self {
            Regressor::Magnitude(of_what) => {
                let own = of_what.factor(factor_of, measured)?;
                Some(own * of_what.value(measured).signum())
            }
            Regressor::Product(both) => {
                let [first, second] = &**both;
                let own = first.factor(factor_of, measured);
                own.map(|own| own * second.value(measured))
                    .or_else(|| Some(first.value(measured) * second.factor(factor_of, measured)?))
            }
            part => factor_of(part),
        }
    }

    /// Unit of a derivative along this regressor; `None` for a product that no [`DerivativeUnit`]
    /// covers.
    #[must_use]
    pub fn unit(&self) -> Option<DerivativeUnit> {
        let mut powers: Powers = [0; 3];
        for part in self.leaves() {
            let own = part.powers()?;
            (0..3).for_each(|i| powers[i] += own[i]);
        }
        match powers {
            [0, 0, 0] => Some(DerivativeUnit::Number),
            [1, 0, 0] => Some(DerivativeUnit::PerDeg),
            [0, 1, 0] => Some(DerivativeUnit::PerRad),
            [0, 0, 1] => Some(DerivativeUnit::PerFtS),
            [2, 0, 0] => Some(DerivativeUnit::PerDeg2),
            [0, 2, 0] => Some(DerivativeUnit::PerRad2),
            [1, 1, 0] => Some(DerivativeUnit::PerDegRad),
            [1, 0, 1] => Some(DerivativeUnit::PerDegFtS),
            [0, 1, 1] => Some(DerivativeUnit::PerRadFtS),
            _ => None,
        }
    }

    fn powers(&self) -> Option<Powers> {
        match self {
            Regressor::Constant => Some([0; 3]),
            Regressor::Alpha | Regressor::Beta | Regressor::Vane(_) => Some([1, 0, 0]),
            Regressor::RollRate
            | Regressor::PitchRate
            | Regressor::YawRate
            | Regressor::AlphaRate => Some([0, 1, 0]),
            Regressor::Surface(name) => match Unit::of_signal(name).quantity {
                Quantity::Number => Some([0; 3]),
                Quantity::Angle => Some([1, 0, 0]),
                Quantity::Velocity => Some([0, 0, 1]),
                _ => None,
            },
            Regressor::Magnitude(_) | Regressor::Product(_) => None,
        }
    }

    /// Regressors that are neither products nor magnitudes.
    #[must_use]
    pub fn leaves(&self) -> Vec<&Regressor> {
        match self {
            Regressor::Magnitude(of) => of.leaves(),
            Regressor::Product(both) => both.iter().flat_map(Regressor::leaves).collect(),
            part => vec![part],
        }
    }
}

/// One factor of a product.
fn factor(written: &str) -> Result<Regressor, String> {
    let written = written.trim();
    if let Some(inner) = written
        .strip_prefix("abs(")
        .and_then(|w| w.strip_suffix(')'))
    {
        return Ok(Regressor::Magnitude(Box::new(part(inner.trim())?)));
    }
    part(written)
}

/// Spelling of the square or the magnitude that another spelling means.
fn meant(written: &str) -> Option<String> {
    let is_name = |name: &&str| {
        let all = |c: char| c.is_alphanumeric() || c == '_';
        !name.is_empty() && name.chars().all(all)
    };
    let square = ["^2", "²"].iter().find_map(|end| written.strip_suffix(end));
    let square = square.map(str::trim).filter(is_name);
    let inner = written.strip_prefix('|').and_then(|w| w.strip_suffix('|'));
    let magnitude = inner.map(str::trim).filter(is_name);
    let square = square.map(|name| format!("{name} * {name}"));
    square.or_else(|| magnitude.map(|name| format!("abs({name})")))
}

fn part(written: &str) -> Result<Regressor, String> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    if written.is_empty() || !written.chars().all(is_name) {
        let meant = meant(written).map(|meant| format!("; did you mean `{meant}`?"));
        return Err(format!(
            "`{written}` is no regressor; a factor is a name or `abs(name)`{}",
            meant.unwrap_or_default()
        ));
    }
    Ok(match written {
        "constant" => Regressor::Constant,
        "alpha" => Regressor::Alpha,
        "beta" => Regressor::Beta,
        "p" => Regressor::RollRate,
        "q" => Regressor::PitchRate,
        "r" => Regressor::YawRate,
        "alpha_dot" => Regressor::AlphaRate,
        signal => Regressor::Surface(signal.to_owned()),
    })
}

impl fmt::Display for Regressor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Regressor::Constant => f.write_str("constant"),
            Regressor::Alpha => f.write_str("alpha"),
            Regressor::Beta => f.write_str("beta"),
            Regressor::RollRate => f.write_str("p"),
            Regressor::PitchRate => f.write_str("q"),
            Regressor::YawRate => f.write_str("r"),
            Regressor::AlphaRate => f.write_str("alpha_dot"),
            Regressor::Surface(signal) | Regressor::Vane(signal) => f.write_str(signal),
            Regressor::Magnitude(of) => write!(f, "abs({of})"),
            Regressor::Product(both) => write!(f, "{} * {}", both[0], both[1]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn products_and_magnitudes_are_read_with_their_units() {
        for (written, unit) in [
            ("constant", DerivativeUnit::Number),
            ("mach", DerivativeUnit::Number),
            ("alpha", DerivativeUnit::PerDeg),
            ("alpha*alpha", DerivativeUnit::PerDeg2),
            ("abs(beta)", DerivativeUnit::PerDeg),
            ("alpha * de_deg", DerivativeUnit::PerDeg2),
            ("q * alpha", DerivativeUnit::PerDegRad),
            ("velocity_ft_s", DerivativeUnit::PerFtS),
            ("mach * alpha", DerivativeUnit::PerDeg),
            ("alpha_dot", DerivativeUnit::PerRad),
            ("alpha_dot * mach", DerivativeUnit::PerRad),
        ] {
            let regressor = Regressor::parse(written).expect(written);
            assert_eq!(regressor.unit(), Some(unit), "{written}");
        }
        for refused in [
            "alpha * alpha * alpha",
            "",
            "abs(abs(beta))",
            "alpha^2",
            "qbar_psf",
            "abs(alpha_dot)",
            "alpha_dot * alpha_dot",
        ] {
            assert!(Regressor::parse(refused).is_err(), "{refused}");
        }
    }

    #[test]
    fn a_product_is_proportional_to_its_state_and_takes_the_rest_as_measured() {
        let states = |r: &Regressor| (*r == Regressor::Alpha).then_some(2.0);
        let measured = |r: &Regressor| match r {
            Regressor::Alpha => -3.0,
            Regressor::Beta => -5.0,
            _ => 7.0,
        };
        for (written, factor, value) in [
            ("alpha", Some(2.0), -3.0),
            ("alpha * alpha", Some(-6.0), 9.0),
            ("de_deg * alpha", Some(14.0), -21.0),
            ("abs(alpha)", Some(-2.0), 3.0),
            ("abs(beta)", None, 5.0),
            ("abs(beta) * alpha", Some(10.0), -15.0),
            ("beta * de_deg", None, -35.0),
        ] {
            let regressor = Regressor::parse(written).unwrap();
            assert_eq!(regressor.factor(&states, &measured), factor, "{written}");
            assert_relative_eq!(regressor.value(&measured), value);
            assert_eq!(Regressor::parse(&regressor.to_string()), Ok(regressor));
        }
    }
}
