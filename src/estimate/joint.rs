//! Joint estimation: maneuvers of one class and nearly one angle of attack share their derivatives,
//! while each keeps its biases and initial states.
//!
//! Constants (`CN_0`) are biases as well: they take up the zero errors of vanes and surfaces, which
//! are others in each flight, and the trim. Unless `share_constants` says otherwise each maneuver
//! keeps its own.
//!
//! Which derivatives are free and what the outputs weigh is decided at the mean angle of attack of
//! the maneuvers, or they could not share anything. A held derivative acts at the tunnel's value at
//! each maneuver's own angle of attack and Mach number, as it does when the maneuver is estimated
//! alone: the tunnel knows how it changes between them, and to hold one value for all would charge
//! that change to the shared derivatives. The tunnel's error is one and the same for all.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::{Basis, Estimated, Ready, Run, calibration, covariance, values_of};
use crate::aero::Axis;
use crate::dynamics::{Equations, Lateral, Longitudinal};
use crate::flight::Record;
use crate::maneuver::{Class, Maneuver, ManeuverOrigin, Quality, Recognised, Status};
use crate::output_error::consider::{self, Considered};
use crate::output_error::{
    Case, Fit, Joint, Likelihood, Outcome, Response, calibration_errors, estimation, mean,
};
use crate::settings::settings;
use crate::tables::{EstimateRow, JOINT_FLIGHT, JointRow, Participation, StartingValues};

settings! {
    /// Settings of joint estimation.
    pub struct Settings {
        /// Widest spread of the mean angles of attack of joined maneuvers, deg. The default is half
        /// the usual distance of test points. Larger: smaller bounds, and the change of derivatives
        /// over the spread becomes an error.
        pub alpha_bin_deg: f64 = 2.5,
        /// Angles of attack around which maneuvers are joined, each within half of `alpha_bin_deg`.
        /// Without any, maneuvers are parted at their widest gaps.
        pub centres_deg: Vec<f64> = Vec::new(),
    }
    elsewhere {
        /// Constants shared by joined maneuvers: `estimate: expert: share_constants`.
        pub share_constants: bool = false,
    }
}

/// Maneuvers that are to be estimated together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// `joint/<class>/<mean α>`: the `maneuver_id` of its rows.
    pub joint_id: String,
    pub class: String,
    /// Places in the list of maneuvers, in its order; two or more.
    pub members: Vec<usize>,
}

/// Groups maneuvers by class and angle of attack; one that stands alone is in no group.
#[must_use]
pub fn bins(maneuvers: &[Maneuver], settings: &Settings) -> Vec<Bin> {
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
            parted(&of_class, &alpha, settings.alpha_bin_deg)
        } else {
            around(&of_class, &alpha, settings)
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

/// Parts maneuvers, sorted by angle of attack, at the widest gap until none of the groups is wider
/// than `widest_deg`.
fn parted(sorted: &[usize], alpha: &dyn Fn(&usize) -> f64, widest_deg: f64) -> Vec<Vec<usize>> {
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
        parted(low, alpha, widest_deg),
        parted(high, alpha, widest_deg),
    ]
    .concat()
}

/// Each maneuver with the nearest centre, if it is near enough.
fn around(sorted: &[usize], alpha: &dyn Fn(&usize) -> f64, settings: &Settings) -> Vec<Vec<usize>> {
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

/// What joint estimation gives: rows as of a maneuver, and a row for each maneuver that was to be
/// joined.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joined {
    pub estimated: Estimated,
    pub members: Vec<JointRow>,
}

/// Estimates maneuvers together; `class` is theirs. Whatever goes wrong is in the outcome; a
/// maneuver that fails alone is left out and named in the reason.
#[must_use]
pub fn estimate(
    joint_id: &str,
    members: &[(&Record, &Maneuver)],
    class: &Class,
    basis: &Basis,
) -> Joined {
    let all: Vec<&Maneuver> = members.iter().map(|(_, m)| *m).collect();
    let class = class.at(mean_of(&all, |m| m.alpha_deg));
    match class.axis {
        Axis::Longitudinal => together::<3, Longitudinal>(joint_id, members, &class, basis),
        Axis::Lateral => together::<4, Lateral>(joint_id, members, &class, basis),
    }
}

