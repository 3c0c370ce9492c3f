//! Gains of a maneuver's filter for given parameters, with their slopes along all of them where they are
//! wanted.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use std::marker::PhantomData;

use nalgebra::SMatrix;
use pulp::{Simd, WithSimd};

use super::gains::{
    ParameterSlope, Pattern, PatternGain, gains_of_patterns, steady_variance_slopes,
    steady_variances,
};
use super::input_process_noise::InputNoise;
use super::linearised::{Discrete, DiscreteSystem, Linearised};
use super::noise::{Noise, NoiseParameter};
use super::riccati::{NoisySystem, StateMatrix, SteadyFilter};
use crate::dynamics::{InGusts, OUTPUTS};
use crate::numerics::linear_algebra::small::product;

/// Computation of the gains, compiled for the processor at hand.
pub(super) struct GainComputation<'a, const NX: usize, E: InGusts<NX>> {
    pub linearised: &'a Linearised<NX>,
    pub input_noise: &'a InputNoise<NX>,
    pub patterns: &'a [Pattern],
    /// Time between two samples.
    pub step_s: f64,
    /// Values of the free derivatives.
    pub derivatives: &'a [f64],
    pub noise: Noise,
    /// Parameters of the noise with their numbers.
    pub noise_parameters: Vec<(usize, NoiseParameter)>,
    /// `false` for gains without slopes.
    pub with_slopes: bool,
    pub equations: PhantomData<E>,
}

impl<const NX: usize, E: InGusts<NX>> WithSimd for GainComputation<'_, NX, E> {
    type Output = Option<Vec<PatternGain<NX>>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let decay = decay_matrix::<NX, E>(self.noise.decay(self.step_s));
        let discrete = self.linearised.discrete(self.derivatives);
        let of_inputs = self.input_noise.covariance(self.derivatives);
        let system = NoisySystem {
            a: product(&discrete.system.step, &decay),
            c: discrete.system.outputs,
            q: self.noise.covariance::<NX, E>(self.step_s) + of_inputs,
            r: steady_variances(&self.noise, self.patterns),
        };
        let slopes = if self.with_slopes {
            self.slopes(&discrete, &decay)
        } else {
            Vec::new()
        };
        let has_no_noise = self.noise.has_no_gusts() && self.input_noise.is_zero();
        let filter = if has_no_noise {
            SteadyFilter::without_process_noise(system)
        } else {
            SteadyFilter::solve_system(system)?
        };
        gains_of_patterns(
            &filter,
            &self.noise,
            &slopes,
            &self.noise_parameters,
            self.patterns,
        )
    }
}

impl<const NX: usize, E: InGusts<NX>> GainComputation<'_, NX, E> {
    /// Slopes of the system along all parameters.
    #[inline(always)]
    fn slopes(
        &self,
        discrete: &DiscreteSystem<NX>,
        decay: &StateMatrix<NX>,
    ) -> Vec<ParameterSlope<NX>> {
        let of_inputs = self.input_noise.covariance_slopes(self.derivatives);
        let mut slopes = Vec::with_capacity(self.derivatives.len() + self.noise_parameters.len());
        for (parameter, (slope, q)) in discrete.slopes().iter().zip(of_inputs).enumerate() {
            slopes.push(ParameterSlope {
                parameter,
                system: derivative_slope(slope, q, decay),
            });
        }
        for (parameter, kind) in &self.noise_parameters {
            slopes.push(ParameterSlope {
                parameter: *parameter,
                system: self.noise_slope(*kind, &discrete.system),
            });
        }
        slopes
    }

    /// Slope of the system along a parameter of the noise.
    #[inline(always)]
    fn noise_slope(&self, kind: NoiseParameter, discrete: &Discrete<NX>) -> NoisySystem<NX> {
        let slope = self.noise.decay_slope(kind, self.step_s);
        NoisySystem {
            a: product(&discrete.step, &decay_matrix_slope::<NX, E>(slope)),
            c: SMatrix::zeros(),
            q: self.noise.covariance_slope::<NX, E>(kind, self.step_s),
            r: steady_variance_slopes(&self.noise, self.patterns, kind),
        }
    }
}

/// Matrix T by which the rotary gusts of the state decay in a step.
fn decay_matrix<const NX: usize, E: InGusts<NX>>(decay: f64) -> StateMatrix<NX> {
    let mut t = StateMatrix::identity();
    for &(rate, relative) in E::AIR_RELATIVE_RATES {
        t[(relative, relative)] = decay;
        t[(relative, rate)] = 1.0 - decay;
    }
    t
}

/// Slope of T along a parameter, from the slope of the decay.
fn decay_matrix_slope<const NX: usize, E: InGusts<NX>>(slope: f64) -> StateMatrix<NX> {
    let mut t = StateMatrix::zeros();
    for &(rate, relative) in E::AIR_RELATIVE_RATES {
        t[(relative, relative)] = slope;
        t[(relative, rate)] = -slope;
    }
    t
}

/// Slope of the system along a derivative; `q` is the slope of the noise of the states.
#[inline(always)]
fn derivative_slope<const NX: usize>(
    slope: &Discrete<NX>,
    q: StateMatrix<NX>,
    decay: &StateMatrix<NX>,
) -> NoisySystem<NX> {
    NoisySystem {
        a: product(&slope.step, decay),
        c: slope.outputs,
        q,
        r: [0.0; OUTPUTS],
    }
}
