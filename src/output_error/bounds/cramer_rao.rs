//! How well the data determine the parameters: Cramér-Rao bounds (1.6, 1.7) in a form that holds
//! for any weights.
//!
//! With H = Σ Sᵀ W S and residual covariance R̂ the covariance of the estimates is H⁻¹ [Σ Sᵀ W R̂ W
//! S] H⁻¹; it is H⁻¹, the usual bound, when W = R̂⁻¹. The weights of Tables 2 and 4 are legitimate
//! weights that are not. Correlated residuals are counted by their autocovariance ([`coloured`]),
//! and the bound is never below the one for white ones. Where that autocovariance is known from
//! little, the corrected bound is longer by what Student's t says, so that ±1.96 of it are an
//! interval of 95 %.

use nalgebra::DMatrix;

use super::coloured;
use super::data::Bounded;
use crate::numerics::matrix::Padded;
use crate::output_error::likelihood::information::{Identified, identified};
use crate::output_error::likelihood::outcome::Fit;

/// The two covariances of the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    pub covariance: DMatrix<f64>,
    pub corrected: DMatrix<f64>,
}

/// Bounds of a fit, given the inverse of its information matrix.
#[must_use]
pub fn bounds<D: Bounded>(inverse: &DMatrix<f64>, data: &D, fit: &Fit<D::Response>) -> Bounds {
    let inverse = Padded::symmetric(inverse);
    let scattered = |gradient: DMatrix<f64>| inverse.about(&Padded::symmetric(&gradient)).matrix();
    let covariance = scattered(data.white_covariance(&fit.response, &fit.weights));
    let (series, inputs) = data.noisy(&fit.values, &fit.response, &fit.weights);
    let residuals = coloured::covariance(&inverse, &series).of_student();
    let corrected = never_below(residuals, &covariance) + scattered(inputs);
    Bounds {
        covariance,
        corrected,
    }
}

/// The noise of the outputs that a fit leaves; none where the data do not determine its parameters.
#[must_use]
pub fn noise<D: Bounded>(
    data: &D,
    fit: &Fit<D::Response>,
    max_condition_number: f64,
) -> Option<coloured::Noise> {
    let sums = data.sums(&fit.response, &fit.weights);
    match identified(&sums.information, max_condition_number) {
        Identified::Determined { inverse, .. } => Some(coloured::noise(
            &inverse,
            &data.series(&fit.response, &fit.weights),
        )),
        Identified::Undetermined { .. } => None,
    }
}

/// Raises variances that came out below the white ones to them, keeping the correlations.
fn never_below(mut corrected: DMatrix<f64>, white: &DMatrix<f64>) -> DMatrix<f64> {
    for j in 0..corrected.nrows() {
        let (have, need) = (corrected[(j, j)], white[(j, j)]);
        if have < need {
            if have > 0.0 {
                let factor = (need / have).sqrt();
                corrected.row_mut(j).scale_mut(factor);
                corrected.column_mut(j).scale_mut(factor);
            } else {
                corrected.row_mut(j).copy_from(&white.row(j));
                corrected.column_mut(j).copy_from(&white.column(j));
            }
            corrected[(j, j)] = need;
        }
    }
    corrected
}
