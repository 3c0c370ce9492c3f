//! Uncertainty of a window's parameters from the noise of its inputs.
//!
//! The rates and accelerations (the *inputs*) drive the equations of motion, so their white noise
//! is integrated. The reconstructed outputs then drift along a random walk. A fit over one short
//! window mistakes the drift for biases and scale errors. The information of the outputs alone
//! would give too small bounds.
//!
//! # Symbols
//!
//! t and k count samples of the window.
//!
//! | symbol | quantity | unit |
//! |---|---|---|
//! | h | time between samples | s |
//! | n(t), Q | noise of an input's sample, and its variance | the input's, squared |
//! | x(t) | state | ft/s, rad, ft |
//! | B(t) | slopes ∂ẋ/∂input | |
//! | Φ(t, 0) | slopes ∂x(t)/∂x(0) along the initial state | |
//! | C(k) | slopes of an output's reading along the state | |
//! | v(k), R | residual of an output, and the variance of its noise | the output's, squared |
//! | S(k) | slopes of the reading along the parameters | |
//! | score | Σ over k of S(k)ᵀ R⁻¹ v(k), the gradient of the log-likelihood | 1/parameter |
//! | H | information Σ Sᵀ R⁻¹ S: covariance of the score from the outputs' noise | |
//! | g(t) | change of the score per unit of n(t) | |
//! | M | covariance of the score from the inputs' noise | |
//!
//! # Covariance of the score
//!
//! The noise n(t) moves the state by B(t) h n(t) at once. At a later sample k it moves the reading by
//! C(k) Φ(k, 0) Φ(t, 0)⁻¹ B(t) h n(t). C(k) Φ(k, 0) is the sensitivity of the reading to the initial
//! state, which the reconstruction has. The score therefore changes by g(t) n(t) with
//!
//! g(t) = [Σ over k > t of S(k)ᵀ R⁻¹ C(k) Φ(k, 0)] Φ(t, 0)⁻¹ B(t) h.
//!
//! Noise at different times is independent, so the covariance is M = Σ over t of g(t) Q g(t)ᵀ.
//!
//! # Information
//!
//! An estimate is H⁻¹ times the score. The score has the covariance H + M, the estimate H⁻¹ (H + M)
//! H⁻¹, and the information on it is H (H + M)⁻¹ H.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use nalgebra::{DMatrix, DMatrixViewMut, DVector, Dyn, U1};

use super::equations::STATES;
use super::parameters::{INPUTS, Kind, OUTPUTS, PARAMETERS, Parameters, input_factor, place};
use super::reconstruction::{LOCAL, ROW, Row};
use super::window::Window;
use super::window_sums::{ALL, LinearisedWindow, ReducedInformation, add_row};
use crate::numerics::linear_algebra::symmetric;
use crate::numerics::vectors::simd::vectorised;

/// Length of the blocks of samples that share one g, s: short against the periods of an aircraft's
/// motion, 1 s and more.
const BLOCK_S: f64 = 0.2;

/// Information added to each parameter, as a share of one over the square of its ordinary size. It
/// keeps H + M positive definite for combinations of parameters that no output depends on.
const LEAST_INFORMATION: f64 = 1e-6;

/// Covariance M of the score on the parameters that all windows share, with the window's own
/// parameters eliminated. `weights` are 1/R of the outputs; `information` is H of the outputs' noise.
/// `None` if Φ is singular at some block, so that noise has no equivalent initial state.
pub fn score_covariance(
    window: &Window,
    linearised: &LinearisedWindow,
    weights: &[f64; OUTPUTS],
    information: &ReducedInformation,
) -> Option<DMatrix<f64>> {
    let moves = moves_of_start(window, linearised)?;
    let mut products = block_products(window, linearised, weights);
    sum_later(&mut products);
    let mut scores = DMatrix::zeros(ALL, INPUTS * moves.len());
    for (block, moves) in moves.iter().enumerate() {
        let by_start = products.columns(STATES * block, STATES);
        let mut own = scores.columns_mut(INPUTS * block, INPUTS);
        own.gemm(1.0, &by_start, moves, 0.0);
    }
    information.eliminate(&mut scores);
    let mut scores = scores.rows_mut(LOCAL, PARAMETERS);
    make_consistent(&mut scores, window, &information.shared);
    Some(&scores * scores.transpose())
}

/// Replaces the products of each block by their sum over all later samples: the later blocks, and the
/// second half of the block itself.
fn sum_later(products: &mut DMatrix<f64>) {
    let mut later = vec![0.0; ALL * STATES];
    let blocks = products.as_mut_slice().chunks_exact_mut(ALL * STATES);
    for block in blocks.rev() {
        for (product, later) in block.iter_mut().zip(&mut later) {
            let own = *product;
            *product = *later + 0.5 * own;
            *later += own;
        }
    }
}

