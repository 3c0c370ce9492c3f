//! Joint estimation: maneuvers of one class and nearly one angle of attack share their derivatives.
//! Each keeps its biases and initial states.
//!
//! Each also keeps its constants (`CN_0`) unless `share_constants` is set: they take up trim and the
//! zero errors of vanes and surfaces, which differ between flights.
//!
//! The class's table and weights are those at the mean angle of attack, so that all maneuvers have
//! the same free derivatives. A held derivative acts at the tunnel's value at each maneuver's own
//! angle of attack and Mach number: one value for all would charge its change between them to the
//! shared derivatives. The tunnel's error is common to all maneuvers.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::calibration_effect::NOT_COUNTED;
use super::context::Context;
use super::estimated::{Covariance, Estimated, rejected_fit};
use super::prepared_case::PreparedCase;
use super::settings::JointSettings;
use super::task::{Task, values_by_name};
use crate::aero::Axis;
use crate::dynamics::{Equations, Lateral, Longitudinal};
use crate::flight::Record;
use crate::maneuver::{Class, Maneuver, ManeuverOrigin, Quality, Recognised, Status};
use crate::output_error::consider::{self, Considered};
use crate::output_error::{
    Case, Fit, Joint, Likelihood, Outcome, Response, calibration_errors, estimation, mean,
};
use crate::tables::{EstimateRow, JOINT_FLIGHT, JointRow, Participation, StartingValues};

/// A group of maneuvers to be estimated together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// `maneuver_id` of its rows: `joint/<class>/<mean α>`.
    pub joint_id: String,
    pub class: String,
    /// Indices in the list of maneuvers, ascending; two or more.
    pub members: Vec<usize>,
}

/// Groups maneuvers by class and angle of attack; a group has two or more.
#[must_use]
pub fn bins(maneuvers: &[Maneuver], settings: &JointSettings) -> Vec<Bin> {
    let mut classes: Vec<&str> = maneuvers.iter().map(|m| m.class.as_str()).collect();
    classes.sort_unstable();
    classes.dedup();
    let mut bins = Vec::new();
    for class in classes {
        let mut of_class: Vec<usize> = (0..maneuvers.len())
            .filter(|&i| maneuvers[i].class == class)
            .collect();
        of_class.sort_by(|&a, &b| maneuvers[a].alpha_deg.total_cmp(&maneuvers[b].alpha_deg));
        let alpha = |&i: &usize| maneuvers[i].alpha_deg;
        let groups = if settings.centres_deg.is_empty() {
            split_at_gaps(&of_class, &alpha, settings.alpha_bin_deg)
        } else {
            group_by_centre(&of_class, &alpha, settings)
        };
        for mut members in groups.into_iter().filter(|g| g.len() > 1) {
            let mean = members.iter().map(alpha).sum::<f64>() / members.len() as f64;
            members.sort_unstable();
            bins.push(Bin {
                joint_id: format!("joint/{class}/{mean:.2}"),
                class: class.to_owned(),
                members,
            });
        }
    }
    bins
}

/// Splits maneuvers, sorted by angle of attack, at the widest gap until no group is wider than
/// `widest_deg`.
fn split_at_gaps(
    sorted: &[usize],
    alpha: &dyn Fn(&usize) -> f64,
    widest_deg: f64,
) -> Vec<Vec<usize>> {
    let (Some(first), Some(last)) = (sorted.first(), sorted.last()) else {
        return vec![];
    };
    if alpha(last) - alpha(first) <= widest_deg {
        return vec![sorted.to_vec()];
    }
    let gap = |i: &usize| alpha(&sorted[*i]) - alpha(&sorted[*i - 1]);
    let Some(at) = (1..sorted.len()).max_by(|a, b| gap(a).total_cmp(&gap(b)).then(b.cmp(a))) else {
        return vec![];
    };
    let (low, high) = sorted.split_at(at);
    [
        split_at_gaps(low, alpha, widest_deg),
        split_at_gaps(high, alpha, widest_deg),
    ]
    .concat()
}

