//! Noise of the inputs in the score of a window.
//!
//! Rates and accelerations drive the equations, so their white noise is integrated: the outputs go
//! along a random walk, which a fit takes for biases and scale errors. A sample of input `i` with the
//! noise n at the time t moves the state by B(t) h n, and an output at a later time by
//! C(k) Φ(k, 0) Φ(t, 0)⁻¹ B(t) h n, where C(k) Φ(k, 0) is the output's sensitivity to the initial
//! state. The score Σ Sᵀ R⁻¹ v so changes by g(t) n with
//!
//! g(t) = [Σ over k > t of S(k)ᵀ R⁻¹ C(k) Φ(k, 0)] Φ(t, 0)⁻¹ B(t) h,
//!
//! and has the covariance M = Σ over t of g Q gᵀ beside the H of the outputs' own noise. An estimate
//! H⁻¹ Sᵀ R⁻¹ v then has the covariance H⁻¹ (H + M) H⁻¹: its information is H (H + M)⁻¹ H.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, SMatrix, Vector3};

use super::equations::{Inputs, STATES, State, rate_slopes, rates};
use super::parameters::{INPUTS, KINDS, Kind, OUTPUTS, PARAMETERS, Parameters, place};
use super::reconstruction::{
    DRIVING, LOCAL, Local, ROW, Reconstructed, Row, input_values, reconstruct, shared_place,
};
use super::window::{Window, input_factor};
use super::window_sums::{ALL, WindowSums};
use crate::aircraft::Aircraft;
use crate::numerics::runge_kutta::{POINT, step};
use crate::numerics::symmetric;

/// Length of the blocks whose samples respond alike to the noise, s: short against the motion.
const BLOCK_S: f64 = 0.2;

/// Least information on a parameter, as a share of that of its ordinary size: keeps H + M positive
/// definite along directions that no output has.
const LEAST_INFORMATION: f64 = 1e-6;

/// A window with the parameters of its fit.
pub struct FittedWindow<'a> {
    pub window: &'a Window,
    pub aircraft: &'a Aircraft,
    /// Samples whose outputs are compared.
    pub compared: Range<usize>,
    pub local: &'a Local,
    pub shared: &'a Parameters,
}

/// Covariance of the score on the shared parameters from the noise of the inputs, the window's own
/// parameters eliminated. `weights` are 1/R of the outputs, and `information` is that of the outputs on
/// the shared parameters. `None` where the window cannot be integrated.
pub fn score_covariance(
    fitted: &FittedWindow,
    weights: [f64; OUTPUTS],
    sums: &WindowSums,
    information: &DMatrix<f64>,
) -> Option<DMatrix<f64>> {
    let FittedWindow {
        window,
        aircraft,
        local,
        shared,
        ..
    } = *fitted;
    let reconstructed = reconstruct(window, aircraft, local, shared)?;
    let blocks = block_products(fitted, &reconstructed, weights);
    let moves = moves_of_start(fitted)?;
    let mut scores = Vec::with_capacity(moves.len());
    let mut later = DMatrix::zeros(ALL, STATES);
    for (block, moves) in blocks.iter().zip(&moves).rev() {
        scores.push(sums.eliminated(&(&later + 0.5 * block))? * moves);
        later += block;
    }
    make_consistent(&mut scores, window, information);
    let zero = DMatrix::zeros(PARAMETERS, PARAMETERS);
    Some(
        scores
            .iter()
            .fold(zero, |sum, score| sum + score * score.transpose()),
    )
}

