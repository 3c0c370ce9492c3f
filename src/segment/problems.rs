//! Problems of a record in segment: excitation that fits no class, missing signals, stuck flags.

use std::collections::BTreeSet;

use super::absent_signals::{AbsentSignal, absent_signals};
use super::recognition::found::FoundManeuver;
use super::settings::Settings;
use crate::error::{Problem, ProblemStage};
use crate::flight::{Record, signal};
use crate::maneuver::{Class, UnclassifiedExcitation};

/// Least number of maneuvers that contradict a constant flag before it counts as stuck: one may be
/// misclassified.
const FEWEST_CONTRADICTIONS: usize = 2;

/// A problem of a record at a place: a signal or a time.
pub(super) fn at_place(record: &Record, place: String, reason: String) -> Problem {
    Problem {
        stage: ProblemStage::Segment,
        flight_id: record.flight_id.clone(),
        place,
        reason,
    }
}

/// A problem at a time of the record.
pub(super) fn at_time(record: &Record, time_s: f64, reason: String) -> Problem {
    at_place(record, format!("t = {time_s:.1} s"), reason)
}

/// One problem for each excitation that fits no class.
pub(super) fn of_unknown(record: &Record, unknown: &[UnclassifiedExcitation]) -> Vec<Problem> {
    let problem = |u: &UnclassifiedExcitation| {
        let lasting_s = u.end_s - u.start_s;
        let reason = format!(
            "excitation of {lasting_s:.1} s that fits no class: {}; steps seen: {}",
            u.reason, u.inputs
        );
        at_time(record, u.start_s, reason)
    };
    unknown.iter().map(problem).collect()
}

/// One row for each signal that recognition needs and the record lacks. The row itself is no rejection:
/// excitation without a class, and maneuvers that are not estimated, have rows of their own.
pub(super) fn of_missing_signals(
    record: &Record,
    classes: &[Class],
    settings: &Settings,
) -> Vec<Problem> {
    let is_recorded = |signal: &str| {
        let values = record.values(signal).unwrap_or_default();
        values.iter().any(|v| v.is_finite())
    };
    let absence = |absent: AbsentSignal| {
        let kind = if absent.is_flag { "flag" } else { "signal" };
        let reason = format!("the record has no such {kind}; {}", absent.cost);
        Problem {
            stage: ProblemStage::Recording,
            ..at_place(record, absent.signal, reason)
        }
    };
    let absent = absent_signals(classes, settings, is_recorded);
    absent.into_iter().map(absence).collect()
}

/// One problem for each flag that never changes although maneuvers contradict it.
pub(super) fn of_stuck_flags(record: &Record, found: &[FoundManeuver]) -> Vec<Problem> {
    let flags: BTreeSet<&String> = found
        .iter()
        .flat_map(|f| f.class.recognition.flags.keys())
        .collect();
    flags
        .into_iter()
        .filter_map(|flag| of_stuck_flag(record, flag, found))
        .collect()
}

fn of_stuck_flag(record: &Record, flag: &str, found: &[FoundManeuver]) -> Option<Problem> {
    let mut positions = record
        .values(flag)?
        .iter()
        .filter(|v| v.is_finite())
        .map(|v| *v > signal::FLAG_UP);
    let is_up = positions.next()?;
    let contradictions = found
        .iter()
        .filter(|f| f.class.recognition.flags.get(flag) == Some(&!is_up))
        .count();
    let reason = format!(
        "is {} throughout and contradicts {contradictions} maneuvers: it is stuck",
        if is_up { "up" } else { "down" }
    );
    (contradictions >= FEWEST_CONTRADICTIONS && positions.all(|up| up == is_up))
        .then(|| at_place(record, flag.to_owned(), reason))
}
