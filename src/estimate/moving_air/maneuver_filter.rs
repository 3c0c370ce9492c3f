//! Filter of one maneuver: its inputs' noise, the prior of its biases, and the sensors' noise.

use super::whiteness::sample_noise;
use crate::aero::Output;
use crate::dynamics::motion::ManeuverSignals;
use crate::dynamics::{Equations, InGusts, OUTPUTS};
use crate::estimate::prepared_case::PreparedCase;
use crate::estimate::task::Task;
use crate::filter_error::filter::Filter;
use crate::output_error::surface_noise::noisy_surfaces;
use crate::output_error::{Measurements, Model, NoisyInputs};

/// Filter of a model on the signals of a maneuver.
pub(in crate::estimate) fn new_filter<
    const NX: usize,
    E: Equations<NX>,
    const NG: usize,
    G: InGusts<NG>,
>(
    task: &Task,
    prepared: &PreparedCase<NX, E>,
    signals: &ManeuverSignals,
    model: &Model,
) -> Filter<NG, G> {
    let measurements = prepared.case.measurements.clone();
    let biases = bias_uncertainties(task, model);
    let filter = Filter::new(task.context.aircraft, signals, measurements, model, &biases);
    filter.with_noisy_inputs(noisy_inputs(task, prepared, signals, model))
}

/// Noise of the inputs of a model in the signals of a maneuver.
pub(in crate::estimate) fn noisy_inputs<const NX: usize, E: Equations<NX>>(
    task: &Task,
    prepared: &PreparedCase<NX, E>,
    signals: &ManeuverSignals,
    model: &Model,
) -> NoisyInputs {
    NoisyInputs {
        surfaces: noisy_surfaces(task.context.aircraft, signals, model),
        pressure_variance: prepared.case.noisy_inputs.pressure_variance,
    }
}

/// Standard uncertainty of each bias of a model; `None` without any prior.
pub(super) fn bias_uncertainties(task: &Task, model: &Model) -> Vec<Option<f64>> {
    let biases = model.biases.iter();
    biases.map(|b| bias_uncertainty(task, b.output)).collect()
}

/// Standard uncertainty of an output's bias in one maneuver: the one stated, or the ordinary size
/// where the flight determines the bias. The flight's own bound is that of a mean over the flight. A
/// gyro drifts, and a slow gust looks like a bias: a prior as narrow as that bound draws the
/// derivatives off.
fn bias_uncertainty(task: &Task, output: Output) -> Option<f64> {
    let settings = task.context.settings;
    let signal = output.signal();
    let stated = settings.calibration.get(signal).map(|c| c.bias);
    let remaining = task.record.remaining_errors.get(signal);
    let is_determined = remaining.is_some_and(|errors| errors.bias.is_some());
    let ordinary = settings.ordinary_bias.get(&output).copied();
    let size = stated
        .filter(|bias| *bias > 0.0)
        .or_else(|| ordinary.filter(|_| is_determined))?;
    Some(size.max(task.error_size(signal).bias))
}

/// Standard deviations of the outputs' own noise: of the second differences of the measured
/// values, and at least the configured resolution.
pub(in crate::estimate) fn least_deviations(
    task: &Task,
    measurements: &Measurements,
) -> [f64; OUTPUTS] {
    let resolution = task.resolution();
    std::array::from_fn(|o| sample_noise(measurements, o).max(resolution[o]))
}
