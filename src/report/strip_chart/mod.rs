//! Strip charts: a whole flight with its maneuvers, and one maneuver measured against computed,
//! each as an SVG file.

mod envelope;

use std::collections::BTreeMap;
use std::fmt::Write;

use super::figure::annotated_chart::{
    self, Chart, Key, Lane, LaneBox, Marks, PITCH, Strip, Trace, Window,
};
use super::figure::scale::{Scale, extent};
use super::figure::style::{INK, MEASURED_COLOUR};
use super::notation::{angle, fixed, number, outcome_in_words, without_unit};
use crate::error::Problem;
use crate::flight::{Mark, Record, signal};
use crate::maneuver::{Class, Maneuver, Unknown};
use crate::tables::{EventRow, EventVerdict, FitRow, History, HistoryOutput};
use crate::units::Unit;
use envelope::{Columns, Shown, envelope, runs};

/// So many columns a chart has at least and at most: pixels of a screen, dots of a page.
const COLUMNS: (f64, f64) = (760.0, 1000.0);
/// How a signal is drawn.
#[derive(Clone, Copy, Debug)]
struct Look {
    height: f64,
    /// About so many steps of its scale.
    steps: f64,
    colour: &'static str,
    width: f64,
}

const OF_FLIGHT: Look = Look {
    height: 50.0,
    steps: 2.0,
    colour: INK,
    width: 0.9,
};
const INPUT: Look = Look {
    width: 1.1,
    ..OF_FLIGHT
};
const FLAG: Look = Look {
    height: 20.0,
    ..INPUT
};
const ALONE: Look = Look {
    height: 72.0,
    steps: 3.0,
    ..INPUT
};
/// Wide, so that it is seen behind what was computed.
const MEASURED: Look = Look {
    colour: MEASURED_COLOUR,
    width: 2.6,
    ..ALONE
};
const RESIDUAL: Look = Look {
    height: 40.0,
    steps: 1.6,
    colour: INK,
    width: 0.8,
};
/// By what share of its range within the maneuver a scale grows for what lies before, after and in
/// what was computed: the recovery from a maneuver, and a response that diverges, would flatten it.
const STRETCH: f64 = 0.5;
/// What is shown before and after a maneuver, s: the trimmed flight it starts from, and whether it
/// was at rest when it was cut.
const AROUND_S: f64 = 4.0;
/// An input that moves less than this share of its smallest step is not drawn.
const HARDLY: f64 = 0.5;
/// One without a smallest step: less than this share of what moves most in the same unit.
const HARDLY_BESIDE: f64 = 0.1;
/// More reasons than this are left to the table `problems`.
const MOST_PROBLEMS: usize = 8;

/// What the signals are that the analyst named.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Groups {
    pub surfaces: Vec<String>,
    /// Of the pilot.
    pub controls: Vec<String>,
    pub flags: Vec<String>,
    /// The smallest change that counts as a step, in the signal's unit, where one is set.
    pub steps: BTreeMap<String, f64>,
}

/// A flight with what was found in it.
#[derive(Clone, Copy, Debug)]
pub struct FlightView<'a> {
    pub aircraft: &'a str,
    pub record: &'a Record,
    /// How many samples were recorded and the step between them, s: the record at hand may be an
    /// outline.
    pub recorded: (usize, f64),
    pub groups: &'a Groups,
    pub maneuvers: &'a [Maneuver],
    /// Excitation that fits no class.
    pub unknown: &'a [Unknown],
    /// The analyst's list against what was found; empty without a list.
    pub events: &'a [EventRow],
    pub problems: &'a [Problem],
}

/// A maneuver with its estimation.
#[derive(Clone, Copy, Debug)]
pub struct ManeuverView<'a> {
    pub aircraft: &'a str,
    pub record: &'a Record,
    pub groups: &'a Groups,
    pub maneuver: &'a Maneuver,
    pub class: Option<&'a Class>,
    /// All maneuvers of the flight: neighbours may reach into the picture.
    pub flight: &'a [Maneuver],
    pub fit: &'a FitRow,
    /// None where it was not estimated.
    pub history: Option<&'a History>,
}

