//! Gram matrices Σ s sᵀ over rows of numbers.
//!
//! The symmetric matrix is updated tile by tile. A tile stays in the processor's registers while
//! the rows run past, and only tiles that touch the lower triangle are computed.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use std::array::from_fn;

use pulp::Simd;

use super::simd::{VECTOR, load};

/// Rows of numbers, in vectors of [`VECTOR`] lanes.
#[derive(Clone, Copy)]
pub(crate) struct StridedRows<'a> {
    pub values: &'a [f64],
    /// Distance between two rows.
    pub stride: usize,
    /// Distance between two vectors of a row: [`VECTOR`] if its numbers follow one another.
    pub vector_stride: usize,
    pub count: usize,
}

impl StridedRows<'_> {
    /// Index of a lane, counted from the row's first number.
    #[inline(always)]
    fn place(self, lane: usize) -> usize {
        lane / VECTOR * self.vector_stride + lane % VECTOR
    }

    /// Adds Σ s sᵀ to the lower triangle of a matrix with rows of `width`. `used` has the lanes in
    /// use of each vector.
    #[inline(always)]
    pub fn add_gram<S: Simd>(self, simd: S, used: &[usize], matrix: &mut [f64], width: usize) {
        for vector in 0..used.len() {
            let (mut first, mut rows) = (vector * VECTOR, used[vector]);
            // Narrower vectors have half the registers: a tile of half the rows. With three vectors it would fill
            // them all, and sums would move to memory and back.
            while S::F64_LANES < VECTOR && rows > 4 {
                self.add_gram_rows::<S, 4, 2>(simd, first, matrix, width);
                (first, rows) = (first + 4, rows - 4);
            }
            match rows {
                0 => {}
                1 => self.add_gram_rows::<S, 1, 3>(simd, first, matrix, width),
                2 => self.add_gram_rows::<S, 2, 3>(simd, first, matrix, width),
                3 => self.add_gram_rows::<S, 3, 3>(simd, first, matrix, width),
                4 => self.add_gram_rows::<S, 4, 2>(simd, first, matrix, width),
                5 => self.add_gram_rows::<S, 5, 2>(simd, first, matrix, width),
                6 => self.add_gram_rows::<S, 6, 2>(simd, first, matrix, width),
                7 => self.add_gram_rows::<S, 7, 2>(simd, first, matrix, width),
                _ => self.add_gram_rows::<S, VECTOR, 2>(simd, first, matrix, width),
            }
        }
    }

    /// Adds to `T` rows of the matrix, from its left edge to the diagonal, in tiles of `C` vectors.
    #[inline(always)]
    fn add_gram_rows<S: Simd, const T: usize, const C: usize>(
        self,
        simd: S,
        first: usize,
        matrix: &mut [f64],
        width: usize,
    ) {
        let (mut lane, end) = (0, first + T);
        while lane + (C - 1) * S::F64_LANES < end {
            self.add_tile::<S, T, C>(simd, first, lane, matrix, width);
            lane += C * S::F64_LANES;
        }
        if lane + S::F64_LANES < end {
            self.add_tile::<S, T, 2>(simd, first, lane, matrix, width);
        } else if lane < end {
            self.add_tile::<S, T, 1>(simd, first, lane, matrix, width);
        }
    }

    /// Adds to a tile of `T` rows and `C` vectors.
    #[inline(always)]
    fn add_tile<S: Simd, const T: usize, const C: usize>(
        self,
        simd: S,
        first: usize,
        lane: usize,
        matrix: &mut [f64],
        width: usize,
    ) {
        let mut sums = [[simd.splat_f64s(0.0); C]; T];
        let matrix =
            &mut matrix[first * width + lane..(first + T - 1) * width + lane + C * S::F64_LANES];
        for t in 0..T {
            let row = S::as_simd_f64s(&matrix[t * width..][..C * S::F64_LANES]).0;
            sums[t].copy_from_slice(row);
        }
        let first = self.place(first);
        let places: [usize; C] = from_fn(|c| self.place(lane + c * S::F64_LANES));
        let end = (first + T).max(places[C - 1] + S::F64_LANES);
        let mut rest = self.values;
        for _ in 0..self.count {
            // Rows of one length, so that their bounds are checked once.
            let row = &rest[..end];
            rest = rest.get(self.stride..).unwrap_or_default();
            let mut s = [simd.splat_f64s(0.0); C];
            for c in 0..C {
                s[c] = load::<S>(row, places[c]);
            }
            let factors = &row[first..first + T];
            for t in 0..T {
                let factor = simd.splat_f64s(factors[t]);
                for c in 0..C {
                    sums[t][c] = simd.mul_add_f64s(factor, s[c], sums[t][c]);
                }
            }
        }
        for t in 0..T {
            let row = S::as_mut_simd_f64s(&mut matrix[t * width..][..C * S::F64_LANES]).0;
            row.copy_from_slice(&sums[t]);
        }
    }
}
