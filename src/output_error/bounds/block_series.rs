//! Residuals and sensitivities of one output in blocks of samples.
//!
//! Noise slower than a block is an autoregressive process of the blocks' means, with few coefficients
//! even where it is far slower. Noise faster than a block is white within the blocks. Parameters act
//! slower than a block, so a slow component counts even if it is small beside the sensors' white
//! noise.

use std::ops::Range;

use nalgebra::DMatrix;

use super::autoregression::{Autoregression, HIGHEST_ORDER};
use super::residual_means::ResidualMeans;
use crate::numerics::linear_algebra::matrix::{AlignedMatrix, LONGEST_LAG};
use crate::output_error::case::blocks::{BlockSums, samples_per_block};

const _: () = assert!(HIGHEST_ORDER <= LONGEST_LAG);

/// One output of one maneuver in blocks of samples.
#[derive(Clone, Debug)]
pub struct BlockSeries {
    /// Weight of a sample in the cost.
    pub(super) weight: f64,
    /// Mean residual of each block.
    pub(super) means: ResidualMeans,
    /// Variance of the samples about their block's mean.
    pub(super) fast_variance: f64,
    pub(super) fast_degrees_of_freedom: f64,
    /// Summed sensitivities of each block.
    pub(crate) sensitivities: AlignedMatrix,
    /// Sum Σ s sᵀ over the blocks, with s the summed sensitivities of a block.
    pub(super) between: AlignedMatrix,
    /// Sum Σ s sᵀ over the samples, with s the sensitivities less the mean of their block.
    pub(super) within: AlignedMatrix,
}

impl BlockSeries {
    /// Divides one output's `samples` into blocks. `sums_of` returns a block's sums and writes its
    /// summed sensitivities to a row. `square` is Σ v² and `squares` is Σ s sᵀ over all samples
    /// that count, with residuals v and sensitivities s.
    #[must_use]
    pub fn new(
        step_s: f64,
        weight: f64,
        samples: usize,
        square: f64,
        squares: &DMatrix<f64>,
        mut sums_of: impl FnMut(Range<usize>, &mut [f64]) -> BlockSums,
    ) -> BlockSeries {
        let (length, parameters) = (samples_per_block(step_s), squares.nrows());
        let blocks = samples.div_ceil(length);
        let mut sensitivities = AlignedMatrix::zeros(blocks, parameters);
        let mut means = ResidualMeans::with_room(length, blocks);
        let (mut square, mut degrees_of_freedom) = (square, 0.0);
        // Sensitivities of incomplete blocks, scaled to the excess of their means' squares.
        let mut excess = Vec::new();
        for (k, row) in sensitivities.rows_mut().enumerate() {
            let within = k * length..samples.min((k + 1) * length);
            let sums = sums_of(within, row);
            let (count, mean) = (sums.count, means.push(sums));
            square -= sums.residual * mean;
            degrees_of_freedom += (count - 1.0).max(0.0);
            if count > 0.0 && count < means.length {
                let factor = (1.0 / count - 1.0 / means.length).sqrt();
                excess.extend(row.iter().map(|s| factor * s));
            }
        }
        let between = sensitivities.gram();
        let mut within = AlignedMatrix::from_symmetric(squares);
        within.add_scaled(&between, -1.0 / means.length);
        if !excess.is_empty() {
            let excess = AlignedMatrix::from_padded_rows(&excess, parameters);
            within.add_scaled(&excess.gram(), -1.0);
        }
        let fast_degrees_of_freedom = f64::max(degrees_of_freedom, 1.0);
        BlockSeries {
            weight,
            means,
            fast_variance: square.max(0.0) / fast_degrees_of_freedom,
            fast_degrees_of_freedom,
            sensitivities,
            between,
            within,
        }
    }

    /// Series over `parameters` parameters: the sensitivity to parameter `j` of this series moves
    /// to column `places[j]`, and the other columns are zero.
    #[must_use]
    pub fn with_parameters(&self, places: &[usize], parameters: usize) -> BlockSeries {
        let mut sensitivities = AlignedMatrix::zeros(self.means.blocks(), parameters);
        let rows = self.sensitivities.rows().zip(sensitivities.rows_mut());
        for (row, wide) in rows {
            widen_row(row, places, wide);
        }
        BlockSeries {
            weight: self.weight,
            means: self.means.clone(),
            fast_variance: self.fast_variance,
            fast_degrees_of_freedom: self.fast_degrees_of_freedom,
            sensitivities,
            between: widen_square(&self.between, places, parameters),
            within: widen_square(&self.within, places, parameters),
        }
    }

    /// Filters rows of the blocks by a process, until the filter has decayed.
    pub(super) fn filtered(&self, rows: &AlignedMatrix, process: &Autoregression) -> AlignedMatrix {
        let mut filtered = rows.with_zero_rows(process.memory(self.means.blocks()));
        filtered.filter_columns(&process.coefficients);
        filtered
    }

    /// Multiplies the autocovariance R of a process with unit innovation by rows that the process
    /// has already filtered once.
    pub(super) fn times_autocovariance(
        &self,
        mut filtered: AlignedMatrix,
        process: &Autoregression,
    ) -> AlignedMatrix {
        filtered.filter_columns_backwards(&process.coefficients);
        filtered.truncate(self.means.blocks());
        for (row, count) in filtered.rows_mut().zip(&self.means.counts) {
            if *count <= 0.0 {
                row.fill(0.0);
            }
        }
        filtered
    }
}

fn widen_row(row: &[f64], places: &[usize], wide: &mut [f64]) {
    for (&place, s) in places.iter().zip(row) {
        wide[place] = *s;
    }
}

fn widen_square(square: &AlignedMatrix, places: &[usize], parameters: usize) -> AlignedMatrix {
    let mut wide = AlignedMatrix::zeros(parameters, parameters);
    let width = wide.width();
    for (row, &place) in square.rows().zip(places) {
        widen_row(
            row,
            places,
            &mut wide.values_mut()[place * width..][..width],
        );
    }
    wide
}