/// The strip chart of a whole flight.
#[must_use]
pub fn flight(view: &FlightView) -> String {
    let record = view.record;
    let (from_s, to_s) = (
        record.time_s(0),
        record.time_s(record.samples.saturating_sub(1)),
    );
    let room = PITCH * (view.maneuvers.len() + view.unknown.len()) as f64;
    let pen = Pen::new(
        record,
        (from_s, to_s),
        (from_s, to_s),
        room.clamp(COLUMNS.0, COLUMNS.1),
    );
    let (recorded, lacking): (Vec<_>, Vec<_>) = flight_signals(view.groups)
        .into_iter()
        .partition(|(name, _)| record.values(name).is_some());
    let strips: Vec<Strip> = recorded
        .iter()
        .filter_map(|(name, look)| pen.strip(name, *look, &[]))
        .collect();
    let lacking: Vec<&str> = lacking.iter().map(|l| l.0).collect();
    let mut notes = notes(&lacking, &[], &strips);
    notes.extend(rejected(view.maneuvers));
    notes.extend(problems(view.problems));
    let maneuvers = super::notation::count(view.maneuvers.len(), "maneuver");
    let lasting = format!("{} to {} s", fixed(from_s, 1), fixed(to_s, 1));
    annotated_chart::draw(&Chart {
        title: format!("{}: {}", record.flight_id, view.aircraft),
        description: format!(
            "Strip chart of flight {}, {lasting}, with {maneuvers} shaded.",
            record.flight_id
        ),
        heading: vec![format!(
            "{lasting}, {} samples of {} s, {maneuvers}",
            view.recorded.0,
            number(Some(view.recorded.1), 3)
        )],
        legend: legend(
            &strips,
            !view.maneuvers.is_empty(),
            !view.events.is_empty(),
            false,
        ),
        time: pen.time,
        width: room.max(pen.columns.count as f64),
        windows: windows(view),
        lanes: lanes(view.events),
        strips,
        notes,
    })
}

/// The strip chart of one maneuver with a few seconds before and after.
#[must_use]
pub fn maneuver(view: &ManeuverView) -> String {
    let maneuver = view.maneuver;
    let part = view
        .record
        .part(maneuver.start_s - AROUND_S, maneuver.end_s + AROUND_S);
    let first_s = (maneuver.start_s - AROUND_S).max(part.start_s);
    let last_s = (maneuver.end_s + AROUND_S).min(part.time_s(part.samples.saturating_sub(1)));
    let pen = Pen::new(
        &part,
        (first_s, last_s),
        (maneuver.start_s, maneuver.end_s),
        COLUMNS.0,
    );
    let (moved, still) = moved(&pen, view.groups);
    let mut strips: Vec<Strip> = moved
        .iter()
        .filter_map(|name| pen.strip(name, INPUT, &[]))
        .collect();
    for output in maneuver.axis.outputs() {
        let computed = view
            .history
            .and_then(|h| Some((h, h.outputs.iter().find(|o| o.label == output.signal())?)));
        strips.extend(pen.output(output.signal(), computed));
    }
    strips.extend(
        view.groups
            .flags
            .iter()
            .filter_map(|name| pen.strip(name, FLAG, &[])),
    );
    let mut notes = notes(&[], &still, &strips);
    notes.push(
        "Scales fit the maneuver: a line that leaves its strip before or after it is cut there."
            .to_owned(),
    );
    let inside = |m: &&Maneuver| m.start_s < last_s && m.end_s > first_s;
    let windows = view.flight.iter().filter(inside).map(|m| window(m, &[]));
    annotated_chart::draw(&Chart {
        title: title(view),
        description: format!(
            "Strip chart of maneuver {} of class {}: inputs, outputs {}.",
            maneuver.maneuver_id,
            maneuver.class,
            if view.history.is_some() {
                "measured and computed, residuals"
            } else {
                "as measured; it was not estimated"
            }
        ),
        heading: heading(view),
        legend: legend(&strips, true, false, view.history.is_some()),
        time: pen.time,
        width: pen.columns.count as f64,
        windows: windows.collect(),
        lanes: vec![],
        notes,
        strips,
    })
}

