//! Cuts of a sequence of steps into maneuvers, and the search for the best one.
//!
//! A sequence may hold one maneuver, several that follow each other closely, or none. It may be cut
//! at each of its pauses. Dynamic programming over the pauses finds the cut with the least
//! [`Penalties`]: for every pause, the best cut of the steps before it is kept.

use std::cmp::Reverse;

use super::class_match::fits;
use super::detections::Detections;
use super::penalties::Penalties;
use super::segment::Segment;
use super::sequences::{SequenceStep, StepSequence};
use crate::maneuver::Class;
use crate::segment::steps::step::TRIM_SHARE;

/// Largest number of pauses within one maneuver: the limit keeps the time of the search linear in a
/// flight's length. It is three times the number of steps of the longest maneuvers, so it excludes
/// none.
const MOST_PAUSES: usize = 64;

/// Largest number of steps in a gap of the flag within a maneuver: one may be feedback. A flag with
/// more steps in its gap is late or wrong, so the gap is not counted.
const STEPS_IN_FLAG_GAP: usize = 1;

/// A part of the best cut: a maneuver, or steps between maneuvers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CutPart {
    /// The steps `first..end` of the sequence.
    pub steps: (usize, usize),
    pub is_maneuver: bool,
}

/// The best cut of a sequence up to some pause.
#[derive(Clone, Copy, Debug, Default)]
struct Cut<'a> {
    penalties: Penalties,
    /// The burst at which the last part begins.
    from: usize,
    /// The class of the last part; `None` if it is no maneuver.
    class: Option<&'a Class>,
}

/// A segment explained as a maneuver of a class.
#[derive(Clone, Copy, Debug)]
struct ExplainedSegment<'a> {
    class: &'a Class,
    penalties: Penalties,
}

/// The search for the maneuvers in one sequence of steps.
#[derive(Clone, Debug)]
pub(super) struct CutSearch<'s, 'a> {
    pub detections: &'s Detections<'s>,
    /// The classes that are flown with the sequence's source.
    pub classes: Vec<&'a Class>,
    pub sequence: &'s StepSequence<'s>,
}

