//! One pass over a maneuver: the states, and the sensitivities of all parameters beside them.
//!
//! A pass goes chunk by chunk. The [`Trajectory`] integrates the states and records the slopes of
//! each stage. [`Propagators`] turn the slopes into matrices for all steps of the chunk side by
//! side. Let s be the sensitivities of the states to a derivative, k the coefficient of the
//! derivative, and r_j its regressor at the stage j. All sensitivities take a step at once,
//! s ← Φ s + Σ_j Γ_jk r_j. The outputs have the sensitivities C s + D_k r. Parameters lie side by side in
//! the lanes of the processor's vectors ([`LaneLayout`]).
//!
//! The loops are compiled for several widths of vectors and chosen when the program runs. Each lane
//! is computed alike in all of them, with fused multiplication, so every width gives the same bits.
#![expect(
    clippy::inline_always,
    reason = "compiled into one loop for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::SVector;
use pulp::{Arch, Simd, WithSimd};

use super::chunk_build_up::ChunkBuildUp;
use super::chunk_regressors::ChunkRegressors;
use super::chunk_rows::ChunkRows;
use super::propagators::Propagators;
use super::trajectory::{StageHistory, Trajectory, is_out_of_bounds};
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};
use crate::numerics::runge_kutta::{POINT, STAGES};
use crate::numerics::vectors::simd::{AlignedBuffer, VECTOR, load};
use crate::output_error::case::build_up::ValuedTerm;
use crate::output_error::case::chunking::{CHUNK, Strided, WIDEST_STRIDE};
use crate::output_error::case::layout::LaneLayout;
use crate::output_error::case::{Case, InitialState};

/// End of an integration whose state left its bounds: no flight has these parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Diverged {
    pub sample: usize,
}

/// Consumer of the outputs' sensitivities.
pub(crate) trait Sink {
    /// Takes the outputs of some samples and their sensitivities. The sink may overwrite the rows.
    fn take<S: Simd>(
        &mut self,
        simd: S,
        samples: Strided,
        outputs: &[[f64; OUTPUTS]],
        rows: ChunkRows,
    );
}

/// One pass, ready to be run with the vectors of some width.
pub(crate) struct Pass<'a, const NX: usize, E: Equations<NX>, K: Sink> {
    case: &'a Case<NX, E>,
    terms: Vec<ValuedTerm>,
    start: SVector<f64, NX>,
    biases: [f64; OUTPUTS],
    stride: usize,
    outputs: &'a mut [[f64; OUTPUTS]],
    sink: &'a mut K,
}

impl<const NX: usize, E: Equations<NX>> Case<NX, E> {
    /// Integrates with these parameters in steps of `stride` samples. Outputs go to the front of
    /// `outputs`, sensitivities to the sink.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves its bounds or is not a number.
    pub(crate) fn run_pass(
        &self,
        parameters: &[f64],
        stride: usize,
        outputs: &mut [[f64; OUTPUTS]],
        sink: &mut impl Sink,
    ) -> Result<(), Diverged> {
        Arch::new().dispatch(self.prepare_pass(parameters, stride, outputs, sink))
    }

    /// Prepares the pass of [`Case::run_pass`].
    pub(crate) fn prepare_pass<'a, K: Sink>(
        &'a self,
        parameters: &[f64],
        stride: usize,
        outputs: &'a mut [[f64; OUTPUTS]],
        sink: &'a mut K,
    ) -> Pass<'a, NX, E, K> {
        let mut biases = [0.0; OUTPUTS];
        let values = &parameters[self.derivatives()..];
        for (&o, bias) in self.biased_outputs.iter().zip(values) {
            biases[o] += bias;
        }
        Pass {
            case: self,
            terms: self.valued_terms(parameters).collect(),
            start: self.start_state(parameters),
            biases,
            stride: stride.clamp(1, WIDEST_STRIDE),
            outputs,
            sink,
        }
    }

    fn start_state(&self, parameters: &[f64]) -> SVector<f64, NX> {
        match self.initial_state {
            InitialState::Measured => self.start,
            InitialState::Estimated => {
                let first = self.parameters() - NX;
                SVector::from_fn(|i, _| parameters[first + i])
            }
        }
    }
}

