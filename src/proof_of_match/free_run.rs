//! Free run: the rigid body flies from a start. Of the record only surfaces, thrust and mass are
//! used.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use super::aerodynamics::{Aerodynamics, SimulationTrim, TrimmedAerodynamics};
use super::factor::AeroInputs;
use super::load_changes::LoadSlopes;
use super::maneuver_recording::ManeuverRecording;
use super::outputs::{Outputs, outputs};
use crate::aircraft::Aircraft;
use crate::numerics::runge_kutta::{self, POINT};
use crate::rigid_body::{
    AirData, BodyState, CHANGING, DEPARTURE_DEG, Euler, Instant, Loads, Readings, body,
};
use crate::units::DEG;
use nalgebra::{Quaternion, Vector3};
use pulp::{Arch, Simd, WithSimd};

/// Number of states at the start.
pub const STATES: usize = 8;

/// Velocities and rates among the states of the body.
const STATES_OF_BODY: usize = 6;

/// State and balance from which a simulation starts. Heading and position over the ground have no
/// effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// α, β, airspeed, p, q, r, pitch attitude, bank; rad, ft/s, rad/s.
    pub state: [f64; STATES],
    pub altitude_ft: f64,
    /// Ratio of the measured dynamic pressure to that in the standard atmosphere: the density of
    /// the day.
    pub density_ratio: f64,
    pub trim: SimulationTrim,
}

impl Start {
    /// Start with one parameter changed. Parameters are the states, then the trim coefficients.
    #[must_use]
    pub fn with_change(&self, parameter: usize, by: f64) -> Start {
        let mut start = self.clone();
        match start.state.get_mut(parameter) {
            Some(state) => *state += by,
            None => {
                if let Some(own) = start.trim.coefficients.get_mut(parameter - STATES) {
                    *own += by;
                }
            }
        }
        start
    }

    /// Slopes of the body's state along one state of the start.
    #[must_use]
    pub fn slopes(&self, parameter: usize) -> [f64; CHANGING] {
        let [alpha, beta, velocity, ..] = self.state;
        let (sa, ca) = alpha.sin_cos();
        let (sb, cb) = beta.sin_cos();
        let attitude = self.body().attitude;
        let mut slopes = [0.0; CHANGING];
        let (body, turn) = slopes.split_at_mut(STATES_OF_BODY);
        match parameter {
            0 => body[..3].copy_from_slice(&[-velocity * sa * cb, 0.0, velocity * ca * cb]),
            1 => body[..3].copy_from_slice(&[
                -velocity * ca * sb,
                velocity * cb,
                -velocity * sa * sb,
            ]),
            2 => body[..3].copy_from_slice(&[ca * cb, sb, sa * cb]),
            // Pitch attitude turns about the horizontal lateral axis, since the heading is zero;
            // bank turns about the body's longitudinal axis.
            6 => turn[..4].copy_from_slice(
                (Quaternion::new(0.0, 0.0, 0.5, 0.0) * attitude)
                    .coords
                    .as_slice(),
            ),
            7 => turn[..4].copy_from_slice(
                (attitude * Quaternion::new(0.0, 0.5, 0.0, 0.0))
                    .coords
                    .as_slice(),
            ),
            rate => body[rate] = 1.0,
        }
        slopes
    }

    fn body(&self) -> BodyState {
        let [alpha, beta, velocity, p, q, r, theta, phi] = self.state;
        BodyState {
            velocity: AirData::velocity(velocity, alpha, beta),
            rates: Vector3::new(p, q, r),
            attitude: Euler {
                phi,
                theta,
                psi: 0.0,
            }
            .attitude(),
            position: Vector3::new(0.0, 0.0, self.altitude_ft),
        }
    }
}

/// Outputs of a free run.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeRun {
    /// At the samples of the run, up to a departure.
    pub outputs: Vec<Outputs>,
    pub has_departed: bool,
}

/// A maneuver with the aircraft that flies it again.
#[derive(Clone, Debug)]
pub struct Simulation<'a> {
    pub aircraft: &'a Aircraft,
    pub recording: &'a ManeuverRecording,
    pub aerodynamics: Aerodynamics<'a>,
}

impl Simulation<'_> {
    /// Flies the first `samples` samples, every `stride`-th of which is a step.
    #[must_use]
    pub fn fly(&self, start: &Start, samples: usize, stride: usize) -> FreeRun {
        self.fly_with(start, (samples, stride), &mut NoObserver)
    }

    /// As [`Simulation::fly`], with computations beside the run.
    pub fn fly_with(
        &self,
        start: &Start,
        (samples, stride): (usize, usize),
        observer: &mut impl StageObserver,
    ) -> FreeRun {
        let step_s = stride as f64 * self.recording.step_s;
        let mut equations = RunEquations {
            simulation: self,
            start,
            aerodynamics: TrimmedAerodynamics::new(&self.aerodynamics, &start.trim),
        };
        let mut state = start.body();
        let mut run = FreeRun {
            outputs: Vec::with_capacity(samples.div_ceil(stride)),
            has_departed: false,
        };
        for sample in (0..samples).step_by(stride) {
            let instant = equations.instant(&state, 2 * sample);
            let alpha_deg = instant.air.alpha * DEG;
            if !(state.is_finite() && alpha_deg.abs() < DEPARTURE_DEG) {
                run.has_departed = true;
                break;
            }
            let readings = Arch::new().dispatch(Sensing {
                instant: &instant,
                aircraft: self.aircraft,
            });
            run.outputs
                .push(outputs(&readings, instant.air.velocity_ft_s));
            observer.at_stage(0, &instant, (&mut equations, 2 * sample));
            observer.at_sample(&instant);
            if sample + stride < samples {
                // The first stage is at the sample itself.
                let rate = |stage: usize, at: &BodyState| {
                    if stage == 0 {
                        return instant.rate;
                    }
                    let point = 2 * sample + stride * POINT[stage];
                    let instant = equations.instant(at, point);
                    observer.at_stage(stage, &instant, (&mut equations, point));
                    instant.rate
                };
                let end = runge_kutta::step(&state, step_s, rate, BodyState::plus);
                observer.after_step(&end);
                state = end.normalised();
            }
        }
        run
    }
}

