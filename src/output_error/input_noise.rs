//! What noise of the measured surfaces does to the estimates. The equations take surfaces as exact, so their noise flies
//! the computed aircraft a little; through a moment it is integrated to slow errors that residuals show hardly, beside the
//! sensors' own noise, and that derivatives follow.
//!
//! The gradient Σ Sᵀ W v answers to an error of one sample of a surface through the outputs at once and through the states
//! that it leaves behind: an adjoint λ = ∂(gradient)/∂(state), run backwards, has both. White noise of variance σ² then
//! adds σ² Σ_k g_k g_kᵀ to the gradient's covariance.

use nalgebra::{DMatrix, DVector, Dyn, OMatrix, SMatrix};

use super::case::{Case, surface_factor};
use super::cost::add_square;
use super::response::Sensitivities;
use crate::aero::Derivative;
use crate::aircraft::Aircraft;
use crate::dynamics::motion::Window;
use crate::dynamics::{COEFFICIENTS, Equations, Motion, OUTPUTS};

/// A surface with noise: how much, and what it acts on.
#[derive(Clone, Debug, PartialEq)]
pub struct NoisySurface {
    variance: f64,
    effects: Vec<Effect>,
}

/// One derivative along the surface.
#[derive(Clone, Debug, PartialEq)]
struct Effect {
    coefficient: usize,
    value: Value,
    /// Coefficient per deflection and unit of the derivative, sample by sample.
    factors: Vec<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Value {
    /// A parameter.
    Free(usize),
    Held(f64),
}

/// Surfaces of a window that have noise. `free` are the derivatives in the order of the case's parameters.
#[must_use]
pub fn noisy_surfaces(
    aircraft: &Aircraft,
    window: &Window,
    free: &[&Derivative],
    held: &[(&Derivative, f64)],
) -> Vec<NoisySurface> {
    let motion: Vec<Motion> = window.motion(aircraft).step_by(2).collect();
    let free = free.iter().enumerate().map(|(j, d)| (*d, Value::Free(j)));
    let all: Vec<(&Derivative, Value)> = free.chain(held.iter().map(|(d, v)| (*d, Value::Held(*v)))).collect();
    let mut names: Vec<&str> = all.iter().filter_map(|(d, _)| d.regressor.surface()).collect();
    names.sort_unstable();
    names.dedup();
    let surface = |name: &&str| {
        let samples: Vec<f64> = window.signal(name).iter().step_by(2).copied().collect();
        let variance = white_variance(&samples);
        let acting = all.iter().filter(|(d, _)| d.regressor.surface() == Some(name));
        let effect = |(d, value): &(&Derivative, Value)| Effect {
            coefficient: d.coefficient.index(),
            value: *value,
            factors: motion.iter().map(|m| surface_factor(aircraft, m, d)).collect(),
        };
        (variance > 0.0).then(|| NoisySurface { variance, effects: acting.map(effect).collect() })
    };
    names.iter().filter_map(surface).collect()
}

/// Variance of the white noise on a signal that is otherwise smooth but for few steps: of third differences, which have
/// 1 + 9 + 9 + 1 times that of the noise, the median size decides.
#[must_use]
pub fn white_variance(samples: &[f64]) -> f64 {
    const MEDIAN_OF_NORMAL: f64 = 0.674_49;
    let mut sizes: Vec<f64> =
        samples.windows(4).map(|u| (u[3] - 3.0 * u[2] + 3.0 * u[1] - u[0]).abs()).filter(|d| d.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let median = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    (median / MEDIAN_OF_NORMAL).powi(2) / 20.0
}

/// The gradient's covariance from the noise of the surfaces, along the measured motion.
#[must_use]
pub(super) fn gradient_covariance<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    parameters: &[f64],
    sensitivities: &Sensitivities,
    weights: &[f64; OUTPUTS],
) -> DMatrix<f64> {
    let n = case.parameters();
    let mut scatter = DMatrix::zeros(n, n);
    if case.noisy_surfaces.is_empty() {
        return scatter;
    }
    let coefficients = case.with(parameters);
    let mut adjoint = OMatrix::<f64, nalgebra::Const<NX>, Dyn>::zeros(n);
    for k in (0..case.samples()).rev() {
        let x = &case.states[k];
        let (c, c_by_state) = coefficients.at(2 * k, x);
        let c_by_state = SMatrix::<f64, COEFFICIENTS, NX>::from_fn(|k, i| c_by_state[k][i]);
        let rates = E::rates(&case.known[2 * k], x, &c);
        let read = E::outputs(&case.known[2 * k], &case.sensed[k], x, &c);
        let weighted = weighted(case, sensitivities, weights, k);
        let by_state = (rates.by_state + rates.by_coefficient * c_by_state) * case.step_s;
        let transition = SMatrix::<f64, NX, NX>::identity() + by_state + by_state * by_state * 0.5;
        let later = transition.transpose() * &adjoint;
        let now = (read.by_state + read.by_coefficient * c_by_state).transpose() * &weighted;
        // A deflection is linear between samples: half of what it leaves behind is there at its own sample.
        let by_coefficient = rates.by_coefficient.transpose() * (&later + &now * 0.5) * case.step_s
            + read.by_coefficient.transpose() * &weighted;
        for surface in &case.noisy_surfaces {
            let answer = surface.answer(k, parameters, &by_coefficient);
            add_square(&mut scatter, surface.variance, answer.as_slice());
        }
        adjoint = later + now;
    }
    scatter.fill_upper_triangle_with_lower_triangle();
    scatter
}

/// W S of a sample, zero for outputs that do not count.
fn weighted<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    sensitivities: &Sensitivities,
    weights: &[f64; OUTPUTS],
    sample: usize,
) -> OMatrix<f64, nalgebra::Const<OUTPUTS>, Dyn> {
    let used = &case.measurements.used[sample];
    OMatrix::<f64, nalgebra::Const<OUTPUTS>, Dyn>::from_fn(case.parameters(), |o, j| {
        if used[o] { weights[o] * sensitivities.at(sample, o)[j] } else { 0.0 }
    })
}

