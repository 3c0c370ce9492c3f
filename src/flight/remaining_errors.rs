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
    /// Estimate by which the signal is not corrected, since it is within the range of chance; `None` for
    /// a corrected signal.
    pub uncorrected: Option<f64>,
    /// Standard deviation of the estimate.
    pub bound: f64,
    /// Scatter of the error within the flight: a drift, or a position error that varies with the flow.
    pub scatter: f64,
}

impl RemainingError {
    /// Error of a corrected signal that is constant over the flight.
    #[must_use]
    pub fn corrected(bound: f64) -> RemainingError {
        RemainingError {
            uncorrected: None,
            bound,
            scatter: 0.0,
        }
    }

    /// Root mean square of the error. Calibration may state a standard deviation σ of the recorded
    /// signal's error.
    ///
    /// The mean error e over the flight of an uncorrected signal then has the prior N(0, σ²), and the
    /// estimate is v = e + N(0, b²): e has the mean k v and the variance k b², with k = σ²/(σ² + b²);
    /// k = 1 where nothing is stated. A corrected signal has the error of the estimate, whatever was
    /// stated of the recorded one. The scatter is added, as far as it is no larger than σ.
    #[must_use]
    pub fn root_mean_square(self, stated: Option<f64>) -> f64 {
        let variance = self.bound.powi(2);
        let share = match (self.uncorrected, stated) {
            (Some(_), Some(sigma)) => sigma.powi(2) / (sigma.powi(2) + variance),
            _ => 1.0,
        };
        let mean = share * self.uncorrected.unwrap_or(0.0);
        let scatter = self.scatter.min(stated.unwrap_or(f64::INFINITY));
        (share * variance + mean.powi(2) + scatter.powi(2)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::numerics::statistics::random::RandomStream;

    #[test]
    fn the_error_that_remains_follows_from_the_estimate_and_from_calibration() {
        let corrected = RemainingError::corrected(0.02);
        for stated in [Some(0.1), None] {
            assert_abs_diff_eq!(corrected.root_mean_square(stated), 0.02);
        }
        let uncorrected = RemainingError {
            uncorrected: Some(0.03),
            ..RemainingError::corrected(0.02)
        };
        let alone = 0.02_f64.hypot(0.03);
        assert_abs_diff_eq!(uncorrected.root_mean_square(None), alone);
        assert_abs_diff_eq!(
            uncorrected.root_mean_square(Some(1e6)),
            alone,
            epsilon = 1e-9
        );
        // A drift counts up to what is stated.
        let drifting = RemainingError {
            scatter: 0.05,
            ..corrected
        };
        for (stated, scatter) in [(None, 0.05), (Some(0.1), 0.05), (Some(0.03), 0.03)] {
            let expected = 0.02_f64.hypot(scatter);
            assert_abs_diff_eq!(drifting.root_mean_square(stated), expected, epsilon = 1e-12);
        }
        // The flight tells nothing: calibration alone.
        let vague = RemainingError {
            uncorrected: Some(0.5),
            ..RemainingError::corrected(1e4)
        };
        assert_abs_diff_eq!(vague.root_mean_square(Some(0.1)), 0.1, epsilon = 1e-9);
    }

    #[test]
    fn the_root_mean_square_of_an_uncorrected_error_is_that_of_simulated_ones() {
        let (stated, bound) = (0.1, 0.06);
        let mut random = RandomStream::new(3, "remaining errors");
        let (mut errors, mut expected) = (0.0, 0.0);
        for _ in 0..20_000 {
            let error = stated * random.normal();
            let value = error + bound * random.normal();
            let remaining = RemainingError {
                uncorrected: Some(value),
                ..RemainingError::corrected(bound)
            };
            errors += error.powi(2);
            expected += remaining.root_mean_square(Some(stated)).powi(2);
        }
        assert!(
            (errors / expected - 1.0).abs() < 0.03,
            "{errors} {expected}"
        );
    }
}
