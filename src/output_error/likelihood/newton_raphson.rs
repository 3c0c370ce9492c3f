//! Newton-Raphson with the Gauss-Newton second gradient (eqs. 1.3-1.5), damped where a full step
//! does not lower the cost.
//!
//! Far from the minimum the iteration goes by a coarse response, of fewer and longer steps, until
//! it is as near as that can tell. That only makes a better start: from there on everything is
//! exact, and decides where the iteration ends.

use nalgebra::{Cholesky, DVector};

use super::cost::Sums;
use super::data::Likelihood;
use super::outcome::{Fit, Outcome};
use crate::dynamics::OUTPUTS;
use crate::numerics::symmetric::{scale, scaled};
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

/// Damping that is added first when a full step fails, relative to the unit diagonal of the scaled
/// information matrix: about the smallest eigenvalue of a maneuver that determines its derivatives
/// badly.
const FIRST_DAMPING: f64 = 1e-8;
const MOST_DAMPING: f64 = 1e9;
/// The iteration from a start with fixed weights, without bounds.
#[must_use]
pub fn minimise<D: Likelihood>(
    data: &D,
    start: Vec<f64>,
    weights: [f64; OUTPUTS],
    settings: &Settings,
) -> Fit<D::Response> {
    let mut response = data.response();
    let Some(near) = approach(data, &start, &weights, settings, &mut response) else {
        return descend(data, start, weights, settings, response);
    };
    let mut fit = descend(data, near.values, weights, settings, response);
    if fit.initial_cost.is_none() {
        return descend(data, start, weights, settings, data.response());
    }
    fit.iterations += near.iterations;
    fit.initial_cost = Some(near.initial_cost);
    fit
}

/// Where coarse steps lead.
struct Near {
    values: Vec<f64>,
    iterations: usize,
    initial_cost: f64,
}

/// A full step that would lower the coarse cost by less than this share of it ends in what the
/// samples left out are worth.
const NEAR: f64 = 0.1;

/// Goes by the coarse response while that is still far from its minimum; none where there is no
/// such response, or where it leads nowhere.
fn approach<D: Likelihood>(
    data: &D,
    start: &[f64],
    weights: &[f64; OUTPUTS],
    settings: &Settings,
    response: &mut D::Response,
) -> Option<Near> {
    if !data.has_coarse() {
        return None;
    }
    data.respond(Detail::Coarse, start, response).ok()?;
    let mut at = data.sums(response, weights);
    let mut near = Near {
        values: start.to_vec(),
        iterations: 0,
        initial_cost: at.cost(),
    };
    let mut damping = 0.0;
    while near.iterations < settings.max_iterations {
        let full = step(&at, 0.0).or_else(|| step(&at, FIRST_DAMPING))?;
        near.iterations += 1;
        if at.gradient.dot(&full) <= NEAR * at.weighted_square {
            near.values
                .iter_mut()
                .zip(full.iter())
                .for_each(|(value, d)| *value += d);
            break;
        }
        let Some(better) = lower(
            data,
            Detail::Coarse,
            &near.values,
            &at,
            weights,
            &mut damping,
            response,
        ) else {
            break;
        };
        (near.values, at) = better;
    }
    Some(near)
}

/// The iteration from a start with exact costs and gradients; `response` is written over.
pub(crate) fn descend<D: Likelihood>(
    data: &D,
    start: Vec<f64>,
    weights: [f64; OUTPUTS],
    settings: &Settings,
    mut response: D::Response,
) -> Fit<D::Response> {
    let mut trial = data.response();
    let mut fit = Fit {
        outcome: Outcome::NotConverged,
        reason: format!("not converged after {} iterations", settings.max_iterations),
        iterations: 0,
        initial_cost: None,
        final_cost: None,
        values: start,
        weights,
        response: D::Response::default(),
        condition_number: None,
        undetermined: vec![],
        covariance: None,
        covariance_held: None,
        covariance_calibration: None,
        covariance_corrected: None,
    };
    if let Err(diverged) = data.respond(Detail::Whole, &fit.values, &mut response) {
        fit.reason = format!(
            "the integration diverges {} with the starting values",
            data.place(diverged)
        );
        fit.response = data.response();
        return fit;
    }
    let mut at = data.sums(&response, &weights);
    fit.initial_cost = Some(at.cost());
    // Where the model fits to the last digit, rounding is all that a further step could lower.
    let floor = f64::EPSILON * f64::EPSILON.sqrt() * at.weighted_square;
    let mut damping = 0.0;
    while fit.iterations < settings.max_iterations {
        let full = step(&at, 0.0).or_else(|| step(&at, FIRST_DAMPING));
        let gain = full.as_ref().map(|full| at.gradient.dot(full));
        let Some(gain) = gain else {
            fit.reason = "the information matrix is singular".into();
            break;
        };
        if gain <= settings.tolerance * at.weighted_square + floor {
            fit.outcome = Outcome::Converged;
            fit.reason = "a further step would not lower the cost".into();
            break;
        }
        fit.iterations += 1;
        let better = lower(
            data,
            Detail::Whole,
            &fit.values,
            &at,
            &weights,
            &mut damping,
            &mut trial,
        );
        let Some(better) = better else {
            fit.reason = "no step lowers the cost".into();
            break;
        };
        fit.values = better.0;
        at = better.1;
        std::mem::swap(&mut response, &mut trial);
    }
    fit.final_cost = Some(at.cost());
    fit.response = response;
    fit
}

/// Tries steps of growing damping until one lowers the cost; the response to it is left in `trial`.
fn lower<D: Likelihood>(
    data: &D,
    detail: Detail,
    values: &[f64],
    at: &Sums,
    weights: &[f64; OUTPUTS],
    damping: &mut f64,
    trial: &mut D::Response,
) -> Option<(Vec<f64>, Sums)> {
    while *damping < MOST_DAMPING {
        if let Some(d) = step(at, *damping) {
            let next: Vec<f64> = values.iter().zip(d.iter()).map(|(v, d)| v + d).collect();
            if data.respond(detail, &next, trial).is_ok() {
                let sums = data.sums(trial, weights);
                let gain = at.weighted_square - sums.weighted_square;
                if gain > 0.0 {
                    *damping = next_damping(*damping, gain / predicted_gain(at, &d));
                    return Some((next, sums));
                }
            }
        }
        *damping = (*damping * 10.0).max(FIRST_DAMPING);
    }
    None
}

/// What a step would lower Σ w v² by if the residuals were linear in the parameters.
fn predicted_gain(at: &Sums, d: &DVector<f64>) -> f64 {
    2.0 * at.gradient.dot(d) - (&at.information * d).dot(d)
}

/// Less damping after a step that did what it promised, more after one that overshot: where the
/// residuals stay large, undamped Gauss-Newton steps zigzag across the minimum.
fn next_damping(damping: f64, kept: f64) -> f64 {
    match kept {
        k if k > 0.75 && damping > FIRST_DAMPING => damping / 10.0,
        k if k > 0.75 => 0.0,
        k if k < 0.25 => (damping * 10.0).max(FIRST_DAMPING),
        _ => damping,
    }
}

/// Solves (H + damping · diag H) d = g on unit-diagonal scale.
fn step(at: &Sums, damping: f64) -> Option<DVector<f64>> {
    let unit = scale(&at.information);
    let mut h = scaled(&at.information, &unit);
    for i in 0..h.nrows() {
        h[(i, i)] += damping;
    }
    let solution = Cholesky::new(h)?.solve(&at.gradient.component_mul(&unit));
    Some(solution.component_mul(&unit))
}
