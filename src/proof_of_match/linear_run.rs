//! A free run with the slopes of its outputs along its start and the derivatives of its model.
//!
//! The slopes are exact for the discrete run: each stage of a step is differentiated at the state
//! at which its rate was computed. All parameters advance together, side by side in the lanes of
//! vectors, along one run.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use std::array::from_fn;

use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

use super::aerodynamics::COEFFICIENTS;
use super::free_run::{FreeRun, RunEquations, STATES, Simulation, StageObserver, Start};
use super::load_changes::LoadSlopes;
use super::outputs::COUNT;
use crate::numerics::runge_kutta::{self, STAGES};
use crate::numerics::vectors::lanes::{Lanes, each};
use crate::numerics::vectors::simd::{AlignedBuffer, VECTOR};
use crate::rigid_body::{
    AirSlopes, BodySlopes, BodyState, CHANGING, Instant, ReadingSlopes, StateChange,
};

/// Parameter of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Index among the states of the start; after the states, the coefficients at its trim.
    Start(usize),
    /// Index of a derivative in the build-up; it is raised by the same amount at every angle of
    /// attack.
    Derivative(usize),
}

/// A run with the slopes of its outputs along parameters.
#[derive(Clone, Debug)]
pub struct RunWithSensitivities {
    pub run: FreeRun,
    /// Slopes of each output: parameters as rows, samples up to a departure as columns.
    pub slopes: [DMatrix<f64>; COUNT],
}

impl Simulation<'_> {
    /// Flies the first `samples` samples, every `stride`-th of which is a step, with the slopes along
    /// parameters.
    #[must_use]
    pub fn fly_with_slopes(
        &self,
        (start, parameters): (&Start, &[Parameter]),
        (samples, stride): (usize, usize),
    ) -> RunWithSensitivities {
        let step_s = stride as f64 * self.recording.step_s;
        let steps = samples.div_ceil(stride);
        let mut slopes = RunSlopes::new(self, (start, parameters), (steps, step_s));
        let run = self.fly_with(start, (samples, stride), &mut slopes);
        RunWithSensitivities {
            run,
            slopes: slopes.of_outputs(),
        }
    }
}

/// Slopes along a run, up to the present step.
struct RunSlopes<'a> {
    simulation: &'a Simulation<'a>,
    /// Coefficient that each parameter changes directly, if any.
    changes: Vec<Option<DirectChange>>,
    step_s: f64,
    stages: [Option<StageSlopes>; STAGES],
    /// Direct change of the coefficients by the parameters at each stage: coefficient by
    /// coefficient, each parameter.
    direct: [AlignedBuffer; STAGES],
    /// Slopes of the state: state by state, each parameter.
    states: AlignedBuffer,
    /// Slopes of the outputs at a sample: output by output, each parameter.
    outputs: AlignedBuffer,
    /// Number of the parameters, padded to whole vectors.
    width: usize,
    /// Slopes of each output: sample by sample, each parameter.
    recorded: [Vec<f64>; COUNT],
}

/// Coefficient that a parameter changes directly.
#[derive(Clone, Copy, Debug)]
struct DirectChange {
    coefficient: usize,
    /// Row of a derivative in the table; a coefficient at the trim has none.
    row: Option<usize>,
}

/// Slopes of the equations at a stage.
#[derive(Clone, Copy, Debug)]
struct StageSlopes {
    air: AirSlopes,
    loads: LoadSlopes,
    body: BodySlopes,
}

impl<'a> RunSlopes<'a> {
    fn new(
        simulation: &'a Simulation<'a>,
        (start, parameters): (&Start, &[Parameter]),
        (steps, step_s): (usize, f64),
    ) -> RunSlopes<'a> {
        let width = parameters.len().next_multiple_of(VECTOR);
        let mut states = AlignedBuffer::zeros(CHANGING * width);
        for (column, parameter) in parameters.iter().enumerate() {
            if let Parameter::Start(place @ 0..STATES) = parameter {
                for (state, slope) in start.slopes(*place).into_iter().enumerate() {
                    states.slice_mut()[state * width + column] = slope;
                }
            }
        }
        let change = |parameter: &Parameter| match parameter {
            Parameter::Start(place) => Some(DirectChange {
                coefficient: place.checked_sub(STATES)?,
                row: None,
            }),
            Parameter::Derivative(place) => {
                let place = simulation.aerodynamics.table.places.get(*place)?;
                Some(DirectChange {
                    coefficient: place.coefficient,
                    row: Some(place.row),
                })
            }
        };
        RunSlopes {
            simulation,
            changes: parameters.iter().map(change).collect(),
            step_s,
            stages: [None; STAGES],
            direct: from_fn(|_| AlignedBuffer::zeros(COEFFICIENTS * width)),
            states,
            outputs: AlignedBuffer::zeros(COUNT * width),
            width,
            recorded: from_fn(|_| Vec::with_capacity(steps * parameters.len())),
        }
    }

    /// Slopes of each output: parameters as rows, samples as columns.
    fn of_outputs(self) -> [DMatrix<f64>; COUNT] {
        let parameters = self.changes.len();
        self.recorded.map(|slopes| {
            let samples = slopes.len() / parameters.max(1);
            DMatrix::from_vec(parameters, samples, slopes)
        })
    }
}

