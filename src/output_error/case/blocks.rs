//! Blocks of samples, through which the bounds read residuals and sensitivities.

/// Length of a block, s: the short period and the test inputs are several times longer.
const BLOCK_S: f64 = 0.2;

/// Sums over the samples of a block that count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockSums {
    /// Number of samples.
    pub count: f64,
    /// Sum of their residuals.
    pub residual: f64,
}

/// Number of samples in a block; the last block of a maneuver may have fewer.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a small positive number"
)]
pub(crate) fn samples_per_block(step_s: f64) -> usize {
    (BLOCK_S / step_s).round().max(1.0) as usize
}
