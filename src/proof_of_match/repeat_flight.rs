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
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use pulp::{Arch, Simd, WithSimd};

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
use crate::numerics::vectors::lanes::Lanes;
use crate::numerics::vectors::simd::{AlignedBuffer, VECTOR};

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
            simulated,
            bias: self.bias(&simulated.run),
        };
        let pairs = judged.iter().zip(limits);
        let inside: Vec<Vec<f64>> = pairs
            .map(|(own, limits)| repeat.inside(&own.tolerance, limits.as_ref()))
            .collect();
        let count = self.draws.len() as f64;
        for draw in 0..self.draws.len() {
            let tolerances: Vec<f64> = inside.iter().map(|own| own[draw]).collect();
            for (sum, inside) in sums.tolerances.iter_mut().zip(&tolerances) {
                *sum += inside / count;
            }
            sums.all_requirements += of_all_requirements(judged, &tolerances) / count;
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

    /// Slopes of one output: parameter by parameter, each sample. Zeros fill the last vector.
    fn slopes_of(&self, output: usize) -> AlignedBuffer {
        let width = self.width();
        let mut slopes = AlignedBuffer::zeros(self.slopes.len() * width);
        let rows = slopes.slice_mut().chunks_exact_mut(width);
        for (row, own) in rows.zip(&self.slopes) {
            row[..own[output].len()].copy_from_slice(&own[output]);
        }
        slopes
    }

    /// Number of the samples, padded to whole vectors.
    fn width(&self) -> usize {
        self.expected.len().next_multiple_of(VECTOR)
    }
}

/// Draws whose differences are summed side by side: one sum would wait for itself.
const SIDE_BY_SIDE: usize = 4;

/// Differences of some draws from a model's run, at the samples of one output.
struct DrawnDifferences<'a> {
    /// Difference of the expected repeat flight at each sample.
    bias: &'a [f64],
    /// Slopes, parameter by parameter.
    slopes: &'a [f64],
    /// Deviations of each parameter.
    deviations: &'a [[f64; SIDE_BY_SIDE]],
    /// Draw by draw, each sample.
    drawn: &'a mut [f64],
}

impl WithSimd for DrawnDifferences<'_> {
    type Output = ();

    #[expect(
        clippy::needless_range_loop,
        reason = "an iterator's functions are not inlined"
    )]
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let width = self.bias.len();
        for sample in (0..width).step_by(S::F64_LANES) {
            let mut sums = [Lanes::load(simd, self.bias, sample); SIDE_BY_SIDE];
            for parameter in 0..self.deviations.len() {
                let slope = Lanes::load(simd, self.slopes, parameter * width + sample);
                for draw in 0..SIDE_BY_SIDE {
                    sums[draw] = sums[draw] + slope * self.deviations[parameter][draw];
                }
            }
            for draw in 0..SIDE_BY_SIDE {
                sums[draw].store(self.drawn, draw * width + sample);
            }
        }
    }
}

/// Deviations of some draws, parameter by parameter; zeros in place of absent draws.
fn side_by_side(draws: &[Draw]) -> Vec<[f64; SIDE_BY_SIDE]> {
    let count = draws.first().map_or(0, |draw| draw.deviations.len());
    let of = |parameter: usize| {
        std::array::from_fn(|draw| draws.get(draw).map_or(0.0, |own| own.deviations[parameter]))
    };
    (0..count).map(of).collect()
}

/// Repeat flights compared with one model's simulation.
struct Repeat<'a> {
    repeats: &'a Repeats,
    simulated: &'a Simulated,
    bias: Histories,
}

impl Repeat<'_> {
    /// Probability of each draw that it meets a tolerance, over the sensors' noise. A tolerance of the
    /// Dutch roll has no limits of samples.
    fn inside(&self, tolerance: &Tolerance, limits: Option<&SampleLimits>) -> Vec<f64> {
        let draws = &self.repeats.draws;
        let Some(limits) = limits else {
            let meets = |draw: &Draw| self.meets(draw.dutch_roll, tolerance);
            return draws
                .iter()
                .map(|d| f64::from(u8::from(meets(d))))
                .collect();
        };
        let slopes = self.repeats.slopes_of(limits.output);
        let mut bias = self.bias[limits.output].clone();
        let width = self.repeats.width();
        bias.resize(width, 0.0);
        let mut drawn = AlignedBuffer::zeros(SIDE_BY_SIDE * width);
        let (mut inside, mut doubtful) = (Vec::with_capacity(draws.len()), Vec::new());
        for draws in draws.chunks(SIDE_BY_SIDE) {
            Arch::new().dispatch(DrawnDifferences {
                bias: &bias,
                slopes: slopes.slice(),
                deviations: &side_by_side(draws),
                drawn: drawn.slice_mut(),
            });
            let drawn = drawn.slice().chunks_exact(width).take(draws.len());
            inside.extend(drawn.map(|drawn| limits.inside(drawn, &mut doubtful)));
        }
        inside
    }

    /// `true` if the model's Dutch roll is within the tolerance of a repeat flight's.
    fn meets(&self, repeat: Option<DutchRoll>, tolerance: &Tolerance) -> bool {
        let value = |own: Option<DutchRoll>| own?.value(tolerance.quantity);
        let (repeat, model) = (value(repeat), value(self.simulated.model));
        let pair = repeat.zip(model);
        pair.is_some_and(|(repeat, model)| (repeat - model).abs() <= tolerance.width(repeat))
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
    output: usize,
    noise: f64,
    /// Samples that may be outside.
    allowed: usize,
    intervals: Vec<Interval>,
}

/// Samples between two samples of the effects.
struct Interval {
    /// Samples of the effects on either side.
    ends: [usize; 2],
    /// Size of both effects up to which noise moves none of the samples outside.
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
        let last = recording.samples.div_ceil(stride).saturating_sub(1);
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
                ends: [first, (first + 1).min(last)],
                certain: (least_width - CERTAIN * noise) / BETWEEN,
                samples,
            }
        };
        let intervals: Vec<Interval> = (0..=last).map(interval).collect();
        let counted = intervals.iter().map(|own| own.samples.len()).sum();
        SampleLimits {
            output,
            noise,
            allowed: allowed_outside(counted, required_pct),
            intervals,
        }
    }

    /// Probability that the required share of samples is inside, over the sensors' noise. The memory of
    /// `doubtful` is used again from draw to draw.
    fn inside(&self, drawn: &[f64], doubtful: &mut Vec<(f64, f64)>) -> f64 {
        let noise = self.noise;
        let mut outside = 0;
        doubtful.clear();
        for interval in &self.intervals {
            let [first, last] = interval.ends;
            let (a, b) = (drawn[first], drawn[last]);
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
