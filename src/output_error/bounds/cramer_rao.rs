//! Cramér-Rao bounds (1.6, 1.7) of output error, in a form that holds for any weights. Those of
//! filter error are in `filter_error::bounds`.
//!
//! Let S be the sensitivities, W the weights, H = Σ Sᵀ W S the information matrix and R̂ the
//! covariance of the residuals. The covariance of the estimates is H⁻¹ [Σ Sᵀ W R̂ W S] H⁻¹. It
//! equals the usual bound H⁻¹ only if W = R̂⁻¹, which does not hold for the weights of Tables 2 and
//! 4.
//!
//! The corrected bound uses the residuals' autocovariance ([`coloured`]) and is never below the
//! bound for white residuals. Student's t widens it where the autocovariance has few degrees of
//! freedom, so that ±1.96 standard errors are an interval of 95 %.

use nalgebra::DMatrix;

use super::bounded::Bounded;
use super::coloured::{self, ResidualNoise};
use crate::numerics::linear_algebra::matrix::AlignedMatrix;
use crate::numerics::linear_algebra::symmetric::raise_variances;
use crate::output_error::likelihood::information::Identification;
use crate::output_error::likelihood::outcome::Fit;

/// Covariances of the parameters: for white residuals, and corrected.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    pub covariance: DMatrix<f64>,
    pub corrected: DMatrix<f64>,
}

/// Computes the bounds of a fit from the inverse of its information matrix.
#[must_use]
pub fn bounds<D: Bounded>(inverse: &DMatrix<f64>, data: &D, fit: &Fit<D::Response>) -> Bounds {
    let inverse = AlignedMatrix::from_symmetric(inverse);
    let white = data.white_covariance(&fit.response, &fit.weights);
    let covariance = estimates_covariance(&inverse, &white);
    let (series, inputs) = data.noisy(&fit.values, &fit.response, &fit.weights);
    let residuals = coloured::covariance(&inverse, &series).widened_by_student_t();
    let corrected =
        raise_variances(residuals, &covariance) + estimates_covariance(&inverse, &inputs);
    Bounds {
        covariance,
        corrected,
    }
}

/// Covariance of the estimates, H⁻¹ M H⁻¹, from the gradient's covariance M.
fn estimates_covariance(inverse: &AlignedMatrix, gradient: &DMatrix<f64>) -> DMatrix<f64> {
    let gradient = AlignedMatrix::from_symmetric(gradient);
    inverse.sandwich(&gradient).to_dense()
}

/// Estimates the noise of the outputs from a fit's residuals; `None` if the data do not determine
/// its parameters.
#[must_use]
pub fn residual_noise<D: Bounded>(
    data: &D,
    fit: &Fit<D::Response>,
    max_condition_number: f64,
) -> Option<ResidualNoise> {
    let sums = data.sums(&fit.response, &fit.weights);
    match Identification::identify(&sums.information, max_condition_number) {
        Identification::Determined { inverse, .. } => {
            let series = data.series(&fit.response, &fit.weights);
            Some(coloured::residual_noise(&inverse, &series))
        }
        Identification::Undetermined { .. } => None,
    }
}
