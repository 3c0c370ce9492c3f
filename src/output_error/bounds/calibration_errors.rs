//! Effect of calibration errors on the estimates. The equations take recorded signals as exact but
//! for noise. A bias or scale error moves a maneuver's estimates as a whole and hardly shows in the
//! residuals.
//!
//! Let S be the sensitivities, W the weights, v the residuals and H = Σ Sᵀ W S the information
//! matrix. The estimates solve Σ Sᵀ W v = 0. An error of one standard deviation changes the
//! residuals from v to v′ at unchanged parameters. To first order the estimates change by H⁻¹ Σ Sᵀ
//! W (v′ − v). A surface's scale error or bias is equivalent to its derivatives in error, so v′ − v
//! follows from sensitivities. For other errors it is integrated.

use nalgebra::{DMatrix, DVector};

use crate::aero::{Coefficient, Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::{ManeuverSignals, slope_name};
use crate::dynamics::{Equations, OUTPUTS};
use crate::numerics::linear_algebra::symmetric::inverse;
use crate::output_error::case::{Case, InitialState, Model};
use crate::output_error::kernel::pass::Diverged;
use crate::output_error::kernel::response::Sensitivities;
use crate::output_error::likelihood::cost;
use crate::output_error::likelihood::definition::Likelihood;
use crate::output_error::likelihood::error_effect::{ErrorEffect, SharedError, covariance_of};
use crate::output_error::likelihood::outcome::Fit;
use crate::settings::settings;

settings! {
    /// Uncertainty of a signal after calibration, standard deviations: reading = (1 + scale) ·
    /// truth + bias. Errors that the flight itself determines count with its own bounds instead.
    #[derive(Copy)]
    pub struct Calibration {
        /// Uncertainty of the bias, in the signal's unit. Larger: wider `bound_corrected`.
        pub bias: f64 = 0.0,
        /// Uncertainty of the scale, percent. Larger: wider `bound_corrected`.
        pub scale_pct: f64 = 0.0,
    }
}

/// One error of one signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignalError<'a> {
    pub signal: &'a str,
    pub scale: f64,
    /// Bias, in the signal's unit.
    pub bias: f64,
    /// Delay of a surface, s; zero for other signals.
    pub delay_s: f64,
}

impl<'a> SignalError<'a> {
    /// Delay of a surface.
    #[must_use]
    pub fn delay(signal: &'a str, delay_s: f64) -> SignalError<'a> {
        SignalError {
            signal,
            scale: 0.0,
            bias: 0.0,
            delay_s,
        }
    }

    /// Effect of the error, given the change of the parameters.
    #[must_use]
    pub fn effect(&self, change: &DVector<f64>) -> ErrorEffect {
        let signal = self.signal.to_owned();
        let (error, deviation) = if self.delay_s != 0.0 {
            (SharedError::Delay(signal), self.delay_s)
        } else if self.scale != 0.0 {
            (SharedError::Scale(signal), self.scale)
        } else {
            (SharedError::Bias(signal), self.bias)
        };
        ErrorEffect::new(error, deviation, change)
    }

    /// Signals as an instrument with the error would have recorded it.
    #[must_use]
    pub fn apply_to(&self, signals: &ManeuverSignals) -> ManeuverSignals {
        let in_error = signals.with_error(self.signal, self.scale, self.bias);
        if self.delay_s == 0.0 {
            return in_error;
        }
        in_error.delayed(self.signal, self.delay_s)
    }

    /// Changes of the recorded signals at the samples by the error. A scale error of a rate also
    /// changes its slope.
    #[must_use]
    pub fn changes_at_samples(&self, signals: &ManeuverSignals) -> Vec<SignalChange> {
        if self.delay_s != 0.0 {
            return vec![SignalChange {
                signal: self.signal.to_owned(),
                samples: signals.changes_by_delay(self.signal, self.delay_s),
            }];
        }
        let of_slope = slope_name(self.signal);
        [(self.signal, self.bias), (&of_slope, 0.0)]
            .map(|(signal, bias)| {
                let samples = signals.samples_of(signal).into_iter();
                SignalChange {
                    signal: signal.to_owned(),
                    samples: samples.map(|value| self.scale * value + bias).collect(),
                }
            })
            .into()
    }
}

/// Change of a signal at the samples by an error.
#[derive(Clone, Debug)]
pub struct SignalChange {
    pub signal: String,
    pub samples: Vec<f64>,
}

impl SignalChange {
    /// Largest magnitude of the change.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.samples.iter().fold(0.0, |most, s| s.abs().max(most))
    }
}

impl Calibration {
    /// Independent errors of one standard deviation each.
    pub fn signal_errors<'a>(
        &self,
        signal: &'a str,
    ) -> impl Iterator<Item = SignalError<'a>> + use<'a> {
        let scale = SignalError {
            signal,
            scale: self.scale_pct / 100.0,
            bias: 0.0,
            delay_s: 0.0,
        };
        let bias = SignalError {
            signal,
            scale: 0.0,
            bias: self.bias,
            delay_s: 0.0,
        };
        [scale, bias]
            .into_iter()
            .filter(|m| m.scale != 0.0 || m.bias != 0.0)
    }
}

