//! Joint output-error fit of a flight's windows: each has its own initial state and wind, and all
//! share the instruments' errors.
//!
//! The prior assumes that instruments are ordinary, or rarely wrong by any amount. Its variance is
//! P = size². For an error surely larger than ordinary it is size² + θ²: a Cauchy prior by
//! reweighting. An error that several instruments could explain thus goes to one. After the
//! reweighting, the fit frees errors of their priors one by one. It takes the error that the data
//! alone put most surely beyond the ordinary, until no such error is left. An error that comes out
//! as large as a fault, but is less certain, gets the ordinary prior again.

use rayon::prelude::*;

use super::joint_state::{JointState, Posterior, SETTLED, kind_of};
use super::parameters::{
    ALL_KINDS, INPUTS, INSTRUMENTS, PARAMETERS, Parameters, is_observable, output, place,
};
use super::settings::Compatibility;
use super::window::{Window, margin};
use super::window_fit::{FitContext, WindowFit};
use crate::aircraft::Aircraft;
use crate::numerics::statistics::mean::finite_mean;

/// Largest number of rounds in which R and P are estimated anew; the fit usually settles earlier.
const ROUNDS: usize = 8;

/// Rounds with the wide prior, in which R settles first. Otherwise the priors of the delays would
/// widen by chance in turbulence, where the data have little information about delays.
const WIDE_ROUNDS: usize = 4;

/// Least number of rounds: those with the wide prior, and two estimates of P.
const LEAST_ROUNDS: usize = WIDE_ROUNDS + 1;

/// Number of bounds above which a parameter is certainly larger than ordinary, so that its prior
/// widens.
const SURELY: f64 = 3.0;

/// Number of bounds above which a parameter is freed of its prior at the end. It is larger than for
/// widening, because no other parameters are widened with the freed one.
const FREED: f64 = 4.0;

/// Number of ordinary sizes below which no parameter is freed.
const LEAST_FREED: f64 = 2.0;

/// Largest number of parameters that are freed, as faults are rare.
const MOST_FREED: usize = 4;

/// Prior of the first round, as a multiple of the least size of a fault, so that any fault is
/// possible.
const FIRST_PRIOR: f64 = 2.0;

/// Least share of the information on a parameter that must come from the data for an estimate
/// without prior. With a smaller share that estimate consists of rounding errors.
const LEAST_DATA_SHARE: f64 = 1e-6;

/// Estimates of the instruments' errors.
#[derive(Clone, Debug)]
pub struct FittedErrors {
    pub values: Parameters,
    /// Standard deviations; zero for what is not estimated.
    pub bounds: Parameters,
    /// Part of the bounds that no number of windows or flights averages out.
    pub systematic: Parameters,
    /// Scatter of the errors between the windows beyond that of their noise.
    pub scatter: Parameters,
    /// Share of the information on each parameter that comes from the flight and not from the prior.
    pub data_shares: Parameters,
    /// Standard deviations of the prior, √P.
    pub prior: Parameters,
    /// Mean airspeed of the windows.
    pub speed_ft_s: Option<f64>,
    /// Negative logarithm of the likelihood of the outputs' residuals, up to a constant.
    pub misfit: f64,
}

/// Fits the windows; `None` if too few of them can be integrated.
pub fn fit(
    windows: &[Window],
    aircraft: &Aircraft,
    settings: &Compatibility,
) -> Option<FittedErrors> {
    let context = FitContext {
        aircraft,
        settings,
        margin: margin(settings, windows.first()?.step_s),
    };
    let shared = [0.0; PARAMETERS];
    let fits: Vec<WindowFit> = windows
        .par_iter()
        .filter_map(|window| WindowFit::begin(window, &context, &shared))
        .collect();
    if fits.len() < settings.least_windows {
        return None;
    }
    let mut state = JointState {
        context,
        estimated: estimated(windows),
        windows: fits,
        shared,
        prior: std::array::from_fn(|j| FIRST_PRIOR * settings.faulty.of_parameter(j)),
    };
    reweight(&mut state)?;
    free_surest(&mut state)?;
    let mut posterior = state.posterior()?;
    let mut bounds = state.bounds(windows)?;
    let doubtful = doubtful(&state, &posterior.values, &bounds.total);
    if !doubtful.is_empty() {
        // Doubtful errors get the prior of healthy instruments.
        for j in doubtful {
            state.prior[j] = settings.ordinary.of_parameter(j);
        }
        state.settle()?;
        state.count_input_noise();
        posterior = state.posterior()?;
        bounds = state.bounds(windows)?;
    }
    Some(FittedErrors {
        values: posterior.values,
        bounds: bounds.total,
        systematic: bounds.systematic,
        scatter: bounds.scatter,
        data_shares: bounds.data_shares,
        prior: state.prior,
        speed_ft_s: mean_speed_ft_s(windows),
        misfit: state.windows.iter().map(WindowFit::misfit).sum(),
    })
}

