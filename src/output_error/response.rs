//! The computed response of a maneuver to a set of parameters: outputs, sums of the normal equations, and on demand the
//! sensitivities themselves.

use pulp::Simd;

use super::case::Case;
use super::kernel::Sink;
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

/// The slopes of every output at every sample along every parameter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sensitivities {
    /// Output by output, sample by sample: the slopes along the parameters in order.
    outputs: [Vec<f64>; OUTPUTS],
    parameters: usize,
    /// The lane of each parameter but the biases, and that parameter.
    places: Vec<(usize, usize)>,
    width: usize,
}

impl Sensitivities {
    /// The slopes of one output at one sample along the parameters.
    #[must_use]
    pub fn at(&self, sample: usize, output: usize) -> &[f64] {
        &self.outputs[output][sample * self.parameters..(sample + 1) * self.parameters]
    }

    /// The slopes of one output, sample by sample.
    #[must_use]
    pub fn of(&self, output: usize) -> &[f64] {
        &self.outputs[output]
    }
}

impl Sink for Sensitivities {
    fn take<S: Simd>(&mut self, _: S, first: usize, outputs: &[[f64; OUTPUTS]], rows: &mut [f64]) {
        let n = self.parameters;
        for (at, row) in rows.chunks_exact(self.width).take(outputs.len() * OUTPUTS).enumerate() {
            let (sample, o) = (first + at / OUTPUTS, at % OUTPUTS);
            let whole = &mut self.outputs[o][sample * n..(sample + 1) * n];
            for &(lane, parameter) in &self.places {
                whole[parameter] = row[lane];
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
            normal: Normal::new(&self.lanes, self.derivatives(), &self.biased),
        }
    }

    /// Integrates the equations with these parameters into `response`.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves the bounds of sense or is no number.
    pub fn respond(&self, parameters: &[f64], response: &mut Response) -> Result<(), Diverged> {
        let Response { outputs, normal } = response;
        normal.clear();
        self.pass(parameters, outputs, &mut Summing { normal, measurements: &self.measurements })
    }

    /// The sensitivities to all parameters.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves the bounds of sense or is no number.
    pub fn sensitivities(&self, parameters: &[f64]) -> Result<Sensitivities, Diverged> {
        let (n, derivatives) = (self.parameters(), self.derivatives());
        let biases = derivatives..derivatives + self.biased.len();
        let driven = (0..n).filter(|j| !biases.contains(j));
        let mut sensitivities = Sensitivities {
            outputs: std::array::from_fn(|_| vec![0.0; self.samples() * n]),
            parameters: n,
            places: self.lanes.places.iter().copied().zip(driven).collect(),
            width: self.lanes.width(),
        };
        self.pass(parameters, &mut vec![[0.0; OUTPUTS]; self.samples()], &mut sensitivities)?;
        for (b, &o) in self.biased.iter().enumerate() {
            sensitivities.outputs[o].chunks_exact_mut(n).for_each(|row| row[derivatives + b] = 1.0);
        }
        Ok(sensitivities)
    }
}
