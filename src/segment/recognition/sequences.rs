//! Sequences of steps: uncommanded steps of surfaces, or steps of pilot controls, in close
//! succession. They belong to one maneuver or to several close together.

use std::collections::BTreeSet;

use super::detections::Detections;
use super::pilot_sequences::pilot_sequences;
use crate::maneuver::Class;
use crate::segment::steps::step::{Step, Steps};

/// One step of a sequence.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SequenceStep<'a> {
    pub signal: &'a str,
    pub time_s: f64,
    pub change: f64,
}

/// Source of the steps of a sequence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Source {
    /// The on-board excitation system: uncommanded steps of surfaces.
    Onboard,
    /// The pilot, with these controls.
    Pilot(BTreeSet<String>),
}

impl Source {
    /// The source of the inputs of a class.
    pub fn of_class(class: &Class, detections: &Detections) -> Source {
        let inputs = class.recognition.inputs();
        if inputs.iter().any(|s| detections.is_pilot_control(s)) {
            Source::Pilot(inputs.into_iter().map(str::to_owned).collect())
        } else {
            Source::Onboard
        }
    }
}

/// Steps that follow each other closely.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StepSequence<'a> {
    pub source: Source,
    /// In order of time.
    pub steps: Vec<SequenceStep<'a>>,
}

impl<'a> StepSequence<'a> {
    /// Joins this sequence with the next if the pilot may have changed from one control to another.
    ///
    /// The pause is then no longer than he may hold a control, and his next step is with another
    /// control than the last one.
    pub fn join(
        &self,
        next: &StepSequence<'a>,
        detections: &Detections,
    ) -> Option<StepSequence<'a>> {
        let is_whole = |s: &&SequenceStep| s.change.abs() >= detections.steps.smallest(s.signal);
        let last = self.steps.iter().rfind(is_whole)?;
        let first = next.steps.iter().find(is_whole)?;
        let rest_s = next.steps.first()?.time_s - self.steps.last()?.time_s;
        let changes_control = self.source == next.source
            && self.source != Source::Onboard
            && last.signal != first.signal;
        let joins = changes_control && (0.0..=detections.settings.longest_hold_s).contains(&rest_s);
        joins.then(|| StepSequence {
            source: self.source.clone(),
            steps: [&self.steps[..], &next.steps[..]].concat(),
        })
    }
}

/// Every sequence of the record: those of the surfaces, then those of each set of pilot controls
/// that classes are flown with.
pub(super) fn sequences<'a>(
    detections: &'a Detections,
    classes: &[Class],
) -> Vec<StepSequence<'a>> {
    let mut sequences = onboard_sequences(detections);
    let sources = classes.iter().map(|c| Source::of_class(c, detections));
    let control_sets: BTreeSet<BTreeSet<String>> = sources
        .filter_map(|source| match source {
            Source::Pilot(controls) => Some(controls),
            Source::Onboard => None,
        })
        .collect();
    for controls in control_sets {
        for span_s in pilot_sequences(detections, &controls) {
            let is_control = |signal: &str| controls.contains(signal);
            sequences.push(StepSequence {
                source: Source::Pilot(controls.clone()),
                steps: steps_between(&detections.deflections, is_control, span_s),
            });
        }
    }
    sequences
}

/// The sequences of uncommanded steps. A sequence ends at a pause longer than a control may be held
/// away from trim.
fn onboard_sequences<'a>(detections: &'a Detections) -> Vec<StepSequence<'a>> {
    let always = (f64::NEG_INFINITY, f64::INFINITY);
    let all = steps_between(&detections.uncommanded, |_| true, always);
    let hold_s = detections.settings.longest_hold_s;
    all.chunk_by(|a, b| b.time_s - a.time_s <= hold_s)
        .map(|steps| StepSequence {
            source: Source::Onboard,
            steps: steps.to_vec(),
        })
        .collect()
}

/// The steps of some signals from one time to another, in order of time.
fn steps_between<'a>(
    steps: &'a Steps,
    is_wanted: impl Fn(&str) -> bool,
    (from_s, to_s): (f64, f64),
) -> Vec<SequenceStep<'a>> {
    let step_of = |signal: &'a str, step: &Step| SequenceStep {
        signal,
        time_s: step.time_s,
        change: step.change(),
    };
    let mut all: Vec<SequenceStep> = steps
        .by_signal
        .keys()
        .filter(|signal| is_wanted(signal))
        .flat_map(|signal| {
            steps
                .between(signal, from_s, to_s)
                .iter()
                .map(move |step| step_of(signal, step))
        })
        .collect();
    all.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    all
}
