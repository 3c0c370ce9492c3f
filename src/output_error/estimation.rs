//! An estimation: the iteration (1.3), the weights in alternation with it, and the bounds of what it
//! found.

use super::bounds::cramer_rao;
use super::bounds::data::Bounded;
use super::likelihood::information::{Identified, identified};
use super::likelihood::newton_raphson::{Settings, descend, minimise};
use super::likelihood::outcome::{Fit, Outcome};
use crate::dynamics::OUTPUTS;

/// What the weights on the residuals are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Weights {
    /// Tables 2 and 4.
    #[default]
    Table,
    /// The inverse of the residuals' variances, re-estimated in alternation with the parameters
    /// until both settle.
    Estimated,
}

impl Weights {
    /// As the configuration says it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Weights::Table => "table",
            Weights::Estimated => "estimated",
        }
    }
}

/// Rounds of re-estimating the weights, and the relative change of all weights at which they have
/// settled.
const WEIGHT_ROUNDS: usize = 20;
const WEIGHTS_SETTLED: f64 = 1e-3;

/// Estimates the free parameters of a maneuver, or of several joined, from `start`, with the
/// table's weights or those they settle to.
///
/// `resolution` is the smallest standard deviation of each output that is believed when weights are
/// estimated.
#[must_use]
pub fn estimate<D: Bounded>(
    data: &D,
    start: Vec<f64>,
    table: [f64; OUTPUTS],
    weights: Weights,
    resolution: [f64; OUTPUTS],
    settings: &Settings,
) -> Fit<D::Response> {
    let mut fit = minimise(data, start, table, settings);
    if weights == Weights::Estimated {
        for _ in 0..WEIGHT_ROUNDS {
            if fit.outcome != Outcome::Converged {
                break;
            }
            let next = residual_weights(data, &fit, resolution);
            let settled = next
                .iter()
                .zip(fit.weights)
                .all(|(a, b)| (a / b - 1.0).abs() < WEIGHTS_SETTLED);
            if settled {
                break;
            }
            let (iterations, initial_cost) = (fit.iterations, fit.initial_cost);
            fit = descend(data, fit.values, next, settings, fit.response);
            fit.iterations += iterations;
            fit.initial_cost = initial_cost;
        }
    }
    judge(data, &mut fit, settings);
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

/// Bounds of a fit, and the verdict on directions that the data do not determine.
fn judge<D: Bounded>(data: &D, fit: &mut Fit<D::Response>, settings: &Settings) {
    if fit.final_cost.is_none() {
        return;
    }
    let at = data.sums(&fit.response, &fit.weights);
    match identified(&at.information, settings.max_condition_number) {
        Identified::Determined {
            inverse,
            condition_number,
        } => {
            fit.condition_number = Some(condition_number);
            let bounds = cramer_rao::bounds(&inverse, data, fit);
            (fit.covariance, fit.covariance_corrected) =
                (Some(bounds.covariance), Some(bounds.corrected));
        }
        Identified::Undetermined {
            condition_number,
            parameters,
        } => {
            fit.condition_number = condition_number;
            let names: Vec<&str> = parameters
                .iter()
                .filter_map(|&j| data.names().get(j))
                .map(String::as_str)
                .collect();
            fit.outcome = Outcome::Unidentifiable;
            fit.reason = format!("the data do not tell apart {}", names.join(", "));
            fit.undetermined = parameters;
        }
    }
}
