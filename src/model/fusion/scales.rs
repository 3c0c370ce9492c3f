//! Most probable scales of the differences between flight and tunnel.
//!
//! The difference of a derivative from the tunnel is a random function of the flight condition with
//! two *scales*. The size is a multiple of the table's size, or of the table's stated uncertainty.
//! The length is the change of α, in deg, over which the difference changes. The most probable
//! scales have the largest product of prior and marginal likelihood of all estimates.
//!
//! | symbol | quantity |
//! |---|---|
//! | d | differences at the points of the grids, each in the unit of its derivative |
//! | Λ, η | information matrix and vector of the estimates on d: Λ d = η at their maximum |
//! | C = R Rᵀ | prior covariance of d for given scales, and a root of it |
//! | B = I + Rᵀ Λ R | information on R⁻¹ d of prior and estimates |
//! | P = R B⁻¹ Rᵀ | posterior covariance of d; P η is its mean |
//! | a = η − Λ P η | part of η that the posterior mean does not explain (innovation) |
//! | M = Λ − Λ P Λ | covariance of a for data that the scales predict |
//! | f | minus the log of the marginal likelihood, without constants |
//!
//! All other unknowns are marginalised in Λ and η. In these symbols
//!
//! f = ½ log |B| − ½ ηᵀ P η.
//!
//! Subscripts i and j are derivatives along the logarithms of two scales. With M_j = −M C_j M and
//! a_j = −M C_j a,
//!
//! f_i = ½ tr(M C_i) − ½ aᵀ C_i a,
//!
//! f_ij = −½ tr(M C_i M C_j) + aᵀ C_i M C_j a + ½ tr(M C_ij) − ½ aᵀ C_ij a.
//!
//! The expectation of f_ij over data that the scales predict is ½ tr(M C_i M C_j), since that of a
//! aᵀ is M. This expectation is never negative; it replaces f_ij where f_ij is not positive
//! definite.

use nalgebra::{DMatrix, DVector};

use super::observed_differences::{MarginalLikelihood, ObservedDifferences, ObservedTerm};
use crate::model::prior::scale_prior::Scale;
use crate::model::prior::term::PosteriorTerm;
use crate::numerics::minimise::{LocalExpansion, minimum};

/// Share of a term's largest prior variance below which a direction of its differences is ignored.
/// Such a direction changes a difference by at most a thousandth of its standard deviation.
pub const LEAST_VARIANCE: f64 = 1e-6;

/// Largest number of Newton steps of the search for the scales.
const STEPS: usize = 60;

/// Distance from the minimum at which the search ends, in standard deviations of the scales.
const TOLERANCE: f64 = 0.01;

/// Medians of the priors of all scales, from which the search starts.
#[must_use]
pub fn centres(terms: &[PosteriorTerm]) -> Vec<Scale> {
    terms.iter().map(|t| t.prior.scale.centre).collect()
}

/// Finds the most probable scales by Newton's method from `start`.
#[must_use]
pub fn most_probable(observed: &ObservedDifferences, start: &[Scale]) -> Vec<Scale> {
    let negative = |logarithms: &DVector<f64>| {
        negative_log_posterior(observed, &scales_of(logarithms), LEAST_VARIANCE)
    };
    scales_of(&minimum(logarithms_of(start), STEPS, TOLERANCE, negative))
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

/// Minus the log of marginal likelihood times prior, with its derivatives along the logarithms of
/// size and length of each term. Directions below the share `least` of a term's largest prior
/// variance are ignored. `None` if the value or a derivative is not finite.
#[must_use]
pub fn negative_log_posterior(
    observed: &ObservedDifferences,
    scales: &[Scale],
    least: f64,
) -> Option<LocalExpansion> {
    let likelihood = observed.marginal_likelihood(scales, least)?;
    let pairs = observed.terms.iter().zip(scales);
    let changes: Vec<TermDerivatives> = pairs
        .map(|(t, s)| TermDerivatives::new(t, s, &likelihood))
        .collect();
    let n = 2 * changes.len();
    let mut local = LocalExpansion {
        value: likelihood.value,
        gradient: DVector::zeros(n),
        curvature: DMatrix::zeros(n, n),
        expected: DMatrix::zeros(n, n),
    };
    for (i, (term, scale)) in changes.iter().zip(scales).enumerate() {
        for (j, other) in changes[..=i].iter().enumerate() {
            term.add_pair(other, &likelihood, (2 * i, 2 * j), &mut local);
        }
        term.add_single(scale, 2 * i, &mut local);
    }
    let LocalExpansion {
        value, curvature, ..
    } = &local;
    (value.is_finite() && curvature.iter().all(|c| c.is_finite())).then_some(local)
}

/// Products of one term's C_i from which the derivatives of f along its size and length follow. C is
/// proportional to the square of the size, so its derivative along log size is 2 C.
struct TermDerivatives<'a> {
    term: &'a ObservedTerm,
    /// M C_i for log size and log length, at the columns of the term's differences.
    information_changes: [DMatrix<f64>; 2],
    /// C_i a for log size and log length.
    innovation_changes: [DVector<f64>; 2],
    /// ½ tr(M X) − ½ aᵀ X a, where X is C, its first and its second derivative along log length.
    cost_slopes: [f64; 3],
}

