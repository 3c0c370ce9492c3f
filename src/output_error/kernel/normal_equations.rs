//! The sums of the normal equations, output by output: Σ s sᵀ, Σ s v, Σ s and Σ v² over the samples
//! that count. Weights come later, so that other weights need no other pass.
//!
//! Beside them the rows of a whole pass are added up over blocks of samples: what the corrected
//! bounds see the sensitivities through, so that they need no pass of their own.
//!
//! A coarse pass leaves out samples; its sums count the others as many times.
//!
//! The residual and a one stand beside the sensitivities in a sample's row, so all of it is one
//! symmetric matrix, updated by as many ranks as there are samples in a chunk: a tile of it stays
//! in the processor's registers while the samples run past, and only tiles that touch the lower
//! triangle are computed.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::{DMatrix, DVector};
use pulp::{Arch, Simd};

use super::pass::Sink;
use crate::dynamics::OUTPUTS;
use crate::numerics::row_products::{Meanwhile, Rows};
use crate::numerics::simd::Aligned;
use crate::output_error::case::Measurements;
use crate::output_error::case::blocks::Block;
use crate::output_error::case::chunking::CHUNK;
use crate::output_error::case::chunking::Spaced;
use crate::output_error::case::layout::Lanes;

/// The sums of all outputs of one case.
#[derive(Clone, Debug, Default)]
pub(crate) struct Normal {
    /// Of each output Σ over rows (s, v, 1) of their squares, row by row; the lower triangle
    /// counts.
    squares: [Aligned; OUTPUTS],
    /// Of each output Σ v (s, v, 1).
    moments: [Aligned; OUTPUTS],
    /// Samples that count.
    counts: [usize; OUTPUTS],
    /// The sums are of every so many samples.
    stride: usize,
    /// Rows (s, v, 1) added up over blocks of so many samples, block by block, output by output; of
    /// whole sums only.
    blocks: Aligned,
    block: usize,
    samples: usize,
    lanes: Lanes,
    /// Derivatives, which come before the biases among the parameters; initial states come after
    /// them.
    derivatives: usize,
    biased: Vec<usize>,
}

impl Normal {
    /// The sums of so many samples, seen through blocks of `block` of them.
    pub fn new(
        lanes: &Lanes,
        derivatives: usize,
        biased: &[usize],
        samples: usize,
        block: usize,
    ) -> Normal {
        let width = lanes.width();
        Normal {
            squares: std::array::from_fn(|_| Aligned::zeros(width * width)),
            moments: std::array::from_fn(|_| Aligned::zeros(width)),
            counts: [0; OUTPUTS],
            stride: 1,
            blocks: Aligned::default(),
            block: block.max(1),
            samples,
            lanes: lanes.clone(),
            derivatives,
            biased: biased.to_vec(),
        }
    }

    /// Begins anew, with every so many samples.
    pub fn clear(&mut self, stride: usize) {
        self.squares
            .iter_mut()
            .chain(&mut self.moments)
            .for_each(|sums| sums.slice_mut().fill(0.0));
        (self.counts, self.stride) = ([0; OUTPUTS], stride);
        let blocks = if stride == 1 {
            self.samples.div_ceil(self.block) * OUTPUTS * self.lanes.width()
        } else {
            0
        };
        if self.blocks.slice().len() == blocks {
            self.blocks.slice_mut().fill(0.0);
        } else if blocks > 0 {
            self.blocks = Aligned::zeros(blocks);
        }
    }

    /// Samples of a block; the last one may have fewer.
    pub fn block_samples(&self) -> usize {
        self.block
    }

    /// Writes the sensitivities of an output to all parameters, added up over a block's samples
    /// that count.
    pub fn block(&self, block: usize, output: usize, row: &mut [f64]) -> Block {
        let width = self.lanes.width();
        let Some(sums) = self
            .blocks
            .slice()
            .get((block * OUTPUTS + output) * width..)
            .filter(|_| self.whole())
        else {
            return Block {
                count: 0.0,
                residual: 0.0,
            };
        };
        let sums = &sums[..width];
        let (derivatives, initial) = self.lanes.places.split_at(self.derivatives);
        let (of_derivatives, others) = row.split_at_mut(self.derivatives);
        let (of_biases, of_initial) = others.split_at_mut(self.biased.len());
        of_derivatives
            .iter_mut()
            .zip(derivatives)
            .for_each(|(to, &lane)| *to = sums[lane]);
        of_initial
            .iter_mut()
            .zip(initial)
            .for_each(|(to, &lane)| *to = sums[lane]);
        let count = sums[self.lanes.one];
        let biases = of_biases.iter_mut().zip(&self.biased);
        biases.for_each(|(to, biased)| *to = if *biased == output { count } else { 0.0 });
        Block {
            count,
            residual: sums[self.lanes.residual],
        }
    }

    /// Whether the sums are of all samples.
    fn whole(&self) -> bool {
        self.stride == 1
    }

    /// Samples of an output that count.
    pub fn count(&self, output: usize) -> usize {
        self.stride * self.counts[output]
    }

    /// Σ v² of an output.
    pub fn square(&self, output: usize) -> f64 {
        self.stride as f64 * self.moments[output].slice()[self.lanes.residual]
    }

    fn at(&self, output: usize, i: usize, j: usize) -> f64 {
        self.stride as f64 * self.squares[output].slice()[i.max(j) * self.lanes.width() + i.min(j)]
    }

