//! What noise of the measured surfaces does to the estimates. The equations take surfaces as exact,
//! so their noise flies the computed aircraft a little; through a moment it is integrated to slow
//! errors that residuals show hardly, beside the sensors' own noise, and that derivatives follow.
//!
//! The gradient Σ Sᵀ W v answers to an error of one sample of a surface through the outputs at once
//! and through the states that it leaves behind: an adjoint λ = ∂(gradient)/∂(state), run
//! backwards, has both. White noise of variance σ² then adds σ² Σ_k g_k g_kᵀ to the gradient's
//! covariance. However many surfaces there are, they reach the aircraft through three coefficients,
//! so three vectors g a sample are enough.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::{DMatrix, SMatrix};
use pulp::{Arch, Simd, WithSimd};

use super::coloured::Series;
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};
use crate::numerics::row_products::Rows;
use crate::numerics::simd::{Aligned, VECTOR, load, store};
use crate::output_error::case::Case;
use crate::output_error::case::blocks::samples_of_block;
use crate::output_error::case::chunking::CHUNK;
use crate::output_error::case::surface_noise::Value;

/// The gradient's covariance from the noise of the surfaces, along the measured motion, given the
/// outputs' series.
#[must_use]
pub(crate) fn gradient_covariance<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    parameters: &[f64],
    series: &[Series],
    weights: &[f64; OUTPUTS],
) -> DMatrix<f64> {
    let (n, width) = (
        case.parameters(),
        case.parameters().next_multiple_of(VECTOR),
    );
    if case.noisy_surfaces.is_empty() || n == 0 {
        return DMatrix::zeros(n, n);
    }
    let mut scatter = Aligned::zeros(width * width);
    let adjoint = Adjoint {
        case,
        parameters,
        series,
        weights,
        width,
        scatter: scatter.slice_mut(),
    };
    Arch::new().dispatch(adjoint);
    let at = |i: usize, j: usize| scatter.slice()[i.max(j) * width + i.min(j)];
    DMatrix::from_fn(n, n, at)
}

/// The adjoint's run from the last block of samples to the first. Sensitivities change little
/// within a block, so its samples answer alike to the noise.
struct Adjoint<'a, const NX: usize, E: Equations<NX>> {
    case: &'a Case<NX, E>,
    parameters: &'a [f64],
    series: &'a [Series],
    weights: &'a [f64; OUTPUTS],
    /// Parameters padded to whole vectors.
    width: usize,
    scatter: &'a mut [f64],
}

/// What the adjoint needs to know of one block, in its middle.
struct At<const NX: usize> {
    /// How a state leaves its mark on that half a block later.
    half: SMatrix<f64, NX, NX>,
    /// Slopes of the outputs along states and coefficients, times the outputs' weights.
    read: SMatrix<f64, OUTPUTS, NX>,
    direct: SMatrix<f64, OUTPUTS, COEFFICIENTS>,
    /// What a coefficient at one sample leaves in the state.
    driven: SMatrix<f64, NX, COEFFICIENTS>,
}

