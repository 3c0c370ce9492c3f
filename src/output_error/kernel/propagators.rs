//! What a Runge-Kutta step does to sensitivities, exactly: s ← Φ s + Σ Γ_j r_j over its stages j,
//! for a chunk's steps side by side in the lanes of vectors.
//!
//! With ẋ_j the slope of stage j and A_j, B_j its slopes along states and coefficients, the step's
//! end depends on the slopes of its stages as M₄ = h/6, M₃ = h/3 + h M₄A₄, M₂ = h/3 + h/2 M₃A₃, M₁
//! = h/6 + h/2 M₂A₂ (the later stages start from the earlier ones' slopes). Then Φ = 1 + Σ M_j A_j
//! and Γ_j = M_j B_j.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use pulp::Simd;

use super::chunk::Near;
use super::trajectory::Path;
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};
use crate::numerics::runge_kutta::STAGES;
use crate::numerics::simd::{load, store};
use crate::output_error::case::Case;
use crate::output_error::case::chunking::CHUNK;

/// Of a chunk's samples, entry by entry, sample after sample.
#[repr(align(64))]
pub(crate) struct Propagators<const NX: usize> {
    /// Φ by state and state.
    pub phi: [[[f64; CHUNK]; NX]; NX],
    /// Γ by stage, coefficient and state.
    pub gamma: [[[[f64; CHUNK]; NX]; COEFFICIENTS]; STAGES],
    /// Slopes of the outputs along states and coefficients.
    pub c: [[[f64; CHUNK]; NX]; OUTPUTS],
    pub d: [[[f64; CHUNK]; COEFFICIENTS]; OUTPUTS],
}

impl<const NX: usize> Propagators<NX> {
    pub const NONE: Propagators<NX> = Propagators {
        phi: [[[0.0; CHUNK]; NX]; NX],
        gamma: [[[[0.0; CHUNK]; NX]; COEFFICIENTS]; STAGES],
        c: [[[0.0; CHUNK]; NX]; OUTPUTS],
        d: [[[0.0; CHUNK]; COEFFICIENTS]; OUTPUTS],
    };

    /// The outputs at a sample of the chunk, the sample `whole` of the maneuver, and their slopes.
    #[inline(always)]
    pub fn read<E: Equations<NX>>(
        &mut self,
        case: &Case<NX, E>,
        near: &Near<NX>,
        path: &Path<NX>,
        whole: usize,
        sample: usize,
    ) -> [f64; OUTPUTS] {
        let x = &path.states[sample];
        let c = near.coefficients::<E>(2 * sample, x);
        let read = E::outputs(&case.known[2 * whole], &case.sensed[whole], x, &c);
        for &(o, k) in E::OUTPUTS_BY_COEFFICIENT {
            self.d[o][k][sample] = read.by_coefficient[(o, k)];
        }
        let slopes = near.through::<E, OUTPUTS>(
            2 * sample,
            read.by_state,
            &read.by_coefficient,
            E::OUTPUTS_BY_COEFFICIENT,
        );
        for &(o, i) in E::OUTPUTS_BY_STATE {
            self.c[o][i][sample] = slopes[(o, i)];
        }
        read.outputs.into()
    }

    /// Φ and Γ of a chunk's steps.
    #[inline(always)]
    pub fn set<S: Simd, E: Equations<NX>>(
        &mut self,
        simd: S,
        path: &Path<NX>,
        samples: usize,
        step_s: f64,
    ) {
        let h = step_s;
        for at in (0..samples).step_by(S::F64_LANES) {
            // M of the last stage is h/6 alone.
            let (mut m, mut product) = (
                [[simd.splat_f64s(0.0); NX]; NX],
                [[simd.splat_f64s(0.0); NX]; NX],
            );
            let mut phi = [[simd.splat_f64s(0.0); NX]; NX];
            let last = simd.splat_f64s(h / 6.0);
            for &(i, k) in E::RATES_BY_COEFFICIENT {
                let b = load::<S>(&path.b[STAGES - 1][i][k], at);
                store::<S>(
                    &mut self.gamma[STAGES - 1][k][i],
                    at,
                    simd.mul_f64s(last, b),
                );
            }
            for &(i, j) in E::RATES_BY_STATE {
                product[i][j] = simd.mul_f64s(last, load::<S>(&path.a[STAGES - 1][i][j], at));
                phi[i][j] = product[i][j];
            }
            for (stage, part, reach) in [
                (2, h / 3.0, h),
                (1, h / 3.0, 0.5 * h),
                (0, h / 6.0, 0.5 * h),
            ] {
                for i in 0..NX {
                    for j in 0..NX {
                        let own = simd.splat_f64s(if i == j { part } else { 0.0 });
                        m[i][j] = simd.mul_add_f64s(simd.splat_f64s(reach), product[i][j], own);
                    }
                }
                product = times_a::<S, NX, E>(simd, &m, path, stage, at);
                self.gammas::<S, E>(simd, &m, path, stage, at);
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

    /// Γ = M B of a stage.
    #[inline(always)]
    fn gammas<S: Simd, E: Equations<NX>>(
        &mut self,
        simd: S,
        m: &[[S::f64s; NX]; NX],
        path: &Path<NX>,
        stage: usize,
        at: usize,
    ) {
        for k in 0..COEFFICIENTS {
            let mut gamma = [simd.splat_f64s(0.0); NX];
            for &(l, c) in E::RATES_BY_COEFFICIENT {
                if c == k {
                    let b = load::<S>(&path.b[stage][l][c], at);
                    for i in 0..NX {
                        gamma[i] = simd.mul_add_f64s(m[i][l], b, gamma[i]);
                    }
                }
            }
            for i in 0..NX {
                store::<S>(&mut self.gamma[stage][k][i], at, gamma[i]);
            }
        }
    }
}

/// M A of a stage.
#[inline(always)]
fn times_a<S: Simd, const NX: usize, E: Equations<NX>>(
    simd: S,
    m: &[[S::f64s; NX]; NX],
    path: &Path<NX>,
    stage: usize,
    at: usize,
) -> [[S::f64s; NX]; NX] {
    let mut product = [[simd.splat_f64s(0.0); NX]; NX];
    for &(l, j) in E::RATES_BY_STATE {
        let a = load::<S>(&path.a[stage][l][j], at);
        for i in 0..NX {
            product[i][j] = simd.mul_add_f64s(m[i][l], a, product[i][j]);
        }
    }
    product
}
