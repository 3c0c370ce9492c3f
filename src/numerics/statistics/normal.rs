//! The standard normal distribution.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use statrs::function::erf::{erf, erf_inv};

/// One-sided 90 % quantile.
pub const NORMAL_90: f64 = 1.281_551_565_544_600_4;

/// Two-sided 95 % quantile.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Probability that a normal deviate with a mean and standard deviation lies within ± a width.
#[must_use]
pub fn within(width: f64, mean: f64, deviation: f64) -> f64 {
    let scale = FRAC_1_SQRT_2 / deviation;
    0.5 * (error_function(scale * (width - mean)) + error_function(scale * (width + mean)))
}

/// Argument above which the error function rounds to one: there it is 1 − 2e-17.
const ROUNDS_TO_ONE: f64 = 6.0;

/// The error function. Large arguments return one without evaluating polynomials.
fn error_function(x: f64) -> f64 {
    if x.abs() >= ROUNDS_TO_ONE {
        1.0_f64.copysign(x)
    } else {
        erf(x)
    }
}

/// Probability that a standard normal deviate is below a value.
#[must_use]
pub fn below(value: f64) -> f64 {
    0.5 * (1.0 + erf(FRAC_1_SQRT_2 * value))
}

/// Value that a standard normal deviate is below with a given probability.
#[must_use]
pub fn quantile(probability: f64) -> f64 {
    SQRT_2 * erf_inv(2.0 * probability - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_error_function_has_the_bits_of_the_polynomials() {
        for k in -400..=400 {
            let x = 0.05 * f64::from(k);
            assert_eq!(error_function(x).to_bits(), erf(x).to_bits(), "{x}");
        }
        assert_eq!(
            error_function(f64::NEG_INFINITY).to_bits(),
            (-1.0_f64).to_bits()
        );
        assert!(error_function(f64::NAN).is_nan());
    }

    #[test]
    fn the_probability_is_that_of_the_tables() {
        for (width, expected) in [
            (1.0, 0.682_689_492),
            (1.959_964, 0.95),
            (3.0, 0.997_300_204),
        ] {
            assert_relative_eq!(within(2.0 * width, 0.0, 2.0), expected, max_relative = 1e-7);
        }
        for (value, expected) in [(0.0, 0.5), (1.644_854, 0.95), (-2.326_348, 0.01)] {
            assert_relative_eq!(below(value), expected, epsilon = 1e-7);
            assert_relative_eq!(quantile(expected), value, epsilon = 1e-5);
        }
        // A mean on the limit leaves half, a mean beyond it by a deviation 15.9 %.
        assert_relative_eq!(within(5.0, 5.0, 0.1), 0.5, max_relative = 1e-9);
        assert_relative_eq!(within(5.0, -5.1, 0.1), 0.158_655_254, max_relative = 1e-7);
    }
}
