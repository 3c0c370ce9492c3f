//! Strip chart of a whole flight.

use super::annotations::{self, SHORT_LIST, window};
use super::signal_groups::SignalGroups;
use super::signal_strips::{
    FLAG, FLIGHT_SIGNAL, LEAST_COLUMNS, MOST_COLUMNS, SignalStrips, StripStyle,
};
use crate::error::Problem;
use crate::flight::{Record, signal};
use crate::maneuver::{Maneuver, UnclassifiedExcitation};
use crate::report::figure::annotated_chart::{
    self, Chart, LABEL_PITCH, Lane, LaneBox, ShadedManeuver,
};
use crate::report::figure::strip::Strip;
use crate::report::notation::{count, fixed, number};
use crate::tables::EventRow;

/// A flight with its maneuvers, events and problems.
#[derive(Clone, Copy, Debug)]
pub struct FlightView<'a> {
    pub aircraft: &'a str,
    /// The record, or an outline of it with fewer samples.
    pub record: &'a Record,
    /// Number of samples recorded, and the step between them, s.
    pub recorded: (usize, f64),
    pub groups: &'a SignalGroups,
    pub maneuvers: &'a [Maneuver],
    /// Excitation that fits no class.
    pub unknown: &'a [UnclassifiedExcitation],
    /// The analyst's events against the recognised maneuvers; empty without a list.
    pub events: &'a [EventRow],
    pub problems: &'a [Problem],
}

/// Draws the strip chart of a flight.
#[must_use]
pub fn draw_flight(view: &FlightView) -> String {
    let record = view.record;
    let from_s = record.time_s(0);
    let to_s = record.time_s(record.samples.saturating_sub(1));
    let labels_width = LABEL_PITCH * (view.maneuvers.len() + view.unknown.len()) as f64;
    let signals = SignalStrips::new(
        record,
        (from_s, to_s),
        (from_s, to_s),
        labels_width.clamp(LEAST_COLUMNS, MOST_COLUMNS),
    );
    let (recorded, missing): (Vec<_>, Vec<_>) = flight_signals(view.groups)
        .into_iter()
        .partition(|(name, _)| record.values(name).is_some());
    let strips: Vec<Strip> = recorded
        .iter()
        .filter_map(|(name, style)| signals.strip(name, *style, &[]))
        .collect();
    let missing: Vec<&str> = missing.iter().map(|(name, _)| *name).collect();
    let maneuvers = count(view.maneuvers.len(), "maneuver");
    let duration = format!("{} to {} s", fixed(from_s, 1), fixed(to_s, 1));
    annotated_chart::draw(&Chart {
        title: format!("{}: {}", record.flight_id, view.aircraft),
        description: format!(
            "Strip chart of flight {}, {duration}, with {maneuvers} shaded.",
            record.flight_id
        ),
        heading: vec![format!(
            "{duration}, {} samples of {} s, {maneuvers}",
            view.recorded.0,
            number(Some(view.recorded.1), 3)
        )],
        legend: annotations::legend(
            &strips,
            !view.maneuvers.is_empty(),
            !view.events.is_empty(),
            false,
        ),
        time: signals.time,
        width: labels_width.max(signals.columns.count as f64),
        windows: windows(view),
        lanes: lanes(view.events),
        notes: notes(view, &missing, &strips),
        strips,
    })
}

/// Signals of a flight in the order of the chart.
pub(super) fn flight_signals(groups: &SignalGroups) -> Vec<(&str, StripStyle)> {
    use signal::{
        ALPHA_VANE, ALTITUDE, AN, AX, AY, BETA_VANE, MACH, P, PHI, PSI, Q, R, THETA, VELOCITY,
    };
    let motion = [
        ALPHA_VANE, BETA_VANE, VELOCITY, MACH, ALTITUDE, P, Q, R, THETA, PHI, PSI, AN, AX, AY,
    ];
    let inputs = groups.surfaces.iter().chain(&groups.controls);
    let continuous = motion
        .into_iter()
        .chain(inputs.map(String::as_str))
        .map(|name| (name, FLIGHT_SIGNAL));
    let flags = groups.flags.iter().map(|name| (name.as_str(), FLAG));
    continuous.chain(flags).collect()
}

/// Maneuvers and unknown excitation in order of time.
fn windows(view: &FlightView) -> Vec<ShadedManeuver> {
    let unknown = view.unknown.iter().map(|u| ShadedManeuver {
        maneuver_id: String::new(),
        class: "unknown".to_owned(),
        label: format!("unknown, nearest to {}", u.nearest_class),
        start_s: u.start_s,
        end_s: u.end_s,
    });
    let mut windows: Vec<ShadedManeuver> = view
        .maneuvers
        .iter()
        .map(|m| window(m, view.events))
        .chain(unknown)
        .collect();
    windows.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    windows
}

/// The analyst's events and the recognised maneuvers; no lanes without a list of events.
fn lanes(events: &[EventRow]) -> Vec<Lane> {
    if events.is_empty() {
        return vec![];
    }
    let interval = |class: &Option<String>, start: Option<f64>, end: Option<f64>| {
        Some(LaneBox {
            label: class.clone()?,
            start_s: start?,
            end_s: end?,
        })
    };
    let given = events
        .iter()
        .filter_map(|e| interval(&e.given_class, e.given_start_s, e.given_end_s));
    let found = events
        .iter()
        .filter_map(|e| interval(&e.found_class, e.found_start_s, e.found_end_s));
    vec![
        Lane {
            name: "given".to_owned(),
            boxes: given.collect(),
        },
        Lane {
            name: "found".to_owned(),
            boxes: found.collect(),
        },
    ]
}

fn notes(view: &FlightView, missing: &[&str], strips: &[Strip]) -> Vec<String> {
    let mut notes = annotations::notes(strips);
    notes.extend(annotations::list_signals("Not recorded", missing));
    let rejected: Vec<String> = view
        .maneuvers
        .iter()
        .filter(|m| m.is_rejected())
        .map(|m| {
            format!(
                "{} {} is rejected: {}",
                m.class, m.maneuver_id, m.quality.reason
            )
        })
        .collect();
    notes.extend(shortened(rejected, "maneuvers"));
    let problems = view
        .problems
        .iter()
        .map(|p| format!("{}, {}: {}", p.stage, p.place, p.reason))
        .collect();
    notes.extend(shortened(problems, "problems"));
    notes
}

/// The first lines, and a reference to the table that has the others.
fn shortened(mut lines: Vec<String>, table: &str) -> Vec<String> {
    let more = lines.len().saturating_sub(SHORT_LIST);
    lines.truncate(SHORT_LIST);
    if more > 0 {
        lines.push(format!("and {more} more in the table `{table}`"));
    }
    lines
}
