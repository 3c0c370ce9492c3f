//! Free run at the mean of a posterior, with the sensitivities of its outputs to the derivatives
//! and the start's parameters. Also the deficiency of a flight against this run.

use nalgebra::DMatrix;

use super::free_run::{FreeRun, STATES, Simulation};
use super::linear_run::{Parameter, RunWithSensitivities};
use super::maneuver_recording::ManeuverRecording;
use super::outputs::{COUNT, Outputs};
use super::start::MatchedStart;
use crate::aero::{AeroModel, Axis, Regressor};
use crate::model::{LocalKind, LocalPosterior, LocalValue};
use crate::numerics::series::sample_count::whole_steps;

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
    /// Slopes of each output: derivatives and then parameters of the start as rows, samples as columns.
    pub slopes: [DMatrix<f64>; COUNT],
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

    /// Deficiency of the run with the outputs `mean`, at every `stride`-th sample: measured less
    /// computed outputs. It is reduced by the fraction of their mean square that derivatives, start
    /// and noise explain. `covariance` is that of the derivatives.
    #[must_use]
    pub fn deficiency(
        &self,
        recording: &ManeuverRecording,
        mean: &[Outputs],
        covariance: &DMatrix<f64>,
    ) -> Vec<Outputs> {
        let flown = mean.len().min(self.run.outputs.len());
        let mut deficiency = vec![[0.0; COUNT]; mean.len()];
        for output in 0..COUNT {
            let counted = (0..flown).filter(|k| !recording.repaired[k * self.stride][output]);
            let counted: Vec<usize> = counted.collect();
            let mut observed = 0.0;
            for &sample in &counted {
                let difference =
                    recording.measured[sample * self.stride][output] - mean[sample][output];
                deficiency[sample][output] = difference;
                observed += difference * difference;
            }
            let noise = counted.len() as f64 * recording.noise[output].powi(2);
            let explained = noise + self.variance(output, &counted, covariance);
            let share = unexplained_share(observed, explained);
            for own in &mut deficiency {
                own[output] *= share;
            }
        }
        deficiency
    }

    /// Variance of an output by the deviations of derivatives and start, summed over some samples.
    fn variance(&self, output: usize, samples: &[usize], covariance: &DMatrix<f64>) -> f64 {
        let slopes = self.slopes[output].select_columns(samples);
        let first = self.derivatives.len();
        let (by_derivative, by_start) = slopes.rows_range_pair(..first, first..);
        let by_derivative = (covariance * by_derivative).dot(&by_derivative);
        by_derivative + (&self.start_covariance * by_start).dot(&by_start)
    }
}

/// Share of the observed square beyond what the variance explains.
fn unexplained_share(observed: f64, explained: f64) -> f64 {
    let limit = EXPLAINED_DEVIATIONS * EXPLAINED_DEVIATIONS * explained;
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

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn the_variance_of_an_output_is_the_sum_over_samples_of_both_kinds_of_deviations() {
        let slopes = [1.0, 7.0, -3.0, 2.0, 7.0, 1.0, 1.0, 7.0, 5.0];
        let mean = MeanRun {
            stride: 1,
            run: FreeRun {
                outputs: vec![[0.0; COUNT]; 3],
                has_departed: false,
            },
            slopes: std::array::from_fn(|_| DMatrix::from_row_slice(3, 3, &slopes)),
            derivatives: vec![(0, 0), (1, 1)],
            start_covariance: DMatrix::from_element(1, 1, 9.0),
        };
        let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 2.0]);
        // s' C s + 9 s² at the first and the last sample.
        let first = 4.0 + 2.0 * 2.0 + 2.0 * 4.0 + 9.0;
        let last = 4.0 * 9.0 - 2.0 * 3.0 + 2.0 + 9.0 * 25.0;
        let sum = mean.variance(4, &[0, 2], &covariance);
        assert_relative_eq!(sum, first + last, epsilon = 1e-12);
        assert_relative_eq!(mean.variance(4, &[], &covariance), 0.0);
    }

    #[test]
    fn a_difference_counts_beyond_two_standard_deviations_of_what_is_explained() {
        assert_relative_eq!(unexplained_share(3.9, 1.0), 0.0);
        assert_relative_eq!(unexplained_share(16.0, 1.0), 0.75);
        assert_relative_eq!(unexplained_share(0.0, 0.0), 0.0);
    }
}
