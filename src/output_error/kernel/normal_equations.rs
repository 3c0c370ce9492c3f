//! Sums of the normal equations of each output. With sensitivities s and residual v they are Σ s
//! sᵀ, Σ s v, Σ s and Σ v² over the samples that count. Weights (1.4, 1.5) are applied afterwards,
//! so other weights need no other pass.
//!
//! A sample's row holds the sensitivities, the residual and a one, so all sums of an output are one
//! symmetric matrix. A coarse pass skips samples; its sums count the remaining ones as many times.
//! A whole pass also sums its rows over blocks of samples, from which the corrected bounds are
//! computed without another pass.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use std::array::from_fn;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use pulp::Simd;

use super::chunk_rows::ChunkRows;
use super::pass::Sink;
use crate::dynamics::OUTPUTS;
use crate::numerics::vectors::simd::{AlignedBuffer, vectorised};
use crate::output_error::case::Measurements;
use crate::output_error::case::blocks::BlockSums;
use crate::output_error::case::chunking::Strided;
use crate::output_error::case::layout::LaneLayout;

/// Sums of all outputs of one case.
#[derive(Clone, Debug, Default)]
pub(crate) struct NormalSums {
    /// Gram matrix of the rows (s, v, 1) of each output; the lower triangle counts.
    gram: [AlignedBuffer; OUTPUTS],
    /// Number of samples of each output that count.
    counts: [usize; OUTPUTS],
    /// Distance between the samples of the pass.
    stride: usize,
    /// Rows (s, v, 1) added up over blocks: block by block, output by output. Whole passes only.
    blocks: AlignedBuffer,
    samples_per_block: usize,
    samples: usize,
    layout: LaneLayout,
    /// Places of the parameters in order.
    places: Vec<ParameterPlace>,
}

/// Place of a parameter in the sums: its lane, and for a bias the only output that it shifts. All
/// biases share the lane of the ones.
#[derive(Clone, Copy, Debug)]
struct ParameterPlace {
    lane: usize,
    only_output: Option<usize>,
}

impl ParameterPlace {
    fn acts_on(self, output: usize) -> bool {
        self.only_output.is_none_or(|only| only == output)
    }
}

impl NormalSums {
    /// Sums over a number of samples, with blocks of `samples_per_block`.
    pub fn new(
        layout: &LaneLayout,
        derivatives: usize,
        biased_outputs: &[usize],
        samples: usize,
        samples_per_block: usize,
    ) -> NormalSums {
        let width = layout.width();
        NormalSums {
            gram: from_fn(|_| AlignedBuffer::zeros(width * width)),
            counts: [0; OUTPUTS],
            stride: 1,
            blocks: AlignedBuffer::default(),
            samples_per_block: samples_per_block.max(1),
            samples,
            layout: layout.clone(),
            places: parameter_places(layout, derivatives, biased_outputs),
        }
    }

    /// Prepares sums just made for a whole pass.
    pub fn with_blocks(mut self) -> NormalSums {
        self.blocks.clear_with_room(self.length_of_blocks());
        self
    }

    /// Clears the sums for a pass of this stride.
    pub fn clear(&mut self, stride: usize) {
        for gram in &mut self.gram {
            gram.slice_mut().fill(0.0);
        }
        (self.counts, self.stride) = ([0; OUTPUTS], stride);
        if stride == 1 {
            self.blocks.clear_with_room(self.length_of_blocks());
        }
    }

    fn length_of_blocks(&self) -> usize {
        self.samples.div_ceil(self.samples_per_block) * OUTPUTS * self.layout.width()
    }

    /// Number of samples in a block; the last one may have fewer.
    pub fn samples_per_block(&self) -> usize {
        self.samples_per_block
    }