fn mean_speed_ft_s(windows: &[Window]) -> Option<f64> {
    finite_mean(
        windows
            .iter()
            .flat_map(|w| &w.outputs[output::AIRSPEED])
            .copied(),
    )
}

/// Parameters of recorded instruments that are observable.
fn estimated(windows: &[Window]) -> [bool; PARAMETERS] {
    let is_recorded = |i: usize| {
        let of_window = |w: &Window| match i.checked_sub(INPUTS) {
            None => w.is_recorded[i],
            Some(output) => w.outputs[output].iter().any(|v| v.is_finite()),
        };
        windows.iter().any(of_window)
    };
    let mut estimated = [false; PARAMETERS];
    for i in (0..INSTRUMENTS).filter(|i| is_recorded(*i)) {
        for kind in ALL_KINDS {
            estimated[place(i, kind)] = is_observable(i, kind);
        }
    }
    estimated
}

/// Fits in rounds, the first of them with a wide prior, and then widens the prior of each parameter
/// that is certainly larger than ordinary.
fn reweight(state: &mut JointState) -> Option<()> {
    for round in 0..ROUNDS {
        let largest = state.settle()?;
        // Nothing reads the evidence of a round that keeps the wide prior.
        if round + 1 < WIDE_ROUNDS {
            continue;
        }
        state.count_input_noise();
        if round >= LEAST_ROUNDS && largest < SETTLED {
            break;
        }
        state.prior = reweighted_prior(state)?;
    }
    Some(())
}

/// √P of each parameter for its present value.
fn reweighted_prior(state: &JointState) -> Option<Parameters> {
    let Posterior { values, covariance } = state.posterior()?;
    Some(std::array::from_fn(|j| {
        let ordinary = state.context.settings.ordinary.of_parameter(j);
        let (value, bound) = (values[j], covariance[(j, j)].sqrt());
        // The error by gusts takes a pass over all windows, and few parameters need it.
        let exceeds = |bound: f64| value.abs() > SURELY * bound;
        if exceeds(bound) && exceeds(bound.hypot(state.gust_error(j))) {
            ordinary.hypot(value)
        } else {
            ordinary
        }
    }))
}

/// Frees one parameter after another of its prior, the most certain first, and repeats the fit.
fn free_surest(state: &mut JointState) -> Option<()> {
    for _ in 0..MOST_FREED {
        let Some((j, prior)) = surest(state) else {
            break;
        };
        state.prior[j] = prior;
        state.settle()?;
        state.count_input_noise();
    }
    Some(())
}

/// The parameter that, by the data alone, exceeds its ordinary size most certainly, and its new
/// prior.
fn surest(state: &JointState) -> Option<(usize, f64)> {
    let Posterior { values, covariance } = state.posterior()?;
    let freed = |j: usize| {
        let ordinary = state.context.settings.ordinary.of_parameter(j);
        let (variance, prior) = (covariance[(j, j)], state.prior[j]);
        let data_share = state.data_share(&covariance, j);
        // Value and bound as they would be without the prior.
        let value = values[j] / data_share;
        let may_be_freed = state.estimated[j]
            && data_share > LEAST_DATA_SHARE
            && prior <= ordinary
            && value.abs() > LEAST_FREED * ordinary;
        if !may_be_freed {
            return None;
        }
        let bound = (variance / data_share).sqrt().hypot(state.gust_error(j));
        let is_freed = value.abs() > FREED * bound;
        is_freed.then(|| (j, ordinary.hypot(value), value.abs() / bound))
    };
    (0..PARAMETERS)
        .filter_map(freed)
        .max_by(|a, b| a.2.total_cmp(&b.2))
        .map(|(j, prior, _)| (j, prior))
}

/// Parameters with a widened prior that came out as large as a fault but less certain. No ordinary
/// error is that large.
fn doubtful(state: &JointState, values: &Parameters, bounds: &Parameters) -> Vec<usize> {
    let settings = state.context.settings;
    let is_doubtful = |j: &usize| {
        let (j, value) = (*j, values[*j]);
        let is_widened = state.prior[j] > settings.ordinary.of_parameter(j);
        let is_large = value.abs() > settings.faulty.of_parameter(j);
        let needed = settings.standard_errors_of_fault(kind_of(j), value);
        state.estimated[j] && is_widened && is_large && value.abs() <= needed * bounds[j]
    };
    (0..PARAMETERS).filter(is_doubtful).collect()
}
