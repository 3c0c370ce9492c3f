//! Strip chart of one maneuver: inputs, outputs measured and computed, residuals.

use std::fmt::Write;

use super::annotations::{self, window};
use super::signal_groups::SignalGroups;
use super::signal_strips::{FLAG, INPUT, LEAST_COLUMNS, SignalStrips};
use crate::flight::Record;
use crate::maneuver::{Class, Maneuver};
use crate::report::figure::annotated_chart::{self, Chart, ShadedManeuver};
use crate::report::figure::scale::extent;
use crate::report::figure::strip::Strip;
use crate::report::notation::{angle, fixed, number, outcome_in_words};
use crate::tables::{FitRow, History};
use crate::units::Unit;

/// Time shown before and after a maneuver, s: the trimmed flight that it starts from, and the decay
/// after it.
const AROUND_S: f64 = 4.0;
/// Share of an input's smallest step below which its movement is not drawn.
const SMALLEST_SHARE_OF_STEP: f64 = 0.5;
/// Share of the largest movement in the same unit below which an input without a smallest step is
/// not drawn.
const SMALLEST_SHARE_OF_LARGEST: f64 = 0.1;

/// A maneuver with its estimation.
#[derive(Clone, Copy, Debug)]
pub struct ManeuverView<'a> {
    pub aircraft: &'a str,
    pub record: &'a Record,
    pub groups: &'a SignalGroups,
    pub maneuver: &'a Maneuver,
    pub class: Option<&'a Class>,
    /// All maneuvers of the flight: neighbours may reach into the picture.
    pub flight: &'a [Maneuver],
    pub fit: &'a FitRow,
    /// Measured and computed response; `None` if it was not estimated.
    pub history: Option<&'a History>,
}

/// Draws the strip chart of a maneuver with a few seconds before and after it.
#[must_use]
pub fn draw_maneuver(view: &ManeuverView) -> String {
    let maneuver = view.maneuver;
    let part = view
        .record
        .part(maneuver.start_s - AROUND_S, maneuver.end_s + AROUND_S);
    let first_s = (maneuver.start_s - AROUND_S).max(part.start_s);
    let last_s = (maneuver.end_s + AROUND_S).min(part.time_s(part.samples.saturating_sub(1)));
    let signals = SignalStrips::new(
        &part,
        (first_s, last_s),
        (maneuver.start_s, maneuver.end_s),
        LEAST_COLUMNS,
    );
    let (moved, resting) = inputs_by_motion(&signals, view.groups);
    let strips = strips(view, &signals, &moved);
    let mut notes = annotations::notes(&strips);
    notes.extend(annotations::list_signals(
        "Not drawn, for they hardly moved",
        &resting,
    ));
    notes.push(
        "Scales fit the maneuver: a line that leaves its strip before or after it is cut there."
            .to_owned(),
    );
    let windows: Vec<ShadedManeuver> = view
        .flight
        .iter()
        .filter(|m| m.start_s < last_s && m.end_s > first_s)
        .map(|m| window(m, &[]))
        .collect();
    annotated_chart::draw(&Chart {
        title: title(view),
        description: alternative_text(view),
        heading: heading(view),
        legend: annotations::legend(&strips, true, false, view.history.is_some()),
        time: signals.time,
        width: signals.columns.count as f64,
        windows,
        lanes: vec![],
        notes,
        strips,
    })
}

/// Inputs that moved, outputs with residuals, flags.
fn strips(view: &ManeuverView, signals: &SignalStrips, inputs: &[&str]) -> Vec<Strip> {
    let mut strips: Vec<Strip> = inputs
        .iter()
        .filter_map(|name| signals.strip(name, INPUT, &[]))
        .collect();
    for output in view.maneuver.axis.outputs() {
        let response = view.history.and_then(|history| {
            let mut outputs = history.outputs.iter();
            Some((history, outputs.find(|o| o.label == output.signal())?))
        });
        strips.extend(signals.output(output.signal(), response));
    }
    let flags = view.groups.flags.iter();
    strips.extend(flags.filter_map(|name| signals.strip(name, FLAG, &[])));
    strips
}

fn alternative_text(view: &ManeuverView) -> String {
    format!(
        "Strip chart of maneuver {} of class {}: inputs, outputs {}.",
        view.maneuver.maneuver_id,
        view.maneuver.class,
        if view.history.is_some() {
            "measured and computed, residuals"
        } else {
            "as measured; it was not estimated"
        }
    )
}

fn title(view: &ManeuverView) -> String {
    let m = view.maneuver;
    let class = view
        .class
        .map_or_else(String::new, |c| format!(", {}", c.title));
    format!("{}: {}{class}", m.maneuver_id, m.class)
}

/// Flight condition, and outcome of the fit.
fn heading(view: &ManeuverView) -> Vec<String> {
    let (m, fit) = (view.maneuver, view.fit);
    let condition = format!(
        "{}, {}, {} to {} s ({}): α {}, Mach {}, q\u{304} {} psf, {} ft/s, {} ft",
        view.aircraft,
        m.flight_id,
        fixed(m.start_s, 1),
        fixed(m.end_s, 1),
        m.origin,
        angle(m.alpha_deg),
        fixed(m.mach, 3),
        fixed(m.qbar_psf, 1),
        fixed(m.velocity_ft_s, 0),
        fixed(m.altitude_ft, 0),
    );
    let mut outcome = format!("{}: {}", outcome_in_words(fit.outcome), fit.reason);
    if let (Some(first), Some(last)) = (fit.initial_cost, fit.final_cost) {
        // Writing into a String cannot fail.
        let _ = write!(
            outcome,
            "; {} iterations, J from {} to {}",
            fit.iterations,
            number(Some(first), 4),
            number(Some(last), 4)
        );
    }
    if let Some(share) = fit.left_out {
        let _ = write!(
            outcome,
            "; {} % of the output samples left out",
            fixed(100.0 * share, 2)
        );
    }
    vec![condition, outcome]
}

/// Surfaces and pilot controls that moved during the maneuver, and those that hardly did.
fn inputs_by_motion<'a>(
    signals: &SignalStrips,
    groups: &'a SignalGroups,
) -> (Vec<&'a str>, Vec<&'a str>) {
    let ranges: Vec<(&str, f64)> = groups
        .controls
        .iter()
        .chain(&groups.surfaces)
        .filter(|name| signals.record.values(name).is_some())
        .map(|name| {
            let (low, high) = extent(signals.within_core(name)).unwrap_or_default();
            (name.as_str(), high - low)
        })
        .collect();
    let has_moved = |(name, range): &(&str, f64)| *range > least_motion(name, &ranges, groups);
    let (moved, resting): (Vec<_>, Vec<_>) = ranges.iter().partition(|input| has_moved(input));
    let names = |inputs: Vec<(&'a str, f64)>| inputs.into_iter().map(|(name, _)| name).collect();
    (names(moved), names(resting))
}

/// Motion below which an input is not drawn.
fn least_motion(name: &str, ranges: &[(&str, f64)], groups: &SignalGroups) -> f64 {
    if let Some(step) = groups.steps.get(name) {
        return SMALLEST_SHARE_OF_STEP * step;
    }
    let unit = Unit::of_signal(name);
    let largest = ranges
        .iter()
        .filter(|(other, _)| Unit::of_signal(other) == unit)
        .map(|(_, range)| *range)
        .fold(0.0, f64::max);
    SMALLEST_SHARE_OF_LARGEST * largest
}
