//! Matching of a segment with a class: the conditions of its recognition that fail.

use super::mismatch::Mismatch;
use super::patterns;
use super::segment::Segment;
use crate::maneuver::Class;

/// Largest number of steps of the pilot during a maneuver of the on-board system: a correction is
/// one step and its return; more is flying.
const CORRECTION_STEPS: usize = 2;

/// `true` if every condition of a class holds in a segment.
pub(super) fn fits(segment: &Segment, class: &Class) -> bool {
    mismatches(segment, class).is_empty()
}

/// The conditions of a class that fail in a segment; empty if it fits.
pub(super) fn mismatches(segment: &Segment, class: &Class) -> Vec<Mismatch> {
    let mut mismatches = step_mismatches(segment, class);
    for (signal, pulses) in &class.recognition.pulses {
        if let Err(mismatch) = patterns::fit_pulses(&segment.steps_of(signal), pulses) {
            mismatches.push(mismatch.of_signal(signal));
        }
    }
    for (signal, wanted) in &class.recognition.moves {
        if segment.moves(signal) == Some(!wanted) {
            let does = if *wanted { "does not move" } else { "moves" };
            mismatches.push(Mismatch::contradiction(format!("{signal} {does}")));
        }
    }
    if segment.is_onboard() {
        mismatches.extend(pilot_mismatch(segment));
    }
    mismatches
}

/// Signals that step too seldom or too often for a class.
fn step_mismatches(segment: &Segment, class: &Class) -> Vec<Mismatch> {
    let mut mismatches = Vec::new();
    for (signal, count) in &class.recognition.steps {
        let n = segment.steps_of(signal).len();
        if n < count.at_least {
            let reason = format!(
                "{signal} steps {n} times, at least {} wanted",
                count.at_least
            );
            mismatches.push(Mismatch::shortfall(reason));
        } else if n > count.at_most && segment.count_against(signal) > count.at_most {
            let reason = format!("{signal} steps {n} times, at most {} wanted", count.at_most);
            mismatches.push(Mismatch::contradiction(reason));
        }
    }
    mismatches
}

/// The reason why steps of surfaces are not attributed to the on-board system. Without recorded
/// pilot controls the steps of surfaces represent the pilot's, and there is no such reason.
fn pilot_mismatch(segment: &Segment) -> Option<Mismatch> {
    let detections = segment.detections;
    let n = detections.count_pilot_steps(segment.from_s, segment.to_s);
    (n > CORRECTION_STEPS)
        .then(|| Mismatch::contradiction(format!("the pilot's controls step {n} times meanwhile")))
}
