//! What is seen in one stretch of a record, and how it stands to a class: what of the class's
//! recognition fails, how much of the stretch the class explains, and how sure that is.

use std::collections::{BTreeMap, BTreeSet};

use crate::maneuver::{Class, Recognised};
use crate::numerics::order_statistics::trimmed_range;

use super::Step;
use super::candidates::{Kind, Scene};
use super::patterns;

/// One condition of a class that a stretch does not fulfil.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Miss {
    pub reason: String,
    /// That there is too little of something: as when a maneuver is broken off.
    pub too_little: bool,
}

/// A stretch of a record from its first step to its last.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen<'a> {
    pub scene: &'a Scene<'a>,
    pub kind: &'a Kind,
    pub from_s: f64,
    pub to_s: f64,
}

/// What speaks for a class, with what weight.
struct Voice {
    weight: f64,
    words: String,
}

impl<'a> Seen<'a> {
    /// The detector places a step within half its transit; that much belongs to a stretch at both
    /// ends.
    fn slack_s(&self) -> f64 {
        self.scene.settings.transit_s / 2.0
    }

    /// The steps of a signal that stand out from feedback's: at least a share of its largest, less
    /// what turbulence may have taken from them. Of a surface in a train of surfaces only those of
    /// its own.
    pub fn steps_of(&self, signal: &str) -> Vec<&'a Step> {
        let scene = self.scene;
        let own = *self.kind == Kind::Onboard && !scene.is_pilot_s(signal);
        let steps = if own { &scene.own } else { &scene.steps };
        let inside = steps.between(
            signal,
            self.from_s - self.slack_s(),
            self.to_s + self.slack_s(),
        );
        let largest = inside.iter().map(|s| s.change().abs()).fold(0.0, f64::max);
        let taken = scene.steps.noise.get(signal).copied().unwrap_or_default();
        let least = scene.settings.outstanding_share * largest - taken;
        inside
            .iter()
            .filter(|s| s.change().abs() >= least)
            .collect()
    }

    /// How often a signal steps to count against a class: of a surface that hardly moves beside the
    /// others, feedback, not at all.
    fn against(&self, signal: &str) -> usize {
        let relative = |signal: &str| {
            let smallest = self
                .scene
                .steps
                .smallest
                .get(signal)
                .copied()
                .unwrap_or(f64::INFINITY);
            self.steps_of(signal)
                .iter()
                .map(|s| s.change().abs() / smallest)
                .fold(0.0, f64::max)
        };
        let others = self
            .scene
            .steps
            .of
            .keys()
            .filter(|s| self.scene.is_pilot_s(s) == self.scene.is_pilot_s(signal));
        let largest = others.map(|s| relative(s)).fold(0.0, f64::max);
        if relative(signal) < self.scene.settings.outstanding_share * largest {
            0
        } else {
            self.steps_of(signal).len()
        }
    }

    /// What of a class's recognition fails here; nothing where it fits.
    pub fn misses(&self, class: &Class) -> Vec<Miss> {
        let rule = &class.recognition;
        let mut misses = Vec::new();
        let mut miss = |too_little: bool, reason: String| misses.push(Miss { reason, too_little });
        for (signal, count) in &rule.steps {
            let n = self.steps_of(signal).len();
            if n < count.at_least {
                miss(
                    true,
                    format!(
                        "{signal} steps {n} times, at least {} wanted",
                        count.at_least
                    ),
                );
            } else if n > count.at_most && self.against(signal) > count.at_most {
                miss(
                    false,
                    format!("{signal} steps {n} times, at most {} wanted", count.at_most),
                );
            }
        }
        for (signal, pulses) in &rule.pulses {
            if let Err((too_little, reason)) = patterns::pulses(&self.steps_of(signal), pulses) {
                miss(too_little, format!("{signal} {reason}"));
            }
        }
        for (signal, wanted) in &rule.moves {
            if self.moves(signal) == Some(!wanted) {
                miss(
                    false,
                    format!(
                        "{signal} {}",
                        if *wanted { "does not move" } else { "moves" }
                    ),
                );
            }
        }
        if *self.kind == Kind::Onboard {
            self.pilot_s_hand(class)
                .into_iter()
                .for_each(|reason| miss(false, reason));
        }
        misses
    }

    /// Why a train of surfaces is not the on-board system's.
    fn pilot_s_hand(&self, class: &Class) -> Option<String> {
        let scene = self.scene;
        if !scene.sees_pilot
            && !class
                .recognition
                .flags
                .iter()
                .any(|(f, up)| *up && self.flag(f) == Some(true))
        {
            return Some("no pilot control is recorded and no flag says that the surfaces moved by themselves".into());
        }
        // One correction is a step there and one back; more is flying.
        let n = scene.pilot_steps(self.from_s, self.to_s);
        (n > 2).then(|| format!("the pilot's controls step {n} times meanwhile"))
    }

    /// Whether a signal moves: between its 2nd and 98th hundredth over twice its smallest step, as
    /// from side to side; that is more where turbulence makes it work. It rests within half of the
    /// smallest step. Between the two, as where it is not recorded, nothing is known.
    fn moves(&self, signal: &str) -> Option<bool> {
        let record = self.scene.record;
        let (first, last) = (record.sample_at(self.from_s), record.sample_at(self.to_s));
        let mut known: Vec<f64> = record.values(signal)?.get(first..=last)?.to_vec();
        known.retain(|v| v.is_finite());
        let range = trimmed_range(known, 0.02)?;
        let smallest = self.scene.steps.smallest.get(signal)?;
        let moves = range >= 2.0 * smallest;
        (moves || range <= 0.5 * smallest).then_some(moves)
    }

    /// Whether a flag is up for most of the stretch; unknown where it is not recorded.
    fn flag(&self, signal: &str) -> Option<bool> {
        let record = self.scene.record;
        let (first, last) = (record.sample_at(self.from_s), record.sample_at(self.to_s));
        let values = record.values(signal)?.get(first..=last)?;
        let known = values.iter().filter(|v| v.is_finite()).count();
        let up = values.iter().filter(|v| **v > 0.5).count();
        (known > 0).then_some(2 * up > known)
    }

    /// Three steps to alternating sides, one of them a reversal: twice the smallest.
    pub fn is_excitation(&self, signal: &str) -> bool {
        let steps = self.steps_of(signal);
        let turns = steps
            .windows(2)
            .filter(|s| s[0].change() * s[1].change() < 0.0)
            .count();
        let smallest = self
            .scene
            .steps
            .smallest
            .get(signal)
            .copied()
            .unwrap_or(f64::INFINITY);
        turns + 1 >= self.scene.settings.fewest_steps
            && steps.iter().any(|s| s.change().abs() >= 2.0 * smallest)
    }

    /// The signals that make a maneuver of a class here: those that must, and of those that may
    /// step as often as a doublet does the ones that are excited. Fewer steps of these are
    /// feedback's.
    pub fn inputs<'c>(&self, class: &'c Class) -> BTreeSet<&'c str> {
        let fewest = self.scene.settings.fewest_steps;
        let may = class
            .recognition
            .steps
            .iter()
            .filter(|(_, count)| count.at_least == 0 && count.at_most >= fewest);
        let excited = may
            .map(|(signal, _)| signal.as_str())
            .filter(|signal| self.is_excitation(signal));
        class
            .recognition
            .inputs()
            .into_iter()
            .chain(excited)
            .collect()
    }

    /// First and last step of the class's inputs; of the pilot's controls, first and last
    /// deflection.
    pub fn excited_s(&self, class: &Class) -> Option<(f64, f64)> {
        if *self.kind != Kind::Onboard {
            return Some((self.from_s, self.to_s));
        }
        let inputs = self.inputs(class);
        let times = || {
            inputs
                .iter()
                .flat_map(|s| self.steps_of(s))
                .map(|s| s.time_s)
        };
        Some((
            times().min_by(f64::total_cmp)?,
            times().max_by(f64::total_cmp)?,
        ))
    }

    /// How many steps the class's inputs make.
    pub fn explained(&self, class: &Class) -> usize {
        self.inputs(class)
            .iter()
            .map(|s| self.steps_of(s).len())
            .sum()
    }

    /// How often each of some signals steps, in words: `de_deg 5, dpv_deg 1`.
    pub fn count_all<'b>(&self, signals: impl Iterator<Item = &'b str>) -> String {
        let counted: BTreeMap<&str, usize> = signals.map(|s| (s, self.steps_of(s).len())).collect();
        let words: Vec<String> = counted
            .iter()
            .filter(|(_, n)| **n > 0)
            .map(|(signal, n)| format!("{signal} {n}"))
            .collect();
        words.join(", ")
    }

    /// All that is said of a maneuver of a class in this stretch.
    pub fn recognised(&self, class: &Class, (first_s, last_s): (f64, f64)) -> Recognised {
        let inputs = self.inputs(class);
        let voices = self.voices(class);
        let confidence = voices.iter().map(|v| v.weight).product::<f64>();
        let evidence: Vec<&str> = voices
            .iter()
            .map(|v| v.words.as_str())
            .filter(|w| !w.is_empty())
            .collect();
        Recognised {
            first_input_s: Some(first_s),
            last_input_s: Some(last_s),
            inputs: self.count_all(inputs.iter().copied()),
            followed: self.followed(&inputs),
            confidence: Some(confidence),
            evidence: evidence.join("; "),
        }
    }

    /// How sure a class is, from 0 to 1.
    pub fn confidence(&self, class: &Class) -> f64 {
        self.voices(class).iter().map(|v| v.weight).product()
    }

    /// Signals other than the inputs that step during the maneuver: by gearing or feedback.
    fn followed(&self, inputs: &BTreeSet<&str>) -> String {
        let scene = self.scene;
        let steps = |s: &&String| {
            !scene
                .steps
                .between(s, self.from_s - self.slack_s(), self.to_s + self.slack_s())
                .is_empty()
        };
        let others = scene
            .steps
            .of
            .keys()
            .filter(|s| !inputs.contains(s.as_str()))
            .filter(steps);
        others.map(String::as_str).collect::<Vec<_>>().join(", ")
    }

    /// What was asked about the class beyond its inputs, and what it answers. The weights are
    /// judgements: a contradiction of a flag, which may be stuck, costs a fifth; a question that
    /// nothing recorded answers, a twentieth.
    fn voices(&self, class: &Class) -> Vec<Voice> {
        let rule = &class.recognition;
        let mut voices = Vec::new();
        let mut say = |weight: f64, words: String| voices.push(Voice { weight, words });
        for (flag, wanted) in &rule.flags {
            let word = |up: bool| if up { "up" } else { "down" };
            match self.flag(flag) {
                Some(up) if up == *wanted => say(1.0, format!("{flag} is {}", word(up))),
                Some(up) => say(0.8, format!("although {flag} is {}", word(up))),
                None => say(0.95, format!("{flag} is not recorded")),
            }
        }
        for (signal, wanted) in &rule.moves {
            match self.moves(signal) {
                Some(_) => say(
                    1.0,
                    format!("{signal} {}", if *wanted { "moves" } else { "rests" }),
                ),
                None => say(0.9, format!("{signal} says nothing")),
            }
        }
        for (signal, pulses) in &rule.pulses {
            if let Ok(fit) = patterns::pulses(&self.steps_of(signal), pulses) {
                say(
                    1.0 - 0.5 * fit.deviation / pulses.tolerance,
                    format!("{signal} pulses of {:.2} s the unit", fit.unit_s),
                );
            }
        }
        if !self.scene.sees_pilot {
            say(0.9, "no pilot control is recorded".into());
        }
        voices
    }
}
