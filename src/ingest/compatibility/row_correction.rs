//! Correction of a record by the errors of an instrument that its row in the table has.

use super::settings::Compatibility;
use crate::flight::{Correction, RemainingError, RemainingErrors};
use crate::tables::{InstrumentError, InstrumentRow};

/// Correction by the errors of a row, and the errors that remain; `None` if the flight determines
/// none of them.
#[must_use]
pub fn correction(row: &InstrumentRow, settings: &Compatibility) -> Option<Correction> {
    let applied = |error| {
        let estimate = row.error(error).filter(|_| row.is_applied(error));
        estimate.map_or(0.0, |(value, _)| value)
    };
    let correction = Correction {
        signal: row.signal.clone(),
        bias: applied(InstrumentError::Bias),
        scale: applied(InstrumentError::Scale),
        delay_s: applied(InstrumentError::Delay),
        remaining: RemainingErrors {
            bias: remaining(row, InstrumentError::Bias, settings),
            scale: remaining(row, InstrumentError::Scale, settings),
        },
    };
    let is_known = correction.remaining != RemainingErrors::default();
    (is_known || correction.changes_values()).then_some(correction)
}

/// Error that remains. `None` if the flight does not determine it, and for a certain error that is not
/// corrected: then calibration alone states its size.
fn remaining(
    row: &InstrumentRow,
    error: InstrumentError,
    settings: &Compatibility,
) -> Option<RemainingError> {
    let (value, bound) = row.error(error)?;
    let is_corrected = row.is_applied(error);
    let is_chance = value.abs() <= settings.standard_errors * bound;
    (is_corrected || is_chance).then(|| RemainingError {
        estimate: value,
        bound,
        is_corrected,
        scatter: row.scatter(error),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::InstrumentVerdict;

    fn row(bias: f64, applied: &str) -> InstrumentRow {
        InstrumentRow {
            bias: Some(bias),
            bias_bound: Some(0.01),
            applied: applied.to_owned(),
            ..InstrumentRow::undetermined("f", "Q", "q_deg_s", "deg/s", InstrumentVerdict::Ok)
        }
    }

    #[test]
    fn a_corrected_error_leaves_its_bound_and_a_small_one_itself() {
        let settings = Compatibility::default();
        let of = |row: InstrumentRow| correction(&row, &settings).map(|c| (c.bias, c.remaining));
        let remaining = |bias| RemainingErrors {
            bias: Some(bias),
            scale: None,
        };
        let corrected = RemainingError {
            estimate: 0.05,
            ..RemainingError::corrected(0.01)
        };
        assert_eq!(of(row(0.05, "bias")), Some((0.05, remaining(corrected))));
        let small = RemainingError {
            estimate: 0.015,
            is_corrected: false,
            ..RemainingError::corrected(0.01)
        };
        assert_eq!(of(row(0.015, "")), Some((0.0, remaining(small))));
    }

    #[test]
    fn a_certain_error_that_is_not_corrected_is_left_to_calibration() {
        assert_eq!(correction(&row(0.05, ""), &Compatibility::default()), None);
    }
}
