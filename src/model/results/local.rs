//! Posterior of an axis's derivatives at one flight condition, with their covariance.

use nalgebra::{DMatrix, DVector};

use super::campaign_model::Model;
use crate::aero::{Axis, Coefficient, Condition};
use crate::model::fusion::coefficient::CoefficientPosterior;
use crate::model::fusion::posterior::Gaussian;
use crate::model::fusion::unknowns::{SparseRow, covariance_between, weighted_sum};
use crate::model::prior::term::PosteriorTerm;

/// Half of the step in Mach number over which slopes are taken. Tables are linear between their points.
const MACH_STEP: f64 = 0.005;

/// Kind of a value of the posterior at a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LocalKind {
    /// A derivative.
    Derivative,
    /// A sum of a constant and its slope times α, published in place of the constant.
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
    /// Number of values of an axis's posterior at each flight condition.
    #[must_use]
    pub fn local_values(&self, axis: Axis) -> usize {
        let posteriors = self.of_axis(axis);
        posteriors.map(|(_, own)| own.local_values()).sum()
    }

    /// Posterior of an axis's derivatives at a flight condition, and of their slopes along Mach number
    /// where the tunnel's tables depend on it. Coefficients are independent of each other.
    #[must_use]
    pub fn posterior_at_condition(&self, axis: Axis, condition: &Condition) -> LocalPosterior {
        let parts: Vec<_> = self
            .of_axis(axis)
            .map(|(coefficient, posterior)| {
                posterior.coefficient_at_condition(*coefficient, condition)
            })
            .collect();
        let count = parts.iter().map(|part| part.values.len()).sum();
        let mut joined = LocalPosterior {
            values: Vec::with_capacity(count),
            mean: DVector::zeros(count),
            covariance: DMatrix::zeros(count, count),
        };
        for part in parts {
            let (first, length) = (joined.values.len(), part.values.len());
            joined
                .mean
                .rows_range_mut(first..first + length)
                .copy_from(&part.mean);
            let mut block = joined.covariance.view_mut((first, first), (length, length));
            block.copy_from(&part.covariance);
            joined.values.extend(part.values);
        }
        joined
    }

    fn of_axis(&self, axis: Axis) -> impl Iterator<Item = &(Coefficient, CoefficientPosterior)> {
        let coefficients = self.coefficients.iter();
        coefficients.filter(move |(coefficient, _)| coefficient.axis() == axis)
    }
}

impl CoefficientPosterior {
    /// Number of values at each condition.
    fn local_values(&self) -> usize {
        let terms = self.terms.iter();
        let slopes = terms.filter(|term| term.prior.grid.depends_on_mach());
        self.terms.len() + slopes.count()
    }

    fn coefficient_at_condition(
        &self,
        coefficient: Coefficient,
        condition: &Condition,
    ) -> LocalPosterior {
        let mut values = Vec::new();
        let mut tunnel = Vec::new();
        let mut rows: Vec<SparseRow> = Vec::new();
        for (term, start) in self.terms.iter().zip(&self.unknowns.starts) {
            for is_mach_slope in [false, true] {
                let Some(shares) = local_shares(term, condition, is_mach_slope) else {
                    continue;
                };
                let kind = match term.slope {
                    Some(_) => LocalKind::Sum,
                    None => LocalKind::Derivative,
                };
                values.push(LocalValue {
                    coefficient,
                    derivative: term.derivative.clone(),
                    kind,
                    is_mach_slope,
                });
                let at_nodes = shares.iter().map(|(node, w)| w * term.prior.mean[*node]);
                tunnel.push(at_nodes.sum::<f64>());
                let of_unknowns = shares.iter().map(|(node, w)| (start + node, *w));
                rows.push(of_unknowns.collect());
            }
        }
        let Gaussian { mean, covariance } = &self.gaussian;
        let with_rows = tunnel.iter().zip(&rows);
        let means = with_rows.map(|(tunnel, row)| tunnel + weighted_sum(row, mean));
        LocalPosterior {
            mean: DVector::from_iterator(rows.len(), means),
            covariance: DMatrix::from_fn(rows.len(), rows.len(), |i, j| {
                covariance_between(&rows[i], &rows[j], covariance)
            }),
            values,
        }
    }
}

/// Weights of the grid's points in the value of a term, or in its slope along Mach number. `None`
/// for the slope of a table without Mach number.
pub fn local_shares(
    term: &PosteriorTerm,
    condition: &Condition,
    is_mach_slope: bool,
) -> Option<SparseRow> {
    let grid = &term.prior.grid;
    if !is_mach_slope {
        return Some(grid.shares(condition));
    }
    if !grid.depends_on_mach() {
        return None;
    }
    let per_mach = 0.5 / MACH_STEP;
    let at = |step: f64| {
        grid.shares(&Condition {
            mach: condition.mach + step,
            ..*condition
        })
    };
    let above = at(MACH_STEP).into_iter();
    let below = at(-MACH_STEP).into_iter();
    let above = above.map(|(node, share)| (node, share * per_mach));
    let below = below.map(|(node, share)| (node, -share * per_mach));
    Some(above.chain(below).collect())
}