/// Maneuver with its fit.
#[derive(Debug)]
pub struct FittedManeuver<'a, const NX: usize, E: Equations<NX>> {
    pub aircraft: &'a Aircraft,
    pub signals: &'a ManeuverSignals,
    pub model: &'a Model<'a>,
    pub case: &'a Case<NX, E>,
    pub values: &'a [f64],
    pub weights: &'a [f64; OUTPUTS],
}

impl<const NX: usize, E: Equations<NX>> FittedManeuver<'_, NX, E> {
    /// Changes of the gradient Σ Sᵀ W v by each error, in the order of the case's parameters.
    ///
    /// # Errors
    /// [`Diverged`] when the integration with an error leaves its bounds.
    pub fn gradient_shifts(&self, errors: &[SignalError]) -> Result<Vec<DVector<f64>>, Diverged> {
        let held = self.all_held();
        let exact = self.computed(self.signals, &held)?;
        let sensitivities = self.case.sensitivities(self.values)?;
        let mut surfaces = None;
        let mut shifts = Vec::with_capacity(errors.len());
        for error in errors {
            let is_surface = |(d, _): &(&Derivative, f64)| is_along(d, error.signal);
            // A delayed surface is no combination of its derivatives and a constant.
            shifts.push(if error.delay_s == 0.0 && held.iter().any(is_surface) {
                if surfaces.is_none() {
                    surfaces = Some(SurfaceErrors::new(self, &held)?);
                }
                let shift = surfaces.as_ref().map(|s| s.gradient_shift(error));
                shift.unwrap_or_else(|| DVector::zeros(self.values.len()))
            } else {
                self.gradient_shift(error, &held, &exact, &sensitivities)?
            });
        }
        Ok(shifts)
    }

    fn gradient_shift(
        &self,
        error: &SignalError,
        held: &[(&Derivative, f64)],
        exact: &[[f64; OUTPUTS]],
        sensitivities: &Sensitivities,
    ) -> Result<DVector<f64>, Diverged> {
        let in_error = error.apply_to(self.signals);
        let computed = self.computed(&in_error, held)?;
        let misread_outputs = E::AXIS.outputs().map(|o| o.signal() == error.signal);
        let measurements = &self.case.measurements;
        let mut lanes = vec![0.0; sensitivities.width];
        for (k, (in_error, exact)) in computed.iter().zip(exact).enumerate() {
            for o in (0..OUTPUTS).filter(|&o| measurements.used[k][o]) {
                let measured = if misread_outputs[o] {
                    error.scale * measurements.values[k][o] + error.bias
                } else {
                    0.0
                };
                let factor = self.weights[o] * (measured - (in_error[o] - exact[o]));
                for (sum, s) in lanes.iter_mut().zip(sensitivities.row(k, o)) {
                    *sum += factor * s;
                }
            }
        }
        Ok(DVector::from_iterator(
            sensitivities.lanes.len(),
            sensitivities.lanes.iter().map(|lane| lanes[*lane]),
        ))
    }

    /// Every derivative, held at its value in the fit.
    fn all_held(&self) -> Vec<(&Derivative, f64)> {
        let free = self.model.free.iter().filter_map(|d| {
            let j = index_of(&self.case.names, &d.name)?;
            Some((*d, self.values[j]))
        });
        free.chain(self.model.held.iter().copied()).collect()
    }

    /// Outputs of a maneuver's signals at the values of the fit, without the biases.
    fn computed(
        &self,
        signals: &ManeuverSignals,
        held: &[(&Derivative, f64)],
    ) -> Result<Vec<[f64; OUTPUTS]>, Diverged> {
        let model = Model {
            held: held.to_vec(),
            initial_state: InitialState::Measured,
            ..Model::default()
        };
        let windows = [self.signals, signals];
        let measurements = self.case.measurements.clone();
        let mut case = self
            .case
            .as_recorded(self.aircraft, windows, measurements, &model);
        if self.case.initial_state == InitialState::Estimated {
            let first = self.values.len() - NX;
            case.start.copy_from_slice(&self.values[first..]);
        }
        let mut response = case.response();
        case.respond(&[], &mut response)?;
        Ok(response.outputs)
    }
}

/// Name of a signal that equals one throughout.
const ONE: &str = "one";

/// Effects of errors of all surfaces, from one pass. A surface acts through its derivatives alone.
/// Its scale error changes the outputs as an error of these derivatives does, and its bias as
/// errors of the coefficients' constants do.
struct SurfaceErrors<'a> {
    /// Derivatives along surfaces, with their values.
    derivatives: Vec<(&'a Derivative, f64)>,
    /// Places of the case's parameters among the parameters of this pass.
    places: Vec<usize>,
    names: Vec<String>,
    /// Information Σ Sᵀ W S on all parameters of this pass.
    information: DMatrix<f64>,
}

