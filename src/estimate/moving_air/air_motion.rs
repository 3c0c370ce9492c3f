//! Filter error on one maneuver, and the choice between it and output error.

use nalgebra::DMatrix;

use super::filter_group::{FilterStart, Group, SlopeFit};
use super::filter_minimum::{Minimum, NoMinimum};
use super::group_member::GroupMember;
use super::gust_size::{gust_ft_s, rotary_gust_deg_s};
use super::sensor_noise;
use super::whiteness::{is_white, lag_one, largest_correlation, white_cost};
use crate::dynamics::{Equations, InGusts, OUTPUTS};
use crate::estimate::prepared_case::PreparedCase;
use crate::estimate::settings::Method;
use crate::estimate::task::Task;
use crate::filter_error::filter::Filter;
use crate::filter_error::noise::Noise;
use crate::output_error::equation_error::Regression;
use crate::output_error::{Case, Fit, Measurements, Response};
use crate::tables::{EstimationMethod, FitRow};

/// Filter error's result on a maneuver.
pub(in crate::estimate) struct Filtered {
    pub fit: Fit,
    /// Information of derivatives, biases and initial states.
    pub information: DMatrix<f64>,
    pub noise: Noise,
    /// −log of the likelihood.
    pub cost: f64,
    /// `true` if gusts account for a drift of the attitude.
    pub attitude_drifts: bool,
    /// Lag-one correlation of each output's innovations.
    autocorrelation: [f64; OUTPUTS],
    /// Log-likelihood gained over output error.
    likelihood_gain: Option<f64>,
    /// Outputs along the air's angle; `None` if they diverge.
    pub outputs_along_air: Option<Vec<[f64; OUTPUTS]>>,
    /// Equation error with the slopes over α that the filter holds; `None` without any.
    pub second_opinion: Option<Regression>,
    /// Cost of output error at its start and end.
    output_error_costs: [Option<f64>; 2],
}

/// Air of a maneuver by filter error.
pub(in crate::estimate) enum Air {
    /// The air moves: the estimates are those of filter error.
    Moves(Box<Filtered>),
    /// Coloured noise of the sensors explains the residuals of output error better than moving air.
    IsStill,
    /// Filter error gives no estimates, and the residuals do not show coloured noise of the
    /// sensors.
    Unknown(NoMinimum),
}

/// `true` if filter error is to estimate a maneuver with this fit by output error.
pub(in crate::estimate) fn needs_filter(
    method: Method,
    measurements: &Measurements,
    fit: &Fit,
) -> bool {
    match method {
        Method::OutputError => false,
        Method::FilterError => true,
        Method::Auto => !is_white(measurements, fit),
    }
}

impl Air {
    /// Estimates a maneuver by filter error. `wide` has the held derivatives free as well, and `implied`
    /// are the starting values by equation error.
    pub fn estimate<'a, const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
        task: &Task<'a>,
        prepared: &PreparedCase<'a, NX, E>,
        wide: &Case<NX, E>,
        implied: Vec<f64>,
        output_error: &Fit,
    ) -> Air {
        let member = GroupMember::new(task, prepared, wide);
        let group: Group<NX, E, NG, G> = Group::single(task, member);
        let constant = group.constant();
        let filters = group.filters(&constant, None);
        let minimum = minimise_from_two_starts(&group, &filters, implied, output_error);
        let fit_with_slopes = minimum.and_then(|minimum| {
            let slope_fit = group.slope_fit(constant, filters, minimum);
            Ok(group.with_slopes(slope_fit.ok_or(NoMinimum::Diverges)?))
        });
        let end = match &fit_with_slopes {
            Ok(fit) => Some(fit.end()),
            Err(why) => why.end(),
        };
        let filter = end.and_then(|end| end.response.members.first());
        let measurements = &prepared.case.measurements;
        if filter.is_some_and(|filter| sensor_noise::explains(measurements, output_error, filter)) {
            return Air::IsStill;
        }
        let filtered = fit_with_slopes
            .and_then(|fit| Filtered::new(&group, &fit, output_error).ok_or(NoMinimum::Diverges));
        match filtered {
            Ok(filtered) => Air::Moves(Box::new(filtered)),
            Err(why) => Air::Unknown(why),
        }
    }
}

