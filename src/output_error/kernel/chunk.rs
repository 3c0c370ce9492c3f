//! A chunk of points: its coefficients, and its regressors in the rows that the lanes read.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::{SMatrix, SVector};

use crate::dynamics::{COEFFICIENTS, Equations};
use crate::output_error::case::Case;
use crate::output_error::case::build_up::Term;
use crate::output_error::case::chunking::{POINTS, Spaced, WHOLE};

/// The three coefficients at the points of a chunk.
#[repr(align(64))]
pub(crate) struct Near<const NX: usize> {
    pub offset: [[f64; WHOLE]; COEFFICIENTS],
    pub slope: [[[f64; WHOLE]; NX]; COEFFICIENTS],
}

impl<const NX: usize> Near<NX> {
    pub const NONE: Near<NX> = Near {
        offset: [[0.0; WHOLE]; COEFFICIENTS],
        slope: [[[0.0; WHOLE]; NX]; COEFFICIENTS],
    };

    /// Their values at one of the points when the state is x.
    #[inline(always)]
    pub fn coefficients<E: Equations<NX>>(
        &self,
        point: usize,
        x: &SVector<f64, NX>,
    ) -> [f64; COEFFICIENTS] {
        let mut values = [0.0; COEFFICIENTS];
        for k in 0..COEFFICIENTS {
            values[k] = self.offset[k][point];
            // The first state last: it is the one that the sum would wait for.
            for &i in E::FOLLOWED.iter().rev() {
                values[k] = self.slope[k][i][point].mul_add(x[i], values[k]);
            }
        }
        values
    }
}

impl<const NX: usize> Near<NX> {
    /// Slopes along states, with those through the coefficients added.
    #[inline(always)]
    pub fn through<E: Equations<NX>, const N: usize>(
        &self,
        point: usize,
        mut by_state: SMatrix<f64, N, NX>,
        by_coefficient: &SMatrix<f64, N, COEFFICIENTS>,
        places: &[(usize, usize)],
    ) -> SMatrix<f64, N, NX> {
        for &(i, k) in places {
            for &j in E::FOLLOWED {
                by_state[(i, j)] =
                    by_coefficient[(i, k)].mul_add(self.slope[k][j][point], by_state[(i, j)]);
            }
        }
        by_state
    }
}

impl<const NX: usize, E: Equations<NX>> Case<NX, E> {
    /// The coefficients at the points of a chunk.
    #[inline(always)]
    pub(crate) fn near(&self, terms: &[Term], points: Spaced, near: &mut Near<NX>) {
        for k in 0..COEFFICIENTS {
            near.offset[k].fill(0.0);
            add(1.0, &self.held.offset[k], points, &mut near.offset[k]);
            for &i in E::FOLLOWED {
                near.slope[k][i].fill(0.0);
                add(1.0, &self.held.slope[k][i], points, &mut near.slope[k][i]);
            }
        }
        for Term { acting, value } in terms {
            let sum = match acting.along {
                Some(state) => &mut near.slope[acting.coefficient][state],
                None => &mut near.offset[acting.coefficient],
            };
            add(*value, &self.columns[acting.column], points, sum);
        }
    }

    /// What the derivatives multiply at the points of a chunk, in the rows that the lanes read.
    #[inline(always)]
    pub(crate) fn spread(&self, points: Spaced, rows: &mut [f64]) {
        for &(place, column) in &self.lanes.columns {
            let column = &self.columns[column][points.first..][..=points.stride * (POINTS - 1)];
            for k in 0..POINTS {
                rows[k * self.lanes.row + place] = column[k * points.stride];
            }
        }
    }
}

/// Adds a value times a column's points; a column that is empty is zero throughout.
#[inline(always)]
fn add(value: f64, column: &[f64], points: Spaced, sum: &mut [f64; WHOLE]) {
    let Some(column) = column.get(points.first..) else {
        return;
    };
    if points.stride == 1 {
        let Some(column) = column.first_chunk::<WHOLE>() else {
            return;
        };
        for k in 0..WHOLE {
            sum[k] = value.mul_add(column[k], sum[k]);
        }
    } else {
        sum.iter_mut()
            .zip(column.iter().step_by(points.stride))
            .for_each(|(sum, c)| *sum = value.mul_add(*c, *sum));
    }
}
