//! Probability that a repeat flight passes: the posterior's uncertainty, the start and the sensors'
//! noise are propagated to the differences between aircraft and simulator.
//!
//! A repeat flight is flown by an aircraft of the posterior with the same surfaces. To first order
//! its outputs differ from those at the mean by the effects of the derivatives' deviations. The
//! outputs of the simulator differ by the effects of the errors of its matched start. Both effects
//! follow from the slopes of one free run. The noise of the sensors is white and independent, so
//! its part of the probability is exact for each draw.
//!
//! A flight may differ from the mean by more than these parts explain. A derivative may vary in a
//! way that the posterior smooths, or the equations may lack an effect. This *deficiency* belongs
//! to the aircraft, so a repeat flight shows it again.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVectorView};

use super::dutch_roll::{DutchRoll, LateralModes};
use super::free_run::{FreeRun, Simulation};
use super::judgement::{Judged, Simulated, allowed_outside};
use super::maneuver_recording::ManeuverRecording;
use super::mean_run::{MeanRun, of_places};
use super::outputs::{Outputs, output_index};
use super::specification::Tolerance;
use super::start::MatchedStart;
use crate::aero::{AeroModel, Axis};
use crate::model::LocalPosterior;
use crate::numerics::linear_algebra::root::continuous_root;
use crate::numerics::statistics::normal;
use crate::numerics::statistics::random::RandomStream;

/// Seed of the draws.
const SEED: u64 = 60;

/// Distance from the limit beyond which noise has no effect, standard deviations.
const CERTAIN: f64 = 5.0;

/// Repeat flights about the mean of a posterior, at every `stride`-th sample. All models share them.
#[derive(Clone, Debug)]
pub struct Repeats {
    stride: usize,
    /// Expected outputs of a repeat flight: those at the mean of the posterior, and the deficiency.
    expected: Vec<Outputs>,
    /// Changes of each judged output by the deviations of a repeat flight: samples as rows, repeat
    /// flights as columns.
    changes: BTreeMap<usize, DMatrix<f64>>,
    /// Dutch roll according to the estimates of each repeat flight.
    dutch_rolls: Vec<Option<DutchRoll>>,
}

/// Probabilities of one model: of each tolerance in the order of the tests, and of all requirements.
#[derive(Clone, Debug, PartialEq)]
pub struct Probabilities {
    pub tolerances: Vec<f64>,
    pub all_requirements: f64,
}

impl Probabilities {
    /// Limits the probabilities to 0 and 1, which rounding errors of the sums may exceed.
    fn clamped(mut self) -> Probabilities {
        for probability in self
            .tolerances
            .iter_mut()
            .chain([&mut self.all_requirements])
        {
            *probability = probability.clamp(0.0, 1.0);
        }
        self
    }
}

/// Draws repeat flights about the mean of a posterior, with the outputs that some tolerances judge;
/// `mean` is the run at the mean in short steps. `None` if the start is not determined or the axis
/// has no posterior.
#[must_use]
pub fn repeats(
    (simulation, start): (&Simulation, &MatchedStart),
    mean: &FreeRun,
    (posterior, modes): (&LocalPosterior, Option<&LateralModes>),
    model: (&AeroModel, Axis),
    (judged, draws): (&[Judged], usize),
) -> Option<Repeats> {
    let about = MeanRun::fly((simulation, start), posterior, model)?;
    if about.derivatives.is_empty() {
        return None;
    }
    let recording = simulation.recording;
    let (values, derivatives): (Vec<usize>, Vec<usize>) = about.derivatives.iter().copied().unzip();
    let covariance = of_places(&posterior.covariance, &values);
    let expected = expected_outputs(&about, mean, recording, &covariance);
    let root = continuous_root(&covariance);
    let root_of_start = continuous_root(&about.start_covariance);
    let mut stream = RandomStream::new(SEED, &recording.start_s.to_string());
    let mut dutch_rolls = Vec::with_capacity(draws);
    // Deviations of the derivatives and of the start's parameters, a column for each repeat flight.
    let parameters = root.nrows() + root_of_start.nrows();
    let mut deviations = DMatrix::zeros(parameters, draws);
    for mut own in deviations.column_iter_mut() {
        let drawn = stream.deviations(&root);
        dutch_rolls.push(modes.and_then(|modes| {
            let deviation = |derivative: usize| {
                let own = derivatives.iter().position(|own| *own == derivative);
                own.map_or(0.0, |own| drawn[own])
            };
            let table = &simulation.aerodynamics.table;
            modes.of_repeat(table, deviation, &mut stream)
        }));
        let of_start = stream.deviations(&root_of_start);
        own.rows_range_mut(..drawn.len()).copy_from(&drawn);
        own.rows_range_mut(drawn.len()..).copy_from(&of_start);
    }
    let outputs = judged.iter();
    let outputs = outputs.filter_map(|own| output_index(own.tolerance.quantity));
    let outputs: BTreeSet<usize> = outputs.collect();
    // The run with slopes may depart where that in short steps does not.
    let change = |output: usize| {
        let own = about.slopes[output].transpose() * &deviations;
        own.resize_vertically(expected.len(), 0.0)
    };
    let changes = outputs.into_iter().map(|output| (output, change(output)));
    Some(Repeats {
        stride: about.stride,
        changes: changes.collect(),
        expected,
        dutch_rolls,
    })
}

