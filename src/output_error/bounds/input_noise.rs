//! Effect of the noise of measured surfaces and of a slow dynamic pressure on the estimates. The
//! equations take both as exact, so their noise moves the computed aircraft. Through a moment it is
//! integrated to slow errors. Derivatives follow these, but they are hardly visible in the
//! residuals beside the sensors' own noise.
//!
//! An error of one surface sample changes the gradient Σ Sᵀ W v of the cost in two ways: directly
//! through the outputs, and indirectly through the later states. Let S be the sensitivities, W the
//! weights and v the residuals. An adjoint λ = ∂(gradient)/∂(state), integrated backwards, contains
//! both effects. Let g_k be the change of the gradient with the surface at sample k. White noise of
//! variance σ² adds σ² Σ_k g_k g_kᵀ to the gradient's covariance. Surfaces act through three
//! coefficients, so three vectors g per sample suffice for any number of surfaces.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::{DMatrix, SMatrix};
use pulp::{Arch, Simd, WithSimd};

use super::block_series::BlockSeries;
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};
use crate::numerics::vectors::row_products::StridedRows;
use crate::numerics::vectors::simd::{AlignedBuffer, VECTOR, load, store};
use crate::output_error::case::Case;
use crate::output_error::case::blocks::samples_per_block;
use crate::output_error::case::chunking::CHUNK;
use crate::output_error::case::surface_noise::DerivativeValue;

/// Covariance of the gradient from the noise of the surfaces and the dynamic pressure, along the
/// measured motion, given the outputs' series.
#[must_use]
pub(super) fn gradient_covariance<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    parameters: &[f64],
    series: &[BlockSeries],
    weights: &[f64; OUTPUTS],
) -> DMatrix<f64> {
    let n = case.parameters();
    let width = n.next_multiple_of(VECTOR);
    if case.noisy_inputs.are_exact() || n == 0 {
        return DMatrix::zeros(n, n);
    }
    let mut covariance = AlignedBuffer::zeros(width * width);
    Arch::new().dispatch(Adjoint {
        case,
        parameters,
        series,
        weights,
        width,
        covariance: covariance.slice_mut(),
    });
    let lower = covariance.slice();
    DMatrix::from_fn(n, n, |i, j| lower[i.max(j) * width + i.min(j)])
}

/// Integration of the adjoint from the last block of samples to the first. Sensitivities change
/// little within a block, so all its samples respond alike to the noise.
struct Adjoint<'a, const NX: usize, E: Equations<NX>> {
    case: &'a Case<NX, E>,
    parameters: &'a [f64],
    series: &'a [BlockSeries],
    weights: &'a [f64; OUTPUTS],
    /// Number of parameters padded to whole vectors.
    width: usize,
    covariance: &'a mut [f64],
}

/// Slopes of one block, taken in its middle.
struct BlockSlopes<const NX: usize> {
    /// Slope of the state half a block later along the present state.
    half_block: SMatrix<f64, NX, NX>,
    /// Slopes of the weighted outputs along the states.
    outputs_by_state: SMatrix<f64, OUTPUTS, NX>,
    /// Slopes of the weighted outputs along the coefficients.
    outputs_by_coefficient: SMatrix<f64, OUTPUTS, COEFFICIENTS>,
    /// Slope of the next state along a coefficient that acts during one sample.
    state_by_coefficient: SMatrix<f64, NX, COEFFICIENTS>,
}

