//! Corrections of states and sensitivities by the measurements, between two steps.
//!
//! Let s and y be the sensitivities of the predicted state and outputs to one parameter. Let v be
//! the innovations, and d a slope along the parameter. The corrected state x̃ then has, after the
//! decay T of the rotary gusts, the sensitivity T (s − K y + dK v) + dT x̃. K y has a minus sign
//! because an innovation falls as its prediction rises. The sums receive L⁻¹ y and L⁻¹ v. With S =
//! L Lᵀ the covariance of the innovations, L⁻¹ v is white with unit variance.
#![expect(
    clippy::inline_always,
    reason = "compiled into one loop for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use std::marker::PhantomData;

use nalgebra::SVector;
use pulp::Simd;

use super::gains::{Pattern, PatternGain};
use crate::dynamics::{InGusts, OUTPUTS};
use crate::numerics::vectors::simd::{AlignedBuffer, VECTOR};
use crate::output_error::case::chunking::CHUNK;
use crate::output_error::case::layout::LaneLayout;
use crate::output_error::kernel::propagation::MeasurementUpdate;
use crate::output_error::kernel::trajectory::set_factors;

/// Rows of numbers in the lanes of the parameters. They are stored vector by vector, and for each
/// of the widest vectors row by row.
pub(super) struct LaneBlocks {
    values: AlignedBuffer,
    rows: usize,
}

impl LaneBlocks {
    pub fn zeros(rows: usize, width: usize) -> Self {
        LaneBlocks {
            values: AlignedBuffer::zeros(rows * width),
            rows,
        }
    }

    pub fn set(&mut self, row: usize, lane: usize, value: f64) {
        let block = lane / VECTOR * self.rows;
        self.values.slice_mut()[(block + row) * VECTOR + lane % VECTOR] = value;
    }

    /// Rows of the vector at a lane, every [`step_of_rows`] vectors.
    #[inline(always)]
    fn at_lane<S: Simd>(&self, lane: usize) -> &[S::f64s] {
        let length = self.rows * VECTOR;
        let block = &self.values.slice()[lane / VECTOR * length..][..length];
        &S::as_simd_f64s(block).0[lane % VECTOR / S::F64_LANES..]
    }
}

/// Distance between the rows of a block, in vectors.
#[inline(always)]
const fn step_of_rows<S: Simd>() -> usize {
    VECTOR / S::F64_LANES
}

/// Slopes of the gains in the lanes of the parameters: pattern by pattern, state by state, output by
/// output.
pub(super) fn gain_slopes<const NX: usize>(
    gains: &[PatternGain<NX>],
    layout: &LaneLayout,
) -> LaneBlocks {
    let mut slopes = LaneBlocks::zeros(gains.len() * NX * OUTPUTS, layout.width());
    for (pattern, gain) in gains.iter().enumerate() {
        for slope in &gain.slopes {
            let lane = layout.parameter_lanes[slope.parameter];
            for i in 0..NX {
                for o in 0..OUTPUTS {
                    let row = (pattern * NX + i) * OUTPUTS + o;
                    slopes.set(row, lane, slope.gain[(i, o)]);
                }
            }
        }
    }
    slopes
}

/// Values of a pass that do not change within it.
pub(super) struct MeasurementUpdates<'a, const NX: usize> {
    /// Gain of each pattern.
    pub gains: &'a [PatternGain<NX>],
    pub gain_slopes: LaneBlocks,
    pub patterns: &'a [Pattern],
    /// Pattern of each sample.
    pub pattern_of: &'a [u8],
    pub biases: [f64; OUTPUTS],
    /// Lanes of the biases: output by output, one where a bias shifts the output.
    pub bias_rows: LaneBlocks,
    /// Share of a rotary gust that remains after a step, and its slope in each lane.
    pub decay: f64,
    pub decay_row: LaneBlocks,
}

/// Measurement updates at the samples of one chunk.
pub(super) struct ChunkUpdates<'a, const NX: usize, E> {
    updates: &'a MeasurementUpdates<'a, NX>,
    /// Slots of products of a state: (slot, state).
    products: &'a [(usize, usize)],
    /// Factors of the first vector's regressors at the predicted states.
    factors: [[f64; VECTOR]; CHUNK],
    pub innovations: [[f64; OUTPUTS]; CHUNK],
    pub patterns: [u8; CHUNK],
    /// Rotary gusts of the corrected states.
    gusts: [[f64; NX]; CHUNK],
    equations: PhantomData<E>,
}

