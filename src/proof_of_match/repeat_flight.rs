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

use pulp::Arch;

use super::dutch_roll::{DutchRoll, LateralModes};
use super::free_run::{FreeRun, Simulation};
use super::judgement::{Judged, Simulated, allowed_outside};
use super::linear_run::Histories;
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

/// Repeat flights about the mean of a posterior, at every `stride`-th sample.
#[derive(Clone, Debug)]
pub struct Repeats {
    stride: usize,
    /// Expected outputs of a repeat flight: those at the mean of the posterior, and the deficiency.
    expected: Vec<Outputs>,
    /// Slopes of the outputs along the derivatives and the parameters of the start.
    slopes: Vec<Histories>,
    /// Repeat flights, which all models share.
    draws: Vec<Draw>,
}

/// Drawn aircraft and start of a repeat flight.
#[derive(Clone, Debug)]
struct Draw {
    /// Deviations of the derivatives and of the start's parameters.
    deviations: Vec<f64>,
    /// Dutch roll according to the estimates of the repeat flight.
    dutch_roll: Option<DutchRoll>,
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

/// Draws repeat flights about the mean of a posterior; `mean` is the run at the mean in short
/// steps. `None` if the start is not determined or the axis has no posterior.
#[must_use]
pub fn repeats(
    (simulation, start): (&Simulation, &MatchedStart),
    mean: &FreeRun,
    (posterior, modes): (&LocalPosterior, Option<&LateralModes>),
    model: (&AeroModel, Axis),
    draws: usize,
) -> Option<Repeats> {
    let about = MeanRun::fly((simulation, start), posterior, model)?;
    if about.derivatives.is_empty() {
        return None;
    }
    let recording = simulation.recording;
    let (values, derivatives): (Vec<usize>, Vec<usize>) = about.derivatives.iter().copied().unzip();
    let root = continuous_root(&of_places(&posterior.covariance, &values));
    let root_of_start = continuous_root(&about.start_covariance);
    // Long steps do for the slopes; the mean is compared with runs in short ones.
    let mut expected: Vec<Outputs> = mean.outputs.iter().copied().step_by(about.stride).collect();
    let deficiency = about.deficiency(recording, &expected, [&root, &root_of_start]);
    for (expected, deficiency) in expected.iter_mut().zip(deficiency) {
        for (output, own) in deficiency.into_iter().enumerate() {
            expected[output] += own;
        }
    }
    let mut stream = RandomStream::new(SEED, &recording.start_s.to_string());
    let draw = |_| {
        let drawn = stream.deviations(&root);
        let dutch_roll = modes.and_then(|modes| {
            let deviation = |derivative: usize| {
                let own = derivatives.iter().position(|own| *own == derivative);
                own.map_or(0.0, |own| drawn[own])
            };
            let table = &simulation.aerodynamics.table;
            modes.of_repeat(table, deviation, &mut stream)
        });
        let of_start = stream.deviations(&root_of_start);
        Draw {
            deviations: drawn.iter().chain(&of_start).copied().collect(),
            dutch_roll,
        }
    };
    let draws = (0..draws).map(draw).collect();
    Some(Repeats {
        slopes: about.slopes,
        stride: about.stride,
        expected,
        draws,
    })
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
        let limits = judged.iter().map(|own| {
            let output = output_index(own.tolerance.quantity)?;
            let stated = (&own.tolerance, output);
            Some(SampleLimits::new(
                recording,
                stated,
                self.stride,
                required_pct,
            ))
        });
        let repeat = Repeat {
            repeats: self,
            judged,
            limits: limits.collect(),
            simulated,
            bias: self.bias(&simulated.run),
        };
        let count = self.draws.len() as f64;
        for draw in &self.draws {
            let drawn = repeat.probabilities(draw);
            for (sum, inside) in sums.tolerances.iter_mut().zip(&drawn.tolerances) {
                *sum += inside / count;
            }
            sums.all_requirements += drawn.all_requirements / count;
        }
        sums.clamped()
    }

    /// Difference of the expected repeat flight from a model's run.
    fn bias(&self, run: &FreeRun) -> Histories {
        let own = run.outputs.iter().step_by(self.stride);
        let pairs = self.expected.iter().zip(own);
        std::array::from_fn(|i| {
            pairs
                .clone()
                .map(|(expected, own)| expected[i] - own[i])
                .collect()
        })
    }

    /// Drawn differences of one output at every `stride`-th sample.
    fn drawn(&self, bias: &Histories, deviations: &[f64], output: usize) -> Vec<f64> {
        let mut drawn = bias[output].clone();
        Arch::new().dispatch(|| {
            for (slopes, deviation) in self.slopes.iter().zip(deviations) {
                for (sum, slope) in drawn.iter_mut().zip(&slopes[output]) {
                    *sum += deviation * slope;
                }
            }
        });
        drawn
    }
}

