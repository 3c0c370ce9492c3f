//! Effects of errors that several maneuvers share: errors of held values, and errors of
//! calibration.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Error that several maneuvers share.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SharedError {
    /// Error of the value at which this derivative is held.
    Held(String),
    /// Scale error of this signal.
    Scale(String),
    /// Constant error of this signal.
    Bias(String),
    /// Remaining error of this surface's delay.
    Delay(String),
}

/// Change of a maneuver's parameters by one standard deviation of an error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorEffect {
    pub error: SharedError,
    /// Standard deviation of the error; for a held value, in the unit of the value.
    pub deviation: f64,
    /// Change of each parameter if the true value exceeds the assumed one by one standard
    /// deviation.
    pub change: Vec<f64>,
}

/// Covariance of `n` parameters from their changes, each by one standard deviation of an independent
/// error.
#[must_use]
pub fn covariance_of(changes: &[DVector<f64>], n: usize) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(n, n);
    for change in changes {
        sum += change * change.transpose();
    }
    sum
}

impl ErrorEffect {
    #[must_use]
    pub fn new(error: SharedError, deviation: f64, change: &DVector<f64>) -> ErrorEffect {
        ErrorEffect {
            error,
            deviation,
            change: change.as_slice().to_vec(),
        }
    }
}
