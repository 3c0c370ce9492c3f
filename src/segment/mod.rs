//! Segment finds the maneuvers of a record and their classes from the record alone, says what each
//! is worth, and weighs the analyst's events against them.
//!
//! What is looked at is steps: fast, lasting changes of a surface or of a pilot control
//! ([`steps`]). Steps do not depend on where a surface is trimmed, and ordinary flying moves the
//! surfaces smoothly or singly. Two kinds of trains are made of them ([`candidates`]): surfaces
//! that step while the pilot's controls rest, and pilot controls. A train is cut at its pauses into
//! stretches that fit the recognition of a class: counts of steps, lengths of pulses, what else
//! moves ([`seen`], [`patterns`], [`recognise`]); sweeps are found by their [`swings`]. Flags are
//! evidence among others: they may be missing, stuck or late. What fits no class is `unknown`, with
//! the reason. Each maneuver's [`quality`] is measured; one beyond a limit is rejected.

mod candidates;
mod completed;
mod condition;
mod events;
mod patterns;
pub mod quality;
mod recognise;
mod seen;
mod steps;
mod swings;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::aircraft::Aircraft;
use crate::error::{Problem, ProblemStage};
use crate::flight::Record;
use crate::maneuver::{Class, Maneuver, Unknown};
use candidates::Scene;

pub use events::with_events;
pub use steps::Step;

/// What the analyst decides about finding maneuvers; all times in s.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The flag signal that is up while the on-board excitation system moves the surfaces: it is
    /// drawn, and a record without it is a problem. While it is up, and not stuck, a surface that
    /// steps soon after the pilot does not answer him.
    pub excitation_flag: String,
    /// The pilot's controls. A surface that steps while one of them moves, or right after it has
    /// stepped, is the pilot's.
    #[serde(default)]
    pub pilot_controls: Vec<String>,
    /// Signal → the smallest change, in the signal's unit, that counts as a step. Well above noise,
    /// turbulence and feedback, well below the smallest reversal that is commanded.
    pub steps: BTreeMap<String, f64>,
    /// Pilot steps begin with a deflection from trim and end with one back to trim, each about half
    /// a reversal or less: such a step belongs to the maneuver when it is at least this share of
    /// the smallest step. It is not counted. Default 0.45.
    #[serde(default = "default_deflection")]
    pub deflection_share: f64,
    /// A step is complete within this time: a full reversal at the actuators' rate limit. Default
    /// 0.15 s.
    #[serde(default = "default_transit")]
    pub transit_s: f64,
    /// Before and after a step the level is averaged over this time. Default 0.125 s.
    #[serde(default = "default_level")]
    pub level_s: f64,
    /// A step is at least this many standard deviations of the signal's own changes, whatever its
    /// smallest step: in turbulence feedback moves the surfaces. Default 4.
    #[serde(default = "default_over_noise")]
    pub steps_over_noise: f64,
    /// Steps smaller than this share of the signal's largest in the same maneuver are feedback and
    /// not counted. Default 0.35: a deflection from trim is about half a reversal.
    #[serde(default = "default_outstanding")]
    pub outstanding_share: f64,
    /// A surface is geared to a pilot control that moves by this share of its smallest step.
    /// Default 0.35.
    #[serde(default = "default_geared")]
    pub geared_share: f64,
    /// It follows within this time, s. Default 0.4: filters and actuators.
    #[serde(default = "default_gearing")]
    pub gearing_s: f64,
    /// Feedback answers a pilot's step within this time, s. Default 1: the response's first
    /// overshoot.
    #[serde(default = "default_answer")]
    pub answer_s: f64,
    /// Two maneuvers are at least this far apart, s. Default 0.7.
    #[serde(default = "default_pause")]
    pub shortest_pause_s: f64,
    /// How long a pilot may hold a control away from trim within one maneuver: half a slow
    /// oscillation. Default 4 s.
    #[serde(default = "default_hold")]
    pub longest_hold_s: f64,
    /// How long all controls of one maneuver may rest at trim between two inputs; a longer rest
    /// ends the maneuver, and what comes after it is recovery, unless the pilot has gone over to
    /// another control of the same class. Default 2 s.
    #[serde(default = "default_rest")]
    pub longest_rest_s: f64,
    /// Where a maneuver begins before another has decayed: the share of the pause between their
    /// inputs that is the decay's at least, and of the lead-in that it may use besides. Default
    /// 0.25: the lead-in counts for more, for the inputs before a decay have told most of their
    /// derivatives already.
    #[serde(default = "default_shared")]
    pub shared_lead_in: f64,
    /// Excitation of fewer steps than this is no maneuver and not worth a word: a flag that
    /// flickers, a turn. Default 3, the edges of one doublet.
    #[serde(default = "default_fewest")]
    pub fewest_steps: usize,
    /// When a maneuver is not estimated.
    #[serde(default)]
    pub quality: quality::Limits,
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
fn default_over_noise() -> f64 {
    4.0
}
fn default_outstanding() -> f64 {
    0.35
}
fn default_geared() -> f64 {
    0.35
}
fn default_gearing() -> f64 {
    0.4
}
fn default_answer() -> f64 {
    1.0
}
fn default_pause() -> f64 {
    0.7
}
fn default_hold() -> f64 {
    4.0
}
fn default_rest() -> f64 {
    2.0
}
fn default_shared() -> f64 {
    0.25
}
fn default_fewest() -> usize {
    3
}

