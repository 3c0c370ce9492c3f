//! Sums of products over rows of numbers, in vectors of the processor at hand.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use pulp::Simd;

use super::simd::VECTOR;

/// Something that goes on step by step beside other work.
pub(crate) trait Meanwhile {
    /// Does one step of it, if any is left.
    fn advance(&mut self);
}

/// Nothing goes on.
pub(crate) struct Nothing;

impl Meanwhile for Nothing {
    #[inline(always)]
    fn advance(&mut self) {}
}

/// Samples of a tile between two stages of what goes on meanwhile: about as long as a stage waits.
const SAMPLES_BETWEEN: usize = 4;

/// Rows of some samples, `stride` apart.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a> {
    pub values: &'a [f64],
    pub stride: usize,
    pub samples: usize,
}

impl Rows<'_> {
    /// Adds Σ s sᵀ to the lower triangle of a matrix with rows of `width`. `used` says how many
    /// lanes of each vector are in use.
    #[inline(always)]
    pub fn add_squares<S: Simd>(self, simd: S, used: &[usize], matrix: &mut [f64], width: usize) {
        self.add_squares_beside(simd, used, matrix, width, &mut Nothing);
    }

    /// The same while something else goes on.
    #[inline(always)]
    pub fn add_squares_beside<S: Simd>(
        self,
        simd: S,
        used: &[usize],
        matrix: &mut [f64],
        width: usize,
        meanwhile: &mut impl Meanwhile,
    ) {
        for vector in 0..used.len() {
            let first = vector * VECTOR;
            match used[vector] {
                0 => {}
                1 => self.rows::<S, 1>(simd, first, matrix, width, meanwhile),
                2 => self.rows::<S, 2>(simd, first, matrix, width, meanwhile),
                3 => self.rows::<S, 3>(simd, first, matrix, width, meanwhile),
                4 => self.rows::<S, 4>(simd, first, matrix, width, meanwhile),
                5 => self.rows::<S, 5>(simd, first, matrix, width, meanwhile),
                6 => self.rows::<S, 6>(simd, first, matrix, width, meanwhile),
                7 => self.rows::<S, 7>(simd, first, matrix, width, meanwhile),
                _ => self.rows::<S, VECTOR>(simd, first, matrix, width, meanwhile),
            }
        }
    }

    /// Adds Σ v s to a row, v being one of the lanes.
    #[inline(always)]
    pub fn add_moments<S: Simd>(self, simd: S, v: usize, row: &mut [f64]) {
        let mut lane = 0;
        while lane + 3 * S::F64_LANES <= row.len() {
            self.moments::<S, 3>(simd, v, lane, row);
            lane += 3 * S::F64_LANES;
        }
        while lane < row.len() {
            self.moments::<S, 1>(simd, v, lane, row);
            lane += S::F64_LANES;
        }
    }

    /// The same of `C` vectors.
    #[inline(always)]
    fn moments<S: Simd, const C: usize>(self, simd: S, v: usize, lane: usize, row: &mut [f64]) {
        let into = S::as_mut_simd_f64s(&mut row[lane..lane + C * S::F64_LANES]).0;
        let mut sums = [simd.splat_f64s(0.0); C];
        sums.copy_from_slice(into);
        for k in 0..self.samples {
            let row = &self.values[k * self.stride..];
            let factor = simd.splat_f64s(row[v]);
            let s = S::as_simd_f64s(&row[lane..lane + C * S::F64_LANES]).0;
            for c in 0..C {
                sums[c] = simd.mul_add_f64s(factor, s[c], sums[c]);
            }
        }
        into.copy_from_slice(&sums);
    }

    /// `T` rows of the matrix, from its left edge to the diagonal.
    #[inline(always)]
    fn rows<S: Simd, const T: usize>(
        self,
        simd: S,
        first: usize,
        matrix: &mut [f64],
        width: usize,
        meanwhile: &mut impl Meanwhile,
    ) {
        let mut lane = 0;
        while lane + S::F64_LANES < first + T {
            self.tile::<S, T, 2>(simd, first, lane, matrix, width, meanwhile);
            lane += 2 * S::F64_LANES;
        }
        if lane < first + T {
            self.tile::<S, T, 1>(simd, first, lane, matrix, width, meanwhile);
        }
    }

    /// A tile of `T` rows and `C` vectors.
    #[inline(always)]
    fn tile<S: Simd, const T: usize, const C: usize>(
        self,
        simd: S,
        first: usize,
        lane: usize,
        matrix: &mut [f64],
        width: usize,
        meanwhile: &mut impl Meanwhile,
    ) {
        let mut sums = [[simd.splat_f64s(0.0); C]; T];
        let matrix =
            &mut matrix[first * width + lane..(first + T - 1) * width + lane + C * S::F64_LANES];
        for t in 0..T {
            let row = S::as_simd_f64s(&matrix[t * width..][..C * S::F64_LANES]).0;
            sums[t].copy_from_slice(row);
        }
        for k in 0..self.samples {
            if k % SAMPLES_BETWEEN == 0 {
                meanwhile.advance();
            }
            let row = &self.values[k * self.stride..];
            let mut s = [simd.splat_f64s(0.0); C];
            s.copy_from_slice(S::as_simd_f64s(&row[lane..][..C * S::F64_LANES]).0);
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