impl<'s, 'a> CutSearch<'s, 'a> {
    pub fn segment(&self, steps: (usize, usize)) -> Segment<'s> {
        Segment::of_steps(self.detections, self.sequence, steps)
    }

    /// Finds the best cut: the parts of the sequence in order, and the penalties.
    pub fn best_cut(&self) -> (Vec<CutPart>, Penalties) {
        let bursts = self.bursts();
        let mut best: Vec<Cut> = vec![Cut::default()];
        for end in 1..=bursts.len() {
            let cut = self.best_cut_before(&bursts[..end], &best);
            best.push(cut);
        }
        let penalties = best[bursts.len()].penalties;
        let mut parts = Vec::new();
        let mut end = bursts.len();
        while end > 0 {
            let from = best[end].from;
            parts.push(CutPart {
                steps: (bursts[from].0, bursts[end - 1].1),
                is_maneuver: best[end].class.is_some(),
            });
            end = from;
        }
        parts.reverse();
        (parts, penalties)
    }

    /// Bursts of the sequence: steps that follow each other without a pause, as `first..end`.
    fn bursts(&self) -> Vec<(usize, usize)> {
        let pause_s = self.detections.settings.shortest_pause_s;
        let mut end = 0;
        self.sequence
            .steps
            .chunk_by(|a, b| b.time_s - a.time_s < pause_s)
            .map(|burst| {
                let first = end;
                end += burst.len();
                (first, end)
            })
            .collect()
    }

    /// The best cut of some bursts, given the best cuts of fewer of them.
    fn best_cut_before(&self, bursts: &[(usize, usize)], best: &[Cut<'a>]) -> Cut<'a> {
        let end = bursts.len();
        let last = bursts[end - 1];
        let mut chosen = Cut {
            penalties: best[end - 1].penalties
                + Penalties {
                    unexplained_steps: last.1 - last.0,
                    ..Penalties::default()
                },
            from: end - 1,
            class: None,
        };
        for from in (end.saturating_sub(MOST_PAUSES)..end).rev() {
            let steps = (bursts[from].0, last.1);
            let Some(explanation) = self.explain(steps) else {
                continue;
            };
            let before = best[from];
            let previous = before
                .class
                .map(|class| (class, (bursts[before.from].0, steps.0)));
            let cut = Cut {
                penalties: before.penalties
                    + explanation.penalties
                    + self.pause_penalties(previous, explanation.class, steps),
                from,
                class: Some(explanation.class),
            };
            if cut.penalties < chosen.penalties {
                chosen = cut;
            }
        }
        chosen
    }

    /// Explains a segment by the class that leaves the fewest steps unexplained; `None` if it fits
    /// no class.
    fn explain(&self, steps: (usize, usize)) -> Option<ExplainedSegment<'a>> {
        let segment = self.segment(steps);
        self.classes
            .iter()
            .filter(|class| fits(&segment, class))
            .map(|class| self.explain_by(class, &segment, steps))
            .min_by_key(|e| (e.penalties.unexplained_steps, e.penalties.steps_in_pulses))
    }

    fn explain_by(
        &self,
        class: &'a Class,
        segment: &Segment,
        (first, end): (usize, usize),
    ) -> ExplainedSegment<'a> {
        let steps = self.sequence.steps.get(first..end).unwrap_or_default();
        let inputs = segment.inputs(class);
        let pulses = &class.recognition.pulses;
        let share = self.detections.settings.outstanding_share;
        let returns = steps
            .chunk_by(|a, b| a.signal == b.signal)
            .count()
            .saturating_sub(inputs.len());
        let away_from_trim = inputs
            .iter()
            .filter(|input| ends_away(&changes_of(input, steps), share))
            .count();
        let in_pulses = pulses
            .iter()
            .map(|(signal, p)| changes_of(signal, steps).len().min(p.widths.len() + 1))
            .sum();
        ExplainedSegment {
            class,
            penalties: Penalties {
                unexplained_steps: steps.iter().filter(|s| !inputs.contains(s.signal)).count(),
                steps_in_pulses: Reverse(in_pulses),
                flag_gaps: self.count_flag_gaps(class, segment, steps),
                maneuvers: 1,
                loose_ends: returns + away_from_trim,
                ..Penalties::default()
            },
        }
    }

    /// Counts the gaps of the excitation flag within a maneuver for which the flag should be up.
    fn count_flag_gaps(&self, class: &Class, segment: &Segment, steps: &[SequenceStep]) -> usize {
        let flag = &self.detections.settings.excitation_flag;
        if !segment.is_onboard() || class.recognition.flags.get(flag) != Some(&true) {
            return 0;
        }
        let steps_within = |from_s: f64, to_s: f64| {
            steps
                .iter()
                .filter(|s| (from_s..=to_s).contains(&s.time_s))
                .count()
        };
        self.detections
            .flag_gaps
            .iter()
            .filter(|(from_s, to_s)| segment.from_s < *from_s && *to_s < segment.to_s)
            .filter(|(from_s, to_s)| steps_within(*from_s, *to_s) <= STEPS_IN_FLAG_GAP)
            .count()
    }

    /// Penalties of the pause between a maneuver and the previous one.
    fn pause_penalties(
        &self,
        previous: Option<(&Class, (usize, usize))>,
        class: &Class,
        steps: (usize, usize),
    ) -> Penalties {
        let Some((previous_class, previous_steps)) = previous else {
            return Penalties::default();
        };
        let all = &self.sequence.steps;
        let pause_s = all[steps.0].time_s - all[steps.0 - 1].time_s;
        let whole_s = previous_class.recognition.decay_s + class.recognition.lead_in_s
            - self.detections.settings.transit_s;
        let is_repeated = || {
            self.order_of_inputs(previous_class, previous_steps)
                == self.order_of_inputs(previous_class, steps)
        };
        let is_unlike = previous_class.name == class.name && !is_repeated();
        Penalties {
            short_pauses: usize::from(pause_s < whole_s),
            unlike_repeats: usize::from(is_unlike),
            pauses_s: Reverse(pause_s),
            ..Penalties::default()
        }
    }

    /// The order in which the inputs of a class step in a segment, and the number of times that
    /// each steps before another does.
    fn order_of_inputs(&self, class: &Class, steps: (usize, usize)) -> Vec<(&str, usize)> {
        let inputs = self.segment(steps).inputs(class);
        let signals: Vec<&str> = self
            .sequence
            .steps
            .get(steps.0..steps.1)
            .unwrap_or_default()
            .iter()
            .map(|s| s.signal)
            .filter(|signal| inputs.contains(signal))
            .collect();
        signals
            .chunk_by(|a, b| a == b)
            .map(|run| (run[0], run.len()))
            .collect()
    }
}

fn changes_of(signal: &str, steps: &[SequenceStep]) -> Vec<f64> {
    steps
        .iter()
        .filter(|s| s.signal == signal)
        .map(|s| s.change)
        .collect()
}

/// `true` for a signal that does not end near its beginning, by those of its changes that stand out
/// from feedback.
fn ends_away(changes: &[f64], outstanding_share: f64) -> bool {
    let largest = changes.iter().map(|c| c.abs()).fold(0.0, f64::max);
    let moved: f64 = changes
        .iter()
        .filter(|c| c.abs() >= outstanding_share * largest)
        .sum();
    moved.abs() > TRIM_SHARE * largest
}