/// Groups maneuvers by the nearest centre within half of `alpha_bin_deg`.
fn group_by_centre(
    sorted: &[usize],
    alpha: &dyn Fn(&usize) -> f64,
    settings: &JointSettings,
) -> Vec<Vec<usize>> {
    let centres = &settings.centres_deg;
    let nearest = |i: &usize| {
        let distance = |c: &usize| (alpha(i) - centres[*c]).abs();
        let centre = (0..centres.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        (distance(&centre) <= settings.alpha_bin_deg / 2.0).then_some(centre)
    };
    let of = |c: usize| {
        sorted
            .iter()
            .copied()
            .filter(|i| nearest(i) == Some(c))
            .collect()
    };
    (0..centres.len()).map(of).collect()
}

/// Results of a joint estimation: rows as for a maneuver, and a row of `joint` for each member.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joined {
    pub estimated: Estimated,
    pub members: Vec<JointRow>,
}

/// Estimates maneuvers of one class together.
///
/// The outcome has any failure. A maneuver that fails alone is left out, and the reason names it;
/// so are those that are `doubtful`, each with its reason.
#[must_use]
pub fn estimate(
    joint_id: &str,
    members: &[(&Record, &Maneuver)],
    doubtful: &[(&Maneuver, String)],
    class: &Class,
    context: &Context,
) -> Joined {
    let all: Vec<&Maneuver> = members.iter().map(|(_, m)| *m).collect();
    let class = class.at(mean_of(&all, |m| m.alpha_deg));
    match class.axis {
        Axis::Longitudinal => {
            estimate_members::<3, Longitudinal>(joint_id, members, doubtful, &class, context)
        }
        Axis::Lateral => {
            estimate_members::<4, Lateral>(joint_id, members, doubtful, &class, context)
        }
    }
}

/// A maneuver that takes part, with its estimation alone.
struct Member<'a, const NX: usize, E: Equations<NX>> {
    task: Task<'a>,
    prepared: PreparedCase<'a, NX, E>,
    alone: Fit,
}

fn estimate_members<const NX: usize, E: Equations<NX>>(
    joint_id: &str,
    members: &[(&Record, &Maneuver)],
    doubtful: &[(&Maneuver, String)],
    class: &Class,
    context: &Context,
) -> Joined {
    let (mut parts, mut left_out) = (Vec::new(), doubtful.to_vec());
    for &(record, maneuver) in members {
        match member::<NX, E>(Task {
            record,
            maneuver,
            class,
            context,
        }) {
            Ok(part) => parts.push(part),
            Err(reason) => left_out.push((maneuver, reason)),
        }
    }
    let taking: Vec<&Maneuver> = parts.iter().map(|p| p.task.maneuver).collect();
    let all: Vec<&Maneuver> = members.iter().map(|(_, m)| *m).collect();
    let whole = mean_maneuver(joint_id, if taking.is_empty() { &all } else { &taking });
    let Some((record, _)) = members.first() else {
        return without_members(&whole);
    };
    let task = Task {
        record,
        maneuver: &whole,
        class,
        context,
    };
    let fitted = if parts.len() > 1 {
        fit(&task, &parts)
    } else {
        Err("fewer than two maneuvers to join".to_owned())
    };
    let (mut estimated, costs) = fitted.unwrap_or_else(|reason| (task.rejected(reason), vec![]));
    for (maneuver, reason) in &left_out {
        estimated.fit.reason = format!(
            "{}; left out: {} ({reason})",
            estimated.fit.reason, maneuver.maneuver_id
        );
    }
    let row =
        |maneuver: &Maneuver, part: Participation| joint_row(&whole, parts.len(), maneuver, part);
    let joined = parts.iter().enumerate().map(|(i, p)| JointRow {
        cost_alone: p.alone.final_cost,
        cost_joint: costs.get(i).copied(),
        ..row(p.task.maneuver, Participation::Joined)
    });
    let rows = joined
        .chain(
            left_out
                .into_iter()
                .map(|(m, reason)| row(m, Participation::LeftOut(reason))),
        )
        .collect();
    Joined {
        estimated,
        members: rows,
    }
}

