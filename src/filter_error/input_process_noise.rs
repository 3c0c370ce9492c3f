//! Noise of the measured inputs as noise of the states. The equations take surfaces and dynamic
//! pressure as exact. Their white noise therefore moves the computed aircraft; through a moment it
//! is integrated to slow errors.
//!
//! Let n be the error of an input at one sample, and e the change of the coefficients c per unit of
//! this input. The error changes the coefficients by e n, and the state x during a step Δt by Γ e
//! n, with Γ = ∂ẋ/∂c Δt. White errors of variance σ² give the states' noise the covariance Q = Σ σ²
//! (Γ e)(Γ e)ᵀ in a step, summed over the inputs. The filter uses the mean of Q over the maneuver.
//! The effects e are linear in the derivatives, so Q has exact slopes along them. The direct part
//! of the outputs' errors belongs to their own noise.

use nalgebra::SVector;

use super::riccati::StateMatrix;
use crate::dynamics::{COEFFICIENTS, Equations};
use crate::output_error::Case;
use crate::output_error::surface_noise::{DerivativeValue, NoisySurface};

/// Stride of the samples at which the effects are computed: enough for a mean.
const NOISE_STRIDE: usize = 16;

/// Noise of the inputs as noise of the states of a filter.
#[derive(Clone, Debug, Default)]
pub(super) struct InputNoise<const NX: usize> {
    /// One effect for each input at each of the selected samples.
    effects: Vec<StateEffect<NX>>,
}

/// Change of the state in a step by one standard deviation of an input's noise, over the root of the
/// number of samples.
#[derive(Clone, Debug)]
struct StateEffect<const NX: usize> {
    /// Part of the held derivatives.
    held: SVector<f64, NX>,
    /// Part per unit of each free derivative through which the input acts.
    free: Vec<(usize, SVector<f64, NX>)>,
}

impl<const NX: usize> InputNoise<NX> {
    /// Effect in the filter of a case.
    pub fn of<E: Equations<NX>>(case: &Case<NX, E>) -> Self {
        let inputs = &case.noisy_inputs;
        let samples = (0..case.samples()).step_by(NOISE_STRIDE);
        let share = 1.0 / samples.len().max(1) as f64;
        let mut effects = vec![];
        for sample in samples {
            let at = CaseSample::new(case, sample);
            let surfaces = inputs.surfaces.iter();
            effects.extend(surfaces.map(|surface| at.of_surface(surface, share)));
            if inputs.pressure_variance > 0.0 {
                effects.push(at.of_pressure(inputs.pressure_variance * share));
            }
        }
        InputNoise { effects }
    }

    /// `true` if the inputs are exact.
    pub fn is_zero(&self) -> bool {
        self.effects.is_empty()
    }

    /// Covariance of the states' noise in a step with these free derivatives.
    pub fn covariance(&self, derivatives: &[f64]) -> StateMatrix<NX> {
        let mut covariance = StateMatrix::zeros();
        for effect in &self.effects {
            let sum = effect.sum(derivatives);
            covariance += sum * sum.transpose();
        }
        covariance
    }

    /// Slopes of [`Self::covariance`] along the derivatives.
    pub fn covariance_slopes(&self, derivatives: &[f64]) -> Vec<StateMatrix<NX>> {
        let mut slopes = vec![StateMatrix::zeros(); derivatives.len()];
        for effect in &self.effects {
            let sum = effect.sum(derivatives);
            for (j, by_derivative) in &effect.free {
                let half = by_derivative * sum.transpose();
                slopes[*j] += half + half.transpose();
            }
        }
        slopes
    }
}

/// A sample of a case.
struct CaseSample<'a, const NX: usize, E: Equations<NX>> {
    case: &'a Case<NX, E>,
    sample: usize,
    /// Change Γ of the state in a step with each coefficient.
    by_coefficient: [SVector<f64, NX>; COEFFICIENTS],
}

impl<'a, const NX: usize, E: Equations<NX>> CaseSample<'a, NX, E> {
    fn new(case: &'a Case<NX, E>, sample: usize) -> Self {
        let inputs = &case.motion.rate_inputs[2 * sample];
        let rates = E::rates(inputs, &case.motion.states[sample], &[0.0; COEFFICIENTS]);
        let column = |k: usize| rates.by_coefficient.column(k) * case.step_s;
        CaseSample {
            case,
            sample,
            by_coefficient: std::array::from_fn(column),
        }
    }

    fn of_surface(&self, surface: &NoisySurface, share: f64) -> StateEffect<NX> {
        let deviation = (surface.variance * share).sqrt();
        let mut sum = StateEffect::none();
        for effect in &surface.effects {
            let factor = effect.factors.get(self.sample).copied().unwrap_or(1.0);
            let change = self.by_coefficient[effect.coefficient] * (factor * deviation);
            match effect.value {
                DerivativeValue::Free(j) => sum.free.push((j, change)),
                DerivativeValue::Held(value) => sum.held += change * value,
            }
        }
        sum
    }

    /// Effect of noise of the dynamic pressure, to which every coefficient's effect is
    /// proportional.
    fn of_pressure(&self, variance: f64) -> StateEffect<NX> {
        let deviation = variance.sqrt();
        let x = &self.case.motion.states[self.sample];
        let mut sum = StateEffect::none();
        let held = self.case.held.at(2 * self.sample).coefficients(x);
        for (column, value) in self.by_coefficient.iter().zip(held) {
            sum.held += column * (value * deviation);
        }
        let mut regressors = vec![0.0; self.case.derivatives()];
        self.case.regressors_at(2 * self.sample, x, &mut regressors);
        let terms = self.case.terms.iter().zip(regressors).enumerate();
        sum.free.extend(terms.map(|(j, (term, regressor))| {
            (
                j,
                self.by_coefficient[term.coefficient] * (regressor * deviation),
            )
        }));
        sum
    }
}

impl<const NX: usize> StateEffect<NX> {
    fn none() -> Self {
        StateEffect {
            held: SVector::zeros(),
            free: vec![],
        }
    }

    /// Effect with these free derivatives.
    fn sum(&self, derivatives: &[f64]) -> SVector<f64, NX> {
        let free = self.free.iter();
        free.fold(self.held, |sum, (j, by_derivative)| {
            sum + by_derivative * derivatives[*j]
        })
    }
}
