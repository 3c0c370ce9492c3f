//! Newton-Raphson with the Gauss-Newton second gradient (1.3-1.5), damped where a full step does
//! not lower the cost.
//!
//! Far from the minimum the iteration uses a coarse response, of fewer and longer steps. The coarse
//! iteration only improves the start. From there on every response is whole and decides where the
//! iteration ends.

use nalgebra::DVector;

use super::cost::Sums;
use super::definition::Likelihood;
use super::outcome::{Fit, Outcome};
use crate::dynamics::OUTPUTS;
use crate::numerics::damping::{next_damping, raised_damping};
use crate::numerics::linear_algebra::symmetric::solve_damped;
use crate::output_error::kernel::response::Detail;
use crate::settings::settings;

settings! {
    /// End of the iteration.
    #[derive(Copy)]
    pub struct Settings {
        /// Most iterations; a maneuver that needs more does not converge.
        pub max_iterations: usize = 50,
        /// Relative decrease of J by a full step below which the iteration has converged. At 1e-8
        /// estimates are within a hundredth of their bounds. Larger: fewer iterations, estimates
        /// further from the minimum.
        pub tolerance: f64 = 1e-8,
        /// Condition number of the information matrix with unit diagonal beyond which a direction
        /// counts as not determined. Smaller: more maneuvers are rejected as not identifiable.
        pub max_condition_number: f64 = 1e10,
    }
}

/// First damping after a full step fails, relative to the unit diagonal of the scaled information
/// matrix. It is about the smallest eigenvalue of a poorly conditioned maneuver.
const FIRST_DAMPING: f64 = 1e-8;
/// Damping at which no step lowers the cost.
const MOST_DAMPING: f64 = 1e9;
/// Least decrease that a full step must predict for another coarse iteration, as a share of the
/// coarse cost. With less, the skipped samples matter as much.
const COARSE_TOLERANCE: f64 = 0.1;

/// Minimises the cost from a start with fixed weights; the fit has no bounds yet.
#[must_use]
pub fn minimise<D: Likelihood>(
    data: &D,
    start: Vec<f64>,
    weights: [f64; OUTPUTS],
    settings: &Settings,
) -> Fit<D::Response> {
    let mut response = data.response();
    let Some(coarse) = approach(data, &start, &weights, settings, &mut response) else {
        return descend(data, start, weights, settings, response);
    };
    let mut fit = descend(data, coarse.values, weights, settings, response);
    if fit.initial_cost.is_none() {
        return descend(data, start, weights, settings, data.response());
    }
    fit.iterations += coarse.iterations;
    fit.initial_cost = Some(coarse.initial_cost);
    fit
}

/// Result of the coarse iteration.
struct CoarseFit {
    values: Vec<f64>,
    iterations: usize,
    initial_cost: f64,
}

/// Approaches the minimum by the coarse response. `None` without a coarse response, or if it
/// diverges or is singular.
fn approach<D: Likelihood>(
    data: &D,
    start: &[f64],
    weights: &[f64; OUTPUTS],
    settings: &Settings,
    response: &mut D::Response,
) -> Option<CoarseFit> {
    if !data.has_coarse() {
        return None;
    }
    data.respond(Detail::Coarse, start, response).ok()?;
    let mut sums = data.sums(response, weights);
    let mut fit = CoarseFit {
        values: start.to_vec(),
        iterations: 0,
        initial_cost: sums.cost(),
    };
    let mut search = StepSearch::new(data, Detail::Coarse, weights);
    while fit.iterations < settings.max_iterations {
        let full = full_step(&sums)?;
        fit.iterations += 1;
        if sums.gradient.dot(&full) <= COARSE_TOLERANCE * sums.weighted_square {
            fit.values = stepped_parameters(&fit.values, &full);
            break;
        }
        let Some(better) = search.lower(&fit.values, &sums, response) else {
            break;
        };
        (fit.values, sums) = better;
    }
    Some(fit)
}

