//! Estimates of the errors of instruments, with the decision on each: fault, doubtful, corrected; and
//! the evidence of a flight alone on them.

use serde::{Deserialize, Serialize};

use super::error_bounds::MODEL_SCALE;
use super::joint_fit::FittedErrors;
use super::joint_state::{is_at_limit, without_prior};
use super::parameters::{KINDS, Kind, SIGNALS, is_observable, place};
use super::settings::{Action, Compatibility, OnFault};
use crate::tables::InstrumentError;

/// Error of the equations in a bias, as a fraction of an ordinary bias. For an accelerometer it is
/// 10⁻⁴ g, the size of the gravity anomalies, which normal gravity leaves out. Smaller: all flights
/// would share an error that their bounds do not contain. Larger: common errors of many flights
/// would be found less often.
const MODEL_BIAS: f64 = 0.01;

/// Error of the clock in a delay, s. Recorders state times to the millisecond, and a tenth of an
/// ordinary delay changes no verdict on one flight.
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
    /// Scatter of the error within the flight, no larger than an ordinary error.
    pub scatter: f64,
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
pub fn evidence(
    errors: &FittedErrors,
    instrument: usize,
    kind: Kind,
    settings: &Compatibility,
) -> Option<ErrorEvidence> {
    let j = place(instrument, kind);
    let (share, variance) = (errors.data_shares[j], errors.bounds[j].powi(2));
    let (factor, own_variance) = without_prior(share, variance, errors.prior[j]);
    let is_inside = !is_at_limit(j, errors.values[j], settings);
    let is_informative =
        is_observable(instrument, kind) && own_variance > 0.0 && share > LEAST_SHARE;
    (is_informative && is_inside).then(|| ErrorEvidence {
        signal: SIGNALS[instrument].to_owned(),
        error: instrument_error(kind),
        value: factor * errors.values[j],
        bound: own_variance.sqrt(),
        ordinary: settings.ordinary.of(instrument, kind),
        systematic: errors.systematic[j].hypot(model_error(instrument, kind, settings)),
    })
}

/// Error of an instrument that a kind of parameter describes.
pub fn instrument_error(kind: Kind) -> InstrumentError {
    match kind {
        Kind::Bias => InstrumentError::Bias,
        Kind::Scale => InstrumentError::Scale,
        Kind::Delay => InstrumentError::Delay,
    }
}

/// Estimate of one parameter; `None` if the flight does not determine it.
pub fn estimate(
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
    let significant = settings.standard_errors_of_fault(kind, value) * bound;
    let at_limit = is_at_limit(j, value, settings);
    let fault = at_limit || value.abs() > limit && value.abs() > significant;
    let doubtful = value.abs() > limit && !fault;
    let applied = if fault {
        settings.fault == OnFault::Apply && !at_limit
    } else {
        settings.corrects(instrument_error(kind), value, bound) && !doubtful
    };
    let ordinary = settings.ordinary.of(instrument, kind);
    Some(ErrorEstimate {
        value,
        bound,
        scatter: errors.scatter[j].min(ordinary),
        fault,
        doubtful,
        at_limit,
        applied,
    })
}

/// Applies the corrections of a bias and a scale error together: their estimates are correlated, so
/// if one is applied the other is too.
pub fn correct_together(estimates: &mut [Option<ErrorEstimate>; KINDS], settings: &Compatibility) {
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
pub fn has_estimate_at_limit(estimates: &[Option<ErrorEstimate>; KINDS]) -> bool {
    estimates.iter().flatten().any(|estimate| estimate.at_limit)
}

/// Marks all errors of an instrument as not corrected.
pub fn withdraw_corrections(estimates: &mut [Option<ErrorEstimate>; KINDS]) {
    for estimate in estimates.iter_mut().flatten() {
        estimate.applied = false;
    }
}

#[cfg(test)]
pub mod tests {
    use super::super::parameters::PARAMETERS;
    use super::*;

    /// Estimate of the first vane's error of a kind.
    pub fn estimated(kind: Kind, value: f64, bound: f64) -> ErrorEstimate {
        let j = place(6, kind);
        let errors = errors(j, value, bound);
        estimate(&errors, 6, kind, &Compatibility::default()).unwrap()
    }

    /// Fitted errors of a flight that determines all of them to `bound`, with one away from zero.
    pub fn errors(parameter: usize, value: f64, bound: f64) -> FittedErrors {
        let mut errors = FittedErrors {
            values: [0.0; PARAMETERS],
            bounds: [bound; PARAMETERS],
            systematic: [0.0; PARAMETERS],
            scatter: [0.0; PARAMETERS],
            data_shares: [1.0; PARAMETERS],
            prior: [1.0; PARAMETERS],
            speed_ft_s: Some(170.0),
            misfit: 0.0,
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
