//! What errors of calibration do to the estimates. The equations take every recorded signal for true but for noise: a bias
//! or a scale error of one moves a maneuver's estimates as a whole, and hardly shows in the residuals.
//!
//! The estimates solve Σ Sᵀ W v = 0. In error by one standard deviation, a signal leaves other residuals v′ at the same
//! parameters, so the estimates move by H⁻¹ Σ Sᵀ W (v′ − v), to first order in the error.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::case::{Case, InitialState, Model};
use super::response::{Diverged, Sensitivities};
use crate::aero::Derivative;
use crate::aircraft::Aircraft;
use crate::dynamics::motion::Window;
use crate::dynamics::{Equations, OUTPUTS};

/// What calibration leaves unknown of a signal, as standard deviations: reading = (1 + scale) · truth + bias.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Calibration {
    /// In the signal's unit.
    pub bias: f64,
    pub scale_pct: f64,
}

/// One error of one signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misreading<'a> {
    pub signal: &'a str,
    pub scale: f64,
    /// In the signal's unit.
    pub bias: f64,
}

impl Calibration {
    /// Its errors, one standard deviation each, of which each is independent of the other.
    pub fn misreadings<'a>(&self, signal: &'a str) -> impl Iterator<Item = Misreading<'a>> {
        let scale = Misreading { signal, scale: self.scale_pct / 100.0, bias: 0.0 };
        let bias = Misreading { signal, scale: 0.0, bias: self.bias };
        [scale, bias].into_iter().filter(|m| m.scale != 0.0 || m.bias != 0.0)
    }
}

/// A maneuver as it was fitted.
#[derive(Debug)]
pub struct Fitted<'a, const NX: usize, E: Equations<NX>> {
    pub aircraft: &'a Aircraft,
    pub window: &'a Window,
    pub model: &'a Model<'a>,
    pub case: &'a Case<NX, E>,
    pub values: &'a [f64],
    pub weights: &'a [f64; OUTPUTS],
}

impl<const NX: usize, E: Equations<NX>> Fitted<'_, NX, E> {
    /// What each error does to the gradient Σ Sᵀ W v, in the order of the case's parameters.
    ///
    /// # Errors
    /// [`Diverged`] when an error makes the integration leave the bounds of sense.
    pub fn gradient_shifts(&self, errors: &[Misreading]) -> Result<Vec<DVector<f64>>, Diverged> {
        let held = self.all_held();
        let right = self.computed(self.window, &held)?;
        let sensitivities = self.case.sensitivities(self.values)?;
        errors.iter().map(|error| self.gradient_shift(error, &held, &right, &sensitivities)).collect()
    }

    fn gradient_shift(
        &self,
        error: &Misreading,
        held: &[(&Derivative, f64)],
        right: &[[f64; OUTPUTS]],
        sensitivities: &Sensitivities,
    ) -> Result<DVector<f64>, Diverged> {
        let misread = self.window.misread(error.signal, error.scale, error.bias);
        let computed = self.computed(&misread, held)?;
        let read = E::AXIS.outputs().map(|o| o.signal() == error.signal);
        let measurements = &self.case.measurements;
        let mut shift = DVector::zeros(self.case.parameters());
        for (k, (now, before)) in computed.iter().zip(right).enumerate() {
            for o in (0..OUTPUTS).filter(|&o| measurements.used[k][o]) {
                let measured = if read[o] { error.scale * measurements.values[k][o] + error.bias } else { 0.0 };
                let factor = self.weights[o] * (measured - (now[o] - before[o]));
                for (j, g) in shift.iter_mut().enumerate() {
                    *g += factor * sensitivities.at(k, o, j);
                }
            }
        }
        Ok(shift)
    }

    /// Every derivative at the value of the fit.
    fn all_held(&self) -> Vec<(&Derivative, f64)> {
        let value = |d: &&Derivative| self.case.names.iter().position(|n| *n == d.name).map(|j| self.values[j]);
        let free = self.model.free.iter().filter_map(|d| Some((*d, value(d)?)));
        free.chain(self.model.held.iter().copied()).collect()
    }

    /// The outputs of a window at the values of the fit, without the biases.
    fn computed(&self, window: &Window, held: &[(&Derivative, f64)]) -> Result<Vec<[f64; OUTPUTS]>, Diverged> {
        let model = Model { held: held.to_vec(), initial_state: InitialState::Measured, ..Model::default() };
        let mut case = Case::<NX, E>::new(self.aircraft, window, self.case.measurements.clone(), &model);
        if self.case.initial_state == InitialState::Estimated {
            let first = self.values.len() - NX;
            case.start.copy_from_slice(&self.values[first..]);
        }
        let mut response = case.response();
        case.respond(&[], &mut response)?;
        Ok(response.outputs)
    }
}
