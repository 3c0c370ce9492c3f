//! The standard case in memory, and one estimate of it.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use nalgebra::DMatrix;

use super::case_file::{self, CaseFile, bias};
use crate::aero::{Bias, Derivative};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::{ManeuverSignals, MassProperties};
use crate::dynamics::{Longitudinal, OUTPUTS};
use crate::error::{Error, Result};
use crate::flight::Record;
use crate::numerics::linear_algebra::symmetric;
use crate::output_error::cost::Sums;
use crate::output_error::newton_raphson::{self, Settings};
use crate::output_error::surface_noise::noisy_surfaces;
use crate::output_error::{Case, Fit, InitialState, Likelihood, Model, Outcome, cramer_rao};
use crate::store::files;

/// Tolerance of the iteration relative to the case's `ftol`. Other estimators stop after a step
/// that lowers the cost by less than `ftol`; harvest stops before it. A step near the minimum
/// lowers the next gain by about this factor, so both end at the same step.
const TOLERANCE_PER_FTOL: f64 = 0.01;

/// A standard case in memory.
#[derive(Clone, Debug)]
pub struct StandardCase {
    file: CaseFile,
    aircraft: Aircraft,
    record: Record,
    free: Vec<Derivative>,
    held: Vec<(Derivative, f64)>,
    biases: Vec<Bias>,
    pub(super) import_s: f64,
}

/// Reads a case and the record beside it.
///
/// # Errors
/// [`Error`] naming the file that is missing or malformed.
pub fn load(path: &Path) -> Result<StandardCase> {
    let begin = Instant::now();
    let file: CaseFile = serde_json::from_str(&files::text(path)?)
        .map_err(|e| Error::config(path, Some(e.line()), format!("malformed case: {e}")))?;
    let table = path.with_extension("csv");
    let columns = files::columns(&table)?;
    let aircraft = file.aircraft();
    let record = file
        .record(&columns)
        .map_err(|what| Error::config(&table, None, what))?;
    let derivative =
        |name: &String| case_file::derivative(name).map_err(|what| Error::config(path, None, what));
    let mut free = Vec::new();
    let mut biases = Vec::new();
    for name in file.start.keys() {
        match bias(name) {
            Some(bias) => biases.push(bias),
            None => free.push(derivative(name)?),
        }
    }
    let held = file
        .fixed
        .iter()
        .map(|(name, value)| Ok((derivative(name)?, *value)))
        .collect::<Result<_>>()?;
    Ok(StandardCase {
        aircraft,
        record,
        free,
        held,
        biases,
        import_s: begin.elapsed().as_secs_f64(),
        file,
    })
}

/// One estimate of a standard case.
pub(super) struct StandardEstimate {
    signals: ManeuverSignals,
    case: Case<3, Longitudinal>,
    pub fit: Fit,
    /// Inverse of the information matrix.
    inverse: Option<DMatrix<f64>>,
    /// Standard errors for white residuals, scaled by their variance.
    pub std: Vec<f64>,
    /// Time before the first iteration.
    pub ready_s: f64,
}

impl StandardEstimate {
    /// Values of the parameters by name, in the case's units.
    pub fn by_name(&self, standard: &StandardCase, values: &[f64]) -> BTreeMap<String, f64> {
        let named = self.case.names.iter().zip(values);
        named
            .map(|(name, value)| (name.clone(), value * standard.unit(name)))
            .collect()
    }

    /// Standard errors that account for autocorrelated residuals and the noise of the surfaces;
    /// `None` if the information matrix is singular.
    pub fn corrected(&mut self, standard: &StandardCase) -> Option<Vec<f64>> {
        let model = standard.model();
        self.case.noisy_inputs.surfaces = noisy_surfaces(&standard.aircraft, &self.signals, &model);
        let bounds = cramer_rao::bounds(self.inverse.as_ref()?, &self.case, &self.fit);
        Some(
            bounds
                .corrected
                .diagonal()
                .iter()
                .map(|v| v.sqrt())
                .collect(),
        )
    }
}

impl StandardCase {
    /// Estimates the case once.
    ///
    /// # Errors
    /// The message for a signal that the record lacks.
    pub(super) fn estimate(&self) -> Result<StandardEstimate, String> {
        let begin = Instant::now();
        let signals = self.signals()?;
        let case = self.case(&signals);
        let ready_s = begin.elapsed().as_secs_f64();
        let settings = Settings {
            tolerance: TOLERANCE_PER_FTOL * self.file.ftol,
            ..Settings::default()
        };
        let (start, weights) = self.start(&case);
        let fit = newton_raphson::minimise(&case, start, weights, &settings);
        let sums = case.sums(&fit.response, &fit.weights);
        let inverse = Some(&sums).filter(|_| fit.outcome == Outcome::Converged);
        let inverse = inverse.and_then(|sums| symmetric::inverse(&sums.information));
        let std = inverse
            .as_ref()
            .map_or(vec![], |inverse| standard_errors(inverse, &sums));
        Ok(StandardEstimate {
            signals,
            case,
            fit,
            inverse,
            std,
            ready_s,
        })
    }

    /// Signals of the case at the samples, with straight lines between them, as in the programs
    /// with which the case is compared.
    ///
    /// # Errors
    /// The message for a signal that the record lacks.
    pub fn signals(&self) -> Result<ManeuverSignals, String> {
        let derivatives = self.free.iter().chain(self.held.iter().map(|(d, _)| d));
        let surfaces = derivatives.flat_map(|d| d.regressor.signals());
        ManeuverSignals::cut_linear(
            &self.aircraft,
            &self.record,
            0..self.record.samples,
            surfaces,
            MassProperties::Mean,
        )
    }

    /// Free and held parameters of the case.
    #[must_use]
    pub fn model(&self) -> Model<'_> {
        Model {
            free: self.free.iter().collect(),
            held: self.held.iter().map(|(d, v)| (d, *v)).collect(),
            biases: self.biases.iter().collect(),
            initial_state: InitialState::Measured,
        }
    }

    /// Prepares the maneuver for the iteration.
    #[must_use]
    pub fn case(&self, signals: &ManeuverSignals) -> Case<3, Longitudinal> {
        let measurements = self.file.measurements(&self.record);
        let mut case = Case::for_passes(&self.aircraft, signals, measurements, &self.model());
        case.start_from_mean_of(self.file.x0_samples);
        case
    }

    #[must_use]
    pub fn aircraft(&self) -> &Aircraft {
        &self.aircraft
    }

    /// Starting values in the order of the parameters, and weights.
    #[must_use]
    pub fn start(&self, case: &Case<3, Longitudinal>) -> (Vec<f64>, [f64; OUTPUTS]) {
        let value = |name: &String| {
            let start = self.file.start.get(name);
            start.map_or(0.0, |v| v / self.unit(name))
        };
        (case.names.iter().map(value).collect(), self.file.weights())
    }

    /// Unit of a parameter in the case's convention: biases count in units of its gravity.
    fn unit(&self, name: &str) -> f64 {
        if bias(name).is_some() {
            self.file.accelerometer_unit()
        } else {
            1.0
        }
    }
}

/// Standard errors: square roots of the diagonal of H⁻¹, scaled by the variance of the residuals
/// 2 n J/(n − parameters).
fn standard_errors(inverse: &DMatrix<f64>, sums: &Sums) -> Vec<f64> {
    let variance = sums.weighted_square / (sums.count - inverse.nrows()) as f64;
    inverse
        .diagonal()
        .iter()
        .map(|v| (v * variance).sqrt())
        .collect()
}
