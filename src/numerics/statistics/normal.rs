//! The standard normal distribution.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_SQRT_PI, SQRT_2};
use std::sync::LazyLock;

use statrs::function::erf::{erf, erf_inv};

use crate::numerics::cubic_curve::hermite;

/// One-sided 90 % quantile.
pub const NORMAL_90: f64 = 1.281_551_565_544_600_4;

/// Two-sided 95 % quantile.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Knots of the tabulated distribution per standard deviation. Between them the cubics differ by less than 1e-10.
const KNOTS: f64 = 64.0;

/// Standard deviations at which the table ends: there the distribution rounds to one.
const ROUNDS_TO_ONE: f64 = 8.5;

/// Distribution and its density at the knots from zero on.
static TABLE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| {
    let knots = (0..).map(|k: u32| f64::from(k) / KNOTS);
    let density = |x: f64| (-0.5 * x * x).exp() * FRAC_1_SQRT_2 * FRAC_2_SQRT_PI * 0.5;
    let knots = knots.take_while(|x| *x <= ROUNDS_TO_ONE);
    knots.map(|x| (below(x), density(x))).collect()
});

/// Probability that a normal deviate with a mean and standard deviation lies within ± a width, to 1e-10. It is
/// read from a table, as repeat flights need it at each of their samples.
#[must_use]
pub fn within(width: f64, mean: f64, deviation: f64) -> f64 {
    let mean = mean.abs();
    let inside_nearer_limit = tabulated_below((width - mean) / deviation);
    let farther = width + mean;
    if farther >= ROUNDS_TO_ONE * deviation {
        return inside_nearer_limit;
    }
    inside_nearer_limit - tabulated_below(-farther / deviation)
}

/// As [`below`], by the cubics of the table.
#[inline]
fn tabulated_below(value: f64) -> f64 {
    let size = value.abs();
    let place = size * KNOTS;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative; what is no number becomes 0"
    )]
    let knot = place as u32;
    let ends = TABLE.get(knot as usize..).and_then(<[_]>::first_chunk);
    let of_size = ends.map_or(1.0, |[(y0, d0), (y1, d1)]| {
        hermite(1.0 / KNOTS, place - f64::from(knot), [*y0, *y1], [*d0, *d1]).0
    });
    if value < 0.0 { 1.0 - of_size } else { of_size }
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
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    #[test]
    fn the_table_has_the_distribution_to_1e_10_at_and_between_its_knots_and_beyond_them() {
        for k in -4000..=4000 {
            let value = 0.0025 * f64::from(k);
            assert_abs_diff_eq!(tabulated_below(value), below(value), epsilon = 1e-10);
        }
        assert_abs_diff_eq!(tabulated_below(f64::INFINITY), 1.0);
        assert_abs_diff_eq!(tabulated_below(f64::NEG_INFINITY), 0.0);
        assert!(tabulated_below(f64::NAN).is_nan());
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