    /// Writes the sensitivities of an output to the first parameters, as many as the row has room for,
    /// summed over a block's samples that count. Returns the other sums. All are zero after a coarse pass.
    pub fn block(&self, block: usize, output: usize, row: &mut [f64]) -> BlockSums {
        let width = self.layout.width();
        let first = (block * OUTPUTS + output) * width;
        let sums = self.blocks.slice().get(first..first + width);
        let Some(sums) = sums.filter(|_| self.stride == 1) else {
            return BlockSums {
                count: 0.0,
                residual: 0.0,
            };
        };
        for (to, place) in row.iter_mut().zip(&self.places) {
            *to = if place.acts_on(output) {
                sums[place.lane]
            } else {
                0.0
            };
        }
        BlockSums {
            count: sums[self.layout.one_lane],
            residual: sums[self.layout.residual_lane],
        }
    }

    /// Number of samples of an output that count.
    pub fn count(&self, output: usize) -> usize {
        self.stride * self.counts[output]
    }

    /// Sum Σ v² of an output.
    pub fn square(&self, output: usize) -> f64 {
        let lane = self.layout.residual_lane;
        self.gram_entry(output, lane, lane)
    }

    /// Gradient Σ_o w_o Σ s v over the outputs o with weights w_o, for all parameters.
    pub fn gradient(&self, weights: &[f64; OUTPUTS]) -> DVector<f64> {
        let residual = self.layout.residual_lane;
        let sum_of = |place: &ParameterPlace| -> f64 {
            (0..OUTPUTS)
                .filter(|o| place.acts_on(*o))
                .map(|o| self.stride as f64 * weights[o] * self.sum(o, place.lane, residual))
                .sum()
        };
        let sums: Vec<f64> = self.places.iter().map(sum_of).collect();
        DVector::from_vec(sums)
    }

    /// Sum Σ s sᵀ of one output, for all parameters.
    pub fn squares(&self, output: usize) -> DMatrix<f64> {
        self.symmetric_by_parameter(|a, b| {
            if a.acts_on(output) && b.acts_on(output) {
                self.gram_entry(output, a.lane, b.lane)
            } else {
                0.0
            }
        })
    }

    /// Information Σ_o w_o Σ s sᵀ over the outputs o with weights w_o, for all parameters.
    pub fn information(&self, weights: &[f64; OUTPUTS]) -> DMatrix<f64> {
        let width = self.layout.width();
        let mut sum = vec![0.0; width * width];
        for (gram, w) in self.gram.iter().zip(weights) {
            let factor = w * self.stride as f64;
            vectorised(
                #[inline(always)]
                || {
                    sum.iter_mut()
                        .zip(gram.slice())
                        .for_each(|(sum, s)| *sum += factor * s);
                },
            );
        }
        self.symmetric_by_parameter(|a, b| match (a.only_output, b.only_output) {
            (None, None) => sum[a.lane.max(b.lane) * width + a.lane.min(b.lane)],
            (Some(o), Some(other)) if o != other => 0.0,
            (Some(o), _) | (_, Some(o)) => weights[o] * self.gram_entry(o, a.lane, b.lane),
        })
    }

    /// Sum of the products of two lanes over all samples.
    fn gram_entry(&self, output: usize, i: usize, j: usize) -> f64 {
        self.stride as f64 * self.sum(output, i, j)
    }

    /// Sum of the products of two lanes over the samples of the pass.
    fn sum(&self, output: usize, i: usize, j: usize) -> f64 {
        self.gram[output].slice()[i.max(j) * self.layout.width() + i.min(j)]
    }

    /// Symmetric matrix of the parameters from its entries.
    fn symmetric_by_parameter(
        &self,
        entry: impl Fn(ParameterPlace, ParameterPlace) -> f64,
    ) -> DMatrix<f64> {
        let places = &self.places;
        let mut whole = DMatrix::zeros(places.len(), places.len());
        for (column, &b) in places.iter().enumerate() {
            for (row, &a) in places.iter().enumerate().skip(column) {
                whole[(row, column)] = entry(a, b);
            }
        }
        whole.fill_upper_triangle_with_lower_triangle();
        whole
    }
}

