//! Corrections of flights by the errors of the other flights.
//!
//! A flight that determines an error by itself keeps its own estimate. Another flight gets the
//! posterior from its weak evidence and the errors of the others. If the error of a flight is far
//! from the other flights', the flight is not corrected by it.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::instrument_trends::{ExaminedSeries, RecorderFindings};
use crate::flight::Correction;
use crate::ingest::{Compatibility, correction};
use crate::tables::{InstrumentRow, InstrumentVerdict};

/// Largest bound of a completed error, in ordinary sizes: with a larger one the other flights have
/// as little information as the flight itself.
const MOST_OF_ORDINARY: f64 = 0.7;

/// Number of grid steps per bound, for completed errors. A further flight that moves an error by
/// less than a step leaves the estimates as they are. Rounding to the grid is a twentieth of the
/// bound.
const STEPS_IN_BOUND: f64 = 8.0;

/// Corrections of a flight's record that replace those from the flight alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlightCorrections {
    pub flight_id: String,
    pub corrections: Vec<Correction>,
}

/// Completes the rows of the flights by the errors that the flights have in common. Returns the
/// corrections of flights whose corrections change.
pub fn correct_flights(
    rows: &mut [InstrumentRow],
    findings: &mut RecorderFindings,
    settings: &Compatibility,
) -> Vec<FlightCorrections> {
    let mut changed = BTreeSet::new();
    for row in rows.iter_mut() {
        let applied = row.applied.clone();
        findings.complete(row, settings);
        if row.applied != applied {
            changed.insert(row.flight_id.clone());
        }
    }
    let of_flight = |flight_id: String| {
        let own = rows.iter().filter(|row| row.flight_id == flight_id);
        let corrections = own.filter_map(|row| correction(row, settings)).collect();
        FlightCorrections {
            flight_id,
            corrections,
        }
    };
    changed.into_iter().map(of_flight).collect()
}

impl RecorderFindings {
    /// Completes the errors of an instrument that its flight does not determine. Withdraws
    /// corrections by errors that are far from the errors of the other flights.
    fn complete(&mut self, row: &mut InstrumentRow, settings: &Compatibility) {
        for (one, trend) in self.examined.iter().zip(&mut self.rows) {
            let (series, error) = (&one.series, one.series.error);
            let Some(common) = one
                .common
                .as_ref()
                .filter(|_| series.channel == row.channel)
            else {
                continue;
            };
            if common.far.contains(&row.flight_id) {
                row.set_applied(error, false);
            } else if row.error(error).is_none() {
                let mut samples = series.samples.iter();
                let own = samples.find(|sample| sample.flight_id == row.flight_id);
                let (value, bound) = common.of_flight(own);
                if bound > MOST_OF_ORDINARY * series.ordinary {
                    continue;
                }
                let value = on_grid(value, bound);
                row.set_error(error, value, bound);
                row.set_applied(error, settings.corrects(error, value, bound));
                if row.verdict.is_unknown() {
                    row.verdict = InstrumentVerdict::FromOthers;
                }
                trend.completed_flights += 1;
            }
        }
    }
}

/// Changes the verdicts of instruments without a fault of their own flight whose common error is certainly
/// larger than ordinary. A flight far from the others does not have that error.
pub fn apply_common_verdicts(rows: &mut [InstrumentRow], examined: &[ExaminedSeries]) {
    for row in rows.iter_mut().filter(|row| row.verdict.passed()) {
        let is_wrong = |one: &ExaminedSeries| {
            one.series.channel == row.channel
                && one.is_wrong_in_every_flight()
                && !one.far().contains(&row.flight_id)
        };
        if examined.iter().any(is_wrong) {
            row.verdict = InstrumentVerdict::WrongInEveryFlight;
        }
    }
}

