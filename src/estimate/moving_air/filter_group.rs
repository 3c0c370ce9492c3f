//! Maneuvers that filter error estimates together, or one alone. A group has the fit, the
//! derivatives' slopes over α, and the parts of the bounds from held values and calibration.

use std::marker::PhantomData;

use nalgebra::{DMatrix, DVector};

use super::filter_minimum::{Minimum, NoMinimum};
use super::group_member::GroupMember;
use crate::dynamics::{Equations, InGusts, OUTPUTS};
use crate::estimate::calibration_effect::{NOT_COUNTED, signal_errors};
use crate::estimate::slopes::held_slopes::HeldSlopes;
use crate::estimate::task::Task;
use crate::filter_error::bounds::{self, WidePass};
use crate::filter_error::filter::Filter;
use crate::filter_error::joint_filter::JointFilter;
use crate::filter_error::noise::Noise;
use crate::filter_error::scoring::{Scored, minimise};
use crate::filter_error::slopes::SlopeEffect;
use crate::output_error::error_effect::{ErrorEffect, SharedError, covariance_of};
use crate::output_error::sharing::{SharedParameters, add_vector};
use crate::output_error::{Fit, Outcome, Response};

/// Change of the estimates by slopes over α, in bounds, up to which the fit is not repeated with
/// the slopes held.
const SMALL_CHANGE: f64 = 0.3;

/// Largest number of steps towards the slopes over α. Their effect on the estimates is nearly
/// linear, so few are needed.
const SLOPE_STEPS: usize = 3;

/// Fractions of a step to the slopes, tried in this order.
const STEP_SHARES: [f64; 3] = [1.0, 0.5, 0.25];

/// Largest rise of the cost by a step to the slopes; the slopes' prior may outweigh it.
const ALLOWED_RISE: f64 = 1.0;

/// Ratio of a rotary gust to the standard deviation of its rate, above which the gust may have
/// taken the place of the rate.
const MOSTLY: f64 = 0.5;

/// Least output noise as a share of the noise seen in the samples.
const LEAST_SHARE: f64 = 0.5;

/// Maneuvers that filter error estimates together.
pub(in crate::estimate) struct Group<
    'g,
    'a,
    const NX: usize,
    E: Equations<NX>,
    const NG: usize,
    G: InGusts<NG>,
> {
    /// The maneuver, or the group as a whole.
    pub task: Task<'a>,
    pub members: Vec<GroupMember<'g, 'a, NX, E>>,
    pub parameters: SharedParameters,
    equations: PhantomData<G>,
}

