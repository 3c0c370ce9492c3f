//! The trajectory of the states through a chunk of samples, integrated by the classical Runge-Kutta
//! step. Each stage leaves its slopes A = ∂ẋ/∂x (through the coefficients included) and B = ∂ẋ/∂c for
//! the sensitivities.
//!
//! Each stage depends on the one before it, so the chain is bound by latency. It advances stage by
//! stage between the rows of the sums, which are bound by throughput.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use nalgebra::SVector;

use super::chunk_build_up::ChunkBuildUp;
use crate::dynamics::{COEFFICIENTS, Equations, Rates};
use crate::numerics::runge_kutta::{self, POINT, STAGES, reaches_s, weights_s};
use crate::numerics::vectors::row_products::Interleaved;
use crate::numerics::vectors::simd::VECTOR;
use crate::output_error::case::Case;
use crate::output_error::case::chunking::{CHUNK, Strided};

/// Limit of a state, rad or rad/s: beyond any flight, but small enough that numbers do not
/// overflow.
pub(crate) const STATE_BOUND: f64 = 50.0;

/// States and slopes of a chunk at every stage: entry by entry, sample after sample.
#[derive(Clone, Copy)]
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

    /// First of some samples whose state is out of bounds or not a number.
    pub fn first_out_of_bounds(&self, samples: usize) -> Option<usize> {
        self.states[..samples]
            .iter()
            .position(|x| !x.iter().all(|x| x.abs() < STATE_BOUND))
    }
}

/// Integration of the states over a chunk, stage by stage.
pub(crate) struct Trajectory<'a, const NX: usize, E: Equations<NX>> {
    stages: Stages<'a, NX, E>,
    /// State at the sample.
    x: SVector<f64, NX>,
    /// State at the stage.
    at: SVector<f64, NX>,
    /// State at the next sample, as far as the stages computed so far determine it.
    next: SVector<f64, NX>,
    sample: usize,
    stage: usize,
    end: usize,
    step_s: f64,
    reaches_s: [f64; STAGES],
    weights_s: [f64; STAGES],
}

impl<'a, const NX: usize, E: Equations<NX>> Trajectory<'a, NX, E> {
    /// Trajectory from the state `x` over `samples` samples: the first of these points, and every
    /// other one after it.
    pub fn new(
        case: &'a Case<NX, E>,
        build_up: &'a ChunkBuildUp<NX>,
        history: &'a mut StageHistory<NX>,
        x: SVector<f64, NX>,
        points: Strided,
        samples: usize,
    ) -> Self {
        let step_s = points.stride as f64 * case.step_s;
        Trajectory {
            stages: Stages {
                case,
                build_up,
                history,
                points,
            },
            x,
            at: x,
            next: x,
            sample: 0,
            stage: 0,
            end: samples,
            step_s,
            reaches_s: reaches_s(step_s),
            weights_s: weights_s(step_s),
        }
    }

    /// Takes the step from the next sample, whose state is corrected to `x`, and returns the state at
    /// its end.
    #[inline(always)]
    pub fn step_from(&mut self, x: SVector<f64, NX>) -> SVector<f64, NX> {
        let next = step(
            &x,
            self.step_s,
            #[inline(always)]
            |stage, at| self.stages.take(self.sample, stage, at),
        );
        self.stages.history.states[self.sample] = x;
        self.sample += 1;
        next
    }

    /// Returns the state a step after the sample `k`, whose state is corrected to `x`, and records
    /// nothing.
    #[inline(always)]
    pub fn state_after(&self, k: usize, x: SVector<f64, NX>) -> SVector<f64, NX> {
        step(
            &x,
            self.step_s,
            #[inline(always)]
            |stage, at| self.stages.rates(2 * k + POINT[stage], at).rates,
        )
    }

    /// Integrates to the end of the chunk and returns the state there.
    #[inline(always)]
    pub fn finish(mut self) -> SVector<f64, NX> {
        while self.sample < self.end {
            self.advance();
        }
        self.x
    }
}

impl<const NX: usize, E: Equations<NX>> Interleaved for Trajectory<'_, NX, E> {
    /// Takes one stage. States are stored and read back number by number. Reading them back at once
    /// with another width would cause a store-forwarding stall and delay the chain.
    #[inline(always)]
    fn advance(&mut self) {
        if self.sample >= self.end {
            return;
        }
        let (sample, stage) = (self.sample, self.stage);
        let rates = self.stages.take(sample, stage, &self.at);
        for i in 0..NX {
            self.next[i] = rates[i].mul_add(self.weights_s[stage], self.next[i]);
        }
        if stage + 1 < STAGES {
            for i in 0..NX {
                self.at[i] = rates[i].mul_add(self.reaches_s[stage], self.x[i]);
            }
            self.stage = stage + 1;
        } else {
            for i in 0..NX {
                self.stages.history.states[sample][i] = self.x[i];
                self.x[i] = self.next[i];
                self.at[i] = self.next[i];
            }
            (self.stage, self.sample) = (0, sample + 1);
        }
    }
}

/// State a step after `x`; `rates` returns the rates at a stage and a state.
#[inline(always)]
fn step<const NX: usize>(
    x: &SVector<f64, NX>,
    step_s: f64,
    rates: impl FnMut(usize, &SVector<f64, NX>) -> SVector<f64, NX>,
) -> SVector<f64, NX> {
    runge_kutta::step(
        x,
        step_s,
        rates,
        #[inline(always)]
        |x, rates, time_s| {
            let mut later = *x;
            for i in 0..NX {
                later[i] = rates[i].mul_add(time_s, x[i]);
            }
            later
        },
    )
}

/// Stages of the steps of a chunk.
struct Stages<'a, const NX: usize, E: Equations<NX>> {
    case: &'a Case<NX, E>,
    build_up: &'a ChunkBuildUp<NX>,
    history: &'a mut StageHistory<NX>,
    points: Strided,
}

impl<const NX: usize, E: Equations<NX>> Stages<'_, NX, E> {
    /// Rates at a point of the chunk and a state.
    #[inline(always)]
    fn rates(&self, point: usize, at: &SVector<f64, NX>) -> Rates<NX> {
        let c = self.build_up.coefficients::<E>(point, at);
        let inputs = &self.case.motion.rate_inputs[self.points.index(point)];
        E::rates(inputs, at, &c)
    }

    /// Rates at the state of a stage. The history receives the stage's slopes and factors.
    #[inline(always)]
    fn take(&mut self, sample: usize, stage: usize, at: &SVector<f64, NX>) -> SVector<f64, NX> {
        let point = 2 * sample + POINT[stage];
        let rates = self.rates(point, at);
        let a = self.build_up.total_slopes::<E, NX>(
            point,
            rates.by_state,
            &rates.by_coefficient,
            E::RATES_BY_COEFFICIENT,
        );
        let history = &mut *self.history;
        for &(i, j) in E::RATES_BY_COEFFICIENT {
            history.b[stage][i][j][sample] = rates.by_coefficient[(i, j)];
        }
        // All entries: a list of those that can differ from zero would be read from memory.
        for i in 0..NX {
            for j in 0..NX {
                history.a[stage][i][j][sample] = a[(i, j)];
            }
        }
        set_factors::<NX, E>(
            &mut history.factors[stage][sample],
            at,
            &self.case.layout.products,
        );
        rates.rates
    }
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
