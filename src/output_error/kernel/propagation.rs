//! Sensitivities of all parameters through the steps of a chunk.
//!
//! Let s be the sensitivities of the states to a derivative, k the coefficient of the derivative, and r_j
//! its regressor at the stage j. All sensitivities take a step at once, s ← Φ s + Σ_j Γ_jk r_j. The
//! outputs have the sensitivities C s + D_k r. Parameters lie side by side in the lanes of the
//! processor's vectors ([`LaneLayout`]).
#![expect(
    clippy::inline_always,
    reason = "compiled into one loop for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use pulp::Simd;

use super::chunk_regressors::ChunkRegressors;
use super::chunk_rows::ChunkRows;
use super::propagators::Propagators;
use super::trajectory::StageHistory;
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};
use crate::numerics::runge_kutta::{POINT, STAGES};
use crate::numerics::vectors::simd::{AlignedBuffer, VECTOR, load};
use crate::output_error::case::Case;
use crate::output_error::case::chunking::Strided;
use crate::output_error::case::layout::LaneLayout;

/// Sensitivities of a pass, and the memory in which they are propagated.
pub(crate) struct ChunkSensitivities {
    regressors: AlignedBuffer,
    rows: AlignedBuffer,
    /// Sensitivities at the chunk's first sample: state by state a row of lanes.
    states: AlignedBuffer,
}

impl ChunkSensitivities {
    /// Sensitivities at the first sample of a pass.
    pub fn new(layout: &LaneLayout, states: AlignedBuffer) -> Self {
        ChunkSensitivities {
            regressors: AlignedBuffer::zeros(ChunkRegressors::length(layout)),
            rows: AlignedBuffer::zeros(ChunkRows::length(layout.width())),
            states,
        }
    }

    /// Propagates the sensitivities through the recorded steps of a chunk's first `count` samples, and
    /// returns the rows of the outputs. History and propagators stay variables of the caller: in one
    /// struct a store to one would make the compiler read the others again.
    #[inline(always)]
    pub fn propagate<const NX: usize, S: Simd, E: Equations<NX>>(
        &mut self,
        simd: S,
        (case, layout): (&Case<NX, E>, &LaneLayout),
        (points, count): (Strided, usize),
        (history, propagators): (&StageHistory<NX>, &mut Propagators<NX>),
        update: impl MeasurementUpdate<NX>,
    ) -> ChunkRows<'_> {
        let step_s = points.stride as f64 * case.step_s;
        propagators.set_steps::<S, E>(simd, history, count, step_s);
        let mut regressors = ChunkRegressors::new(self.regressors.slice_mut());
        regressors.set(case, layout, points);
        let mut propagation = Propagation {
            simd,
            layout,
            regressors: &regressors,
            sensitivities: S::as_mut_simd_f64s(self.states.slice_mut()).0,
            rows: ChunkRows::new(self.rows.slice_mut()),
            history,
            propagators,
            count,
            update,
        };
        propagation.run::<E>();
        propagation.rows
    }
}

/// Update of the states by the measurements, between a sample's outputs and the next step.
pub(crate) trait MeasurementUpdate<const NX: usize> {
    /// Numbers of the update in some vectors of lanes.
    type Lanes<'l, S: Simd, const N: usize>
    where
        Self: 'l;

    /// Finds the numbers in the vectors that begin at some lanes, once for a chunk.
    fn in_lanes<S: Simd, const N: usize>(&self, lanes: [usize; N]) -> Self::Lanes<'_, S, N>;

    /// Returns the factors of the first vector's regressors in the outputs, if they differ from the
    /// factors at the step's first stage.
    fn output_factors(&self, k: usize) -> Option<&[f64; VECTOR]>;

