//! Events that the analyst gives: they replace maneuvers found, and are compared with them.

use crate::aircraft::Aircraft;
use crate::error::did_you_mean;
use crate::flight::Record;
use crate::maneuver::{Class, Event, Maneuver, UnclassifiedExcitation};
use crate::tables::{EventRow, EventVerdict};

use super::segmented::Segmented;
use super::settings::QualityLimits;
use super::{condition, problems};

/// Difference up to which starts and ends of a found maneuver and an event agree, s. It is coarse
/// enough for times read from a strip chart.
const AGREEMENT_S: f64 = 1.0;

/// Share of the shorter window above which an event replaces a maneuver, also one of the other
/// axis. Neighbouring windows share the time between them, which is less than half of either.
const REPLACING_SHARE: f64 = 0.5;

/// Replaces maneuvers by the events given for this flight, and compares the two. An event replaces a
/// maneuver if it
///
/// - covers more than half of it,
/// - lies in it by more than half, or
/// - is of its axis and has samples between its first and its last input.
///
/// An event of an unknown class, outside the record, or with samples of an earlier event of its axis
/// becomes a problem and replaces nothing. Without events for any flight there is no comparison.
#[must_use]
pub fn with_events(
    segmented: Segmented,
    record: &Record,
    events: &[Event],
    classes: &[Class],
    aircraft: &Aircraft,
    limits: &QualityLimits,
) -> (Segmented, Vec<EventRow>) {
    if events.is_empty() {
        return (segmented, Vec::new());
    }
    let Segmented {
        maneuvers: found,
        unknown,
        mut problems,
    } = segmented;
    let mut given: Vec<Maneuver> = Vec::new();
    let mut rows = Vec::new();
    for event in in_order(events, &record.flight_id) {
        let class = class_inside(event, record, classes);
        let own = class.and_then(|class| with_own_samples(event, class, &given, record.step_s));
        let window = (event.start_s, event.end_s);
        let maneuver = |class| condition::maneuver(record, aircraft, class, window, None, limits);
        match own.and_then(maneuver) {
            Ok(maneuver) => {
                rows.push(compare(Some(event), most_overlapping(event, &found)));
                given.push(maneuver);
            }
            Err(reason) => problems.push(problems::at_time(record, event.start_s, reason)),
        }
    }
    let is_explained = |u: &UnclassifiedExcitation| given.iter().any(|g| explains(g, u));
    let (explained, unknown) = unknown.into_iter().partition::<Vec<_>, _>(is_explained);
    let explained = problems::of_unknown(record, &explained);
    problems.retain(|problem| !explained.contains(problem));
    let is_replaced = |f: &Maneuver| given.iter().any(|g| replaces(g, f, record.step_s));
    let mut maneuvers = found;
    maneuvers.retain(|f| !is_replaced(f));
    rows.extend(maneuvers.iter().map(|f| compare(None, Some(f))));
    maneuvers.extend(given);
    maneuvers.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    let time_s = |r: &EventRow| r.given_start_s.or(r.found_start_s).unwrap_or(f64::INFINITY);
    rows.sort_by(|a, b| time_s(a).total_cmp(&time_s(b)));
    let segmented = Segmented {
        maneuvers,
        unknown,
        problems,
    };
    (segmented, rows)
}

/// Events of a flight by their starts, those with one start in the order of the list.
fn in_order<'a>(events: &'a [Event], flight_id: &str) -> Vec<&'a Event> {
    let own = events.iter().filter(|event| event.flight_id == flight_id);
    let mut own: Vec<&Event> = own.collect();
    own.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    own
}

/// Returns the class of an event if no earlier event has samples of it. Samples of an axis count
/// once.
///
/// # Errors
/// The event that has them, in words.
fn with_own_samples<'c>(
    event: &Event,
    class: &'c Class,
    before: &[Maneuver],
    step_s: f64,
) -> Result<&'c Class, String> {
    // Those before it share nothing, so the latest ends last. One event may begin at the sample at which another
    // ends.
    let of_axis = |other: &&Maneuver| other.axis == class.axis;
    let shares = |other: &&Maneuver| overlap_s(other, event.start_s, event.end_s) > step_s / 2.0;
    match before.iter().rev().find(of_axis).filter(shares) {
        None => Ok(class),
        Some(other) => Err(format!(
            "the event {} from {:.1} to {:.1} s has samples of the event {} from {:.1} to {:.1} s, \
             and samples count once; it is left out",
            event.class, event.start_s, event.end_s, other.class, other.start_s, other.end_s
        )),
    }
}

