//! Series of errors for tests.

use super::error_series::{ErrorSample, ErrorSeries};
use crate::tables::InstrumentError;

/// Scale errors of the channel Q, value and bound of each flight.
pub fn scales(errors: impl IntoIterator<Item = (f64, f64)>, systematic: f64) -> ErrorSeries {
    let errors = errors.into_iter().enumerate();
    let samples = errors.map(|(i, (value, bound))| ErrorSample {
        flight_id: format!("f{i}"),
        value,
        bound,
        systematic,
    });
    ErrorSeries {
        channel: "Q".to_owned(),
        signal: "q_deg_s".to_owned(),
        error: InstrumentError::Scale,
        ordinary: 0.005,
        corrected: 0.0,
        samples: samples.collect(),
    }
}