/// Let a be the adjoint at the end of a block, Ψ the slope of the state over half a block
/// (`half_block`), C and D the slopes of the weighted outputs along states and coefficients, B the
/// slope of the next state along a coefficient, y the block's sums of sensitivities, and w the
/// share of one sample. Each block has
///
/// - the part Ψᵀ a from the later blocks, and Cᵀ y from its own outputs, both in its middle;
/// - the adjoint Ψᵀ (Ψᵀ a + Cᵀ y) at its start;
/// - the change Bᵀ (Ψᵀ a + ½ Cᵀ y) + w Dᵀ y of the gradient with each coefficient.
impl<const NX: usize, E: Equations<NX>> WithSimd for Adjoint<'_, NX, E> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let width = self.width;
        let mut adjoint = AlignedBuffer::zeros(NX * width);
        let adjoint = adjoint.slice_mut();
        let mut rows = AlignedBuffer::zeros(CHUNK * COEFFICIENTS * width);
        let rows = rows.slice_mut();
        let whole_vectors = vec![VECTOR; width / VECTOR];
        let block_length = samples_per_block(self.case.step_s);
        let blocks = self.case.samples().div_ceil(block_length);
        for b in (0..blocks).rev() {
            let samples = block_length.min(self.case.samples() - b * block_length);
            let middle_sample = b * block_length + samples / 2;
            let slopes = self.slopes(middle_sample, samples);
            let root = cholesky_root(&self.coefficient_noise(middle_sample));
            // A sample has this share of its output's sums, and the block's samples together the
            // root of their number.
            let mut share = [0.0; OUTPUTS];
            for (share, series) in share.iter_mut().zip(self.series) {
                *share = 1.0 / (series.means.counts[b].max(1.0) * samples as f64).sqrt();
            }
            let root_of_samples = (samples as f64).sqrt();
            let row = b % CHUNK * COEFFICIENTS * width;
            for lane in (0..width).step_by(S::F64_LANES) {
                let mut by_coefficient = [simd.splat_f64s(0.0); COEFFICIENTS];
                let (mut from_later_blocks, mut from_outputs) =
                    ([simd.splat_f64s(0.0); NX], [simd.splat_f64s(0.0); NX]);
                let mut sums = [simd.splat_f64s(0.0); OUTPUTS];
                for (sums, series) in sums.iter_mut().zip(self.series) {
                    *sums = load::<S>(series.sensitivities.values(), b * width + lane);
                }
                for &(o, i) in E::OUTPUTS_BY_STATE {
                    let slope = simd.splat_f64s(slopes.outputs_by_state[(o, i)]);
                    from_outputs[i] = simd.mul_add_f64s(slope, sums[o], from_outputs[i]);
                }
                for &(o, c) in E::OUTPUTS_BY_COEFFICIENT {
                    let slope = simd.splat_f64s(share[o] * slopes.outputs_by_coefficient[(o, c)]);
                    by_coefficient[c] = simd.mul_add_f64s(slope, sums[o], by_coefficient[c]);
                }
                for j in 0..NX {
                    let s = load::<S>(adjoint, j * width + lane);
                    for i in 0..NX {
                        let slope = simd.splat_f64s(slopes.half_block[(j, i)]);
                        from_later_blocks[i] = simd.mul_add_f64s(slope, s, from_later_blocks[i]);
                    }
                }
                let mut at_block_start = [simd.splat_f64s(0.0); NX];
                for i in 0..NX {
                    // On average half of the block comes after a deflection in it.
                    let remaining = simd.mul_add_f64s(
                        simd.splat_f64s(0.5),
                        from_outputs[i],
                        from_later_blocks[i],
                    );
                    for c in 0..COEFFICIENTS {
                        let slope = simd.splat_f64s(slopes.state_by_coefficient[(i, c)]);
                        by_coefficient[c] = simd.mul_add_f64s(slope, remaining, by_coefficient[c]);
                    }
                    let at_middle = simd.add_f64s(from_later_blocks[i], from_outputs[i]);
                    for j in 0..NX {
                        let slope = simd.splat_f64s(slopes.half_block[(i, j)]);
                        at_block_start[j] = simd.mul_add_f64s(slope, at_middle, at_block_start[j]);
                    }
                }
                for i in 0..NX {
                    store::<S>(adjoint, i * width + lane, at_block_start[i]);
                }
                for c in 0..COEFFICIENTS {
                    let mut change = simd.splat_f64s(0.0);
                    for d in c..COEFFICIENTS {
                        let factor = simd.splat_f64s(root_of_samples * root[d][c]);
                        change = simd.mul_add_f64s(factor, by_coefficient[d], change);
                    }
                    store::<S>(rows, row + c * width + lane, change);
                }
            }
            if b % CHUNK == 0 {
                let changes = StridedRows {
                    values: rows,
                    stride: width,
                    vector_stride: VECTOR,
                    count: COEFFICIENTS * CHUNK.min(blocks - b),
                };
                changes.add_gram(simd, &whole_vectors, self.covariance, width);
            }
        }
    }
}

