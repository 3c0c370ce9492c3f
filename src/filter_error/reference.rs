//! The filter's pass in plain scalar code: the same results as the kernel, without vectors.
//!
//! Read this before `pass`. Equations (1) to (4) are those of the module's head. Steps and outputs
//! are output error's plain ones ([`Reference`]); between them the measurements correct the state
//! and its sensitivities. The tests compare the kernel with this pass on both axes.

use nalgebra::SVector;

use super::filter::Filter;
use super::gains::PatternGain;
use crate::dynamics::{InGusts, OUTPUTS};
use crate::output_error::kernel::reference::{Augmented, PlainSums, Reference};

/// Plain pass of a filter over its maneuver.
pub(super) struct PlainFilter<'a, const NX: usize, E: InGusts<NX>> {
    pub filter: &'a Filter<NX, E>,
    /// Equations of the filter's case.
    pub equations: Reference<'a, NX, E>,
}

/// Outputs y of a predicted state, and their slopes along each parameter.
struct Predicted {
    y: [f64; OUTPUTS],
    slopes: Vec<SVector<f64, OUTPUTS>>,
}

impl<const NX: usize, E: InGusts<NX>> PlainFilter<'_, NX, E> {
    /// Runs the filter with the gains of its patterns. The sums are those of the whitened
    /// innovations L⁻¹ v and their sensitivities L⁻¹ y. With S = L Lᵀ, v' S⁻¹ v of (4) is the square
    /// of L⁻¹ v.
    pub fn run(&self, parameters: &[f64], gains: &[PatternGain<NX>]) -> PlainSums {
        let measurements = &self.filter.case.measurements;
        let (_, pattern_of) = self.filter.patterns();
        let mut sums = PlainSums::zeros(parameters.len());
        let mut state = self.first_state(parameters);
        for (sample, pattern) in pattern_of.iter().enumerate() {
            let predicted = self.outputs(sample, parameters, &state);
            let (z, used) = (&measurements.values[sample], &measurements.used[sample]);
            // (2): zero where a sample does not count.
            let v = SVector::from_fn(|o, _| if used[o] { z[o] - predicted.y[o] } else { 0.0 });
            let gain = &gains[usize::from(*pattern)];
            add_whitened(&mut sums, gain, &v, &predicted.slopes);
            sums.outputs.push(predicted.y);
            if sample + 1 < pattern_of.len() {
                let corrected = corrected(gain, &state, &v, &predicted.slopes);
                let decayed = self.decayed(parameters, &corrected);
                // (1)
                state = self.equations.step(sample, parameters, &decayed);
            }
        }
        sums
    }

    /// State at the first sample, without rotary gusts. Each free initial state depends on itself.
    fn first_state(&self, parameters: &[f64]) -> Augmented<NX> {
        let states = E::states_in_still_air();
        let first = self.filter.first_noise() - states;
        let (mut x, mut s) = (SVector::zeros(), vec![SVector::zeros(); parameters.len()]);
        for i in 0..states {
            x[i] = parameters[first + i];
            s[first + i][i] = 1.0;
        }
        let without_gusts = |x| E::decayed(x, 0.0);
        Augmented {
            x: without_gusts(x),
            s: s.into_iter().map(without_gusts).collect(),
        }
    }

    /// Outputs of a predicted state with the biases, and their slopes.
    fn outputs(&self, sample: usize, parameters: &[f64], state: &Augmented<NX>) -> Predicted {
        let (mut y, slopes) = self.equations.outputs(sample, parameters, state);
        let along = |j: usize| SVector::from_fn(|o, _| slopes[o][j]);
        let mut slopes: Vec<_> = (0..parameters.len()).map(along).collect();
        let first = self.filter.case.derivatives();
        for (b, &o) in self.filter.biased_outputs().iter().enumerate() {
            y[o] += parameters[first + b];
            slopes[first + b][o] += 1.0;
        }
        Predicted { y, slopes }
    }

    /// Decay T of the rotary gusts g in (1): T x̃, with the sensitivity T s + dT g.
    fn decayed(&self, parameters: &[f64], corrected: &Augmented<NX>) -> Augmented<NX> {
        let (noise, step_s) = (self.filter.noise(parameters), self.filter.case.step_s);
        let decay = noise.decay(step_s);
        let decayed = |x: &SVector<f64, NX>| E::decayed(*x, decay);
        let mut state = Augmented {
            x: decayed(&corrected.x),
            s: corrected.s.iter().map(decayed).collect(),
        };
        let of_noise = self.filter.noise_parameters().iter();
        for (j, parameter) in (self.filter.first_noise()..).zip(of_noise) {
            let slope = noise.decay_slope(*parameter, step_s);
            for &(rate, relative) in E::AIR_RELATIVE_RATES {
                let gust = corrected.x[relative] - corrected.x[rate];
                state.s[j][relative] += slope * gust;
            }
        }
        state
    }
}

/// Corrected state (3), with the sensitivity s − K y + dK v. K y has a minus sign because an
/// innovation falls as its prediction rises.
fn corrected<const NX: usize>(
    gain: &PatternGain<NX>,
    predicted: &Augmented<NX>,
    v: &SVector<f64, OUTPUTS>,
    slopes: &[SVector<f64, OUTPUTS>],
) -> Augmented<NX> {
    let along = predicted.s.iter().zip(slopes);
    let mut state = Augmented {
        x: predicted.x + gain.gain * v,
        s: along.map(|(s, y)| s - gain.gain * y).collect(),
    };
    for slope in &gain.slopes {
        state.s[slope.parameter] += slope.gain * v;
    }
    state
}

/// Adds a sample to the sums.
fn add_whitened<const NX: usize>(
    sums: &mut PlainSums,
    gain: &PatternGain<NX>,
    v: &SVector<f64, OUTPUTS>,
    slopes: &[SVector<f64, OUTPUTS>],
) {
    let white = gain.whitening * v;
    let slopes: Vec<_> = slopes.iter().map(|y| gain.whitening * y).collect();
    sums.weighted_square += white.norm_squared();
    for (i, a) in slopes.iter().enumerate() {
        sums.gradient[i] += a.dot(&white);
        for (j, b) in slopes.iter().enumerate() {
            sums.information[(i, j)] += a.dot(b);
        }
    }
}