impl<const NX: usize, E: Equations<NX>> WithSimd for Adjoint<'_, NX, E> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let width = self.width;
        let mut adjoint = Aligned::zeros(NX * width);
        let adjoint = adjoint.slice_mut();
        let mut rows = Aligned::zeros(CHUNK * COEFFICIENTS * width);
        let rows = rows.slice_mut();
        let whole = vec![VECTOR; width / VECTOR];
        let block = samples_of_block(self.case.step_s);
        let blocks = self.case.samples().div_ceil(block);
        for b in (0..blocks).rev() {
            let samples = block.min(self.case.samples() - b * block);
            let middle = b * block + samples / 2;
            let at = self.at(middle, samples);
            let root = root(&self.noise(middle));
            // Each of the block's samples has this part of the outputs' sums, and all of them
            // together its square.
            let all = (samples as f64).sqrt();
            let mut part = [0.0; OUTPUTS];
            for (part, series) in part.iter_mut().zip(self.series) {
                *part = 1.0 / (series.counts[b].max(1.0) * samples as f64).sqrt();
            }
            let row = b % CHUNK * COEFFICIENTS * width;
            for lane in (0..width).step_by(S::F64_LANES) {
                let mut by_coefficient = [simd.splat_f64s(0.0); COEFFICIENTS];
                let (mut later, mut now) = ([simd.splat_f64s(0.0); NX], [simd.splat_f64s(0.0); NX]);
                let mut sums = [simd.splat_f64s(0.0); OUTPUTS];
                for (sums, series) in sums.iter_mut().zip(self.series) {
                    *sums = load::<S>(series.sensitivities.values(), b * width + lane);
                }
                for &(o, i) in E::OUTPUTS_BY_STATE {
                    now[i] = simd.mul_add_f64s(simd.splat_f64s(at.read[(o, i)]), sums[o], now[i]);
                }
                for &(o, c) in E::OUTPUTS_BY_COEFFICIENT {
                    let slope = simd.splat_f64s(part[o] * at.direct[(o, c)]);
                    by_coefficient[c] = simd.mul_add_f64s(slope, sums[o], by_coefficient[c]);
                }
                for j in 0..NX {
                    let s = load::<S>(adjoint, j * width + lane);
                    for i in 0..NX {
                        later[i] = simd.mul_add_f64s(simd.splat_f64s(at.half[(j, i)]), s, later[i]);
                    }
                }
                let mut before = [simd.splat_f64s(0.0); NX];
                for i in 0..NX {
                    // On average half of the block comes after a deflection in it.
                    let left = simd.mul_add_f64s(simd.splat_f64s(0.5), now[i], later[i]);
                    for c in 0..COEFFICIENTS {
                        let slope = simd.splat_f64s(at.driven[(i, c)]);
                        by_coefficient[c] = simd.mul_add_f64s(slope, left, by_coefficient[c]);
                    }
                    let middle = simd.add_f64s(later[i], now[i]);
                    for j in 0..NX {
                        before[j] =
                            simd.mul_add_f64s(simd.splat_f64s(at.half[(i, j)]), middle, before[j]);
                    }
                }
                for i in 0..NX {
                    store::<S>(adjoint, i * width + lane, before[i]);
                }
                for c in 0..COEFFICIENTS {
                    let mut answer = simd.splat_f64s(0.0);
                    for d in c..COEFFICIENTS {
                        answer = simd.mul_add_f64s(
                            simd.splat_f64s(all * root[d][c]),
                            by_coefficient[d],
                            answer,
                        );
                    }
                    store::<S>(rows, row + c * width + lane, answer);
                }
            }
            if b % CHUNK == 0 {
                let samples = COEFFICIENTS * CHUNK.min(blocks - b);
                Rows {
                    values: rows,
                    stride: width,
                    samples,
                }
                .add_squares(simd, &whole, self.scatter, width);
            }
        }
    }
}

impl<const NX: usize, E: Equations<NX>> Adjoint<'_, NX, E> {
    #[inline(always)]
    fn at(&self, k: usize, samples: usize) -> At<NX> {
        let case = self.case;
        let x = &case.states[k];
        let coefficients = case.coefficients_at(self.parameters, 2 * k);
        let c = coefficients.with(x);
        let mut c_by_state = SMatrix::<f64, COEFFICIENTS, NX>::zeros();
        for k in 0..COEFFICIENTS {
            for i in 0..NX {
                c_by_state[(k, i)] = coefficients.slope[k][i];
            }
        }
        let rates = E::rates(&case.known[2 * k], x, &c);
        let read = E::outputs(&case.known[2 * k], &case.sensed[k], x, &c);
        let half_s = 0.5 * samples as f64 * case.step_s;
        let by_state = (rates.by_state + rates.by_coefficient * c_by_state) * half_s;
        let square = by_state * by_state;
        let mut at = At {
            half: SMatrix::identity() + by_state + square * 0.5 + square * by_state * (1.0 / 6.0),
            read: read.by_state + read.by_coefficient * c_by_state,
            direct: read.by_coefficient,
            driven: rates.by_coefficient * case.step_s,
        };
        for o in 0..OUTPUTS {
            at.read.row_mut(o).scale_mut(self.weights[o]);
            at.direct.row_mut(o).scale_mut(self.weights[o]);
        }
        at
    }

    /// Covariance of the coefficients' errors at a sample: each surface's noise acts on all of them
    /// together.
    #[inline(always)]
    fn noise(&self, k: usize) -> [[f64; COEFFICIENTS]; COEFFICIENTS] {
        let mut covariance = [[0.0; COEFFICIENTS]; COEFFICIENTS];
        for surface in &self.case.noisy_surfaces {
            let mut shares = [0.0; COEFFICIENTS];
            for effect in &surface.effects {
                let value = match effect.value {
                    Value::Free(j) => self.parameters[j],
                    Value::Held(value) => value,
                };
                shares[effect.coefficient] += value * effect.factors.get(k).copied().unwrap_or(1.0);
            }
            for (c, row) in covariance.iter_mut().enumerate() {
                for (d, v) in row.iter_mut().enumerate() {
                    *v += surface.variance * shares[c] * shares[d];
                }
            }
        }
        covariance
    }
}

