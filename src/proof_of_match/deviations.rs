//! Independent deviations with a covariance.

use nalgebra::{DMatrix, DVector};

use crate::numerics::root::root;

/// Share of the largest variance, in units of the parameters' own, below which a direction is left out:
/// it adds 3 % of a standard deviation.
const LEAST_VARIANCE: f64 = 1e-3;

/// Deviations whose sum, each times an independent standard normal deviate, has the covariance.
/// Directions are ranked in units of the standard deviations.
#[must_use]
pub fn independent(covariance: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let deviations = covariance.diagonal().map(|v| v.max(0.0).sqrt());
    let per = deviations.map(|d| if d > 0.0 { 1.0 / d } else { 0.0 });
    let correlation = DMatrix::from_fn(covariance.nrows(), covariance.ncols(), |i, j| {
        per[i] * covariance[(i, j)] * per[j]
    });
    if correlation.is_empty() || correlation.amax() == 0.0 {
        return vec![];
    }
    let root = root(&correlation, LEAST_VARIANCE);
    let columns = root.column_iter();
    columns
        .map(|column| column.component_mul(&deviations))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn independent_deviations_have_the_covariance() {
        let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 1e-3, 1e-3, 1e-6]);
        let deviations = independent(&covariance);
        let sum = deviations.iter().map(|d| d * d.transpose());
        let sum = sum.reduce(|a, b| a + b).unwrap();
        assert_relative_eq!(sum, covariance, epsilon = 1e-12);
        assert!(independent(&DMatrix::zeros(0, 0)).is_empty());
        assert!(independent(&DMatrix::zeros(2, 2)).is_empty());
    }
}
