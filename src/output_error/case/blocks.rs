//! Blocks of samples through which the bounds see residuals and sensitivities.

/// Length of a block, s: the short period and the test inputs are several times longer.
const BLOCK_S: f64 = 0.2;

/// What the samples of a block that count add up to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// How many they are.
    pub count: f64,
    /// Sum of their residuals.
    pub residual: f64,
}

/// Samples of a block.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a small positive number"
)]
pub(crate) fn samples_of_block(step_s: f64) -> usize {
    (BLOCK_S / step_s).round().max(1.0) as usize
}
