//! Uncertainty of the scales as a part of the posterior's covariance.
//!
//! The posterior of the differences holds for the most probable scales
//! ([`scales`](super::scales)). Other scales would give another mean; this file adds the variance of
//! the mean over the scales.
//!
//! | symbol | quantity |
//! |---|---|
//! | θ | logarithms of the most probable sizes and lengths |
//! | m(θ) | posterior mean of the differences for these scales |
//! | H | second derivatives of minus the log posterior of the scales, at θ |
//! | v, κ | eigenvector of H, and its eigenvalue: the scales are uncertain by 1/√κ along v |
//!
//! Along each v the mean is computed at θ and at θ ± √(3/κ) v. These are the points of the
//! Gauss-Hermite rule with three points, whose weights are 1/6, 2/3 and 1/6. The published mean is
//! m(θ), so 1/6 of the squares of both differences from m(θ) is added to the covariance. Without
//! data m does not depend on the scales, and the tunnel's uncertainty stays as stated.

use nalgebra::{DMatrix, DVector};

use super::observed_differences::ObservedDifferences;
use super::posterior::Gaussian;
use super::scales::{LEAST_VARIANCE, logarithms_of, negative_log_posterior, scales_of};
use crate::model::prior::scale_prior::{DEVIATION_OF_LOG_SIZE, Scale};

/// Least eigenvalue of H that is used, so that points stay where the prior allows scales. A scale's
/// widest prior alone has the curvature 1/`DEVIATION_OF_LOG_SIZE`² = 1.56. The limit is 4 % lower.
/// It therefore acts only where the data flatten H below the prior's curvature.
const LEAST_CURVATURE: f64 = 1.5;
const _: () = assert!(LEAST_CURVATURE < 1.0 / (DEVIATION_OF_LOG_SIZE * DEVIATION_OF_LOG_SIZE));

/// Weight of each outer point of the Gauss-Hermite rule.
const OUTER: f64 = 1.0 / 6.0;

/// Adds the variance of the mean over the scales to the posterior `posterior` at the most probable
/// `scales`. An eigenvector along which the mean cannot be computed is left out.
pub fn add_open_scales(observed: &ObservedDifferences, scales: &[Scale], posterior: &mut Gaussian) {
    let at = logarithms_of(scales);
    let mean = |logarithms: &DVector<f64>| observed.mean(&scales_of(logarithms), LEAST_VARIANCE);
    let local = negative_log_posterior(observed, scales, LEAST_VARIANCE);
    let (Some(local), Some(centre)) = (local, mean(&at)) else {
        return;
    };
    let eigen = local.curvature.symmetric_eigen();
    let mut changes = vec![];
    for (direction, curvature) in eigen.eigenvectors.column_iter().zip(&eigen.eigenvalues) {
        let step = direction * (3.0 / curvature.max(LEAST_CURVATURE)).sqrt();
        let (Some(above), Some(below)) = (mean(&(&at + &step)), mean(&(&at - &step))) else {
            continue;
        };
        changes.extend([above - &centre, below - &centre]);
    }
    if changes.is_empty() {
        return;
    }
    let (changes, n) = (DMatrix::from_columns(&changes), centre.len());
    let mut of_differences = posterior.covariance.view_mut((0, 0), (n, n));
    of_differences.gemm(OUTER, &changes, &changes.transpose(), 1.0);
}
