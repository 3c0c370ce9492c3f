//! Joint estimation: maneuvers of one class and nearly one angle of attack share their derivatives.
//! Each keeps its biases and initial states.
//!
//! Each also keeps its constants (`CN_0`) unless `share_constants` is set. They take up trim and
//! the zero errors of vanes and surfaces, which differ between flights.
//!
//! The class's table and weights are those at the mean angle of attack, so that all maneuvers have
//! the same free derivatives. A held derivative has the tunnel's value at each maneuver's own angle
//! of attack and Mach number. One value for all would attribute its change between them to the
//! shared derivatives. The tunnel's error is common to all maneuvers.

mod bins;
mod by_filter_error;
mod by_output_error;
mod member;
mod recorded_alike;

use serde::{Deserialize, Serialize};

use self::by_filter_error::OwnEstimate;
use self::member::{Fitted, Member};
use self::recorded_alike::RecordedAlike;
use super::context::Context;
use super::estimated::{Estimated, rejected_fit};
use super::rows::RowMaker;
use super::task::Task;
use crate::aero::Axis;
use crate::dynamics::{
    Equations, InGusts, Lateral, LateralInGusts, Longitudinal, LongitudinalInGusts,
};
use crate::flight::Record;
use crate::maneuver::{Class, Maneuver, ManeuverOrigin, Quality, Recognised};
use crate::output_error::Outcome;
use crate::tables::{JOINT_FLIGHT, JointRow, Participation};

pub use self::bins::{Bin, bins};

/// Results of a joint estimation: rows as for a maneuver, and a row of `joint` for each member.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joined {
    pub estimated: Estimated,
    pub members: Vec<JointRow>,
}

/// Estimates maneuvers of one class together.
///
/// A failure is reported in the outcome. Maneuvers that fail alone or are `doubtful` are left out;
/// the reason names them.
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
    let group = RecordedAlike::new(members, &class, context);
    let request = Request {
        joint_id,
        members: &group.members,
        class: &group.class,
        context,
    };
    let left_out = [doubtful, &group.left_out].concat();
    let mut joined = match class.axis {
        Axis::Longitudinal => request.estimate::<3, Longitudinal, 4, LongitudinalInGusts>(left_out),
        Axis::Lateral => request.estimate::<4, Lateral, 6, LateralInGusts>(left_out),
    };
    for row in &mut joined.estimated.estimates {
        row.held_because = group.reasons.get(&row.derivative).cloned();
    }
    joined
}

/// Maneuvers to be joined.
struct Request<'r> {
    joint_id: &'r str,
    members: &'r [(&'r Record, &'r Maneuver)],
    /// Class at the mean angle of attack.
    class: &'r Class,
    context: &'r Context<'r>,
}

/// Maneuvers that are left out, each with the reason.
type LeftOut<'r> = Vec<(&'r Maneuver, String)>;

/// A maneuver that takes part, with the cost of its fit alone.
type TakingPart<'r> = (&'r Maneuver, Option<f64>);

