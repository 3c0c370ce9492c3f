//! Sizes and lengths of the differences, by the marginal likelihood.
//!
//! With Λ and η the normal equations of the differences, whose other unknowns are marginalised, and C
//! = R Rᵀ their prior covariance, the log marginal likelihood is, but for a constant,
//!
//! −½ log |B| + ½ ηᵀ P η,  B = I + Rᵀ Λ R,  P = R B⁻¹ Rᵀ,
//!
//! and its derivative by a scale is ½ aᵀ ∂C a − ½ tr(M ∂C) with a = η − Λ P η and M = Λ − Λ P Λ.

use nalgebra::{DMatrix, DVector};

use super::flight_data::Information;
use super::prior::Scale;
use super::term::Term;
use super::unknowns::{Unknowns, root_of_differences};
use crate::numerics::minimise::minimum;
use crate::numerics::triangular::{cholesky, solve_lower};

/// Share of a term's largest variance below which the search leaves directions out: they change a
/// difference by a thousandth of its deviation.
pub const LEAST_VARIANCE: f64 = 1e-6;

/// Steps of the search.
const STEPS: usize = 60;

/// Gradient at which the search ends: scales are then within a hundredth of their uncertainty.
const TOLERANCE: f64 = 0.03;

/// Centres of the priors.
#[must_use]
pub fn centres(terms: &[Term]) -> Vec<Scale> {
    terms.iter().map(|t| t.prior.centre).collect()
}

/// Most probable scales, from a start.
#[must_use]
pub fn most_probable(
    terms: &[Term],
    unknowns: &Unknowns,
    information: &Information,
    start: &[Scale],
) -> Vec<Scale> {
    let start = logarithms_of(start);
    let negative = |logarithms: &DVector<f64>| {
        negative_log_posterior(
            terms,
            unknowns,
            information,
            &scales_of(logarithms),
            LEAST_VARIANCE,
        )
    };
    scales_of(&minimum(start, STEPS, TOLERANCE, negative))
}

/// Logarithms of size and length, term by term.
#[must_use]
pub fn logarithms_of(scales: &[Scale]) -> DVector<f64> {
    let logarithms = scales.iter().flat_map(|s| [s.size.ln(), s.length_deg.ln()]);
    DVector::from_iterator(2 * scales.len(), logarithms)
}

/// Scales of logarithms of size and length.
#[must_use]
pub fn scales_of(logarithms: &DVector<f64>) -> Vec<Scale> {
    let pairs = logarithms.as_slice().chunks_exact(2);
    pairs
        .map(|pair| Scale {
            size: pair[0].exp(),
            length_deg: pair[1].exp(),
        })
        .collect()
}

/// −log of marginal likelihood times prior, with its gradient by the logarithms of the scales. Directions
/// below `least` of a term's largest variance are left out.
#[must_use]
pub fn negative_log_posterior(
    terms: &[Term],
    unknowns: &Unknowns,
    information: &Information,
    scales: &[Scale],
    least: f64,
) -> Option<(f64, DVector<f64>)> {
    let Information { matrix, vector } = information;
    let root = root_of_differences(terms, scales, least);
    let mut halves = root.left(matrix);
    let mut inner = root.right(&halves);
    for j in 0..inner.nrows() {
        inner[(j, j)] += 1.0;
    }
    let lower = cholesky(inner)?;
    solve_lower(lower.as_view(), halves.as_view_mut());
    let mut seen = root.left_of(vector);
    lower.solve_lower_triangular_mut(&mut seen);
    let innovation = vector - halves.tr_mul(&seen);
    let log_determinant: f64 = lower.diagonal().iter().map(|d| d.ln()).sum();
    let mut value = log_determinant - 0.5 * seen.norm_squared();
    let mut gradient = DVector::zeros(2 * terms.len());
    for (i, (term, scale)) in terms.iter().zip(scales).enumerate() {
        let (start, n) = (unknowns.starts[i], term.prior.grid.len());
        let own = halves.columns(start, n);
        let rest = matrix.view((start, start), (n, n)) - own.transpose() * own;
        let innovation = innovation.rows(start, n);
        let by = |change: &DMatrix<f64>| {
            0.5 * rest.dot(change) - 0.5 * innovation.dot(&(change * innovation))
        };
        let (penalty, by_penalty) = term.prior.penalty(scale);
        value += penalty;
        gradient[2 * i] = 2.0 * by(&term.prior.covariance(scale)) + by_penalty[0];
        gradient[2 * i + 1] = by(&term.prior.covariance_by_length(scale)) + by_penalty[1];
    }
    (value.is_finite()).then_some((value, gradient))
}