    /// Corrects the sensitivities `s` of the states in the vectors of `lanes`. The sensitivities
    /// `y` of the outputs were computed before, at the chunk's sample k. Replaces `y` by the
    /// sensitivities that the sink receives.
    fn correct<S: Simd, const N: usize>(
        &self,
        simd: S,
        k: usize,
        lanes: &Self::Lanes<'_, S, N>,
        s: &mut [[S::f64s; NX]; N],
        y: &mut [[S::f64s; OUTPUTS]; N],
    );
}

/// No update: output error.
pub(crate) struct NoUpdate;

impl<const NX: usize> MeasurementUpdate<NX> for NoUpdate {
    type Lanes<'l, S: Simd, const N: usize> = ();

    #[inline(always)]
    fn in_lanes<S: Simd, const N: usize>(&self, _: [usize; N]) {}

    #[inline(always)]
    fn output_factors(&self, _: usize) -> Option<&[f64; VECTOR]> {
        None
    }

    #[inline(always)]
    fn correct<S: Simd, const N: usize>(
        &self,
        _: S,
        _: usize,
        (): &(),
        _: &mut [[S::f64s; NX]; N],
        _: &mut [[S::f64s; OUTPUTS]; N],
    ) {
    }
}

/// Propagation of all sensitivities over a chunk.
struct Propagation<'a, 'r, S: Simd, const NX: usize, K> {
    simd: S,
    layout: &'a LaneLayout,
    regressors: &'a ChunkRegressors<'a>,
    sensitivities: &'a mut [S::f64s],
    /// Sensitivities of the outputs.
    rows: ChunkRows<'r>,
    history: &'a StageHistory<NX>,
    propagators: &'a Propagators<NX>,
    count: usize,
    update: K,
}

impl<S: Simd, const NX: usize, K: MeasurementUpdate<NX>> Propagation<'_, '_, S, NX, K> {
    /// Propagates the groups of all coefficients side by side, so that the processor has several
    /// independent sums, then the group of the initial states.
    #[inline(always)]
    fn run<E: Equations<NX>>(&mut self) {
        let (from, end) = (self.layout.groups[0].start, self.layout.groups[0].end);
        for lane in (from..end).step_by(S::F64_LANES) {
            self.propagate::<E, COEFFICIENTS>(lane, [0, 1, 2]);
        }
        let initial = &self.layout.groups[COEFFICIENTS];
        for lane in (0..initial.end - initial.start).step_by(S::F64_LANES) {
            self.propagate::<E, 1>(lane, [COEFFICIENTS]);
        }
    }

    /// Propagates one vector of each of some groups, which begins at a lane of the group.
    #[inline(always)]
    fn propagate<E: Equations<NX>, const N: usize>(&mut self, lane: usize, groups: [usize; N]) {
        let vectors = self.layout.width() / S::F64_LANES;
        let lanes = groups.map(|group| self.layout.groups[group].start + lane);
        let places = groups.map(|group| match self.layout.regressors.get(group) {
            Some(first) => first + lane,
            None => 0,
        });
        let mut s = [[self.simd.splat_f64s(0.0); NX]; N];
        for n in 0..N {
            for i in 0..NX {
                s[n][i] = self.sensitivities[i * vectors + lanes[n] / S::F64_LANES];
            }
        }
        let in_lanes = self.update.in_lanes::<S, N>(lanes);
        for k in 0..self.count {
            let mut r = [[self.simd.splat_f64s(0.0); STAGES]; N];
            let mut y = self.read::<E, N>(k, lane, groups, places, &s, &mut r);
            self.update.correct(self.simd, k, &in_lanes, &mut s, &mut y);
            for n in 0..N {
                self.rows.store::<S>(k, lanes[n], &y[n]);
            }
            s = next_sensitivities::<S, NX, E, N>(self.simd, groups, self.propagators, k, &s, &r);
        }
        for n in 0..N {
            for i in 0..NX {
                self.sensitivities[i * vectors + lanes[n] / S::F64_LANES] = s[n][i];
            }
        }
    }

