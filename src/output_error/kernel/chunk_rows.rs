//! Rows of a chunk: for each output at each sample the numbers of all lanes.
//!
//! A *strip* has one vector of lanes of one output, sample after sample. The strips of all outputs
//! follow one another, then come those of the next vector. The compiler thus knows all distances but
//! that between vectors, and the loops need few addresses. An address for each output and vector would
//! not fit into the registers: the stores of addresses then take longer than the sums.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use std::ops::Range;

use pulp::Simd;

use crate::dynamics::OUTPUTS;
use crate::numerics::vectors::row_products::StridedRows;
use crate::numerics::vectors::simd::{VECTOR, load, store};
use crate::output_error::case::chunking::CHUNK;

/// Numbers of a strip.
const STRIP: usize = CHUNK * VECTOR;

/// Numbers of the strips of all outputs.
const OF_VECTOR: usize = OUTPUTS * STRIP;

/// Rows of a chunk, in a buffer of [`ChunkRows::length`].
pub(crate) struct ChunkRows<'a> {
    values: &'a mut [f64],
}

impl<'a> ChunkRows<'a> {
    /// Length of the buffer of rows of this number of lanes, whole vectors.
    pub const fn length(lanes: usize) -> usize {
        lanes / VECTOR * OF_VECTOR
    }

    pub fn new(values: &'a mut [f64]) -> Self {
        ChunkRows { values }
    }

    #[inline(always)]
    fn index(sample: usize, output: usize, lane: usize) -> usize {
        lane / VECTOR * OF_VECTOR + output * STRIP + sample * VECTOR + lane % VECTOR
    }

    /// Sets the lane of one row.
    #[inline(always)]
    pub fn set(&mut self, sample: usize, output: usize, lane: usize, value: f64) {
        self.values[Self::index(sample, output, lane)] = value;
    }

    /// Sets all lanes of one row to zero.
    #[inline(always)]
    pub fn clear(&mut self, sample: usize, output: usize) {
        let first = Self::index(sample, output, 0);
        for of_vector in self.values.chunks_exact_mut(OF_VECTOR) {
            of_vector[first..first + VECTOR].fill(0.0);
        }
    }

    /// Stores the vectors of all outputs at a sample, which begin at a lane.
    #[inline(always)]
    pub fn store<S: Simd>(&mut self, sample: usize, lane: usize, vectors: &[S::f64s; OUTPUTS]) {
        // One slice, so that its bounds are checked once.
        let first = Self::index(sample, 0, lane);
        let strips = &mut self.values[first..][..(OUTPUTS - 1) * STRIP + S::F64_LANES];
        for (output, vector) in vectors.iter().enumerate() {
            store::<S>(strips, output * STRIP, *vector);
        }
    }

    /// Copies all lanes of one row.
    pub fn copy_to(&self, sample: usize, output: usize, row: &mut [f64]) {
        let first = Self::index(sample, output, 0);
        let of_vectors = self.values.chunks_exact(OF_VECTOR);
        for (to, of_vector) in row.chunks_exact_mut(VECTOR).zip(of_vectors) {
            to.copy_from_slice(&of_vector[first..first + VECTOR]);
        }
    }

    /// Rows of one output at the first samples.
    #[inline(always)]
    pub fn of_output(&self, output: usize, samples: usize) -> StridedRows<'_> {
        StridedRows {
            values: &self.values[output * STRIP..],
            stride: VECTOR,
            vector_stride: OF_VECTOR,
            count: samples,
        }
    }

    /// Adds the rows of some samples to sums: output by output a row of lanes.
    #[inline(always)]
    pub fn add_to<S: Simd>(&self, simd: S, samples: Range<usize>, sums: &mut [f64]) {
        let width = sums.len() / OUTPUTS;
        for lane in (0..width).step_by(S::F64_LANES) {
            let mut of_outputs = [simd.splat_f64s(0.0); OUTPUTS];
            for (output, sum) in of_outputs.iter_mut().enumerate() {
                *sum = load::<S>(sums, output * width + lane);
            }
            for sample in samples.clone() {
                let first = Self::index(sample, 0, lane);
                let strips = &self.values[first..][..(OUTPUTS - 1) * STRIP + S::F64_LANES];
                for (output, sum) in of_outputs.iter_mut().enumerate() {
                    *sum = simd.add_f64s(*sum, load::<S>(strips, output * STRIP));
                }
            }
            for (output, sum) in of_outputs.iter().enumerate() {
                store::<S>(sums, output * width + lane, *sum);
            }
        }
    }
}
