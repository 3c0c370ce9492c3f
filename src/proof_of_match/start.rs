//! Start of a free run: initial state and trim, matched over the first samples of a maneuver.
//!
//! As in a qualification test guide, the simulator is trimmed to the aircraft before it runs free.
//! Initial state and the six coefficients at trim are chosen so that the simulation fits all
//! outputs best up to the first input. The outputs are weighted by their noise. After that the
//! model alone changes the coefficients.

use nalgebra::{DMatrix, DVector};

use super::aerodynamics::{COEFFICIENTS, SimulationTrim, TrimmedAerodynamics};
use super::factor::AeroInputs;
use super::free_run::{FreeRun, STATES, Simulation, Start};
use super::linear_run::{Parameter, RunWithSensitivities};
use super::maneuver_recording::ManeuverRecording;
use super::outputs::COUNT;
use crate::dynamics::{Equations, Lateral, Longitudinal, Motion};
use crate::earth::air;
use crate::numerics::linear_algebra::symmetric;
use crate::numerics::statistics::mean::mean;
use crate::units::DEG;

/// Number of parameters of a start.
pub const PARAMETERS: usize = STATES + COEFFICIENTS;

/// Number of Gauss-Newton iterations, all with the slopes of the first: a second of flight is
/// nearly linear in its start.
const ITERATIONS: usize = 3;

/// Matched start with the covariance of its parameters.
#[derive(Clone, Debug)]
pub struct MatchedStart {
    pub start: Start,
    /// `None` if the samples do not determine all parameters.
    pub covariance: Option<DMatrix<f64>>,
}

/// Matches initial state and trim of a simulation.
#[must_use]
pub fn matched(simulation: &Simulation) -> MatchedStart {
    let recording = simulation.recording;
    let mut start = as_measured(simulation);
    let Some((slopes, mut computed)) = StartSlopes::of(simulation, &start) else {
        return MatchedStart {
            start,
            covariance: None,
        };
    };
    for left in (0..ITERATIONS).rev() {
        let Some(step) = slopes.step(recording, &computed) else {
            break;
        };
        for (parameter, by) in step.iter().enumerate() {
            start = start.with_change(parameter, *by);
        }
        if left > 0 {
            computed = simulation.fly(&start, recording.trim_samples, 1);
        }
    }
    MatchedStart {
        start,
        covariance: Some(slopes.covariance),
    }
}

/// Slopes of the outputs along the parameters of a start, over the noise of each output.
struct StartSlopes {
    /// Sample, output and slopes of each row; outputs that ingest has repaired have no row.
    rows: Vec<(usize, usize, [f64; PARAMETERS])>,
    covariance: DMatrix<f64>,
}

impl StartSlopes {
    /// Slopes, with the run at the start; `None` if the simulated aircraft departs or the samples
    /// do not determine all parameters.
    fn of(simulation: &Simulation, start: &Start) -> Option<(StartSlopes, FreeRun)> {
        let recording = simulation.recording;
        let parameters: [Parameter; PARAMETERS] = std::array::from_fn(Parameter::Start);
        let RunWithSensitivities { run, slopes } =
            simulation.fly_with_slopes((start, &parameters), (recording.trim_samples, 1));
        if run.has_departed {
            return None;
        }
        let mut information = [[0.0; PARAMETERS]; PARAMETERS];
        let mut rows = Vec::with_capacity(recording.trim_samples * COUNT);
        let trim = recording.repaired.iter().take(recording.trim_samples);
        for (sample, repaired) in trim.enumerate() {
            for output in (0..COUNT).filter(|output| !repaired[*output]) {
                let noise = recording.noise[output];
                let own = slopes[output].column(sample);
                let own: [f64; PARAMETERS] = std::array::from_fn(|i| own[i] / noise);
                for (sums, slope) in information.iter_mut().zip(own) {
                    add_multiple(sums, slope, &own);
                }
                rows.push((sample, output, own));
            }
        }
        let information = DMatrix::from_fn(PARAMETERS, PARAMETERS, |i, j| information[j][i]);
        let covariance = symmetric::inverse(&information)?;
        Some((StartSlopes { rows, covariance }, run))
    }

    /// Gauss-Newton step; `None` if the aircraft departs or the step is not finite.
    fn step(&self, recording: &ManeuverRecording, computed: &FreeRun) -> Option<DVector<f64>> {
        if computed.has_departed {
            return None;
        }
        let mut gradient = [0.0; PARAMETERS];
        for (sample, output, slopes) in &self.rows {
            let residual =
                recording.measured[*sample][*output] - computed.outputs[*sample][*output];
            add_multiple(&mut gradient, residual / recording.noise[*output], slopes);
        }
        let step = &self.covariance * DVector::from_column_slice(&gradient);
        step.iter().all(|s| s.is_finite()).then_some(step)
    }
}

