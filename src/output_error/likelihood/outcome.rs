//! Result of an estimation. A failure is a result too, with its reason.

use nalgebra::DMatrix;

use crate::dynamics::OUTPUTS;
use crate::output_error::kernel::response::Response;
use crate::output_error::likelihood::error_effect::ErrorEffect;
pub use crate::tables::Outcome;

/// Result of an estimation; `R` is the response of one maneuver, or of several joined.
#[derive(Clone, Debug)]
pub struct Fit<R = Response> {
    pub outcome: Outcome,
    pub reason: String,
    pub iterations: usize,
    /// Cost J at the start.
    pub initial_cost: Option<f64>,
    /// Cost J at the end.
    pub final_cost: Option<f64>,
    /// Parameters in the order of the case's names.
    pub values: Vec<f64>,
    /// Weights of the last iteration.
    pub weights: [f64; OUTPUTS],
    pub response: R,
    /// Condition number of the information matrix with unit diagonal.
    pub condition_number: Option<f64>,
    /// Parameters that take part in the least determined direction, if it is undetermined.
    pub undetermined: Vec<usize>,
    /// Covariance of the parameters for white residuals, the held values' part included; absent if
    /// the data do not determine it.
    pub covariance: Option<DMatrix<f64>>,
    /// Part of both covariances from the uncertainty of the held values.
    pub covariance_held: Option<DMatrix<f64>>,
    /// Part of the corrected covariance from errors of calibration.
    pub covariance_calibration: Option<DMatrix<f64>>,
    /// Covariance that counts the residuals' autocorrelation, noise of the surfaces and errors of
    /// calibration.
    pub covariance_corrected: Option<DMatrix<f64>>,
    /// Effects of the errors that other maneuvers share; the covariances contain them.
    pub shared_errors: Vec<ErrorEffect>,
}

impl<R: Default> Fit<R> {
    /// Fit before its iteration, which has not converged.
    pub(super) fn unfinished(
        values: Vec<f64>,
        weights: [f64; OUTPUTS],
        max_iterations: usize,
    ) -> Fit<R> {
        Fit {
            outcome: Outcome::NotConverged,
            reason: format!("not converged after {max_iterations} iterations"),
            iterations: 0,
            initial_cost: None,
            final_cost: None,
            values,
            weights,
            response: R::default(),
            condition_number: None,
            undetermined: vec![],
            covariance: None,
            covariance_held: None,
            covariance_calibration: None,
            covariance_corrected: None,
            shared_errors: vec![],
        }
    }
}

impl<R> Fit<R> {
    /// Exchanges the response for another one; returns the fit and its own response.
    #[must_use]
    pub fn with_response<S>(self, response: S) -> (Fit<S>, R) {
        let fit = Fit {
            outcome: self.outcome,
            reason: self.reason,
            iterations: self.iterations,
            initial_cost: self.initial_cost,
            final_cost: self.final_cost,
            values: self.values,
            weights: self.weights,
            response,
            condition_number: self.condition_number,
            undetermined: self.undetermined,
            covariance: self.covariance,
            covariance_held: self.covariance_held,
            covariance_calibration: self.covariance_calibration,
            covariance_corrected: self.covariance_corrected,
            shared_errors: self.shared_errors,
        };
        (fit, self.response)
    }
}
