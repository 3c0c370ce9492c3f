//! How an estimation ended: a failure is data.

use nalgebra::DMatrix;

use crate::dynamics::OUTPUTS;
use crate::output_error::kernel::response::Response;
pub use crate::tables::Outcome;

/// The result of an estimation; `R` is the response of one maneuver, or of several joined.
#[derive(Clone, Debug)]
pub struct Fit<R = Response> {
    pub outcome: Outcome,
    pub reason: String,
    pub iterations: usize,
    /// J at the start and at the end.
    pub initial_cost: Option<f64>,
    pub final_cost: Option<f64>,
    /// The parameters in the order of the case's names.
    pub values: Vec<f64>,
    /// The weights in force at the end.
    pub weights: [f64; OUTPUTS],
    pub response: R,
    /// Of the information matrix with unit diagonal.
    pub condition_number: Option<f64>,
    /// The parameters that take part in the least determined direction, where the data do not
    /// determine it.
    pub undetermined: Vec<usize>,
    /// Sandwich covariance of the parameters, the held values' part in it; absent where the data
    /// determine none.
    pub covariance: Option<DMatrix<f64>>,
    /// What the uncertainty of the held values contributes to both covariances.
    pub covariance_held: Option<DMatrix<f64>>,
    /// What errors of calibration contribute to the corrected covariance.
    pub covariance_calibration: Option<DMatrix<f64>>,
    /// The covariance with the residuals' autocorrelation, noise of the surfaces and errors of
    /// calibration counted.
    pub covariance_corrected: Option<DMatrix<f64>>,
}

impl<R> Fit<R> {
    /// The same result with another response in place of its own, and its own.
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
        };
        (fit, self.response)
    }
}