/// Corrects the scores of all blocks so that their sum for constant noise is exactly the score H b of
/// a bias b. Blocks approximate the sum; without the correction, combinations of parameters with
/// almost no information would seem to separate noise from bias.
fn make_consistent(
    scores: &mut DMatrixViewMut<f64, U1, Dyn>,
    window: &Window,
    information: &DMatrix<f64>,
) {
    let length = block_length(window);
    let samples = |block: usize| length.min(window.samples - block * length) as f64;
    let mut lacking = DMatrix::from_fn(PARAMETERS, INPUTS, |j, input| {
        let deviation = window.input_variances[input].sqrt();
        -input_factor(input).signum() * deviation * information[(j, place(input, Kind::Bias))]
    });
    let blocks = 0..scores.ncols() / INPUTS;
    for block in blocks.clone() {
        lacking -= scores.columns(INPUTS * block, INPUTS) * samples(block).sqrt();
    }
    lacking /= window.samples as f64;
    for block in blocks {
        let mut own = scores.columns_mut(INPUTS * block, INPUTS);
        own += &lacking * samples(block).sqrt();
    }
}

/// Information H (H + M)⁻¹ H and gradient H (H + M)⁻¹ g of a window for information H and gradient g
/// of its outputs alone. `sizes` are ordinary sizes of the parameters.
pub fn with_input_noise(
    information: &DMatrix<f64>,
    gradient: &DVector<f64>,
    score_covariance: &DMatrix<f64>,
    sizes: &Parameters,
) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let mut total = information + score_covariance;
    for (j, size) in sizes.iter().enumerate() {
        total[(j, j)] += LEAST_INFORMATION / (size * size);
    }
    let gain = information * symmetric::inverse(&total)?;
    Some((&gain * information, gain * gradient))
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a small positive number"
)]
fn block_length(window: &Window) -> usize {
    (BLOCK_S / window.step_s).round().max(1.0) as usize
}

/// Sums of Sᵀ R⁻¹ C Φ over each block of samples, side by side. The rows are the window's
/// parameters and the shared ones, the columns the initial states. A node stands for the samples
/// around it.
fn block_products(
    window: &Window,
    linearised: &LinearisedWindow,
    weights: &[f64; OUTPUTS],
) -> DMatrix<f64> {
    let (length, spacing) = (block_length(window), window.samples_per_node());
    let mut products = DMatrix::zeros(ALL, STATES * window.samples.div_ceil(length));
    let sums = products.as_mut_slice();
    vectorised(
        #[inline(always)]
        || {
            for (node, rows) in linearised.sensitivities.rows.iter().enumerate() {
                let block = &mut sums[node * spacing / length * ALL * STATES..][..ALL * STATES];
                for (output, row) in rows.iter().enumerate() {
                    let count = linearised.counts[output][node];
                    if count > 0.0 {
                        add_products(block, row, output, count * weights[output]);
                    }
                }
            }
        },
    );
    products
}

/// Adds the products of a row with its slopes along the initial state.
#[inline(always)]
fn add_products(block: &mut [f64], row: &Row, output: usize, weight: f64) {
    for (column, by_start) in block.chunks_exact_mut(ALL).zip(&row[..STATES]) {
        add_row(column, &row[..ROW], output, weight * by_start);
    }
}

/// Changes of the initial state with the effect of a block's noise, for each block and input: Φ(t,
/// 0)⁻¹ B(t) h σ √N at the block's middle t. σ is the noise's standard deviation, N the number of
/// samples. `None` if Φ is singular.
fn moves_of_start(window: &Window, linearised: &LinearisedWindow) -> Option<Vec<DMatrix<f64>>> {
    let (length, spacing) = (block_length(window), window.samples_per_node());
    let slopes = &linearised.sensitivities;
    let moves = (0..window.samples.div_ceil(length)).map(|block| {
        let samples = length.min(window.samples - block * length);
        let middle = (block * length + samples / 2) / spacing;
        let by_start = slopes.transitions[middle].try_inverse()?;
        let mut by_noise = by_start * slopes.by_input[middle] * window.step_s;
        for (input, mut column) in by_noise.column_iter_mut().enumerate() {
            let deviation = input_factor(input).abs() * window.input_variances[input].sqrt();
            column *= deviation * (samples as f64).sqrt();
        }
        let by_noise = by_noise.as_slice();
        Some(DMatrix::from_column_slice(STATES, INPUTS, by_noise))
    });
    moves.collect()
}
