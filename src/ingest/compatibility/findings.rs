//! Findings on each instrument: estimated errors, faults in words, rows of the table `instruments`,
//! and the corrections of the record.

use std::collections::BTreeMap;

use super::error_bounds::MODEL_SCALE;
use super::joint_fit::FittedErrors;
use super::parameters::{ALL_KINDS, INSTRUMENTS, KINDS, Kind, SIGNALS, is_observable, place};
use super::settings::{Action, Compatibility, OnFault};
use crate::error::{Problem, ProblemStage};
use crate::flight::{Channel, Correction, signal};
use crate::tables::{InstrumentRow, InstrumentVerdict};
use crate::units::Unit;

/// Error of the equations in a bias, as a share of an ordinary bias.
const MODEL_BIAS: f64 = 0.01;

/// Error of the clock in a delay, s.
const MODEL_DELAY_S: f64 = 0.001;

/// Largest bound of an estimated parameter, as a share of its prior. About half of the information
/// then comes from the flight; with a larger bound the estimate is mostly the prior.
const MOST_OF_PRIOR: f64 = 0.7;

/// ErrorEstimate of one error of an instrument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    pub value: f64,
    /// Standard deviation.
    pub bound: f64,
    /// Many times its bound and larger than any ordinary error.
    pub fault: bool,
    /// As large as a fault but not as sure: neither named nor corrected.
    pub doubtful: bool,
    /// `true` where the record is corrected by it.
    pub applied: bool,
}

/// Estimated errors of one instrument; `None` for an error that the flight does not determine.
#[derive(Clone, Debug, PartialEq)]
pub struct InstrumentFinding {
    pub signal: &'static str,
    pub channel: String,
    /// `false` where no window of the flight could be reconstructed.
    pub examined: bool,
    pub estimates: [Option<ErrorEstimate>; KINDS],
}

/// Findings on all recorded instruments of a flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings(pub Vec<InstrumentFinding>);

impl Findings {
    /// Findings for each recorded instrument from the fitted errors.
    #[must_use]
    pub fn of(
        errors: Option<&FittedErrors>,
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
            recorded
                .iter()
                .any(|s| s == signal)
                .then(|| InstrumentFinding {
                    signal,
                    channel: channel.clone(),
                    examined: errors.is_some(),
                    estimates,
                })
        };
        Findings((0..INSTRUMENTS).filter_map(finding).collect())
    }

    /// `true` where an instrument has a fault.
    #[must_use]
    pub fn has_fault(&self) -> bool {
        self.0.iter().any(|f| !f.faults().is_empty())
    }

    /// `true` where an instrument that the equations of motion need has a fault.
    #[must_use]
    pub fn has_required_fault(&self) -> bool {
        self.0
            .iter()
            .any(|f| signal::is_indispensable(f.signal) && !f.faults().is_empty())
    }

    /// These findings with every fault corrected.
    #[must_use]
    pub fn with_faults_corrected(&self) -> Findings {
        let mut corrected = self.clone();
        for estimate in corrected
            .0
            .iter_mut()
            .flat_map(|f| f.estimates.iter_mut().flatten())
        {
            estimate.applied |= estimate.fault;
        }
        corrected
    }

    /// These findings with every fault in doubt: neither named nor corrected.
    #[must_use]
    pub fn without_faults(mut self) -> Findings {
        let estimates = self
            .0
            .iter_mut()
            .flat_map(|f| f.estimates.iter_mut().flatten());
        for estimate in estimates.filter(|estimate| estimate.fault) {
            estimate.doubtful = true;
            estimate.fault = false;
            estimate.applied = false;
        }
        self
    }

    /// These findings with nothing corrected.
    #[must_use]
    pub fn without_corrections(mut self) -> Findings {
        for estimate in self
            .0
            .iter_mut()
            .flat_map(|f| f.estimates.iter_mut().flatten())
        {
            estimate.applied = false;
        }
        self
    }

    /// Corrections of the record.
    #[must_use]
    pub fn corrections(&self) -> Vec<Correction> {
        let correction = |finding: &InstrumentFinding| {
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
                reason: format!("{}; {}", f.fault_sentence(), f.consequence()),
            })
            .collect()
    }

    /// All faults in one sentence; `None` without a fault.
    #[must_use]
    pub fn fault_summary(&self) -> Option<String> {
        let all: Vec<String> = self
            .0
            .iter()
            .filter(|f| !f.faults().is_empty())
            .map(InstrumentFinding::fault_sentence)
            .collect();
        (!all.is_empty()).then(|| all.join("; "))
    }

    /// Faults of the channel of a signal, in words.
    #[must_use]
    pub fn verdict(&self, signal: &str) -> Option<String> {
        let finding = self.0.iter().find(|f| f.signal == signal)?;
        let faults = finding.faults();
        (!faults.is_empty()).then(|| faults.join(", "))
    }
}