/// Prepares a maneuver and estimates it alone.
fn member<const NX: usize, E: Equations<NX>>(task: Task) -> Result<Member<NX, E>, String> {
    let prepared = task.prepare::<NX, E>(task.class_model()?)?;
    let (mut alone, _) = task.fit(&prepared.case, &task.starting_points(&prepared.case)?)?;
    estimation::add_bounds(&prepared.case, &mut alone, &task.context.settings.iteration);
    if alone.outcome == Outcome::NotConverged {
        return Err(format!("alone: {}", alone.reason));
    }
    Ok(Member {
        task,
        prepared,
        alone,
    })
}

/// Output error on the sum of the costs, from the mean of the maneuvers' own estimates.
fn fit<'a, const NX: usize, E: Equations<NX>>(
    task: &Task<'a>,
    parts: &[Member<'a, NX, E>],
) -> Result<(Estimated, Vec<f64>), String> {
    let cases = parts
        .iter()
        .map(|p| (p.task.maneuver.maneuver_id.as_str(), &p.prepared.case));
    let settings = task.context.settings;
    let share_constants = settings.joint.as_ref().is_some_and(|s| s.share_constants);
    let joint = Joint::new(cases, |name| !share_constants && task.is_constant(name))?;
    let (weights, resolution) = (task.weights()?, task.resolution());
    let own: Vec<Vec<f64>> = parts.iter().map(|p| p.alone.values.clone()).collect();
    let from = |shared: &[f64]| {
        let start = joint.parameters().assemble(shared, &own);
        estimation::estimate(
            &joint,
            start,
            weights,
            settings.weights,
            resolution,
            &settings.iteration,
        )
    };
    let mut fit = from(&starting_values(parts, joint.parameters().shared()));
    if fit.outcome != Outcome::Converged {
        // From the derivatives of the maneuver that fits best alone.
        let cost = |p: &&Member<NX, E>| p.alone.final_cost.unwrap_or(f64::INFINITY);
        let best = parts.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
        let other = best.map(|p| {
            from(
                &joint
                    .parameters()
                    .shared()
                    .iter()
                    .map(|&j| p.alone.values[j])
                    .collect::<Vec<_>>(),
            )
        });
        fit = other
            .filter(|f| f.outcome == Outcome::Converged)
            .unwrap_or(fit);
    }
    let costs = if fit.final_cost.is_some() {
        joint.costs(&fit.response, &weights)
    } else {
        vec![]
    };
    add_held_uncertainty(task, parts, &joint, &mut fit);
    add_calibration_errors(parts, &joint, &mut fit);
    let names = joint.names().to_vec();
    let (fit, _) = fit.with_response(Response::default());
    // Parameters that each maneuver keeps to itself have no row.
    let is_shared =
        |row: &EstimateRow| row.status != Status::Estimated || names.contains(&row.derivative);
    let shared = task
        .estimate_rows(Some((&names, &fit)))
        .into_iter()
        .filter(is_shared);
    let left_out =
        parts.iter().map(|p| p.prepared.left_out).sum::<f64>() / parts.len().max(1) as f64;
    let estimated = Estimated {
        estimates: shared.collect(),
        combined: task.combined_rows(&names, &fit),
        correlations: vec![],
        covariance: Covariance::of_fit(&names, &fit),
        history: None,
        fit_outputs: vec![],
        means: None,
        fit: task.fit_row(&fit, left_out, StartingValues::SingleEstimates),
    };
    Ok((estimated, costs))
}