/// Places of the parameters in order: derivatives, biases, initial states.
fn parameter_places(
    layout: &LaneLayout,
    derivatives: usize,
    biased_outputs: &[usize],
) -> Vec<ParameterPlace> {
    let of_lane = |lane: &usize| ParameterPlace {
        lane: *lane,
        only_output: None,
    };
    let of_bias = |output: &usize| ParameterPlace {
        lane: layout.one_lane,
        only_output: Some(*output),
    };
    let (derivatives, initial_states) = layout.parameter_lanes.split_at(derivatives);
    let first = derivatives.iter().map(of_lane);
    let then = biased_outputs.iter().map(of_bias);
    first
        .chain(then)
        .chain(initial_states.iter().map(of_lane))
        .collect()
}

/// Sink that adds the rows of a pass to the sums.
pub(crate) struct NormalAccumulator<'a> {
    pub sums: &'a mut NormalSums,
    pub measurements: &'a Measurements,
}

impl Sink for NormalAccumulator<'_> {
    #[inline(always)]
    fn take<S: Simd>(
        &mut self,
        simd: S,
        samples: Strided,
        outputs: &[[f64; OUTPUTS]],
        mut rows: ChunkRows,
    ) {
        let Measurements { values, used } = self.measurements;
        let residuals = |k: usize| {
            let sample = samples.index(k);
            let mut residuals = values[sample];
            for o in 0..OUTPUTS {
                residuals[o] -= outputs[k][o];
            }
            (residuals, &used[sample])
        };
        let count = outputs.len();
        self.sums.complete_rows(count, &mut rows, residuals);
        self.sums.add_rows(simd, samples.first, count, &rows);
    }
}

impl NormalSums {
    /// Writes the residual and the number 1 into their lanes of every row that counts, and clears
    /// all other rows. `residuals` returns the residuals of a sample's outputs, and the outputs that
    /// count.
    #[inline(always)]
    pub fn complete_rows<'u>(
        &mut self,
        samples: usize,
        rows: &mut ChunkRows,
        residuals: impl Fn(usize) -> ([f64; OUTPUTS], &'u [bool; OUTPUTS]),
    ) {
        let NormalSums { counts, layout, .. } = self;
        let (residual_lane, one_lane) = (layout.residual_lane, layout.one_lane);
        for k in 0..samples {
            let (residuals, used) = residuals(k);
            for o in 0..OUTPUTS {
                if used[o] {
                    rows.set(k, o, residual_lane, residuals[o]);
                    rows.set(k, o, one_lane, 1.0);
                    counts[o] += 1;
                } else {
                    rows.clear(k, o);
                }
            }
        }
    }

    /// Adds the complete rows of a chunk, which begins at the sample `first`.
    #[inline(always)]
    pub fn add_rows<S: Simd>(&mut self, simd: S, first: usize, samples: usize, rows: &ChunkRows) {
        let NormalSums {
            gram,
            stride,
            layout,
            blocks,
            samples_per_block,
            ..
        } = self;
        let width = layout.width();
        if *stride == 1 {
            let samples = first..first + samples;
            add_to_blocks(simd, samples, *samples_per_block, rows, width, blocks);
        }
        for (o, gram) in gram.iter_mut().enumerate() {
            let rows = rows.of_output(o, samples);
            rows.add_gram(simd, &layout.lanes_used, gram.slice_mut(), width);
        }
    }
}

/// Adds the rows of a chunk of samples to the rows of their blocks, of `width` lanes. The first sample
/// of a block appends its rows.
#[inline(always)]
fn add_to_blocks<S: Simd>(
    simd: S,
    samples: Range<usize>,
    samples_per_block: usize,
    rows: &ChunkRows,
    width: usize,
    blocks: &mut AlignedBuffer,
) {
    let length = OUTPUTS * width;
    let mut sample = samples.start;
    while sample < samples.end {
        let block = sample / samples_per_block;
        let next = ((block + 1) * samples_per_block).min(samples.end);
        if blocks.slice().len() <= block * length {
            blocks.append_zeros(length);
        }
        let sums = &mut blocks.slice_mut()[block * length..][..length];
        rows.add_to(simd, sample - samples.start..next - samples.start, sums);
        sample = next;
    }
}
