//! The sums of the normal equations, output by output: Σ s sᵀ, Σ s v, Σ s and Σ v² over the samples that count. Weights
//! come later, so that other weights need no other pass.
//!
//! The residual and a one stand beside the sensitivities in a sample's row, so all of it is one symmetric matrix, updated
//! by as many ranks as there are samples in a chunk: a tile of it stays in the processor's registers while the samples run
//! past, and only tiles that touch the lower triangle are computed.
#![expect(clippy::inline_always, reason = "compiled into the kernel for the processor at hand")]
#![expect(clippy::needless_range_loop, reason = "plain indices become straight code for the vectors")]

use nalgebra::{DMatrix, DVector};
use pulp::Simd;

use super::case::Measurements;
use super::kernel::{Sink, load, store};
use super::lanes::{Aligned, Lanes, VECTOR};
use crate::dynamics::OUTPUTS;

/// The sums of all outputs of one case.
#[derive(Clone, Debug, Default)]
pub(super) struct Normal {
    /// Of each output Σ over rows (s, v, 1) of their squares, row by row; the lower triangle counts.
    squares: [Aligned; OUTPUTS],
    lanes: Lanes,
    /// Derivatives, which come before the biases among the parameters; initial states come after them.
    derivatives: usize,
    biased: Vec<usize>,
}

impl Normal {
    pub fn new(lanes: &Lanes, derivatives: usize, biased: &[usize]) -> Normal {
        let size = lanes.width() * lanes.width();
        Normal {
            squares: std::array::from_fn(|_| Aligned::zeros(size)),
            lanes: lanes.clone(),
            derivatives,
            biased: biased.to_vec(),
        }
    }

    pub fn clear(&mut self) {
        self.squares.iter_mut().for_each(|squares| squares.slice_mut().fill(0.0));
    }

    /// Samples of an output that count.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a sum of ones")]
    pub fn count(&self, output: usize) -> usize {
        self.at(output, self.lanes.one, self.lanes.one) as usize
    }

    /// Σ v² of an output.
    pub fn square(&self, output: usize) -> f64 {
        self.at(output, self.lanes.residual, self.lanes.residual)
    }

    fn at(&self, output: usize, i: usize, j: usize) -> f64 {
        self.squares[output].slice()[i.max(j) * self.lanes.width() + i.min(j)]
    }

    /// The lane of each parameter; of a bias that of the ones, and the output where alone it is.
    fn parameters(&self) -> Vec<(usize, Option<usize>)> {
        let (derivatives, initial) = self.lanes.places.split_at(self.derivatives);
        let biases = self.biased.iter().map(|&o| (self.lanes.one, Some(o)));
        let whole = |places: &[usize]| places.iter().map(|&lane| (lane, None)).collect::<Vec<_>>();
        whole(derivatives).into_iter().chain(biases).chain(whole(initial)).collect()
    }

    /// Σ_o w_o Σ s v of all parameters.
    pub fn gradient(&self, weights: &[f64; OUTPUTS]) -> DVector<f64> {
        let lanes = self.parameters();
        let of = |(lane, only): (usize, Option<usize>)| -> f64 {
            let outputs = (0..OUTPUTS).filter(|o| only.is_none_or(|only| only == *o));
            outputs.map(|o| weights[o] * self.at(o, lane, self.lanes.residual)).sum()
        };
        DVector::from_iterator(lanes.len(), lanes.iter().map(|lane| of(*lane)))
    }

    /// Σ s sᵀ of one output, for all parameters.
    pub fn squares(&self, output: usize) -> DMatrix<f64> {
        let mut weights = [0.0; OUTPUTS];
        weights[output] = 1.0;
        self.information(&weights)
    }