/// Adds to the scores of all blocks, from the last to the first, what they lack in the score of a bias: noise
/// that is constant is a bias b, whose score is H b. Otherwise combinations of scores on which the outputs
/// say next to nothing would seem to separate the two.
fn make_consistent(scores: &mut [DMatrix<f64>], window: &Window, information: &DMatrix<f64>) {
    let length = block_length(window);
    let samples = |block: usize| length.min(window.samples - block * length) as f64;
    let last = scores.len().saturating_sub(1);
    let roots: Vec<f64> = (0..scores.len())
        .map(|b| samples(last - b).sqrt())
        .collect();
    let of_bias = DMatrix::from_fn(PARAMETERS, INPUTS, |j, input| {
        let deviation = window.input_variances[input].sqrt();
        -input_factor(input).signum() * deviation * information[(j, place(input, Kind::Bias))]
    });
    let found = scores.iter().zip(&roots);
    let found = found.fold(DMatrix::zeros(PARAMETERS, INPUTS), |sum, (score, root)| {
        sum + score * *root
    });
    let lacking = (of_bias - found) / window.samples as f64;
    for (score, root) in scores.iter_mut().zip(&roots) {
        *score += &lacking * *root;
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

/// Sums of Sᵀ R⁻¹ C Φ block by block of samples: rows for the window's own and the shared parameters, a
/// column for each initial state. A node stands for the samples around it.
fn block_products(
    fitted: &FittedWindow,
    reconstructed: &Reconstructed,
    weights: [f64; OUTPUTS],
) -> Vec<DMatrix<f64>> {
    let window = fitted.window;
    let (length, spacing) = (block_length(window), reconstructed.samples_per_node);
    let mut blocks = vec![DMatrix::zeros(ALL, STATES); window.samples.div_ceil(length)];
    let nodes = reconstructed.rows.len();
    for sample in (0..nodes).map(|node| node * spacing) {
        let Some(block) = blocks.get_mut(sample / length) else {
            continue;
        };
        let around = sample.saturating_sub(spacing / 2)..sample + spacing - spacing / 2;
        for (output, weight) in weights.iter().enumerate() {
            let measured = |k: &usize| {
                let value = window.outputs[output].get(*k);
                fitted.compared.contains(k) && value.is_some_and(|v| v.is_finite())
            };
            let count = around.clone().filter(measured).count() as f64;
            if count > 0.0 {
                let row = row_at(fitted, reconstructed, sample, output);
                add_products(block, &row, output, count * weight);
            }
        }
    }
    blocks
}

/// Sensitivities of an output at a node's sample.
fn row_at(
    fitted: &FittedWindow,
    reconstructed: &Reconstructed,
    sample: usize,
    output: usize,
) -> Row {
    let readings = &reconstructed.readings;
    let gain = 1.0 + fitted.shared[place(INPUTS + output, Kind::Scale)];
    let mut row = reconstructed.rows[sample / reconstructed.samples_per_node][output];
    for slope in &mut row {
        *slope *= gain;
    }
    let last = readings.len() - 1;
    let (before, after) = (sample.saturating_sub(1).min(last), (sample + 1).min(last));
    let rise = readings[after][output] - readings[before][output];
    let rate = rise / ((after - before).max(1) as f64 * fitted.window.step_s);
    let own = [1.0, readings[sample.min(last)][output], -gain * rate];
    row[DRIVING..ROW].copy_from_slice(&own);
    row
}

/// Adds the products of a row with its slopes along the initial state.
fn add_products(block: &mut DMatrix<f64>, row: &Row, output: usize, weight: f64) {
    // Parameters of the states stand alike in a row and among all; those of the output do not.
    let own = LOCAL + shared_place(DRIVING, output);
    let columns = block.as_mut_slice().chunks_exact_mut(ALL);
    for (column, by_start) in columns.zip(&row[..STATES]) {
        let factor = weight * by_start;
        add_scaled(&mut column[..DRIVING], &row[..DRIVING], factor);
        add_scaled(&mut column[own..own + KINDS], &row[DRIVING..ROW], factor);
    }
}

fn add_scaled(sums: &mut [f64], values: &[f64], factor: f64) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// Moves of the initial state that act like one standard deviation of each input's noise, block by
/// block: Φ(t, 0)⁻¹ B(t) h σ √samples at the middle of a block.
fn moves_of_start(fitted: &FittedWindow) -> Option<Vec<DMatrix<f64>>> {
    let FittedWindow {
        window,
        local,
        shared,
        ..
    } = *fitted;
    let h = window.step_s;
    let length = block_length(window);
    let points = input_values(window, shared);
    let deviations: [f64; INPUTS] =
        std::array::from_fn(|i| input_factor(i).abs() * window.input_variances[i].sqrt());
    let mut x = State::from_column_slice(&local[..STATES]);
    let mut transition = SMatrix::<f64, STATES, STATES>::identity();
    let mut moves = Vec::with_capacity(window.samples.div_ceil(length));
    for k in 0..window.samples {
        let at = rate_slopes(&x, &points[2 * k], &window.terms[k]);
        let samples = length.min(window.samples - k / length * length);
        if k % length == samples / 2 {
            let mut by_noise = transition.try_inverse()? * at.by_input * h;
            for (mut column, deviation) in by_noise.column_iter_mut().zip(deviations) {
                column *= deviation * (samples as f64).sqrt();
            }
            moves.push(DMatrix::from_column_slice(
                STATES,
                INPUTS,
                by_noise.as_slice(),
            ));
        }
        let a = at.by_state * h;
        transition += (a + 0.5 * a * a) * transition;
        if k + 1 < window.samples {
            x = next_state(fitted, &points, k, &x);
        }
    }
    Some(moves)
}

/// State one sample after the sample k.
fn next_state(fitted: &FittedWindow, points: &[Inputs], k: usize, x: &State) -> State {
    let wind = Vector3::from_column_slice(&fitted.local[STATES..]);
    let slope = |stage: usize, x: &State| {
        let sample = k + usize::from(POINT[stage] == 2);
        let terms = &fitted.window.terms[sample];
        let mut slope = rates(x, &points[2 * k + POINT[stage]], terms);
        let against = terms.to_body * wind;
        slope
            .fixed_rows_mut::<3>(0)
            .zip_apply(&against, |rate, wind| *rate -= wind);
        slope
    };
    step(x, fitted.window.step_s, slope, |x, rate, h| x + rate * h)
}