impl<const NX: usize, E: Equations<NX>> Adjoint<'_, NX, E> {
    /// Slopes of a block of some samples around the sample k.
    #[inline(always)]
    fn slopes(&self, k: usize, samples: usize) -> BlockSlopes<NX> {
        let case = self.case;
        let x = &case.motion.states[k];
        let build_up = case.build_up_at(self.parameters, 2 * k);
        let c = build_up.coefficients(x);
        let mut c_by_state = SMatrix::<f64, COEFFICIENTS, NX>::zeros();
        for k in 0..COEFFICIENTS {
            for i in 0..NX {
                c_by_state[(k, i)] = build_up.slope[k][i];
            }
        }
        let rates = E::rates(&case.motion.rate_inputs[2 * k], x, &c);
        let read = E::outputs(
            &case.motion.rate_inputs[2 * k],
            &case.motion.sensor_inputs[k],
            x,
            &c,
        );
        let half_s = 0.5 * samples as f64 * case.step_s;
        let a = (rates.by_state + rates.by_coefficient * c_by_state) * half_s;
        let square = a * a;
        let mut at = BlockSlopes {
            // exp(A t) to third order.
            half_block: SMatrix::identity() + a + square * 0.5 + square * a * (1.0 / 6.0),
            outputs_by_state: read.by_state + read.by_coefficient * c_by_state,
            outputs_by_coefficient: read.by_coefficient,
            state_by_coefficient: rates.by_coefficient * case.step_s,
        };
        for o in 0..OUTPUTS {
            at.outputs_by_state.row_mut(o).scale_mut(self.weights[o]);
            at.outputs_by_coefficient
                .row_mut(o)
                .scale_mut(self.weights[o]);
        }
        at
    }

    /// Covariance of the errors of the coefficients at a sample; the noise of each surface and of
    /// the dynamic pressure acts on all coefficients.
    #[inline(always)]
    fn coefficient_noise(&self, k: usize) -> [[f64; COEFFICIENTS]; COEFFICIENTS] {
        let mut covariance = [[0.0; COEFFICIENTS]; COEFFICIENTS];
        let inputs = &self.case.noisy_inputs;
        if inputs.pressure_variance > 0.0 {
            let build_up = self.case.build_up_at(self.parameters, 2 * k);
            let effects = build_up.coefficients(&self.case.motion.states[k]);
            add_product(&mut covariance, inputs.pressure_variance, &effects);
        }
        for surface in &inputs.surfaces {
            let mut effects = [0.0; COEFFICIENTS];
            for effect in &surface.effects {
                let value = match effect.value {
                    DerivativeValue::Free(j) => self.parameters[j],
                    DerivativeValue::Held(value) => value,
                };
                let factor = effect.factors.get(k).copied().unwrap_or(1.0);
                effects[effect.coefficient] += value * factor;
            }
            add_product(&mut covariance, surface.variance, &effects);
        }
        covariance
    }
}

/// Adds the covariance that one noise source causes by its effects.
#[inline(always)]
fn add_product(
    covariance: &mut [[f64; COEFFICIENTS]; COEFFICIENTS],
    variance: f64,
    effects: &[f64; COEFFICIENTS],
) {
    for (row, c) in covariance.iter_mut().zip(effects) {
        for (v, d) in row.iter_mut().zip(effects) {
            *v += variance * c * d;
        }
    }
}