/// ErrorEstimate of one parameter; `None` where the flight does not determine it.
fn estimate(
    errors: &FittedErrors,
    instrument: usize,
    kind: Kind,
    settings: &Compatibility,
) -> Option<ErrorEstimate> {
    let j = place(instrument, kind);
    let (value, ordinary) = (errors.values[j], settings.ordinary.of(instrument, kind));
    let model = match kind {
        Kind::Bias => MODEL_BIAS * ordinary,
        Kind::Scale => MODEL_SCALE,
        Kind::Delay => MODEL_DELAY_S,
    };
    if !is_observable(instrument, kind)
        || errors.bounds[j] <= 0.0
        || errors.bounds[j] > MOST_OF_PRIOR * errors.prior[j]
    {
        return None;
    }
    let bound = errors.bounds[j].hypot(model);
    let limit = settings.faulty.of(instrument, kind);
    let surely = settings.standard_errors_of_fault(kind, value) * bound;
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
    Some(ErrorEstimate {
        value,
        bound,
        fault,
        doubtful,
        applied,
    })
}

/// Corrects a bias and a scale error together: their estimates are correlated, so where one is
/// applied the other is too.
fn correct_together(estimates: &mut [Option<ErrorEstimate>; KINDS], settings: &Compatibility) {
    let [bias, scale, _] = estimates;
    if let (Some(bias), Some(scale)) = (bias, scale)
        && (bias.applied || scale.applied)
    {
        bias.applied |= settings.bias == Action::Apply && !bias.fault && !bias.doubtful;
        scale.applied |= settings.scale == Action::Apply && !scale.fault && !scale.doubtful;
    }
}

impl InstrumentFinding {
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

    fn fault_sentence(&self) -> String {
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
        let is_determined = self.estimates.iter().any(Option::is_some);
        let verdict = match (faults.is_empty(), is_determined) {
            (false, _) => InstrumentVerdict::Fault(faults.join(", ")),
            (true, true) if of(Kind::Delay).is_none() => InstrumentVerdict::NoDelay,
            (true, true) => InstrumentVerdict::Ok,
            (true, false) if self.examined => InstrumentVerdict::NotExcited,
            (true, false) => InstrumentVerdict::NotExamined,
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

    /// Estimate of the first vane's error of a kind.
    fn estimated(kind: Kind, value: f64, bound: f64) -> ErrorEstimate {
        let j = place(6, kind);
        let mut errors = FittedErrors {
            values: [0.0; PARAMETERS],
            bounds: [bound; PARAMETERS],
            prior: [1.0; PARAMETERS],
        };
        errors.values[j] = value;
        estimate(&errors, 6, kind, &Compatibility::default()).unwrap()
    }

    #[test]
    fn a_channel_ahead_of_all_others_needs_more_evidence_than_one_that_is_late() {
        assert!(estimated(Kind::Delay, 0.1, 0.02).fault);
        let ahead = estimated(Kind::Delay, -0.1, 0.02);
        assert!(!ahead.fault && ahead.doubtful && !ahead.applied);
        assert!(estimated(Kind::Delay, -0.1, 0.01).fault);
    }

    #[test]
    fn a_scale_error_that_gusts_may_cause_is_neither_named_nor_corrected() {
        assert!(estimated(Kind::Scale, -0.35, 0.05).fault);
        let gusts = estimated(Kind::Scale, -0.35, 0.2);
        assert!(!gusts.fault && gusts.doubtful && !gusts.applied);
    }
}
