//! Filter of one maneuver: its inputs' noise, the prior of its biases, and the sensors' noise.

use super::prepared_case::PreparedCase;
use super::settings::Settings;
use super::task::Task;
use super::whiteness::sample_noise;
use crate::aero::Output;
use crate::dynamics::motion::ManeuverSignals;
use crate::dynamics::{Equations, InGusts, OUTPUTS};
use crate::filter_error::filter::Filter;
use crate::output_error::surface_noise::noisy_surfaces;
use crate::output_error::{Measurements, Model, NoisyInputs};

/// Filter of a model in a window of the maneuver.
pub(super) fn new_filter<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
    task: &Task,
    prepared: &PreparedCase<NX, E>,
    window: &ManeuverSignals,
    model: &Model,
) -> Filter<NG, G> {
    let measurements = prepared.case.measurements.clone();
    let biases = bias_uncertainties(task.context.settings, model);
    let filter = Filter::new(task.context.aircraft, window, measurements, model, &biases);
    filter.with_noisy_inputs(noisy_inputs(task, prepared, window, model))
}

/// Noise of the inputs of a model in a window of the maneuver.
pub(super) fn noisy_inputs<const NX: usize, E: Equations<NX>>(
    task: &Task,
    prepared: &PreparedCase<NX, E>,
    window: &ManeuverSignals,
    model: &Model,
) -> NoisyInputs {
    NoisyInputs {
        surfaces: noisy_surfaces(task.context.aircraft, window, model),
        pressure_variance: prepared.case.noisy_inputs.pressure_variance,
    }
}

/// Standard uncertainty of each bias, if calibration gives one.
pub(super) fn bias_uncertainties(settings: &Settings, model: &Model) -> Vec<Option<f64>> {
    let uncertainty = |output: Output| {
        let calibration = settings.calibration.get(output.signal())?;
        (calibration.bias > 0.0).then_some(calibration.bias)
    };
    model.biases.iter().map(|b| uncertainty(b.output)).collect()
}

/// Standard deviations of the outputs' own noise: of the second differences of the measured
/// values, and at least the configured resolution.
pub(super) fn least_deviations(task: &Task, measurements: &Measurements) -> [f64; OUTPUTS] {
    let resolution = task.resolution();
    std::array::from_fn(|o| sample_noise(measurements, o).max(resolution[o]))
}