impl<'g, 'a, const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>
    Group<'g, 'a, NX, E, NG, G>
{
    pub fn new(
        task: &Task<'a>,
        members: Vec<GroupMember<'g, 'a, NX, E>>,
        parameters: SharedParameters,
    ) -> Self {
        Group {
            task: *task,
            members,
            parameters,
            equations: PhantomData,
        }
    }

    /// A maneuver by itself.
    pub fn single(task: &Task<'a>, member: GroupMember<'g, 'a, NX, E>) -> Self {
        let parameters = SharedParameters::of_one(&member.prepared.case.names);
        Group::new(task, vec![member], parameters)
    }

    /// Derivatives that do not change over α.
    pub fn constant(&self) -> HeldSlopes {
        HeldSlopes::constant(self.members.iter().map(|member| &member.slopes))
    }

    /// Filters with the slopes held; `like` are earlier filters of the same maneuvers, from which
    /// each begins.
    pub fn filters(&self, held: &HeldSlopes, like: Option<&[Filter<NG, G>]>) -> Vec<Filter<NG, G>> {
        let members = self.members.iter().enumerate();
        let filter = |(i, member): (usize, &GroupMember<'g, 'a, NX, E>)| {
            member.filter(
                &member.model_with_slopes(held),
                like.and_then(|like| like.get(i)),
            )
        };
        members.map(filter).collect()
    }

    /// Minimum of the cost from a start.
    ///
    /// # Errors
    /// Why the start leads to no minimum with a covariance.
    pub fn minimum(
        &self,
        filters: &[Filter<NG, G>],
        start: &FilterStart,
    ) -> Result<Minimum, NoMinimum> {
        let settings = self.task.context.settings;
        let joint = JointFilter::new(filters, &self.parameters);
        let least = |member: &GroupMember<NX, E>| member.deviations.map(|d| LEAST_SHARE * d);
        let resolutions: Vec<_> = self.members.iter().map(least).collect();
        let floors = joint.floors(&resolutions);
        let from = joint.with_noise(&start.own, &start.noise);
        let scored =
            minimise(&joint, from, &floors, &settings.filter).ok_or(NoMinimum::Diverges)?;
        if !scored.converged {
            return Err(NoMinimum::NotConverged(Box::new(scored)));
        }
        let limit = settings.iteration.max_condition_number;
        match bounds::bounds(&joint, &scored, limit) {
            Ok(bounds) => Ok(Minimum { scored, bounds }),
            Err(_) => Err(NoMinimum::Undetermined(Box::new(scored))),
        }
    }

    /// A fit with the effect that the slopes still have on it.
    pub fn slope_fit(
        &self,
        held: HeldSlopes,
        filters: Vec<Filter<NG, G>>,
        found: Minimum,
    ) -> Option<SlopeFit<NG, G>> {
        let pass = self.wide_pass(&held, &filters, &found)?;
        let effect = held.effect(&pass, &found.bounds);
        Some(SlopeFit {
            held,
            filters,
            found,
            pass,
            effect,
        })
    }

    /// Pass at a fit with the held derivatives and the slopes free as well.
    fn wide_pass(
        &self,
        held: &HeldSlopes,
        filters: &[Filter<NG, G>],
        found: &Minimum,
    ) -> Option<WidePass> {
        let joint = JointFilter::new(filters, &self.parameters);
        let mut passes = Vec::with_capacity(self.members.len());
        for (i, (member, filter)) in self.members.iter().zip(filters).enumerate() {
            let parameters = joint.parameters_of(i, &found.scored.parameters);
            passes.push(member.wide_pass(held, filter, &parameters)?);
        }
        Some(WidePass::joined(&passes, &self.parameters))
    }

    /// Repeats the fit with the slopes held, while they move the estimates. A step that raises the
    /// cost is halved. If no step succeeds, the effect of the slopes counts as an uncertainty only.
    pub fn with_slopes(&self, start: SlopeFit<NG, G>) -> SlopeFit<NG, G> {
        let mut slope_fit = start;
        for _ in 0..SLOPE_STEPS {
            let Some(effect) = slope_fit.moving_effect() else {
                return slope_fit;
            };
            let next = STEP_SHARES
                .iter()
                .find_map(|share| self.step_to_slopes(&slope_fit, effect, *share));
            match next {
                Some(next) => slope_fit = next,
                None => break,
            }
        }
        if let Some(effect) = &mut slope_fit.effect
            && slope_fit
                .found
                .bounds
                .are_exceeded_by(&effect.change, SMALL_CHANGE)
        {
            effect.replace_change_by_variance();
        }
        slope_fit
    }

    /// Fit with the slopes a fraction of the way to those found, from the fit before; `None` if its
    /// cost rises.
    ///
    /// No other start is tried. In 59 refits in turbulence a start by equation error ended at costs
    /// that differed by less than 0.03, or at higher ones.
    fn step_to_slopes(
        &self,
        slope_fit: &SlopeFit<NG, G>,
        effect: &SlopeEffect,
        share: f64,
    ) -> Option<SlopeFit<NG, G>> {
        let held = slope_fit.held.towards(&effect.slopes, share);
        let start = FilterStart {
            own: self.moved_parameters(slope_fit, &effect.change, share),
            noise: self.noise(slope_fit),
        };
        let filters = self.filters(&held, Some(&slope_fit.filters));
        let most = slope_fit.found.cost() + ALLOWED_RISE;
        let found = self.minimum(&filters, &start).ok();
        self.slope_fit(held, filters, found.filter(|found| found.cost() < most)?)
    }

    /// `true` if in a maneuver a rotary gust exceeds the share [`MOSTLY`] of the rate to which it adds.
    pub fn is_mostly_air(&self, filters: &[Filter<NG, G>], minimum: &Minimum) -> bool {
        let joint = JointFilter::new(filters, &self.parameters);
        let noises = joint.noise(&minimum.scored.parameters);
        let mut flown = self.members.iter().zip(noises);
        flown.any(|(member, noise)| {
            let states = &member.prepared.case.motion.states;
            let mut rates = G::AIR_RELATIVE_RATES.iter().zip(noise.gusts);
            rates.any(|((rate, _), gust)| {
                let values = states.iter().map(|x| x[*rate]);
                let values = DVector::from_iterator(states.len(), values);
                gust > MOSTLY * values.variance().sqrt()
            })
        })
    }

    /// Derivatives, biases and initial states of a fit, moved by a share of a change.
    fn moved_parameters(
        &self,
        slope_fit: &SlopeFit<NG, G>,
        change: &DVector<f64>,
        share: f64,
    ) -> Vec<f64> {
        let both = self.own_parameters(slope_fit).iter().zip(change.iter());
        both.map(|(own, change)| own + share * change).collect()
    }

    /// Derivatives, biases and initial states of a fit.
    fn own_parameters<'s>(&self, slope_fit: &'s SlopeFit<NG, G>) -> &'s [f64] {
        &slope_fit.parameters()[..self.parameters.names().len()]
    }

    /// Filters of the maneuvers on their shared parameters.
    pub fn joint<'s>(&'s self, slope_fit: &'s SlopeFit<NG, G>) -> JointFilter<'s, NG, G> {
        JointFilter::new(&slope_fit.filters, &self.parameters)
    }

    /// Noise of each maneuver.
    pub fn noise(&self, slope_fit: &SlopeFit<NG, G>) -> Vec<Noise> {
        self.joint(slope_fit).noise(slope_fit.parameters())
    }

    /// Information of derivatives, biases and initial states.
    pub fn information(&self, slope_fit: &SlopeFit<NG, G>) -> DMatrix<f64> {
        let n = self.parameters.names().len();
        let all = self
            .joint(slope_fit)
            .information(&slope_fit.found.scored.response);
        all.view((0, 0), (n, n)).into_owned()
    }

    /// Outputs of a maneuver along the air's angle; `None` if they diverge.
    pub fn outputs_along_air(
        &self,
        member: usize,
        slope_fit: &SlopeFit<NG, G>,
    ) -> Option<Vec<[f64; OUTPUTS]>> {
        let parameters = self
            .joint(slope_fit)
            .parameters_of(member, slope_fit.parameters());
        slope_fit.filters[member]
            .outputs_along_air(&parameters)
            .ok()
    }

    /// Fit in the form of output error: the noise's parameters are left out, and the outputs are the
    /// predicted ones. The weights are those of the first maneuver.
    pub fn fit(&self, slope_fit: &SlopeFit<NG, G>) -> Fit<Vec<Response>> {
        let Minimum { scored, bounds } = &slope_fit.found;
        let noise = self.noise(slope_fit);
        let responses = scored.response.members.iter();
        let mut fit = Fit {
            outcome: Outcome::Converged,
            reason: scored.reason.clone(),
            iterations: scored.iterations,
            initial_cost: Some(scored.initial_cost),
            final_cost: Some(scored.response.cost),
            values: self.own_parameters(slope_fit).to_vec(),
            weights: noise[0].outputs.map(|deviation| deviation.powi(-2)),
            response: responses
                .map(|r| Response::of_outputs(r.predicted.clone()))
                .collect(),
            condition_number: Some(bounds.condition_number),
            undetermined: vec![],
            covariance: Some(bounds.covariance.clone()),
            covariance_held: None,
            covariance_calibration: None,
            covariance_corrected: Some(bounds.corrected(&self.joint(slope_fit), scored)),
            shared_errors: vec![],
        };
        self.add_held_and_slopes(slope_fit, &mut fit);
        self.add_calibration(slope_fit, &mut fit);
        fit
    }

    /// Moves the estimates by what the slopes still change in them. Adds the effects of the
    /// tunnel's errors and of the derivatives' change over α to the covariances. Both are common to
    /// all maneuvers.
    fn add_held_and_slopes(&self, slope_fit: &SlopeFit<NG, G>, fit: &mut Fit<Vec<Response>>) {
        let Some(first) = self.members.first() else {
            return;
        };
        let uncertainties = self.task.held_uncertainties(&first.prepared.model);
        let bounds = &slope_fit.found.bounds;
        let changes = bounds.changes(&slope_fit.pass.held_shifts(&uncertainties));
        let mut held = covariance_of(&changes, fit.values.len());
        let effects = uncertainties
            .iter()
            .zip(&changes)
            .map(|((name, deviation), change)| {
                ErrorEffect::new(SharedError::Held((*name).to_owned()), *deviation, change)
            });
        fit.shared_errors.extend(effects);
        if let Some(effect) = &slope_fit.effect {
            for (value, change) in fit.values.iter_mut().zip(effect.change.iter()) {
                *value += change;
            }
            held += &effect.covariance;
        }
        add_covariance(&mut fit.covariance, &held);
        add_covariance(&mut fit.covariance_corrected, &held);
        fit.covariance_held = Some(held);
    }

    /// Adds the effect of calibration errors. The estimates move by H⁻¹ times the gradient of the
    /// maneuvers as an instrument in error would have recorded them. The instrument's error is
    /// taken as common to all.
    fn add_calibration(&self, slope_fit: &SlopeFit<NG, G>, fit: &mut Fit<Vec<Response>>) {
        let Some(first) = self.members.first() else {
            return;
        };
        let tasks: Vec<&Task> = self.members.iter().map(|member| &member.task).collect();
        if tasks.iter().all(|task| task.has_exact_signals()) {
            return;
        }
        let errors = signal_errors(&tasks, &first.slopes.signals);
        let mut together = vec![DVector::zeros(fit.values.len()); errors.len()];
        for (i, (member, filter)) in self.members.iter().zip(&slope_fit.filters).enumerate() {
            let parameters = self
                .joint(slope_fit)
                .parameters_of(i, slope_fit.parameters());
            let shifts = member.gradient_shifts(&errors, &slope_fit.held, filter, &parameters);
            let Ok(shifts) = shifts else {
                fit.reason.push_str(NOT_COUNTED);
                return;
            };
            for (sum, shift) in together.iter_mut().zip(&shifts) {
                add_vector(self.parameters.places(i), shift, sum);
            }
        }
        let changes = slope_fit.found.bounds.changes(&together);
        let common = covariance_of(&changes, fit.values.len());
        let effects = errors.iter().zip(&changes);
        fit.shared_errors
            .extend(effects.map(|(error, change)| error.effect(change)));
        add_covariance(&mut fit.covariance_corrected, &common);
        fit.covariance_calibration = Some(common);
    }
}

