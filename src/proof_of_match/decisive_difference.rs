//! Difference that decides whether a repeat flight passes, as a linear function of the derivatives.
//!
//! To first order the outputs of a repeat flight and of a model differ by four parts. These are the
//! mean difference, the effects of the derivatives' deviations and of the start's errors, and
//! sensor noise. At one sample the difference is therefore normal, and its nearest limit is a
//! number of standard deviations away: its distance. The decisive difference is
//!
//! 1. of an alternative: the difference at the sample with the smallest distance;
//! 2. of a requirement: the one of the alternative with the largest distance;
//! 3. of the maneuver: the one of the requirement with the smallest distance.
//!
//! A requirement on the Dutch roll has one value only, whose noise is the error of the repeat
//! flight's estimates.

use nalgebra::{DMatrix, DVector};

use super::derivative_table::DerivativeTable;
use super::dutch_roll::{DutchRoll, LateralModes};
use super::free_run::FreeRun;
use super::judgement::Judged;
use super::maneuver_recording::ManeuverRecording;
use super::mean_run::{MeanRun, acting_derivatives};
use super::outputs::output_index;
use super::specification::Tolerance;
use crate::aero::{AeroModel, Condition};
use crate::model::{LocalPosterior, LocalValue};
use crate::tables::MatchedQuantity;

/// Decisive difference of a maneuver, in tolerances: inside between −1 and 1.
#[derive(Clone, Debug, PartialEq)]
pub struct DecisiveDifference {
    pub maneuver_id: String,
    pub condition: Condition,
    pub quantity: MatchedQuantity,
    /// Difference between a repeat flight at the posterior's mean and the model.
    pub mean: f64,
    /// Slopes along the values of the posterior.
    pub slopes: Vec<(LocalValue, f64)>,
    /// Standard deviation from the start and the noise.
    pub fixed_deviation: f64,
    /// `true` if the model is the posterior, so that it moves with the posterior's mean.
    pub follows_mean: bool,
}

/// Dutch roll of repeat flights and of the model that predicts them.
#[derive(Clone, Copy, Debug)]
pub struct PredictedDutchRoll<'a> {
    pub modes: &'a LateralModes,
    /// Derivatives of the posterior's mean.
    pub mean: &'a DerivativeTable,
    pub model: DutchRoll,
}

impl PredictedDutchRoll<'_> {
    /// Difference of a quantity; `None` if the repeat flights have no oscillation.
    fn difference(
        &self,
        posterior: &LocalPosterior,
        aero_model: &AeroModel,
        tolerance: &Tolerance,
    ) -> Option<LinearDifference> {
        let moving = acting_derivatives(posterior, aero_model);
        let deviation = |(value, derivative): &(usize, usize)| {
            (*derivative, posterior.covariance[(*value, *value)].sqrt())
        };
        let deviations: Vec<(usize, f64)> = moving.iter().map(deviation).collect();
        let quantity = tolerance.quantity;
        let repeats = self.modes.of_repeats(quantity, self.mean, &deviations)?;
        let model = self.model.value(quantity)?;
        let per_width = 1.0 / tolerance.width(repeats.mean);
        let slopes = moving.iter().zip(&repeats.slopes);
        Some(LinearDifference {
            quantity,
            mean: per_width * (repeats.mean - model),
            slopes: slopes
                .map(|((value, _), slope)| (*value, per_width * slope))
                .collect(),
            fixed_deviation: per_width * repeats.error,
        })
    }
}

impl MeanRun {
    /// Decisive difference of a model's run at every `stride`-th sample, and of its Dutch roll if
    /// available. `None` if a run departs or no tolerance can be judged.
    #[must_use]
    pub fn decisive(
        &self,
        flown: (&ManeuverRecording, &FreeRun),
        dutch_roll: Option<PredictedDutchRoll>,
        (posterior, aero_model): (&LocalPosterior, &AeroModel),
        judged: &[Judged],
    ) -> Option<LinearDifference> {
        if flown.1.has_departed || self.run.has_departed {
            return None;
        }
        let worst = |own: &Judged| {
            if own.tolerance.quantity.is_of_dutch_roll() {
                let difference = dutch_roll?.difference(posterior, aero_model, &own.tolerance)?;
                return Some((difference.distance(&posterior.covariance), difference));
            }
            self.worst(flown, posterior, own)
        };
        let requirements = judged.chunk_by(Judged::is_alternative);
        let best = requirements.filter_map(|alternatives| {
            let worst = alternatives.iter().filter_map(worst);
            worst.max_by(|a, b| a.0.total_cmp(&b.0))
        });
        let decisive = best.min_by(|a, b| a.0.total_cmp(&b.0));
        decisive.map(|(_, difference)| difference)
    }

    /// Smallest distance inside a tolerance's limit over the samples, and the difference at that
    /// sample.
    fn worst(
        &self,
        flown: (&ManeuverRecording, &FreeRun),
        posterior: &LocalPosterior,
        judged: &Judged,
    ) -> Option<(f64, LinearDifference)> {
        let samples = 0..self.run.outputs.len();
        let all = samples.filter_map(|sample| {
            let own = self.difference(flown, sample, judged)?;
            Some((own.distance(&posterior.covariance), own))
        });
        all.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Difference at a sample; `None` for one that ingest has repaired, or a tolerance of no output.
    fn difference(
        &self,
        (recording, run): (&ManeuverRecording, &FreeRun),
        sample: usize,
        judged: &Judged,
    ) -> Option<LinearDifference> {
        let tolerance = &judged.tolerance;
        let output = output_index(tolerance.quantity)?;
        let recorded = sample * self.stride;
        if *recording.repaired.get(recorded)?.get(output)? {
            return None;
        }
        let per_width = 1.0 / tolerance.width(recording.measured[recorded][output]);
        let slopes = self.slopes[output].column(sample);
        let of_start = slopes.rows_range(self.derivatives.len()..).into_owned();
        let values = self.derivatives.iter().map(|(value, _)| *value);
        let slopes = values.zip(slopes.iter().map(|own| per_width * own));
        let by_start = deviation(&self.start_covariance, &of_start);
        Some(LinearDifference {
            quantity: tolerance.quantity,
            mean: per_width * (self.run.outputs[sample][output] - run.outputs.get(sample)?[output]),
            slopes: slopes.collect(),
            fixed_deviation: per_width * by_start.hypot(recording.noise[output]),
        })
    }
}

/// Difference at one sample or of one value, in tolerances.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearDifference {
    pub quantity: MatchedQuantity,
    pub mean: f64,
    /// Slopes by index among the values of the posterior.
    pub slopes: Vec<(usize, f64)>,
    /// Standard deviation from the start and the noise.
    pub fixed_deviation: f64,
}

impl LinearDifference {
    /// Distance inside the nearest limit, standard deviations.
    fn distance(&self, covariance: &DMatrix<f64>) -> f64 {
        (1.0 - self.mean.abs()) / self.deviation(covariance).hypot(self.fixed_deviation)
    }

    /// Standard deviation from the derivatives.
    #[must_use]
    pub fn deviation(&self, covariance: &DMatrix<f64>) -> f64 {
        let mut slopes = DVector::zeros(covariance.nrows());
        for (value, slope) in &self.slopes {
            slopes[*value] = *slope;
        }
        deviation(covariance, &slopes)
    }
}

/// Standard deviation of a linear function, by its slopes along quantities with a covariance.
fn deviation(covariance: &DMatrix<f64>, slopes: &DVector<f64>) -> f64 {
    (covariance * slopes).dot(slopes).max(0.0).sqrt()
}