fn title(view: &ManeuverView) -> String {
    let m = view.maneuver;
    let class = view
        .class
        .map_or_else(String::new, |c| format!(", {}", c.title));
    format!("{}: {}{class}", m.maneuver_id, m.class)
}

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
        let (first, last) = (number(Some(first), 4), number(Some(last), 4));
        // Writing into a String cannot fail.
        let _ = write!(
            outcome,
            "; {} iterations, J from {first} to {last}",
            fit.iterations
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

/// The signals of a flight in the order of the chart, each with its look.
fn flight_signals(groups: &Groups) -> Vec<(&str, Look)> {
    use signal::{
        ALPHA_VANE, ALTITUDE, AN, AX, AY, BETA_VANE, MACH, P, PHI, PSI, Q, R, THETA, VELOCITY,
    };
    let motion = [
        ALPHA_VANE, BETA_VANE, VELOCITY, MACH, ALTITUDE, P, Q, R, THETA, PHI, PSI, AN, AX, AY,
    ];
    let named = groups
        .surfaces
        .iter()
        .chain(&groups.controls)
        .map(String::as_str);
    let strips = motion
        .into_iter()
        .chain(named)
        .map(|name| (name, OF_FLIGHT));
    strips
        .chain(groups.flags.iter().map(|name| (name.as_str(), FLAG)))
        .collect()
}

/// Draws signals of one record over one time axis.
struct Pen<'a> {
    record: &'a Record,
    time: Scale,
    columns: Columns,
    /// From when to when the scales must show everything, s.
    core: (f64, f64),
}

impl Pen<'_> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between the limits of COLUMNS"
    )]
    fn new(record: &Record, (from_s, to_s): (f64, f64), core: (f64, f64), columns: f64) -> Pen<'_> {
        let to_s = to_s.max(from_s + record.step_s);
        let time = Scale {
            min: from_s,
            max: to_s,
            ..Scale::in_steps(from_s, to_s, 10.0)
        };
        Pen {
            record,
            time,
            columns: Columns {
                from_s,
                to_s,
                count: columns as usize,
            },
            core,
        }
    }

    /// The values of a signal from one time to another.
    fn between(&self, name: &str, (from_s, to_s): (f64, f64)) -> impl Iterator<Item = f64> {
        let values = self
            .record
            .values(name)
            .unwrap_or_default()
            .iter()
            .enumerate();
        let slack = 0.5 * self.record.step_s;
        values
            .filter(move |(k, _)| (from_s - slack..=to_s + slack).contains(&self.record.time_s(*k)))
            .map(|(_, v)| *v)
    }

    /// What a signal's scale covers: all of its core, and of the rest and of `more` what does not
    /// flatten that.
    fn limits(&self, name: &str, more: &[f64]) -> (f64, f64) {
        let all = || {
            self.between(name, (self.columns.from_s, self.columns.to_s))
                .chain(more.iter().copied())
        };
        let core = extent(self.between(name, self.core)).or_else(|| extent(all()));
        let Some((low, high)) = core else {
            return (0.0, 1.0);
        };
        let room = STRETCH * (high - low);
        let near = all().filter(|v| (low - room..=high + room).contains(v));
        extent(near.chain([low, high])).unwrap_or((low, high))
    }

    /// One signal with its marks on a scale for it and for `more`; none where the record has no
    /// such signal.
    fn strip(&self, name: &str, look: Look, more: &[f64]) -> Option<Strip> {
        let record = self.record;
        let series = record.signals.get(name)?;
        let of = |mark| runs(series, record.start_s, record.step_s, mark, self.columns);
        let (low, high) = self.limits(name, more);
        let is_flag = look.height <= FLAG.height;
        let flag = Scale {
            min: -0.25,
            max: high.max(1.0) + 0.25,
            step: high.max(1.0),
        };
        let scale = if is_flag {
            flag
        } else {
            scale(low, high, look.steps)
        };
        Some(Strip {
            name: without_unit(name).to_owned(),
            unit: if is_flag {
                "0/1"
            } else {
                Unit::of_signal(name).name
            }
            .to_owned(),
            height: look.height,
            scale,
            traces: vec![self.trace(record.start_s, &series.values, scale, look)],
            dots: vec![],
            marks: Marks {
                bridged: of(Mark::Bridged),
                despiked: of(Mark::Despiked),
                missing: [of(Mark::Missing), of(Mark::Stuck)].concat(),
            },
        })
    }

    /// The line through values from a time on, cut where it leaves the scale.
    fn trace(&self, start_s: f64, values: &[f64], scale: Scale, look: Look) -> Trace {
        let inside: Vec<f64> = values
            .iter()
            .map(|v| if scale.contains(*v) { *v } else { f64::NAN })
            .collect();
        let shown = Shown {
            start_s,
            step_s: self.record.step_s,
            values: &inside,
        };
        Trace {
            pieces: envelope(shown, self.columns),
            colour: look.colour,
            width: look.width,
        }
    }

    /// An output as measured, with what was computed over it and their difference under it.
    fn output(&self, name: &str, computed: Option<(&History, &HistoryOutput)>) -> Vec<Strip> {
        let Some((history, output)) = computed else {
            return self.strip(name, ALONE, &[]).into_iter().collect();
        };
        let Some(mut measured) = self.strip(name, MEASURED, &output.computed) else {
            return vec![];
        };
        let start_s = self.core.0 + history.time_s.first().copied().unwrap_or(0.0);
        measured
            .traces
            .push(self.trace(start_s, &output.computed, measured.scale, INPUT));
        // What was left out of the cost may be no measurement at all: it has a place in time and no
        // residual.
        let samples = output
            .measured
            .iter()
            .zip(&output.computed)
            .zip(&output.marked);
        let residuals: Vec<f64> = samples
            .map(|((z, y), marked)| if *marked { f64::NAN } else { z - y })
            .collect();
        let (low, high) = extent(residuals.iter().copied()).unwrap_or((-1.0, 1.0));
        let scale = scale(low.min(0.0), high.max(0.0), RESIDUAL.steps);
        let left_out = output
            .marked
            .iter()
            .enumerate()
            .filter(|(_, marked)| **marked);
        let dots = left_out.map(|(k, _)| (start_s + k as f64 * self.record.step_s, 0.0));
        let below = Strip {
            name: "residual".to_owned(),
            unit: Unit::of_signal(name).name.to_owned(),
            height: RESIDUAL.height,
            scale,
            traces: vec![self.trace(start_s, &residuals, scale, RESIDUAL)],
            dots: dots.collect(),
            marks: Marks::default(),
        };
        vec![measured, below]
    }
}

