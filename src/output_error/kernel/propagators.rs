//! Propagators: exact effect of a Runge-Kutta step on sensitivities, for the steps of a chunk side
//! by side in the lanes of vectors.
//!
//! | symbol | quantity |
//! |---|---|
//! | h | step, s |
//! | A_j, B_j | slopes of the rates at stage j along states and coefficients |
//! | r_j | regressor of a derivative at stage j |
//! | M_j | change of the state at the end of the step with the rates of stage j |
//!
//! A step changes the sensitivities s of the states to s ← Φ s + Σ_j Γ_j r_j, with Φ = 1 + Σ_j M_j
//! A_j and Γ_j = M_j B_j. The rates of a stage act on the end of the step directly, and through the
//! later stages that start from them:
//!
//! M₄ = h/6, M₃ = h/3 + h M₄A₄, M₂ = h/3 + h/2 M₃A₃, M₁ = h/6 + h/2 M₂A₂.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::SVector;
use pulp::Simd;

use super::chunk_build_up::ChunkBuildUp;
use super::trajectory::StageHistory;
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};
use crate::numerics::runge_kutta::{STAGES, reaches_s, weights_s};
use crate::numerics::vectors::simd::{load, store};
use crate::output_error::case::Case;
use crate::output_error::case::chunking::CHUNK;

/// Propagators and output slopes of a chunk: entry by entry, sample after sample.
#[repr(align(64))]
pub(crate) struct Propagators<const NX: usize> {
    /// Matrix Φ, by state after and state before the step.
    pub phi: [[[f64; CHUNK]; NX]; NX],
    /// Matrices Γ, by stage, coefficient and state.
    pub gamma: [[[[f64; CHUNK]; NX]; COEFFICIENTS]; STAGES],
    /// Total slopes C of the outputs along the states.
    pub c: [[[f64; CHUNK]; NX]; OUTPUTS],
    /// Slopes D of the outputs along the coefficients.
    pub d: [[[f64; CHUNK]; COEFFICIENTS]; OUTPUTS],
}

impl<const NX: usize> Propagators<NX> {
    pub const ZERO: Propagators<NX> = Propagators {
        phi: [[[0.0; CHUNK]; NX]; NX],
        gamma: [[[[0.0; CHUNK]; NX]; COEFFICIENTS]; STAGES],
        c: [[[0.0; CHUNK]; NX]; OUTPUTS],
        d: [[[0.0; CHUNK]; COEFFICIENTS]; OUTPUTS],
    };

    /// Computes the outputs at a sample of the chunk and its state, and records their slopes. `sample`
    /// counts in the maneuver, `k` in the chunk.
    #[inline(always)]
    pub fn read_outputs<E: Equations<NX>>(
        &mut self,
        case: &Case<NX, E>,
        build_up: &ChunkBuildUp<NX>,
        x: &SVector<f64, NX>,
        sample: usize,
        k: usize,
    ) -> [f64; OUTPUTS] {
        let c = build_up.coefficients::<E>(2 * k, x);
        let inputs = &case.motion.rate_inputs[2 * sample];
        let read = E::outputs(inputs, &case.motion.sensor_inputs[sample], x, &c);
        for &(o, c) in E::OUTPUTS_BY_COEFFICIENT {
            self.d[o][c][k] = read.by_coefficient[(o, c)];
        }
        let slopes = build_up.total_slopes::<E, OUTPUTS>(
            2 * k,
            read.by_state,
            &read.by_coefficient,
            E::OUTPUTS_BY_COEFFICIENT,
        );
        for &(o, i) in E::OUTPUTS_BY_STATE {
            self.c[o][i][k] = slopes[(o, i)];
        }
        read.outputs.into()
    }

    /// Computes Φ and Γ of a chunk's steps.
    #[inline(always)]
    pub fn set_steps<S: Simd, E: Equations<NX>>(
        &mut self,
        simd: S,
        history: &StageHistory<NX>,
        samples: usize,
        step_s: f64,
    ) {
        let (reaches, weights) = (reaches_s(step_s), weights_s(step_s));
        for at in (0..samples).step_by(S::F64_LANES) {
            let (mut m, mut product) = (
                [[simd.splat_f64s(0.0); NX]; NX],
                [[simd.splat_f64s(0.0); NX]; NX],
            );
            let mut phi = [[simd.splat_f64s(0.0); NX]; NX];
            // M of the last stage is its weight alone.
            let last = simd.splat_f64s(weights[STAGES - 1]);
            for &(i, k) in E::RATES_BY_COEFFICIENT {
                let b = load::<S>(&history.b[STAGES - 1][i][k], at);
                store::<S>(
                    &mut self.gamma[STAGES - 1][k][i],
                    at,
                    simd.mul_f64s(last, b),
                );
            }
            for i in 0..NX {
                for j in 0..NX {
                    if E::HAS_SLOPE_BY_STATE[i][j] {
                        let a = load::<S>(&history.a[STAGES - 1][i][j], at);
                        product[i][j] = simd.mul_f64s(last, a);
                        phi[i][j] = product[i][j];
                    }
                }
            }
            for stage in (0..STAGES - 1).rev() {
                let reach = simd.splat_f64s(reaches[stage]);
                for i in 0..NX {
                    for j in 0..NX {
                        let diagonal = simd.splat_f64s(if i == j { weights[stage] } else { 0.0 });
                        m[i][j] = simd.mul_add_f64s(reach, product[i][j], diagonal);
                    }
                }
                product = times_a::<S, NX, E>(simd, &m, history, stage, at);
                self.set_gammas::<S, E>(simd, &m, history, stage, at);
                for i in 0..NX {
                    for j in 0..NX {
                        phi[i][j] = simd.add_f64s(phi[i][j], product[i][j]);
                    }
                }
            }
            for i in 0..NX {
                phi[i][i] = simd.add_f64s(phi[i][i], simd.splat_f64s(1.0));
                for j in 0..NX {
                    store::<S>(&mut self.phi[i][j], at, phi[i][j]);
                }
            }
        }
    }

    /// Computes Γ = M B of a stage.
    #[inline(always)]
    fn set_gammas<S: Simd, E: Equations<NX>>(
        &mut self,
        simd: S,
        m: &[[S::f64s; NX]; NX],
        history: &StageHistory<NX>,
        stage: usize,
        at: usize,
    ) {
        for k in 0..COEFFICIENTS {
            let mut gamma = [simd.splat_f64s(0.0); NX];
            for i in 0..NX {
                for l in 0..NX {
                    if E::HAS_SLOPE_BY_COEFFICIENT[l][k] {
                        let b = load::<S>(&history.b[stage][l][k], at);
                        gamma[i] = simd.mul_add_f64s(m[i][l], b, gamma[i]);
                    }
                }
                store::<S>(&mut self.gamma[stage][k][i], at, gamma[i]);
            }
        }
    }
}

/// Product M A of a stage.
#[inline(always)]
fn times_a<S: Simd, const NX: usize, E: Equations<NX>>(
    simd: S,
    m: &[[S::f64s; NX]; NX],
    history: &StageHistory<NX>,
    stage: usize,
    at: usize,
) -> [[S::f64s; NX]; NX] {
    let mut product = [[simd.splat_f64s(0.0); NX]; NX];
    for i in 0..NX {
        for j in 0..NX {
            for l in 0..NX {
                if E::HAS_SLOPE_BY_STATE[l][j] {
                    let a = load::<S>(&history.a[stage][l][j], at);
                    product[i][j] = simd.mul_add_f64s(m[i][l], a, product[i][j]);
                }
            }
        }
    }
    product
}
