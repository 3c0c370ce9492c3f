//! Maneuver of a group that filter error estimates: its filters and passes with slopes over α held.

use nalgebra::DVector;

use super::maneuver_filter::{bias_uncertainties, least_deviations, new_filter, noisy_inputs};
use crate::dynamics::{Equations, InGusts, OUTPUTS};
use crate::estimate::prepared_case::{PreparedCase, all_free};
use crate::estimate::slopes::alpha_slopes::AlphaSlopes;
use crate::estimate::slopes::held_slopes::HeldSlopes;
use crate::estimate::task::{Task, values_by_name};
use crate::filter_error::bounds::WidePass;
use crate::filter_error::filter::Filter;
use crate::filter_error::noise::Noise;
use crate::filter_error::signal_slopes::Recorded;
use crate::output_error::calibration_errors::SignalError;
use crate::output_error::{Case, Diverged, Model, equation_error};

/// Maneuver of a group.
pub(in crate::estimate) struct GroupMember<'g, 'a, const NX: usize, E: Equations<NX>> {
    pub task: Task<'a>,
    pub prepared: &'g PreparedCase<'a, NX, E>,
    /// Slopes over α that act in the maneuver.
    pub slopes: AlphaSlopes,
    /// Standard deviations of the outputs' own noise.
    pub deviations: [f64; OUTPUTS],
}

impl<'g, 'a, const NX: usize, E: Equations<NX>> GroupMember<'g, 'a, NX, E> {
    /// `wide` has the held derivatives free as well.
    pub fn new(task: &Task<'a>, prepared: &'g PreparedCase<'a, NX, E>, wide: &Case<NX, E>) -> Self {
        GroupMember {
            task: *task,
            prepared,
            slopes: AlphaSlopes::new(task, &prepared.signals, wide),
            deviations: least_deviations(task, &prepared.case.measurements),
        }
    }

    /// The maneuver's model with the slopes held.
    pub fn model_with_slopes<'s>(&'s self, held: &HeldSlopes) -> Model<'s> {
        let model: &Model<'s> = &self.prepared.model;
        if held.is_constant() {
            model.clone()
        } else {
            self.slopes.held_in(model, &held.values_of(&self.slopes))
        }
    }

    /// The maneuver with the signals of its slopes.
    fn case_with(&self, model: &Model) -> Case<NX, E> {
        let aircraft = self.task.context.aircraft;
        self.prepared
            .case
            .with_model(aircraft, &self.slopes.signals, model)
    }

    /// Filter of a model on the signals of the slopes; `like` is another filter of the maneuver.
    pub fn filter<const NG: usize, G: InGusts<NG>>(
        &self,
        model: &Model,
        like: Option<&Filter<NG, G>>,
    ) -> Filter<NG, G> {
        match like {
            None => new_filter(&self.task, self.prepared, &self.slopes.signals, model),
            Some(filter) => self.filter_like(filter, model, None),
        }
    }

    /// Filter of a model, from another filter of the maneuver. A known noise is not estimated.
    fn filter_like<const NG: usize, G: InGusts<NG>>(
        &self,
        filter: &Filter<NG, G>,
        model: &Model,
        known_noise: Option<Noise>,
    ) -> Filter<NG, G> {
        let signals = &self.slopes.signals;
        let aircraft = self.task.context.aircraft;
        let biases = bias_uncertainties(&self.task, model);
        let filter = filter.with_model(aircraft, signals, model, &biases, known_noise);
        filter.with_noisy_inputs(noisy_inputs(&self.task, self.prepared, signals, model))
    }

    /// Pass at a fit with the held derivatives and the slopes free as well.
    pub fn wide_pass<const NG: usize, G: InGusts<NG>>(
        &self,
        held: &HeldSlopes,
        filter: &Filter<NG, G>,
        parameters: &[f64],
    ) -> Option<WidePass> {
        let model = self.model_with_slopes(held);
        let all = all_free(&model);
        let all = if held.is_constant() {
            self.slopes.added_to(&all)
        } else {
            all
        };
        let wide = self.filter_like(filter, &all, Some(filter.noise(parameters)));
        let own = &parameters[..filter.first_noise()];
        let values = values_by_name(&model, filter.names(), own);
        let pass = WidePass::pass_at_fit(filter, &wide, &values)?;
        Some(self.slopes.with_lines(pass))
    }

    /// Changes of the gradient by calibration errors.
    pub fn gradient_shifts<const NG: usize, G: InGusts<NG>>(
        &self,
        errors: &[SignalError],
        held: &HeldSlopes,
        filter: &Filter<NG, G>,
        parameters: &[f64],
    ) -> Result<Vec<DVector<f64>>, Diverged> {
        let model = self.model_with_slopes(held);
        let recorded = Recorded {
            aircraft: self.task.context.aircraft,
            signals: &self.slopes.signals,
            model: &model,
        };
        filter.gradient_shifts(parameters, &recorded, errors)
    }

    /// Equation error with the slopes over α that a fit holds; `None` without any.
    pub fn second_opinion_on(&self, held: &HeldSlopes) -> Option<equation_error::Regression> {
        let model = self.model_with_slopes(held);
        let uncertainties = self.task.held_uncertainties(&self.prepared.model);
        let regression = |wide: &Case<NX, E>| {
            equation_error::regression(&self.case_with(&model), wide, &uncertainties)
        };
        (!held.is_constant()).then(|| regression(&self.case_with(&all_free(&model))))
    }
}
