//! A step of a signal, and the steps of a record by signal.

use std::collections::BTreeMap;

/// Share of a control's largest step within which the control counts as back at trim.
///
/// A deflection from trim is about half a reversal. Halfway to it, at a quarter of the reversal, a
/// control is as near to trim as to a deflection.
pub(in crate::segment) const TRIM_SHARE: f64 = 0.25;

/// A step of a signal: its time (s on the record's clock) and the levels before and after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::segment) struct Step {
    pub time_s: f64,
    pub before: f64,
    pub after: f64,
}

impl Step {
    pub fn change(&self) -> f64 {
        self.after - self.before
    }

    pub fn size(&self) -> f64 {
        self.change().abs()
    }

    /// `true` for steps to opposite sides.
    pub fn opposes(&self, other: &Step) -> bool {
        self.change() * other.change() < 0.0
    }
}

/// The steps of one signal in order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::segment) struct SignalSteps {
    pub steps: Vec<Step>,
    /// The smallest change that counts as a step.
    pub smallest: f64,
    /// Standard deviation of the signal's own changes if it has raised the smallest step; otherwise
    /// 0.
    pub noise: f64,
}

/// The steps of a record by signal.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::segment) struct Steps {
    pub by_signal: BTreeMap<String, SignalSteps>,
}

impl Steps {
    pub fn of(&self, signal: &str) -> &[Step] {
        self.by_signal
            .get(signal)
            .map_or(&[][..], |of_signal| of_signal.steps.as_slice())
    }

    /// The steps of a signal from one time to another, both included.
    pub fn between(&self, signal: &str, from_s: f64, to_s: f64) -> &[Step] {
        let steps = self.of(signal);
        let first = steps.partition_point(|s| s.time_s < from_s);
        let end = steps.partition_point(|s| s.time_s <= to_s);
        steps.get(first..end.max(first)).unwrap_or_default()
    }

    /// The smallest change of a signal that counts as a step; infinite for a signal without one.
    pub fn smallest(&self, signal: &str) -> f64 {
        self.by_signal
            .get(signal)
            .map_or(f64::INFINITY, |of_signal| of_signal.smallest)
    }

    /// Standard deviation of a signal's own changes if turbulence has raised its smallest step.
    pub fn noise(&self, signal: &str) -> f64 {
        self.by_signal
            .get(signal)
            .map_or(0.0, |of_signal| of_signal.noise)
    }
}
