//! Findings on each instrument: estimated errors, faults in words, rows of the table `instruments`,
//! and the corrections of the record.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::error_bounds::MODEL_SCALE;
use super::joint_fit::FittedErrors;
use super::joint_state::{is_at_limit, without_prior};
use super::parameters::{ALL_KINDS, INSTRUMENTS, KINDS, Kind, SIGNALS, is_observable, place};
use super::settings::{Action, Compatibility, OnFault};
use crate::error::{Problem, ProblemStage};
use crate::flight::{Channel, Correction, signal};
use crate::tables::{InstrumentError, InstrumentRow, InstrumentVerdict};
use crate::units::Unit;

/// Error of the equations in a bias, as a share of an ordinary bias: 10⁻⁴ g of an accelerometer, the size of
/// gravity's anomalies, which normal gravity leaves out. Smaller: all flights would share an error that their
/// bounds do not contain. Larger: common errors of many flights would be found less often.
const MODEL_BIAS: f64 = 0.01;

/// Error of the clock in a delay, s: recorders state times to the millisecond, and a tenth of an ordinary delay
/// changes no verdict on one flight.
const MODEL_DELAY_S: f64 = 0.001;

/// Largest bound of an estimated parameter, as a share of its prior. About half of the information
/// then comes from the flight. An estimate with a larger bound is mostly the prior.
const MOST_OF_PRIOR: f64 = 0.7;

/// Least share of the information on an error that must come from the flight for evidence: with less,
/// the estimate without prior is rounding.
const LEAST_SHARE: f64 = 0.02;

/// Evidence of a flight alone on one error of an instrument, without the prior.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorEvidence {
    pub signal: String,
    pub error: InstrumentError,
    pub value: f64,
    /// Standard deviation, without the error of the equations.
    pub bound: f64,
    /// Standard deviation of the errors of healthy instruments.
    pub ordinary: f64,
    /// Part of the bound, and error of the equations, that all flights have alike.
    pub systematic: f64,
}

/// Estimate of one error of an instrument.
#[expect(
    clippy::struct_excessive_bools,
    reason = "separate findings on one estimate"
)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    pub value: f64,
    /// Standard deviation.
    pub bound: f64,
    /// `true` if the error is many times its bound, and larger than any ordinary error.
    pub fault: bool,
    /// `true` if the error is as large as a fault but less certain: it is neither named nor
    /// corrected.
    pub doubtful: bool,
    /// `true` at the limit of the search: the error is named, and never corrected.
    pub at_limit: bool,
    /// `true` if the record is corrected by it.
    pub applied: bool,
}

/// Least relative difference of the temperature from the standard atmosphere's that is named: 5 K,
/// by which the derivatives change less than by an ordinary error of q̄.
const SURELY_AIR: f64 = 0.02;

/// Largest relative difference of the temperature: the extremes on record (MIL-STD-210C) are within 20 %
/// of the standard atmosphere's.
const MOST_AIR: f64 = 0.2;

/// Size of both scale errors from which they are certain, and difference up to which they agree, in
/// bounds.
const SURE_BOUNDS: f64 = 4.0;
const AGREEING_BOUNDS: f64 = 3.0;

