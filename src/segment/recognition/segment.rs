//! A segment of a record, from its first step to its last, and the activity of its signals.

use std::collections::{BTreeMap, BTreeSet};

use super::detections::Detections;
use super::sequences::{Source, StepSequence};
use crate::maneuver::Class;
use crate::numerics::statistics::order_statistics::trimmed_range;
use crate::segment::steps::step::Step;

/// Share of the samples at either end of a signal's range that may be spikes or a short excursion. Trade-off: of
/// a segment of 10 s it leaves out 0.2 s. A larger share would leave out a short pulse, a smaller one would
/// count a spike of a few samples as motion.
const OUTLYING: f64 = 0.02;

/// Least range, in smallest steps, of a signal that moves: from side to side.
const MOVES: f64 = 2.0;

/// Largest range, in smallest steps, of a signal at rest. A signal between the two ranges counts
/// neither as moving nor as at rest.
const RESTS: f64 = 0.5;

/// Least size, in smallest steps, of a reversal: from side to side.
const REVERSAL: f64 = 2.0;

/// A segment of a record from its first step to its last.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment<'a> {
    pub detections: &'a Detections<'a>,
    pub source: &'a Source,
    pub from_s: f64,
    pub to_s: f64,
}

impl<'a> Segment<'a> {
    /// The segment of the steps `first..end` of a sequence.
    pub fn of_steps(
        detections: &'a Detections<'a>,
        sequence: &'a StepSequence<'a>,
        (first, end): (usize, usize),
    ) -> Segment<'a> {
        let time_s = |k: usize| sequence.steps.get(k).map_or(f64::NAN, |s| s.time_s);
        Segment {
            detections,
            source: &sequence.source,
            from_s: time_s(first),
            to_s: time_s(end.saturating_sub(1)),
        }
    }

    pub fn is_onboard(&self) -> bool {
        *self.source == Source::Onboard
    }

    /// First and last time at which a step belongs to the segment: the detector places a step
    /// within half its transit.
    fn reach_s(&self) -> (f64, f64) {
        let slack_s = self.detections.settings.transit_s / 2.0;
        (self.from_s - slack_s, self.to_s + slack_s)
    }

    /// Steps of a signal that stand out from feedback: at least a fraction of the signal's largest
    /// step, reduced by the possible effect of turbulence. For a surface that the on-board system
    /// moves, only the uncommanded steps.
    pub fn steps_of(&self, signal: &str) -> Vec<&'a Step> {
        let detections = self.detections;
        let steps = if self.is_onboard() && !detections.is_pilot_control(signal) {
            &detections.uncommanded
        } else {
            &detections.steps
        };
        let (from_s, to_s) = self.reach_s();
        let inside = steps.between(signal, from_s, to_s);
        let largest = inside.iter().map(Step::size).fold(0.0, f64::max);
        let least =
            detections.settings.outstanding_share * largest - detections.steps.noise(signal);
        inside.iter().filter(|s| s.size() >= least).collect()
    }

    /// Number of steps of a signal that count against a class: none for a surface that hardly moves
    /// beside the others, which is feedback.
    pub fn count_against(&self, signal: &str) -> usize {
        let detections = self.detections;
        let is_control = detections.is_pilot_control(signal);
        let largest = detections
            .steps
            .by_signal
            .keys()
            .filter(|other| detections.is_pilot_control(other) == is_control)
            .map(|other| self.relative_size(other))
            .fold(0.0, f64::max);
        if self.relative_size(signal) < detections.settings.outstanding_share * largest {
            0
        } else {
            self.steps_of(signal).len()
        }
    }

    /// Largest step of a signal in its smallest steps.
    fn relative_size(&self, signal: &str) -> f64 {
        let smallest = self.detections.steps.smallest(signal);
        self.steps_of(signal)
            .iter()
            .map(|s| s.size() / smallest)
            .fold(0.0, f64::max)
    }

    /// `true` for a signal that moves, false for one at rest; `None` for a signal in between, or
    /// one that is not recorded.
    pub fn moves(&self, signal: &str) -> Option<bool> {
        let record = self.detections.record;
        let (first, last) = (record.sample_at(self.from_s), record.sample_at(self.to_s));
        let mut finite: Vec<f64> = record.values(signal)?.get(first..=last)?.to_vec();
        finite.retain(|v| v.is_finite());
        let range = trimmed_range(finite, OUTLYING)?;
        let smallest = self.detections.steps.by_signal.get(signal)?.smallest;
        let moves = range >= MOVES * smallest;
        (moves || range <= RESTS * smallest).then_some(moves)
    }

    /// `true` if a flag is up for most of the segment; `None` if it is not recorded.
    pub fn flag_is_up(&self, flag: &str) -> Option<bool> {
        self.detections
            .flag_is_mostly_up(flag, (self.from_s, self.to_s))
    }

    /// `true` for `fewest_steps` steps of a signal to alternating sides, at least one of which is a
    /// reversal.
    pub fn is_excitation(&self, signal: &str) -> bool {
        let steps = self.steps_of(signal);
        let turns = steps.windows(2).filter(|s| s[0].opposes(s[1])).count();
        let reversal = REVERSAL * self.detections.steps.smallest(signal);
        turns + 1 >= self.detections.settings.fewest_steps
            && steps.iter().any(|s| s.size() >= reversal)
    }

    /// The inputs of a class in this segment.
    ///
    /// They are the signals that must step, and those signals that may step as often as a doublet
    /// and are excited. Fewer steps of the latter are feedback.
    pub fn inputs<'c>(&self, class: &'c Class) -> BTreeSet<&'c str> {
        let fewest = self.detections.settings.fewest_steps;
        let excited = class
            .recognition
            .steps
            .iter()
            .filter(|(_, count)| count.at_least == 0 && count.at_most >= fewest)
            .map(|(signal, _)| signal.as_str())
            .filter(|signal| self.is_excitation(signal));
        class
            .recognition
            .inputs()
            .into_iter()
            .chain(excited)
            .collect()
    }

    /// Times of the first and the last step of a class's inputs; for pilot controls, of the first
    /// and the last deflection.
    pub fn excited_s(&self, class: &Class) -> Option<(f64, f64)> {
        if !self.is_onboard() {
            return Some((self.from_s, self.to_s));
        }
        let times: Vec<f64> = self
            .inputs(class)
            .iter()
            .flat_map(|signal| self.steps_of(signal))
            .map(|step| step.time_s)
            .collect();
        Some((
            times.iter().copied().min_by(f64::total_cmp)?,
            times.iter().copied().max_by(f64::total_cmp)?,
        ))
    }

    /// Number of steps that the inputs of a class make.
    pub fn count_explained(&self, class: &Class) -> usize {
        self.inputs(class)
            .iter()
            .map(|signal| self.steps_of(signal).len())
            .sum()
    }

    /// The number of steps of each of some signals, in words: `de_deg 5, dpv_deg 1`.
    pub fn count_in_words<'b>(&self, signals: impl Iterator<Item = &'b str>) -> String {
        let counts: BTreeMap<&str, usize> = signals
            .map(|signal| (signal, self.steps_of(signal).len()))
            .collect();
        let words: Vec<String> = counts
            .iter()
            .filter(|(_, n)| **n > 0)
            .map(|(signal, n)| format!("{signal} {n}"))
            .collect();
        words.join(", ")
    }

    /// The signals other than the inputs that step during the segment, by gearing or feedback.
    pub fn followers(&self, inputs: &BTreeSet<&str>) -> String {
        let steps = &self.detections.steps;
        let (from_s, to_s) = self.reach_s();
        steps
            .by_signal
            .keys()
            .map(String::as_str)
            .filter(|signal| !inputs.contains(signal))
            .filter(|signal| !steps.between(signal, from_s, to_s).is_empty())
            .collect::<Vec<_>>()
            .join(", ")
    }
}