/// Adds to a covariance, if there is one.
fn add_covariance(sum: &mut Option<DMatrix<f64>>, part: &DMatrix<f64>) {
    if let Some(sum) = sum {
        *sum += part;
    }
}

/// Fit with the derivatives' slopes held, and the effect that the difference from the estimated
/// slopes would have.
pub(in crate::estimate) struct SlopeFit<const NG: usize, G: InGusts<NG>> {
    pub held: HeldSlopes,
    filters: Vec<Filter<NG, G>>,
    found: Minimum,
    pass: WidePass,
    effect: Option<SlopeEffect>,
}

impl<const NG: usize, G: InGusts<NG>> SlopeFit<NG, G> {
    /// Effect of the slopes, if it moves the estimates by more than a small part of their bounds.
    fn moving_effect(&self) -> Option<&SlopeEffect> {
        let bounds = &self.found.bounds;
        let moves = |e: &&SlopeEffect| bounds.are_exceeded_by(&e.change, SMALL_CHANGE);
        self.effect.as_ref().filter(moves)
    }

    /// End of the iteration.
    pub fn end(&self) -> &Scored {
        &self.found.scored
    }

    /// Derivatives, biases and initial states, then the noise's parameters.
    fn parameters(&self) -> &[f64] {
        &self.end().parameters
    }

    /// −log of the likelihood.
    pub fn cost(&self) -> f64 {
        self.found.cost()
    }

    /// −log of the likelihood of each maneuver.
    pub fn costs(&self) -> Vec<f64> {
        let members = self.found.scored.response.members.iter();
        members.map(|response| response.cost).collect()
    }
}

/// Start of a filter's iteration.
pub(in crate::estimate) struct FilterStart {
    /// Derivatives, biases and initial states.
    pub own: Vec<f64>,
    /// Noise of each maneuver.
    pub noise: Vec<Noise>,
}