/// Repeat flights compared with one model's simulation.
struct Repeat<'a> {
    repeats: &'a Repeats,
    judged: &'a [Judged<'a>],
    /// Limits of each tolerance; `None` for one of the Dutch roll.
    limits: Vec<Option<SampleLimits>>,
    simulated: &'a Simulated,
    bias: Histories,
}

impl Repeat<'_> {
    /// Probabilities of one aircraft and start, over the sensors' noise.
    fn probabilities(&self, draw: &Draw) -> Probabilities {
        let repeats = self.repeats;
        let inside = |(own, limits): (&Judged, &Option<SampleLimits>)| match limits {
            None => f64::from(u8::from(self.meets(draw.dutch_roll, &own.tolerance))),
            Some(limits) => {
                limits.inside(&repeats.drawn(&self.bias, &draw.deviations, limits.output))
            }
        };
        let tolerances: Vec<f64> = self.judged.iter().zip(&self.limits).map(inside).collect();
        let mut all_requirements = 1.0;
        let mut rest = tolerances.as_slice();
        for requirement in self.judged.chunk_by(Judged::is_alternative) {
            let (own, others) = rest.split_at(requirement.len());
            all_requirements *= 1.0 - own.iter().map(|inside| 1.0 - inside).product::<f64>();
            rest = others;
        }
        Probabilities {
            tolerances,
            all_requirements,
        }
    }

    /// `true` if the model's Dutch roll is within the tolerance of a repeat flight's.
    fn meets(&self, repeat: Option<DutchRoll>, tolerance: &Tolerance) -> bool {
        let value = |own: Option<DutchRoll>| own?.value(tolerance.quantity);
        let (repeat, model) = (value(repeat), value(self.simulated.model));
        let pair = repeat.zip(model);
        pair.is_some_and(|(repeat, model)| (repeat - model).abs() <= tolerance.width(repeat))
    }
}

/// Limits of a tolerance at the samples that count.
struct SampleLimits {
    output: usize,
    noise: f64,
    /// Samples that may be outside.
    allowed: usize,
    samples: Vec<SampleLimit>,
}

/// Limit at one sample.
struct SampleLimit {
    width: f64,
    /// Samples of the effects on either side of this one, and its fractional position between them.
    between: [usize; 2],
    share: f64,
}

impl SampleLimits {
    fn new(
        recording: &ManeuverRecording,
        (tolerance, output): (&Tolerance, usize),
        stride: usize,
        required_pct: f64,
    ) -> SampleLimits {
        let last = recording.samples.div_ceil(stride).saturating_sub(1);
        let limit = |sample: usize| SampleLimit {
            width: tolerance.width(recording.measured[sample][output]),
            between: [sample / stride, (sample / stride + 1).min(last)],
            share: (sample % stride) as f64 / stride as f64,
        };
        let counted = (0..recording.samples).filter(|k| !recording.repaired[*k][output]);
        let samples: Vec<SampleLimit> = counted.map(limit).collect();
        SampleLimits {
            output,
            noise: recording.noise[output],
            allowed: allowed_outside(samples.len(), required_pct),
            samples,
        }
    }

    /// Probability that the required share of samples is inside, over the sensors' noise.
    fn inside(&self, drawn: &[f64]) -> f64 {
        let noise = self.noise;
        let mut outside = 0;
        let mut doubtful = Vec::new();
        for SampleLimit {
            width,
            between,
            share,
        } in &self.samples
        {
            let [a, b] = between.map(|k| drawn[k]);
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
        let inside = doubtful.into_iter();
        let inside: Vec<f64> = inside
            .map(|(width, difference)| normal::within(width, difference, noise))
            .collect();
        at_most_outside(&inside, self.allowed - outside)
    }
}

/// Probability that at most `allowed` of independent samples are outside.
fn at_most_outside(inside: &[f64], allowed: usize) -> f64 {
    if allowed == 0 {
        return inside.iter().product();
    }
    let mut outside = vec![0.0; allowed + 1];
    outside[0] = 1.0;
    for (before, inside) in inside.iter().enumerate() {
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
        let inside = [0.9; 10];
        assert_relative_eq!(
            at_most_outside(&inside, 0),
            0.9_f64.powi(10),
            epsilon = 1e-12
        );
        let one = 10.0 * 0.1 * 0.9_f64.powi(9);
        let most_one = 0.9_f64.powi(10) + one;
        assert_relative_eq!(at_most_outside(&inside, 1), most_one, epsilon = 1e-12);
        assert_relative_eq!(at_most_outside(&inside, 10), 1.0, epsilon = 1e-12);
    }
}
