//! Errors of calibration in the bounds of a maneuver, and of maneuvers estimated together.

use nalgebra::DVector;

use super::{Ready, Run};
use crate::dynamics::{Equations, OUTPUTS};
use crate::output_error::calibration_errors::{Fitted, Misreading};
use crate::output_error::{Diverged, Fit, calibration_errors};

/// What a fit is told when it cannot be said what errors of calibration do to it.
pub(super) const NOT_COUNTED: &str =
    "; errors of calibration are not in its bounds: with them the integration diverges";

impl<'a> Run<'a> {
    /// Adds what errors of calibration do to the estimates to the corrected covariance of a fit.
    pub(super) fn miscalibrate<const NX: usize, E: Equations<NX>>(
        &self,
        ready: &Ready<'a, NX, E>,
        fit: &mut Fit,
    ) {
        if fit.covariance_corrected.is_none() || self.basis.settings.calibration.is_empty() {
            return;
        }
        match self.gradient_shifts(ready, &fit.values, &fit.weights) {
            Ok(shifts) => calibration_errors::miscalibrated(&ready.case, &shifts, fit),
            Err(Diverged { .. }) => fit.reason.push_str(NOT_COUNTED),
        }
    }

    /// What one standard deviation of each error of calibration does to the gradient, in the order
    /// of the maneuver's parameters.
    pub(super) fn gradient_shifts<const NX: usize, E: Equations<NX>>(
        &self,
        ready: &Ready<'a, NX, E>,
        values: &[f64],
        weights: &[f64; OUTPUTS],
    ) -> Result<Vec<DVector<f64>>, Diverged> {
        let calibration = self.basis.settings.calibration.iter();
        // A signal that the maneuver does not use cannot spoil it.
        let used = calibration.filter(|(signal, _)| !ready.window.signal(signal).is_empty());
        let errors: Vec<Misreading> = used.flat_map(|(signal, c)| c.misreadings(signal)).collect();
        let aircraft = self.basis.aircraft;
        let Ready {
            window,
            model,
            case,
            ..
        } = ready;
        Fitted {
            aircraft,
            window,
            model,
            case,
            values,
            weights,
        }
        .gradient_shifts(&errors)
    }
}
