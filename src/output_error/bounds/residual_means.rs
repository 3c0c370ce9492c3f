//! Means of one output's residuals over blocks of samples.

use super::autoregression::HIGHEST_ORDER;
use crate::numerics::series::lagged_products::{MOST_LAGS, lagged_products};
use crate::output_error::case::blocks::BlockSums;

const _: () = assert!(HIGHEST_ORDER < MOST_LAGS);

/// Least number of blocks per coefficient of a process.
const BLOCKS_PER_COEFFICIENT: usize = 10;

/// Means of one output's residuals over the blocks of a maneuver.
#[derive(Clone, Debug)]
pub(super) struct ResidualMeans {
    /// Number of samples in a whole block.
    pub length: f64,
    /// Number of samples that count in each block.
    pub counts: Vec<f64>,
    /// Mean residual of each block.
    means: Vec<f64>,
}

impl ResidualMeans {
    /// No blocks yet, with room for as many `blocks` of `length` samples each.
    pub fn with_room(length: usize, blocks: usize) -> ResidualMeans {
        ResidualMeans {
            length: length as f64,
            counts: Vec::with_capacity(blocks),
            means: Vec::with_capacity(blocks),
        }
    }

    /// Appends a block and returns its mean.
    pub fn push(&mut self, BlockSums { count, residual }: BlockSums) -> f64 {
        let mean = residual / count.max(1.0);
        self.counts.push(count);
        self.means.push(mean);
        mean
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.counts.len()
    }

    /// Number of lags of the autocovariances, lag 0 included.
    pub fn lags(&self) -> usize {
        1 + HIGHEST_ORDER.min(self.blocks() / BLOCKS_PER_COEFFICIENT)
    }

    /// Number of pairs of blocks that count, at lags 0, 1, …, at least one.
    pub fn pairs(&self) -> Vec<f64> {
        let used: Vec<f64> = self.counts.iter().map(|count| count.min(1.0)).collect();
        let pairs = lagged_products(&used, self.lags());
        pairs.iter().map(|pairs| pairs.max(1.0)).collect()
    }

    /// Autocovariances of the means at lags 0, 1, …
    pub fn autocovariances(&self, pairs: &[f64]) -> Vec<f64> {
        let sums = lagged_products(&self.means, self.lags());
        sums.iter()
            .zip(pairs)
            .map(|(sum, pairs)| sum / pairs)
            .collect()
    }
}