/// Iterates from a start with whole responses; `response` is overwritten.
pub(crate) fn descend<D: Likelihood>(
    data: &D,
    start: Vec<f64>,
    weights: [f64; OUTPUTS],
    settings: &Settings,
    mut response: D::Response,
) -> Fit<D::Response> {
    let mut fit = Fit::unfinished(start, weights, settings.max_iterations);
    if let Err(diverged) = data.respond(Detail::Whole, &fit.values, &mut response) {
        let place = data.place(diverged);
        fit.reason = format!("the integration diverges {place} with the starting values");
        fit.response = data.response();
        return fit;
    }
    let mut trial = data.response();
    let mut sums = data.sums(&response, &weights);
    fit.initial_cost = Some(sums.cost());
    // Rounding is all that a step can still lower where the model fits to the last digit.
    let floor = f64::EPSILON * f64::EPSILON.sqrt() * sums.weighted_square;
    let mut search = StepSearch::new(data, Detail::Whole, &weights);
    while fit.iterations < settings.max_iterations {
        let Some(full) = full_step(&sums) else {
            fit.reason = "the information matrix is singular".into();
            break;
        };
        let gain = sums.gradient.dot(&full);
        if gain <= settings.tolerance * sums.weighted_square + floor {
            fit.outcome = Outcome::Converged;
            fit.reason = "a further step would not lower the cost".into();
            break;
        }
        fit.iterations += 1;
        let Some(better) = search.lower(&fit.values, &sums, &mut trial) else {
            fit.reason = "no step lowers the cost".into();
            break;
        };
        (fit.values, sums) = better;
        std::mem::swap(&mut response, &mut trial);
    }
    fit.final_cost = Some(sums.cost());
    fit.response = response;
    fit
}

/// Search for a step that lowers the cost; the damping carries over to the next iteration.
struct StepSearch<'a, D> {
    data: &'a D,
    detail: Detail,
    weights: &'a [f64; OUTPUTS],
    damping: f64,
}

impl<'a, D: Likelihood> StepSearch<'a, D> {
    fn new(data: &'a D, detail: Detail, weights: &'a [f64; OUTPUTS]) -> Self {
        StepSearch {
            data,
            detail,
            weights,
            damping: 0.0,
        }
    }

    /// Tries steps of growing damping until one lowers the cost, and leaves its response in `trial`.
    fn lower(
        &mut self,
        values: &[f64],
        sums: &Sums,
        trial: &mut D::Response,
    ) -> Option<(Vec<f64>, Sums)> {
        while self.damping < MOST_DAMPING {
            if let Some(step) = damped_step(sums, self.damping) {
                let next = stepped_parameters(values, &step);
                if self.data.respond(self.detail, &next, trial).is_ok() {
                    let lower = self.data.sums(trial, self.weights);
                    let gain = sums.weighted_square - lower.weighted_square;
                    if gain > 0.0 {
                        let kept = gain / predicted_gain(sums, &step);
                        // With large residuals, undamped Gauss-Newton steps zigzag across the minimum.
                        self.damping = next_damping(self.damping, kept, FIRST_DAMPING);
                        return Some((next, lower));
                    }
                }
            }
            self.damping = raised_damping(self.damping, FIRST_DAMPING);
        }
        None
    }
}

fn stepped_parameters(values: &[f64], step: &DVector<f64>) -> Vec<f64> {
    values.iter().zip(step.iter()).map(|(v, d)| v + d).collect()
}

/// Reduction of Σ w v² by a step if the residuals were linear in the parameters.
fn predicted_gain(sums: &Sums, step: &DVector<f64>) -> f64 {
    2.0 * sums.gradient.dot(step) - (&sums.information * step).dot(step)
}

/// Undamped step, with the least damping where the matrix is singular to rounding.
fn full_step(sums: &Sums) -> Option<DVector<f64>> {
    damped_step(sums, 0.0).or_else(|| damped_step(sums, FIRST_DAMPING))
}

fn damped_step(sums: &Sums, damping: f64) -> Option<DVector<f64>> {
    solve_damped(&sums.information, &sums.gradient, damping)
}