/// Outputs at the mean of the posterior, and the deficiency. Long steps do for the slopes; the mean is
/// compared with runs in short ones.
fn expected_outputs(
    about: &MeanRun,
    mean: &FreeRun,
    recording: &ManeuverRecording,
    covariance: &DMatrix<f64>,
) -> Vec<Outputs> {
    let mut expected: Vec<Outputs> = mean.outputs.iter().copied().step_by(about.stride).collect();
    let deficiency = about.deficiency(recording, &expected, covariance);
    for (expected, deficiency) in expected.iter_mut().zip(deficiency) {
        for (output, own) in deficiency.into_iter().enumerate() {
            expected[output] += own;
        }
    }
    expected
}

impl Repeats {
    /// Probabilities that a repeat flight meets the tolerances of a model's prediction. A run that
    /// departs meets none.
    #[must_use]
    pub fn probabilities(
        &self,
        recording: &ManeuverRecording,
        simulated: &Simulated,
        judged: &[Judged],
        required_pct: f64,
    ) -> Probabilities {
        let mut sums = Probabilities {
            tolerances: vec![0.0; judged.len()],
            all_requirements: 0.0,
        };
        if simulated.run.has_departed || self.expected.len() * self.stride < recording.samples {
            return sums;
        }
        let inside = judged.iter().map(|own| {
            let output = output_index(own.tolerance.quantity);
            let Some((output, changes)) = output.and_then(|i| self.changes.get_key_value(&i))
            else {
                return self.inside_by_modes(simulated.model, &own.tolerance);
            };
            let bias = self.bias(&simulated.run, *output);
            let stated = (&own.tolerance, *output);
            let limits = SampleLimits::new(recording, stated, self.stride, required_pct);
            limits.inside(&bias, changes)
        });
        let inside: Vec<Vec<f64>> = inside.collect();
        let count = self.dutch_rolls.len() as f64;
        for repeat in 0..self.dutch_rolls.len() {
            let tolerances: Vec<f64> = inside.iter().map(|own| own[repeat]).collect();
            for (sum, inside) in sums.tolerances.iter_mut().zip(&tolerances) {
                *sum += inside / count;
            }
            sums.all_requirements += of_all_requirements(judged, &tolerances) / count;
        }
        sums.clamped()
    }

    /// Difference of the expected repeat flight from a model's run, in one output.
    fn bias(&self, run: &FreeRun, output: usize) -> Vec<f64> {
        let own = run.outputs.iter().step_by(self.stride);
        let pairs = self.expected.iter().zip(own);
        pairs
            .map(|(expected, own)| expected[output] - own[output])
            .collect()
    }

    /// One for each repeat flight whose Dutch roll meets a tolerance of a model's, zero for the others.
    fn inside_by_modes(&self, model: Option<DutchRoll>, tolerance: &Tolerance) -> Vec<f64> {
        let value = |own: Option<DutchRoll>| own?.value(tolerance.quantity);
        let model = value(model);
        let meets = |repeat: &Option<DutchRoll>| {
            let pair = value(*repeat).zip(model);
            pair.is_some_and(|(repeat, model)| (repeat - model).abs() <= tolerance.width(repeat))
        };
        let repeats = self.dutch_rolls.iter();
        repeats.map(|own| f64::from(u8::from(meets(own)))).collect()
    }
}

/// Probability that all requirements are met, from those of the tolerances. One of a requirement's
/// alternatives must be met.
fn of_all_requirements(judged: &[Judged], tolerances: &[f64]) -> f64 {
    let mut all_requirements = 1.0;
    let mut rest = tolerances;
    for requirement in judged.chunk_by(Judged::is_alternative) {
        let (own, others) = rest.split_at(requirement.len());
        all_requirements *= 1.0 - own.iter().map(|inside| 1.0 - inside).product::<f64>();
        rest = others;
    }
    all_requirements
}

/// Limits of a tolerance at the samples that count.
struct SampleLimits {
    noise: f64,
    /// Samples that may be outside.
    allowed: usize,
    intervals: Vec<Interval>,
}

