//! The computed response of a maneuver to a set of parameters: outputs, sums of the normal
//! equations, and on demand the sensitivities themselves.

use pulp::Simd;

use super::normal_equations::{Normal, Summing};
use super::pass::Diverged;
use super::pass::Sink;
use crate::dynamics::{Equations, OUTPUTS};
use crate::numerics::row_products::Meanwhile;
use crate::numerics::simd::Aligned;
use crate::output_error::case::Case;
use crate::output_error::case::blocks::samples_of_block;
use crate::output_error::case::chunking::{Spaced, WIDEST_STRIDE};

/// Outputs at every sample and what the normal equations need; allocated once per maneuver and
/// written over at every iteration.
#[derive(Clone, Debug, Default)]
pub struct Response {
    pub outputs: Vec<[f64; OUTPUTS]>,
    pub(crate) normal: Normal,
}

/// How much of a maneuver a response looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// Integrated in steps of about [`COARSE_STEP_S`] and compared at their ends only: near the
    /// minimum, at a fraction of the work.
    Coarse,
    /// Sample by sample.
    Whole,
}

/// Steps by which a maneuver's slow motion is followed well, though not its surfaces, s.
pub const COARSE_STEP_S: f64 = 0.1;
/// So many samples a parameter are left at least.
const SAMPLES_A_PARAMETER: usize = 8;

/// The slopes of every output along every parameter at every sample, zero where a sample does not
/// count.
#[derive(Clone, Debug, Default)]
pub struct Sensitivities {
    /// Sample by sample, output by output a row of lanes.
    rows: Aligned,
    pub(crate) width: usize,
    /// The lane of each parameter.
    pub(crate) lanes: Vec<usize>,
}

impl Sensitivities {
    /// The slope of one output at one sample along a parameter.
    #[must_use]
    pub fn at(&self, sample: usize, output: usize, parameter: usize) -> f64 {
        self.row(sample, output)[self.lanes[parameter]]
    }

    /// The lanes of one output at one sample.
    pub(crate) fn row(&self, sample: usize, output: usize) -> &[f64] {
        &self.rows.slice()[(sample * OUTPUTS + output) * self.width..][..self.width]
    }
}

/// Keeps the rows of a pass.
struct Keeping<'a> {
    kept: &'a mut Sensitivities,
    used: &'a [[bool; OUTPUTS]],
    /// The lane of each bias, and the output that it shifts.
    biases: Vec<(usize, usize)>,
}

impl Sink for Keeping<'_> {
    fn take<S: Simd>(
        &mut self,
        _: S,
        samples: Spaced,
        outputs: &[[f64; OUTPUTS]],
        rows: &mut [f64],
        _: &mut impl Meanwhile,
    ) {
        let row = OUTPUTS * self.kept.width;
        let kept = &mut self.kept.rows.slice_mut()[samples.first * row..][..outputs.len() * row];
        kept.copy_from_slice(&rows[..outputs.len() * row]);
        for (row, used) in kept.chunks_exact_mut(row).zip(&self.used[samples.first..]) {
            for (o, row) in row.chunks_exact_mut(self.kept.width).enumerate() {
                if used[o] {
                    self.biases
                        .iter()
                        .for_each(|(lane, output)| row[*lane] = f64::from(u8::from(*output == o)));
                } else {
                    row.fill(0.0);
                }
            }
        }
    }
}

impl<const NX: usize, E: Equations<NX>> Case<NX, E> {
    /// A response of this case's size to write into.
    #[must_use]
    pub fn response(&self) -> Response {
        Response {
            outputs: vec![[0.0; OUTPUTS]; self.samples()],
            normal: Normal::new(
                &self.lanes,
                self.derivatives(),
                &self.biased,
                self.samples(),
                samples_of_block(self.step_s),
            ),
        }
    }

    /// Integrates the equations with these parameters into `response`.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves the bounds of sense or is no number.
    pub fn respond(&self, parameters: &[f64], response: &mut Response) -> Result<(), Diverged> {
        self.respond_with(Detail::Whole, parameters, response)
    }

    /// The same in less detail, of which only the sums are of use.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves the bounds of sense or is no number.
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
        let Response { outputs, normal } = response;
        normal.clear(stride);
        self.pass(
            parameters,
            stride,
            outputs,
            &mut Summing {
                normal,
                measurements: &self.measurements,
            },
        )
    }

    /// Whether coarse steps are longer than the samples' own.
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
        let within = (COARSE_STEP_S / self.step_s).round() as usize;
        let spare = self.samples() / (SAMPLES_A_PARAMETER * self.parameters().max(1));
        within.min(spare).clamp(1, WIDEST_STRIDE)
    }

    /// The sensitivities to all parameters.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves the bounds of sense or is no number.
    pub fn sensitivities(&self, parameters: &[f64]) -> Result<Sensitivities, Diverged> {
        let lanes = &self.lanes;
        let (derivatives, initial) = lanes.places.split_at(self.derivatives());
        let mut kept = Sensitivities {
            rows: Aligned::zeros(self.samples() * OUTPUTS * lanes.width()),
            width: lanes.width(),
            lanes: [derivatives, &lanes.biases, initial].concat(),
        };
        let biases = lanes
            .biases
            .iter()
            .copied()
            .zip(self.biased.iter().copied())
            .collect();
        let mut keeping = Keeping {
            kept: &mut kept,
            used: &self.measurements.used,
            biases,
        };
        self.pass(
            parameters,
            1,
            &mut vec![[0.0; OUTPUTS]; self.samples()],
            &mut keeping,
        )?;
        Ok(kept)
    }
}