impl<'a> TermDerivatives<'a> {
    fn new(
        term: &'a ObservedTerm,
        scale: &Scale,
        likelihood: &MarginalLikelihood,
    ) -> TermDerivatives<'a> {
        let slopes = term.covariance.slopes(scale);
        let (start, n) = (term.start, term.len());
        let columns = likelihood.information.columns(start, n);
        let of_term = columns.rows(start, n);
        let a = likelihood.innovation.rows(start, n);
        let half = |c: &DMatrix<f64>| 0.5 * of_term.dot(c) - 0.5 * a.dot(&(c * a));
        let halves = [&slopes.value, &slopes.by_length, &slopes.by_length_twice].map(half);
        TermDerivatives {
            information_changes: [2.0 * columns * &slopes.value, columns * &slopes.by_length],
            innovation_changes: [2.0 * &slopes.value * a, &slopes.by_length * a],
            cost_slopes: halves,
            term,
        }
    }

    /// Adds the parts with M C_i M C_j to the second derivatives of f. i is a scale of this term, j
    /// a scale of an earlier term or of the same one.
    fn add_pair(
        &self,
        other: &TermDerivatives,
        likelihood: &MarginalLikelihood,
        (i, j): (usize, usize),
        local: &mut LocalExpansion,
    ) {
        let (term, earlier) = (self.term, other.term);
        let at = (term.start, earlier.start);
        let between = likelihood.information.view(at, (term.len(), earlier.len()));
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let image = other.information_changes[b].rows(term.start, term.len());
            let back = self.information_changes[a].rows(earlier.start, earlier.len());
            let trace = 0.5 * image.dot(&back.transpose());
            let square = self.innovation_changes[a].dot(&(between * &other.innovation_changes[b]));
            for place in [(i + a, j + b), (j + b, i + a)] {
                local.expected[place] = trace;
                local.curvature[place] = square - trace;
            }
        }
    }

    /// Adds the first derivatives of f, the terms of f_ij with C_ij, and the prior of this term's
    /// scales.
    fn add_single(&self, scale: &Scale, i: usize, local: &mut LocalExpansion) {
        let [value, by_length, by_length_twice] = self.cost_slopes;
        let penalty = self.term.scale.penalty(scale);
        local.value += penalty.value;
        local.gradient[i] = 2.0 * value + penalty.gradient[0];
        local.gradient[i + 1] = by_length + penalty.gradient[1];
        let second = [4.0 * value, 2.0 * by_length, by_length_twice];
        for (place, second) in [(0, 0), (0, 1), (1, 1)].into_iter().zip(second) {
            local.curvature[(i + place.0, i + place.1)] += second;
        }
        local.curvature[(i + 1, i)] += second[1];
        for k in 0..2 {
            local.curvature[(i + k, i + k)] += penalty.curvature[k];
            local.expected[(i + k, i + k)] += penalty.curvature[k];
        }
    }
}
