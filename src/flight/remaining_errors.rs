//! Errors of a signal after its correction.

use serde::{Deserialize, Serialize};

/// Bias and scale error of a signal after its correction; `None` where the flight does not determine
/// them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RemainingErrors {
    /// In the signal's unit.
    pub bias: Option<RemainingError>,
    pub scale: Option<RemainingError>,
}

/// Error of a signal after its correction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RemainingError {
    /// Estimate of the recorded signal's error.
    pub estimate: f64,
    /// Standard deviation of the estimate.
    pub bound: f64,
    /// `true` if the signal is corrected by the estimate.
    pub is_corrected: bool,
    /// Scatter of the error within the flight: a drift, or a position error that varies with the flow.
    pub scatter: f64,
}

/// Standard deviations of an estimate from an error of the stated size within which it agrees with
/// that size.
const AGREEMENT: f64 = 3.0;

impl RemainingError {
    /// Error of a corrected signal whose estimate was zero.
    #[must_use]
    pub fn corrected(bound: f64) -> RemainingError {
        RemainingError {
            estimate: 0.0,
            bound,
            is_corrected: true,
            scatter: 0.0,
        }
    }

    /// Root mean square of the error. Calibration may state a standard deviation σ of the recorded
    /// signal's error.
    ///
    /// The mean error e over the flight then has the prior N(0, σ²), and the estimate is
    /// v = e + N(0, b²): e has the mean k v and the variance k b², with k = σ²/(σ² + b²). An estimate
    /// that is too large for σ contradicts the calibration: then, and where nothing is stated, k = 1.
    /// A correction removes v. The scatter is added, as far as it is no larger than σ.
    #[must_use]
    pub fn root_mean_square(self, stated: Option<f64>) -> f64 {
        let variance = self.bound.powi(2);
        let agrees = |prior: &f64| self.estimate.powi(2) <= AGREEMENT.powi(2) * (prior + variance);
        let share = stated
            .map(|sigma| sigma.powi(2))
            .filter(agrees)
            .map_or(1.0, |prior| prior / (prior + variance));
        let removed = if self.is_corrected {
            self.estimate
        } else {
            0.0
        };
        let mean = share * self.estimate - removed;
        let scatter = stated.map_or(self.scatter, |sigma| self.scatter.min(sigma));
        (share * variance + mean.powi(2) + scatter.powi(2)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::numerics::statistics::random::RandomStream;

    fn uncorrected(estimate: f64, bound: f64) -> RemainingError {
        RemainingError {
            estimate,
            is_corrected: false,
            ..RemainingError::corrected(bound)
        }
    }

    #[test]
    fn without_calibration_the_error_that_remains_follows_from_the_estimate_alone() {
        let by_estimate = uncorrected(0.03, 0.02);
        let corrected = RemainingError {
            is_corrected: true,
            ..by_estimate
        };
        // A vague calibration says no more than none.
        for stated in [None, Some(1e6)] {
            assert_abs_diff_eq!(corrected.root_mean_square(stated), 0.02, epsilon = 1e-9);
            let expected = 0.02_f64.hypot(0.03);
            assert_abs_diff_eq!(
                by_estimate.root_mean_square(stated),
                expected,
                epsilon = 1e-9
            );
        }
    }

    #[test]
    fn a_flight_that_tells_nothing_leaves_the_calibration() {
        let stated = Some(0.1);
        assert_abs_diff_eq!(
            uncorrected(0.5, 1e4).root_mean_square(stated),
            0.1,
            epsilon = 1e-9
        );
    }

    #[test]
    fn an_estimate_that_contradicts_the_calibration_is_believed() {
        let certain = RemainingError {
            estimate: 0.5,
            ..RemainingError::corrected(0.02)
        };
        assert_abs_diff_eq!(certain.root_mean_square(Some(0.1)), 0.02, epsilon = 1e-12);
    }

    #[test]
    fn a_drift_counts_up_to_what_is_stated() {
        let drifting = RemainingError {
            scatter: 0.05,
            ..RemainingError::corrected(0.0)
        };
        for (stated, scatter) in [(None, 0.05), (Some(0.1), 0.05), (Some(0.03), 0.03)] {
            assert_abs_diff_eq!(drifting.root_mean_square(stated), scatter, epsilon = 1e-12);
        }
    }

    #[test]
    fn the_root_mean_square_is_that_of_simulated_errors() {
        let (stated, bound) = (0.1, 0.06);
        let mut random = RandomStream::new(3, "remaining errors");
        let (mut errors, mut expected) = ([0.0; 2], [0.0; 2]);
        for _ in 0..40_000 {
            let error = stated * random.normal();
            let estimate = error + bound * random.normal();
            let is_corrected = estimate.abs() > 2.0 * bound;
            let remaining = RemainingError {
                is_corrected,
                ..uncorrected(estimate, bound)
            };
            let removed = if is_corrected { estimate } else { 0.0 };
            errors[usize::from(is_corrected)] += (error - removed).powi(2);
            expected[usize::from(is_corrected)] += remaining.root_mean_square(Some(stated)).powi(2);
        }
        for (errors, expected) in errors.into_iter().zip(expected) {
            let ratio = errors / expected;
            assert!((ratio - 1.0).abs() < 0.04, "{errors} of {expected}");
        }
    }
}