impl StageObserver for RunSlopes<'_> {
    fn at_stage(&mut self, stage: usize, instant: &Instant, at: (&mut RunEquations, usize)) {
        let (equations, point) = at;
        let inputs = self.simulation.recording.inputs(point);
        let (loads, by_derivative) = equations.load_slopes(instant, point);
        self.stages[stage] = Some(StageSlopes {
            air: AirSlopes::new(&instant.state, &instant.air),
            loads,
            body: BodySlopes::new(
                &instant.state,
                &inputs.mass,
                inputs.engine_momentum,
                inputs.gravity_ft_s2,
            ),
        });
        let direct = self.direct[stage].slice_mut();
        for (column, change) in self.changes.iter().enumerate() {
            if let Some(DirectChange { coefficient, row }) = change {
                let slope = row.map_or(Some(&1.0), |row| by_derivative.get(row));
                direct[coefficient * self.width + column] = slope.copied().unwrap_or(0.0);
            }
        }
    }

    fn at_sample(&mut self, instant: &Instant) {
        let Some(stage) = self.stages[0] else {
            return;
        };
        Arch::new().dispatch(OutputSlopes {
            readings: &ReadingSlopes::new(instant, self.simulation.aircraft),
            stage: &stage,
            direct: self.direct[0].slice(),
            states: self.states.slice(),
            width: self.width,
            outputs: self.outputs.slice_mut(),
        });
        let outputs = self.outputs.slice().chunks_exact(self.width);
        for (recorded, slopes) in self.recorded.iter_mut().zip(outputs) {
            recorded.extend_from_slice(&slopes[..self.changes.len()]);
        }
    }

    fn after_step(&mut self, end: &BodyState) {
        let [Some(a), Some(b), Some(c), Some(d)] = self.stages else {
            return;
        };
        Arch::new().dispatch(StateUpdateSlopes {
            stages: &[a, b, c, d],
            direct: from_fn(|stage| self.direct[stage].slice()),
            end: end.attitude.coords.into(),
            step_s: self.step_s,
            width: self.width,
            states: self.states.slice_mut(),
        });
    }
}

/// Changes of states and coefficients of some parameters, from buffers whose rows have `width`.
#[inline(always)]
fn load<S: Simd, const N: usize>(
    simd: S,
    rows: &[f64],
    width: usize,
    column: usize,
) -> [Lanes<S>; N] {
    each(
        #[inline(always)]
        |row| Lanes::load(simd, rows, row * width + column),
    )
}

impl StageSlopes {
    /// Change of the state's rate, and of the force.
    #[inline(always)]
    fn rate<S: Simd>(
        &self,
        state: &StateChange<S>,
        direct: &[Lanes<S>; COEFFICIENTS],
    ) -> (StateChange<S>, [Lanes<S>; 3]) {
        let air = self.air.change(state);
        let loads = self.loads.change(&self.body, state, &air, direct);
        let rate = self.body.change(state, &loads.force, &loads.moment);
        (rate, loads.force)
    }
}

/// Slopes of the outputs at a sample.
struct OutputSlopes<'a> {
    readings: &'a ReadingSlopes,
    stage: &'a StageSlopes,
    direct: &'a [f64],
    states: &'a [f64],
    width: usize,
    /// Output by output, each parameter.
    outputs: &'a mut [f64],
}

impl WithSimd for OutputSlopes<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for column in (0..self.width).step_by(S::F64_LANES) {
            let state = StateChange(load(simd, self.states, self.width, column));
            let direct = load(simd, self.direct, self.width, column);
            let (rate, force) = self.stage.rate(&state, &direct);
            let air = self.stage.air.change(&state);
            let read = self.readings.change(&state, &rate, &air, &force);
            let [p, q, r] = read.rates_deg_s;
            let [phi, theta] = read.euler_deg;
            let outputs: [Lanes<S>; COUNT] = [
                read.alpha_vane_deg,
                read.beta_vane_deg,
                air.velocity,
                p,
                q,
                r,
                theta,
                phi,
                read.an_g,
                read.ax_g,
                read.ay_g,
            ];
            for (output, value) in outputs.into_iter().enumerate() {
                value.store(self.outputs, output * self.width + column);
            }
        }
    }
}

/// Slopes of the state after a step.
struct StateUpdateSlopes<'a> {
    stages: &'a [StageSlopes; STAGES],
    direct: [&'a [f64]; STAGES],
    /// Attitude at the end, before it is normalised.
    end: [f64; 4],
    step_s: f64,
    width: usize,
    states: &'a mut [f64],
}

impl WithSimd for StateUpdateSlopes<'_> {
    type Output = ();

    #[expect(
        clippy::redundant_closure_for_method_calls,
        reason = "a method passed by its name is not inlined"
    )]
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for column in (0..self.width).step_by(S::F64_LANES) {
            let state = StateChange(load(simd, self.states, self.width, column));
            let end = runge_kutta::step(
                &state,
                self.step_s,
                #[inline(always)]
                |stage, at| {
                    let direct = load(simd, self.direct[stage], self.width, column);
                    self.stages[stage].rate(at, &direct).0
                },
                #[inline(always)]
                |at, rate, factor| at.plus(rate, factor),
            );
            for (row, value) in end.normalised(&self.end).0.into_iter().enumerate() {
                value.store(self.states, row * self.width + column);
            }
        }
    }
}
