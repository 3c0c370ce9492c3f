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
pub enum RemainingError {
    /// The signal is corrected by an estimate of this standard deviation.
    Corrected { bound: f64 },
    /// The estimate is within the range of chance, and the signal is left as it was recorded.
    Uncorrected { value: f64, bound: f64 },
}

impl RemainingError {
    /// Root mean square of the error. Calibration may state a standard deviation σ of the recorded
    /// signal's error.
    ///
    /// The error e of an uncorrected signal then has the prior N(0, σ²), and the estimate is v = e +
    /// N(0, b²): e has the mean k v and the variance k b², with k = σ²/(σ² + b²); k = 1 where nothing is
    /// stated. A corrected signal has the error of the estimate, whatever was stated of the recorded one.
    #[must_use]
    pub fn root_mean_square(self, stated: Option<f64>) -> f64 {
        match self {
            RemainingError::Corrected { bound } => bound,
            RemainingError::Uncorrected { value, bound } => {
                let share =
                    stated.map_or(1.0, |sigma| sigma.powi(2) / (sigma.powi(2) + bound.powi(2)));
                (share * bound.powi(2) + (share * value).powi(2)).sqrt()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::numerics::random::RandomStream;

    #[test]
    fn the_error_that_remains_follows_from_the_estimate_and_from_calibration() {
        let corrected = RemainingError::Corrected { bound: 0.02 };
        for stated in [Some(0.1), None] {
            assert_abs_diff_eq!(corrected.root_mean_square(stated), 0.02);
        }
        let uncorrected = RemainingError::Uncorrected {
            value: 0.03,
            bound: 0.02,
        };
        let alone = 0.02_f64.hypot(0.03);
        assert_abs_diff_eq!(uncorrected.root_mean_square(None), alone);
        assert_abs_diff_eq!(
            uncorrected.root_mean_square(Some(1e6)),
            alone,
            epsilon = 1e-9
        );
        // The flight tells nothing: calibration alone.
        let vague = RemainingError::Uncorrected {
            value: 0.5,
            bound: 1e4,
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
            let remaining = RemainingError::Uncorrected { value, bound };
            errors += error.powi(2);
            expected += remaining.root_mean_square(Some(stated)).powi(2);
        }
        assert!(
            (errors / expected - 1.0).abs() < 0.03,
            "{errors} {expected}"
        );
    }
}
