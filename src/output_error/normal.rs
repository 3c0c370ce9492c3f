//! The sums of the normal equations, output by output: Σ v², Σ s v, Σ s and Σ s sᵀ over the samples that count. Weights
//! come later, so that other weights need no other pass.
//!
//! Σ s sᵀ is a symmetric update of as many ranks as there are samples in a chunk: a tile of it stays in the processor's
//! registers while the samples run past, and only tiles that touch the lower triangle are computed.
#![expect(clippy::inline_always, reason = "compiled into the kernel for the processor at hand")]

use nalgebra::{DMatrix, DVector};
use pulp::Simd;

use super::case::Measurements;
use super::kernel::{CHUNK, Sink, load, store};
use super::lanes::Lanes;
use crate::dynamics::OUTPUTS;

/// Rows of a tile.
const TILE: usize = 8;

/// The sums of one output, for packed lanes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Sums {
    pub count: usize,
    /// Σ v and Σ v².
    pub residual: f64,
    pub square: f64,
    /// Σ s v and Σ s.
    gradient: Vec<f64>,
    total: Vec<f64>,
    /// Σ s sᵀ, row by row; the lower triangle counts.
    information: Vec<f64>,
    width: usize,
}

/// The sums of all outputs of one case.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Normal {
    pub outputs: [Sums; OUTPUTS],
    driven: usize,
    /// Derivatives, which come before the biases among the parameters; initial states come after them.
    derivatives: usize,
    biased: Vec<usize>,
}

impl Normal {
    pub fn new(lanes: &Lanes, derivatives: usize, biased: &[usize]) -> Normal {
        let width = lanes.width;
        let sums = || Sums {
            gradient: vec![0.0; width],
            total: vec![0.0; width],
            information: vec![0.0; width * lanes.driven.next_multiple_of(TILE)],
            width,
            ..Sums::default()
        };
        let outputs = std::array::from_fn(|_| sums());
        Normal { outputs, driven: lanes.driven, derivatives, biased: biased.to_vec() }
    }

    pub fn clear(&mut self) {
        for sums in &mut self.outputs {
            (sums.count, sums.residual, sums.square) = (0, 0.0, 0.0);
            sums.gradient.fill(0.0);
            sums.total.fill(0.0);
            sums.information.fill(0.0);
        }
    }

    /// The parameter of a packed lane.
    fn parameter(&self, lane: usize) -> usize {
        if lane < self.derivatives { lane } else { lane + self.biased.len() }
    }

    /// Σ_o w_o Σ s v of all parameters.
    pub fn gradient(&self, weights: &[f64; OUTPUTS]) -> DVector<f64> {
        let mut gradient = DVector::zeros(self.driven + self.biased.len());
        for (sums, w) in self.outputs.iter().zip(weights) {
            for lane in 0..self.driven {
                gradient[self.parameter(lane)] += w * sums.gradient[lane];
            }
        }
        for (b, &o) in self.biased.iter().enumerate() {
            gradient[self.derivatives + b] += weights[o] * self.outputs[o].residual;
        }
        gradient
    }

    /// Σ_o w_o Σ s sᵀ of all parameters.
    pub fn information(&self, weights: &[f64; OUTPUTS]) -> DMatrix<f64> {
        let n = self.driven + self.biased.len();
        let mut whole = DMatrix::zeros(n, n);
        for lane in 0..self.driven {
            let column = self.parameter(lane);
            for other in lane..self.driven {
                let weighted = self.outputs.iter().zip(weights).map(|(s, w)| w * s.information[other * s.width + lane]);
                whole[(self.parameter(other), column)] = weighted.sum();
            }
        }
        for (b, &o) in self.biased.iter().enumerate() {
            let (row, sums) = (self.derivatives + b, &self.outputs[o]);
            for lane in 0..self.driven {
                let (i, j) = (row.max(self.parameter(lane)), row.min(self.parameter(lane)));
                whole[(i, j)] = weights[o] * sums.total[lane];
            }
            for (c, _) in self.biased.iter().enumerate().filter(|(c, other)| *c <= b && **other == o) {
                whole[(row, self.derivatives + c)] = weights[o] * sums.count as f64;
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
        for (o, sums) in self.normal.outputs.iter_mut().enumerate() {
            let mut residuals = [0.0; CHUNK];
            for k in 0..outputs.len() {
                if self.measurements.used[first + k][o] {
                    let v = self.measurements.values[first + k][o] - outputs[k][o];
                    residuals[k] = v;
                    sums.count += 1;
                    sums.residual += v;
                    sums.square += v * v;
                } else {
                    let row = (k * OUTPUTS + o) * sums.width;
                    rows[row..row + sums.width].fill(0.0);
                }
            }
            let rows = Rows { rows: &rows[o * sums.width..], stride: OUTPUTS * sums.width, samples: outputs.len() };
            for lane in (0..self.normal.driven).step_by(S::F64_LANES) {
                let mut gradient = load::<S>(&sums.gradient, lane);
                let mut total = load::<S>(&sums.total, lane);
                for k in 0..rows.samples {
                    let s = load::<S>(rows.rows, k * rows.stride + lane);
                    gradient = simd.mul_add_f64s(simd.splat_f64s(residuals[k]), s, gradient);
                    total = simd.add_f64s(total, s);
                }
                store::<S>(&mut sums.gradient, lane, gradient);
                store::<S>(&mut sums.total, lane, total);
            }
            rows.add_squares(simd, self.normal.driven, &mut sums.information, sums.width);
        }
    }
}

/// Rows of some samples, `stride` apart.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub rows: &'a [f64],
    pub stride: usize,
    pub samples: usize,
}

impl Rows<'_> {
    /// Adds Σ s sᵀ of the first `n` lanes to the lower triangle of a matrix with rows of `width`.
    #[inline(always)]
    pub fn add_squares<S: Simd>(self, simd: S, n: usize, matrix: &mut [f64], width: usize) {
        for first in (0..n).step_by(TILE) {
            match n - first {
                1 => self.tile::<S, 1>(simd, first, matrix, width),
                2 => self.tile::<S, 2>(simd, first, matrix, width),
                3 => self.tile::<S, 3>(simd, first, matrix, width),
                4 => self.tile::<S, 4>(simd, first, matrix, width),
                5 => self.tile::<S, 5>(simd, first, matrix, width),
                6 => self.tile::<S, 6>(simd, first, matrix, width),
                7 => self.tile::<S, 7>(simd, first, matrix, width),
                _ => self.tile::<S, TILE>(simd, first, matrix, width),
            }
        }
    }

    /// The tiles of `T` rows of the matrix, from its left edge to the diagonal.
    #[inline(always)]
    fn tile<S: Simd, const T: usize>(self, simd: S, first: usize, matrix: &mut [f64], width: usize) {
        for lane in (0..first + T).step_by(S::F64_LANES) {
            let mut sums = [simd.splat_f64s(0.0); T];
            for t in 0..T {
                sums[t] = load::<S>(matrix, (first + t) * width + lane);
            }
            for k in 0..self.samples {
                let row = &self.rows[k * self.stride..];
                let s = load::<S>(row, lane);
                let factors = &row[first..first + T];
                for t in 0..T {
                    sums[t] = simd.mul_add_f64s(simd.splat_f64s(factors[t]), s, sums[t]);
                }
            }
            for t in 0..T {
                store::<S>(matrix, (first + t) * width + lane, sums[t]);
            }
        }
    }
}
