//! Joint estimation by filter error.

use super::member::{Fitted, Member, is_unshared, mean_of_own_estimates};
use crate::dynamics::{Equations, InGusts, OUTPUTS};
use crate::estimate::moving_air::air_motion::Air;
use crate::estimate::moving_air::filter_group::{FilterStart, Group, SlopeFit};
use crate::estimate::moving_air::filter_minimum::NoMinimum;
use crate::estimate::moving_air::group_member::GroupMember;
use crate::estimate::moving_air::gust_size::{gust_ft_s, rotary_gust_deg_s};
use crate::estimate::moving_air::maneuver_filter::least_deviations;
use crate::estimate::moving_air::whiteness::{lag_one, largest_correlation};
use crate::estimate::task::Task;
use crate::filter_error::noise::Noise;
use crate::output_error::sharing::SharedParameters;
use crate::output_error::{Case, Fit, Outcome, Response};
use crate::tables::{EstimationMethod, FitRow};

/// A maneuver with its own estimate, from which the joint one starts.
pub struct OwnEstimate<'m, 'a, const NX: usize, E: Equations<NX>> {
    pub member: &'m Member<'a, NX, E>,
    /// The maneuver with the held derivatives free as well.
    wide: Case<NX, E>,
    fit: Fit,
    noise: Noise,
    /// −log of the likelihood by filter error; `None` if a maneuver alone does not determine its
    /// derivatives, or flew in still air.
    pub cost: Option<f64>,
    pub air_is_still: bool,
}

impl<'m, 'a, const NX: usize, E: Equations<NX>> OwnEstimate<'m, 'a, NX, E> {
    /// Estimates a maneuver alone. A maneuver that does not determine its derivatives, or was flown
    /// in still air, takes part with its estimates by output error.
    pub fn new<const NG: usize, G: InGusts<NG>>(
        member: &'m Member<'a, NX, E>,
    ) -> Result<Self, String> {
        let (task, prepared) = (&member.task, &member.prepared);
        let wide = prepared.with_held_free(task.context.aircraft);
        let implied = member.starts.implied.clone();
        let air = Air::estimate::<NX, E, NG, G>(task, prepared, &wide, implied, &member.alone);
        let air_is_still = matches!(air, Air::IsStill);
        let deviations = || least_deviations(task, &prepared.case.measurements);
        let alone = |noise| (member.alone.clone(), noise, None);
        let (fit, noise, cost) = match air {
            Air::Moves(filtered) => (filtered.fit, filtered.noise, Some(filtered.cost)),
            Air::IsStill => alone(Noise::with_small_gusts(deviations())),
            Air::Unknown(_) if member.alone.outcome == Outcome::Unidentifiable => {
                alone(Noise::starting(deviations()))
            }
            Air::Unknown(why) => return Err(format!("alone: {why}")),
        };
        Ok(OwnEstimate {
            member,
            wide,
            fit,
            noise,
            cost,
            air_is_still,
        })
    }
}

/// Filter error on the sum of the costs, from the mean of the maneuvers' own estimates.
pub fn fit_jointly<'a, const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
    task: &Task<'a>,
    own: &[OwnEstimate<'_, 'a, NX, E>],
) -> Result<Fitted, String> {
    let named = own.iter().map(|o| {
        let case = &o.member.prepared.case;
        let label = o.member.task.maneuver.maneuver_id.as_str();
        (label, case.names.as_slice(), case.derivatives())
    });
    let parameters = SharedParameters::new(named, |name| is_unshared(task, name))?;
    let members = own
        .iter()
        .map(|o| GroupMember::new(&o.member.task, &o.member.prepared, &o.wide));
    let group: Group<NX, E, NG, G> = Group::new(task, members.collect(), parameters);
    let slope_fit = minimum(&group, own).map_err(|why| why.to_string())?;
    let (fit, responses) = group.fit(&slope_fit).with_response(Response::default());
    let members = own.iter().map(|o| o.member);
    let mut fitted = Fitted::new(
        task,
        group.parameters.names(),
        &fit,
        members,
        slope_fit.costs(),
    );
    let air = JointAir {
        noise: group.noise(&slope_fit),
        responses,
    };
    air.add_to(own, &mut fitted.estimated.fit);
    Ok(fitted)
}

/// Fit of a group: from the noise of the maneuvers' own fits, and from light turbulence where the
/// iteration does not converge.
fn minimum<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
    group: &Group<NX, E, NG, G>,
    own: &[OwnEstimate<NX, E>],
) -> Result<SlopeFit<NG, G>, NoMinimum> {
    let alone: Vec<&Fit> = own.iter().map(|o| &o.fit).collect();
    let shared = mean_of_own_estimates(&alone, group.parameters.shared());
    let values: Vec<Vec<f64>> = alone.iter().map(|fit| fit.values.clone()).collect();
    let start = |noise: Vec<Noise>| FilterStart {
        own: group.parameters.assemble(&shared, &values),
        noise,
    };
    let found = start(own.iter().map(|o| o.noise).collect());
    let deviations = group.members.iter().map(|member| member.deviations);
    let light = start(deviations.map(Noise::starting).collect());
    let constant = group.constant();
    let filters = group.filters(&constant, None);
    let minimum = group.minimum(&filters, &found);
    let minimum = minimum.or_else(|_| group.minimum(&filters, &light))?;
    let slope_fit = group.slope_fit(constant, filters, minimum);
    Ok(group.with_slopes(slope_fit.ok_or(NoMinimum::Diverges)?))
}

/// Air of a group's maneuvers, and their predicted outputs.
struct JointAir {
    noise: Vec<Noise>,
    responses: Vec<Response>,
}

impl JointAir {
    /// Adds the gusts that the filters estimate to the row of `fits`. They are the root mean square
    /// of the maneuvers' gusts, and the largest correlation of innovations. The row has no cost of
    /// output error.
    fn add_to<const NX: usize, E: Equations<NX>>(
        &self,
        own: &[OwnEstimate<NX, E>],
        row: &mut FitRow,
    ) {
        let air = own.iter().zip(&self.noise).map(|(o, noise)| {
            let (task, case) = (&o.member.task, &o.member.prepared.case);
            (
                gust_ft_s(task, noise, case.step_s),
                rotary_gust_deg_s(task.class.axis, noise),
            )
        });
        let air: Vec<(f64, f64)> = air.collect();
        let rms = |value: fn(&(f64, f64)) -> f64| {
            let square: f64 = air.iter().map(|both| value(both).powi(2)).sum();
            (square / air.len().max(1) as f64).sqrt()
        };
        let correlations = own.iter().zip(&self.responses).map(|(o, response)| {
            let measured = &o.member.prepared.case.measurements;
            let correlations: [f64; OUTPUTS] = lag_one(measured, &response.outputs);
            largest_correlation(correlations)
        });
        [row.initial_cost, row.final_cost] = [None; 2];
        row.method = Some(EstimationMethod::FilterError);
        row.gust_ft_s = Some(rms(|(gust, _)| *gust));
        row.rotary_gust_deg_s = Some(rms(|(_, rotary)| *rotary));
        row.autocorrelation = correlations.flatten().reduce(f64::max);
    }
}
