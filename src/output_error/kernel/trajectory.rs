//! The trajectory of the states through a chunk of samples, integrated by the classical Runge-Kutta
//! step. Each stage leaves its slopes A = ∂ẋ/∂x (through the coefficients included) and B = ∂ẋ/∂c for
//! the sensitivities.
//!
//! Each stage depends on the one before it, so the chain is bound by latency.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use nalgebra::SVector;

use super::chunk_build_up::ChunkBuildUp;
use crate::dynamics::{COEFFICIENTS, Equations, Rates};
use crate::numerics::runge_kutta::{self, POINT, STAGES};
use crate::numerics::vectors::simd::VECTOR;
use crate::output_error::case::Case;
use crate::output_error::case::chunking::{CHUNK, Strided};

/// Limit of a state, rad or rad/s: beyond any flight, but small enough that numbers do not
/// overflow.
const STATE_BOUND: f64 = 50.0;

/// States and slopes of a chunk at every stage: entry by entry, sample after sample.
#[repr(align(64))]
pub(crate) struct StageHistory<const NX: usize> {
    /// States at the samples.
    pub states: [SVector<f64, NX>; CHUNK],
    /// Factors of the regressors in the first vector of a group: the state to which a regressor is
    /// proportional, else one.
    pub factors: [[[f64; VECTOR]; CHUNK]; STAGES],
    /// A by stage, rate and state.
    pub a: [[[[f64; CHUNK]; NX]; NX]; STAGES],
    /// B by stage, rate and coefficient.
    pub b: [[[[f64; CHUNK]; COEFFICIENTS]; NX]; STAGES],
}

impl<const NX: usize> StageHistory<NX> {
    pub const EMPTY: StageHistory<NX> = StageHistory {
        states: [SVector::<f64, NX>::from_array_storage(nalgebra::ArrayStorage([[0.0; NX]; 1]));
            CHUNK],
        factors: [[[1.0; VECTOR]; CHUNK]; STAGES],
        a: [[[[0.0; CHUNK]; NX]; NX]; STAGES],
        b: [[[[0.0; CHUNK]; COEFFICIENTS]; NX]; STAGES],
    };
}

/// `true` if a state is beyond its bound or not a number.
#[inline(always)]
pub(crate) fn is_out_of_bounds<const NX: usize>(x: &SVector<f64, NX>) -> bool {
    !x.iter().all(|x| x.abs() < STATE_BOUND)
}

/// Trajectory of the states through a chunk.
pub(crate) struct Trajectory<'a, const NX: usize, E: Equations<NX>> {
    case: &'a Case<NX, E>,
    build_up: &'a ChunkBuildUp<NX>,
    history: &'a mut StageHistory<NX>,
    /// Points of the chunk; every other one is a sample.
    points: Strided,
    step_s: f64,
}

impl<'a, const NX: usize, E: Equations<NX>> Trajectory<'a, NX, E> {
    /// Trajectory over a chunk's points, whose build-up is `build_up`.
    pub fn new(
        case: &'a Case<NX, E>,
        build_up: &'a ChunkBuildUp<NX>,
        history: &'a mut StageHistory<NX>,
        points: Strided,
    ) -> Self {
        Trajectory {
            case,
            build_up,
            history,
            points,
            step_s: points.stride as f64 * case.step_s,
        }
    }

    /// Returns the state a step after the sample `k` of the chunk, whose state is `x`. The history
    /// receives the step.
    #[inline(always)]
    pub fn record_step(&mut self, k: usize, x: &SVector<f64, NX>) -> SVector<f64, NX> {
        self.history.states[k] = *x;
        runge_kutta::step(
            x,
            self.step_s,
            #[inline(always)]
            |stage, at| self.record_stage(k, stage, at),
            later,
        )
    }

    /// Returns the state a step after the sample `k`, whose state is `x`, and records nothing.
    #[inline(always)]
    pub fn step(&self, k: usize, x: &SVector<f64, NX>) -> SVector<f64, NX> {
        runge_kutta::step(
            x,
            self.step_s,
            #[inline(always)]
            |stage, at| self.rates(2 * k + POINT[stage], at).rates,
            later,
        )
    }

    /// Rates at a point of the chunk and a state.
    #[inline(always)]
    fn rates(&self, point: usize, at: &SVector<f64, NX>) -> Rates<NX> {
        let c = self.build_up.coefficients::<E>(point, at);
        let inputs = &self.case.motion.rate_inputs[self.points.index(point)];
        E::rates(inputs, at, &c)
    }

    /// Rates at the state of a stage. The history receives the stage's slopes and factors.
    #[inline(always)]
    fn record_stage(&mut self, k: usize, stage: usize, at: &SVector<f64, NX>) -> SVector<f64, NX> {
        let point = 2 * k + POINT[stage];
        let rates = self.rates(point, at);
        let a = self.build_up.total_slopes::<E, NX>(
            point,
            rates.by_state,
            &rates.by_coefficient,
            E::RATES_BY_COEFFICIENT,
        );
        let history = &mut *self.history;
        for &(i, j) in E::RATES_BY_COEFFICIENT {
            history.b[stage][i][j][k] = rates.by_coefficient[(i, j)];
        }
        for i in 0..NX {
            for j in 0..NX {
                if E::HAS_SLOPE_BY_STATE[i][j] {
                    history.a[stage][i][j][k] = a[(i, j)];
                }
            }
        }
        set_factors::<NX, E>(
            &mut history.factors[stage][k],
            at,
            &self.case.layout.products,
        );
        rates.rates
    }
}

/// State after some time at constant rates.
#[inline(always)]
fn later<const NX: usize>(
    x: &SVector<f64, NX>,
    rates: &SVector<f64, NX>,
    time_s: f64,
) -> SVector<f64, NX> {
    let mut later = *x;
    for i in 0..NX {
        later[i] = rates[i].mul_add(time_s, x[i]);
    }
    later
}

/// Sets the factors of the regressors in a group's first vector at a state. `products` are the slots of
/// products of a state: (slot, state).
#[inline(always)]
pub(crate) fn set_factors<const NX: usize, E: Equations<NX>>(
    factors: &mut [f64; VECTOR],
    at: &SVector<f64, NX>,
    products: &[(usize, usize)],
) {
    for (slot, &state) in E::REGRESSOR_STATES.iter().enumerate() {
        factors[slot] = at[state];
    }
    // A copy is indexed, so that the state itself can stay in registers.
    let states: [f64; NX] = at.data.0[0];
    for &(slot, state) in products {
        factors[slot] = states[state];
    }
}
