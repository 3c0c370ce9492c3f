//! Probability that a repeat flight passes: the posterior's uncertainty, the start and the sensors'
//! noise carried to the differences between aircraft and simulator.
//!
//! A repeat flight is flown by an aircraft of the posterior with the same surfaces. To first order its
//! outputs differ from those at the mean by the effects of the derivatives' deviations; the simulator's
//! differ by those of the errors of its matched start. Both effects are free runs. The noise of the
//! sensors is white and independent, so its part of the probability is exact for each draw.

use nalgebra::{DMatrix, DVector};
use pulp::Arch;

use super::derivative_table::DerivativeTable;
use super::deviations::independent;
use super::dutch_roll::{DutchRoll, LateralModes};
use super::free_run::{FreeRun, STATES, Simulation, Start};
use super::judgement::{Judged, Simulated, allowed_outside};
use super::outputs::{COUNT, Outputs, place};
use super::recording::Recording;
use super::specification::Tolerance;
use super::start::MatchedStart;
use crate::aero::{Axis, Buildup, Regressor};
use crate::model::{LocalKind, LocalPosterior, LocalValue};
use crate::numerics::normal;
use crate::numerics::random::RandomStream;

/// Seed of the draws.
const SEED: u64 = 60;

/// Longest step of the effects' free runs, s: a tenth of a radian of the fastest mode.
const LONGEST_STEP_S: f64 = 0.06;

/// Distance from the limit beyond which noise decides nothing, standard deviations.
const CERTAIN: f64 = 5.0;

/// Effects of independent standard normal deviates on the outputs, at every `stride`-th sample.
#[derive(Clone, Debug)]
pub struct Effects {
    stride: usize,
    /// Outputs at the mean of the posterior.
    mean: Vec<Outputs>,
    effects: Vec<Histories>,
    /// Deviations of the derivatives to which the first effects belong, by place in the build-up.
    deviations: Vec<Vec<(usize, f64)>>,
    /// Derivatives at the mean of the posterior.
    table: DerivativeTable,
}

/// History of each output. A draw sums hundreds of them, sample after sample.
pub type Histories = [Vec<f64>; COUNT];

/// Probabilities of one model: of each tolerance in the order of the tests, and of all requirements.
#[derive(Clone, Debug, PartialEq)]
pub struct Probabilities {
    pub tolerances: Vec<f64>,
    pub whole: f64,
}

impl Probabilities {
    /// Without the rounding errors of the sums.
    fn clamped(mut self) -> Probabilities {
        for probability in self.tolerances.iter_mut().chain([&mut self.whole]) {
            *probability = probability.clamp(0.0, 1.0);
        }
        self
    }
}

/// Free runs about that of the posterior's mean.
#[derive(Debug)]
pub struct MovedRuns<'a> {
    simulation: &'a Simulation<'a>,
    start: &'a Start,
    buildup: &'a Buildup,
    pub stride: usize,
    pub mean: FreeRun,
}

impl<'a> MovedRuns<'a> {
    #[must_use]
    pub fn new(
        simulation: &'a Simulation<'a>,
        start: &'a Start,
        buildup: &'a Buildup,
    ) -> MovedRuns<'a> {
        let recording = simulation.recording;
        let stride = if 2.0 * recording.step_s <= LONGEST_STEP_S {
            2
        } else {
            1
        };
        MovedRuns {
            simulation,
            start,
            buildup,
            stride,
            mean: simulation.fly(start, recording.samples, stride),
        }
    }

    /// Effect of a deviation of the derivatives, by place in the build-up.
    #[must_use]
    pub fn effect(&self, deviation: &[(usize, f64)]) -> Histories {
        let mut raised = self.simulation.clone();
        for (derivative, by) in deviation {
            let regressor = &self.buildup.derivatives[*derivative].regressor;
            raised.aerodynamics.table.raise(*derivative, regressor, *by);
        }
        self.difference(&raised, self.start)
    }

    /// Effect of another start.
    fn effect_of_start(&self, moved: &Start) -> Histories {
        self.difference(self.simulation, moved)
    }

    /// Effects of the independent errors of a matched start.
    pub fn effects_of_start(
        &self,
        covariance: &DMatrix<f64>,
        axis: Axis,
    ) -> impl Iterator<Item = Histories> {
        let moved = moved_starts(self.start, covariance, axis).into_iter();
        moved.map(|moved| self.effect_of_start(&moved))
    }

    fn difference(&self, simulation: &Simulation, start: &Start) -> Histories {
        let samples = self.simulation.recording.samples;
        difference(&simulation.fly(start, samples, self.stride), &self.mean)
    }
}