/// Adds a multiple of values to sums.
fn add_multiple(sums: &mut [f64; PARAMETERS], factor: f64, values: &[f64; PARAMETERS]) {
    for i in 0..PARAMETERS {
        sums[i] += factor * values[i];
    }
}

/// State on straight lines through the measured states, and coefficients that the measured motion
/// implies.
fn as_measured(simulation: &Simulation) -> Start {
    let recording = simulation.recording;
    let motions = &recording.motions;
    let states: Vec<[f64; STATES]> = motions.iter().map(state).collect();
    let mut trim = SimulationTrim {
        coefficients: [0.0; COEFFICIENTS],
        factors: mean_factors(simulation),
    };
    let mut about_trim = TrimmedAerodynamics::new(&simulation.aerodynamics, &trim);
    let implied: Vec<[f64; COEFFICIENTS]> = motions
        .iter()
        .enumerate()
        .map(|(sample, motion)| {
            let recorded = recording.signals(2 * sample);
            let change = about_trim.change(&flow(simulation, motion), recorded);
            let implied = implied(simulation, motion);
            std::array::from_fn(|i| implied[i] - change[i])
        })
        .collect();
    trim.coefficients = std::array::from_fn(|i| mean(implied.iter().map(|c| c[i])));
    let ratio = |m: &Motion| {
        let standard = air(recording.altitude_ft).density_slug_ft3;
        m.qbar / (0.5 * standard * m.velocity * m.velocity)
    };
    Start {
        state: std::array::from_fn(|i| at_start(states.iter().map(|s| s[i]))),
        altitude_ft: recording.altitude_ft,
        density_ratio: mean(motions.iter().map(ratio)),
        trim,
    }
}

fn state(motion: &Motion) -> [f64; STATES] {
    let [p, q, r] = motion.rates;
    [
        motion.alpha,
        motion.beta,
        motion.velocity,
        p,
        q,
        r,
        motion.theta,
        motion.phi,
    ]
}

/// Inputs of a measured motion, with the Mach number of the standard atmosphere.
fn flow(simulation: &Simulation, motion: &Motion) -> AeroInputs {
    AeroInputs {
        mach: motion.velocity / air(simulation.recording.altitude_ft).sound_ft_s,
        alpha_deg: DEG * motion.alpha,
        beta_deg: DEG * motion.beta,
        velocity: motion.velocity,
        rates: motion.rates,
        alpha_rate: Longitudinal::alpha_rate(simulation.aircraft, motion),
        qbar: motion.qbar,
    }
}

/// Means of the build-up's factors over the trim.
fn mean_factors(simulation: &Simulation) -> Vec<f64> {
    let recording = simulation.recording;
    let share = 1.0 / recording.motions.len().max(1) as f64;
    let mut sums: Vec<f64> = vec![];
    for (sample, motion) in recording.motions.iter().enumerate() {
        let flow = flow(simulation, motion);
        let recorded = recording.signals(2 * sample);
        let factors = simulation.aerodynamics.factors(&flow, recorded);
        if sums.is_empty() {
            sums = factors.map(|factor| share * factor).collect();
        } else {
            for (sum, factor) in sums.iter_mut().zip(factors) {
                *sum += share * factor;
            }
        }
    }
    sums
}

/// Coefficients of both axes that a measured motion implies.
fn implied(simulation: &Simulation, motion: &Motion) -> [f64; COEFFICIENTS] {
    let aircraft = simulation.aircraft;
    let inputs = Longitudinal::rate_inputs(aircraft, motion);
    let [normal, pitching, axial] = Longitudinal::implied_coefficients(aircraft, motion, &inputs);
    let inputs = Lateral::rate_inputs(aircraft, motion);
    let [side, rolling, yawing] = Lateral::implied_coefficients(aircraft, motion, &inputs);
    [normal, pitching, axial, side, rolling, yawing]
}

/// Value at the first sample of the straight line of least squares.
fn at_start(values: impl ExactSizeIterator<Item = f64> + Clone) -> f64 {
    let last = values.len().saturating_sub(1) as f64;
    let level = mean(values.clone());
    let (mut up, mut norm) = (0.0, 0.0);
    for (k, value) in values.enumerate() {
        let place = k as f64 - 0.5 * last;
        up += place * value;
        norm += place * place;
    }
    level - 0.5 * last * up / f64::max(norm, f64::MIN_POSITIVE)
}