/// A round scale of about so many steps on which at least two numbers stand: one alone gives no
/// scale.
fn scale(low: f64, high: f64, steps: f64) -> Scale {
    let scale = Scale::in_steps(low, high, steps);
    let ticks = (scale.max / scale.step).floor() - (scale.min / scale.step).ceil() + 1.0;
    if ticks < 2.0 {
        Scale::with_step(low, high, scale.step, scale.step)
    } else {
        scale
    }
}

/// Surfaces and pilot controls that moved during the maneuver, and those that hardly did.
fn moved<'a>(pen: &Pen, groups: &'a Groups) -> (Vec<&'a str>, Vec<&'a str>) {
    let range =
        |name: &str| extent(pen.between(name, pen.core)).map_or(0.0, |(low, high)| high - low);
    let inputs = groups
        .controls
        .iter()
        .chain(&groups.surfaces)
        .map(String::as_str);
    let recorded = inputs.filter(|name| pen.record.values(name).is_some());
    let ranges: Vec<(&str, f64)> = recorded.map(|name| (name, range(name))).collect();
    let alike = |name: &str, other: &str| Unit::of_signal(name) == Unit::of_signal(other);
    let most = |name: &str| {
        ranges
            .iter()
            .filter(|(o, _)| alike(name, o))
            .map(|r| r.1)
            .fold(0.0, f64::max)
    };
    let least = |name: &str| {
        groups
            .steps
            .get(name)
            .map_or_else(|| HARDLY_BESIDE * most(name), |step| HARDLY * step)
    };
    let (moved, still): (Vec<_>, Vec<_>) = ranges
        .iter()
        .copied()
        .partition(|(name, range)| *range > least(name));
    let names = |of: Vec<(&'a str, f64)>| of.into_iter().map(|m| m.0).collect();
    (names(moved), names(still))
}

/// A maneuver as it is written over the chart: with what the record says where the analyst's list
/// says otherwise.
fn window(maneuver: &Maneuver, events: &[EventRow]) -> Window {
    let same = |e: &&EventRow| {
        e.given_class.as_ref() == Some(&maneuver.class)
            && e.given_start_s
                .is_some_and(|s| (s - maneuver.start_s).abs() < 1.0)
    };
    let verdict = events
        .iter()
        .find(same)
        .map(|e| e.verdict)
        .filter(|v| *v != EventVerdict::Agrees);
    let rejected = if maneuver.is_rejected() {
        ", rejected"
    } else {
        ""
    };
    let label = format!("{} {}{rejected}", maneuver.class, maneuver.maneuver_id);
    Window {
        maneuver_id: maneuver.maneuver_id.clone(),
        class: maneuver.class.clone(),
        label: verdict.map_or_else(|| label.clone(), |v| format!("{label}, {v}")),
        start_s: maneuver.start_s,
        end_s: maneuver.end_s,
    }
}

/// Everything that is shaded in a flight, in order of time.
fn windows(view: &FlightView) -> Vec<Window> {
    let unknown = view.unknown.iter().map(|u| Window {
        maneuver_id: String::new(),
        class: "unknown".to_owned(),
        label: format!("unknown, nearest to {}", u.nearest_class),
        start_s: u.start_s,
        end_s: u.end_s,
    });
    let mut windows: Vec<Window> = view
        .maneuvers
        .iter()
        .map(|m| window(m, view.events))
        .chain(unknown)
        .collect();
    windows.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    windows
}

/// Why maneuvers were rejected before they were estimated.
fn rejected(maneuvers: &[Maneuver]) -> Vec<String> {
    let rejected: Vec<&Maneuver> = maneuvers.iter().filter(|m| m.is_rejected()).collect();
    let line = |m: &&Maneuver| {
        format!(
            "{} {} is rejected: {}",
            m.class, m.maneuver_id, m.quality.reason
        )
    };
    let mut lines: Vec<String> = rejected.iter().take(MOST_PROBLEMS).map(line).collect();
    if rejected.len() > MOST_PROBLEMS {
        lines.push(format!(
            "and {} more in the table `maneuvers`",
            rejected.len() - MOST_PROBLEMS
        ));
    }
    lines
}

/// The analyst's list and what was found, where there is a list.
fn lanes(events: &[EventRow]) -> Vec<Lane> {
    if events.is_empty() {
        return vec![];
    }
    let item = |class: &Option<String>, start: Option<f64>, end: Option<f64>| {
        Some(LaneBox {
            label: class.clone()?,
            start_s: start?,
            end_s: end?,
        })
    };
    let given = events
        .iter()
        .filter_map(|e| item(&e.given_class, e.given_start_s, e.given_end_s))
        .collect();
    let found = events
        .iter()
        .filter_map(|e| item(&e.found_class, e.found_start_s, e.found_end_s))
        .collect();
    vec![
        Lane {
            name: "given".to_owned(),
            boxes: given,
        },
        Lane {
            name: "found".to_owned(),
            boxes: found,
        },
    ]
}

/// Only what occurs.
fn legend(strips: &[Strip], windows: bool, events: bool, computed: bool) -> Vec<(Key, String)> {
    let any = |of: fn(&Marks) -> &Vec<(f64, f64)>| strips.iter().any(|s| !of(&s.marks).is_empty());
    let entries = [
        (windows, Key::Window, "maneuver"),
        (events, Key::Given, "the analyst's event, or what was found"),
        (computed, Key::Line(MEASURED_COLOUR, 2.6), "measured"),
        (computed, Key::Line(INK, 1.1), "computed; residual"),
        (
            strips.iter().any(|s| !s.dots.is_empty()),
            Key::Dot,
            "left out of the cost",
        ),
        (any(|m| &m.bridged), Key::Bridged, "bridged"),
        (any(|m| &m.despiked), Key::Despiked, "spike replaced"),
        (any(|m| &m.missing), Key::Missing, "missing"),
    ];
    entries
        .into_iter()
        .filter(|e| e.0)
        .map(|(_, key, word)| (key, word.to_owned()))
        .collect()
}

/// What the reader must know to read the chart.
fn notes(lacking: &[&str], still: &[&str], strips: &[Strip]) -> Vec<String> {
    let mut notes = vec![
        "Times on the record's clock. A line passes through the smallest and the largest sample of each column of the \
         picture."
            .to_owned(),
    ];
    if !lacking.is_empty() {
        let names: Vec<&str> = lacking.iter().map(|name| without_unit(name)).collect();
        notes.push(format!("Not recorded: {}.", names.join(", ")));
    }
    if !still.is_empty() {
        let names: Vec<&str> = still.iter().map(|name| without_unit(name)).collect();
        notes.push(format!(
            "Not drawn, for they hardly moved: {}.",
            names.join(", ")
        ));
    }
    let empty: Vec<&str> = strips
        .iter()
        .filter(|s| s.traces.iter().all(|t| t.pieces.is_empty()))
        .map(|s| s.name.as_str())
        .collect();
    if !empty.is_empty() {
        notes.push(format!("Without a sample: {}.", empty.join(", ")));
    }
    notes
}

fn problems(problems: &[Problem]) -> Vec<String> {
    let line = |p: &Problem| format!("{}, {}: {}", p.stage, p.place, p.reason);
    let mut lines: Vec<String> = problems.iter().take(MOST_PROBLEMS).map(line).collect();
    if problems.len() > MOST_PROBLEMS {
        lines.push(format!(
            "and {} more in the table `problems`",
            problems.len() - MOST_PROBLEMS
        ));
    }
    lines
}

#[cfg(test)]
mod tests;