/// Rows of the measurement updates in some vectors of lanes.
pub(super) struct UpdateLanes<'l, S: Simd, const N: usize> {
    gain_slopes: [&'l [S::f64s]; N],
    biases: [&'l [S::f64s]; N],
    decay_slopes: [&'l [S::f64s]; N],
}

impl<const NX: usize, E: InGusts<NX>> MeasurementUpdate<NX> for &ChunkUpdates<'_, NX, E> {
    type Lanes<'l, S: Simd, const N: usize>
        = UpdateLanes<'l, S, N>
    where
        Self: 'l;

    #[inline(always)]
    fn in_lanes<S: Simd, const N: usize>(&self, lanes: [usize; N]) -> UpdateLanes<'_, S, N> {
        let updates = self.updates;
        let mut found = UpdateLanes {
            gain_slopes: [&[][..]; N],
            biases: [&[][..]; N],
            decay_slopes: [&[][..]; N],
        };
        for n in 0..N {
            found.gain_slopes[n] = updates.gain_slopes.at_lane::<S>(lanes[n]);
            found.biases[n] = updates.bias_rows.at_lane::<S>(lanes[n]);
            found.decay_slopes[n] = updates.decay_row.at_lane::<S>(lanes[n]);
        }
        found
    }

    #[inline(always)]
    fn output_factors(&self, k: usize) -> Option<&[f64; VECTOR]> {
        Some(&self.factors[k])
    }

    #[inline(always)]
    fn correct<S: Simd, const N: usize>(
        &self,
        simd: S,
        k: usize,
        lanes: &UpdateLanes<'_, S, N>,
        s: &mut [[S::f64s; NX]; N],
        y: &mut [[S::f64s; OUTPUTS]; N],
    ) {
        let updates = self.updates;
        let (pattern, step) = (usize::from(self.patterns[k]), step_of_rows::<S>());
        let gain = &updates.gains[pattern];
        let rows = NX * OUTPUTS;
        let mut slopes = lanes.gain_slopes;
        for n in 0..N {
            slopes[n] = &slopes[n][pattern * rows * step..][..=(rows - 1) * step];
            let biases = &lanes.biases[n][..=(OUTPUTS - 1) * step];
            for o in 0..OUTPUTS {
                y[n][o] = simd.add_f64s(y[n][o], biases[o * step]);
            }
        }
        for o in 0..OUTPUTS {
            let v = simd.splat_f64s(self.innovations[k][o]);
            // Sensitivities of the innovation.
            let mut innovation = [v; N];
            for n in 0..N {
                innovation[n] = simd.neg_f64s(y[n][o]);
            }
            for i in 0..NX {
                let gain = simd.splat_f64s(gain.gain[(i, o)]);
                for n in 0..N {
                    s[n][i] = simd.mul_add_f64s(slopes[n][(i * OUTPUTS + o) * step], v, s[n][i]);
                    s[n][i] = simd.mul_add_f64s(gain, innovation[n], s[n][i]);
                }
            }
        }
        let decay = simd.splat_f64s(updates.decay);
        for n in 0..N {
            let decay_slope = lanes.decay_slopes[n][0];
            for &(rate, relative) in E::AIR_RELATIVE_RATES {
                let gust = simd.sub_f64s(s[n][relative], s[n][rate]);
                s[n][relative] = simd.mul_add_f64s(decay, gust, s[n][rate]);
                let gust = simd.splat_f64s(self.gusts[k][relative]);
                s[n][relative] = simd.mul_add_f64s(decay_slope, gust, s[n][relative]);
            }
        }
        // From the last output on, as the first ones are read till the end.
        for o in (0..OUTPUTS).rev() {
            let mut white = [simd.splat_f64s(0.0); N];
            for p in 0..=o {
                let factor = simd.splat_f64s(gain.whitening[(o, p)]);
                for n in 0..N {
                    white[n] = simd.mul_add_f64s(factor, y[n][p], white[n]);
                }
            }
            for n in 0..N {
                y[n][o] = white[n];
            }
        }
    }
}

impl<'a, const NX: usize, E: InGusts<NX>> ChunkUpdates<'a, NX, E> {
    pub fn new(updates: &'a MeasurementUpdates<'a, NX>, layout: &'a LaneLayout) -> Self {
        ChunkUpdates {
            updates,
            products: &layout.products,
            factors: [[1.0; VECTOR]; CHUNK],
            innovations: [[0.0; OUTPUTS]; CHUNK],
            patterns: [0; CHUNK],
            gusts: [[0.0; NX]; CHUNK],
            equations: PhantomData,
        }
    }

    /// Corrects the predicted state of a sample with the outputs `y`, and returns it with its
    /// whitened innovation.
    #[inline(always)]
    pub fn correct_state(
        &mut self,
        sample: usize,
        k: usize,
        x: &SVector<f64, NX>,
        y: &[f64; OUTPUTS],
        measured: &[f64; OUTPUTS],
    ) -> (SVector<f64, NX>, [f64; OUTPUTS]) {
        set_factors::<NX, E>(&mut self.factors[k], x, self.products);
        let pattern = self.updates.pattern_of[sample];
        let used = &self.updates.patterns[usize::from(pattern)].used;
        let gain = &self.updates.gains[usize::from(pattern)];
        let (mut corrected, mut white) = (*x, [0.0; OUTPUTS]);
        for o in 0..OUTPUTS {
            let v = if used[o] { measured[o] - y[o] } else { 0.0 };
            self.innovations[k][o] = v;
            for i in 0..NX {
                corrected[i] = gain.gain[(i, o)].mul_add(v, corrected[i]);
            }
            for p in 0..=o {
                white[o] = gain.whitening[(o, p)].mul_add(self.innovations[k][p], white[o]);
            }
        }
        self.patterns[k] = pattern;
        for &(rate, relative) in E::AIR_RELATIVE_RATES {
            self.gusts[k][relative] = corrected[relative] - corrected[rate];
        }
        (E::decayed(corrected, self.updates.decay), white)
    }
}
