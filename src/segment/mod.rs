//! Segment finds the maneuvers of a record and their classes, measures their quality, and compares
//! them with the analyst's events.
//!
//! The evidence is steps: fast, lasting changes of a surface or of a pilot control ([`steps`]).
//! Steps do not depend on a surface's trim, and ordinary flying moves surfaces smoothly or singly.
//! [`recognition`] forms sequences of two kinds: uncommanded steps of surfaces while the pilot's
//! controls rest, and steps of pilot controls. It cuts a sequence at its pauses into segments that
//! fit the recognition of a class: counts of steps, lengths of pulses, signals that move. Sweeps are
//! found by their swings. Flags are evidence among others: they may be missing, stuck or late.
//! Excitation that fits no class is `unknown`, with the reason. A maneuver whose [`quality`] is
//! beyond a limit is rejected.

mod absent_signals;
mod condition;
mod events;
mod noisy_controls;
mod problems;
mod quality;
mod recognition;
mod segmented;
mod settings;
mod steps;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use crate::aircraft::Aircraft;
use crate::flight::Record;
use crate::maneuver::{Acceptance, Class, Maneuver};
use noisy_controls::{control_noise, without_noisy_controls};
use recognition::detections::Detections;
use recognition::found::FoundManeuver;
use recognition::overlaps::without_overlaps;
use recognition::recognise::recognise;
use recognition::stand_ins::with_surfaces_for_controls;
use recognition::unclassified::nothing_found;
use recognition::windows::windows;

pub use absent_signals::absent_signals;
pub use events::with_events;
pub use segmented::Segmented;
pub use settings::{Actuator, QualityLimits, Settings};

/// Names of the signals that segment needs: those of the classes' recognition, of the flight
/// condition, and of the quality.
#[must_use]
pub fn signals(classes: &[Class], settings: &Settings) -> BTreeSet<String> {
    let recognised_by = classes.iter().flat_map(|c| c.recognition.signals());
    let set = settings
        .steps
        .keys()
        .chain(&settings.pilot_controls)
        .chain(settings.quality.actuators.keys())
        .chain([&settings.excitation_flag])
        .map(String::as_str);
    let mut signals: BTreeSet<String> = recognised_by
        .chain(set)
        .chain(condition::SIGNALS.iter().copied())
        .map(str::to_owned)
        .collect();
    let outputs = classes.iter().flat_map(|c| c.axis.outputs());
    signals.extend(outputs.map(|output| output.signal().to_owned()));
    signals
}

/// Reason for which a maneuver is rejected, by its quality or because its condition cannot be computed.
fn rejection_of(maneuver: Result<Maneuver, String>) -> Option<String> {
    match maneuver.map(|maneuver| maneuver.quality) {
        Ok(quality) if quality.verdict == Acceptance::Accepted => None,
        Ok(quality) => Some(quality.reason),
        Err(reason) => Some(reason),
    }
}

/// Finds the maneuvers of one record.
///
/// Excitation that fits no class or several is `unknown` and a problem. Stuck flags and signals
/// that the record lacks are problems; the rest of the record is segmented all the same.
#[must_use]
pub fn maneuvers(
    record: &Record,
    classes: &[Class],
    aircraft: &Aircraft,
    settings: &Settings,
) -> Segmented {
    let mut problems = problems::of_missing_signals(record, classes, settings);
    let control_noise = control_noise(record, settings);
    let (record, of_noise) = without_noisy_controls(record, settings, &control_noise);
    problems.extend(of_noise);
    let record = record.as_ref();
    let detections = Detections::of(record, settings, &control_noise);
    let recognised_as = with_surfaces_for_controls(record, classes, settings);
    let recognition = recognise(&detections, &recognised_as);
    let maneuver = |found: &FoundManeuver, window: (f64, f64)| {
        let recognised = Some(found.recognised.clone());
        let limits = &settings.quality;
        condition::maneuver(record, aircraft, found.class, window, recognised, limits)
    };
    let rejection = |found: &FoundManeuver| {
        let alone = windows(&detections, std::slice::from_ref(found));
        rejection_of(maneuver(found, *alone.first()?))
    };
    let mut recognition = without_overlaps(&detections, recognition, rejection);
    recognition
        .unknown
        .extend(nothing_found(&detections, &recognition));
    let windows = windows(&detections, &recognition.found);
    problems.extend(problems::of_unknown(record, &recognition.unknown));
    problems.extend(problems::of_stuck_flags(record, &recognition.found));
    let mut maneuvers = Vec::new();
    for (found, window) in recognition.found.iter().zip(windows) {
        match maneuver(found, window) {
            Ok(maneuver) => maneuvers.push(maneuver),
            Err(reason) => problems.push(problems::at_time(record, found.first_s, reason)),
        }
    }
    problems.sort_by(|a, b| a.place.cmp(&b.place));
    Segmented {
        maneuvers,
        unknown: recognition.unknown,
        problems,
    }
}
