//! Student's t distribution: intervals around estimates whose variance is itself an estimate.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Two-sided 95 % quantile of the normal distribution.
const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Fewest degrees of freedom of [`widening_95`]. With fewer, the variance's standard error exceeds
/// the variance, and the delta method behind the degrees of freedom fails.
const FEWEST: f64 = 3.0;

/// Half width of a 95 % interval in standard errors; NaN without a degree of freedom.
#[must_use]
pub fn quantile_95(degrees_of_freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, degrees_of_freedom).map_or(f64::NAN, |t| t.inverse_cdf(0.975))
}

/// Ratio of Student's 95 % interval to the normal one: the expansion of Abramowitz and Stegun
/// 26.7.5, to 0.2 % from three degrees of freedom on.
#[must_use]
pub fn widening_95(degrees_of_freedom: f64) -> f64 {
    let (v, x2) = (degrees_of_freedom.max(FEWEST), NORMAL_95 * NORMAL_95);
    // The terms over x, in powers of x².
    let first = (x2 + 1.0) / 4.0;
    let second = ((5.0 * x2 + 16.0) * x2 + 3.0) / 96.0;
    let third = (((3.0 * x2 + 19.0) * x2 + 17.0) * x2 - 15.0) / 384.0;
    let fourth = ((((79.0 * x2 + 776.0) * x2 + 1482.0) * x2 - 1920.0) * x2 - 945.0) / 92_160.0;
    1.0 + (first + (second + (third + fourth / v) / v) / v) / v
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn the_widening_is_the_ratio_of_the_quantiles() {
        for freedom in [3.0, 4.0, 6.5, 10.0, 30.0, 1000.0] {
            assert_relative_eq!(
                widening_95(freedom),
                quantile_95(freedom) / NORMAL_95,
                max_relative = 2e-3
            );
        }
        assert_relative_eq!(widening_95(f64::INFINITY), 1.0);
        assert_relative_eq!(widening_95(0.0), widening_95(3.0));
    }
}
