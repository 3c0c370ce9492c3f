//! Spread of the posterior's mean over the scales that the data leave uncertain.
//!
//! Sizes and lengths are the most probable ones, θ. With H the second derivatives of −log of their
//! posterior and H = V Λ Vᵀ, the mean m is computed at θ ± √3 v/√λ for each direction v. The three
//! values have the weights 1/6, 2/3, 1/6 of the Gauss-Hermite rule. The published mean is that of
//! θ, so their mean square about it is added to the covariance. In conditions without data the mean
//! does not depend on the scales, and the tunnel's uncertainty stays as stated.

use nalgebra::DVector;

use super::observed_differences::ObservedDifferences;
use super::posterior::Gaussian;
use super::scale_prior::Scale;
use super::scales::{LEAST_VARIANCE, logarithms_of, negative_log_posterior, scales_of};

/// Least second derivative along a direction: that of the widest prior of a scale.
const LEAST_CURVATURE: f64 = 1.5;

/// Weight of the outer points.
const OUTER: f64 = 1.0 / 6.0;

/// Adds the spread to the covariance of a Gaussian at the most probable scales. A direction in
/// which the posterior cannot be computed is skipped.
pub fn add_open_scales(observed: &ObservedDifferences, scales: &[Scale], whole: &mut Gaussian) {
    let at = logarithms_of(scales);
    let mean = |logarithms: &DVector<f64>| observed.mean(&scales_of(logarithms), LEAST_VARIANCE);
    let local = negative_log_posterior(observed, scales, LEAST_VARIANCE);
    let (Some(local), Some(centre)) = (local, mean(&at)) else {
        return;
    };
    let eigen = local.curvature.symmetric_eigen();
    let n = centre.len();
    for (direction, curvature) in eigen.eigenvectors.column_iter().zip(&eigen.eigenvalues) {
        let step = direction * (3.0 / curvature.max(LEAST_CURVATURE)).sqrt();
        let (Some(above), Some(below)) = (mean(&(&at + &step)), mean(&(&at - &step))) else {
            continue;
        };
        let (above, below) = (above - &centre, below - &centre);
        let squares = &above * above.transpose() + &below * below.transpose();
        let mut own = whole.covariance.view_mut((0, 0), (n, n));
        own += squares * OUTER;
    }
}