/// Flies the effects of a posterior's deviations and of the start's errors; `None` where the start is
/// not determined or nothing is known of the axis.
#[must_use]
pub fn effects(
    simulation: &Simulation,
    start: &MatchedStart,
    posterior: &LocalPosterior,
    (buildup, axis): (&Buildup, Axis),
) -> Option<Effects> {
    let covariance = start.covariance.as_ref()?;
    let runs = MovedRuns::new(simulation, &start.start, buildup);
    let deviations = deviations(posterior, buildup)?;
    let of_derivatives = deviations.iter().map(|deviation| runs.effect(deviation));
    let effects = of_derivatives.chain(runs.effects_of_start(covariance, axis));
    Some(Effects {
        effects: effects.collect(),
        stride: runs.stride,
        mean: runs.mean.outputs,
        deviations,
        table: simulation.aerodynamics.table.clone(),
    })
}

/// Places of the derivatives that move a simulation, among the values of a posterior and in the build-up.
#[must_use]
pub fn moving(posterior: &LocalPosterior, buildup: &Buildup) -> Vec<(usize, usize)> {
    let index = |value: &LocalValue| {
        let is_slope = value.kind == LocalKind::Derivative && !value.is_mach_slope;
        let mut derivatives = buildup.derivatives.iter();
        let index = derivatives.position(|d| is_slope && d.name == value.derivative)?;
        (buildup.derivatives[index].regressor != Regressor::Constant).then_some(index)
    };
    let values = posterior.values.iter().enumerate();
    values.filter_map(|(i, v)| Some((i, index(v)?))).collect()
}

/// Independent deviations of the derivatives; `None` where the posterior has none of the axis.
fn deviations(posterior: &LocalPosterior, buildup: &Buildup) -> Option<Vec<Vec<(usize, f64)>>> {
    let known = moving(posterior, buildup);
    if known.is_empty() {
        return None;
    }
    let covariance = DMatrix::from_fn(known.len(), known.len(), |i, j| {
        posterior.covariance[(known[i].0, known[j].0)]
    });
    let named = |deviation: DVector<f64>| {
        let pairs = known.iter().zip(deviation.iter());
        pairs
            .map(|((_, derivative), by)| (*derivative, *by))
            .collect()
    };
    Some(independent(&covariance).into_iter().map(named).collect())
}

/// Starts with one independent error of the axis's own parameters each.
fn moved_starts(start: &Start, covariance: &DMatrix<f64>, axis: Axis) -> Vec<Start> {
    // α, airspeed, q, θ with CN, Cm, CA; β, p, r, φ with CY, Cl, Cn.
    let parameters: [usize; 7] = match axis {
        Axis::Longitudinal => [0, 2, 4, 6, STATES, STATES + 1, STATES + 2],
        Axis::Lateral => [1, 3, 5, 7, STATES + 3, STATES + 4, STATES + 5],
    };
    let own = DMatrix::from_fn(7, 7, |i, j| covariance[(parameters[i], parameters[j])]);
    let moved = |deviation: DVector<f64>| {
        let parameters = parameters.iter().zip(deviation.iter());
        parameters.fold(start.clone(), |start, (parameter, by)| {
            start.moved(*parameter, *by)
        })
    };
    independent(&own).into_iter().map(moved).collect()
}

/// Difference of two runs; after a departure the last one stays.
fn difference(run: &FreeRun, mean: &FreeRun) -> Histories {
    std::array::from_fn(|i| {
        let mut last = 0.0;
        let at = |(k, mean): (usize, &Outputs)| {
            if let Some(own) = run.outputs.get(k) {
                last = own[i] - mean[i];
            }
            last
        };
        mean.outputs.iter().enumerate().map(at).collect()
    })
}

impl Effects {
    /// Probabilities that a repeat flight meets the tolerances, when a model's simulation predicts it. A
    /// run that departs meets none.
    #[must_use]
    pub fn probabilities(
        &self,
        (recording, modes): (&Recording, Option<&LateralModes>),
        simulated: &Simulated,
        judged: &[Judged],
        (draws, required_pct): (usize, f64),
    ) -> Probabilities {
        let mut sums = Probabilities {
            tolerances: vec![0.0; judged.len()],
            whole: 0.0,
        };
        if simulated.run.has_departed || self.mean.len() * self.stride < recording.samples {
            return sums;
        }
        let repeat = Repeat {
            effects: self,
            recording,
            modes,
            simulated,
            bias: self.bias(&simulated.run),
            required_pct,
        };
        let mut stream = RandomStream::new(SEED, &recording.start_s.to_string());
        for _ in 0..draws {
            let drawn = repeat.draw(judged, &mut stream);
            for (sum, inside) in sums.tolerances.iter_mut().zip(&drawn.tolerances) {
                *sum += inside / draws as f64;
            }
            sums.whole += drawn.whole / draws as f64;
        }
        sums.clamped()
    }

    /// Difference of a model's run from the mean of the posterior.
    fn bias(&self, run: &FreeRun) -> Histories {
        let own = run.outputs.iter().step_by(self.stride);
        let pairs = self.mean.iter().zip(own);
        std::array::from_fn(|i| pairs.clone().map(|(mean, own)| mean[i] - own[i]).collect())
    }