fn replaces(given: &Maneuver, found: &Maneuver, step_s: f64) -> bool {
    let shorter_s = (found.end_s - found.start_s).min(given.end_s - given.start_s);
    let shares_most = overlap_s(found, given.start_s, given.end_s) > REPLACING_SHARE * shorter_s;
    let inputs = (
        found.recognised.first_input_s,
        found.recognised.last_input_s,
    );
    let has_input = matches!(inputs, (Some(first_s), Some(last_s))
        if overlap_s(given, first_s, last_s) > step_s / 2.0);
    shares_most || given.axis == found.axis && has_input
}

/// `true` if the analyst's maneuver covers more than half of an excitation that fits no class.
fn explains(given: &Maneuver, unknown: &UnclassifiedExcitation) -> bool {
    let lasting_s = unknown.end_s - unknown.start_s;
    overlap_s(given, unknown.start_s, unknown.end_s) > REPLACING_SHARE * lasting_s
}

/// The class of an event inside the record.
///
/// # Errors
/// There is no such class, or the event lies outside, in words.
fn class_inside<'c>(
    event: &Event,
    record: &Record,
    classes: &'c [Class],
) -> Result<&'c Class, String> {
    let class = classes
        .iter()
        .find(|c| c.name == event.class)
        .ok_or_else(|| {
            let near = did_you_mean(&event.class, classes.iter().map(|c| c.name.as_str()));
            format!("an event is of the unknown class `{}`{near}", event.class)
        })?;
    let (first_s, last_s) = (
        record.time_s(0),
        record.time_s(record.samples.saturating_sub(1)),
    );
    // The analyst reads times from a chart: an event may reach beyond the record by as much as events
    // and maneuvers that agree may differ. It is cut at the end.
    let inside = first_s - AGREEMENT_S <= event.start_s
        && event.start_s < event.end_s.min(last_s)
        && event.end_s.max(first_s) > event.start_s
        && event.end_s <= last_s + AGREEMENT_S;
    if inside {
        return Ok(class);
    }
    let (start, end) = (event.start_s, event.end_s);
    Err(format!(
        "the event {} from {start:.1} to {end:.1} s is not inside the record, {first_s:.1} to {last_s:.1} s",
        event.class
    ))
}

fn overlap_s(m: &Maneuver, start_s: f64, end_s: f64) -> f64 {
    m.end_s.min(end_s) - m.start_s.max(start_s)
}

fn most_overlapping<'a>(event: &Event, found: &'a [Maneuver]) -> Option<&'a Maneuver> {
    let overlap = |m: &&Maneuver| overlap_s(m, event.start_s, event.end_s);
    found
        .iter()
        .filter(|m| overlap(m) > 0.0)
        .max_by(|a, b| overlap(a).total_cmp(&overlap(b)))
}

fn compare(given: Option<&Event>, found: Option<&Maneuver>) -> EventRow {
    let verdict = match (given, found) {
        (Some(_), None) => EventVerdict::NotFound,
        (None, _) => EventVerdict::NotGiven,
        (Some(g), Some(f)) if g.class != f.class => EventVerdict::OtherClass,
        (Some(g), Some(f)) => {
            let apart_s = (g.start_s - f.start_s).abs().max((g.end_s - f.end_s).abs());
            if apart_s <= AGREEMENT_S {
                EventVerdict::Agrees
            } else {
                EventVerdict::OtherTimes
            }
        }
    };
    EventRow {
        flight_id: given
            .map(|g| &g.flight_id)
            .or(found.map(|f| &f.flight_id))
            .cloned()
            .unwrap_or_default(),
        given_class: given.map(|g| g.class.clone()),
        given_start_s: given.map(|g| g.start_s),
        given_end_s: given.map(|g| g.end_s),
        found_class: found.map(|f| f.class.clone()),
        found_start_s: found.map(|f| f.start_s),
        found_end_s: found.map(|f| f.end_s),
        verdict,
    }
}
