//! Search for maneuvers in windows of a long record.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::config::Config;
use crate::error::{Problem, Result};
use crate::maneuver::{Event, Maneuver, UnclassifiedExcitation};
use crate::segment::{self, Segmented};
use crate::store::record_file::{RecordFile, RecordHeader};
use crate::tables::EventRow;

/// Samples of a window: an hour at 36 Hz. A record up to half as long again is one window.
const WINDOW: usize = 1 << 17;

/// Time that a window searches beyond its own samples on either side, s: longer than any maneuver
/// with its lead-in and decay.
const SURROUNDINGS_S: f64 = 180.0;

/// Shortest time between an event and the end of a window, s.
const EVENT_S: f64 = 10.0;

/// Artefact of segment: the maneuvers of a stretch.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct FoundManeuvers {
    pub maneuvers: Vec<Maneuver>,
    /// Excitation that fits no class.
    pub unknown: Vec<UnclassifiedExcitation>,
    pub events: Vec<EventRow>,
    pub problems: Vec<Problem>,
}

/// Finds the maneuvers of a record, window by window if it is long.
///
/// # Errors
/// [`crate::error::Error::Io`] or [`crate::error::Error::Store`] naming the record.
pub fn find_maneuvers(
    config: &Config,
    file: &RecordFile,
    events: &[Event],
) -> Result<FoundManeuvers> {
    let ends = window_ends(&file.header, surroundings(&file.header), events);
    let starts = std::iter::once(0).chain(ends.iter().copied());
    let windows: Vec<Range<usize>> = starts.zip(&ends).map(|(from, to)| from..*to).collect();
    let found: Result<Vec<FoundManeuvers>> = windows
        .into_par_iter()
        .map(|own| find_in_window(config, file, events, own))
        .collect();
    let mut all = FoundManeuvers::default();
    for found in found? {
        all.maneuvers.extend(found.maneuvers);
        all.unknown.extend(found.unknown);
        all.events.extend(found.events);
        all.problems.extend(found.problems);
    }
    // A problem of the whole record appears in every window.
    let mut seen = BTreeSet::new();
    all.problems
        .retain(|p| seen.insert((p.place.clone(), p.reason.clone())));
    number_ids(&mut all.maneuvers);
    Ok(all)
}

/// Numbers the ids of maneuvers that begin in one second: `f_t00118`, `f_t00118.2`.
fn number_ids(maneuvers: &mut [Maneuver]) {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for maneuver in maneuvers {
        let count = counts.entry(maneuver.maneuver_id.clone()).or_default();
        *count += 1;
        if *count > 1 {
            maneuver.maneuver_id = format!("{}.{count}", maneuver.maneuver_id);
        }
    }
}

/// Finds the maneuvers that begin in a range of a record's samples.
fn find_in_window(
    config: &Config,
    file: &RecordFile,
    events: &[Event],
    samples: Range<usize>,
) -> Result<FoundManeuvers> {
    let header = &file.header;
    let signals = segment::signals(&config.classes, &config.segment);
    let beyond = surroundings(header);
    let record = file.window(
        Some(&signals),
        samples.start.saturating_sub(beyond)..samples.end + beyond,
    )?;
    let time_s = |sample: usize| header.start_s + sample as f64 * header.step_s;
    let (is_first, is_last) = (samples.start == 0, samples.end >= header.samples);
    let (start_s, end_s) = (time_s(samples.start), time_s(samples.end));
    let begins_here = |t: f64| (is_first || t >= start_s) && (is_last || t < end_s);
    let mut found = segment::maneuvers(&record, &config.classes, &config.aircraft, &config.segment);
    found.maneuvers.retain(|m| begins_here(m.start_s));
    found.unknown.retain(|u| begins_here(u.start_s));
    found
        .problems
        .retain(|p| stated_time_s(p).is_none_or(begins_here));
    let mut events = events.to_vec();
    events.retain(|event| begins_here(event.start_s));
    let (found, events) = segment::with_events(
        found,
        &record,
        &events,
        &config.classes,
        &config.aircraft,
        &config.segment.quality,
    );
    let Segmented {
        maneuvers,
        unknown,
        problems,
    } = found;
    Ok(FoundManeuvers {
        maneuvers,
        unknown,
        events,
        problems,
    })
}

/// Number of samples that a window searches beyond its own on either side.
fn surroundings(header: &RecordHeader) -> usize {
    samples(SURROUNDINGS_S, header.step_s)
}

/// Number of samples that contain a time, at least one.
fn samples(time_s: f64, step_s: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a length of time, not negative"
    )]
    let samples = (time_s / step_s).ceil().max(1.0) as usize;
    samples
}

/// Ends of a record's windows, samples. No window ends at an event.
fn window_ends(header: &RecordHeader, beyond: usize, events: &[Event]) -> Vec<usize> {
    let window = WINDOW.max(4 * beyond);
    let mut ends = Vec::new();
    let mut end = window;
    while end + window / 2 < header.samples {
        let time_s = header.start_s + end as f64 * header.step_s;
        let at = |e: &&Event| e.start_s - EVENT_S <= time_s && time_s <= e.end_s + EVENT_S;
        if let Some(event) = events.iter().find(at) {
            end = samples(event.end_s + EVENT_S - header.start_s, header.step_s) + 1;
        } else {
            ends.push(end);
            end += window;
        }
    }
    ends.push(header.samples);
    ends
}

/// Time that a problem of segment states as its place, s.
fn stated_time_s(problem: &Problem) -> Option<f64> {
    problem
        .place
        .strip_prefix("t = ")?
        .strip_suffix(" s")?
        .parse()
        .ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(samples: usize) -> RecordHeader {
        RecordHeader {
            flight_id: "f".to_owned(),
            start_s: 5.0,
            step_s: 0.025,
            samples,
            ..RecordHeader::default()
        }
    }

    fn event(start_s: f64, end_s: f64) -> Event {
        Event {
            flight_id: "f".to_owned(),
            class: "C".to_owned(),
            start_s,
            end_s,
        }
    }

    #[test]
    fn ten_hours_are_several_windows_and_one_hour_is_one() {
        let beyond = samples(SURROUNDINGS_S, 0.025);
        assert_eq!(window_ends(&header(144_000), beyond, &[]), [144_000]);
        let ends = window_ends(&header(1_440_000), beyond, &[]);
        assert_eq!(
            (ends.len(), ends[0], *ends.last().unwrap()),
            (11, WINDOW, 1_440_000)
        );
    }

    #[test]
    fn no_window_ends_at_an_event() {
        let at_s = 5.0 + WINDOW as f64 * 0.025;
        let ends = window_ends(&header(1_440_000), 7200, &[event(at_s - 3.0, at_s + 20.0)]);
        let end_s = 5.0 + ends[0] as f64 * 0.025;
        assert!((at_s + 30.0..at_s + 30.2).contains(&end_s), "{end_s}");
    }
}
