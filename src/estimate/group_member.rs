//! Maneuver of a group that filter error estimates: its filters and passes with slopes over α held.

use nalgebra::DVector;

use super::alpha_slopes::AlphaSlopes;
use super::held_slopes::HeldSlopes;
use super::prepared_case::{PreparedCase, all_free};
use super::task::{Task, values_by_name};
use super::whiteness::sample_noise;
use crate::aero::Output;
use crate::dynamics::motion::Window;
use crate::dynamics::{Equations, InGusts, OUTPUTS};
use crate::filter_error::bounds::WidePass;
use crate::filter_error::filter::Filter;
use crate::output_error::calibration_errors::Misreading;
use crate::output_error::surface_noise::noisy_surfaces;
use crate::output_error::{Case, Diverged, Measurements, Model, NoisyInputs, equation_error};

/// Maneuver of a group.
pub(super) struct GroupMember<'g, 'a, const NX: usize, E: Equations<NX>> {
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
            slopes: task.alpha_slopes(&prepared.window, wide),
            deviations: task.least_deviations(&prepared.case.measurements),
        }
    }

    /// The maneuver's model with the slopes held.
    pub fn held<'s>(&'s self, held: &HeldSlopes) -> Model<'s> {
        let model: &Model<'s> = &self.prepared.model;
        if held.is_constant() {
            model.clone()
        } else {
            self.slopes.held_in(model, &held.values_of(&self.slopes))
        }
    }

    /// The maneuver in the window of its slopes.
    pub fn case_with(&self, model: &Model) -> Case<NX, E> {
        let aircraft = self.task.context.aircraft;
        self.prepared
            .case
            .with_model(aircraft, &self.slopes.window, model)
    }

    /// Filter of a model in the window of the slopes; `like` is another one of the maneuver.
    pub fn filter<const NG: usize, G: InGusts<NG>>(
        &self,
        model: &Model,
        like: Option<&Filter<NG, G>>,
    ) -> Filter<NG, G> {
        let window = &self.slopes.window;
        let Some(filter) = like else {
            return self.task.filter(self.prepared, window, model);
        };
        let aircraft = self.task.context.aircraft;
        let biases = self.task.bias_uncertainties(model);
        let filter = filter.with_model(aircraft, window, model, &biases);
        filter.with_noisy_inputs(self.task.noisy_inputs(self.prepared, window, model))
    }

    /// Pass at a fit with the held derivatives and the slopes free as well.
    pub fn wide_pass<const NG: usize, G: InGusts<NG>>(
        &self,
        held: &HeldSlopes,
        filter: &Filter<NG, G>,
        parameters: &[f64],
    ) -> Option<WidePass> {
        let model = self.held(held);
        let all = all_free(&model);
        let all = if held.is_constant() {
            self.slopes.added_to(&all)
        } else {
            all
        };
        let wide = self.filter(&all, Some(filter));
        let own = &parameters[..filter.first_noise()];
        let values = values_by_name(&model, filter.names(), own);
        WidePass::pass_at_fit(filter, parameters, &wide, &values)
    }

    /// Changes of the gradient by calibration errors.
    pub fn gradient_shifts<const NG: usize, G: InGusts<NG>>(
        &self,
        errors: &[Misreading],
        held: &HeldSlopes,
        filter: &Filter<NG, G>,
        parameters: &[f64],
    ) -> Result<Vec<DVector<f64>>, Diverged> {
        let model = self.held(held);
        let window = &self.slopes.window;
        let cases = errors.iter().map(|error| {
            let misread_window = error.of_window(window);
            let measured = misread(&self.prepared.case, error);
            let windows = [window, &misread_window];
            filter.as_recorded(self.task.context.aircraft, windows, measured, &model)
        });
        filter.gradient_shifts(parameters, cases)
    }

    /// Starting values by equation error with the slopes held.
    pub fn implied(&self, held: &HeldSlopes) -> Vec<f64> {
        let case = self.case_with(&self.held(held));
        equation_error::start(&case, &self.task.tunnel_start(&self.prepared.case))
    }

    /// Equation error with the slopes over α that a fit holds; `None` without any.
    pub fn second_opinion_on(&self, held: &HeldSlopes) -> Option<equation_error::Regression> {
        let model = self.held(held);
        let uncertainties = self.task.held_uncertainties(&self.prepared.model);
        let regression = |wide: &Case<NX, E>| {
            equation_error::regression(&self.case_with(&model), wide, &uncertainties)
        };
        (!held.is_constant()).then(|| regression(&self.case_with(&all_free(&model))))
    }
}

impl Task<'_> {
    /// Filter of a model in a window of the maneuver.
    pub(super) fn filter<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
        &self,
        prepared: &PreparedCase<NX, E>,
        window: &Window,
        model: &Model,
    ) -> Filter<NG, G> {
        let measurements = prepared.case.measurements.clone();
        let biases = self.bias_uncertainties(model);
        let filter = Filter::new(self.context.aircraft, window, measurements, model, &biases);
        filter.with_noisy_inputs(self.noisy_inputs(prepared, window, model))
    }

    /// Noise of the inputs of a model in a window of the maneuver.
    fn noisy_inputs<const NX: usize, E: Equations<NX>>(
        &self,
        prepared: &PreparedCase<NX, E>,
        window: &Window,
        model: &Model,
    ) -> NoisyInputs {
        NoisyInputs {
            surfaces: noisy_surfaces(self.context.aircraft, window, model),
            pressure_variance: prepared.case.noisy_inputs.pressure_variance,
        }
    }

    /// Standard uncertainty of each bias, if calibration gives one.
    fn bias_uncertainties(&self, model: &Model) -> Vec<Option<f64>> {
        let uncertainty = |output: Output| {
            let known = self.context.settings.calibration.get(output.signal())?;
            (known.bias > 0.0).then_some(known.bias)
        };
        model.biases.iter().map(|b| uncertainty(b.output)).collect()
    }

    /// Standard deviations of the outputs' own noise: of the second differences of the measured
    /// values, and at least the configured resolution.
    pub(super) fn least_deviations(&self, measurements: &Measurements) -> [f64; OUTPUTS] {
        let resolution = self.resolution();
        std::array::from_fn(|o| sample_noise(measurements, o).max(resolution[o]))
    }
}

/// Measurements as an instrument in error would have recorded them.
fn misread<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    error: &Misreading,
) -> Measurements {
    let mut measured = case.measurements.clone();
    let outputs = E::AXIS.outputs();
    if let Some(o) = outputs.iter().position(|o| o.signal() == error.signal) {
        for values in &mut measured.values {
            values[o] += error.scale * values[o] + error.bias;
        }
    }
    measured
}