/// Mean of the maneuvers' own derivatives, weighted by their covariances; the plain mean where these
/// do not exist.
fn starting_values<const NX: usize, E: Equations<NX>>(
    parts: &[Member<NX, E>],
    shared: &[usize],
) -> Vec<f64> {
    let n = shared.len();
    let values =
        |p: &Member<NX, E>| DVector::from_iterator(n, shared.iter().map(|&j| p.alone.values[j]));
    let estimate = |p: &Member<NX, E>| {
        let covariance: &DMatrix<f64> = p.alone.covariance.as_ref()?;
        Some(mean::Estimate {
            places: (0..n).collect(),
            values: values(p),
            covariance: DMatrix::from_fn(n, n, |i, j| covariance[(shared[i], shared[j])]),
        })
    };
    let estimates: Vec<mean::Estimate> = parts.iter().filter_map(estimate).collect();
    let plain = || parts.iter().map(values).sum::<DVector<f64>>();
    let mean = mean::weighted(&estimates, n).unwrap_or_else(|| plain() / parts.len().max(1) as f64);
    mean.as_slice().to_vec()
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
        .map(|p| p.task.with_held_free(&p.prepared))
        .collect();
    let own = |i: usize| {
        joint
            .parameters()
            .places(i)
            .iter()
            .filter_map(|&p| fit.values.get(p))
            .copied()
            .collect::<Vec<f64>>()
    };
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
    let mut together: Vec<DVector<f64>> = vec![];
    let mut errors = vec![];
    for (i, part) in parts.iter().enumerate() {
        let places = joint.parameters().places(i);
        let own: Vec<f64> = places.iter().map(|&p| fit.values[p]).collect();
        errors = part.task.misreadings(&part.prepared.window);
        let Ok(shifts) = part
            .task
            .gradient_shifts(&part.prepared, &errors, &own, &fit.weights)
        else {
            fit.reason.push_str(NOT_COUNTED);
            return;
        };
        together.resize(shifts.len(), DVector::zeros(joint.names().len()));
        for (sum, shift) in together.iter_mut().zip(shifts) {
            for (&place, value) in places.iter().zip(shift.iter()) {
                sum[place] += value;
            }
        }
    }
    calibration_errors::add_calibration_errors(joint, &errors, &together, fit);
}

fn mean_of(maneuvers: &[&Maneuver], value: impl Fn(&Maneuver) -> f64) -> f64 {
    maneuvers.iter().map(|m| value(m)).sum::<f64>() / maneuvers.len().max(1) as f64
}

/// A maneuver with the mean flight condition of several.
fn mean_maneuver(joint_id: &str, maneuvers: &[&Maneuver]) -> Maneuver {
    let mean = |value: fn(&Maneuver) -> f64| mean_of(maneuvers, value);
    Maneuver {
        maneuver_id: joint_id.to_owned(),
        flight_id: JOINT_FLIGHT.to_owned(),
        class: maneuvers
            .first()
            .map_or_else(String::new, |m| m.class.clone()),
        axis: maneuvers.first().map_or(Axis::Longitudinal, |m| m.axis),
        start_s: 0.0,
        end_s: 0.0,
        alpha_deg: mean(|m| m.alpha_deg),
        mach: mean(|m| m.mach),
        qbar_psf: mean(|m| m.qbar_psf),
        velocity_ft_s: mean(|m| m.velocity_ft_s),
        altitude_ft: mean(|m| m.altitude_ft),
        mass_slug: mean(|m| m.mass_slug),
        x_cg_ft: mean(|m| m.x_cg_ft),
        samples: maneuvers.iter().map(|m| m.samples).sum(),
        origin: ManeuverOrigin::Joint,
        recognised: Recognised::default(),
        quality: Quality::default(),
    }
}

fn without_members(whole: &Maneuver) -> Joined {
    let fit = rejected_fit(whole, "no maneuver to join".to_owned());
    Joined {
        estimated: Estimated::without_fit(fit, vec![]),
        members: vec![],
    }
}

fn joint_row(
    whole: &Maneuver,
    maneuvers: usize,
    member: &Maneuver,
    part: Participation,
) -> JointRow {
    JointRow {
        joint_id: whole.maneuver_id.clone(),
        class: whole.class.clone(),
        joint_alpha_deg: whole.alpha_deg,
        joint_mach: whole.mach,
        maneuvers,
        maneuver_id: member.maneuver_id.clone(),
        flight_id: member.flight_id.clone(),
        alpha_deg: member.alpha_deg,
        mach: member.mach,
        part,
        cost_alone: None,
        cost_joint: None,
    }
}
