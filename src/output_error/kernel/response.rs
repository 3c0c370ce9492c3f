//! Computed response of a maneuver to a set of parameters: outputs, sums of the normal equations, and
//! on demand the sensitivities themselves.

use pulp::Simd;

use super::chunk_rows::ChunkRows;
use super::normal_equations::{NormalAccumulator, NormalSums};
use super::pass::{Diverged, Sink};
use crate::dynamics::{Equations, OUTPUTS};
use crate::numerics::vectors::simd::AlignedBuffer;
use crate::output_error::case::Case;
use crate::output_error::case::blocks::samples_per_block;
use crate::output_error::case::chunking::{Strided, WIDEST_STRIDE};

/// Outputs at every sample and the sums of the normal equations. Allocated once per maneuver and
/// overwritten by every iteration.
#[derive(Clone, Debug, Default)]
pub struct Response {
    pub outputs: Vec<[f64; OUTPUTS]>,
    pub(crate) sums: NormalSums,
}

/// Resolution of a response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// Steps of about [`COARSE_STEP_S`], compared with the measurements at their ends only. The
    /// iteration comes near the minimum at a fraction of the work.
    Coarse,
    /// Every sample.
    Whole,
}

/// Step of a coarse response, s: it follows the airframe's motion well, but not the surfaces.
const COARSE_STEP_S: f64 = 0.1;
/// Least number of samples per parameter of a coarse response.
const SAMPLES_PER_PARAMETER: usize = 8;

/// Slopes of every output along every parameter at every sample; zero where a sample does not count.
#[derive(Clone, Debug, Default)]
pub struct Sensitivities {
    /// Rows of lanes: sample by sample, output by output.
    rows: AlignedBuffer,
    pub(crate) width: usize,
    /// Lane of each parameter.
    pub(crate) lanes: Vec<usize>,
}

impl Sensitivities {
    /// Slope of one output at one sample along a parameter.
    #[must_use]
    pub fn at(&self, sample: usize, output: usize, parameter: usize) -> f64 {
        self.row(sample, output)[self.lanes[parameter]]
    }

    /// Lanes of one output at one sample.
    pub(crate) fn row(&self, sample: usize, output: usize) -> &[f64] {
        &self.rows.slice()[(sample * OUTPUTS + output) * self.width..][..self.width]
    }
}

/// Sink that keeps the rows of a pass.
struct SensitivityRecorder<'a> {
    sensitivities: &'a mut Sensitivities,
    used: &'a [[bool; OUTPUTS]],
    /// Lane of each bias, and the output that it shifts.
    biases: Vec<(usize, usize)>,
}

impl Sink for SensitivityRecorder<'_> {
    fn take<S: Simd>(
        &mut self,
        _: S,
        samples: Strided,
        outputs: &[[f64; OUTPUTS]],
        rows: ChunkRows,
    ) {
        let width = self.sensitivities.width;
        let kept = self.sensitivities.rows.slice_mut();
        let kept = kept[samples.first * OUTPUTS * width..].chunks_exact_mut(OUTPUTS * width);
        for (k, kept) in kept.take(outputs.len()).enumerate() {
            for (o, row) in kept.chunks_exact_mut(width).enumerate() {
                if !self.used[samples.first + k][o] {
                    row.fill(0.0);
                    continue;
                }
                rows.copy_to(k, o, row);
                for (lane, output) in &self.biases {
                    row[*lane] = if *output == o { 1.0 } else { 0.0 };
                }
            }
        }
    }
}

impl Response {
    /// Response with given outputs, without sums.
    #[must_use]
    pub fn of_outputs(outputs: Vec<[f64; OUTPUTS]>) -> Response {
        Response {
            outputs,
            sums: NormalSums::default(),
        }
    }
}

impl<const NX: usize, E: Equations<NX>> Case<NX, E> {
    /// Allocates a response of this case's size.
    #[must_use]
    pub fn response(&self) -> Response {
        Response {
            outputs: vec![[0.0; OUTPUTS]; self.samples()],
            sums: NormalSums::new(
                &self.layout,
                self.derivatives(),
                &self.biased_outputs,
                self.samples(),
                samples_per_block(self.step_s),
            ),
        }
    }

    /// Computes the response in some detail. Of a coarse response only the sums are valid.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves its bounds or is not a number.
    pub fn respond(&self, parameters: &[f64], response: &mut Response) -> Result<(), Diverged> {
        self.respond_with(Detail::Whole, parameters, response)
    }

    /// Computes the response in this detail. Only the sums of a coarse response are valid.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves its bounds or is not a number.
    pub fn respond_with(
        &self,
        detail: Detail,
        parameters: &[f64],
        response: &mut Response,
    ) -> Result<(), Diverged> {
        let stride = match detail {
            Detail::Coarse => self.coarse_stride(),
            Detail::Whole => 1,
        };
        let Response { outputs, sums } = response;
        sums.clear(stride);
        let mut accumulator = NormalAccumulator {
            sums,
            measurements: &self.measurements,
        };
        self.run_pass(parameters, stride, outputs, &mut accumulator)
    }

    /// `true` if coarse steps are longer than the sampling interval.
    #[must_use]
    pub fn has_coarse(&self) -> bool {
        self.coarse_stride() > 1
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small positive number"
    )]
    fn coarse_stride(&self) -> usize {
        let of_coarse_step = (COARSE_STEP_S / self.step_s).round() as usize;
        let spare = self.samples() / (SAMPLES_PER_PARAMETER * self.parameters().max(1));
        of_coarse_step.min(spare).clamp(1, WIDEST_STRIDE)
    }

    /// Computes the sensitivities to all parameters.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves its bounds or is not a number.
    pub fn sensitivities(&self, parameters: &[f64]) -> Result<Sensitivities, Diverged> {
        let layout = &self.layout;
        let (derivatives, initial_states) = layout.parameter_lanes.split_at(self.derivatives());
        let mut sensitivities = Sensitivities {
            rows: AlignedBuffer::zeros(self.samples() * OUTPUTS * layout.width()),
            width: layout.width(),
            lanes: [derivatives, &layout.biases, initial_states].concat(),
        };
        let bias_lanes = layout.biases.iter().copied();
        let mut recorder = SensitivityRecorder {
            sensitivities: &mut sensitivities,
            used: &self.measurements.used,
            biases: bias_lanes
                .zip(self.biased_outputs.iter().copied())
                .collect(),
        };
        let mut outputs = vec![[0.0; OUTPUTS]; self.samples()];
        self.run_pass(parameters, 1, &mut outputs, &mut recorder)?;
        Ok(sensitivities)
    }
}
