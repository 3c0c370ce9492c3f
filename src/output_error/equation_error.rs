//! Equation error: the derivatives by linear least squares on the coefficients that the measured accelerations imply.
//!
//! It needs no integration and so cannot diverge, whatever the airframe's stability; noise in the regressors biases it,
//! so it is a start for output error, not a result.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::case::Case;
use super::cost::add_square;
use crate::dynamics::{COEFFICIENTS, Equations};

/// Weight of the prior start against the data, on unit-diagonal scale: enough to hold what the data do not say.
const PULL: f64 = 1e-4;

/// Starting values with the derivatives from equation error; what the data do not determine stays near `prior`, as do
/// biases and initial states.
#[must_use]
pub fn start<const NX: usize, E: Equations<NX>>(case: &Case<NX, E>, prior: &[f64]) -> Vec<f64> {
    let mut values = prior.to_vec();
    for k in 0..COEFFICIENTS {
        let range = case.ranges[k].clone();
        if let Some(change) = regress(case, k, prior) {
            for (v, d) in values[range].iter_mut().zip(change.iter()) {
                *v += d;
            }
        }
    }
    values
}

/// Least-squares change of the derivatives of one coefficient against the prior values.
fn regress<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    coefficient: usize,
    prior: &[f64],
) -> Option<DVector<f64>> {
    let range = case.ranges[coefficient].clone();
    let mut regressors = vec![0.0; case.derivatives()];
    let (mut normal, mut right) = (DMatrix::zeros(range.len(), range.len()), DVector::zeros(range.len()));
    for (sample, (state, implied)) in case.states.iter().zip(&case.implied).enumerate() {
        let (computed, _) = case.coefficients(2 * sample, prior, state, &mut regressors);
        let error = implied[coefficient] - computed[coefficient];
        let row = &regressors[range.clone()];
        add_square(&mut normal, 1.0, row);
        for (b, r) in right.iter_mut().zip(row) {
            *b += error * r;
        }
    }
    normal.fill_upper_triangle_with_lower_triangle();
    let scale = super::cramer_rao::scale(&normal);
    let mut scaled = super::cramer_rao::scaled(&normal, &scale);
    for i in 0..range.len() {
        scaled[(i, i)] += PULL;
    }
    let solution = Cholesky::new(scaled)?.solve(&right.component_mul(&scale));
    let change = solution.component_mul(&scale);
    change.iter().all(|d| d.is_finite()).then_some(change)
}