/// Lower triangular L with L Lᵀ = a covariance (Cholesky); zero in columns without variance.
#[inline(always)]
fn cholesky_root(
    covariance: &[[f64; COEFFICIENTS]; COEFFICIENTS],
) -> [[f64; COEFFICIENTS]; COEFFICIENTS] {
    /// Share of a variance that rounding leaves, where there are fewer surfaces than coefficients.
    const ROUNDED_VARIANCE: f64 = 1e-14;
    let mut root = [[0.0; COEFFICIENTS]; COEFFICIENTS];
    for j in 0..COEFFICIENTS {
        for i in j..COEFFICIENTS {
            let products = root[i].iter().zip(&root[j]).take(j).map(|(a, b)| a * b);
            let left = covariance[i][j] - products.sum::<f64>();
            if i == j {
                root[j][j] = if left > ROUNDED_VARIANCE * covariance[j][j] {
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
    use crate::dynamics::tests::aircraft;
    use crate::dynamics::{Lateral, Longitudinal};
    use crate::flight::Record;
    use crate::output_error::bounds::bounded::Bounded;
    use crate::output_error::case::surface_noise::noisy_surfaces;
    use crate::output_error::case::{InitialState, Model};
    use crate::output_error::tests::{
        Noise, SAMPLES, TABLE, nothing_measured, record, signals, truth, window_of,
        with_noisy_surfaces,
    };

    /// Record with noise on every nth value of its dynamic pressure, and lines between them.
    fn slow_pressure(share: f64, every: usize, noise: &mut Noise) -> Record {
        let mut record = record();
        let series = record.signals.get_mut(crate::flight::signal::QBAR).unwrap();
        let nodes: Vec<f64> = (0..=SAMPLES / every + 1)
            .map(|_| share * noise.gaussian())
            .collect();
        for (k, value) in series.values.iter_mut().enumerate() {
            let part = (k % every) as f64 / every as f64;
            let (before, after) = (nodes[k / every], nodes[k / every + 1]);
            *value *= 1.0 + before + part * (after - before);
        }
        record
    }

    /// Source of noise for a comparison.
    #[derive(Clone, Copy)]
    enum Source {
        Surfaces { sd_deg: f64 },
        Pressure { share: f64, every: usize },
    }

    impl Source {
        fn record(self, noise: &mut Noise) -> Record {
            match self {
                Source::Surfaces { sd_deg } => with_noisy_surfaces(sd_deg, noise),
                Source::Pressure { share, every } => slow_pressure(share, every, noise),
            }
        }
    }

    /// Compares the scatter of the gradient over draws of the noise with its covariance; the last
    /// derivative is held.
    fn assert_gradient_scatters_as_computed<const NX: usize, E: Equations<NX>>(source: Source) {
        let (draws, mut noise) = (150, Noise(77));
        let truth = truth(E::AXIS);
        let ((held, value), free) = truth.split_last().unwrap();
        let model = Model {
            free: free.iter().map(|(d, _)| d).collect(),
            held: vec![(held, *value)],
            biases: vec![],
            initial_state: InitialState::Estimated,
        };
        let exact = signals();
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
                &window_of(&source.record(&mut noise)),
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
        match source {
            Source::Surfaces { .. } => {
                let once = window_of(&source.record(&mut noise));
                case.noisy_inputs.surfaces = noisy_surfaces(&aircraft(), &once, &model);
            }
            Source::Pressure { share, every } => {
                case.noisy_inputs.pressure_variance = every as f64 * share * share;
            }
        }
        let series = case.series(&response, &TABLE);
        let computed = gradient_covariance(&case, &parameters, &series, &TABLE);
        for (j, name) in case.names.iter().enumerate() {
            // 150 draws give a standard deviation to 6 %; the noise's size is an estimate to 5 %.
            let ratio = (scatter[j] / computed[(j, j)]).sqrt();
            assert!(
                (0.75..1.25).contains(&ratio),
                "{name}: scatter is {ratio:.2} of the computed one"
            );
        }
    }

    #[test]
    fn the_gradient_scatters_with_the_noise_of_the_surfaces() {
        let source = Source::Surfaces { sd_deg: 0.02 };
        assert_gradient_scatters_as_computed::<3, Longitudinal>(source);
        assert_gradient_scatters_as_computed::<4, Lateral>(source);
    }

    #[test]
    fn the_gradient_scatters_with_the_noise_of_a_slow_dynamic_pressure() {
        let source = Source::Pressure {
            share: 0.001,
            every: 4,
        };
        // Lateral coefficients swing about zero nearly as fast as the noise: there the computed scatter
        // is larger than the actual one.
        assert_gradient_scatters_as_computed::<3, Longitudinal>(source);
    }

    #[test]
    fn without_noise_on_the_surfaces_nothing_is_added() {
        let truth = truth(crate::aero::Axis::Longitudinal);
        let model = Model {
            free: truth.iter().map(|(d, _)| d).collect(),
            ..Model::default()
        };
        let still = signals();
        assert_eq!(noisy_surfaces(&aircraft(), &still, &model), []);
    }
}
