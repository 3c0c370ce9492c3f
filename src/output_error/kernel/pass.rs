//! One pass over a maneuver: the states, and the sensitivities of all parameters beside them.
//!
//! A pass goes chunk by chunk. The [`Trajectory`] integrates the states and records the slopes of
//! each stage. [`ChunkSensitivities::propagate`] then takes the sensitivities of all parameters
//! through the recorded steps.
//!
//! The loops are compiled for several widths of vectors and chosen when the program runs. Each lane
//! is computed alike in all of them, with fused multiplication, so every width gives the same bits.
#![expect(
    clippy::inline_always,
    reason = "compiled into one loop for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::SVector;
use pulp::{Arch, Simd, WithSimd};

use super::chunk_build_up::ChunkBuildUp;
use super::chunk_rows::ChunkRows;
use super::propagation::{ChunkSensitivities, NoUpdate};
use super::propagators::Propagators;
use super::trajectory::{StageHistory, Trajectory, is_out_of_bounds};
use crate::dynamics::{Equations, OUTPUTS};
use crate::numerics::vectors::simd::AlignedBuffer;
use crate::output_error::case::build_up::ValuedTerm;
use crate::output_error::case::chunking::{CHUNK, Strided, WIDEST_STRIDE};
use crate::output_error::case::layout::LaneLayout;
use crate::output_error::case::{Case, InitialState};

/// End of an integration whose state left its bounds: no flight has these parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Diverged {
    pub sample: usize,
}

/// Consumer of the outputs' sensitivities.
pub(crate) trait Sink {
    /// Takes the outputs of some samples and their sensitivities. The sink may overwrite the rows.
    fn take<S: Simd>(
        &mut self,
        simd: S,
        samples: Strided,
        outputs: &[[f64; OUTPUTS]],
        rows: ChunkRows,
    );
}

/// One pass, ready to be run with the vectors of some width.
pub(crate) struct Pass<'a, const NX: usize, E: Equations<NX>, K: Sink> {
    case: &'a Case<NX, E>,
    terms: Vec<ValuedTerm>,
    start: SVector<f64, NX>,
    biases: [f64; OUTPUTS],
    stride: usize,
    outputs: &'a mut [[f64; OUTPUTS]],
    sink: &'a mut K,
}

impl<const NX: usize, E: Equations<NX>> Case<NX, E> {
    /// Integrates with these parameters in steps of `stride` samples. Outputs go to the front of
    /// `outputs`, sensitivities to the sink.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves its bounds or is not a number.
    pub(crate) fn run_pass(
        &self,
        parameters: &[f64],
        stride: usize,
        outputs: &mut [[f64; OUTPUTS]],
        sink: &mut impl Sink,
    ) -> Result<(), Diverged> {
        Arch::new().dispatch(self.prepare_pass(parameters, stride, outputs, sink))
    }

    /// Prepares the pass of [`Case::run_pass`].
    pub(crate) fn prepare_pass<'a, K: Sink>(
        &'a self,
        parameters: &[f64],
        stride: usize,
        outputs: &'a mut [[f64; OUTPUTS]],
        sink: &'a mut K,
    ) -> Pass<'a, NX, E, K> {
        let mut biases = [0.0; OUTPUTS];
        let values = &parameters[self.derivatives()..];
        for (&o, bias) in self.biased_outputs.iter().zip(values) {
            biases[o] += bias;
        }
        Pass {
            case: self,
            terms: self.valued_terms(parameters).collect(),
            start: self.start_state(parameters),
            biases,
            stride: stride.clamp(1, WIDEST_STRIDE),
            outputs,
            sink,
        }
    }

    fn start_state(&self, parameters: &[f64]) -> SVector<f64, NX> {
        match self.initial_state {
            InitialState::Measured => self.start,
            InitialState::Estimated => {
                let first = self.parameters() - NX;
                SVector::from_fn(|i, _| parameters[first + i])
            }
        }
    }
}

impl<const NX: usize, E: Equations<NX>, K: Sink> WithSimd for Pass<'_, NX, E, K> {
    type Output = Result<(), Diverged>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Result<(), Diverged> {
        let (case, layout, stride) = (self.case, &self.case.layout, self.stride);
        let samples = case.samples().div_ceil(stride);
        let start = initial_sensitivities::<NX>(case.initial_state, layout);
        let mut sensitivities = ChunkSensitivities::new(layout, start);
        let mut build_up = ChunkBuildUp::<NX>::ZERO;
        let mut history = StageHistory::<NX>::EMPTY;
        let mut propagators = Propagators::<NX>::ZERO;
        let mut x = self.start;
        for first in (0..samples).step_by(CHUNK) {
            let count = CHUNK.min(samples - first);
            let points = Strided {
                first: 2 * stride * first,
                stride,
            };
            build_up.set(case, &self.terms, points);
            let mut trajectory = Trajectory::new(case, &build_up, &mut history, points);
            for k in 0..count {
                let sample = stride * (first + k);
                if is_out_of_bounds(&x) {
                    return Err(Diverged { sample });
                }
                let y = propagators.read_outputs(case, &build_up, &x, sample, k);
                for o in 0..OUTPUTS {
                    self.outputs[first + k][o] = y[o] + self.biases[o];
                }
                x = trajectory.record_step(k, &x);
            }
            let rows = sensitivities.propagate(
                simd,
                (case, layout),
                (points, count),
                (&history, &mut propagators),
                NoUpdate,
            );
            let samples = Strided {
                first: stride * first,
                stride,
            };
            let outputs = &self.outputs[first..first + count];
            self.sink.take(simd, samples, outputs, rows);
        }
        Ok(())
    }
}

/// Sensitivities at the first sample: one for each free initial state along itself, else zero.
fn initial_sensitivities<const NX: usize>(
    initial_state: InitialState,
    layout: &LaneLayout,
) -> AlignedBuffer {
    let mut sensitivities = AlignedBuffer::zeros(NX * layout.width());
    if initial_state == InitialState::Estimated {
        for i in 0..NX {
            let lane = layout.first_initial_state() + i;
            sensitivities.slice_mut()[i * layout.width() + lane] = 1.0;
        }
    }
    sensitivities
}
