//! One pass of the filter over a maneuver, in the kernel of output error. The steps are the same,
//! with a correction of states and sensitivities between them.
#![expect(
    clippy::inline_always,
    reason = "compiled into one loop for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::SVector;
use pulp::{Simd, WithSimd};

use super::measurement_updates::{ChunkUpdates, MeasurementUpdates};
use super::row_sinks::RowSink;
use crate::dynamics::{InGusts, OUTPUTS};
use crate::numerics::vectors::simd::AlignedBuffer;
use crate::output_error::case::Case;
use crate::output_error::case::build_up::ValuedTerm;
use crate::output_error::case::chunking::{CHUNK, Strided};
use crate::output_error::case::layout::LaneLayout;
use crate::output_error::kernel::chunk_build_up::ChunkBuildUp;
use crate::output_error::kernel::pass::Diverged;
use crate::output_error::kernel::propagation::ChunkSensitivities;
use crate::output_error::kernel::propagators::Propagators;
use crate::output_error::kernel::trajectory::{StageHistory, Trajectory, is_out_of_bounds};

/// Results of a pass besides the sums, to which it appends sample by sample.
pub(super) struct PassOutputs<'a> {
    /// Predicted outputs.
    pub predicted: &'a mut Vec<[f64; OUTPUTS]>,
    pub innovations: &'a mut Vec<[f64; OUTPUTS]>,
    /// Innovations made white with unit variance.
    pub whitened: &'a mut Vec<[f64; OUTPUTS]>,
}

/// One pass; without a sink no sensitivities are computed.
pub(super) struct FilterPass<'a, const NX: usize, E: InGusts<NX>, K: RowSink<NX>> {
    pub case: &'a Case<NX, E>,
    pub layout: &'a LaneLayout,
    pub terms: Vec<ValuedTerm>,
    pub start: SVector<f64, NX>,
    /// Sensitivities of the first state: state by state a row of lanes.
    pub start_sensitivities: AlignedBuffer,
    pub updates: &'a MeasurementUpdates<'a, NX>,
    pub outputs: PassOutputs<'a>,
    pub sink: Option<&'a mut K>,
}

impl<const NX: usize, E: InGusts<NX>, K: RowSink<NX>> WithSimd for FilterPass<'_, NX, E, K> {
    type Output = Result<(), Diverged>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Result<(), Diverged> {
        let (case, layout) = (self.case, self.layout);
        let samples = case.samples();
        let mut sensitivities = ChunkSensitivities::new(layout, self.start_sensitivities);
        let mut build_up = ChunkBuildUp::<NX>::ZERO;
        let mut history = StageHistory::<NX>::EMPTY;
        let mut propagators = Propagators::<NX>::ZERO;
        let mut chunk = ChunkUpdates::<NX, E>::new(self.updates, layout);
        let mut x = self.start;
        for first in (0..samples).step_by(CHUNK) {
            let count = CHUNK.min(samples - first);
            let points = Strided {
                first: 2 * first,
                stride: 1,
            };
            build_up.set(case, &self.terms, points);
            let mut trajectory = Trajectory::new(case, &build_up, &mut history, points);
            for k in 0..count {
                let sample = first + k;
                if is_out_of_bounds(&x) {
                    return Err(Diverged { sample });
                }
                let mut y = if self.sink.is_some() {
                    propagators.read_outputs(case, &build_up, &x, sample, k)
                } else {
                    let c = build_up.coefficients::<E>(2 * k, &x);
                    let inputs = (
                        &case.motion.rate_inputs[2 * sample],
                        &case.motion.sensor_inputs[sample],
                    );
                    E::outputs(inputs.0, inputs.1, &x, &c).outputs.into()
                };
                for o in 0..OUTPUTS {
                    y[o] += self.updates.biases[o];
                }
                let (corrected, white) =
                    chunk.correct_state(sample, k, &x, &y, &case.measurements.values[sample]);
                self.outputs.predicted.push(y);
                self.outputs.innovations.push(chunk.innovations[k]);
                self.outputs.whitened.push(white);
                x = if self.sink.is_some() {
                    trajectory.record_step(k, &corrected)
                } else {
                    trajectory.step(k, &corrected)
                };
            }
            let Some(sink) = self.sink.as_deref_mut() else {
                continue;
            };
            let white = &self.outputs.whitened[first..first + count];
            let used = |k: usize| {
                let pattern = usize::from(chunk.patterns[k]);
                &self.updates.patterns[pattern].used
            };
            let rows = sensitivities.propagate(
                simd,
                (case, layout),
                (points, count),
                (&history, &mut propagators),
                &chunk,
            );
            sink.take(simd, first, white, used, rows);
            sink.take_steps(&history, &propagators, count);
        }
        Ok(())
    }
}
