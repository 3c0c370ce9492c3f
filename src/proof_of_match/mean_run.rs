//! Free run at the mean of a posterior, with the sensitivities of its outputs to the derivatives
//! and the start's parameters. Also the deficiency of a flight against this run.

use nalgebra::DMatrix;

use super::free_run::{FreeRun, STATES, Simulation};
use super::linear_run::{Histories, Parameter, RunWithSensitivities};
use super::maneuver_recording::ManeuverRecording;
use super::outputs::{COUNT, Outputs};
use super::start::MatchedStart;
use crate::aero::{AeroModel, Axis, Regressor};
use crate::model::{LocalKind, LocalPosterior, LocalValue};
use crate::numerics::series::sample_count::whole_steps;
use crate::numerics::vectors::simd::vectorised;

/// Longest step of the run with slopes, s. Probabilities differ by 0.2 % rms from those of steps of a quarter.
const LONGEST_STEP_S: f64 = 0.1;

/// Limit of the rms difference between flight and mean run, in standard deviations of what
/// posterior, start and noise explain. Few directions carry the deviations, so two is reached by
/// chance.
const EXPLAINED_DEVIATIONS: f64 = 2.0;

/// Run about which flights repeat, with the slopes of its outputs.
#[derive(Debug)]
pub struct MeanRun {
    pub stride: usize,
    pub run: FreeRun,
    /// Slopes along the derivatives, and after them along the start's own parameters.
    pub slopes: Vec<Histories>,
    /// Indices of the derivatives, among the values of the posterior and in the build-up.
    pub derivatives: Vec<(usize, usize)>,
    /// Covariance of the start's own parameters.
    pub start_covariance: DMatrix<f64>,
}

impl MeanRun {
    /// Flies the mean of a posterior; `None` if its start is not determined.
    #[must_use]
    pub fn fly(
        (simulation, start): (&Simulation, &MatchedStart),
        posterior: &LocalPosterior,
        (aero_model, axis): (&AeroModel, Axis),
    ) -> Option<MeanRun> {
        let covariance = start.covariance.as_ref()?;
        let recording = simulation.recording;
        let stride = stride(recording);
        let derivatives = acting_derivatives(posterior, aero_model);
        let own = start_parameters(axis);
        let moved = derivatives.iter().map(|(_, d)| Parameter::Derivative(*d));
        let parameters: Vec<Parameter> = moved.chain(own.map(Parameter::Start)).collect();
        let steps = (recording.samples, stride);
        let RunWithSensitivities { run, slopes } =
            simulation.fly_with_slopes((&start.start, &parameters), steps);
        Some(MeanRun {
            stride,
            run,
            slopes,
            derivatives,
            start_covariance: of_places(covariance, &own),
        })
    }

    /// Slopes along the derivatives, and along the parameters of the start.
    #[must_use]
    pub fn slopes_by_kind(&self) -> (&[Histories], &[Histories]) {
        self.slopes.split_at(self.derivatives.len())
    }

    /// Deficiency of the run with the outputs `mean`, at every `stride`-th sample: measured less
    /// computed outputs. It is reduced by the fraction of their mean square that derivatives, start
    /// and noise explain. `roots` are those of the covariances of derivatives and start.
    #[must_use]
    pub fn deficiency(
        &self,
        recording: &ManeuverRecording,
        mean: &[Outputs],
        roots: [&DMatrix<f64>; 2],
    ) -> Vec<Outputs> {
        let flown = mean.len().min(self.run.outputs.len());
        let mut deficiency = vec![[0.0; COUNT]; mean.len()];
        for output in 0..COUNT {
            let counted = (0..flown).filter(|k| !recording.repaired[k * self.stride][output]);
            let mut observed = 0.0;
            for sample in counted.clone() {
                let difference =
                    recording.measured[sample * self.stride][output] - mean[sample][output];
                deficiency[sample][output] = difference;
                observed += difference * difference;
            }
            let noise = recording.noise[output] * recording.noise[output];
            let variances = self.variances(output, roots);
            let variances = counted.map(|sample| variances[sample] + noise);
            let share = unexplained_share(observed, variances);
            for own in &mut deficiency {
                own[output] *= share;
            }
        }
        deficiency
    }

    /// Variance of an output at each sample by the deviations of derivatives and start.
    fn variances(&self, output: usize, roots: [&DMatrix<f64>; 2]) -> Vec<f64> {
        let (by_derivative, by_start) = self.slopes_by_kind();
        let samples = self.run.outputs.len();
        let (mut variances, mut deviations) = (vec![0.0; samples], vec![0.0; samples]);
        for (slopes, root) in [by_derivative, by_start].into_iter().zip(roots) {
            for independent in root.column_iter() {
                deviations.fill(0.0);
                for (own, factor) in slopes.iter().zip(independent.iter()) {
                    add_scaled(&mut deviations, *factor, &own[output]);
                }
                let both = variances.iter_mut().zip(&deviations);
                both.for_each(|(variance, deviation)| *variance += deviation * deviation);
            }
        }
        variances
    }
}

/// Adds a factor times some values.
fn add_scaled(sums: &mut [f64], factor: f64, values: &[f64]) {
    vectorised(
        #[inline(always)]
        || {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += factor * value;
            }
        },
    );
}

/// Share of the observed mean square beyond what the variances explain. The sum of the variances
/// ends where it explains all: no later one makes it smaller.
fn unexplained_share(observed: f64, variances: impl Iterator<Item = f64>) -> f64 {
    let (mut explained, mut limit) = (0.0, 0.0);
    for variance in variances {
        explained += variance;
        limit = EXPLAINED_DEVIATIONS * EXPLAINED_DEVIATIONS * explained;
        if observed <= limit {
            return 0.0;
        }
    }
    if observed > limit {
        1.0 - limit / observed
    } else {
        0.0
    }
}

/// Samples in a step of the run with slopes.
fn stride(recording: &ManeuverRecording) -> usize {
    whole_steps(LONGEST_STEP_S, recording.step_s)
        .min(recording.samples)
        .max(1)
}

/// Indices of the derivatives that affect a simulation, among the values of a posterior and in the
/// build-up.
#[must_use]
pub fn acting_derivatives(
    posterior: &LocalPosterior,
    aero_model: &AeroModel,
) -> Vec<(usize, usize)> {
    let index = |value: &LocalValue| {
        let is_slope = value.kind == LocalKind::Derivative && !value.is_mach_slope;
        let mut derivatives = aero_model.derivatives.iter();
        let index = derivatives.position(|d| is_slope && d.name == value.derivative)?;
        (aero_model.derivatives[index].regressor != Regressor::Constant).then_some(index)
    };
    let values = posterior.values.iter().enumerate();
    values.filter_map(|(i, v)| Some((i, index(v)?))).collect()
}

/// Parameters of a start that an axis determines.
fn start_parameters(axis: Axis) -> [usize; 7] {
    // α, airspeed, q, θ with CN, Cm, CA; β, p, r, φ with CY, Cl, Cn.
    match axis {
        Axis::Longitudinal => [0, 2, 4, 6, STATES, STATES + 1, STATES + 2],
        Axis::Lateral => [1, 3, 5, 7, STATES + 3, STATES + 4, STATES + 5],
    }
}

/// Covariance of the quantities at some indices.
#[must_use]
pub fn of_places(covariance: &DMatrix<f64>, places: &[usize]) -> DMatrix<f64> {
    covariance.select_rows(places).select_columns(places)
}