    /// The lane of each parameter; of a bias that of the ones, and the output where alone it is.
    fn parameters(&self) -> Vec<(usize, Option<usize>)> {
        let (derivatives, initial) = self.lanes.places.split_at(self.derivatives);
        let biases = self.biased.iter().map(|&o| (self.lanes.one, Some(o)));
        let whole = |places: &[usize]| places.iter().map(|&lane| (lane, None)).collect::<Vec<_>>();
        whole(derivatives)
            .into_iter()
            .chain(biases)
            .chain(whole(initial))
            .collect()
    }

    /// Σ_o w_o Σ s v of all parameters.
    pub fn gradient(&self, weights: &[f64; OUTPUTS]) -> DVector<f64> {
        let lanes = self.parameters();
        let of = |(lane, only): (usize, Option<usize>)| -> f64 {
            let outputs = (0..OUTPUTS).filter(|o| only.is_none_or(|only| only == *o));
            outputs
                .map(|o| self.stride as f64 * weights[o] * self.moments[o].slice()[lane])
                .sum()
        };
        DVector::from_iterator(lanes.len(), lanes.iter().map(|lane| of(*lane)))
    }

    /// Σ s sᵀ of one output, for all parameters.
    pub fn squares(&self, output: usize) -> DMatrix<f64> {
        let lanes = self.parameters();
        let mut whole = DMatrix::zeros(lanes.len(), lanes.len());
        for (column, &(j, second)) in lanes.iter().enumerate() {
            for (row, &(i, first)) in lanes.iter().enumerate().skip(column) {
                if [first, second].iter().flatten().all(|only| *only == output) {
                    whole[(row, column)] = self.at(output, i, j);
                }
            }
        }
        whole.fill_upper_triangle_with_lower_triangle();
        whole
    }

    /// Σ_o w_o Σ s sᵀ of all parameters.
    pub fn information(&self, weights: &[f64; OUTPUTS]) -> DMatrix<f64> {
        let width = self.lanes.width();
        let mut sum = vec![0.0; width * width];
        for (squares, w) in self.squares.iter().zip(weights) {
            let factor = w * self.stride as f64;
            Arch::new().dispatch(|| {
                sum.iter_mut()
                    .zip(squares.slice())
                    .for_each(|(sum, s)| *sum += factor * s)
            });
        }
        let lanes = self.parameters();
        let both = |(i, first): (usize, Option<usize>), (j, second): (usize, Option<usize>)| match (
            first, second,
        ) {
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
pub(crate) struct Summing<'a> {
    pub normal: &'a mut Normal,
    pub measurements: &'a Measurements,
}

impl Sink for Summing<'_> {
    #[inline(always)]
    fn take<S: Simd>(
        &mut self,
        simd: S,
        samples: Spaced,
        outputs: &[[f64; OUTPUTS]],
        rows: &mut [f64],
        meanwhile: &mut impl Meanwhile,
    ) {
        let Normal {
            squares,
            moments,
            counts,
            stride,
            lanes,
            blocks,
            block,
            ..
        } = &mut *self.normal;
        let width = lanes.width();
        for (k, y) in outputs.iter().enumerate() {
            for o in 0..OUTPUTS {
                let row = &mut rows[(k * OUTPUTS + o) * width..][..width];
                if self.measurements.used[samples.at(k)][o] {
                    row[lanes.residual] = self.measurements.values[samples.at(k)][o] - y[o];
                    row[lanes.one] = 1.0;
                    counts[o] += 1;
                } else {
                    row.fill(0.0);
                }
            }
        }
        if *stride == 1 {
            add_blocks(
                simd,
                samples.first,
                *block,
                rows,
                outputs.len(),
                blocks.slice_mut(),
            );
        }
        for o in 0..OUTPUTS {
            let all = Rows {
                values: &rows[o * width..],
                stride: OUTPUTS * width,
                samples: outputs.len(),
            };
            all.add_moments(simd, lanes.residual, moments[o].slice_mut());
            all.add_squares_beside(simd, &lanes.used, squares[o].slice_mut(), width, meanwhile);
        }
    }
}

/// Adds the rows of some samples, from `first` on, to those of their blocks.
#[inline(always)]
fn add_blocks<S: Simd>(
    simd: S,
    first: usize,
    block: usize,
    rows: &[f64],
    samples: usize,
    blocks: &mut [f64],
) {
    let row = rows.len() / CHUNK;
    let mut k = 0;
    while k < samples {
        let within = (first + k) / block;
        let next = ((within + 1) * block - first).min(samples);
        let sums = S::as_mut_simd_f64s(&mut blocks[within * row..][..row]).0;
        let lines = S::as_simd_f64s(&rows[k * row..next * row]).0;
        let vectors = sums.len();
        // There are as many vectors of each output: so many sums go on side by side.
        for (v, sums) in sums.chunks_exact_mut(OUTPUTS).enumerate() {
            let mut side = [simd.splat_f64s(0.0); OUTPUTS];
            side.copy_from_slice(sums);
            for n in 0..next - k {
                let line = &lines[n * vectors + v * OUTPUTS..][..OUTPUTS];
                for i in 0..OUTPUTS {
                    side[i] = simd.add_f64s(side[i], line[i]);
                }
            }
            sums.copy_from_slice(&side);
        }
        k = next;
    }
}
