//! The aerodynamic build-up (2.10-2.13, 3.9-3.13): the three coefficients as functions of the state.
//!
//! Each coefficient is linear in the derivatives, c = Σ ξ_j r_j. A regressor r_j is known at every
//! point or proportional to a state, so c = offset + slope · x.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::SVector;

use crate::dynamics::COEFFICIENTS;

/// Term of the build-up. It has the coefficient of one derivative, the state to which its regressor
/// is proportional, if any, and a column of regressors or of factors of proportion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BuildUpTerm {
    pub coefficient: usize,
    pub state: Option<usize>,
    pub column: usize,
}

/// Term of the build-up with the value of its derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ValuedTerm {
    pub term: BuildUpTerm,
    pub value: f64,
}

/// Build-up at every point of a maneuver; a column is empty where it is zero throughout.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BuildUp<const NX: usize> {
    pub offset: [Vec<f64>; COEFFICIENTS],
    pub slope: [[Vec<f64>; NX]; COEFFICIENTS],
}

impl<const NX: usize> BuildUp<NX> {
    pub fn zero() -> Self {
        BuildUp {
            offset: std::array::from_fn(|_| vec![]),
            slope: std::array::from_fn(|_| std::array::from_fn(|_| vec![])),
        }
    }

    /// Adds a term with its column of regressors.
    pub fn add(&mut self, ValuedTerm { term, value }: ValuedTerm, column: &[f64]) {
        let sum = match term.state {
            Some(state) => &mut self.slope[term.coefficient][state],
            None => &mut self.offset[term.coefficient],
        };
        if sum.is_empty() {
            sum.extend(column.iter().map(|r| value * r));
            return;
        }
        for (sum, r) in sum.iter_mut().zip(column) {
            *sum += value * r;
        }
    }

    /// Build-up at one point.
    #[inline(always)]
    pub fn at(&self, point: usize) -> PointBuildUp<NX> {
        let mut at = PointBuildUp {
            offset: [0.0; COEFFICIENTS],
            slope: [[0.0; NX]; COEFFICIENTS],
        };
        for k in 0..COEFFICIENTS {
            at.offset[k] = value_at(&self.offset[k], point);
            for i in 0..NX {
                at.slope[k][i] = value_at(&self.slope[k][i], point);
            }
        }
        at
    }
}

#[inline(always)]
fn value_at(column: &[f64], point: usize) -> f64 {
    column.get(point).copied().unwrap_or(0.0)
}

/// Build-up at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PointBuildUp<const NX: usize> {
    pub offset: [f64; COEFFICIENTS],
    pub slope: [[f64; NX]; COEFFICIENTS],
}

impl<const NX: usize> PointBuildUp<NX> {
    /// Adds a term with its regressor.
    pub fn add(&mut self, ValuedTerm { term, value }: ValuedTerm, regressor: f64) {
        let sum = match term.state {
            Some(state) => &mut self.slope[term.coefficient][state],
            None => &mut self.offset[term.coefficient],
        };
        *sum += value * regressor;
    }

    /// Coefficients at the state x.
    #[inline(always)]
    pub fn coefficients(&self, x: &SVector<f64, NX>) -> [f64; COEFFICIENTS] {
        let mut values = self.offset;
        for k in 0..COEFFICIENTS {
            // The first state last: the integration delivers it last.
            for i in (0..NX).rev() {
                values[k] = self.slope[k][i].mul_add(x[i], values[k]);
            }
        }
        values
    }
}
