//! Joint estimation by output error.

use nalgebra::DVector;

use super::member::{Fitted, Member, is_unshared, mean_of_own_estimates};
use crate::dynamics::Equations;
use crate::estimate::calibration_effect::{NOT_COUNTED, gradient_shifts, signal_errors};
use crate::estimate::moving_air::whiteness::{lag_one, largest_correlation};
use crate::estimate::task::{Task, values_by_name};
use crate::output_error::consider::{self, Considered};
use crate::output_error::sharing::{add_vector, values_at};
use crate::output_error::{
    Case, Fit, Joint, Likelihood, Outcome, Response, calibration_errors, estimation,
};
use crate::tables::EstimationMethod;

/// Output error on the sum of the costs, from the mean of the maneuvers' own estimates.
pub fn fit_jointly<'a, const NX: usize, E: Equations<NX>>(
    task: &Task<'a>,
    parts: &[Member<'a, NX, E>],
) -> Result<Fitted, String> {
    let cases = parts
        .iter()
        .map(|p| (p.task.maneuver.maneuver_id.as_str(), &p.prepared.case));
    let joint = Joint::new(cases, |name| is_unshared(task, name))?;
    let mut fit = fit_from_starts(task, parts, &joint)?;
    let costs = if fit.final_cost.is_some() {
        joint.costs(&fit.response, &task.weights()?)
    } else {
        vec![]
    };
    add_held_uncertainty(task, parts, &joint, &mut fit);
    add_calibration_errors(parts, &joint, &mut fit);
    let members = parts.iter().zip(&fit.response);
    let correlations = members.map(|(part, response)| {
        largest_correlation(lag_one(&part.prepared.case.measurements, &response.outputs))
    });
    let autocorrelation = correlations.flatten().reduce(f64::max);
    let (fit, _) = fit.with_response(Response::default());
    let mut fitted = Fitted::new(task, joint.names(), &fit, parts.iter(), costs);
    fitted.estimated.fit.method = Some(EstimationMethod::OutputError);
    fitted.estimated.fit.autocorrelation = autocorrelation;
    Ok(fitted)
}

/// Fit from the mean of the maneuvers' own estimates; if it does not converge, from the derivatives
/// of the maneuver that fits best alone.
fn fit_from_starts<const NX: usize, E: Equations<NX>>(
    task: &Task,
    parts: &[Member<NX, E>],
    joint: &Joint<NX, E>,
) -> Result<Fit<Vec<Response>>, String> {
    let settings = task.context.settings;
    let (weights, resolution) = (task.weights()?, task.resolution());
    let own: Vec<Vec<f64>> = parts.iter().map(|p| p.alone.values.clone()).collect();
    let fit_from = |shared: &[f64]| {
        let start = joint.parameters().assemble(shared, &own);
        estimation::estimate(
            joint,
            start,
            weights,
            settings.weights,
            resolution,
            &settings.iteration,
        )
    };
    let alone: Vec<&Fit> = parts.iter().map(|p| &p.alone).collect();
    let shared = joint.parameters().shared();
    let fit = fit_from(&mean_of_own_estimates(&alone, shared));
    if fit.outcome == Outcome::Converged {
        return Ok(fit);
    }
    let cost = |p: &&Member<NX, E>| p.alone.final_cost.unwrap_or(f64::INFINITY);
    let best = parts.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
    let other = best.map(|p| fit_from(&values_at(shared, &p.alone.values)));
    Ok(other
        .filter(|f| f.outcome == Outcome::Converged)
        .unwrap_or(fit))
}

/// Adds the effect of the tunnel's errors to the covariances of the shared derivatives.
fn add_held_uncertainty<'a, const NX: usize, E: Equations<NX>>(
    task: &Task<'a>,
    parts: &[Member<'a, NX, E>],
    joint: &Joint<NX, E>,
    fit: &mut Fit<Vec<Response>>,
) {
    let Some(first) = parts.first() else { return };
    let wide: Vec<Case<NX, E>> = parts
        .iter()
        .map(|p| p.prepared.with_held_free(p.task.context.aircraft))
        .collect();
    let own = |i: usize| values_at(joint.parameters().places(i), &fit.values);
    let considered: Vec<Considered<NX, E>> = parts
        .iter()
        .zip(&wide)
        .enumerate()
        .map(|(i, (part, wide))| Considered {
            case: &part.prepared.case,
            wide,
            values: values_by_name(&part.prepared.model, &part.prepared.case.names, &own(i)),
            places: joint.parameters().places(i).to_vec(),
        })
        .collect();
    consider::consider_together(
        &considered,
        &task.held_uncertainties(&first.prepared.model),
        fit,
    );
}

/// Adds the effect of calibration errors to the covariance of the shared derivatives.
///
/// An error of a signal is taken as common to all maneuvers. That is so within a flight; between
/// flights it overestimates the effect.
fn add_calibration_errors<const NX: usize, E: Equations<NX>>(
    parts: &[Member<NX, E>],
    joint: &Joint<NX, E>,
    fit: &mut Fit<Vec<Response>>,
) {
    if fit.covariance_corrected.is_none() {
        return;
    }
    let Some(first) = parts.first() else {
        return;
    };
    let tasks: Vec<_> = parts.iter().map(|part| &part.task).collect();
    let errors = signal_errors(&tasks, &first.prepared.signals);
    let mut together = vec![DVector::zeros(joint.names().len()); errors.len()];
    for (i, part) in parts.iter().enumerate() {
        let places = joint.parameters().places(i);
        let own = values_at(places, &fit.values);
        let aircraft = part.task.context.aircraft;
        let shifts = gradient_shifts(aircraft, &part.prepared, &errors, &own, &fit.weights);
        let Ok(shifts) = shifts else {
            fit.reason.push_str(NOT_COUNTED);
            return;
        };
        for (sum, shift) in together.iter_mut().zip(shifts) {
            add_vector(places, &shift, sum);
        }
    }
    calibration_errors::add_calibration_errors(joint, &errors, &together, fit);
}