/// L with L Lᵀ = a covariance (Cholesky), zero in a column where nothing is left.
#[inline(always)]
fn root(covariance: &[[f64; COEFFICIENTS]; COEFFICIENTS]) -> [[f64; COEFFICIENTS]; COEFFICIENTS] {
    let mut root = [[0.0; COEFFICIENTS]; COEFFICIENTS];
    for j in 0..COEFFICIENTS {
        for i in j..COEFFICIENTS {
            let done: f64 = root[i]
                .iter()
                .zip(&root[j])
                .take(j)
                .map(|(a, b)| a * b)
                .sum();
            let left = covariance[i][j] - done;
            if i == j {
                // Of fewer surfaces than coefficients rounding is all that is left.
                root[j][j] = if left > 1e-14 * covariance[j][j] {
                    left.sqrt()
                } else {
                    0.0
                };
            } else if root[j][j] > 0.0 {
                root[i][j] = left / root[j][j];
            }
        }
    }
    root
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::aero::Derivative;
    use crate::dynamics::motion::MassProperties;
    use crate::dynamics::motion::Window;
    use crate::dynamics::tests::aircraft;
    use crate::dynamics::{Lateral, Longitudinal};
    use crate::flight::Record;
    use crate::output_error::bounds::data::Bounded;
    use crate::output_error::case::surface_noise::noisy_surfaces;
    use crate::output_error::case::{InitialState, Model};
    use crate::output_error::tests::{Noise, SAMPLES, TABLE, nothing_measured, record, truth};

    const SURFACES: [&str; 5] = ["de_deg", "dpv_deg", "da_deg", "dr_deg", "dyv_deg"];

    /// The record with white noise on its surfaces.
    fn noisy(sd_deg: f64, noise: &mut Noise) -> Record {
        let mut record = record();
        for name in SURFACES {
            let series = record.signals.get_mut(name).unwrap();
            series
                .values
                .iter_mut()
                .for_each(|v| *v += sd_deg * noise.gaussian());
        }
        record
    }

    fn window(record: &Record) -> Window {
        Window::cut(record, 0..SAMPLES, SURFACES, MassProperties::Recorded).unwrap()
    }

    /// The scatter of the gradient over draws of the surfaces' noise against what is said of it;
    /// the last derivative is held.
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
        let derivative = |name: &str| {
            free.iter()
                .find(|(d, _)| d.name == name)
                .map_or(0.0, |(_, v)| *v)
        };
        let parameters = case.starting_values(derivative);
        let mut response = case.response();
        case.respond(&parameters, &mut response).unwrap();
        case.measurements.values.clone_from(&response.outputs);
        let sensitivities = case.sensitivities(&parameters).unwrap();
        let mut scatter = vec![0.0; parameters.len()];
        let mut flown = case.response();
        for _ in 0..draws {
            let other = Case::<NX, E>::new(
                &aircraft(),
                &window(&noisy(sd_deg, &mut noise)),
                nothing_measured(),
                &model,
            );
            other.respond(&parameters, &mut flown).unwrap();
            let mut gradient = vec![0.0; parameters.len()];
            for (k, (y, moved)) in response.outputs.iter().zip(&flown.outputs).enumerate() {
                for o in 0..OUTPUTS {
                    let v = y[o] - moved[o];
                    gradient
                        .iter_mut()
                        .enumerate()
                        .for_each(|(j, g)| *g += TABLE[o] * v * sensitivities.at(k, o, j));
                }
            }
            for (s, g) in scatter.iter_mut().zip(&gradient) {
                *s += g * g / f64::from(draws);
            }
        }
        let ordered: Vec<&Derivative> = case
            .names
            .iter()
            .filter_map(|name| free.iter().map(|(d, _)| d).find(|d| d.name == *name))
            .collect();
        let once = window(&noisy(sd_deg, &mut noise));
        case.noisy_surfaces = noisy_surfaces(&aircraft(), &once, &ordered, &model.held);
        let series = case.series(&response, &TABLE);
        let said = gradient_covariance(&case, &parameters, &series, &TABLE);
        for (j, name) in case.names.iter().enumerate() {
            // 150 draws give a standard deviation to 6%, the noise's size is known to some 5%.
            let ratio = (scatter[j] / said[(j, j)]).sqrt();
            assert!(
                (0.75..1.25).contains(&ratio),
                "{name}: scatter is {ratio:.2} of what is said"
            );
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
