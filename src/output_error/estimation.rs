//! One estimation: the iteration (1.3), the weights in alternation with it, and the bounds of the
//! result.

use super::bounds::bounded::Bounded;
use super::bounds::cramer_rao;
use super::likelihood::information::Identification;
use super::likelihood::newton_raphson::{Settings, descend, minimise};
use super::likelihood::outcome::{Fit, Outcome};
use crate::dynamics::OUTPUTS;
pub use crate::tables::Weights;

/// Largest number of rounds of re-estimating the weights.
const WEIGHT_ROUNDS: usize = 20;
/// Relative change of all weights below which they have settled.
const WEIGHTS_SETTLED: f64 = 1e-3;

/// Estimates the free parameters of a maneuver, or of several joined, with their bounds.
///
/// The published costs use the weights of the `table`. `resolution` is the least standard deviation
/// of each output from which weights are estimated.
#[must_use]
pub fn estimate<D: Bounded>(
    data: &D,
    start: Vec<f64>,
    table: [f64; OUTPUTS],
    weights: Weights,
    resolution: [f64; OUTPUTS],
    settings: &Settings,
) -> Fit<D::Response> {
    let mut fit = estimate_values(data, start, table, weights, resolution, settings);
    add_bounds(data, &mut fit, settings);
    fit
}

/// Estimates as [`estimate`] does, without bounds: [`add_bounds`] adds them.
#[must_use]
pub fn estimate_values<D: Bounded>(
    data: &D,
    start: Vec<f64>,
    table: [f64; OUTPUTS],
    weights: Weights,
    resolution: [f64; OUTPUTS],
    settings: &Settings,
) -> Fit<D::Response> {
    let mut fit = minimise(data, start, table, settings);
    if weights == Weights::Estimated {
        fit = settle_weights(data, fit, resolution, settings);
        // With settled weights the cost is one half for every fit, so fits are compared by the cost
        // with the table's weights.
        let cost = |_| data.sums(&fit.response, &table).cost();
        fit.final_cost = fit.final_cost.map(cost);
    }
    identify(data, &mut fit, settings);
    fit
}

/// Alternates between weights and parameters until both settle or an iteration fails.
fn settle_weights<D: Bounded>(
    data: &D,
    mut fit: Fit<D::Response>,
    resolution: [f64; OUTPUTS],
    settings: &Settings,
) -> Fit<D::Response> {
    for _ in 0..WEIGHT_ROUNDS {
        let next = residual_weights(data, &fit, resolution);
        if fit.outcome != Outcome::Converged || have_settled(&next, &fit.weights) {
            break;
        }
        let (iterations, initial_cost) = (fit.iterations, fit.initial_cost);
        fit = descend(data, fit.values, next, settings, fit.response);
        fit.iterations += iterations;
        fit.initial_cost = initial_cost;
    }
    fit
}

fn residual_weights<D: Bounded>(
    data: &D,
    fit: &Fit<D::Response>,
    resolution: [f64; OUTPUTS],
) -> [f64; OUTPUTS] {
    let variances = data.variances(&fit.response);
    std::array::from_fn(|o| 1.0 / variances[o].max(resolution[o] * resolution[o]))
}

fn have_settled(next: &[f64; OUTPUTS], weights: &[f64; OUTPUTS]) -> bool {
    let mut both = next.iter().zip(weights);
    both.all(|(a, b)| (a / b - 1.0).abs() < WEIGHTS_SETTLED)
}

/// Adds the condition number to a fit, or names the parameters that the data do not determine.
fn identify<D: Bounded>(data: &D, fit: &mut Fit<D::Response>, settings: &Settings) {
    if fit.final_cost.is_none() {
        return;
    }
    let sums = data.sums(&fit.response, &fit.weights);
    match Identification::identify(&sums.information, settings.max_condition_number) {
        Identification::Determined {
            condition_number, ..
        } => fit.condition_number = Some(condition_number),
        Identification::Undetermined {
            condition_number,
            parameters,
        } => {
            let names = parameters.iter().filter_map(|&j| data.names().get(j));
            let names: Vec<&str> = names.map(String::as_str).collect();
            fit.condition_number = condition_number;
            fit.outcome = Outcome::Unidentifiable;
            fit.reason = format!("not identifiable together: {}", names.join(", "));
            fit.undetermined = parameters;
        }
    }
}

/// Adds the bounds to a fit whose parameters the data determine.
pub fn add_bounds<D: Bounded>(data: &D, fit: &mut Fit<D::Response>, settings: &Settings) {
    if fit.final_cost.is_none() {
        return;
    }
    let sums = data.sums(&fit.response, &fit.weights);
    let identification = Identification::identify(&sums.information, settings.max_condition_number);
    if let Identification::Determined { inverse, .. } = identification {
        let bounds = cramer_rao::bounds(&inverse, data, fit);
        fit.covariance = Some(bounds.covariance);
        fit.covariance_corrected = Some(bounds.corrected);
    }
}
