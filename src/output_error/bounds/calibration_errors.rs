//! What errors of calibration do to the estimates. The equations take every recorded signal for
//! true but for noise: a bias or a scale error of one moves a maneuver's estimates as a whole, and
//! hardly shows in the residuals.
//!
//! The estimates solve Σ Sᵀ W v = 0. In error by one standard deviation, a signal leaves other
//! residuals v′ at the same parameters, so the estimates move by H⁻¹ Σ Sᵀ W (v′ − v), to first
//! order in the error. A surface in error is the same as its derivatives in error, so for surfaces
//! v′ − v is known from sensitivities; for other signals it is integrated.

use nalgebra::{DMatrix, DVector};

use crate::aero::{Coefficient, Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::Window;
use crate::dynamics::{Equations, OUTPUTS};
use crate::numerics::symmetric::inverse;
use crate::output_error::case::{Case, InitialState, Model};
use crate::output_error::kernel::pass::Diverged;
use crate::output_error::kernel::response::Sensitivities;
use crate::output_error::likelihood::cost;
use crate::output_error::likelihood::data::Likelihood;
use crate::output_error::likelihood::outcome::Fit;
use crate::settings::settings;

settings! {
    /// Uncertainty that calibration leaves of a signal, standard deviations: reading = (1 + scale) ·
    /// truth + bias.
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
pub struct Misreading<'a> {
    pub signal: &'a str,
    pub scale: f64,
    /// In the signal's unit.
    pub bias: f64,
}

impl Calibration {
    /// Its errors, one standard deviation each, of which each is independent of the other.
    pub fn misreadings<'a>(&self, signal: &'a str) -> impl Iterator<Item = Misreading<'a>> {
        let scale = Misreading {
            signal,
            scale: self.scale_pct / 100.0,
            bias: 0.0,
        };
        let bias = Misreading {
            signal,
            scale: 0.0,
            bias: self.bias,
        };
        [scale, bias]
            .into_iter()
            .filter(|m| m.scale != 0.0 || m.bias != 0.0)
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
        let acts = |error: &Misreading| {
            held.iter()
                .any(|(d, _)| d.regressor.surface() == Some(error.signal))
        };
        let surfaces = if errors.iter().any(acts) {
            Some(Surfaces::of(self, &held)?)
        } else {
            None
        };
        let shift = |error: &Misreading| match surfaces.as_ref().filter(|_| acts(error)) {
            Some(surfaces) => Ok(surfaces.gradient_shift(error)),
            None => self.gradient_shift(error, &held, &right, &sensitivities),
        };
        errors.iter().map(shift).collect()
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
        let mut lanes = vec![0.0; sensitivities.width];
        for (k, (now, before)) in computed.iter().zip(right).enumerate() {
            for o in (0..OUTPUTS).filter(|&o| measurements.used[k][o]) {
                let measured = if read[o] {
                    error.scale * measurements.values[k][o] + error.bias
                } else {
                    0.0
                };
                let factor = self.weights[o] * (measured - (now[o] - before[o]));
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

    /// Every derivative at the value of the fit.
    fn all_held(&self) -> Vec<(&Derivative, f64)> {
        let value = |d: &&Derivative| {
            self.case
                .names
                .iter()
                .position(|n| *n == d.name)
                .map(|j| self.values[j])
        };
        let free = self.model.free.iter().filter_map(|d| Some((*d, value(d)?)));
        free.chain(self.model.held.iter().copied()).collect()
    }

    /// The outputs of a window at the values of the fit, without the biases.
    fn computed(
        &self,
        window: &Window,
        held: &[(&Derivative, f64)],
    ) -> Result<Vec<[f64; OUTPUTS]>, Diverged> {
        let model = Model {
            held: held.to_vec(),
            initial_state: InitialState::Measured,
            ..Model::default()
        };
        let mut case = Case::<NX, E>::new(
            self.aircraft,
            window,
            self.case.measurements.clone(),
            &model,
        );
        if self.case.initial_state == InitialState::Estimated {
            let first = self.values.len() - NX;
            case.start.copy_from_slice(&self.values[first..]);
        }
        let mut response = case.response();
        case.respond(&[], &mut response)?;
        Ok(response.outputs)
    }
}

/// A signal that is one throughout.
const ONE: &str = "one";

/// What errors of surfaces do, of all of them from one pass: a surface enters through its
/// derivatives alone, so its scale error changes the outputs as errors of its derivatives would,
/// and its bias as errors of the coefficients' constants.
struct Surfaces<'a> {
    /// The derivatives along surfaces with their values.
    acting: Vec<(&'a Derivative, f64)>,
    /// Parameters of the case, which come first here.
    parameters: Vec<usize>,
    names: Vec<String>,
    /// Σ Sᵀ W S of the case's parameters, these derivatives and the constants.
    information: DMatrix<f64>,
}

impl<'a> Surfaces<'a> {
    fn of<const NX: usize, E: Equations<NX>>(
        fitted: &Fitted<NX, E>,
        held: &[(&'a Derivative, f64)],
    ) -> Result<Surfaces<'a>, Diverged> {
        let Fitted {
            window,
            model,
            case,
            values,
            weights,
            ..
        } = fitted;
        let is_free = |d: &Derivative| model.free.iter().any(|f| f.name == d.name);
        let (acting, rest): (Vec<_>, Vec<_>) = held
            .iter()
            .partition(|(d, _)| d.regressor.surface().is_some());
        let constants: Vec<Derivative> = E::AXIS
            .coefficients()
            .into_iter()
            .flat_map(|coefficient| {
                [
                    Regressor::Surface(ONE.to_owned()),
                    Regressor::Vane(ONE.to_owned()),
                ]
                .map(|regressor| {
                    let name = constant(coefficient, &regressor);
                    Derivative {
                        name,
                        coefficient,
                        regressor,
                    }
                })
            })
            .collect();
        let mut free = model.free.clone();
        free.extend(acting.iter().map(|(d, _)| *d).filter(|d| !is_free(d)));
        free.extend(&constants);
        let wide = Model {
            free,
            held: rest.into_iter().filter(|(d, _)| !is_free(d)).collect(),
            biases: model.biases.clone(),
            initial_state: case.initial_state,
        };
        let window = window.with_constant(ONE, 1.0);
        let mut wide =
            Case::<NX, E>::new(fitted.aircraft, &window, case.measurements.clone(), &wide);
        wide.start = case.start;
        let place = |name: &String| case.names.iter().position(|n| n == name);
        let value = |name: &String| match place(name) {
            Some(j) => values[j],
            None => acting
                .iter()
                .find(|(d, _)| d.name == *name)
                .map_or(0.0, |(_, value)| *value),
        };
        let start: Vec<f64> = wide.names.iter().map(value).collect();
        let mut response = wide.response();
        wide.respond(&start, &mut response)?;
        let at = |name: &String| wide.names.iter().position(|n| n == name).unwrap_or(0);
        let parameters = case.names.iter().map(at).collect();
        let information = cost::sums(&response, weights).information;
        Ok(Surfaces {
            acting,
            parameters,
            names: wide.names,
            information,
        })
    }

    fn gradient_shift(&self, error: &Misreading) -> DVector<f64> {
        let mut shift = DVector::zeros(self.parameters.len());
        let mut add = |name: &str, change: f64| {
            if let Some(column) = self.names.iter().position(|n| n == name) {
                for (shift, &row) in shift.iter_mut().zip(&self.parameters) {
                    *shift -= change * self.information[(row, column)];
                }
            }
        };
        for (derivative, value) in self
            .acting
            .iter()
            .filter(|(d, _)| d.regressor.surface() == Some(error.signal))
        {
            add(&derivative.name, error.scale * value);
            add(
                &constant(derivative.coefficient, &derivative.regressor),
                error.bias * value,
            );
        }
        shift
    }
}

/// The name of what a constant deflection of a surface, or force of a vane, changes of a
/// coefficient.
fn constant(coefficient: Coefficient, regressor: &Regressor) -> String {
    let vane = matches!(regressor, Regressor::Vane(_));
    format!(
        "{coefficient:?} of a constant {}",
        if vane { "vane" } else { "surface" }
    )
}

/// Adds to a fit's corrected covariance what errors common to all its data do to the estimates: of
/// each, the change of the gradient with one standard deviation of it ([`super::calibration`]).
pub fn miscalibrated<D: Likelihood>(
    data: &D,
    gradient_shifts: &[DVector<f64>],
    fit: &mut Fit<D::Response>,
) {
    let Some(corrected) = &mut fit.covariance_corrected else {
        return;
    };
    let Some(inverse) = inverse(&data.sums(&fit.response, &fit.weights).information) else {
        return;
    };
    let mut common = DMatrix::zeros(inverse.nrows(), inverse.ncols());
    for gradient_shift in gradient_shifts {
        let shift = &inverse * gradient_shift;
        common += &shift * shift.transpose();
    }
    *corrected += &common;
    fit.covariance_calibration = Some(common);
}
