//! The χ² distribution: sums of squares of independent standard normal errors.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Probability of a larger sum of squares; one with zero degrees of freedom.
#[must_use]
pub fn exceedance(sum_of_squares: f64, degrees_of_freedom: usize) -> f64 {
    ChiSquared::new(degrees_of_freedom as f64).map_or(1.0, |chi| chi.sf(sum_of_squares))
}

/// Sum of squares that is not exceeded with a probability; `None` unless there are degrees of freedom.
#[must_use]
pub fn quantile(probability: f64, degrees_of_freedom: f64) -> Option<f64> {
    let chi = ChiSquared::new(degrees_of_freedom).ok()?;
    Some(chi.inverse_cdf(probability))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn with_two_degrees_of_freedom_the_probability_is_an_exponential() {
        for square in [0.0, 1.0, 9.21, 60.0] {
            let expected = (-0.5f64 * square).exp();
            assert_relative_eq!(exceedance(square, 2), expected, max_relative = 1e-9);
        }
        // The 95 % quantile of nine degrees of freedom.
        assert_relative_eq!(exceedance(16.918_978, 9), 0.05, max_relative = 1e-6);
        assert_relative_eq!(exceedance(3.0, 0), 1.0);
    }

    #[test]
    fn the_quantile_is_the_inverse_of_the_probability() {
        let square = quantile(0.95, 9.0).unwrap();
        assert_relative_eq!(square, 16.918_978, max_relative = 1e-6);
        assert_eq!(quantile(0.95, 0.0), None);
    }
}
