//! Candidates for maneuvers: trains of steps of the surfaces that nobody's stick explains, and
//! trains of pilot steps.
//!
//! The on-board excitation system moves surfaces while the pilot's controls rest. A surface that
//! steps while a control moves is geared to it, and one that steps soon after a pilot's step
//! answers it by feedback: neither is excitation of its own. What is left tells excitation from
//! ordinary flying without any flag.

use std::collections::{BTreeMap, BTreeSet};

use crate::flight::Record;
use crate::maneuver::Class;

use super::steps::{self, Steps};
use super::{Settings, Step, completed};

/// What is looked at in one record.
#[derive(Clone, Debug)]
pub(super) struct Scene<'a> {
    pub record: &'a Record,
    pub settings: &'a Settings,
    /// Every step.
    pub steps: Steps,
    /// Every step and smaller deflection of the pilot's controls.
    pub deflections: Steps,
    /// The steps of surfaces on their own.
    pub own: Steps,
    /// Whether one of the pilot's controls is recorded: without any, nothing tells the pilot's hand
    /// from the system's.
    pub sees_pilot: bool,
    /// Whether the excitation flag is recorded and not stuck.
    flag_speaks: bool,
    /// From when to when a flag that is not stuck is down between two times that it is up, for no
    /// less than the shortest pause.
    pub flag_rests: Vec<(f64, f64)>,
}

impl<'a> Scene<'a> {
    pub fn of(record: &'a Record, settings: &'a Settings) -> Scene<'a> {
        let (steps, deflections) = steps::of_record(record, settings);
        let is_known = |name: &&String| {
            record
                .values(name)
                .is_some_and(|v| v.iter().any(|v| v.is_finite()))
        };
        let sees_pilot = settings.pilot_controls.iter().any(|name| is_known(&name));
        let flag = record.values(&settings.excitation_flag).unwrap_or_default();
        let (flag_speaks, flag_rests) = (
            changes(flag),
            rests(flag, record, settings.shortest_pause_s),
        );
        let own = Steps::default();
        let mut scene = Scene {
            record,
            settings,
            steps,
            deflections,
            own,
            sees_pilot,
            flag_speaks,
            flag_rests,
        };
        scene.own = scene.without_the_pilot_s();
        completed::complete(&mut scene.own, &scene.deflections, settings);
        scene
    }

    fn without_the_pilot_s(&self) -> Steps {
        let surfaces = self
            .steps
            .of
            .iter()
            .filter(|(signal, _)| !self.is_pilot_s(signal));
        let own = |steps: &Vec<Step>| {
            steps
                .iter()
                .filter(|s| !self.is_answer(s.time_s))
                .copied()
                .collect()
        };
        Steps {
            of: surfaces
                .map(|(signal, steps)| (signal.clone(), own(steps)))
                .collect(),
            smallest: self.steps.smallest.clone(),
            noise: self.steps.noise.clone(),
        }
    }

    pub fn is_pilot_s(&self, signal: &str) -> bool {
        self.settings.pilot_controls.iter().any(|c| c == signal)
    }

    /// Whether the pilot explains what a surface does at a time: a control of his moves then, or
    /// has stepped shortly before and no flag says that the on-board system is at work.
    fn is_answer(&self, time_s: f64) -> bool {
        let settings = self.settings;
        let system = self.flag_is_up(time_s);
        settings.pilot_controls.iter().any(|control| {
            let Some(smallest) = self.steps.smallest.get(control) else {
                return false;
            };
            let geared = (time_s - settings.gearing_s, time_s + settings.transit_s);
            let share = settings.geared_share * smallest;
            let answered = (time_s - settings.answer_s, time_s + settings.transit_s);
            !system
                && !self
                    .steps
                    .between(control, answered.0, answered.1)
                    .is_empty()
                || steps::largest_change(self.record, control, settings, geared) >= share
        })
    }

    /// Whether a flag that is not stuck says that the on-board system is at work.
    fn flag_is_up(&self, time_s: f64) -> bool {
        let values = self
            .record
            .values(&self.settings.excitation_flag)
            .unwrap_or_default();
        self.flag_speaks
            && values
                .get(self.record.sample_at(time_s))
                .is_some_and(|v| *v > 0.5)
    }

    /// How often the pilot's controls step from one time to another.
    pub fn pilot_steps(&self, from_s: f64, to_s: f64) -> usize {
        self.settings
            .pilot_controls
            .iter()
            .map(|c| self.steps.between(c, from_s, to_s).len())
            .sum()
    }
}

/// Whether a flag is up in some samples and down in others.
fn changes(flag: &[f64]) -> bool {
    let mut known = flag.iter().filter(|v| v.is_finite()).map(|v| *v > 0.5);
    known.next().is_some_and(|first| known.any(|v| v != first))
}

