//! Stretches of flights on their way through segment: their events, the windows in which a long
//! record is looked at, and rows that two flights have in common.

use std::collections::BTreeSet;
use std::ops::Range;

use rayon::prelude::*;

use super::{Campaign, Flight, Found, problem};
use crate::config::Config;
use crate::error::{Problem, ProblemStage, Result};
use crate::flight::is_stretch;
use crate::maneuver::{Event, Maneuver};
use crate::segment::{self, Segmented};
use crate::store::Store;
use crate::store::record_file::{self, About, RecordFile};

/// A flight of which this share is another's rows is the other under another name.
const COPY: f64 = 0.9;

/// The samples of a long record that are segmented at once: an hour of a usual recorder. A record
/// that is hardly longer is taken whole.
const WINDOW: usize = 1 << 17;

/// What a window sees beyond its own on either side, s: longer than any maneuver with its lead-in
/// and decay.
const SURROUNDINGS_S: f64 = 180.0;

/// How far from an event no window ends, s.
const EVENT_S: f64 = 10.0;

impl Flight {
    /// Its record, corrected by what its instruments are off by.
    pub(crate) fn open(&self, store: &Store) -> Result<RecordFile> {
        store.fetch(&self.record, self.ingested.record.as_ref())?;
        Ok(record_file::open(&self.record)?.corrected(self.ingested.corrections.clone()))
    }

    /// Whether this is a stretch of a flight, or the flight itself.
    pub(crate) fn is_of(&self, flight_id: &str) -> bool {
        is_stretch(&self.flight_id, flight_id)
    }

    /// The analyst's events in this stretch: those that name it, and those of its flight that lie
    /// in its time.
    pub(crate) fn events(&self, events: &[Event], about: &About) -> Vec<Event> {
        let end_s = about.start_s + about.samples as f64 * about.step_s;
        let inside = |e: &Event| e.start_s < end_s && e.end_s > about.start_s;
        let own =
            |e: &&Event| e.flight_id == self.flight_id || (self.is_of(&e.flight_id) && inside(e));
        let named = |e: &Event| Event {
            flight_id: self.flight_id.clone(),
            ..e.clone()
        };
        events.iter().filter(own).map(named).collect()
    }
}

/// Refuses flights whose rows are another's, and says which rows two flights have in common.
pub(crate) fn same_rows(campaign: &mut Campaign) {
    for later in 1..campaign.flights.len() {
        let (before, rest) = campaign.flights.split_at_mut(later);
        let Some(flight) = rest.first_mut().filter(|f| f.ingested.accepted) else {
            continue;
        };
        for other in before.iter().filter(|f| f.ingested.accepted) {
            let Some((from_s, to_s, share)) =
                flight.ingested.signature.common(&other.ingested.signature)
            else {
                continue;
            };
            let id = flight.flight_id.clone();
            if share >= COPY {
                let reason = format!(
                    "it holds the rows of flight `{}` again; it is left out",
                    other.flight_id
                );
                flight.ingested =
                    super::Ingested::refused(problem(ProblemStage::Ingest, &id, &id, &reason));
                break;
            }
            let reason = format!(
                "from about {from_s:.0} s to {to_s:.0} s it holds rows that flight `{}` has, too; maneuvers there are \
                 taken from that one",
                other.flight_id
            );
            flight
                .ingested
                .problems
                .push(problem(ProblemStage::Ingest, &id, &id, &reason));
            campaign.again.push((id, from_s, to_s));
        }
    }
}

/// Leaves out maneuvers in rows that an earlier flight has, too.
pub(crate) fn leave_out_same(campaign: &mut Campaign) {
    // What lies between two full ten seconds, and its surroundings, is the same as well.
    let beyond_s = 10.0;
    let Campaign {
        maneuvers,
        again,
        problems,
        ..
    } = campaign;
    let is_again = |m: &Maneuver| {
        let inside = |(id, from_s, to_s): &(String, f64, f64)| {
            *id == m.flight_id && m.start_s >= from_s - beyond_s && m.end_s <= to_s + beyond_s
        };
        again.iter().any(inside)
    };
    for m in maneuvers.iter().filter(|m| is_again(m)) {
        let reason = "an earlier flight holds the same rows; it is left out";
        problems.push(problem(
            ProblemStage::Segment,
            &m.flight_id,
            &m.maneuver_id,
            reason,
        ));
    }
    maneuvers.retain(|m| !is_again(m));
}

/// The maneuvers of a record, window by window where it is long.
pub(crate) fn segmented(config: &Config, file: &RecordFile, events: &[Event]) -> Result<Found> {
    let ends = window_ends(&file.about, surroundings(&file.about), events);
    let starts = std::iter::once(0).chain(ends.iter().copied());
    let windows: Vec<Range<usize>> = starts.zip(&ends).map(|(from, to)| from..*to).collect();
    let found: Result<Vec<Found>> = windows
        .into_par_iter()
        .map(|own| in_window(config, file, events, own))
        .collect();
    let mut all = Found::default();
    for found in found? {
        all.maneuvers.extend(found.maneuvers);
        all.unknown.extend(found.unknown);
        all.events.extend(found.events);
        all.problems.extend(found.problems);
    }
    // What concerns the whole record is said in every window.
    let mut said = BTreeSet::new();
    all.problems
        .retain(|p| said.insert((p.place.clone(), p.reason.clone())));
    Ok(all)
}