impl<const NX: usize, E: Equations<NX>, K: Sink> WithSimd for Pass<'_, NX, E, K> {
    type Output = Result<(), Diverged>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Result<(), Diverged> {
        let (case, layout, stride) = (self.case, &self.case.layout, self.stride);
        let samples = case.samples().div_ceil(stride);
        let step_s = stride as f64 * case.step_s;
        let mut sensitivities = initial_sensitivities::<NX>(case.initial_state, layout);
        let sensitivities = sensitivities.slice_mut();
        let mut rows = AlignedBuffer::zeros(ChunkRows::length(layout.width()));
        let mut rows = ChunkRows::new(rows.slice_mut());
        let mut regressors = AlignedBuffer::zeros(ChunkRegressors::length(layout));
        let mut regressors = ChunkRegressors::new(regressors.slice_mut());
        let mut build_up = ChunkBuildUp::<NX>::ZERO;
        let mut history = StageHistory::<NX>::EMPTY;
        let mut propagators = Propagators::<NX>::ZERO;
        let mut x = self.start;
        for first in (0..samples).step_by(CHUNK) {
            let count = CHUNK.min(samples - first);
            let points = Strided {
                first: 2 * stride * first,
                stride,
            };
            build_up.set(case, &self.terms, points);
            let mut trajectory = Trajectory::new(case, &build_up, &mut history, points);
            for k in 0..count {
                let sample = stride * (first + k);
                if is_out_of_bounds(&x) {
                    return Err(Diverged { sample });
                }
                let y = propagators.read_outputs(case, &build_up, &x, sample, k);
                for o in 0..OUTPUTS {
                    self.outputs[first + k][o] = y[o] + self.biases[o];
                }
                x = trajectory.record_step(k, &x);
            }
            propagators.set_steps::<S, E>(simd, &history, count, step_s);
            regressors.set(case, layout, points);
            let mut propagation = Propagation {
                simd,
                layout,
                regressors: &regressors,
                sensitivities: S::as_mut_simd_f64s(sensitivities).0,
                rows: rows.reborrow(),
                history: &history,
                propagators: &propagators,
                count,
                correction: NoUpdate,
            };
            propagation.run::<E>();
            let samples = Strided {
                first: stride * first,
                stride,
            };
            let outputs = &self.outputs[first..first + count];
            self.sink.take(simd, samples, outputs, rows.reborrow());
        }
        Ok(())
    }
}

/// Sensitivities at the first sample: one for each free initial state along itself, else zero.
fn initial_sensitivities<const NX: usize>(
    initial_state: InitialState,
    layout: &LaneLayout,
) -> AlignedBuffer {
    let mut sensitivities = AlignedBuffer::zeros(NX * layout.width());
    if initial_state == InitialState::Estimated {
        for i in 0..NX {
            let lane = layout.first_initial_state() + i;
            sensitivities.slice_mut()[i * layout.width() + lane] = 1.0;
        }
    }
    sensitivities
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
struct NoUpdate;

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
pub(crate) struct Propagation<'a, S: Simd, const NX: usize, K> {
    pub simd: S,
    pub layout: &'a LaneLayout,
    pub regressors: &'a ChunkRegressors<'a>,
    pub sensitivities: &'a mut [S::f64s],
    /// Sensitivities of the outputs.
    pub rows: ChunkRows<'a>,
    pub history: &'a StageHistory<NX>,
    pub propagators: &'a Propagators<NX>,
    pub count: usize,
    pub correction: K,
}

impl<S: Simd, const NX: usize, K: MeasurementUpdate<NX>> Propagation<'_, S, NX, K> {
    /// Propagates the groups of all coefficients side by side, so that the processor has several
    /// independent sums, then the group of the initial states.
    #[inline(always)]
    pub fn run<E: Equations<NX>>(&mut self) {
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
        let update = self.correction.in_lanes::<S, N>(lanes);
        for k in 0..self.count {
            let mut r = [[self.simd.splat_f64s(0.0); STAGES]; N];
            let mut y = self.read::<E, N>(k, lane, groups, places, &s, &mut r);
            self.correction
                .correct(self.simd, k, &update, &mut s, &mut y);
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
                if let Some(factors) = self.correction.output_factors(k)
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
