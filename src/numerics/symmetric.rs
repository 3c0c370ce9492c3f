//! Symmetric positive definite matrices: scaling to unit diagonal, and the inverse.

use nalgebra::{DMatrix, DVector};

use super::matrix::AlignedMatrix;

/// 1/√H_jj of each parameter; one where the diagonal is not positive.
#[must_use]
pub fn scale(information: &DMatrix<f64>) -> DVector<f64> {
    information
        .diagonal()
        .map(|h| if h > 0.0 { 1.0 / h.sqrt() } else { 1.0 })
}

/// D H D with D the diagonal matrix of `scale`.
#[must_use]
pub fn scaled(information: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(information.nrows(), information.ncols(), |i, j| {
        information[(i, j)] * scale[i] * scale[j]
    })
}

/// Inverse, computed at unit diagonal without a condition check; `None` unless positive definite.
#[must_use]
pub fn inverse(information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = scale(information);
    Some(scaled(
        &AlignedMatrix::from_symmetric(&scaled(information, &scale))
            .inverse()?
            .to_dense(),
        &scale,
    ))
}

/// Raises the variances of a covariance that are below those of another one; correlations stay.
#[must_use]
pub fn raise_variances(mut covariance: DMatrix<f64>, other: &DMatrix<f64>) -> DMatrix<f64> {
    for j in 0..covariance.nrows() {
        let (variance, least) = (covariance[(j, j)], other[(j, j)]);
        if variance < least {
            if variance > 0.0 {
                let factor = (least / variance).sqrt();
                covariance.row_mut(j).scale_mut(factor);
                covariance.column_mut(j).scale_mut(factor);
            } else {
                covariance.row_mut(j).copy_from(&other.row(j));
                covariance.column_mut(j).copy_from(&other.column(j));
            }
            covariance[(j, j)] = least;
        }
    }
    covariance
}
