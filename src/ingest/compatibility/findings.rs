//! What was found of each instrument, in words and rows, and what the record is to be corrected by.

use std::collections::BTreeMap;

use super::joint_fit::{Errors, MODEL_SCALE};
use super::parameters::{ALL_KINDS, INSTRUMENTS, KINDS, Kind, SIGNALS, observable, place};
use super::settings::{Action, Compatibility, OnFault};
use crate::error::{Problem, ProblemStage};
use crate::flight::{Channel, Correction, signal};
use crate::tables::{InstrumentRow, InstrumentVerdict};
use crate::units::Unit;

/// The equations themselves are held to be no better than this, nor the clock.
const MODEL_BIAS: f64 = 0.01; // of an ordinary bias
const MODEL_DELAY_S: f64 = 0.001;

/// A parameter is told by the flight when its bound is at most this share of what was thought
/// before.
const TOLD: f64 = 0.7;

/// One parameter of an instrument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    pub value: f64,
    /// Standard deviation.
    pub bound: f64,
    /// Many times its bound and beyond what is ordinary.
    pub fault: bool,
    /// As large as a fault and not as sure: neither named nor corrected.
    pub doubtful: bool,
    /// Whether the record is corrected by it.
    pub applied: bool,
}

/// What the flight tells of one instrument; none for what it does not tell.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    pub signal: &'static str,
    pub channel: String,
    pub estimates: [Option<Estimate>; KINDS],
}

/// What the flight tells of its instruments.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings(pub Vec<Finding>);

impl Findings {
    /// One for each recorded instrument.
    #[must_use]
    pub fn of(
        errors: Option<&Errors>,
        channels: &BTreeMap<String, Channel>,
        recorded: &[String],
        settings: &Compatibility,
    ) -> Findings {
        let finding = |i: usize| {
            let signal = SIGNALS[i];
            let (channel, _) = channels.iter().find(|(_, c)| c.signal == signal)?;
            let mut estimates =
                ALL_KINDS.map(|kind| errors.and_then(|errors| estimate(errors, i, kind, settings)));
            correct_together(&mut estimates, settings);
            recorded.iter().any(|s| s == signal).then(|| Finding {
                signal,
                channel: channel.clone(),
                estimates,
            })
        };
        Findings((0..INSTRUMENTS).filter_map(finding).collect())
    }

    /// Whether an instrument has a fault.
    #[must_use]
    pub fn faulty(&self) -> bool {
        self.0.iter().any(|f| !f.faults().is_empty())
    }

    /// Whether one has that the equations cannot do without.
    #[must_use]
    pub fn required_faulty(&self) -> bool {
        self.0
            .iter()
            .any(|f| signal::REQUIRED.contains(&f.signal) && !f.faults().is_empty())
    }

    /// The same with every fault applied.
    #[must_use]
    pub fn freed(&self) -> Findings {
        let mut freed = self.clone();
        for estimate in freed
            .0
            .iter_mut()
            .flat_map(|f| f.estimates.iter_mut().flatten())
        {
            estimate.applied |= estimate.fault;
        }
        freed
    }

    /// The same with nothing applied.
    #[must_use]
    pub fn reported(mut self) -> Findings {
        for estimate in self
            .0
            .iter_mut()
            .flat_map(|f| f.estimates.iter_mut().flatten())
        {
            estimate.applied = false;
        }
        self
    }

    /// What the record is to be corrected by.
    #[must_use]
    pub fn corrections(&self) -> Vec<Correction> {
        let correction = |finding: &Finding| {
            let of = |kind: Kind| {
                finding.estimates[kind as usize]
                    .filter(|e| e.applied)
                    .map_or(0.0, |e| e.value)
            };
            let (bias, scale, delay_s) = (of(Kind::Bias), of(Kind::Scale), of(Kind::Delay));
            let counts = (bias, scale, delay_s) != (0.0, 0.0, 0.0);
            counts.then(|| Correction {
                signal: finding.signal.to_owned(),
                bias,
                scale,
                delay_s,
            })
        };
        self.0.iter().filter_map(correction).collect()
    }