impl Filtered {
    /// Adds the gusts that the filter found to the row of `fits`.
    pub fn add_gusts(&self, task: &Task, step_s: f64, row: &mut FitRow) {
        [row.initial_cost, row.final_cost] = self.output_error_costs;
        row.method = Some(EstimationMethod::FilterError);
        row.gust_ft_s = Some(gust_ft_s(task, &self.noise, step_s));
        row.rotary_gust_deg_s = Some(rotary_gust_deg_s(task.class.axis, &self.noise));
        row.gust_corner_rad_s = Some(self.noise.corner);
        row.autocorrelation = largest_correlation(self.autocorrelation);
        row.likelihood_gain = self.likelihood_gain;
    }

    /// Result of the fit of one maneuver.
    fn new<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
        group: &Group<NX, E, NG, G>,
        slope_fit: &SlopeFit<NG, G>,
        output_error: &Fit,
    ) -> Option<Filtered> {
        let member = group.members.first()?;
        let case = &member.prepared.case;
        let (mut fit, mut responses) = group.fit(slope_fit).with_response(Response::default());
        fit.response = responses.pop()?;
        let noise = group.noise(slope_fit).pop()?;
        Some(Filtered {
            information: group.information(slope_fit),
            outputs_along_air: group.outputs_along_air(0, slope_fit),
            second_opinion: member.second_opinion_on(&slope_fit.held),
            noise,
            cost: slope_fit.cost(),
            attitude_drifts: noise.is_of_air(G::AIR_RELATIVE_RATES.len(), case.step_s),
            autocorrelation: lag_one(&case.measurements, &fit.response.outputs),
            output_error_costs: [output_error.initial_cost, output_error.final_cost],
            likelihood_gain: white_cost(&case.measurements, output_error)
                .map(|cost| cost - slope_fit.cost()),
            fit,
        })
    }
}

/// Iterates from moving air, or from still air if the residuals of output error are white. If this
/// gives no estimates, iterates from the other start. Both starts are tried if a rotary gust is as
/// large as its rate. The gust may then be mistaken for the effect of the rate.
///
/// # Errors
/// Why no start leads to a minimum: the reason of the iteration that ended at the least cost.
fn minimise_from_two_starts<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
    group: &Group<NX, E, NG, G>,
    filters: &[Filter<NG, G>],
    implied: Vec<f64>,
    output_error: &Fit,
) -> Result<Minimum, NoMinimum> {
    let member = group.members.first().ok_or(NoMinimum::Diverges)?;
    let case = &member.prepared.case;
    let start = |own: Vec<f64>, noise: Noise| FilterStart {
        own,
        noise: vec![noise],
    };
    let moving = start(implied, Noise::starting(member.deviations));
    let still = start(
        output_error.values.clone(),
        Noise::with_small_gusts(member.deviations),
    );
    let starts = if is_white(&case.measurements, output_error) {
        [still, moving]
    } else {
        [moving, still]
    };
    let (mut least, mut failures) = (None::<Minimum>, vec![]);
    for start in &starts {
        match group.minimum(filters, start) {
            Ok(minimum) => least = least.into_iter().chain([minimum]).min_by(Minimum::by_cost),
            Err(why) => failures.push(why),
        }
        let is_plausible = |minimum: &Minimum| !group.is_mostly_air(filters, minimum);
        if least.as_ref().is_some_and(is_plausible) {
            break;
        }
    }
    let why = || failures.into_iter().min_by(NoMinimum::by_cost);
    least.ok_or_else(|| why().unwrap_or(NoMinimum::Diverges))
}