impl Settings {
    /// The signals that some class counts steps of and for which no smallest step is set: a mistake
    /// in the configuration, since such a class could never be recognised.
    #[must_use]
    pub fn without_smallest_step(&self, classes: &[Class]) -> BTreeSet<String> {
        let counted = classes.iter().flat_map(|c| c.recognition.counted());
        counted
            .filter(|s| !self.steps.contains_key(*s))
            .cloned()
            .collect()
    }
}

/// The maneuvers of one record in the order of their starts, excitation that fits no class, and
/// what went wrong.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Segmented {
    pub maneuvers: Vec<Maneuver>,
    pub unknown: Vec<Unknown>,
    pub problems: Vec<Problem>,
}

/// The signals that are looked at: what classes are known by, and what flight condition and quality
/// are made of. A record needs no others.
#[must_use]
pub fn signals(classes: &[Class], settings: &Settings) -> BTreeSet<String> {
    let named = classes
        .iter()
        .flat_map(|c| c.recognition.signals())
        .map(str::to_owned);
    let measured = classes
        .iter()
        .flat_map(|c| c.axis.outputs())
        .map(|o| o.signal().to_owned());
    let looked_at = settings
        .steps
        .keys()
        .chain(&settings.pilot_controls)
        .chain(settings.quality.actuators.keys());
    let condition = condition::SIGNALS.iter().map(|s| (*s).to_owned());
    named
        .chain(measured)
        .chain(condition)
        .chain(looked_at.cloned())
        .chain([settings.excitation_flag.clone()])
        .collect()
}

/// Finds the maneuvers of one record.
///
/// Excitation that fits no class or several is `unknown` and a problem; so are flags that cannot be
/// right and signals that the record lacks. The rest of the record is segmented all the same.
#[must_use]
pub fn maneuvers(
    record: &Record,
    classes: &[Class],
    aircraft: &Aircraft,
    settings: &Settings,
) -> Segmented {
    let scene = Scene::of(record, settings);
    let trains = candidates::trains(&scene, classes);
    let mut recognition = recognise::all(&scene, classes, &trains);
    recognise::keep_apart(&mut recognition);
    let recognise::Recognition { found, unknown } = recognition;
    let mut problems = recognise::problems(&scene, &unknown);
    problems.extend(lacking(record, classes, settings));
    problems.extend(stuck(record, &found));
    let windows = recognise::windows(&scene, &found);
    let mut maneuvers = Vec::new();
    for (f, window) in found.into_iter().zip(windows) {
        let at_s = f.first_s;
        match condition::maneuver(
            record,
            aircraft,
            f.class,
            window,
            Some(f.recognised),
            &settings.quality,
        ) {
            Ok(m) => maneuvers.push(m),
            Err(reason) => problems.push(problem(record, at_s, reason)),
        }
    }
    problems.sort_by(|a, b| a.place.cmp(&b.place));
    Segmented {
        maneuvers,
        unknown,
        problems,
    }
}

/// Signals that some class is recognised by and that this record has not.
fn lacking(record: &Record, classes: &[Class], settings: &Settings) -> Vec<Problem> {
    let flags: BTreeSet<&String> = classes
        .iter()
        .flat_map(|c| c.recognition.flags.keys())
        .chain([&settings.excitation_flag])
        .collect();
    let counted = classes.iter().flat_map(|c| c.recognition.counted());
    let wanted: BTreeSet<&String> = counted
        .chain(&settings.pilot_controls)
        .chain(flags.iter().copied())
        .collect();
    let lacks = |s: &&String| {
        record
            .values(s)
            .is_none_or(|v| v.iter().all(|v| !v.is_finite()))
    };
    let reason = |signal: &String| {
        if flags.contains(signal) {
            "the record has no such flag; maneuvers are recognised by their inputs alone"
        } else {
            "the record has no such signal; maneuvers of the classes that count its steps cannot be recognised"
        }
    };
    let problem = |signal: &String| Problem {
        stage: ProblemStage::Segment,
        flight_id: record.flight_id.clone(),
        place: signal.clone(),
        reason: reason(signal).into(),
    };
    wanted.into_iter().filter(lacks).map(problem).collect()
}

/// Flags that never change though two maneuvers or more say that they should.
fn stuck(record: &Record, found: &[recognise::Found]) -> Vec<Problem> {
    let flags: BTreeSet<&String> = found
        .iter()
        .flat_map(|f| f.class.recognition.flags.keys())
        .collect();
    let of = |flag: &String| -> Option<Problem> {
        let mut values = record
            .values(flag)?
            .iter()
            .filter(|v| v.is_finite())
            .map(|v| *v > 0.5);
        let always = values.next()?;
        let against = found
            .iter()
            .filter(|f| f.class.recognition.flags.get(flag) == Some(&!always))
            .count();
        let reason = format!(
            "is {} throughout, and {against} maneuvers say otherwise: it is stuck",
            if always { "up" } else { "down" }
        );
        let place = flag.clone();
        (against > 1 && values.all(|v| v == always)).then(|| Problem {
            stage: ProblemStage::Segment,
            flight_id: record.flight_id.clone(),
            place,
            reason,
        })
    };
    flags.into_iter().filter_map(of).collect()
}

/// A problem at a time of the record.
fn problem(record: &Record, at_s: f64, reason: String) -> Problem {
    Problem {
        stage: ProblemStage::Segment,
        flight_id: record.flight_id.clone(),
        place: format!("t = {at_s:.1} s"),
        reason,
    }
}
