//! Linear response of a filter to errors of the instruments.
//!
//! An instrument in error changes the recorded inputs and outputs. Let f be the change of the
//! rates, y of the computed outputs and z of the measured outputs, at one sample. f and y are taken
//! at the filter's corrected state, with unchanged parameters and gain. The change s of the
//! predicted state and the change v of the innovations then obey
//!
//! ```text
//! v(k) = z(k) − y(k) − C s(k)
//! s(k+1) = Φ [T (s(k) + K v(k)) + Δt/2 f(k)] + Δt/2 f(k+1)
//! ```
//!
//! with the filter's own steps Φ, slopes C of the outputs, gain K and decay T. A pass of each error
//! would integrate the whole maneuver again, from inputs at twice as many points.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use std::collections::BTreeMap;
use std::marker::PhantomData;

use nalgebra::SMatrix;
use pulp::{Simd, WithSimd};

use super::gains::{Pattern, PatternGain};
use super::row_sinks::RecordedStep;
use super::signal_slopes::RatesAndOutputs;
use crate::dynamics::{Equations, InGusts, OUTPUTS};
use crate::numerics::linear_algebra::matrix::AlignedMatrix;
use crate::numerics::vectors::lanes::Lanes;
use crate::numerics::vectors::simd::{AlignedBuffer, VECTOR};
use crate::output_error::calibration_errors::{SignalChange, SignalError};

/// Number of errors that are propagated side by side, in the lanes of a vector.
pub(super) const ABREAST: usize = VECTOR;

/// One signal that some of the errors of a group change.
pub(super) struct SignalInError<'a, const NX: usize> {
    name: &'a str,
    /// Slopes of rates and outputs along the signal at the samples.
    slopes: &'a [RatesAndOutputs<NX>],
    /// Changes of the signal: sample by sample, error by error.
    changes: AlignedBuffer,
}

/// Signals that the errors of a group change.
pub(super) fn inputs_in_error<'a, const NX: usize>(
    slopes: &'a BTreeMap<String, Vec<RatesAndOutputs<NX>>>,
    errors: &'a [Vec<SignalChange>],
    samples: usize,
) -> Vec<SignalInError<'a, NX>> {
    let mut inputs: Vec<SignalInError<NX>> = vec![];
    for (error, changes) in errors.iter().enumerate() {
        for change in changes {
            let Some(slopes) = slopes.get(&change.signal) else {
                continue;
            };
            let known = inputs.iter().position(|own| own.name == change.signal);
            let place = known.unwrap_or(inputs.len());
            if known.is_none() {
                inputs.push(SignalInError {
                    name: &change.signal,
                    slopes,
                    changes: AlignedBuffer::zeros(ABREAST * samples),
                });
            }
            let rows = inputs[place].changes.slice_mut().chunks_exact_mut(ABREAST);
            for (row, value) in rows.zip(&change.samples) {
                row[error] = *value;
            }
        }
    }
    inputs
}

/// Errors of the measured outputs: output by output, error by error.
pub(super) struct OutputErrors {
    scales: AlignedBuffer,
    biases: AlignedBuffer,
}

impl OutputErrors {
    pub fn of<const NX: usize, E: Equations<NX>>(errors: &[SignalError]) -> OutputErrors {
        let outputs = E::AXIS.outputs();
        let zeros = || AlignedBuffer::zeros(ABREAST * OUTPUTS);
        let (mut scales, mut biases) = (zeros(), zeros());
        for (error, own) in errors.iter().enumerate() {
            if let Some(o) = outputs.iter().position(|o| o.signal() == own.signal) {
                scales.slice_mut()[o * ABREAST + error] = own.scale;
                biases.slice_mut()[o * ABREAST + error] = own.bias;
            }
        }
        OutputErrors { scales, biases }
    }
}

/// Linear response of a filter to a group of errors side by side.
pub(super) struct ErrorPropagation<'a, const NX: usize, E: InGusts<NX>> {
    pub steps: &'a [RecordedStep<NX>],
    pub gains: &'a [PatternGain<NX>],
    /// Patterns, and the pattern of each sample.
    pub patterns: (&'a [Pattern], &'a [u8]),
    pub decay: f64,
    pub half_step_s: f64,
    pub inputs: Vec<SignalInError<'a, NX>>,
    pub outputs: OutputErrors,
    /// Measured outputs at each sample.
    pub measured: &'a [[f64; OUTPUTS]],
    /// Changes of the whitened innovations: sample by sample, output by output a row; each error a
    /// column.
    pub white: &'a mut AlignedMatrix,
    /// Column of the first error.
    pub first: usize,
    pub equations: PhantomData<E>,
}