impl NoisySurface {
    /// What the gradient does per deflection at one sample.
    fn answer(
        &self,
        sample: usize,
        parameters: &[f64],
        by_coefficient: &OMatrix<f64, nalgebra::Const<COEFFICIENTS>, Dyn>,
    ) -> DVector<f64> {
        let mut answer = DVector::zeros(by_coefficient.ncols());
        for effect in &self.effects {
            let value = match effect.value {
                Value::Free(j) => parameters[j],
                Value::Held(value) => value,
            };
            let share = value * effect.factors[sample];
            for (a, g) in answer.iter_mut().zip(by_coefficient.row(effect.coefficient).iter()) {
                *a += share * g;
            }
        }
        answer
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::super::tests::{Noise, SAMPLES, TABLE, nothing_measured, record, truth};
    use super::super::{InitialState, Model};
    use super::*;
    use crate::dynamics::motion::MassProperties;
    use crate::dynamics::tests::aircraft;
    use crate::dynamics::{Lateral, Longitudinal};
    use crate::flight::Record;

    const SURFACES: [&str; 5] = ["de_deg", "dpv_deg", "da_deg", "dr_deg", "dyv_deg"];

    /// The record with white noise on its surfaces.
    fn noisy(sd_deg: f64, noise: &mut Noise) -> Record {
        let mut record = record();
        for name in SURFACES {
            let series = record.signals.get_mut(name).unwrap();
            series.values.iter_mut().for_each(|v| *v += sd_deg * noise.gaussian());
        }
        record
    }

    fn window(record: &Record) -> Window {
        Window::cut(record, 0..SAMPLES, SURFACES, MassProperties::Recorded).unwrap()
    }

    #[test]
    fn white_noise_is_told_from_doublets_and_feedback() {
        let mut noise = Noise(5);
        let values: Vec<f64> = (0..800)
            .map(|k| 3.0 * f64::from(k / 100 % 2) + (0.1 * f64::from(k)).sin() + 0.05 * noise.gaussian())
            .collect();
        assert_relative_eq!(white_variance(&values).sqrt(), 0.05, max_relative = 0.1);
        let smooth: Vec<f64> = (0..800).map(|k| 3.0 * f64::from(k / 100 % 2) + (0.1 * f64::from(k)).sin()).collect();
        assert!(white_variance(&smooth).sqrt() < 1e-3);
        assert!(white_variance(&[]) == 0.0 && white_variance(&[f64::NAN; 9]) == 0.0);
    }

    /// The scatter of the gradient over draws of the surfaces' noise against what is said of it; the last derivative is
    /// held.
    fn scatter_is_as_said<const NX: usize, E: Equations<NX>>() {
        let (sd_deg, draws, mut noise) = (0.02, 150, Noise(77));
        let truth = truth(E::AXIS);
        let ((held, value), free) = truth.split_last().unwrap();
        let model = Model {
            free: free.iter().map(|(d, _)| d).collect(),
            held: vec![(held, *value)],
            biases: vec![],
            initial_state: InitialState::Estimated,
        };
        let exact = window(&record());
        let mut case = Case::<NX, E>::new(&aircraft(), &exact, nothing_measured(), &model);
        let derivative = |name: &str| free.iter().find(|(d, _)| d.name == name).map_or(0.0, |(_, v)| *v);
        let parameters = case.starting_values(derivative);
        let mut response = case.response();
        case.respond(&parameters, &mut response).unwrap();
        case.measurements.values.clone_from(&response.outputs);
        let sensitivities = case.sensitivities(&parameters).unwrap();
        let mut scatter = vec![0.0; parameters.len()];
        let mut flown = case.response();
        for _ in 0..draws {
            let other =
                Case::<NX, E>::new(&aircraft(), &window(&noisy(sd_deg, &mut noise)), nothing_measured(), &model);
            other.respond(&parameters, &mut flown).unwrap();
            let mut gradient = vec![0.0; parameters.len()];
            for (k, (y, moved)) in response.outputs.iter().zip(&flown.outputs).enumerate() {
                for o in 0..OUTPUTS {
                    let v = y[o] - moved[o];
                    gradient.iter_mut().zip(sensitivities.at(k, o)).for_each(|(g, s)| *g += TABLE[o] * v * s);
                }
            }
            for (s, g) in scatter.iter_mut().zip(&gradient) {
                *s += g * g / f64::from(draws);
            }
        }
        let ordered: Vec<&Derivative> =
            case.names.iter().filter_map(|name| free.iter().map(|(d, _)| d).find(|d| d.name == *name)).collect();
        let once = window(&noisy(sd_deg, &mut noise));
        case.noisy_surfaces = noisy_surfaces(&aircraft(), &once, &ordered, &model.held);
        let said = gradient_covariance(&case, &parameters, &sensitivities, &TABLE);
        for (j, name) in case.names.iter().enumerate() {
            // 150 draws give a standard deviation to 6%, the noise's size is known to some 5%.
            let ratio = (scatter[j] / said[(j, j)]).sqrt();
            assert!((0.75..1.25).contains(&ratio), "{name}: scatter is {ratio:.2} of what is said");
        }
    }

    #[test]
    fn the_gradient_scatters_with_the_noise_of_the_surfaces_as_said() {
        scatter_is_as_said::<3, Longitudinal>();
        scatter_is_as_said::<4, Lateral>();
    }

    #[test]
    fn without_noise_on_the_surfaces_nothing_is_added() {
        let truth = truth(crate::aero::Axis::Longitudinal);
        let free: Vec<&Derivative> = truth.iter().map(|(d, _)| d).collect();
        let still = window(&record());
        assert_eq!(noisy_surfaces(&aircraft(), &still, &free, &[]), []);
    }
}
