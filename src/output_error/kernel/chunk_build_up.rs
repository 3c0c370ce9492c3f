//! Build-up at the points of a chunk.
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
use crate::output_error::case::build_up::ValuedTerm;
use crate::output_error::case::chunking::{PADDED_POINTS, Strided};

/// Build-up at the points of a chunk: c = offset + slope · x.
#[repr(align(64))]
pub(crate) struct ChunkBuildUp<const NX: usize> {
    pub offset: [[f64; PADDED_POINTS]; COEFFICIENTS],
    pub slope: [[[f64; PADDED_POINTS]; NX]; COEFFICIENTS],
}

impl<const NX: usize> ChunkBuildUp<NX> {
    pub const ZERO: ChunkBuildUp<NX> = ChunkBuildUp {
        offset: [[0.0; PADDED_POINTS]; COEFFICIENTS],
        slope: [[[0.0; PADDED_POINTS]; NX]; COEFFICIENTS],
    };

    /// Sums the build-up of the held and the free derivatives at some points.
    #[inline(always)]
    pub fn set<E: Equations<NX>>(
        &mut self,
        case: &Case<NX, E>,
        free: &[ValuedTerm],
        points: Strided,
    ) {
        for k in 0..COEFFICIENTS {
            self.offset[k].fill(0.0);
            add(1.0, &case.held.offset[k], points, &mut self.offset[k]);
            for &i in E::REGRESSOR_STATES {
                self.slope[k][i].fill(0.0);
                add(1.0, &case.held.slope[k][i], points, &mut self.slope[k][i]);
            }
        }
        for ValuedTerm { term, value } in free {
            let sum = match term.state {
                Some(state) => &mut self.slope[term.coefficient][state],
                None => &mut self.offset[term.coefficient],
            };
            add(*value, &case.columns[term.column], points, sum);
        }
    }

    /// Coefficients at one of the points and the state x.
    #[inline(always)]
    pub fn coefficients<E: Equations<NX>>(
        &self,
        point: usize,
        x: &SVector<f64, NX>,
    ) -> [f64; COEFFICIENTS] {
        let mut values = [0.0; COEFFICIENTS];
        for k in 0..COEFFICIENTS {
            values[k] = self.offset[k][point];
            // The first state last: the integration delivers it last.
            for &i in E::REGRESSOR_STATES.iter().rev() {
                values[k] = self.slope[k][i][point].mul_add(x[i], values[k]);
            }
        }
        values
    }

    /// Total slopes along the states: those at constant coefficients plus those through the
    /// coefficients. `places` are the entries of `by_coefficient` that can differ from zero.
    #[inline(always)]
    pub fn total_slopes<E: Equations<NX>, const N: usize>(
        &self,
        point: usize,
        mut by_state: SMatrix<f64, N, NX>,
        by_coefficient: &SMatrix<f64, N, COEFFICIENTS>,
        places: &[(usize, usize)],
    ) -> SMatrix<f64, N, NX> {
        for &(i, k) in places {
            for &j in E::REGRESSOR_STATES {
                by_state[(i, j)] =
                    by_coefficient[(i, k)].mul_add(self.slope[k][j][point], by_state[(i, j)]);
            }
        }
        by_state
    }
}

/// Adds a value times a column at some points; an empty column is zero throughout.
#[inline(always)]
fn add(value: f64, column: &[f64], points: Strided, sum: &mut [f64; PADDED_POINTS]) {
    let Some(column) = column.get(points.first..) else {
        return;
    };
    if points.stride == 1 {
        let Some(column) = column.first_chunk::<PADDED_POINTS>() else {
            return;
        };
        for k in 0..PADDED_POINTS {
            sum[k] = value.mul_add(column[k], sum[k]);
        }
    } else {
        sum.iter_mut()
            .zip(column.iter().step_by(points.stride))
            .for_each(|(sum, c)| *sum = value.mul_add(*c, *sum));
    }
}