/// From when to when a flag is down between two times that it is up, for no less than a pause.
fn rests(flag: &[f64], record: &Record, pause_s: f64) -> Vec<(f64, f64)> {
    let known: Vec<(usize, bool)> = flag
        .iter()
        .enumerate()
        .filter(|(_, v)| v.is_finite())
        .map(|(k, v)| (k, *v > 0.5))
        .collect();
    let runs: Vec<&[(usize, bool)]> = known.chunk_by(|a, b| a.1 == b.1).collect();
    let inner = runs
        .get(1..runs.len().saturating_sub(1))
        .unwrap_or_default();
    let down = inner
        .iter()
        .filter(|run| run.first().is_some_and(|(_, up)| !up));
    let spans =
        down.filter_map(|run| Some((record.time_s(run.first()?.0), record.time_s(run.last()?.0))));
    spans
        .filter(|(from_s, to_s)| to_s - from_s >= pause_s)
        .collect()
}

/// One step of a train.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Edge<'a> {
    pub signal: &'a str,
    pub time_s: f64,
    pub change: f64,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Surfaces on their own.
    Onboard,
    /// These pilot controls.
    Pilot(BTreeSet<String>),
}

/// Steps that follow each other closely enough to be of one maneuver, or of several close together.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Train<'a> {
    pub kind: Kind,
    /// In order of time.
    pub edges: Vec<Edge<'a>>,
}

impl<'a> Train<'a> {
    /// This train and the next as one, where the pilot may have gone over from one control to
    /// another: he rests no longer than he may hold a control, and steps first with another than
    /// the one that he has stepped with last.
    pub fn going_over(&self, next: &Train<'a>, scene: &Scene) -> Option<Train<'a>> {
        let smallest = |signal: &str| {
            scene
                .steps
                .smallest
                .get(signal)
                .copied()
                .unwrap_or(f64::INFINITY)
        };
        let whole = |e: &&Edge| e.change.abs() >= smallest(e.signal);
        let (last, first) = (
            self.edges.iter().rfind(whole)?,
            next.edges.iter().find(whole)?,
        );
        let rest_s = next.edges.first()?.time_s - self.edges.last()?.time_s;
        let over =
            self.kind == next.kind && self.kind != Kind::Onboard && last.signal != first.signal;
        let joins = over && (0.0..=scene.settings.longest_hold_s).contains(&rest_s);
        joins.then(|| Train {
            kind: self.kind.clone(),
            edges: [&self.edges[..], &next.edges[..]].concat(),
        })
    }
}

/// The kind of train that a class is flown as.
pub(super) fn kind_of(class: &Class, scene: &Scene) -> Kind {
    let inputs = class.recognition.inputs();
    if inputs.iter().any(|s| scene.is_pilot_s(s)) {
        Kind::Pilot(inputs.into_iter().map(str::to_owned).collect())
    } else {
        Kind::Onboard
    }
}

/// Every candidate of the record.
pub(super) fn trains<'a>(scene: &'a Scene, classes: &[Class]) -> Vec<Train<'a>> {
    let mut trains = onboard(scene);
    let kinds = classes.iter().map(|c| kind_of(c, scene));
    let controls: BTreeSet<BTreeSet<String>> = kinds
        .filter_map(|k| {
            if let Kind::Pilot(signals) = k {
                Some(signals)
            } else {
                None
            }
        })
        .collect();
    for signals in controls {
        for (from_s, to_s) in pilot(scene, &signals) {
            let edges = edges(&scene.deflections, |s| signals.contains(s), (from_s, to_s));
            trains.push(Train {
                kind: Kind::Pilot(signals.clone()),
                edges,
            });
        }
    }
    trains
}

fn edges<'a>(
    steps: &'a Steps,
    wanted: impl Fn(&str) -> bool,
    (from_s, to_s): (f64, f64),
) -> Vec<Edge<'a>> {
    let signals = steps.of.keys().filter(|s| wanted(s));
    let edge = |signal: &'a String, s: &Step| Edge {
        signal,
        time_s: s.time_s,
        change: s.change(),
    };
    let of = |signal: &'a String| {
        steps
            .between(signal, from_s, to_s)
            .iter()
            .map(move |s| edge(signal, s))
    };
    let mut edges: Vec<Edge> = signals.flat_map(of).collect();
    edges.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    edges
}

/// Surfaces on their own, one train as long as no pause is longer than a control may be held away
/// from trim.
fn onboard<'a>(scene: &'a Scene) -> Vec<Train<'a>> {
    let all = edges(&scene.own, |_| true, (f64::NEG_INFINITY, f64::INFINITY));
    let near = |a: &Edge, b: &Edge| b.time_s - a.time_s <= scene.settings.longest_hold_s;
    let of = |edges: &[Edge<'a>]| Train {
        kind: Kind::Onboard,
        edges: edges.to_vec(),
    };
    all.chunk_by(near).map(of).collect()
}