impl<const NX: usize, E: InGusts<NX>> ErrorPropagation<'_, NX, E> {
    /// Propagates the errors in the lanes of one vector, from a lane on.
    #[inline(always)]
    fn propagate<S: Simd>(&mut self, simd: S, lane: usize) {
        let (patterns, pattern_of) = self.patterns;
        let (zero, width) = (Lanes::zero(simd), self.white.width());
        let mut state = [zero; NX];
        for (k, step) in self.steps.iter().enumerate() {
            let pattern = usize::from(pattern_of[k]);
            let (used, gain) = (&patterns[pattern].used, &self.gains[pattern]);
            let (rates, outputs) = self.input_changes(simd, k, lane);
            if k > 0 {
                add_scaled(&mut state, self.half_step_s, &rates);
            }
            let predicted = times(&step.outputs, &state, zero);
            let mut innovations = [zero; OUTPUTS];
            for o in 0..OUTPUTS {
                if used[o] {
                    let row = o * ABREAST + lane;
                    let scale = Lanes::load(simd, self.outputs.scales.slice(), row);
                    let bias = Lanes::load(simd, self.outputs.biases.slice(), row);
                    let measured = scale * self.measured[k][o] + bias;
                    innovations[o] = measured - outputs[o] - predicted[o];
                }
            }
            let rows = &mut self.white.values_mut()[k * OUTPUTS * width..][..OUTPUTS * width];
            for o in 0..OUTPUTS {
                // L⁻¹ is a lower triangle.
                let mut white = zero;
                for p in 0..=o {
                    white = white.plus(gain.whitening[(o, p)], innovations[p]);
                }
                white.store(rows, o * width + self.first + lane);
            }
            add_scaled(&mut state, 1.0, &times(&gain.gain, &innovations, zero));
            for &(rate, relative) in E::AIR_RELATIVE_RATES {
                state[relative] = state[rate] + (state[relative] - state[rate]) * self.decay;
            }
            add_scaled(&mut state, self.half_step_s, &rates);
            state = times(&step.transition, &state, zero);
        }
    }

    /// Changes of rates and outputs at a sample.
    #[inline(always)]
    fn input_changes<S: Simd>(
        &self,
        simd: S,
        k: usize,
        lane: usize,
    ) -> ([Lanes<S>; NX], [Lanes<S>; OUTPUTS]) {
        let zero = Lanes::zero(simd);
        let (mut rates, mut outputs) = ([zero; NX], [zero; OUTPUTS]);
        for input in &self.inputs {
            let change = Lanes::load(simd, input.changes.slice(), k * ABREAST + lane);
            let slopes = &input.slopes[k];
            for i in 0..NX {
                rates[i] = rates[i].plus(slopes.rates[i], change);
            }
            for o in 0..OUTPUTS {
                outputs[o] = outputs[o].plus(slopes.outputs[o], change);
            }
        }
        (rates, outputs)
    }
}

impl<const NX: usize, E: InGusts<NX>> WithSimd for ErrorPropagation<'_, NX, E> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for lane in (0..ABREAST).step_by(S::F64_LANES) {
            self.propagate(simd, lane);
        }
    }
}

/// Product of a matrix and a vector of each error.
#[inline(always)]
fn times<S: Simd, const N: usize, const M: usize>(
    matrix: &SMatrix<f64, N, M>,
    vector: &[Lanes<S>; M],
    zero: Lanes<S>,
) -> [Lanes<S>; N] {
    let mut product = [zero; N];
    for j in 0..M {
        for i in 0..N {
            product[i] = product[i].plus(matrix[(i, j)], vector[j]);
        }
    }
    product
}

/// Adds a vector of each error times a factor.
#[inline(always)]
fn add_scaled<S: Simd, const N: usize>(
    sum: &mut [Lanes<S>; N],
    factor: f64,
    vector: &[Lanes<S>; N],
) {
    for i in 0..N {
        sum[i] = sum[i].plus(factor, vector[i]);
    }
}