/// The maneuvers that begin in a range of a record's samples.
fn in_window(
    config: &Config,
    file: &RecordFile,
    events: &[Event],
    samples: Range<usize>,
) -> Result<Found> {
    let about = &file.about;
    let signals = segment::signals(&config.classes, &config.segment);
    let beyond = surroundings(about);
    let record = file.window(
        Some(&signals),
        samples.start.saturating_sub(beyond)..samples.end + beyond,
    )?;
    let time_s = |sample: usize| about.start_s + sample as f64 * about.step_s;
    let (first, last) = (samples.start == 0, samples.end >= about.samples);
    let own = |t: f64| (first || t >= time_s(samples.start)) && (last || t < time_s(samples.end));
    let mut found = segment::maneuvers(&record, &config.classes, &config.aircraft, &config.segment);
    found.maneuvers.retain(|m| own(m.start_s));
    found.unknown.retain(|u| own(u.start_s));
    found.problems.retain(|p| said_at(p).is_none_or(own));
    let events: Vec<Event> = events.iter().filter(|e| own(e.start_s)).cloned().collect();
    let limits = &config.segment.quality;
    let (found, events) = segment::with_events(
        found,
        &record,
        &events,
        &config.classes,
        &config.aircraft,
        limits,
    );
    let Segmented {
        maneuvers,
        unknown,
        problems,
    } = found;
    Ok(Found {
        maneuvers,
        unknown,
        events,
        problems,
    })
}

/// The samples that a window sees beyond its own on either side.
fn surroundings(about: &About) -> usize {
    samples(SURROUNDINGS_S, about.step_s)
}

fn samples(time_s: f64, step_s: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a length of time, not negative"
    )]
    let samples = (time_s / step_s).ceil().max(1.0) as usize;
    samples
}

/// Where the windows of a record end; none ends at an event.
fn window_ends(about: &About, beyond: usize, events: &[Event]) -> Vec<usize> {
    let window = WINDOW.max(4 * beyond);
    let mut ends = Vec::new();
    let mut end = window;
    while end + window / 2 < about.samples {
        let time_s = about.start_s + end as f64 * about.step_s;
        let at = |e: &&Event| e.start_s - EVENT_S <= time_s && time_s <= e.end_s + EVENT_S;
        if let Some(event) = events.iter().find(at) {
            end = samples(event.end_s + EVENT_S - about.start_s, about.step_s) + 1;
        } else {
            ends.push(end);
            end += window;
        }
    }
    ends.push(about.samples);
    ends
}

/// The time that a problem of segment names, s.
fn said_at(problem: &Problem) -> Option<f64> {
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

    fn about(samples: usize) -> About {
        About {
            flight_id: "f".to_owned(),
            start_s: 5.0,
            step_s: 0.025,
            samples,
            ..About::default()
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
    fn a_flight_of_ten_hours_has_windows_and_one_of_an_hour_is_whole() {
        let beyond = samples(SURROUNDINGS_S, 0.025);
        assert_eq!(window_ends(&about(144_000), beyond, &[]), [144_000]);
        let ends = window_ends(&about(1_440_000), beyond, &[]);
        assert_eq!(
            (ends.len(), ends[0], *ends.last().unwrap()),
            (11, WINDOW, 1_440_000)
        );
    }

    #[test]
    fn no_window_ends_at_an_event() {
        let at_s = 5.0 + WINDOW as f64 * 0.025;
        let ends = window_ends(&about(1_440_000), 7200, &[event(at_s - 3.0, at_s + 20.0)]);
        let end_s = 5.0 + ends[0] as f64 * 0.025;
        assert!((at_s + 30.0..at_s + 30.2).contains(&end_s), "{end_s}");
    }

    #[test]
    fn events_of_a_flight_are_its_stretches_where_they_lie() {
        let flight = |flight_id: &str| Flight {
            flight_id: flight_id.to_owned(),
            fingerprint: String::new(),
            record: std::path::PathBuf::new(),
            ingested: super::super::Ingested::refused(problem(ProblemStage::Ingest, "", "", "")),
        };
        assert!(flight("f").is_of("f") && flight("f.2").is_of("f"));
        assert!(
            !flight("f.nav").is_of("f") && !flight("f2").is_of("f") && !flight("f").is_of("f.2")
        );
        let events = [
            event(10.0, 20.0),
            Event {
                flight_id: "f.2".to_owned(),
                ..event(10.0, 20.0)
            },
        ];
        assert_eq!(flight("f").events(&events, &about(4000)).len(), 1);
        assert_eq!(flight("f.2").events(&events, &about(4000)).len(), 2);
        assert_eq!(flight("f.2").events(&events, &about(40)).len(), 1);
    }
}
