//! Labels, legend and notes of strip charts.

use crate::maneuver::Maneuver;
use crate::report::figure::annotated_chart::{Key, ShadedManeuver};
use crate::report::figure::strip::{FlaggedSpans, Strip};
use crate::report::figure::style::{INK, MEASURED_COLOUR};
use crate::report::notation::without_unit;
use crate::tables::{EventRow, EventVerdict};

/// Number of lines that a list of reasons under the chart has; the tables have all.
pub const SHORT_LIST: usize = 8;

/// Largest difference between the starts of an event and the maneuver it names, s.
const SAME_START_S: f64 = 1.0;

/// A maneuver as a shaded window, labelled with the verdict on the analyst's event unless they
/// agree.
pub fn window(maneuver: &Maneuver, events: &[EventRow]) -> ShadedManeuver {
    let event = events.iter().find(|event| {
        event.given_class.as_ref() == Some(&maneuver.class)
            && event
                .given_start_s
                .is_some_and(|s| (s - maneuver.start_s).abs() < SAME_START_S)
    });
    let mut label = format!("{} {}", maneuver.class, maneuver.maneuver_id);
    if maneuver.is_rejected() {
        label += ", rejected";
    }
    if let Some(event) = event.filter(|event| event.verdict != EventVerdict::Agrees) {
        label = format!("{label}, {}", event.verdict);
    }
    ShadedManeuver {
        maneuver_id: maneuver.maneuver_id.clone(),
        class: maneuver.class.clone(),
        label,
        start_s: maneuver.start_s,
        end_s: maneuver.end_s,
    }
}

/// Legend of what occurs in the chart.
pub fn legend(
    strips: &[Strip],
    has_windows: bool,
    has_events: bool,
    has_response: bool,
) -> Vec<(Key, String)> {
    let has = |spans: fn(&FlaggedSpans) -> &Vec<(f64, f64)>| {
        strips.iter().any(|s| !spans(&s.flagged).is_empty())
    };
    let entries = [
        (has_windows, Key::Maneuver, "maneuver"),
        (
            has_events,
            Key::Event,
            "event given by the analyst, or maneuver found",
        ),
        (has_response, Key::Line(MEASURED_COLOUR, 2.6), "measured"),
        (has_response, Key::Line(INK, 1.1), "computed; residual"),
        (
            strips.iter().any(|s| !s.dots.is_empty()),
            Key::Excluded,
            "left out of the cost",
        ),
        (has(|f| &f.bridged), Key::Bridged, "bridged"),
        (has(|f| &f.despiked), Key::Despiked, "spike replaced"),
        (has(|f| &f.missing), Key::Missing, "missing"),
    ];
    entries
        .into_iter()
        .filter(|(occurs, _, _)| *occurs)
        .map(|(_, key, word)| (key, word.to_owned()))
        .collect()
}

/// Notes that every chart has.
pub fn notes(strips: &[Strip]) -> Vec<String> {
    let mut notes = vec![
        "Times on the record's clock. A line passes through the smallest and the largest sample of \
         each column of the picture."
            .to_owned(),
    ];
    let empty: Vec<&str> = strips
        .iter()
        .filter(|s| s.lines.iter().all(|line| line.pieces.is_empty()))
        .map(|s| s.name.as_str())
        .collect();
    notes.extend(list_signals("Without a sample", &empty));
    notes
}

/// A note that lists signals; `None` without any.
pub fn list_signals(reason: &str, names: &[&str]) -> Option<String> {
    let names: Vec<&str> = names.iter().map(|name| without_unit(name)).collect();
    (!names.is_empty()).then(|| format!("{reason}: {}.", names.join(", ")))
}
