//! Posterior of an axis's derivatives at one flight condition, with their covariance.

use nalgebra::{DMatrix, DVector};

use super::campaign_model::Model;
use super::coefficient::CoefficientPosterior;
use super::term::Term;
use crate::aero::{Axis, Coefficient, Condition};

/// Half of the step in Mach number over which slopes are taken. Tables are linear between their points.
const MACH_STEP: f64 = 0.005;

/// Kind of a value of the posterior at a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LocalKind {
    /// A derivative.
    Derivative,
    /// A sum of a constant and its slope times α, in place of the constant.
    Sum,
}

/// One value of the posterior at a condition.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalValue {
    pub coefficient: Coefficient,
    /// Derivative of the model; the constant of a sum.
    pub derivative: String,
    pub kind: LocalKind,
    /// `true` for the slope of the value along Mach number.
    pub is_mach_slope: bool,
}

/// Posterior of an axis's derivatives at one flight condition.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalPosterior {
    pub values: Vec<LocalValue>,
    /// In the units of the derivatives.
    pub mean: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

impl Model {
    /// Posterior of an axis's derivatives at a flight condition, and of their slopes along Mach number
    /// where the tunnel's tables depend on it. Coefficients are independent of each other.
    #[must_use]
    pub fn at(&self, axis: Axis, condition: &Condition) -> LocalPosterior {
        let of_axis = self.coefficients.iter().filter(|(c, _)| c.axis() == axis);
        let parts: Vec<_> = of_axis
            .map(|(coefficient, posterior)| posterior.at(*coefficient, condition))
            .collect();
        let count = parts.iter().map(|part| part.values.len()).sum();
        let mut whole = LocalPosterior {
            values: Vec::with_capacity(count),
            mean: DVector::zeros(count),
            covariance: DMatrix::zeros(count, count),
        };
        for part in parts {
            let (first, length) = (whole.values.len(), part.values.len());
            whole
                .mean
                .rows_range_mut(first..first + length)
                .copy_from(&part.mean);
            let mut block = whole.covariance.view_mut((first, first), (length, length));
            block.copy_from(&part.covariance);
            whole.values.extend(part.values);
        }
        whole
    }
}

impl CoefficientPosterior {
    fn at(&self, coefficient: Coefficient, condition: &Condition) -> LocalPosterior {
        let mut values = Vec::new();
        let mut rows = Vec::new();
        let mut tunnel = Vec::new();
        for (term, start) in self.terms.iter().zip(&self.unknowns.starts) {
            let weights = [
                Some(value_shares(term, condition)),
                mach_shares(term, condition),
            ];
            for (shares, is_mach_slope) in weights.into_iter().zip([false, true]) {
                let Some(shares) = shares else { continue };
                values.push(LocalValue {
                    coefficient,
                    derivative: term.derivative.clone(),
                    kind: if term.slope.is_some() {
                        LocalKind::Sum
                    } else {
                        LocalKind::Derivative
                    },
                    is_mach_slope,
                });
                let known = shares.iter().map(|(node, w)| w * term.prior.mean[*node]);
                tunnel.push(known.sum::<f64>());
                rows.push((*start, shares));
            }
        }
        let n = self.unknowns.differences;
        let mut weights = DMatrix::zeros(rows.len(), n);
        for (i, (start, shares)) in rows.iter().enumerate() {
            for (node, weight) in shares {
                weights[(i, start + node)] += weight;
            }
        }
        let covariance = self.gaussian.covariance.view((0, 0), (n, n));
        LocalPosterior {
            values,
            mean: DVector::from_vec(tunnel) + &weights * self.gaussian.mean.rows(0, n),
            covariance: &weights * covariance * weights.transpose(),
        }
    }
}

fn value_shares(term: &Term, condition: &Condition) -> Vec<(usize, f64)> {
    term.prior.grid.shares(condition)
}

/// Weights of the grid's points in the slope along Mach number; `None` for a table without Mach.
fn mach_shares(term: &Term, condition: &Condition) -> Option<Vec<(usize, f64)>> {
    let at = |mach: f64| {
        let condition = Condition { mach, ..*condition };
        term.prior.grid.shares(&condition)
    };
    if term.prior.grid.machs.is_empty() {
        return None;
    }
    let per_mach = 0.5 / MACH_STEP;
    let above = at(condition.mach + MACH_STEP).into_iter();
    let below = at(condition.mach - MACH_STEP).into_iter();
    let above = above.map(|(node, share)| (node, share * per_mach));
    let below = below.map(|(node, share)| (node, -share * per_mach));
    Some(above.chain(below).collect())
}