/// From when to when pilot controls step, with the deflection from trim that begins a train and the
/// one back that ends it. A train goes on while a control is held away from its trim for no longer
/// than `longest_hold_s`, or while all rest at trim for no longer than `longest_rest_s`.
fn pilot(scene: &Scene, signals: &BTreeSet<String>) -> Vec<(f64, f64)> {
    let settings = scene.settings;
    let of = |signal| {
        scene
            .deflections
            .of
            .get(signal)
            .into_iter()
            .flatten()
            .map(move |step| (signal, step))
    };
    let mut all: Vec<(&String, &Step)> = signals.iter().flat_map(of).collect();
    all.sort_by(|a, b| a.1.time_s.total_cmp(&b.1.time_s));
    let mut trains: Vec<Growing> = Vec::new();
    let mut previous: BTreeMap<&str, &Step> = BTreeMap::new();
    for (signal, step) in all {
        let smallest = scene
            .steps
            .smallest
            .get(signal)
            .copied()
            .unwrap_or(f64::INFINITY);
        let counts = step.change().abs() >= smallest;
        let deflection = settings.deflection_share * smallest;
        let taken_s = trains.last().map_or(f64::NEG_INFINITY, |t| t.to_s);
        let opens = |p: &&&Step| {
            let near = step.time_s - p.time_s <= settings.longest_hold_s;
            near && p.time_s > taken_s && p.change() * step.change() < 0.0
        };
        let opening = previous
            .get(signal.as_str())
            .filter(opens)
            .map_or(step, |p| *p);
        let from_s = if counts { opening.time_s } else { step.time_s };
        let going_on = trains
            .last_mut()
            .filter(|t| from_s - t.to_s <= t.longest_quiet(settings));
        match going_on {
            Some(train) if counts || train.brings_to_trim(signal, step) => {
                train.add(signal, step, opening.before, deflection);
            }
            None if counts => {
                let mut train = Growing {
                    from_s: opening.time_s,
                    to_s: step.time_s,
                    controls: BTreeMap::new(),
                };
                train.add(signal, step, opening.before, deflection);
                trains.push(train);
            }
            _ => {}
        }
        previous.insert(signal, step);
    }
    trains.iter().map(|t| (t.from_s, t.to_s)).collect()
}

/// A train of pilot steps as it grows.
struct Growing<'a> {
    from_s: f64,
    to_s: f64,
    controls: BTreeMap<&'a str, Control>,
}

/// A deflection from trim is about half a reversal: halfway to it, a quarter of the largest step
/// away, a control is as near to trim as to a deflection.
pub(super) const TRIM_SHARE: f64 = 0.25;

/// Where one control of a train stands.
struct Control {
    trim: f64,
    now: f64,
    /// The sum of its steps.
    moved: f64,
    /// The smallest change that is a deflection.
    deflection: f64,
    /// Its largest step, and its last.
    largest: f64,
    last: f64,
}

impl Control {
    fn is_near(&self, from_trim: f64) -> bool {
        from_trim.abs() < self.deflection.max(TRIM_SHARE * self.largest)
    }

    /// Trim drifts in a turn, so a control is back at it when its steps cancel, or by its level;
    /// but a whole reversal leads to the other side, whatever the level.
    fn rests(&self) -> bool {
        let reversed = self.last > (1.0 - TRIM_SHARE) * self.largest;
        self.is_near(self.moved) || (self.is_near(self.now - self.trim) && !reversed)
    }

    /// Whether a step leads from away to trim, by the sum of the steps or by the level: one of them
    /// may have been slow.
    fn comes_to_trim(&self, step: &Step) -> bool {
        let leads = |before: f64, after: f64| !self.is_near(before) && self.is_near(after);
        leads(self.moved, self.moved + step.change())
            || leads(self.now - self.trim, step.after - self.trim)
    }
}

impl<'a> Growing<'a> {
    fn add(&mut self, signal: &'a str, step: &Step, trim: f64, deflection: f64) {
        self.to_s = step.time_s;
        let new = Control {
            trim,
            now: trim,
            moved: 0.0,
            deflection,
            largest: 0.0,
            last: 0.0,
        };
        let control = self.controls.entry(signal).or_insert(new);
        control.now = step.after;
        control.last = step.change().abs();
        control.largest = control.largest.max(control.last);
        // The first step that counts may follow the deflection that opens the train.
        control.moved = if control.moved == 0.0 {
            step.after - trim
        } else {
            control.moved + step.change()
        };
    }

    fn at_trim(&self) -> bool {
        self.controls.values().all(Control::rests)
    }

    /// Whether a control of the train that is held away from trim comes back to it with this step.
    fn brings_to_trim(&self, signal: &str, step: &Step) -> bool {
        self.controls
            .get(signal)
            .is_some_and(|c| c.comes_to_trim(step))
    }

    fn longest_quiet(&self, settings: &Settings) -> f64 {
        if self.at_trim() {
            settings.longest_rest_s
        } else {
            settings.longest_hold_s
        }
    }
}