    /// Sensitivities of the outputs for some groups' lanes. `r` receives the regressors at the stages of
    /// the step, which stay zero for initial states.
    #[inline(always)]
    fn read<E: Equations<NX>, const N: usize>(
        &self,
        k: usize,
        lane: usize,
        groups: [usize; N],
        places: [usize; N],
        s: &[[S::f64s; NX]; N],
        r: &mut [[S::f64s; STAGES]; N],
    ) -> [[S::f64s; OUTPUTS]; N] {
        let mut y = [[self.simd.splat_f64s(0.0); OUTPUTS]; N];
        for n in 0..N {
            let mut in_outputs = None;
            if groups[n] != COEFFICIENTS {
                let points = self.regressors.of_step::<S>(k, places[n]);
                for stage in 0..STAGES {
                    r[n][stage] = points[POINT[stage]];
                    if lane < VECTOR {
                        let factors = load::<S>(&self.history.factors[stage][k], lane);
                        r[n][stage] = self.simd.mul_f64s(r[n][stage], factors);
                    }
                }
                if let Some(factors) = self.update.output_factors(k)
                    && lane < VECTOR
                {
                    let factors = load::<S>(factors, lane);
                    in_outputs = Some(self.simd.mul_f64s(points[0], factors));
                }
            }
            let in_outputs = in_outputs.unwrap_or(r[n][0]);
            let at = self.propagators;
            y[n] = output_sensitivities::<S, NX, E>(self.simd, groups[n], at, k, &s[n], in_outputs);
        }
        y
    }
}

/// Sensitivities C s + D r of the outputs, for lanes of one group.
#[inline(always)]
fn output_sensitivities<S: Simd, const NX: usize, E: Equations<NX>>(
    simd: S,
    group: usize,
    at: &Propagators<NX>,
    k: usize,
    s: &[S::f64s; NX],
    r: S::f64s,
) -> [S::f64s; OUTPUTS] {
    let mut y = [simd.splat_f64s(0.0); OUTPUTS];
    for &(o, i) in E::OUTPUTS_BY_STATE {
        y[o] = simd.mul_add_f64s(simd.splat_f64s(at.c[o][i][k]), s[i], y[o]);
    }
    for &(o, c) in E::OUTPUTS_BY_COEFFICIENT {
        if c == group {
            y[o] = simd.mul_add_f64s(simd.splat_f64s(at.d[o][c][k]), r, y[o]);
        }
    }
    y
}

/// Sensitivities Φ s + Σ Γ r of the states after a step, for lanes of some groups.
#[inline(always)]
fn next_sensitivities<S: Simd, const NX: usize, E: Equations<NX>, const N: usize>(
    simd: S,
    groups: [usize; N],
    at: &Propagators<NX>,
    k: usize,
    s: &[[S::f64s; NX]; N],
    r: &[[S::f64s; STAGES]; N],
) -> [[S::f64s; NX]; N] {
    let mut next = [[simd.splat_f64s(0.0); NX]; N];
    for n in 0..N {
        if groups[n] == COEFFICIENTS {
            continue;
        }
        for i in 0..NX {
            for stage in 0..STAGES - 1 {
                let gamma = simd.splat_f64s(at.gamma[stage][groups[n]][i][k]);
                next[n][i] = simd.mul_add_f64s(gamma, r[n][stage], next[n][i]);
            }
        }
        for &(i, c) in E::RATES_BY_COEFFICIENT {
            if c == groups[n] {
                let gamma = simd.splat_f64s(at.gamma[STAGES - 1][c][i][k]);
                next[n][i] = simd.mul_add_f64s(gamma, r[n][STAGES - 1], next[n][i]);
            }
        }
    }
    for j in 0..NX {
        for i in 0..NX {
            let phi = simd.splat_f64s(at.phi[i][j][k]);
            for n in 0..N {
                next[n][i] = simd.mul_add_f64s(phi, s[n][j], next[n][i]);
            }
        }
    }
    next
}
