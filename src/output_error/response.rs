//! The computed response of a maneuver to a set of parameters, with its exact sensitivities.

use nalgebra::{SMatrix, SVector};

use super::case::{Case, InitialState};
use crate::dynamics::runge_kutta::{Integrator, Rows, Stage};
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};

/// Outputs and their sensitivities at every sample; allocated once per maneuver and written over at every iteration.
#[derive(Clone, Debug, Default)]
pub struct Response {
    pub outputs: Vec<[f64; OUTPUTS]>,
    /// Sample by sample, output by output: the slope along every parameter.
    pub sensitivities: Vec<f64>,
    parameters: usize,
}

impl Response {
    /// The slopes of one output at one sample along the parameters.
    #[must_use]
    pub fn sensitivity(&self, sample: usize, output: usize) -> &[f64] {
        let at = (sample * OUTPUTS + output) * self.parameters;
        &self.sensitivities[at..at + self.parameters]
    }
}

/// The integration left every bound of sense: these parameters describe no flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Diverged {
    pub sample: usize,
}

/// A state beyond this (rad, rad/s) is no flight: it stops the integration before the numbers overflow.
const BEYOND_SENSE: f64 = 50.0;

impl<const NX: usize, E: Equations<NX>> Case<NX, E> {
    /// A response of this case's size to write into.
    #[must_use]
    pub fn response(&self) -> Response {
        let (samples, parameters) = (self.samples(), self.parameters());
        Response {
            outputs: vec![[0.0; OUTPUTS]; samples],
            sensitivities: vec![0.0; samples * OUTPUTS * parameters],
            parameters,
        }
    }

    /// Integrates the equations with these parameters into `response`.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves the bounds of sense or is no number.
    pub fn respond(&self, parameters: &[f64], response: &mut Response) -> Result<(), Diverged> {
        let mut regressors = vec![0.0; self.derivatives()];
        let mut integrator = self.at_start(parameters);
        for sample in 0..self.samples() {
            if sample > 0 {
                let point = 2 * (sample - 1);
                integrator.step(self.step_s, |stage, x, s, ds| {
                    let i = match stage {
                        Stage::Start => point,
                        Stage::Middle => point + 1,
                        Stage::End => point + 2,
                    };
                    self.slope(i, parameters, x, s, &mut regressors, ds)
                });
            }
            if !integrator.state.iter().all(|v| v.abs() < BEYOND_SENSE) {
                return Err(Diverged { sample });
            }
            self.read_sensors(sample, parameters, &integrator, &mut regressors, response);
        }
        Ok(())
    }

    fn at_start(&self, parameters: &[f64]) -> Integrator<NX> {
        match self.initial_state {
            InitialState::Measured => Integrator::new(self.start, self.parameters()),
            InitialState::Estimated => {
                let first = self.parameters() - NX;
                let state = SVector::from_fn(|i, _| parameters[first + i]);
                let mut integrator = Integrator::new(state, self.parameters());
                for (i, row) in integrator.sensitivity.iter_mut().enumerate() {
                    row[first + i] = 1.0;
                }
                integrator
            }
        }
    }

    /// The coefficients at a point and state, and their slopes along the states; the regressors go to `regressors`.
    pub(super) fn coefficients(
        &self,
        point: usize,
        parameters: &[f64],
        x: &SVector<f64, NX>,
        regressors: &mut [f64],
    ) -> ([f64; COEFFICIENTS], SMatrix<f64, COEFFICIENTS, NX>) {
        let n = regressors.len();
        regressors.copy_from_slice(&self.regressors[point * n..(point + 1) * n]);
        let held = &self.held[point];
        let mut by_state = SMatrix::<f64, COEFFICIENTS, NX>::from_fn(|k, i| held[k].slope[i]);
        for &(j, state) in &self.along_state {
            let k = self.ranges.iter().position(|range| range.contains(&j)).unwrap_or(0);
            by_state[(k, state)] += parameters[j] * regressors[j];
            regressors[j] *= x[state];
        }
        let values = std::array::from_fn(|k| {
            let range = self.ranges[k].clone();
            let free: f64 = parameters[range.clone()].iter().zip(&regressors[range]).map(|(v, r)| v * r).sum();
            held[k].offset + held[k].slope.dot(x) + free
        });
        (values, by_state)
    }

    fn slope(
        &self,
        point: usize,
        parameters: &[f64],
        x: &SVector<f64, NX>,
        s: &Rows<NX>,
        regressors: &mut [f64],
        ds: &mut Rows<NX>,
    ) -> SVector<f64, NX> {
        let (c, c_by_state) = self.coefficients(point, parameters, x, regressors);
        let rates = E::rates(&self.known[point], x, &c);
        let by_state = rates.by_state + rates.by_coefficient * c_by_state;
        for (i, row) in ds.iter_mut().enumerate() {
            let weights: [f64; NX] = std::array::from_fn(|j| by_state[(i, j)]);
            combine(row, &weights, s);
            self.add_direct(row, &std::array::from_fn(|k| rates.by_coefficient[(i, k)]), regressors);
        }
        rates.rates
    }

    /// Adds what the free derivatives do directly, through the coefficients they belong to.
    fn add_direct(&self, row: &mut [f64], by_coefficient: &[f64; COEFFICIENTS], regressors: &[f64]) {
        for (k, range) in self.ranges.iter().enumerate() {
            if by_coefficient[k] != 0.0 {
                for (v, r) in row[range.clone()].iter_mut().zip(&regressors[range.clone()]) {
                    *v += by_coefficient[k] * r;
                }
            }
        }
    }

    fn read_sensors(
        &self,
        sample: usize,
        parameters: &[f64],
        integrator: &Integrator<NX>,
        regressors: &mut [f64],
        response: &mut Response,
    ) {
        let x = &integrator.state;
        let (c, c_by_state) = self.coefficients(2 * sample, parameters, x, regressors);
        let read = E::outputs(&self.known[2 * sample], x, &c);
        let by_state = read.by_state + read.by_coefficient * c_by_state;
        let mut outputs: [f64; OUTPUTS] = read.outputs.into();
        let n = self.parameters();
        for o in 0..OUTPUTS {
            let at = (sample * OUTPUTS + o) * n;
            let row = &mut response.sensitivities[at..at + n];
            combine(row, &std::array::from_fn(|j| by_state[(o, j)]), &integrator.sensitivity);
            self.add_direct(row, &std::array::from_fn(|k| read.by_coefficient[(o, k)]), regressors);
        }
        let first = self.derivatives();
        for (b, &o) in self.biased.iter().enumerate() {
            outputs[o] += parameters[first + b];
            response.sensitivities[(sample * OUTPUTS + o) * n + first + b] += 1.0;
        }
        response.outputs[sample] = outputs;
    }
}

/// `out` = Σ weights · rows, skipping what is zero.
fn combine<const NX: usize>(out: &mut [f64], weights: &[f64; NX], rows: &Rows<NX>) {
    out.fill(0.0);
    for (weight, row) in weights.iter().zip(rows) {
        if *weight != 0.0 {
            for (v, s) in out.iter_mut().zip(row) {
                *v += weight * s;
            }
        }
    }
}
