//! Receivers of the rows of a pass: the sums of the normal equations, or a record of steps and rows.
#![expect(
    clippy::inline_always,
    reason = "compiled into one loop for the processor at hand"
)]

use nalgebra::{SMatrix, SVector};
use pulp::Simd;

use crate::dynamics::OUTPUTS;
use crate::numerics::linear_algebra::matrix::AlignedMatrix;
use crate::output_error::kernel::chunk_rows::ChunkRows;
use crate::output_error::kernel::normal_equations::NormalSums;
use crate::output_error::kernel::propagators::Propagators;
use crate::output_error::kernel::trajectory::StageHistory;

/// Consumer of the steps and of the rows of whitened sensitivities.
pub(super) trait RowSink<const NX: usize> {
    /// Takes the steps of some samples of a chunk, after their rows.
    fn take_steps(&mut self, history: &StageHistory<NX>, steps: &Propagators<NX>, samples: usize);

    /// Takes the rows of a chunk that begins at the sample `first`. `white` has the whitened
    /// innovations, and `used` the outputs that count.
    fn take<'a, S: Simd>(
        &mut self,
        simd: S,
        first: usize,
        white: &[[f64; OUTPUTS]],
        used: impl Fn(usize) -> &'a [bool; OUTPUTS],
        rows: ChunkRows,
    );
}

impl<const NX: usize> RowSink<NX> for NormalSums {
    #[inline(always)]
    fn take_steps(&mut self, _: &StageHistory<NX>, _: &Propagators<NX>, _: usize) {}

    #[inline(always)]
    fn take<'a, S: Simd>(
        &mut self,
        simd: S,
        first: usize,
        white: &[[f64; OUTPUTS]],
        used: impl Fn(usize) -> &'a [bool; OUTPUTS],
        mut rows: ChunkRows,
    ) {
        self.complete_rows(white.len(), &mut rows, |k| (white[k], used(k)));
        self.add_rows(simd, first, white.len(), &rows);
    }
}

/// One step of a filter along its own trajectory.
#[derive(Clone, Copy, Debug)]
pub(super) struct RecordedStep<const NX: usize> {
    /// Corrected state, from which the step begins.
    pub corrected: SVector<f64, NX>,
    /// Matrix Φ: change of the next predicted state with the corrected one.
    pub transition: SMatrix<f64, NX, NX>,
    /// Matrix C: change of the outputs with the predicted state.
    pub outputs: SMatrix<f64, OUTPUTS, NX>,
}

/// Steps and rows of all samples of a pass.
pub(super) struct RecordedPass<const NX: usize> {
    pub steps: Vec<RecordedStep<NX>>,
    /// Whitened sensitivities in the lanes of the parameters: sample by sample, output by output;
    /// zero where an output does not count.
    pub rows: AlignedMatrix,
}

impl<const NX: usize> RecordedPass<NX> {
    pub fn new(samples: usize, width: usize) -> Self {
        RecordedPass {
            steps: Vec::with_capacity(samples),
            rows: AlignedMatrix::zeros(samples * OUTPUTS, width),
        }
    }
}

impl<const NX: usize> RowSink<NX> for RecordedPass<NX> {
    #[inline(always)]
    fn take_steps(&mut self, history: &StageHistory<NX>, steps: &Propagators<NX>, samples: usize) {
        for k in 0..samples {
            let mut step = RecordedStep {
                corrected: history.states[k],
                transition: SMatrix::zeros(),
                outputs: SMatrix::zeros(),
            };
            for j in 0..NX {
                for i in 0..NX {
                    step.transition[(i, j)] = steps.phi[i][j][k];
                }
                for o in 0..OUTPUTS {
                    step.outputs[(o, j)] = steps.c[o][j][k];
                }
            }
            self.steps.push(step);
        }
    }

    #[inline(always)]
    fn take<'a, S: Simd>(
        &mut self,
        _: S,
        first: usize,
        white: &[[f64; OUTPUTS]],
        used: impl Fn(usize) -> &'a [bool; OUTPUTS],
        rows: ChunkRows,
    ) {
        let width = self.rows.width();
        for k in 0..white.len() {
            for o in (0..OUTPUTS).filter(|o| used(k)[*o]) {
                let to = ((first + k) * OUTPUTS + o) * width;
                rows.copy_to(k, o, &mut self.rows.values_mut()[to..][..width]);
            }
        }
    }
}