impl<'a> SurfaceErrors<'a> {
    /// Runs the pass with the derivatives along surfaces and constant deflections free as well.
    fn new<const NX: usize, E: Equations<NX>>(
        fitted: &FittedManeuver<NX, E>,
        held: &[(&'a Derivative, f64)],
    ) -> Result<SurfaceErrors<'a>, Diverged> {
        let FittedManeuver { model, case, .. } = fitted;
        let is_free = |d: &Derivative| model.free.iter().any(|f| f.name == d.name);
        let (derivatives, rest): (Vec<_>, Vec<_>) = held
            .iter()
            .partition(|(d, _)| d.regressor.surface().is_some());
        let constants = constant_deflections::<NX, E>();
        let mut free = model.free.clone();
        free.extend(derivatives.iter().map(|(d, _)| *d).filter(|d| !is_free(d)));
        free.extend(&constants);
        let wide = Model {
            free,
            held: rest.into_iter().filter(|(d, _)| !is_free(d)).collect(),
            biases: model.biases.clone(),
            initial_state: case.initial_state,
        };
        let signals = fitted.signals.with_constant(ONE, 1.0);
        let mut wide = case.with_model(fitted.aircraft, &signals, &wide);
        wide.start = case.start;
        let values = wide
            .names
            .iter()
            .map(|name| match index_of(&case.names, name) {
                Some(j) => fitted.values[j],
                None => derivatives
                    .iter()
                    .find(|(d, _)| d.name == *name)
                    .map_or(0.0, |(_, value)| *value),
            });
        let values: Vec<f64> = values.collect();
        let mut response = wide.response();
        wide.respond(&values, &mut response)?;
        let places = case.names.iter();
        Ok(SurfaceErrors {
            derivatives,
            places: places
                .map(|name| index_of(&wide.names, name).unwrap_or(0))
                .collect(),
            information: cost::sums(&response, fitted.weights).information,
            names: wide.names,
        })
    }

    fn gradient_shift(&self, error: &SignalError) -> DVector<f64> {
        let mut shift = DVector::zeros(self.places.len());
        let derivatives = self.derivatives.iter();
        for (derivative, value) in derivatives.filter(|(d, _)| is_along(d, error.signal)) {
            let constant = constant_name(derivative.coefficient, &derivative.regressor);
            self.subtract_column(&derivative.name, error.scale * value, &mut shift);
            self.subtract_column(&constant, error.bias * value, &mut shift);
        }
        shift
    }

    /// Subtracts a change of one parameter times its column of the information matrix.
    fn subtract_column(&self, name: &str, change: f64, shift: &mut DVector<f64>) {
        if let Some(column) = index_of(&self.names, name) {
            for (shift, &row) in shift.iter_mut().zip(&self.places) {
                *shift -= change * self.information[(row, column)];
            }
        }
    }
}

/// Derivatives of every coefficient along a constant deflection, and along a vane's constant force.
fn constant_deflections<const NX: usize, E: Equations<NX>>() -> Vec<Derivative> {
    let mut constants = Vec::new();
    for coefficient in E::AXIS.coefficients() {
        for regressor in [
            Regressor::Surface(ONE.to_owned()),
            Regressor::Vane(ONE.to_owned()),
        ] {
            constants.push(Derivative {
                name: constant_name(coefficient, &regressor),
                coefficient,
                regressor,
            });
        }
    }
    constants
}

fn is_along(derivative: &Derivative, surface: &str) -> bool {
    derivative.regressor.surface() == Some(surface)
}

fn index_of(names: &[String], name: &str) -> Option<usize> {
    names.iter().position(|n| n == name)
}

/// Name of the effect of a constant deflection of a surface, or force of a vane, on a coefficient.
fn constant_name(coefficient: Coefficient, regressor: &Regressor) -> String {
    let vane = matches!(regressor, Regressor::Vane(_));
    format!(
        "{coefficient:?} of a constant {}",
        if vane { "vane" } else { "surface" }
    )
}

/// Adds the effect of errors common to all data to a fit's corrected covariance. Each error is
/// given by its change of the gradient at one standard deviation
/// ([`FittedManeuver::gradient_shifts`]).
pub fn add_calibration_errors<D: Likelihood>(
    data: &D,
    errors: &[SignalError],
    gradient_shifts: &[DVector<f64>],
    fit: &mut Fit<D::Response>,
) {
    let Some(corrected) = &mut fit.covariance_corrected else {
        return;
    };
    let Some(inverse) = inverse(&data.sums(&fit.response, &fit.weights).information) else {
        return;
    };
    let shifts: Vec<DVector<f64>> = gradient_shifts.iter().map(|g| &inverse * g).collect();
    let effects = errors.iter().zip(&shifts);
    fit.shared_errors
        .extend(effects.map(|(error, shift)| error.effect(shift)));
    let common = covariance_of(&shifts, inverse.nrows());
    *corrected += &common;
    fit.covariance_calibration = Some(common);
}