    /// Σ_o w_o Σ s sᵀ of all parameters.
    pub fn information(&self, weights: &[f64; OUTPUTS]) -> DMatrix<f64> {
        let width = self.lanes.width();
        let mut sum = vec![0.0; width * width];
        for (squares, w) in self.squares.iter().zip(weights) {
            sum.iter_mut().zip(squares.slice()).for_each(|(sum, s)| *sum += w * s);
        }
        let lanes = self.parameters();
        let both = |(i, first): (usize, Option<usize>), (j, second): (usize, Option<usize>)| match (first, second) {
            (None, None) => sum[i.max(j) * width + i.min(j)],
            (Some(o), Some(other)) if o != other => 0.0,
            (Some(o), _) | (_, Some(o)) => weights[o] * self.at(o, i, j),
        };
        let mut whole = DMatrix::zeros(lanes.len(), lanes.len());
        for (column, &b) in lanes.iter().enumerate() {
            for (row, &a) in lanes.iter().enumerate().skip(column) {
                whole[(row, column)] = both(a, b);
            }
        }
        whole.fill_upper_triangle_with_lower_triangle();
        whole
    }
}

/// Adds what a pass leaves to the sums.
pub(super) struct Summing<'a> {
    pub normal: &'a mut Normal,
    pub measurements: &'a Measurements,
}

impl Sink for Summing<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, first: usize, outputs: &[[f64; OUTPUTS]], rows: &mut [f64]) {
        let Normal { squares, lanes, .. } = &mut *self.normal;
        let width = lanes.width();
        for (k, y) in outputs.iter().enumerate() {
            for o in 0..OUTPUTS {
                let row = &mut rows[(k * OUTPUTS + o) * width..][..width];
                if self.measurements.used[first + k][o] {
                    row[lanes.residual] = self.measurements.values[first + k][o] - y[o];
                    row[lanes.one] = 1.0;
                } else {
                    row.fill(0.0);
                }
            }
        }
        for o in 0..OUTPUTS {
            let rows = Rows { values: &rows[o * width..], stride: OUTPUTS * width, samples: outputs.len() };
            rows.add_squares(simd, &lanes.used, squares[o].slice_mut(), width);
        }
    }
}

/// Rows of some samples, `stride` apart.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub values: &'a [f64],
    pub stride: usize,
    pub samples: usize,
}

impl Rows<'_> {
    /// Adds Σ s sᵀ to the lower triangle of a matrix with rows of `width`. `used` says how many lanes of each vector are
    /// in use.
    #[inline(always)]
    pub fn add_squares<S: Simd>(self, simd: S, used: &[usize], matrix: &mut [f64], width: usize) {
        for vector in 0..used.len() {
            let first = vector * VECTOR;
            match used[vector] {
                0 => {}
                1 => self.rows::<S, 1>(simd, first, matrix, width),
                2 => self.rows::<S, 2>(simd, first, matrix, width),
                3 => self.rows::<S, 3>(simd, first, matrix, width),
                4 => self.rows::<S, 4>(simd, first, matrix, width),
                5 => self.rows::<S, 5>(simd, first, matrix, width),
                6 => self.rows::<S, 6>(simd, first, matrix, width),
                7 => self.rows::<S, 7>(simd, first, matrix, width),
                _ => self.rows::<S, VECTOR>(simd, first, matrix, width),
            }
        }
    }

    /// `T` rows of the matrix, from its left edge to the diagonal.
    #[inline(always)]
    fn rows<S: Simd, const T: usize>(self, simd: S, first: usize, matrix: &mut [f64], width: usize) {
        let mut lane = 0;
        while lane + S::F64_LANES < first + T {
            self.tile::<S, T, 2>(simd, first, lane, matrix, width);
            lane += 2 * S::F64_LANES;
        }
        if lane < first + T {
            self.tile::<S, T, 1>(simd, first, lane, matrix, width);
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
    ) {
        let mut sums = [[simd.splat_f64s(0.0); C]; T];
        for t in 0..T {
            for c in 0..C {
                sums[t][c] = load::<S>(matrix, (first + t) * width + lane + c * S::F64_LANES);
            }
        }
        for k in 0..self.samples {
            let row = &self.values[k * self.stride..];
            let mut s = [simd.splat_f64s(0.0); C];
            for c in 0..C {
                s[c] = load::<S>(row, lane + c * S::F64_LANES);
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
            for c in 0..C {
                store::<S>(matrix, (first + t) * width + lane + c * S::F64_LANES, sums[t][c]);
            }
        }
    }
}
