//! Regressors at the points of a chunk, in the order of the lanes.
//!
//! A *strip* has one vector of regressors, point after point. Only the distance between strips is
//! unknown to the compiler, as in [`super::chunk_rows`].
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use pulp::Simd;

use crate::dynamics::Equations;
use crate::numerics::vectors::simd::{VECTOR, load};
use crate::output_error::case::Case;
use crate::output_error::case::chunking::{POINTS, Strided};
use crate::output_error::case::layout::LaneLayout;

/// Numbers of a strip.
const STRIP: usize = POINTS * VECTOR;

/// Regressors of a chunk, in a buffer of [`ChunkRegressors::length`].
pub(crate) struct ChunkRegressors<'a> {
    values: &'a mut [f64],
}

impl<'a> ChunkRegressors<'a> {
    /// Length of the buffer of a layout's regressors.
    pub fn length(layout: &LaneLayout) -> usize {
        layout.row_length / VECTOR * STRIP
    }

    pub fn new(values: &'a mut [f64]) -> Self {
        ChunkRegressors { values }
    }

    #[inline(always)]
    fn index(place: usize, point: usize) -> usize {
        place / VECTOR * STRIP + point * VECTOR + place % VECTOR
    }

    /// Copies the regressors at some points of a case.
    #[inline(always)]
    pub fn set<const NX: usize, E: Equations<NX>>(
        &mut self,
        case: &Case<NX, E>,
        layout: &LaneLayout,
        points: Strided,
    ) {
        for &(place, column) in &layout.columns {
            let column = &case.columns[column][points.first..][..=points.stride * (POINTS - 1)];
            let strip = &mut self.values[Self::index(place, 0)..][..=(POINTS - 1) * VECTOR];
            let strip = strip.iter_mut().step_by(VECTOR);
            if points.stride == 1 {
                strip.zip(column).for_each(|(r, c)| *r = *c);
            } else {
                let column = column.iter().step_by(points.stride);
                strip.zip(column).for_each(|(r, c)| *r = *c);
            }
        }
    }

    /// Regressors at the start, the middle and the end of the step from sample `k`, in the vector that
    /// begins at a place.
    #[inline(always)]
    pub fn of_step<S: Simd>(&self, k: usize, place: usize) -> [S::f64s; 3] {
        let first = Self::index(place, 2 * k);
        let strip = &self.values[first..][..2 * VECTOR + S::F64_LANES];
        // Without a closure, which would not be inlined by force.
        [
            load::<S>(strip, 0),
            load::<S>(strip, VECTOR),
            load::<S>(strip, 2 * VECTOR),
        ]
    }
}
