//! The computed response of a maneuver to a set of parameters: outputs, sums of the normal equations, and on demand the
//! sensitivities themselves.

use pulp::Simd;

use super::case::Case;
use super::coloured::samples_of_block;
use super::course::Meanwhile;
use super::kernel::Sink;
use super::lanes::Aligned;
use super::normal::{Normal, Summing};
use crate::dynamics::{Equations, OUTPUTS};

/// Outputs at every sample and what the normal equations need; allocated once per maneuver and written over at every
/// iteration.
#[derive(Clone, Debug, Default)]
pub struct Response {
    pub outputs: Vec<[f64; OUTPUTS]>,
    pub(super) normal: Normal,
}

/// The integration left every bound of sense: these parameters describe no flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Diverged {
    pub sample: usize,
}

/// The slopes of every output along every parameter at every sample, zero where a sample does not count.
#[derive(Clone, Debug, Default)]
pub struct Sensitivities {
    /// Sample by sample, output by output a row of lanes.
    rows: Aligned,
    pub(super) width: usize,
    /// The lane of each parameter.
    pub(super) lanes: Vec<usize>,
}

impl Sensitivities {
    /// The slope of one output at one sample along a parameter.
    #[must_use]
    pub fn at(&self, sample: usize, output: usize, parameter: usize) -> f64 {
        self.row(sample, output)[self.lanes[parameter]]
    }

    /// The lanes of one output at one sample.
    pub(super) fn row(&self, sample: usize, output: usize) -> &[f64] {
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
        first: usize,
        outputs: &[[f64; OUTPUTS]],
        rows: &mut [f64],
        _: &mut impl Meanwhile,
    ) {
        let row = OUTPUTS * self.kept.width;
        let kept = &mut self.kept.rows.slice_mut()[first * row..][..outputs.len() * row];
        kept.copy_from_slice(&rows[..outputs.len() * row]);
        for (row, used) in kept.chunks_exact_mut(row).zip(&self.used[first..]) {
            for (o, row) in row.chunks_exact_mut(self.kept.width).enumerate() {
                if used[o] {
                    self.biases.iter().for_each(|(lane, output)| row[*lane] = f64::from(u8::from(*output == o)));
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
        self.respond_every(1, parameters, response)
    }

    /// The same, with an information matrix of every few samples where there are plenty: at least so many rows of five
    /// outputs a parameter are left.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves the bounds of sense or is no number.
    pub fn respond_roughly(&self, parameters: &[f64], response: &mut Response) -> Result<(), Diverged> {
        const ROWS_A_PARAMETER: usize = 8;
        let plenty = self.samples() / (ROWS_A_PARAMETER * self.parameters().max(1));
        let every = if plenty >= 4 { 4 } else { plenty.clamp(1, 2) };
        self.respond_every(every, parameters, response)
    }

    fn respond_every(&self, every: usize, parameters: &[f64], response: &mut Response) -> Result<(), Diverged> {
        let Response { outputs, normal } = response;
        normal.clear(every);
        self.pass(parameters, outputs, &mut Summing { normal, measurements: &self.measurements })
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
        let biases = lanes.biases.iter().copied().zip(self.biased.iter().copied()).collect();
        let mut keeping = Keeping { kept: &mut kept, used: &self.measurements.used, biases };
        self.pass(parameters, &mut vec![[0.0; OUTPUTS]; self.samples()], &mut keeping)?;
        Ok(kept)
    }
}
