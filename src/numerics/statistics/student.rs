//! Student's t distribution: intervals around estimates whose variance is itself an estimate.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::normal::NORMAL_95;

/// Least number of degrees of freedom of [`widening_95`]. With fewer, the variance's standard error
/// exceeds the variance, and the delta method behind the degrees of freedom fails.
const FEWEST: f64 = 3.0;

/// Degrees of freedom from which the expansion about the normal distribution is used: its error is
/// below 1e-8 there. The inverse of the distribution function takes longer, and loses
/// its digits far above (7 % at 1e7).
const MANY: f64 = 50.0;

/// Half width of a 95 % interval in standard errors; NaN with zero degrees of freedom.
#[must_use]
pub fn quantile_95(degrees_of_freedom: f64) -> f64 {
    if degrees_of_freedom >= MANY {
        return NORMAL_95 * (1.0 + expansion(NORMAL_95 * NORMAL_95, 1.0 / degrees_of_freedom));
    }
    StudentsT::new(0.0, 1.0, degrees_of_freedom).map_or(f64::NAN, |t| t.inverse_cdf(0.975))
}

/// Relative excess of a quantile over the normal one (Abramowitz and Stegun 26.7.5, four terms), from
/// the square `x` of the normal quantile and the reciprocal of the degrees of freedom.
fn expansion(x: f64, reciprocal: f64) -> f64 {
    let terms = [
        (x + 1.0) / 4.0,
        ((5.0 * x + 16.0) * x + 3.0) / 96.0,
        (((3.0 * x + 19.0) * x + 17.0) * x - 15.0) / 384.0,
        ((((79.0 * x + 776.0) * x + 1482.0) * x - 1920.0) * x - 945.0) / 92_160.0,
    ];
    terms
        .iter()
        .rev()
        .fold(0.0, |sum, term| reciprocal * (term + sum))
}

/// Ratio of Student's 95 % interval to the normal one.
#[must_use]
pub fn widening_95(degrees_of_freedom: f64) -> f64 {
    quantile_95(degrees_of_freedom.max(FEWEST)) / NORMAL_95
}

/// Probability of a larger magnitude; one with zero degrees of freedom.
#[must_use]
pub fn exceedance(magnitude: f64, degrees_of_freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, degrees_of_freedom).map_or(1.0, |t| 2.0 * t.sf(magnitude))
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn the_quantiles_are_those_of_the_tables() {
        // Abramowitz and Stegun, table 26.10.
        for (freedom, quantile) in [
            (1.0, 12.706),
            (3.0, 3.182),
            (4.0, 2.776),
            (10.0, 2.228),
            (30.0, 2.042),
            (120.0, 1.980),
        ] {
            assert_relative_eq!(quantile_95(freedom), quantile, max_relative = 3e-4);
        }
        assert!(quantile_95(0.0).is_nan());
        assert_relative_eq!(exceedance(2.776_445, 4.0), 0.05, max_relative = 1e-5);
        assert_relative_eq!(exceedance(1.0, 1.0), 0.5, max_relative = 1e-9);
        assert_relative_eq!(exceedance(1.0, 0.0), 1.0);
    }

    #[test]
    fn the_expansion_continues_the_inverse() {
        assert_relative_eq!(
            quantile_95(MANY),
            quantile_95(MANY * (1.0 - 1e-9)),
            max_relative = 2e-8
        );
        assert_relative_eq!(quantile_95(f64::INFINITY), NORMAL_95);
    }

    #[test]
    fn the_widening_falls_to_one_and_is_limited_at_three_degrees_of_freedom() {
        assert_relative_eq!(widening_95(3.0), 3.182_446 / 1.959_964, max_relative = 1e-6);
        assert_relative_eq!(widening_95(0.0), widening_95(3.0));
        assert_relative_eq!(widening_95(f64::INFINITY), 1.0);
    }
}