    /// Rows of the table `instruments`.
    #[must_use]
    pub fn rows(&self, flight_id: &str) -> Vec<InstrumentRow> {
        self.0.iter().map(|f| f.row(flight_id)).collect()
    }

    /// A problem for each instrument with a fault.
    #[must_use]
    pub fn problems(&self, flight_id: &str) -> Vec<Problem> {
        let faulty = self.0.iter().filter(|f| !f.faults().is_empty());
        faulty
            .map(|f| Problem {
                stage: ProblemStage::Ingest,
                flight_id: flight_id.to_owned(),
                place: format!("channel `{}`", f.channel),
                reason: format!("{}; {}", f.accusation(), f.consequence()),
            })
            .collect()
    }

    /// All faults in one sentence; none where there is none.
    #[must_use]
    pub fn fault_summary(&self) -> Option<String> {
        let all: Vec<String> = self
            .0
            .iter()
            .filter(|f| !f.faults().is_empty())
            .map(Finding::accusation)
            .collect();
        (!all.is_empty()).then(|| all.join("; "))
    }

    /// What is wrong with the channel of a signal, in words.
    #[must_use]
    pub fn verdict(&self, signal: &str) -> Option<String> {
        let finding = self.0.iter().find(|f| f.signal == signal)?;
        let faults = finding.faults();
        (!faults.is_empty()).then(|| faults.join(", "))
    }
}

/// What the fit says of one parameter; none where the flight does not tell it.
fn estimate(
    errors: &Errors,
    instrument: usize,
    kind: Kind,
    settings: &Compatibility,
) -> Option<Estimate> {
    let j = place(instrument, kind);
    let (value, ordinary) = (errors.values[j], settings.ordinary.of(instrument, kind));
    let model = match kind {
        Kind::Bias => MODEL_BIAS * ordinary,
        Kind::Scale => MODEL_SCALE,
        Kind::Delay => MODEL_DELAY_S,
    };
    if !observable(instrument, kind)
        || errors.bounds[j] <= 0.0
        || errors.bounds[j] > TOLD * errors.prior[j]
    {
        return None;
    }
    let bound = errors.bounds[j].hypot(model);
    let limit = settings.faulty.of(instrument, kind);
    let surely =
        settings.standard_errors_of_fault(kind, value) * errors.fault_bounds[j].hypot(model);
    let fault = value.abs() > limit && value.abs() > surely;
    let action = match kind {
        Kind::Bias => settings.bias,
        Kind::Scale => settings.scale,
        Kind::Delay => settings.delay,
    };
    let doubtful = value.abs() > limit && !fault;
    let counts = value.abs() > settings.standard_errors * bound && !doubtful;
    let applied = if fault {
        settings.fault == OnFault::Apply
    } else {
        action == Action::Apply && counts
    };
    Some(Estimate {
        value,
        bound,
        fault,
        doubtful,
        applied,
    })
}

/// A bias and a scale error are estimated together and make sense together: where one is applied so
/// is the other.
fn correct_together(estimates: &mut [Option<Estimate>; KINDS], settings: &Compatibility) {
    let [bias, scale, _] = estimates;
    if let (Some(bias), Some(scale)) = (bias, scale)
        && (bias.applied || scale.applied)
    {
        bias.applied |= settings.bias == Action::Apply && !bias.fault && !bias.doubtful;
        scale.applied |= settings.scale == Action::Apply && !scale.fault && !scale.doubtful;
    }
}

impl Finding {
    /// Each fault in words.
    fn faults(&self) -> Vec<String> {
        let fault = |kind: Kind| {
            let e = self.estimates[kind as usize].filter(|e| e.fault)?;
            Some(match kind {
                Kind::Bias => format!("off by {:.3} {}", e.value, self.unit()),
                Kind::Scale => format!("reads {:.3} times what it should", 1.0 + e.value),
                Kind::Delay if e.value > 0.0 => format!("delayed by {:.0} ms", 1e3 * e.value),
                Kind::Delay => format!("ahead by {:.0} ms", -1e3 * e.value),
            })
        };
        ALL_KINDS.into_iter().filter_map(fault).collect()
    }