/// Computation beside a run, at the instants of its stages.
pub trait StageObserver {
    /// Called at each stage, with the equations and the point of the recording. The first stage of
    /// a step is at its sample.
    fn at_stage(&mut self, stage: usize, instant: &Instant, at: (&mut RunEquations, usize));

    /// Called after the first stage of a sample, even if no step starts there.
    fn at_sample(&mut self, instant: &Instant);

    /// Called after all stages of a step; its end is not yet normalised.
    fn after_step(&mut self, end: &BodyState);
}

/// Observer that computes nothing.
struct NoObserver;

impl StageObserver for NoObserver {
    fn at_stage(&mut self, _: usize, _: &Instant, _: (&mut RunEquations, usize)) {}
    fn at_sample(&mut self, _: &Instant) {}
    fn after_step(&mut self, _: &BodyState) {}
}

/// Readings of the sensors, compiled for the processor at hand. Without its fused multiplication
/// the vanes' angles take as long to compute as the motion.
struct Sensing<'a> {
    instant: &'a Instant,
    aircraft: &'a Aircraft,
}

impl WithSimd for Sensing<'_> {
    type Output = Readings;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Readings {
        self.instant.readings(self.aircraft)
    }
}

/// Equations of motion of one run.
pub struct RunEquations<'a> {
    simulation: &'a Simulation<'a>,
    start: &'a Start,
    aerodynamics: TrimmedAerodynamics<'a>,
}

impl RunEquations<'_> {
    /// Motion at a state and a point of the recording.
    fn instant(&mut self, state: &BodyState, point: usize) -> Instant {
        if !self.aerodynamics.have_alpha_rate() {
            return self.instant_at(0.0, state, point);
        }
        let implied = |alpha_rate: f64| {
            let instant = self.instant_at(alpha_rate, state, point);
            AirData::alpha_rate(&state.velocity, &instant.rate.velocity)
        };
        let alpha_rate = AirData::alpha_rate_in_balance(implied);
        self.instant_at(alpha_rate, state, point)
    }

    /// Slopes of the loads at an instant, and slope of a coefficient along the derivatives of each row
    /// of the table.
    pub fn load_slopes(&mut self, instant: &Instant, point: usize) -> (LoadSlopes, &[f64]) {
        let has_alpha_rate = self.aerodynamics.have_alpha_rate();
        let state = &instant.state;
        let alpha_rate = if has_alpha_rate {
            AirData::alpha_rate(&state.velocity, &instant.rate.velocity)
        } else {
            0.0
        };
        let flow = AeroInputs::new(&instant.air, state.rates.into(), alpha_rate);
        let recorded = self.simulation.recording.signals(point);
        let change = self.aerodynamics.change(&flow, recorded);
        let slopes = self.aerodynamics.slopes(&flow, recorded);
        let loads = LoadSlopes::new(
            &self.simulation.aerodynamics,
            instant,
            &self.start.trim.plus(change),
            slopes.by_flow,
            has_alpha_rate,
        );
        (loads, slopes.by_derivative)
    }

    /// Motion for loads at this α̇, rad/s.
    fn instant_at(&mut self, alpha_rate: f64, state: &BodyState, point: usize) -> Instant {
        let recording = self.simulation.recording;
        let inputs = recording.inputs(point);
        let mut air = AirData::new(&state.velocity, state.position.z);
        air.qbar_psf *= self.start.density_ratio;
        let flow = AeroInputs::new(&air, state.rates.into(), alpha_rate);
        let change = self.aerodynamics.change(&flow, recording.signals(point));
        let coefficients = self.start.trim.plus(change);
        let model = &self.simulation.aerodynamics;
        let (force, moment) = model.loads(&coefficients, air.qbar_psf);
        let thrust = inputs.thrust;
        let force = force + Vector3::new(thrust.forward_lbf, 0.0, thrust.down_lbf);
        let moment = moment + Vector3::new(0.0, thrust.pitch_ft_lbf, 0.0);
        let loads = Loads {
            force,
            moment,
            engine_momentum: inputs.engine_momentum,
            gravity_ft_s2: inputs.gravity_ft_s2,
        };
        Instant {
            state: *state,
            rate: body::state_rate(state, &inputs.mass, &loads),
            air,
            loading: inputs.loading,
            specific_force: force / inputs.loading.mass_slug,
            relative_rates: state.rates,
            forward_thrust_lbf: thrust.forward_lbf,
        }
    }
}
