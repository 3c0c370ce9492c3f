//! Recognition of a record: its sequences of steps are cut into maneuvers, and its sweeps found.

use super::class_evidence::{confidence, recognised};
use super::class_match::fits;
use super::cuts::CutSearch;
use super::detections::Detections;
use super::found::{FoundManeuver, RecognitionResult};
use super::segment::Segment;
use super::sequences::{Source, StepSequence, sequences};
use super::sweeps::find_sweeps;
use super::unclassified::{ambiguous, unexplained};
use crate::maneuver::{Class, UnclassifiedExcitation};
use crate::segment::steps::step::Step;

/// Difference of confidence below which two classes fit alike: less than the weight of a flag that
/// is not recorded, the smallest finding.
const SAME_CONFIDENCE: f64 = 0.01;

/// Size, as a share of `outstanding_share`, above which a step before the first one may begin the
/// maneuver: feedback may have halved it.
const OPENING_SHARE: f64 = 0.5;

/// Recognises the maneuvers of a record.
///
/// Two sequences of the same pilot controls are joined if more maneuvers are found in both together
/// than in each alone.
pub(in crate::segment) fn recognise<'a>(
    detections: &Detections,
    classes: &'a [Class],
) -> RecognitionResult<'a> {
    let mut recognition = RecognitionResult::default();
    let mut previous: Option<(StepSequence, RecognitionResult)> = None;
    for sequence in sequences(detections, classes) {
        let own = recognise_sequence(detections, classes, &sequence);
        let found_apart = previous.as_ref().map_or(0, |p| p.1.found.len()) + own.found.len();
        let joined = previous
            .as_ref()
            .and_then(|p| p.0.join(&sequence, detections))
            .map(|joined| {
                let recognised = recognise_sequence(detections, classes, &joined);
                (joined, recognised)
            })
            .filter(|(_, recognised)| recognised.found.len() > found_apart);
        if joined.is_none() {
            recognition.add(previous.map(|p| p.1).unwrap_or_default());
        }
        previous = joined.or(Some((sequence, own)));
    }
    recognition.add(previous.map(|p| p.1).unwrap_or_default());
    for class in classes {
        recognition.found.extend(find_sweeps(detections, class));
    }
    recognition
}

fn recognise_sequence<'a>(
    detections: &Detections,
    classes: &'a [Class],
    sequence: &StepSequence,
) -> RecognitionResult<'a> {
    let of_source = |class: &&Class| {
        class.recognition.sweep.is_empty() && Source::of_class(class, detections) == sequence.source
    };
    let search = CutSearch {
        detections,
        classes: classes.iter().filter(of_source).collect(),
        sequence,
    };
    let mut recognition = RecognitionResult::default();
    let (parts, penalties) = search.best_cut();
    for run in parts.chunk_by(|a, b| !a.is_maneuver && !b.is_maneuver) {
        let (first, last) = (run[0], run[run.len() - 1]);
        if !first.is_maneuver {
            let between = (first.steps.0, last.steps.1);
            recognition.unknown.extend(unexplained(&search, between));
            continue;
        }
        match classify(&search, first.steps) {
            Classified::Found(mut found) => {
                found.add_evidence(&format!("cut: {}", penalties.in_words()));
                recognition.found.push(found);
            }
            Classified::Ambiguous(unknown) => recognition.unknown.push(unknown),
            Classified::None => {}
        }
    }
    recognition
}

/// Classification of one part of a cut.
enum Classified<'a> {
    Found(FoundManeuver<'a>),
    /// Several classes fit alike.
    Ambiguous(UnclassifiedExcitation),
    None,
}

fn classify<'a>(search: &CutSearch<'_, 'a>, steps: (usize, usize)) -> Classified<'a> {
    let segment = search.segment(steps);
    match &best_classes(search, &segment)[..] {
        [] => Classified::None,
        [class] => {
            maneuver(search, &segment, class, steps).map_or(Classified::None, Classified::Found)
        }
        alike => {
            let names: Vec<&str> = alike.iter().map(|c| c.name.as_str()).collect();
            Classified::Ambiguous(ambiguous(search, &segment, names.join(", ")))
        }
    }
}

/// The classes that a segment fits best; several where they fit alike.
///
/// The class whose inputs explain the most steps is best. Among equals a class with pulses goes
/// before one with counts alone: lengths fit by chance less often. Then confidence decides.
fn best_classes<'a>(search: &CutSearch<'_, 'a>, segment: &Segment) -> Vec<&'a Class> {
    let mut ranked: Vec<(&'a Class, (usize, bool), f64)> = search
        .classes
        .iter()
        .filter(|class| fits(segment, class))
        .map(|class| {
            let has_pulses = !class.recognition.pulses.is_empty();
            let rank = (segment.count_explained(class), has_pulses);
            (*class, rank, confidence(segment, class))
        })
        .collect();
    ranked.sort_by(|a, b| b.1.cmp(&a.1).then(b.2.total_cmp(&a.2)));
    let Some((_, best_rank, best_confidence)) = ranked.first().copied() else {
        return Vec::new();
    };
    ranked
        .into_iter()
        .filter(|(_, rank, confidence)| {
            *rank == best_rank && best_confidence - confidence < SAME_CONFIDENCE
        })
        .map(|(class, ..)| class)
        .collect()
}

/// The maneuver of a class in a segment; `None` if no input of the class steps.
fn maneuver<'a>(
    search: &CutSearch,
    segment: &Segment,
    class: &'a Class,
    steps: (usize, usize),
) -> Option<FoundManeuver<'a>> {
    let (first_s, last_s) = segment.excited_s(class)?;
    let previous_s = steps
        .0
        .checked_sub(1)
        .and_then(|k| search.sequence.steps.get(k))
        .map_or(f64::NEG_INFINITY, |step| step.time_s);
    let first_s = opening_s(segment, (previous_s, first_s));
    Some(FoundManeuver {
        class,
        first_s,
        last_s,
        recognised: recognised(segment, class, (first_s, last_s)),
    })
}

/// Time of the first step of a maneuver. If a smaller step to the other side precedes it, the time
/// of that step: a deflection from trim that feedback made small.
///
/// Steps up to the last one before the segment belong to another maneuver.
fn opening_s(segment: &Segment, (previous_s, first_s): (f64, f64)) -> f64 {
    if !segment.is_onboard() {
        return first_s;
    }
    let uncommanded = &segment.detections.uncommanded;
    uncommanded
        .by_signal
        .keys()
        .filter_map(|signal| opening_of_signal(segment, signal, (previous_s, first_s)))
        .fold(first_s, f64::min)
}

fn opening_of_signal(
    segment: &Segment,
    signal: &str,
    (previous_s, first_s): (f64, f64),
) -> Option<f64> {
    let detections = segment.detections;
    let settings = detections.settings;
    let from_s = first_s - settings.longest_rest_s;
    let steps = detections.uncommanded.between(signal, from_s, first_s);
    let half_a_sample_s = detections.record.step_s / 2.0;
    let first = steps
        .iter()
        .find(|s| (s.time_s - first_s).abs() < half_a_sample_s)?;
    let least = OPENING_SHARE * settings.outstanding_share * first.size();
    let opens = |s: &&Step| {
        previous_s < s.time_s && s.time_s < first.time_s && s.opposes(first) && s.size() >= least
    };
    steps.iter().filter(opens).map(|s| s.time_s).next_back()
}
