//! The build-up: the three coefficients as functions of the state at every point.
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

/// The three coefficients at every point as functions of the state: c = offset + slope · x; empty
/// where zero throughout.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Coefficients<const NX: usize> {
    pub offset: [Vec<f64>; COEFFICIENTS],
    pub slope: [[Vec<f64>; NX]; COEFFICIENTS],
}

impl<const NX: usize> Coefficients<NX> {
    pub fn zero() -> Self {
        Coefficients {
            offset: std::array::from_fn(|_| vec![]),
            slope: std::array::from_fn(|_| std::array::from_fn(|_| vec![])),
        }
    }

    /// Adds a derivative of this value.
    pub fn add(&mut self, value: f64, acting: Acting, column: &[f64]) {
        let sum = match acting.along {
            Some(state) => &mut self.slope[acting.coefficient][state],
            None => &mut self.offset[acting.coefficient],
        };
        sum.resize(column.len(), 0.0);
        sum.iter_mut()
            .zip(column)
            .for_each(|(sum, r)| *sum += value * r);
    }

    /// Those of a point.
    #[inline(always)]
    pub(crate) fn at(&self, point: usize) -> At<NX> {
        let value = |of: &Vec<f64>| of.get(point).copied().unwrap_or(0.0);
        At {
            offset: std::array::from_fn(|k| value(&self.offset[k])),
            slope: std::array::from_fn(|k| std::array::from_fn(|i| value(&self.slope[k][i]))),
        }
    }
}

/// What a free derivative adds to a coefficient: its value times a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Term {
    pub acting: Acting,
    pub value: f64,
}

/// The coefficients at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct At<const NX: usize> {
    pub offset: [f64; COEFFICIENTS],
    pub slope: [[f64; NX]; COEFFICIENTS],
}

impl<const NX: usize> At<NX> {
    /// Their values when the state is x.
    #[inline(always)]
    pub(crate) fn with(&self, x: &SVector<f64, NX>) -> [f64; COEFFICIENTS] {
        let mut values = self.offset;
        for k in 0..COEFFICIENTS {
            // The first state last: it is the one that the sum would wait for.
            for i in (0..NX).rev() {
                values[k] = self.slope[k][i].mul_add(x[i], values[k]);
            }
        }
        values
    }
}

/// How a derivative acts: on which coefficient, along which state (where its regressor is one), and
/// which column of regressors or factors of proportion is its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Acting {
    pub coefficient: usize,
    pub along: Option<usize>,
    pub column: usize,
}
