//! Sequences of pilot steps: from the first deflection away from trim to the last one back to trim.

use std::collections::{BTreeMap, BTreeSet};

use super::detections::Detections;
use crate::segment::settings::Settings;
use crate::segment::steps::step::{Step, TRIM_SHARE};

/// Periods in which pilot controls step.
///
/// A sequence continues while a control is held away from trim, up to `longest_hold_s`, or while
/// all controls rest at trim, up to `longest_rest_s`. Steps of at least the smallest size count. A
/// smaller deflection can only begin a sequence, as the first half of a reversal, or end one, by
/// returning a control to trim.
pub(super) fn pilot_sequences(
    detections: &Detections,
    controls: &BTreeSet<String>,
) -> Vec<(f64, f64)> {
    let settings = detections.settings;
    let mut sequences: Vec<GrowingSequence> = Vec::new();
    let mut previous: BTreeMap<&str, &Step> = BTreeMap::new();
    for (signal, step) in deflections_of(detections, controls) {
        let smallest = detections.steps.smallest(signal);
        let counts = step.size() >= smallest;
        let smallest_deflection = settings.deflection_share * smallest;
        let previous_end_s = sequences.last().map_or(f64::NEG_INFINITY, |t| t.to_s);
        let opening = previous
            .insert(signal, step)
            .filter(|p| {
                step.time_s - p.time_s <= settings.longest_hold_s
                    && p.time_s > previous_end_s
                    && p.opposes(step)
            })
            .unwrap_or(step);
        let from_s = if counts { opening.time_s } else { step.time_s };
        let current = sequences
            .last_mut()
            .filter(|sequence| from_s - sequence.to_s <= sequence.longest_pause_s(settings));
        match current {
            Some(sequence) if counts || sequence.returns_to_trim(signal, step) => {
                sequence.add(signal, step, opening.before, smallest_deflection);
            }
            None if counts => {
                let mut sequence = GrowingSequence {
                    from_s: opening.time_s,
                    to_s: step.time_s,
                    controls: BTreeMap::new(),
                };
                sequence.add(signal, step, opening.before, smallest_deflection);
                sequences.push(sequence);
            }
            _ => {}
        }
    }
    sequences.iter().map(|t| (t.from_s, t.to_s)).collect()
}

/// All steps and deflections of some controls in order of time.
fn deflections_of<'a>(
    detections: &'a Detections,
    controls: &'a BTreeSet<String>,
) -> Vec<(&'a str, &'a Step)> {
    let mut all: Vec<(&str, &Step)> = controls
        .iter()
        .flat_map(|control| {
            let steps = detections.deflections.of(control);
            steps.iter().map(move |step| (control.as_str(), step))
        })
        .collect();
    all.sort_by(|a, b| a.1.time_s.total_cmp(&b.1.time_s));
    all
}

/// A sequence of pilot steps as it grows.
struct GrowingSequence<'a> {
    from_s: f64,
    to_s: f64,
    controls: BTreeMap<&'a str, ControlState>,
}

/// The state of one control in a sequence.
struct ControlState {
    trim: f64,
    level: f64,
    /// The sum of its steps.
    moved: f64,
    /// The smallest change that is a deflection.
    smallest_deflection: f64,
    largest_step: f64,
    last_step: f64,
}

impl ControlState {
    fn is_near_trim(&self, from_trim: f64) -> bool {
        from_trim.abs() < self.smallest_deflection.max(TRIM_SHARE * self.largest_step)
    }

    /// `true` if the control's steps cancel, or if its level is back at trim, since trim drifts in
    /// a turn. A whole reversal leads to the other side at any level.
    fn rests(&self) -> bool {
        let reversed = self.last_step > (1.0 - TRIM_SHARE) * self.largest_step;
        self.is_near_trim(self.moved) || (self.is_near_trim(self.level - self.trim) && !reversed)
    }

    /// `true` if the step returns the control to trim, judged by the sum of the steps or by the
    /// level. The level is needed because a slow step may have been missed.
    fn is_return(&self, step: &Step) -> bool {
        let returns =
            |before: f64, after: f64| !self.is_near_trim(before) && self.is_near_trim(after);
        returns(self.moved, self.moved + step.change())
            || returns(self.level - self.trim, step.after - self.trim)
    }
}

impl<'a> GrowingSequence<'a> {
    fn add(&mut self, signal: &'a str, step: &Step, trim: f64, smallest_deflection: f64) {
        self.to_s = step.time_s;
        let new = ControlState {
            trim,
            level: trim,
            moved: 0.0,
            smallest_deflection,
            largest_step: 0.0,
            last_step: 0.0,
        };
        let control = self.controls.entry(signal).or_insert(new);
        control.level = step.after;
        control.last_step = step.size();
        control.largest_step = control.largest_step.max(control.last_step);
        // The first step that counts may follow the deflection that opens the sequence.
        control.moved = if control.moved == 0.0 {
            step.after - trim
        } else {
            control.moved + step.change()
        };
    }

    /// `true` if a control that is held away from trim returns to it with this step.
    fn returns_to_trim(&self, signal: &str, step: &Step) -> bool {
        self.controls.get(signal).is_some_and(|c| c.is_return(step))
    }

    /// Longest pause after which the sequence still continues in its present state.
    fn longest_pause_s(&self, settings: &Settings) -> f64 {
        if self.controls.values().all(ControlState::rests) {
            settings.longest_rest_s
        } else {
            settings.longest_hold_s
        }
    }
}