    fn unit(&self) -> &'static str {
        Unit::of_signal(self.signal).name
    }

    fn accusation(&self) -> String {
        let bound = |kind: Kind| {
            let e = self.estimates[kind as usize].filter(|e| e.fault)?;
            Some(match kind {
                Kind::Bias => format!("bound {:.3} {}", e.bound, self.unit()),
                Kind::Scale => format!("bound {:.3}", e.bound),
                Kind::Delay => format!("bound {:.0} ms", 1e3 * e.bound),
            })
        };
        let bounds: Vec<String> = ALL_KINDS.into_iter().filter_map(bound).collect();
        let (faults, bounds) = (self.faults().join(", "), bounds.join(", "));
        format!(
            "`{}` is {faults} against the other channels ({bounds})",
            self.channel
        )
        .replace("is reads", "reads")
    }

    fn consequence(&self) -> &'static str {
        if self
            .estimates
            .iter()
            .flatten()
            .any(|e| e.fault && e.applied)
        {
            "the record is corrected by it. Look after the instrument or the recorder"
        } else {
            "the channel is left as recorded. Look after the instrument or the recorder, or have it corrected \
             (ingest: compatibility: fault: apply)"
        }
    }

    fn row(&self, flight_id: &str) -> InstrumentRow {
        let of = |kind: Kind| self.estimates[kind as usize];
        let value = |kind: Kind| of(kind).map(|e| e.value);
        let bound = |kind: Kind| of(kind).map(|e| e.bound);
        let applied: Vec<&str> = ALL_KINDS
            .into_iter()
            .filter(|k| of(*k).is_some_and(|e| e.applied))
            .map(name)
            .collect();
        let faults = self.faults();
        let told = self.estimates.iter().any(Option::is_some);
        let verdict = match (faults.is_empty(), told) {
            (false, _) => InstrumentVerdict::Fault(faults.join(", ")),
            (true, true) if of(Kind::Delay).is_none() => InstrumentVerdict::NoDelay,
            (true, true) => InstrumentVerdict::Ok,
            (true, false) => InstrumentVerdict::NotExcited,
        };
        InstrumentRow {
            flight_id: flight_id.to_owned(),
            channel: self.channel.clone(),
            signal: self.signal.to_owned(),
            unit: self.unit().to_owned(),
            bias: value(Kind::Bias),
            bias_bound: bound(Kind::Bias),
            scale: value(Kind::Scale).map(|s| 1.0 + s),
            scale_bound: bound(Kind::Scale),
            delay_s: value(Kind::Delay),
            delay_bound_s: bound(Kind::Delay),
            applied: applied.join(" "),
            verdict,
        }
    }
}

fn name(kind: Kind) -> &'static str {
    match kind {
        Kind::Bias => "bias",
        Kind::Scale => "scale",
        Kind::Delay => "delay",
    }
}

#[cfg(test)]
mod tests {
    use super::super::parameters::PARAMETERS;
    use super::*;

    /// What is said of the first vane's error of a kind.
    fn said(kind: Kind, value: f64, bound: f64, fault_bound: f64) -> Estimate {
        let j = place(6, kind);
        let mut errors = Errors {
            values: [0.0; PARAMETERS],
            bounds: [bound; PARAMETERS],
            fault_bounds: [fault_bound; PARAMETERS],
            prior: [1.0; PARAMETERS],
        };
        errors.values[j] = value;
        estimate(&errors, 6, kind, &Compatibility::default()).unwrap()
    }

    #[test]
    fn a_channel_ahead_of_all_others_needs_more_to_be_named_than_one_that_is_late() {
        assert!(said(Kind::Delay, 0.1, 0.02, 0.02).fault);
        let ahead = said(Kind::Delay, -0.1, 0.02, 0.02);
        assert!(!ahead.fault && ahead.doubtful && !ahead.applied);
        assert!(said(Kind::Delay, -0.1, 0.01, 0.01).fault);
    }

    #[test]
    fn what_gusts_may_make_of_a_scale_is_neither_named_nor_corrected() {
        assert!(said(Kind::Scale, -0.35, 0.05, 0.05).fault);
        let gusts = said(Kind::Scale, -0.35, 0.05, 0.2);
        assert!(!gusts.fault && gusts.doubtful && !gusts.applied);
    }
}