/// Samples between two samples of the differences; after the last one the difference stays.
struct Interval {
    /// Size of both differences up to which noise moves none of the samples outside.
    certain: f64,
    samples: Vec<SampleLimit>,
}

/// Limit at one sample.
struct SampleLimit {
    width: f64,
    /// Fractional position in the interval.
    share: f64,
}

/// Size of a value between two others, over the larger of their sizes: one, and more than the rounding
/// errors of its computation.
const BETWEEN: f64 = 1.0 + 1e-12;

impl SampleLimits {
    fn new(
        recording: &ManeuverRecording,
        (tolerance, output): (&Tolerance, usize),
        stride: usize,
        required_pct: f64,
    ) -> SampleLimits {
        let noise = recording.noise[output];
        let limit = |sample: usize| SampleLimit {
            width: tolerance.width(recording.measured[sample][output]),
            share: (sample % stride) as f64 / stride as f64,
        };
        let interval = |first: usize| {
            let samples = first * stride..((first + 1) * stride).min(recording.samples);
            let counted = samples.filter(|k| !recording.repaired[*k][output]);
            let samples: Vec<SampleLimit> = counted.map(limit).collect();
            let least_width = samples.iter().map(|own| own.width).fold(f64::MAX, f64::min);
            Interval {
                certain: (least_width - CERTAIN * noise) / BETWEEN,
                samples,
            }
        };
        let intervals: Vec<Interval> = (0..recording.samples.div_ceil(stride))
            .map(interval)
            .collect();
        let counted = intervals.iter().map(|own| own.samples.len()).sum();
        SampleLimits {
            noise,
            allowed: allowed_outside(counted, required_pct),
            intervals,
        }
    }

    /// Probability of each repeat flight that the required share of samples is inside, over the
    /// sensors' noise. `bias` is the expected difference at each sample, `changes` are the deviations
    /// from it.
    fn inside(&self, bias: &[f64], changes: &DMatrix<f64>) -> Vec<f64> {
        let (mut differences, mut doubtful) = (Vec::with_capacity(bias.len()), Vec::new());
        let own = |change: DVectorView<f64>| {
            differences.clear();
            let pairs = bias.iter().zip(change.as_slice());
            differences.extend(pairs.map(|(bias, own)| bias + own));
            self.inside_of_one(&differences, &mut doubtful)
        };
        changes.column_iter().map(own).collect()
    }

    /// Probability of one repeat flight with these differences; the memory of `doubtful` is used again.
    fn inside_of_one(&self, differences: &[f64], doubtful: &mut Vec<(f64, f64)>) -> f64 {
        let noise = self.noise;
        let mut outside = 0;
        doubtful.clear();
        for (first, (interval, a)) in self.intervals.iter().zip(differences).enumerate() {
            let b = differences.get(first + 1).unwrap_or(a);
            if a.abs().max(b.abs()) <= interval.certain {
                continue;
            }
            for SampleLimit { width, share } in &interval.samples {
                let difference = a + share * (b - a);
                let margin = width - difference.abs();
                if margin < -CERTAIN * noise {
                    outside += 1;
                    if outside > self.allowed {
                        return 0.0;
                    }
                } else if margin < CERTAIN * noise {
                    doubtful.push((*width, difference));
                }
            }
        }
        let doubtful = doubtful.iter();
        let inside = doubtful.map(|(width, difference)| normal::within(*width, *difference, noise));
        at_most_outside(inside, self.allowed - outside)
    }
}

/// Probability that at most `allowed` of independent samples are outside.
fn at_most_outside(inside: impl Iterator<Item = f64>, allowed: usize) -> f64 {
    if allowed == 0 {
        return inside.product();
    }
    let mut outside = vec![0.0; allowed + 1];
    outside[0] = 1.0;
    for (before, inside) in inside.enumerate() {
        // At most as many samples can be outside as were considered so far.
        for count in (1..=allowed.min(before + 1)).rev() {
            outside[count] = inside * outside[count] + (1.0 - inside) * outside[count - 1];
        }
        outside[0] *= inside;
    }
    outside.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_count_outside_is_that_of_the_binomial_distribution() {
        let inside = || [0.9; 10].into_iter();
        assert_relative_eq!(
            at_most_outside(inside(), 0),
            0.9_f64.powi(10),
            epsilon = 1e-12
        );
        let one = 10.0 * 0.1 * 0.9_f64.powi(9);
        let most_one = 0.9_f64.powi(10) + one;
        assert_relative_eq!(at_most_outside(inside(), 1), most_one, epsilon = 1e-12);
        assert_relative_eq!(at_most_outside(inside(), 10), 1.0, epsilon = 1e-12);
    }
}
