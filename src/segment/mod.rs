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

use crate::aircraft::Aircraft;
use crate::error::{Problem, ProblemStage};
use crate::flight::Record;
use crate::maneuver::{Class, Maneuver, Unknown};
use crate::settings::settings;
use candidates::Scene;

pub use events::with_events;
pub use steps::Step;

settings! {
    /// Settings of the search for maneuvers; times in s.
    pub struct Settings {
        /// Flag signal that is up while the on-board excitation system moves the surfaces. It is
        /// drawn, and a flight without it is listed in `problems`. A surface that steps while it is
        /// up is not taken for feedback to the pilot, unless the flag is stuck.
        pub excitation_flag: String = String::new(),
        /// Signals of the pilot's controls. A surface that steps with one of them is geared to it,
        /// one that steps right after it is feedback; neither counts as excitation by the on-board
        /// system.
        pub pilot_controls: Vec<String> = Vec::new(),
        /// Smallest change of each signal that counts as a step, in the signal's unit. Smaller:
        /// turbulence and feedback are counted as steps. Larger: small doublets are missed. Classes
        /// count steps of these signals only.
        pub steps: BTreeMap<String, f64> = BTreeMap::new(),
        /// Limits beyond which a maneuver is rejected.
        pub quality: quality::Limits = quality::Limits::default(),
    }
    expert {
        /// Smallest first and last pilot step of a maneuver, as a share of the smallest step. They
        /// deflect the control from trim and return it, by half a reversal or less. Larger: the
        /// maneuver's window may cut them off. They are never counted.
        pub deflection_share: f64 = 0.45,
        /// Longest duration of a step: a full reversal at the actuators' rate limit. Larger: slower
        /// motion counts as steps.
        pub transit_s: f64 = 0.15,
        /// Time over which the level before and after a step is averaged. Larger: less noise, and
        /// steps close together merge.
        pub level_s: f64 = 0.125,
        /// Smallest step, in standard deviations of the signal's own changes. Larger: fewer steps
        /// from feedback in turbulence, more missed edges.
        pub steps_over_noise: f64 = 4.0,
        /// Share of a signal's largest step in a maneuver below which its steps count as feedback.
        /// The default lies below a deflection from trim, about half a reversal.
        pub outstanding_share: f64 = 0.35,
        /// Smallest motion of a pilot control that gears a surface to it, as a share of the
        /// control's smallest step. Smaller: more surface steps are attributed to the pilot.
        pub geared_share: f64 = 0.35,
        /// Longest delay of a geared surface behind its control: filters and actuators. Larger: more
        /// surface steps are attributed to the pilot.
        pub gearing_s: f64 = 0.4,
        /// Time after a pilot's step in which surface steps count as feedback: the first overshoot
        /// of the response.
        pub answer_s: f64 = 1.0,
        /// Shortest pause between two maneuvers. Larger: maneuvers that follow each other closely
        /// merge.
        pub shortest_pause_s: f64 = 0.7,
        /// Longest time that a pilot holds a control away from trim within one maneuver: half a slow
        /// oscillation. Smaller: slow maneuvers come apart.
        pub longest_hold_s: f64 = 4.0,
        /// Longest rest of all controls at trim within one maneuver. A longer one ends it, and later
        /// steps are recovery, unless the pilot goes over to another control of the class.
        pub longest_rest_s: f64 = 2.0,
        /// Least share of the pause between two maneuvers that the first one's decay keeps, and of
        /// the lead-in that the second may use. Larger: longer decay, shorter lead-in. The lead-in
        /// matters more: the inputs before a decay have determined most derivatives.
        pub shared_lead_in: f64 = 0.25,
        /// Fewest steps of excitation that is reported when it fits no class. The default is the
        /// edges of one doublet. Smaller: flickering flags and turns appear in `unknown`.
        pub fewest_steps: usize = 3,
    }
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
