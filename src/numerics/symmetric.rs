//! Symmetric matrices at unit diagonal, and their inverse.

use nalgebra::{DMatrix, DVector};

use super::matrix::Padded;

/// 1/√H_jj, one where the data say nothing of a parameter.
#[must_use]
pub fn scale(information: &DMatrix<f64>) -> DVector<f64> {
    information
        .diagonal()
        .map(|h| if h > 0.0 { 1.0 / h.sqrt() } else { 1.0 })
}

/// H with rows and columns scaled.
#[must_use]
pub fn scaled(information: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(information.nrows(), information.ncols(), |i, j| {
        information[(i, j)] * scale[i] * scale[j]
    })
}

/// The inverse alone, whatever the condition; none where no direction less would do.
#[must_use]
pub fn inverse(information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = scale(information);
    Some(scaled(
        &Padded::symmetric(&scaled(information, &scale))
            .inverse()?
            .matrix(),
        &scale,
    ))
}