/// A maneuver that takes part, with its own estimation.
struct Part<'a, const NX: usize, E: Equations<NX>> {
    run: Run<'a>,
    ready: Ready<'a, NX, E>,
    alone: Fit,
}

fn together<const NX: usize, E: Equations<NX>>(
    joint_id: &str,
    members: &[(&Record, &Maneuver)],
    class: &Class,
    basis: &Basis,
) -> Joined {
    let (mut parts, mut left_out) = (Vec::new(), Vec::new());
    for &(record, maneuver) in members {
        match part::<NX, E>(Run {
            record,
            maneuver,
            class,
            basis,
        }) {
            Ok(part) => parts.push(part),
            Err(reason) => left_out.push((maneuver, reason)),
        }
    }
    let taking: Vec<&Maneuver> = parts.iter().map(|p| p.run.maneuver).collect();
    let all: Vec<&Maneuver> = members.iter().map(|(_, m)| *m).collect();
    let whole = condition(joint_id, if taking.is_empty() { &all } else { &taking });
    let Some((record, _)) = members.first() else {
        return nothing(&whole);
    };
    let run = Run {
        record,
        maneuver: &whole,
        class,
        basis,
    };
    let fitted = if parts.len() > 1 {
        fit(&run, &parts)
    } else {
        Err("fewer than two maneuvers to join".to_owned())
    };
    let (mut estimated, costs) = fitted.unwrap_or_else(|reason| (run.rejected(reason), vec![]));
    for (maneuver, reason) in &left_out {
        estimated.fit.reason = format!(
            "{}; left out: {} ({reason})",
            estimated.fit.reason, maneuver.maneuver_id
        );
    }
    let row = |maneuver: &Maneuver, part: Participation| row(&whole, parts.len(), maneuver, part);
    let joined = parts.iter().enumerate().map(|(i, p)| JointRow {
        cost_alone: p.alone.final_cost,
        cost_joint: costs.get(i).copied(),
        ..row(p.run.maneuver, Participation::Joined)
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

/// Makes a maneuver ready and estimates it alone.
fn part<const NX: usize, E: Equations<NX>>(run: Run) -> Result<Part<NX, E>, String> {
    let ready = run.ready::<NX, E>(run.model()?)?;
    let (alone, _) = run.fit(&ready.case)?;
    if alone.outcome == Outcome::NotConverged {
        return Err(format!("alone: {}", alone.reason));
    }
    Ok(Part { run, ready, alone })
}

/// Output error on the sum of the costs, from the mean of the maneuvers' own estimates.
fn fit<'a, const NX: usize, E: Equations<NX>>(
    run: &Run<'a>,
    parts: &[Part<'a, NX, E>],
) -> Result<(Estimated, Vec<f64>), String> {
    let cases = parts
        .iter()
        .map(|p| (p.run.maneuver.maneuver_id.as_str(), &p.ready.case));
    let settings = run.basis.settings;
    let share_constants = settings.joint.as_ref().is_some_and(|s| s.share_constants);
    let joint = Joint::new(cases, |name| !share_constants && run.is_constant(name))?;
    let (weights, resolution) = (run.weights()?, run.resolution());
    let own: Vec<Vec<f64>> = parts.iter().map(|p| p.alone.values.clone()).collect();
    let from = |shared: &[f64]| {
        let start = joint.assemble(shared, &own);
        estimation::estimate(
            &joint,
            start,
            weights,
            settings.weights,
            resolution,
            &settings.iteration,
        )
    };
    let mut fit = from(&start(parts, joint.shared()));
    if fit.outcome != Outcome::Converged {
        // From the derivatives of the maneuver that fits best alone.
        let cost = |p: &&Part<NX, E>| p.alone.final_cost.unwrap_or(f64::INFINITY);
        let best = parts.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
        let other = best.map(|p| {
            from(
                &joint
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
        joint.costs(&fit.response, &fit.weights)
    } else {
        vec![]
    };
    consider(run, parts, &joint, &mut fit);
    miscalibrate(parts, &joint, &mut fit);
    let names = joint.names().to_vec();
    let (fit, _) = fit.with_response(Response::default());
    // What each maneuver keeps to itself is no row of what they share.
    let is_shared =
        |row: &EstimateRow| row.status != Status::Estimated || names.contains(&row.derivative);
    let shared = run.rows(Some((&names, &fit))).into_iter().filter(is_shared);
    let left_out = parts.iter().map(|p| p.ready.left_out).sum::<f64>() / parts.len().max(1) as f64;
    let estimated = Estimated {
        estimates: shared.collect(),
        combined: run.combined(&names, &fit),
        correlations: vec![],
        covariance: covariance(&names, &fit),
        history: None,
        fit: run.fit_row(&fit, left_out, StartingValues::SingleEstimates),
    };
    Ok((estimated, costs))
}

/// The mean of the maneuvers' own derivatives, weighted by their covariances; plain where these do
/// not exist.
fn start<const NX: usize, E: Equations<NX>>(parts: &[Part<NX, E>], shared: &[usize]) -> Vec<f64> {
    let n = shared.len();
    let values =
        |p: &Part<NX, E>| DVector::from_iterator(n, shared.iter().map(|&j| p.alone.values[j]));
    let estimate = |p: &Part<NX, E>| {
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

/// Adds what the tunnel's errors do to the shared derivatives.
fn consider<'a, const NX: usize, E: Equations<NX>>(
    run: &Run<'a>,
    parts: &[Part<'a, NX, E>],
    joint: &Joint<NX, E>,
    fit: &mut Fit<Vec<Response>>,
) {
    let Some(first) = parts.first() else { return };
    let wide: Vec<Case<NX, E>> = parts.iter().map(|p| p.run.wide(&p.ready)).collect();
    let own = |i: usize| {
        joint
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
            case: &part.ready.case,
            wide,
            values: values_of(&part.ready.model, &part.ready.case.names, &own(i)),
            places: joint.places(i).to_vec(),
        })
        .collect();
    consider::consider_together(
        &considered,
        &run.held_uncertainties(&first.ready.model),
        fit,
    );
}

/// Adds what errors of calibration do to the shared derivatives. An error of a signal is common to
/// all its maneuvers: so it is where they are of one flight, and where flights have errors of their
/// own this is on the safe side.
fn miscalibrate<const NX: usize, E: Equations<NX>>(
    parts: &[Part<NX, E>],
    joint: &Joint<NX, E>,
    fit: &mut Fit<Vec<Response>>,
) {
    if fit.covariance_corrected.is_none() {
        return;
    }
    let mut together: Vec<DVector<f64>> = vec![];
    for (i, part) in parts.iter().enumerate() {
        let places = joint.places(i);
        let own: Vec<f64> = places.iter().map(|&p| fit.values[p]).collect();
        let Ok(shifts) = part.run.gradient_shifts(&part.ready, &own, &fit.weights) else {
            fit.reason.push_str(calibration::NOT_COUNTED);
            return;
        };
        together.resize(shifts.len(), DVector::zeros(joint.names().len()));
        for (sum, shift) in together.iter_mut().zip(shifts) {
            for (&place, value) in places.iter().zip(shift.iter()) {
                sum[place] += value;
            }
        }
    }
    calibration_errors::miscalibrated(joint, &together, fit);
}

fn mean_of(maneuvers: &[&Maneuver], value: impl Fn(&Maneuver) -> f64) -> f64 {
    maneuvers.iter().map(|m| value(m)).sum::<f64>() / maneuvers.len().max(1) as f64
}

/// The mean flight condition of maneuvers, in the form of one.
fn condition(joint_id: &str, maneuvers: &[&Maneuver]) -> Maneuver {
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

fn nothing(whole: &Maneuver) -> Joined {
    let fit = super::rejected(whole, "no maneuver to join".to_owned());
    Joined {
        estimated: Estimated::without_fit(fit, vec![]),
        members: vec![],
    }
}

fn row(whole: &Maneuver, maneuvers: usize, member: &Maneuver, part: Participation) -> JointRow {
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
