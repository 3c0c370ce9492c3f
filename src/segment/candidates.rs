//! Candidates for maneuvers: intervals in which the excitation flag is up, and trains of pilot steps.
//!
//! A class whose recognition wants the excitation flag up is an excited class; every other is a pilot's. The signals
//! that a class wants at least one step of are its inputs.

use std::collections::{BTreeMap, BTreeSet};

use crate::flight::Record;
use crate::maneuver::Class;

use super::{Settings, Step, steps};

/// The steps of a record, by signal.
pub(super) type Steps = BTreeMap<String, Vec<Step>>;

/// A stretch of a record in which something was put in on purpose, s on the record's clock.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Excitation {
    pub from_s: f64,
    pub to_s: f64,
    pub kind: Kind,
    /// The record begins or ends inside it.
    pub cut: bool,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Kind {
    /// The excitation flag is up from beginning to end.
    Flagged,
    /// Steps of these pilot controls, from the first to the last.
    Pilot(BTreeSet<String>),
}

/// The signals that a class wants steps of.
pub(super) fn inputs(class: &Class) -> BTreeSet<String> {
    let counts = class.recognition.steps.iter();
    counts.filter(|(_, count)| count.at_least > 0).map(|(signal, _)| signal.clone()).collect()
}

/// Whether a class is flown by the on-board excitation system.
pub(super) fn is_excited(class: &Class, settings: &Settings) -> bool {
    class.recognition.flags.get(&settings.excitation_flag) == Some(&true)
}

/// Every candidate of the record.
pub(super) fn excitations(record: &Record, classes: &[Class], settings: &Settings) -> Vec<Excitation> {
    let pilots = classes.iter().filter(|c| !is_excited(c, settings));
    let controls: BTreeSet<BTreeSet<String>> = pilots.map(inputs).filter(|s| !s.is_empty()).collect();
    let deflections = steps::of_record(record, settings, settings.deflection_share);
    let trains = controls.into_iter().flat_map(|signals| trains(record, &signals, settings, &deflections));
    flagged(record, settings).into_iter().chain(trains).collect()
}

/// Intervals in which the excitation flag is up, with short drop-outs closed. A missing sample holds the last value.
fn flagged(record: &Record, settings: &Settings) -> Vec<Excitation> {
    let Some(flag) = record.values(&settings.excitation_flag) else { return Vec::new() };
    let mut intervals: Vec<(usize, usize)> = Vec::new();
    let mut up = false;
    for (k, value) in flag.iter().enumerate() {
        let was_up = up;
        up = if value.is_finite() { *value > 0.5 } else { up };
        match (was_up, up) {
            (false, true) => intervals.push((k, k + 1)),
            (true, true) => intervals.iter_mut().last().into_iter().for_each(|i| i.1 = k + 1),
            _ => {}
        }
    }
    let mut closed: Vec<(usize, usize)> = Vec::new();
    for (on, off) in intervals {
        match closed.last_mut() {
            Some(last) if (on - last.1) as f64 * record.step_s <= settings.longest_dropout_s => last.1 = off,
            _ => closed.push((on, off)),
        }
    }
    let excitation = |(on, off): (usize, usize)| Excitation {
        from_s: record.time_s(on),
        to_s: record.time_s(off),
        kind: Kind::Flagged,
        cut: on == 0 || off == record.samples,
    };
    closed.into_iter().map(excitation).collect()
}

/// Trains of steps of some pilot controls, with the deflection from trim that begins them and the one back that ends
/// them. A train goes on while a control is held away from its trim for no longer than `longest_hold_s`, or while all
/// rest at trim for no longer than `longest_rest_s`. `deflections` holds the steps and the smaller deflections.
fn trains(record: &Record, signals: &BTreeSet<String>, settings: &Settings, deflections: &Steps) -> Vec<Excitation> {
    let of = |signal| deflections.get(signal).into_iter().flatten().map(move |step| (signal, step));
    let mut all: Vec<(&String, &Step)> = signals.iter().flat_map(of).collect();
    all.sort_by(|a, b| a.1.time_s.total_cmp(&b.1.time_s));
    let mut trains: Vec<Train> = Vec::new();
    let mut previous: BTreeMap<&str, &Step> = BTreeMap::new();
    for (signal, step) in all {
        let smallest = settings.steps.get(signal).copied().unwrap_or(f64::INFINITY);
        let counts = step.change().abs() >= smallest;
        let deflection = settings.deflection_share * smallest;
        let taken_s = trains.last().map_or(f64::NEG_INFINITY, |t| t.to_s);
        let opens = |p: &&&Step| {
            let near = step.time_s - p.time_s <= settings.longest_hold_s;
            near && p.time_s > taken_s && p.change() * step.change() < 0.0
        };
        let opening = previous.get(signal.as_str()).filter(opens).map_or(step, |p| *p);
        let from_s = if counts { opening.time_s } else { step.time_s };
        let going_on = trains.last_mut().filter(|t| from_s - t.to_s <= t.longest_quiet(settings));
        match going_on {
            Some(train) if counts || train.brings_to_trim(signal, step) => {
                train.add(signal, step, opening.before, deflection);
            }
            None if counts => {
                let mut train = Train { from_s: opening.time_s, to_s: step.time_s, controls: BTreeMap::new() };
                train.add(signal, step, opening.before, deflection);
                trains.push(train);
            }
            _ => {}
        }
        previous.insert(signal, step);
    }
    let end_s = record.time_s(record.samples);
    let excitation = |train: Train| Excitation {
        from_s: train.from_s,
        to_s: train.to_s,
        kind: Kind::Pilot(signals.clone()),
        cut: !train.at_trim() && train.to_s + train.longest_quiet(settings) > end_s,
    };
    trains.into_iter().map(excitation).collect()
}

/// A train of steps as it grows.
struct Train<'a> {
    from_s: f64,
    to_s: f64,
    controls: BTreeMap<&'a str, Control>,
}

/// Where one control of a train stands.
struct Control {
    trim: f64,
    now: f64,
    /// The smallest change that is a deflection.
    deflection: f64,
}

impl Control {
    /// Whether a level is trim: no deflection from where the train found the control.
    fn is_trim(&self, level: f64) -> bool {
        (level - self.trim).abs() < self.deflection
    }
}

impl<'a> Train<'a> {
    fn add(&mut self, signal: &'a str, step: &Step, trim: f64, deflection: f64) {
        self.to_s = step.time_s;
        self.controls.entry(signal).or_insert(Control { trim, now: trim, deflection }).now = step.after;
    }

    fn at_trim(&self) -> bool {
        self.controls.values().all(|c| c.is_trim(c.now))
    }

    /// Whether a control of the train that is held away from trim comes back to it with this step.
    fn brings_to_trim(&self, signal: &str, step: &Step) -> bool {
        self.controls.get(signal).is_some_and(|c| !c.is_trim(c.now) && c.is_trim(step.after))
    }

    fn longest_quiet(&self, settings: &Settings) -> f64 {
        if self.at_trim() { settings.longest_rest_s } else { settings.longest_hold_s }
    }
}
