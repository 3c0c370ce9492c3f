//! Effect of calibration errors on the bounds.

use std::collections::BTreeMap;

use nalgebra::DVector;

use super::prepared_case::PreparedCase;
use super::task::Task;
use crate::aircraft::Aircraft;
use crate::dynamics::motion::ManeuverSignals;
use crate::dynamics::{Equations, OUTPUTS};
use crate::output_error::calibration_errors::{Calibration, FittedManeuver, SignalError};
use crate::output_error::{Diverged, Fit, calibration_errors};

/// Added to the reason of a fit whose bounds lack the effect of calibration errors.
pub(super) const NOT_COUNTED: &str =
    "; errors of calibration are not in its bounds: with them the integration diverges";

/// Adds the effect of calibration errors to the corrected covariance of a fit.
pub(super) fn add_calibration_errors<const NX: usize, E: Equations<NX>>(
    task: &Task,
    prepared: &PreparedCase<NX, E>,
    fit: &mut Fit,
) {
    if fit.covariance_corrected.is_none() || task.has_exact_signals() {
        return;
    }
    let errors = signal_errors(&[task], &prepared.signals);
    match gradient_shifts(
        task.context.aircraft,
        prepared,
        &errors,
        &fit.values,
        &fit.weights,
    ) {
        Ok(shifts) => {
            calibration_errors::add_calibration_errors(&prepared.case, &errors, &shifts, fit);
        }
        Err(Diverged { .. }) => fit.reason.push_str(NOT_COUNTED),
    }
}

/// Errors of one standard deviation each of the signals of a maneuver. Of several maneuvers each error
/// has its largest size.
pub(super) fn signal_errors<'a>(
    tasks: &[&Task<'a>],
    signals: &ManeuverSignals,
) -> Vec<SignalError<'a>> {
    // A signal that the maneuver does not use has no effect.
    let is_used = |signal: &str| !signals.signal(signal).is_empty();
    let mut sizes: BTreeMap<&str, Calibration> = BTreeMap::new();
    for (signal, of_task) in tasks.iter().flat_map(|task| task.error_sizes()) {
        let size = sizes.entry(signal).or_default();
        size.bias = size.bias.max(of_task.bias);
        size.scale_pct = size.scale_pct.max(of_task.scale_pct);
    }
    let used = sizes.into_iter().filter(|(signal, _)| is_used(signal));
    let readings = used.flat_map(|(signal, size)| size.signal_errors(signal));
    let delays = tasks.first().map_or(&[][..], |task| task.context.delays);
    let delays = delays.iter().filter(|d| is_used(&d.surface));
    let late = delays.map(|d| SignalError::delay(&d.surface, d.uncertainty_s));
    readings.chain(late).collect()
}

/// Change of the gradient with one standard deviation of each calibration error, in the order of
/// the maneuver's parameters.
pub(super) fn gradient_shifts<const NX: usize, E: Equations<NX>>(
    aircraft: &Aircraft,
    prepared: &PreparedCase<NX, E>,
    errors: &[SignalError],
    values: &[f64],
    weights: &[f64; OUTPUTS],
) -> Result<Vec<DVector<f64>>, Diverged> {
    let PreparedCase {
        signals,
        model,
        case,
        ..
    } = prepared;
    FittedManeuver {
        aircraft,
        signals,
        model,
        case,
        values,
        weights,
    }
    .gradient_shifts(errors)
}