/// Rounds a value to a grid whose step, a power of two, is a fraction of the bound.
fn on_grid(value: f64, bound: f64) -> f64 {
    let step = (bound / STEPS_IN_BOUND).log2().floor().exp2();
    step * (value / step).round()
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::super::fixture;
    use super::super::instrument_trends::examine;
    use super::*;

    fn row(flight: usize, scale: Option<f64>, applied: &str) -> InstrumentRow {
        InstrumentRow {
            bias: Some(0.04),
            bias_bound: Some(0.002),
            scale: scale.map(|scale| 1.0 + scale),
            scale_bound: scale.map(|_| 0.001),
            applied: applied.to_owned(),
            ..InstrumentRow::undetermined(
                &format!("f{flight}"),
                "Q",
                "q_deg_s",
                "deg/s",
                InstrumentVerdict::Ok,
            )
        }
    }

    /// Eight flights with a scale error of 2 %, one far from them, and one that determines none.
    fn campaign() -> (Vec<InstrumentRow>, RecorderFindings) {
        let scales = [
            0.019, 0.021, 0.02, 0.0195, 0.0205, 0.02, 0.0198, 0.0202, 0.3,
        ];
        let series = fixture::scales(scales.iter().map(|scale| (*scale, 0.001)), 0.0);
        let mut rows: Vec<InstrumentRow> = scales
            .iter()
            .enumerate()
            .map(|(i, scale)| row(i, Some(*scale), "bias scale"))
            .collect();
        rows.push(row(9, None, "bias"));
        (rows, examine(vec![series]))
    }

    #[test]
    fn a_flight_without_evidence_takes_the_others_errors_and_a_far_one_corrects_nothing() {
        let (mut rows, mut findings) = campaign();
        let corrected = correct_flights(&mut rows, &mut findings, &Compatibility::default());
        let flights: Vec<&str> = corrected.iter().map(|c| c.flight_id.as_str()).collect();
        assert_eq!(flights, ["f8", "f9"]);
        let [far, taken] = [&corrected[0].corrections[0], &corrected[1].corrections[0]];
        assert_eq!((far.bias, far.scale), (0.04, 0.0));
        assert!(
            (taken.scale - 0.02).abs() < 5e-4 && (taken.bias - 0.04).abs() < 1e-12,
            "{taken:?}"
        );
        assert_eq!(findings.rows[0].completed_flights, 1);
        assert_eq!(
            (rows[8].applied.as_str(), rows[9].applied.as_str()),
            ("bias", "bias scale")
        );
        assert_eq!(rows[0], row(0, Some(0.019), "bias scale"));
    }

    #[test]
    fn no_flight_has_an_ok_instrument_whose_common_error_is_wrong() {
        let (mut rows, findings) = campaign();
        let fault = InstrumentVerdict::Fault("off by 2 deg/s".to_owned());
        rows[1].verdict = fault.clone();
        apply_common_verdicts(&mut rows, &findings.examined);
        // Flight f8 is far from the others: its error is not the common one.
        for (i, row) in rows.iter().enumerate() {
            let expected = match i {
                1 => &fault,
                8 => &InstrumentVerdict::Ok,
                _ => &InstrumentVerdict::WrongInEveryFlight,
            };
            assert_eq!(row.verdict, *expected, "{}", row.flight_id);
        }
    }

    #[test]
    fn an_ordinary_common_error_changes_no_verdict() {
        let series = fixture::scales([0.001, -0.001, 0.0, 0.001].map(|v| (v, 0.001)), 0.0);
        let mut rows = vec![row(0, Some(0.001), "")];
        apply_common_verdicts(&mut rows, &examine(vec![series]).examined);
        assert_eq!(rows[0].verdict, InstrumentVerdict::Ok);
    }

    #[test]
    fn a_further_flight_within_the_grid_changes_no_value() {
        assert_abs_diff_eq!(on_grid(0.020_1, 0.001), on_grid(0.020_12, 0.000_99));
        assert!((on_grid(0.020_1, 0.001) - 0.020_1).abs() < 0.000_063);
    }
}