impl<'r> Request<'r> {
    /// Estimates by filter error if a maneuver needs it. Estimates by output error otherwise. It
    /// does so also if the sensors' noise explains all maneuvers, or if filter error does not
    /// converge and all residuals of output error are white.
    fn estimate<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
        &self,
        mut left_out: LeftOut<'r>,
    ) -> Joined {
        let mut members = Vec::new();
        for &(record, maneuver) in self.members {
            match Member::<NX, E>::new(self.task(record, maneuver)) {
                Ok(member) => members.push(member),
                Err(reason) => left_out.push((maneuver, reason)),
            }
        }
        if members.iter().any(Member::needs_filter) {
            let joined = self.by_filter_error::<NX, E, NG, G>(&members, left_out.clone());
            let counts = |joined: &Joined| {
                let converged = joined.estimated.fit.outcome == Outcome::Converged;
                converged || !members.iter().all(Member::is_white)
            };
            if let Some(joined) = joined.filter(counts) {
                return joined;
            }
        }
        self.by_output_error(members, left_out)
    }

    /// A maneuver, or the group as a whole, to be estimated with the class of the group.
    fn task<'t>(&self, record: &'t Record, maneuver: &'t Maneuver) -> Task<'t>
    where
        'r: 't,
    {
        Task {
            record,
            maneuver,
            class: self.class,
            context: self.context,
        }
    }

    /// Estimates by filter error; `None` if no maneuver shows that the air moves.
    fn by_filter_error<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
        &self,
        members: &[Member<'r, NX, E>],
        mut left_out: LeftOut<'r>,
    ) -> Option<Joined> {
        let mut own = Vec::new();
        for member in members {
            match OwnEstimate::new::<NG, G>(member) {
                Ok(estimate) => own.push(estimate),
                Err(reason) => left_out.push((member.task.maneuver, reason)),
            }
        }
        if !own.is_empty() && own.iter().all(|o| o.air_is_still) {
            return None;
        }
        let taking = own.iter().map(|o| (o.member.task.maneuver, o.cost));
        let taking: Vec<TakingPart> = taking.collect();
        Some(self.join(&taking, left_out, |task| {
            by_filter_error::fit_jointly::<NX, E, NG, G>(task, &own)
        }))
    }

    /// Estimates by output error, without the maneuvers whose own fit does not converge.
    fn by_output_error<const NX: usize, E: Equations<NX>>(
        &self,
        members: Vec<Member<'r, NX, E>>,
        mut left_out: LeftOut<'r>,
    ) -> Joined {
        let converged = |member: &Member<'r, NX, E>| member.alone.outcome != Outcome::NotConverged;
        let (members, failed): (Vec<_>, Vec<_>) = members.into_iter().partition(converged);
        left_out.extend(failed.into_iter().map(|member| {
            let reason = format!("alone: {}", member.alone.reason);
            (member.task.maneuver, reason)
        }));
        let taking = members
            .iter()
            .map(|member| (member.task.maneuver, member.alone.final_cost));
        let taking: Vec<TakingPart> = taking.collect();
        self.join(&taking, left_out, |task| {
            by_output_error::fit_jointly(task, &members)
        })
    }

    /// Results of a group from its fit.
    fn join(
        &self,
        taking: &[TakingPart<'r>],
        left_out: LeftOut<'r>,
        fit: impl FnOnce(&Task) -> Result<Fitted, String>,
    ) -> Joined {
        let all = self.members.iter().map(|(_, maneuver)| *maneuver);
        let mut of_mean: Vec<&Maneuver> = taking.iter().map(|(maneuver, _)| *maneuver).collect();
        if of_mean.is_empty() {
            of_mean = all.collect();
        }
        let whole = mean_maneuver(self.joint_id, &of_mean);
        let Some((record, _)) = self.members.first() else {
            return without_members(&whole);
        };
        let task = self.task(record, &whole);
        let fitted = if taking.len() > 1 {
            fit(&task)
        } else {
            Err("fewer than two maneuvers to join".to_owned())
        };
        let Fitted {
            mut estimated,
            costs,
        } = fitted.unwrap_or_else(|reason| Fitted {
            estimated: RowMaker::new(&task).rejected(reason),
            costs: vec![],
        });
        for (maneuver, reason) in &left_out {
            estimated.fit.reason = format!(
                "{}; left out: {} ({reason})",
                estimated.fit.reason, maneuver.maneuver_id
            );
        }
        Joined {
            members: joint_rows(&whole, taking, left_out, &costs),
            estimated,
        }
    }
}

/// Rows of `joint`: of the maneuvers that take part, with their costs in the joint fit, and of those
/// that are left out.
fn joint_rows(
    whole: &Maneuver,
    taking: &[TakingPart],
    left_out: LeftOut,
    costs: &[f64],
) -> Vec<JointRow> {
    let count = taking.len();
    let row = |maneuver: &Maneuver, part| joint_row(whole, count, maneuver, part);
    let joined = taking.iter().enumerate();
    let joined = joined.map(|(i, (maneuver, cost_alone))| JointRow {
        cost_alone: *cost_alone,
        cost_joint: costs.get(i).copied(),
        ..row(maneuver, Participation::Joined)
    });
    let left_out = left_out.into_iter();
    let left_out = left_out.map(|(maneuver, reason)| row(maneuver, Participation::LeftOut(reason)));
    joined.chain(left_out).collect()
}

/// Mean of a quantity over maneuvers; zero without any.
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

/// Result of a group without maneuvers.
fn without_members(whole: &Maneuver) -> Joined {
    let fit = rejected_fit(whole, "no maneuver to join".to_owned());
    Joined {
        estimated: Estimated::without_fit(fit, vec![]),
        members: vec![],
    }
}

/// Row of a maneuver without its costs.
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