/// Estimated errors of one instrument; `None` for an error that the flight does not determine.
#[derive(Clone, Debug, PartialEq)]
pub struct InstrumentFinding {
    pub signal: &'static str,
    pub channel: String,
    /// `false` if no window of the flight could be reconstructed.
    pub examined: bool,
    pub estimates: [Option<ErrorEstimate>; KINDS],
    /// Mean airspeed of the windows.
    pub speed_ft_s: Option<f64>,
    /// Evidence of the flight alone on its errors.
    pub evidence: Vec<ErrorEvidence>,
    /// Temperature of the air over that of the standard atmosphere, if it explains the scale error.
    pub air_temperature: Option<f64>,
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
            if has_estimate_at_limit(&estimates) {
                withdraw_corrections(&mut estimates);
            }
            let evidence = ALL_KINDS
                .into_iter()
                .filter_map(|kind| evidence(errors?, i, kind, settings));
            let evidence = evidence.collect();
            recorded
                .iter()
                .any(|s| s == signal)
                .then(|| InstrumentFinding {
                    signal,
                    channel: channel.clone(),
                    examined: errors.is_some(),
                    estimates,
                    speed_ft_s: errors.and_then(|errors| errors.speed_ft_s),
                    evidence,
                    air_temperature: None,
                })
        };
        let mut findings = Findings((0..INSTRUMENTS).filter_map(finding).collect());
        if !recorded.iter().any(|s| s == signal::AIR_TEMPERATURE) {
            findings.leave_to_air_temperature();
        }
        findings
    }

    /// Withdraws corrections of q̄ and Mach whose scale errors are those of another temperature of the
    /// air than the standard atmosphere's. With T times that temperature, q̄ at a speed and a pressure
    /// altitude is 1/T times as large, and Mach 1/√T times.
    fn leave_to_air_temperature(&mut self) {
        let scale = |signal: &str| {
            let finding = self.0.iter().find(|f| f.signal == signal)?;
            finding.estimates[Kind::Scale as usize]
        };
        let (Some(pressure), Some(mach)) = (scale(signal::QBAR), scale(signal::MACH)) else {
            return;
        };
        let (by_pressure, by_mach) = (-pressure.value.ln_1p(), -2.0 * mach.value.ln_1p());
        let bound = pressure.bound.hypot(2.0 * mach.bound);
        let is_sure = |log: f64, bound: f64| log.abs() > SURELY_AIR.max(SURE_BOUNDS * bound);
        let agree = (by_pressure - by_mach).abs() <= AGREEING_BOUNDS * bound;
        let is_air = is_sure(by_pressure, pressure.bound) && is_sure(by_mach, 2.0 * mach.bound);
        if !(is_air && agree && by_pressure.abs() < MOST_AIR) {
            return;
        }
        for finding in &mut self.0 {
            if [signal::QBAR, signal::MACH].contains(&finding.signal) {
                finding.air_temperature = Some(by_pressure.exp());
                for estimate in finding.estimates.iter_mut().flatten() {
                    (estimate.applied, estimate.fault) = (false, false);
                }
            }
        }
    }

    /// `true` if an instrument has a fault.
    #[must_use]
    pub fn has_fault(&self) -> bool {
        self.0.iter().any(|f| !f.faults().is_empty())
    }

    /// `true` if an instrument that the equations of motion need has a fault.
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
        for finding in &mut corrected.0 {
            let is_usable = !has_estimate_at_limit(&finding.estimates);
            for estimate in finding.estimates.iter_mut().flatten() {
                estimate.applied |= estimate.fault && is_usable;
            }
        }
        corrected
    }

    /// These findings with every fault marked as doubtful: neither named nor corrected.
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
        for finding in &mut self.0 {
            withdraw_corrections(&mut finding.estimates);
        }
        self
    }

    /// Signals whose scale error is at the limit of its search, each with the fault in words: no error
    /// of an instrument explains their values.
    pub fn inexplicable(&self) -> impl Iterator<Item = (&'static str, String)> {
        let scale = |f: &InstrumentFinding| f.estimates[Kind::Scale as usize];
        let inexplicable = self
            .0
            .iter()
            .filter(move |f| scale(f).is_some_and(|e| e.at_limit));
        inexplicable.map(|f| (f.signal, f.fault_sentence()))
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

    /// Evidence of the flight alone on the errors of its instruments.
    #[must_use]
    pub fn evidence(&self) -> Vec<ErrorEvidence> {
        self.0.iter().flat_map(|f| f.evidence.clone()).collect()
    }

    /// A problem for each instrument with a fault.
    #[must_use]
    pub fn problems(&self, flight_id: &str) -> Vec<Problem> {
        let reason = |f: &InstrumentFinding| {
            let of_fault = || format!("{}; {}", f.fault_sentence(), f.consequence());
            let is_faulty = !f.faults().is_empty();
            is_faulty.then(of_fault).or_else(|| f.air_sentence())
        };
        let problem = |f: &InstrumentFinding| {
            Some(Problem {
                stage: ProblemStage::Ingest,
                flight_id: flight_id.to_owned(),
                place: format!("channel `{}`", f.channel),
                reason: reason(f)?,
            })
        };
        self.0.iter().filter_map(problem).collect()
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

/// Error of the equations in a parameter.
fn model_error(instrument: usize, kind: Kind, settings: &Compatibility) -> f64 {
    match kind {
        Kind::Bias => MODEL_BIAS * settings.ordinary.of(instrument, kind),
        Kind::Scale => MODEL_SCALE,
        Kind::Delay => MODEL_DELAY_S,
    }
}

/// Evidence on one parameter: estimate and bound without the prior. `None` if the flight has almost
/// no information on it.
fn evidence(
    errors: &FittedErrors,
    instrument: usize,
    kind: Kind,
    settings: &Compatibility,
) -> Option<ErrorEvidence> {
    let j = place(instrument, kind);
    let (share, variance) = (errors.data_shares[j], errors.bounds[j].powi(2));
    let (factor, own_variance) = without_prior(share, variance, errors.prior[j]);
    let is_inside = !is_at_limit(j, errors.values[j], settings);
    let says = is_observable(instrument, kind) && own_variance > 0.0 && share > LEAST_SHARE;
    (says && is_inside).then(|| ErrorEvidence {
        signal: SIGNALS[instrument].to_owned(),
        error: instrument_error(kind),
        value: factor * errors.values[j],
        bound: own_variance.sqrt(),
        ordinary: settings.ordinary.of(instrument, kind),
        systematic: errors.systematic[j].hypot(model_error(instrument, kind, settings)),
    })
}

fn instrument_error(kind: Kind) -> InstrumentError {
    match kind {
        Kind::Bias => InstrumentError::Bias,
        Kind::Scale => InstrumentError::Scale,
        Kind::Delay => InstrumentError::Delay,
    }
}

/// Estimate of one parameter; `None` if the flight does not determine it.
fn estimate(
    errors: &FittedErrors,
    instrument: usize,
    kind: Kind,
    settings: &Compatibility,
) -> Option<ErrorEstimate> {
    let j = place(instrument, kind);
    let value = errors.values[j];
    if !is_observable(instrument, kind)
        || errors.bounds[j] <= 0.0
        || errors.bounds[j] > MOST_OF_PRIOR * errors.prior[j]
    {
        return None;
    }
    let bound = errors.bounds[j].hypot(model_error(instrument, kind, settings));
    let limit = settings.faulty.of(instrument, kind);
    let surely = settings.standard_errors_of_fault(kind, value) * bound;
    let at_limit = is_at_limit(j, value, settings);
    let fault = at_limit || value.abs() > limit && value.abs() > surely;
    let doubtful = value.abs() > limit && !fault;
    let applied = if fault {
        settings.fault == OnFault::Apply && !at_limit
    } else {
        settings.corrects(instrument_error(kind), value, bound) && !doubtful
    };
    Some(ErrorEstimate {
        value,
        bound,
        fault,
        doubtful,
        at_limit,
        applied,
    })
}

/// Applies the corrections of a bias and a scale error together: their estimates are correlated, so
/// if one is applied the other is too.
fn correct_together(estimates: &mut [Option<ErrorEstimate>; KINDS], settings: &Compatibility) {
    let [bias, scale, _] = estimates;
    if let (Some(bias), Some(scale)) = (bias, scale)
        && (bias.applied || scale.applied)
    {
        bias.applied |= settings.bias == Action::Apply && !bias.fault && !bias.doubtful;
        scale.applied |= settings.scale == Action::Apply && !scale.fault && !scale.doubtful;
    }
}

/// `true` if an error is at the limit of its search. The estimates of an instrument's other errors
/// then depend on that limit.
fn has_estimate_at_limit(estimates: &[Option<ErrorEstimate>; KINDS]) -> bool {
    estimates.iter().flatten().any(|estimate| estimate.at_limit)
}

fn withdraw_corrections(estimates: &mut [Option<ErrorEstimate>; KINDS]) {
    for estimate in estimates.iter_mut().flatten() {
        estimate.applied = false;
    }
}

impl InstrumentFinding {
    /// Each fault in words.
    fn faults(&self) -> Vec<String> {
        let fault = |kind: Kind| {
            let e = self.estimates[kind as usize].filter(|e| e.fault)?;
            let words = match kind {
                Kind::Bias => format!("off by {:.3} {}", e.value, self.unit()),
                Kind::Scale => format!("reads {:.3} times what it should", 1.0 + e.value),
                Kind::Delay if e.value > 0.0 => format!("delayed by {:.0} ms", 1e3 * e.value),
                Kind::Delay => format!("ahead by {:.0} ms", -1e3 * e.value),
            };
            Some(if e.at_limit {
                format!("{words} or more, the limit of the search")
            } else {
                words
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
            "`{}` is {faults} against the other channels ({bounds}){}",
            self.channel,
            self.vane_position().unwrap_or_default()
        )
        .replace("is reads", "reads")
    }

    /// Temperature of the air that explains the scale error of q̄, in words.
    fn air_sentence(&self) -> Option<String> {
        let ratio = self.air_temperature?;
        let scale = self.estimates[Kind::Scale as usize]?;
        Some(format!(
            "`{}` reads {:.3} times what it should in the standard atmosphere, as in air of {:.0} % of its temperature. \
             The channel is left as recorded: record the temperature of the air (signal `{}`)",
            self.channel,
            1.0 + scale.value,
            100.0 * ratio,
            signal::AIR_TEMPERATURE
        ))
    }

    /// Position that explains the delay of a vane. The flow at a distance x ahead of the c.g. is α − q x/V,
    /// and in a pitching motion with q ≈ α̇ that is α(t − x/V); likewise β + r x/V with r ≈ −β̇.
    fn vane_position(&self) -> Option<String> {
        let is_vane = matches!(self.signal, signal::ALPHA_VANE | signal::BETA_VANE);
        let delay = self.estimates[Kind::Delay as usize].filter(|e| e.fault && is_vane)?;
        let (distance_ft, speed_ft_s) = (delay.value * self.speed_ft_s?, self.speed_ft_s?);
        let direction = if distance_ft > 0.0 { "ahead" } else { "aft" };
        Some(format!(
            "; a vane {:.1} ft further {direction} than aircraft.yaml has it reads so at {speed_ft_s:.0} ft/s: check its \
             position first",
            distance_ft.abs()
        ))
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
            .map(|kind| instrument_error(kind).name())
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

#[cfg(test)]
mod tests {
    use super::super::parameters::PARAMETERS;
    use super::*;
    use approx::assert_relative_eq;

    /// Estimate of the first vane's error of a kind.
    fn estimated(kind: Kind, value: f64, bound: f64) -> ErrorEstimate {
        let j = place(6, kind);
        let errors = errors(j, value, bound);
        estimate(&errors, 6, kind, &Compatibility::default()).unwrap()
    }

    fn errors(parameter: usize, value: f64, bound: f64) -> FittedErrors {
        let mut errors = FittedErrors {
            values: [0.0; PARAMETERS],
            bounds: [bound; PARAMETERS],
            systematic: [0.0; PARAMETERS],
            data_shares: [1.0; PARAMETERS],
            prior: [1.0; PARAMETERS],
            speed_ft_s: Some(170.0),
        };
        errors.values[parameter] = value;
        errors
    }

    #[test]
    fn a_value_at_the_limit_of_its_search_is_named_and_never_applied() {
        let limit_s = Compatibility::default().longest_delay_s;
        let at_limit = estimated(Kind::Delay, limit_s, 0.001);
        assert!(at_limit.fault && at_limit.at_limit && !at_limit.applied);
        let inside = estimated(Kind::Delay, 0.9 * limit_s, 0.001);
        assert!(inside.fault && inside.applied);
        let j = place(6, Kind::Delay);
        let of = |value| {
            let settings = Compatibility::default();
            evidence(&errors(j, value, 0.001), 6, Kind::Delay, &settings)
        };
        assert!(of(limit_s).is_none() && of(0.9 * limit_s).is_some());
    }

    #[test]
    fn no_error_of_an_instrument_is_corrected_beside_one_at_the_limit_of_its_search() {
        let mach = SIGNALS.iter().position(|s| *s == signal::MACH).unwrap();
        let settings = Compatibility::default();
        let of_scale = |scale: f64| {
            let mut errors = errors(place(mach, Kind::Bias), 0.35, 0.002);
            errors.values[place(mach, Kind::Scale)] = scale;
            let channel = Channel::plain(signal::MACH, "1");
            let channels = BTreeMap::from([("mach".to_owned(), channel)]);
            let recorded = [signal::MACH.to_owned()];
            Findings::of(Some(&errors), &channels, &recorded, &settings)
        };
        let at_limit = of_scale(-0.8);
        assert_eq!(at_limit.corrections(), []);
        assert_eq!(at_limit.with_faults_corrected().corrections(), []);
        let problem = &at_limit.problems("f")[0].reason;
        assert!(problem.contains("left as recorded"), "{problem}");
        let inexplicable: Vec<_> = at_limit.inexplicable().map(|(name, _)| name).collect();
        assert_eq!(inexplicable, [signal::MACH]);
        let inside = of_scale(-0.4);
        assert_eq!(inside.corrections().len(), 1);
        assert_eq!(inside.inexplicable().count(), 0);
    }

    #[test]
    fn scale_errors_of_a_warm_day_correct_nothing_and_name_the_temperature() {
        let instrument = |signal: &str| SIGNALS.iter().position(|s| *s == signal).unwrap();
        let of_scales = |pressure: f64, mach: f64, others: &[&str]| {
            let j = place(instrument(signal::QBAR), Kind::Scale);
            let mut errors = errors(j, pressure, 0.002);
            errors.values[place(instrument(signal::MACH), Kind::Scale)] = mach;
            let channels = [signal::QBAR, signal::MACH]
                .map(|signal| (signal.to_owned(), Channel::plain(signal, "1")));
            let recorded = [signal::QBAR, signal::MACH].iter().chain(others);
            let recorded: Vec<String> = recorded.map(|s| (*s).to_owned()).collect();
            let settings = Compatibility::default();
            Findings::of(
                Some(&errors),
                &BTreeMap::from(channels),
                &recorded,
                &settings,
            )
        };
        let scales = |findings: &Findings| {
            let of = |c: &Correction| (c.signal.clone(), c.scale);
            findings.corrections().iter().map(of).collect::<Vec<_>>()
        };
        // 10 % warmer.
        let (pressure, mach) = (1.0 / 1.1 - 1.0, 1.0 / f64::sqrt(1.1) - 1.0);
        let warm = of_scales(pressure, mach, &[]);
        assert_eq!(scales(&warm), []);
        let problem = &warm.problems("f")[0];
        assert!(problem.reason.contains("110 %"), "{problem:?}");
        let recorded = of_scales(pressure, mach, &[signal::AIR_TEMPERATURE]);
        assert_eq!(scales(&recorded).len(), 2);
        let of_one_instrument = of_scales(pressure, 0.0, &[]);
        assert_relative_eq!(scales(&of_one_instrument)[0].1, pressure);
    }

    #[test]
    fn the_delay_of_a_vane_is_told_with_the_position_that_explains_it() {
        let finding = |signal: &'static str, delay_s: f64| InstrumentFinding {
            signal,
            channel: "vane".to_owned(),
            examined: true,
            estimates: [None, None, Some(estimated(Kind::Delay, delay_s, 0.002))],
            speed_ft_s: Some(170.0),
            evidence: vec![],
            air_temperature: None,
        };
        let ahead = finding(signal::ALPHA_VANE, 0.088).fault_sentence();
        assert!(ahead.contains("15.0 ft further ahead"), "{ahead}");
        let aft = finding(signal::BETA_VANE, -0.088).fault_sentence();
        assert!(aft.contains("15.0 ft further aft"), "{aft}");
        assert!(
            !finding(signal::THETA, 0.088)
                .fault_sentence()
                .contains("vane 15")
        );
    }

    #[test]
    fn evidence_is_the_estimate_without_its_prior() {
        // Prior 0.3 and data 0.4 ± 0.3 have the mean 0.2 and the deviation 0.3/√2.
        let j = place(6, Kind::Bias);
        let mut errors = errors(j, 0.2, 0.3 / 2.0_f64.sqrt());
        errors.prior = [0.3; PARAMETERS];
        errors.data_shares = [0.5; PARAMETERS];
        let found = evidence(&errors, 6, Kind::Bias, &Compatibility::default()).unwrap();
        assert!((found.value - 0.4).abs() < 1e-12 && (found.bound - 0.3).abs() < 1e-12);
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
