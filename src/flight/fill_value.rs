//! Fill values: numbers that recorders write in place of a missing one, such as -9999.

use super::signal;
use crate::units::{Quantity, Unit};

/// Numbers of nines that recorders write for a missing value.
const FILL_VALUES: [f64; 4] = [999.0, 9_999.0, 99_999.0, 999_999.0];

/// `true` for a number that is usual as a fill value. Without branches, for the vectors.
#[inline]
#[must_use]
pub fn is_usual(recorded: f64) -> bool {
    let size = recorded.abs().to_bits();
    let is = |fill: &f64| size == fill.to_bits();
    FILL_VALUES.iter().fold(false, |any, fill| any | is(fill))
}

/// `true` for a fill value that is no measurement of a signal either. `convert` returns the number in the signal's
/// unit.
#[inline]
#[must_use]
pub fn is_fill_value(recorded: f64, signal: &str, convert: impl Fn(f64) -> f64) -> bool {
    let is_of_any_sign = || signal == signal::IXZ;
    is_usual(recorded)
        && !is_of_any_sign()
        && is_impossible(Unit::of_signal(signal).quantity, convert(recorded))
}

/// `true` for a fill value in a column of a formula, which has this unit.
#[must_use]
pub fn is_fill_value_in(recorded: f64, unit: &str) -> bool {
    is_usual(recorded)
        && Unit::parse(unit).is_ok_and(|unit| {
            let conversion = unit
                .alike()
                .next()
                .and_then(|kept| unit.conversion_to(kept));
            conversion.is_some_and(|c| is_impossible(unit.quantity, c.of(recorded)))
        })
}

/// `true` for a number that no aircraft has, in the unit of signals of a quantity. The limits are far beyond those of
/// any aircraft: a fill value is farther.
fn is_impossible(quantity: Quantity, value: f64) -> bool {
    match quantity {
        Quantity::Angle | Quantity::AngularRate => value.abs() > 720.0,
        Quantity::Acceleration => value.abs() > 90.0,
        Quantity::Velocity => value < -300.0,
        Quantity::Length => value < -2_500.0,
        Quantity::Pressure
        | Quantity::Mass
        | Quantity::Density
        | Quantity::Temperature
        | Quantity::RotationalSpeed
        | Quantity::Inertia => value < 0.0,
        Quantity::Number => value.abs() > 900.0,
        Quantity::AngularAcceleration | Quantity::Force | Quantity::Time => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nines_that_are_no_measurement_are_fill_values() {
        for (recorded, signal, converted) in [
            (-9_999.0, signal::ALPHA_VANE, -9_999.0),
            (-999.0, signal::VELOCITY, -3_277.6),
            (99_999.0, signal::AN, 99_999.0),
            (-9_999.0, signal::ALTITUDE, -9_999.0),
            (-9_999.0, signal::IX, -9_999.0),
        ] {
            assert!(is_fill_value(recorded, signal, |_| converted), "{signal}");
        }
        for (recorded, signal, converted) in [
            (-9_998.0, signal::ALPHA_VANE, -9_998.0),
            (-999.0, signal::ALTITUDE, -999.0),
            (9_999.0, signal::ALTITUDE, 9_999.0),
            (-9_999.0, signal::IXZ, -9_999.0),
        ] {
            assert!(!is_fill_value(recorded, signal, |_| converted), "{signal}");
        }
        assert!(is_fill_value_in(-9_999.0, "hPa") && !is_fill_value_in(-9_999.0, "N"));
    }
}
