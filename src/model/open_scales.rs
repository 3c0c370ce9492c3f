//! Spread of the posterior's mean over the scales that the data leave open.
//!
//! Sizes and lengths are the most probable ones, θ. With H the second derivatives of −log of their
//! posterior and H = V Λ Vᵀ, the mean m is computed at θ ± √3 v/√λ for each direction v. The three values
//! have the weights 1/6, 2/3, 1/6 of Gauss and Hermite's rule. The published mean is that of θ, so their
//! mean square about it is added to the covariance. Where the data say nothing the mean does not depend on
//! the scales, and the tunnel's uncertainty stays as stated.

use nalgebra::{DMatrix, DVector};

use super::flight_data::Information;
use super::posterior::{Gaussian, mean};
use super::prior::Scale;
use super::scales::{LEAST_VARIANCE, logarithms_of, negative_log_posterior, scales_of};
use super::term::Term;
use super::unknowns::{Unknowns, root_of_differences};

/// Step of the differences for the second derivatives.
const STEP: f64 = 0.05;

/// Least second derivative along a direction: that of the widest prior of a scale.
const LEAST_CURVATURE: f64 = 1.5;

/// Weight of the outer points.
const OUTER: f64 = 1.0 / 6.0;

/// Coefficient's terms with the information on their differences.
#[derive(Clone, Copy, Debug)]
pub struct OpenScales<'a> {
    pub terms: &'a [Term],
    pub unknowns: &'a Unknowns,
    pub information: &'a Information,
}

impl OpenScales<'_> {
    /// Adds the spread to the covariance of a Gaussian at the most probable scales. A direction in which
    /// the posterior cannot be computed adds nothing.
    pub fn add_to(&self, scales: &[Scale], whole: &mut Gaussian) {
        let at = logarithms_of(scales);
        let (Some(curvature), Some(mean)) = (self.curvature(&at), self.mean(&at)) else {
            return;
        };
        let eigen = curvature.symmetric_eigen();
        let n = self.unknowns.differences;
        for (direction, curvature) in eigen.eigenvectors.column_iter().zip(&eigen.eigenvalues) {
            let step = direction * (3.0 / curvature.max(LEAST_CURVATURE)).sqrt();
            let (Some(above), Some(below)) = (self.mean(&(&at + &step)), self.mean(&(&at - &step)))
            else {
                continue;
            };
            let (above, below) = (above - &mean, below - &mean);
            let squares = &above * above.transpose() + &below * below.transpose();
            let mut own = whole.covariance.view_mut((0, 0), (n, n));
            own += squares * OUTER;
        }
    }

    /// Second derivatives by the logarithms of the scales.
    fn curvature(&self, at: &DVector<f64>) -> Option<DMatrix<f64>> {
        let gradient = |at: &DVector<f64>| {
            let scales = scales_of(at);
            let (terms, unknowns) = (self.terms, self.unknowns);
            negative_log_posterior(terms, unknowns, self.information, &scales, LEAST_VARIANCE)
                .map(|(_, gradient)| gradient)
        };
        let columns = (0..at.len()).map(|i| {
            let mut step = DVector::zeros(at.len());
            step[i] = STEP;
            Some((gradient(&(at + &step))? - gradient(&(at - &step))?) / (2.0 * STEP))
        });
        let columns: Vec<DVector<f64>> = columns.collect::<Option<_>>()?;
        let whole = DMatrix::from_columns(&columns);
        Some(0.5 * (&whole + whole.transpose()))
    }

    /// Mean of the differences.
    fn mean(&self, logarithms: &DVector<f64>) -> Option<DVector<f64>> {
        let scales = scales_of(logarithms);
        let root = root_of_differences(self.terms, &scales, LEAST_VARIANCE);
        mean(&root, self.information)
    }
}
