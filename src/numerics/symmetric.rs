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