    /// Drawn deviation of a derivative.
    fn deviation(&self, derivative: usize, deviates: &[f64]) -> f64 {
        let own = self
            .deviations
            .iter()
            .zip(deviates)
            .map(|(deviation, deviate)| {
                let own = deviation.iter().find(|(i, _)| *i == derivative);
                own.map_or(0.0, |(_, by)| by * deviate)
            });
        own.sum()
    }

    /// Drawn differences of one quantity at every `stride`-th sample.
    fn drawn(&self, bias: &Histories, deviates: &[f64], tolerance: &Tolerance) -> Vec<f64> {
        let Some(output) = place(tolerance.quantity) else {
            return vec![];
        };
        let mut drawn = bias[output].clone();
        Arch::new().dispatch(|| {
            for (effect, deviate) in self.effects.iter().zip(deviates) {
                for (sum, effect) in drawn.iter_mut().zip(&effect[output]) {
                    *sum += deviate * effect;
                }
            }
        });
        drawn
    }
}

/// Repeat flights that one model's simulation predicts.
struct Repeat<'a> {
    effects: &'a Effects,
    recording: &'a Recording,
    modes: Option<&'a LateralModes>,
    simulated: &'a Simulated,
    bias: Histories,
    required_pct: f64,
}

impl Repeat<'_> {
    /// Probabilities of one aircraft and start, over the sensors' noise.
    fn draw(&self, judged: &[Judged], stream: &mut RandomStream) -> Probabilities {
        let effects = self.effects;
        let deviates: Vec<f64> = effects.effects.iter().map(|_| stream.normal()).collect();
        let dutch_roll = self.modes.and_then(|modes| {
            modes.of_repeat(&effects.table, |i| effects.deviation(i, &deviates), stream)
        });
        let inside = |own: &Judged| {
            let tolerance = &own.tolerance;
            if tolerance.quantity.is_of_dutch_roll() {
                return f64::from(u8::from(self.meets(dutch_roll, tolerance)));
            }
            let drawn = effects.drawn(&self.bias, &deviates, tolerance);
            let share = (tolerance, self.required_pct);
            inside(self.recording, &drawn, effects.stride, share)
        };
        let tolerances: Vec<f64> = judged.iter().map(inside).collect();
        let mut whole = 1.0;
        let mut rest = tolerances.as_slice();
        for requirement in judged.chunk_by(Judged::is_alternative) {
            let (own, others) = rest.split_at(requirement.len());
            whole *= 1.0 - own.iter().map(|inside| 1.0 - inside).product::<f64>();
            rest = others;
        }
        Probabilities { tolerances, whole }
    }

    /// `true` where the model's Dutch roll is within the tolerance of a repeat flight's.
    fn meets(&self, repeat: Option<DutchRoll>, tolerance: &Tolerance) -> bool {
        let value = |own: Option<DutchRoll>| own?.value(tolerance.quantity);
        let (repeat, model) = (value(repeat), value(self.simulated.model));
        let pair = repeat.zip(model);
        pair.is_some_and(|(repeat, model)| (repeat - model).abs() <= tolerance.width(repeat))
    }
}

/// Probability that the required share of samples is inside, over the sensors' noise.
fn inside(
    recording: &Recording,
    drawn: &[f64],
    stride: usize,
    (tolerance, required_pct): (&Tolerance, f64),
) -> f64 {
    let Some(output) = place(tolerance.quantity) else {
        return 0.0;
    };
    let noise = recording.noise[output];
    let (mut count, mut outside) = (0, 0);
    let mut doubtful = Vec::new();
    for sample in (0..recording.samples).filter(|k| !recording.repaired[*k][output]) {
        count += 1;
        let (low, share) = (sample / stride, (sample % stride) as f64 / stride as f64);
        let (a, b) = (drawn[low], drawn[(low + 1).min(drawn.len() - 1)]);
        let difference = a + share * (b - a);
        let width = tolerance.width(recording.measured[sample][output]);
        let margin = width - difference.abs();
        if margin < -CERTAIN * noise {
            outside += 1;
        } else if margin < CERTAIN * noise {
            doubtful.push((width, difference));
        }
    }
    let allowed = allowed_outside(count, required_pct);
    let Some(allowed) = allowed.checked_sub(outside) else {
        return 0.0;
    };
    let inside = doubtful.into_iter();
    let inside: Vec<f64> = inside
        .map(|(width, difference)| normal::within(width, difference, noise))
        .collect();
    at_most_outside(&inside, allowed)
}

/// Probability that at most `allowed` of independent samples are outside.
fn at_most_outside(inside: &[f64], allowed: usize) -> f64 {
    if allowed == 0 {
        return inside.iter().product();
    }
    let mut outside = vec![0.0; allowed + 1];
    outside[0] = 1.0;
    for inside in inside {
        for count in (0..=allowed).rev() {
            let fewer = if count > 0 { outside[count - 1] } else { 0.0 };
            outside[count] = inside * outside[count] + (1.0 - inside) * fewer;
        }
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
