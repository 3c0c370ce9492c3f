//! Difference that decides whether a repeat flight passes, as a linear function of the derivatives.
//!
//! To first order the outputs of a repeat flight differ from a model's by the mean difference, the
//! effects of the derivatives' deviations, those of the start's errors, and the sensors' noise. At one
//! sample the difference is therefore normal, and its nearest limit is some standard deviations away. Of
//! an alternative the sample with the smallest distance counts, of a requirement the alternative with
//! the largest, and of the requirements the one with the smallest. Requirements of the Dutch roll are
//! left out.

use nalgebra::{DMatrix, DVector};

use super::free_run::FreeRun;
use super::judgement::Judged;
use super::outputs::place;
use super::recording::Recording;
use super::repeat_flight::{Histories, MovedRuns, moving};
use super::start::MatchedStart;
use crate::aero::{Axis, Buildup, Condition};
use crate::model::{LocalPosterior, LocalValue};
use crate::tables::MatchedQuantity;

/// Decisive difference of a maneuver, in tolerances: inside between −1 and 1.
#[derive(Clone, Debug, PartialEq)]
pub struct DecisiveDifference {
    pub maneuver_id: String,
    pub condition: Condition,
    pub quantity: MatchedQuantity,
    /// Difference of a repeat flight of the posterior's mean from the model.
    pub mean: f64,
    /// Slopes along the values of the posterior.
    pub slopes: Vec<(LocalValue, f64)>,
    /// Standard deviation by the start and the noise.
    pub rest: f64,
    /// `true` where the model is the posterior, whose mean the model is.
    pub follows_mean: bool,
}

/// Effects on the outputs at every `stride`-th sample.
#[derive(Debug)]
pub struct LinearOutputs {
    pub stride: usize,
    /// Place among the posterior's values, and effect per unit.
    slopes: Vec<(usize, Histories)>,
    /// Effects of the start's independent errors.
    of_start: Vec<Histories>,
    mean: FreeRun,
}

/// Sample and tolerance.
#[derive(Clone, Copy, Debug)]
struct Place<'a> {
    /// Distance inside the nearest limit, standard deviations.
    distance: f64,
    /// Number among the samples of the effects.
    sample: usize,
    judged: &'a Judged<'a>,
}

impl LinearOutputs {
    /// Flies the effect of each derivative, raised by its standard deviation, and of the start's errors;
    /// `None` where the start is not determined.
    #[must_use]
    pub fn new(
        (runs, start): (MovedRuns, &MatchedStart),
        posterior: &LocalPosterior,
        (buildup, axis): (&Buildup, Axis),
    ) -> Option<LinearOutputs> {
        let covariance = start.covariance.as_ref()?;
        let slope = |(value, derivative): (usize, usize)| {
            let deviation = posterior.covariance[(value, value)].sqrt();
            let effect = runs.effect(&[(derivative, deviation)]);
            let per_unit = |history: Vec<f64>| history.iter().map(|e| e / deviation).collect();
            (deviation > 0.0).then(|| (value, effect.map(per_unit)))
        };
        let moving = moving(posterior, buildup).into_iter();
        let slopes = moving.filter_map(slope).collect();
        let of_start = runs.effects_of_start(covariance, axis).collect();
        Some(LinearOutputs {
            slopes,
            of_start,
            stride: runs.stride,
            mean: runs.mean,
        })
    }

    /// The decisive difference of the run of a model at every `stride`-th sample; `None` where a run departs or no tolerance is of
    /// an output.
    #[must_use]
    pub fn decisive(
        &self,
        recording: &Recording,
        run: &FreeRun,
        posterior: &LocalPosterior,
        judged: &[Judged],
    ) -> Option<LinearDifference> {
        if run.has_departed || self.mean.has_departed {
            return None;
        }
        let requirements = judged.chunk_by(Judged::is_alternative);
        let best = requirements.filter_map(|alternatives| {
            let worst = alternatives
                .iter()
                .filter_map(|own| self.worst((recording, run), posterior, own));
            worst.max_by(|a, b| a.distance.total_cmp(&b.distance))
        });
        let decisive = best.min_by(|a, b| a.distance.total_cmp(&b.distance))?;
        self.difference((recording, run), decisive.sample, decisive.judged)
    }

    /// Sample of a tolerance with the smallest distance inside its limit.
    fn worst<'a>(
        &self,
        flown: (&Recording, &FreeRun),
        posterior: &LocalPosterior,
        judged: &'a Judged<'a>,
    ) -> Option<Place<'a>> {
        let samples = 0..self.mean.outputs.len();
        let all = samples.filter_map(|sample| {
            let own = self.difference(flown, sample, judged)?;
            let deviation = own.deviation(&posterior.covariance).hypot(own.rest);
            Some(Place {
                distance: (1.0 - own.mean.abs()) / deviation,
                sample,
                judged,
            })
        });
        all.min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// Difference at a sample; `None` for one that ingest has repaired, or a tolerance of no output.
    fn difference(
        &self,
        (recording, run): (&Recording, &FreeRun),
        sample: usize,
        judged: &Judged,
    ) -> Option<LinearDifference> {
        let tolerance = &judged.tolerance;
        let output = place(tolerance.quantity)?;
        let recorded = sample * self.stride;
        if *recording.repaired.get(recorded)?.get(output)? {
            return None;
        }
        let per_width = 1.0 / tolerance.width(recording.measured[recorded][output]);
        let by_start = self.of_start.iter().map(|effect| effect[output][sample]);
        let by_start = by_start.map(|effect| effect * effect).sum::<f64>().sqrt();
        let slopes = self.slopes.iter();
        let slopes = slopes.map(|(value, effect)| (*value, per_width * effect[output][sample]));
        Some(LinearDifference {
            quantity: tolerance.quantity,
            mean: per_width
                * (self.mean.outputs[sample][output] - run.outputs.get(sample)?[output]),
            slopes: slopes.collect(),
            rest: per_width * by_start.hypot(recording.noise[output]),
        })
    }
}

/// Difference at one sample, in tolerances.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearDifference {
    pub quantity: MatchedQuantity,
    pub mean: f64,
    /// Slopes by place among the values of the posterior.
    pub slopes: Vec<(usize, f64)>,
    /// Standard deviation by the start and the noise.
    pub rest: f64,
}

impl LinearDifference {
    /// Standard deviation by the derivatives.
    #[must_use]
    pub fn deviation(&self, covariance: &DMatrix<f64>) -> f64 {
        let mut slopes = DVector::zeros(covariance.nrows());
        for (value, slope) in &self.slopes {
            slopes[*value] = *slope;
        }
        (covariance * &slopes).dot(&slopes).max(0.0).sqrt()
    }
}
