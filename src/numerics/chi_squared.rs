//! The χ² distribution: sums of squares of independent standard normal errors.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Probability of a larger sum of squares; one with zero degrees of freedom.
#[must_use]
pub fn exceedance(sum_of_squares: f64, degrees_of_freedom: usize) -> f64 {
    ChiSquared::new(degrees_of_freedom as f64).map_or(1.0, |chi| chi.sf(sum_of_squares))
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
}
