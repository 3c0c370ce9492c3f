//! Segment finds the maneuvers of a record and their classes from the record alone, and weighs the analyst's events
//! against them.
//!
//! What is looked at is steps: fast, lasting changes of a surface or of a pilot control ([`steps`]). Two kinds of
//! candidates are made of them ([`candidates`]): intervals in which the excitation flag is up, and trains of pilot steps.
//! A candidate is a maneuver of the class whose recognition it fits: flags up or down for most of it, and step counts
//! within limits ([`recognise`]). Steps do not depend on where a surface is trimmed, and feedback and ordinary flying
//! move the surfaces smoothly or singly; so counts of steps, and not amplitudes, tell the classes apart.

mod candidates;
mod condition;
mod events;
mod recognise;
mod steps;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::aircraft::Aircraft;
use crate::error::Problem;
use crate::flight::Record;
use crate::maneuver::{Class, Maneuver};

pub use events::with_events;
pub use steps::Step;

/// What the analyst decides about finding maneuvers; all times in s.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The flag signal that is up while the on-board excitation system moves the surfaces.
    pub excitation_flag: String,
    /// Signal → the smallest change, in the signal's unit, that counts as a step. Well above noise, turbulence and
    /// feedback, well below the smallest reversal that is commanded.
    pub steps: BTreeMap<String, f64>,
    /// Pilot steps begin with a deflection from trim and end with one back to trim, each about half a reversal or less:
    /// such a step belongs to the maneuver when it is at least this share of the smallest step. It is not counted.
    /// Default 0.45.
    #[serde(default = "default_deflection")]
    pub deflection_share: f64,
    /// A step is complete within this time: a full reversal at the actuators' rate limit. Default 0.15 s.
    #[serde(default = "default_transit")]
    pub transit_s: f64,
    /// Before and after a step the level is averaged over this time. Default 0.125 s.
    #[serde(default = "default_level")]
    pub level_s: f64,
    /// A drop-out of the excitation flag up to this long does not end the excitation. Default 0.5 s, shorter than the
    /// decay after a maneuver, so that two maneuvers are never joined.
    #[serde(default = "default_dropout")]
    pub longest_dropout_s: f64,
    /// How long a pilot may hold a control away from trim within one maneuver: half a slow oscillation. Default 4 s.
    #[serde(default = "default_hold")]
    pub longest_hold_s: f64,
    /// How long all controls of one maneuver may rest at trim between two inputs; a longer rest ends the maneuver, and
    /// what comes after it is recovery. Default 2 s.
    #[serde(default = "default_rest")]
    pub longest_rest_s: f64,
    /// Excitation of fewer steps than this is no maneuver and not worth a word: a flag that flickers, a turn. Default 3,
    /// the edges of one doublet.
    #[serde(default = "default_fewest")]
    pub fewest_steps: usize,
}

fn default_deflection() -> f64 {
    0.45
}
fn default_transit() -> f64 {
    0.15
}
fn default_level() -> f64 {
    0.125
}
fn default_dropout() -> f64 {
    0.5
}
fn default_hold() -> f64 {
    4.0
}
fn default_rest() -> f64 {
    2.0
}
fn default_fewest() -> usize {
    3
}

impl Settings {
    /// The signals that some class counts steps of and for which no smallest step is set: a mistake in the
    /// configuration, since such a class could never be recognised.
    #[must_use]
    pub fn without_smallest_step(&self, classes: &[Class]) -> BTreeSet<String> {
        let counted = classes.iter().flat_map(|c| c.recognition.steps.keys());
        counted.filter(|s| !self.steps.contains_key(*s)).cloned().collect()
    }
}

/// The maneuvers of one record in the order of their starts, and what looked like one but is none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Segmented {
    pub maneuvers: Vec<Maneuver>,
    pub problems: Vec<Problem>,
}

/// The signals that are looked at: steps and flags, and what the flight condition is made of. A record needs no others.
#[must_use]
pub fn signals(classes: &[Class], settings: &Settings) -> BTreeSet<String> {
    let named = classes.iter().flat_map(|c| c.recognition.steps.keys().chain(c.recognition.flags.keys()));
    let steps = named.chain(settings.steps.keys()).chain([&settings.excitation_flag]).cloned();
    steps.chain(condition::SIGNALS.iter().map(|s| (*s).to_owned())).collect()
}

/// Finds the maneuvers of one record.
///
/// Excitation that fits no class or several, maneuvers that the record cuts, and signals that the record lacks are
/// problems; the rest of the record is segmented all the same.
#[must_use]
pub fn maneuvers(record: &Record, classes: &[Class], aircraft: &Aircraft, settings: &Settings) -> Segmented {
    let steps = steps::of_record(record, settings, 1.0);
    let excitations = candidates::excitations(record, classes, settings);
    let (mut recognised, mut problems) = recognise::all(record, classes, settings, &steps, &excitations);
    problems.extend(lacking(record, classes, settings));
    recognise::keep_apart(&mut recognised);
    let mut maneuvers = Vec::new();
    for r in &recognised {
        match condition::maneuver(record, aircraft, r.class, (r.start_s, r.end_s), "found") {
            Ok(m) => maneuvers.push(m),
            Err(reason) => problems.push(problem(record, r.start_s, reason)),
        }
    }
    problems.sort_by(|a, b| a.place.cmp(&b.place));
    Segmented { maneuvers, problems }
}

/// Signals without which some class cannot be recognised in this record.
fn lacking(record: &Record, classes: &[Class], settings: &Settings) -> Vec<Problem> {
    let counted = classes.iter().flat_map(|c| c.recognition.steps.keys().chain(c.recognition.flags.keys()));
    let wanted: BTreeSet<&String> = counted.chain([&settings.excitation_flag]).collect();
    let missing = wanted.into_iter().filter(|s| record.values(s).is_none());
    let reason = "the record has no such signal; maneuvers of the classes that count its steps cannot be recognised";
    missing
        .map(|signal| Problem {
            stage: "segment".into(),
            flight_id: record.flight_id.clone(),
            place: signal.clone(),
            reason: reason.into(),
        })
        .collect()
}

/// A problem at a time of the record.
fn problem(record: &Record, at_s: f64, reason: String) -> Problem {
    Problem { stage: "segment".into(), flight_id: record.flight_id.clone(), place: format!("t = {at_s:.1} s"), reason }
}
