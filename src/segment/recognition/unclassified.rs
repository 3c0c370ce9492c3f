//! Excitation that fits no class, or several alike, with the reason in words.

use std::collections::BTreeSet;

use super::class_match::mismatches;
use super::cuts::CutSearch;
use super::detections::Detections;
use super::found::RecognitionResult;
use super::mismatch::Mismatch;
use super::segment::Segment;
use crate::maneuver::{Class, UnclassifiedExcitation};
use crate::segment::steps::detection::{is_maneuver_alone, largest_change};

/// Least number of steps of pilot controls that are more than ordinary flying: four reversals.
const FEWEST_PILOT_STEPS: usize = 4;

/// Time before the first step within which the start of the record may have cut a maneuver, s.
const CUT_AT_START_S: f64 = 1.0;

/// Reports steps that no maneuver explains, unless they may be ordinary flying.
///
/// They are reported if a signal moves to one side, to the other by more than in ordinary flying,
/// and back. Ordinary flying moves the controls too. Two cases are not reported: a few steps of the
/// pilot, and steps among which no class has one of its inputs complete. In a recording that may be
/// one maneuver everything is reported.
pub(super) fn unexplained(
    search: &CutSearch,
    steps: (usize, usize),
) -> Option<UnclassifiedExcitation> {
    let segment = search.segment(steps);
    let nearest = search
        .classes
        .iter()
        .map(|class| (*class, mismatches(&segment, class)))
        .min_by_key(|(class, mismatches)| {
            (
                usize::MAX - segment.count_explained(class),
                mismatches.len(),
            )
        });
    let signals: BTreeSet<&str> = search.sequence.steps.iter().map(|s| s.signal).collect();
    let reports_all = is_maneuver_alone(search.detections.record);
    if !reports_all && !signals.iter().any(|s| segment.is_excitation(s)) {
        return None;
    }
    let Some((class, mismatches)) = nearest else {
        let reason = "no class has inputs of this kind".to_owned();
        return Some(unknown(search, &segment, String::new(), reason));
    };
    let is_incomplete = mismatches.iter().any(Mismatch::is_shortfall);
    let is_flying = !segment.is_onboard() && is_incomplete && !is_series(&segment, class);
    if is_flying && !reports_all {
        return None;
    }
    let reason = reason_in_words(&segment, class, &mismatches);
    Some(unknown(search, &segment, class.name.clone(), reason))
}

/// Reports a recording that may be one maneuver and in which nothing was found.
pub(in crate::segment) fn nothing_found(
    detections: &Detections,
    recognition: &RecognitionResult,
) -> Option<UnclassifiedExcitation> {
    let record = detections.record;
    let is_empty = recognition.found.is_empty() && recognition.unknown.is_empty();
    if !is_empty || !is_maneuver_alone(record) {
        return None;
    }
    let (start_s, end_s) = (
        record.start_s,
        record.time_s(record.samples.saturating_sub(1)),
    );
    let change = |(signal, set): (&String, &f64)| {
        let settings = detections.settings;
        let largest = largest_change(record, signal, settings, (start_s, end_s));
        let is_recorded = record.signals.contains_key(signal);
        is_recorded.then(|| format!("{signal} {largest:.2} of {set}"))
    };
    let changes = detections.settings.steps.iter().filter_map(change);
    let changes: Vec<String> = changes.collect();
    Some(UnclassifiedExcitation {
        flight_id: record.flight_id.clone(),
        start_s,
        end_s,
        inputs: String::new(),
        nearest_class: String::new(),
        reason: format!(
            "no signal steps enough for a maneuver; largest changes and the smallest that is a step \
             (segment: steps): {}",
            changes.join(", ")
        ),
    })
}

/// Reports a segment that fits several classes alike.
pub(super) fn ambiguous(
    search: &CutSearch,
    segment: &Segment,
    names: String,
) -> UnclassifiedExcitation {
    let reason = format!("fits {names} alike; make their recognition exclude each other");
    unknown(search, segment, names, reason)
}

/// `true` for pilot steps beyond ordinary flying. They are at least [`FEWEST_PILOT_STEPS`], and at
/// least half of the steps that the class requires of all its inputs together.
fn is_series(segment: &Segment, class: &Class) -> bool {
    let wanted: usize = class.recognition.steps.values().map(|c| c.at_least).sum();
    segment.count_explained(class) >= wanted.div_ceil(2).max(FEWEST_PILOT_STEPS)
}

fn unknown(
    search: &CutSearch,
    segment: &Segment,
    nearest_class: String,
    reason: String,
) -> UnclassifiedExcitation {
    let counted = search
        .classes
        .iter()
        .flat_map(|c| c.recognition.counted())
        .map(String::as_str);
    let own = search.sequence.steps.iter().map(|step| step.signal);
    let counted = counted.chain(own.filter(|_| search.classes.is_empty()));
    UnclassifiedExcitation {
        flight_id: segment.detections.record.flight_id.clone(),
        start_s: segment.from_s,
        end_s: segment.to_s,
        inputs: segment.count_in_words(counted),
        nearest_class,
        reason,
    }
}

fn reason_in_words(segment: &Segment, class: &Class, mismatches: &[Mismatch]) -> String {
    let record = segment.detections.record;
    let record_end_s = record.time_s(record.samples.saturating_sub(1));
    let is_cut = segment.to_s + segment.detections.settings.longest_hold_s > record_end_s
        || segment.from_s - CUT_AT_START_S < record.start_s;
    let is_broken_off = mismatches.iter().all(Mismatch::is_shortfall);
    let why = match (is_broken_off, is_cut) {
        (true, true) => "cut by the end of the record, or broken off: ",
        (true, false) => "broken off? ",
        (false, _) => "",
    };
    let reasons: Vec<&str> = mismatches.iter().map(|m| m.reason.as_str()).collect();
    format!("nearest to {}; {why}{}", class.name, reasons.join("; "))
}
