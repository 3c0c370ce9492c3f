//! The inner loop: one pass over a maneuver integrates the states, and beside them the
//! sensitivities of all parameters.
//!
//! A pass goes chunk by chunk. The states themselves are a chain of dependent operations
//! ([`Course`]); what it leaves of each stage becomes the propagators of all its steps side by side
//! ([`Propagators`]); with them all sensitivities take a step at once, s ← Φ s + Σ Γ_jk r_j over
//! the stages j, k being the coefficient of a derivative and r its regressor, and outputs read y =
//! C s + D_k r. Parameters lie side by side in the lanes of the processor's vectors ([`Lanes`]).
//! While the sink sums what one chunk left, the states of the next one move on: the chain waits for
//! itself, the sums do not.
//!
//! Compiled for several widths of vectors, chosen when the program runs. Each lane is computed
//! alike in all of them, with fused multiplication, so the width does not show in the results.
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

use super::chunk::Near;
use super::propagators::Propagators;
use super::trajectory::{Course, Path};
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};
use crate::numerics::row_products::Meanwhile;
use crate::numerics::runge_kutta::{POINT, STAGES};
use crate::numerics::simd::load;
use crate::numerics::simd::{Aligned, VECTOR};
use crate::output_error::case::chunking::{CHUNK, Spaced};
use crate::output_error::case::chunking::{POINTS, WIDEST_STRIDE};
use crate::output_error::case::layout::Lanes;
use crate::output_error::case::{Case, InitialState};

/// The integration left every bound of sense: these parameters describe no flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Diverged {
    pub sample: usize,
}

/// What becomes of the sensitivities of the outputs.
pub(crate) trait Sink {
    /// Takes the outputs of some samples and their sensitivities: sample by sample, output by
    /// output one row of lanes. Nobody needs the rows afterwards. There is something to do
    /// meanwhile.
    fn take<S: Simd>(
        &mut self,
        simd: S,
        samples: Spaced,
        outputs: &[[f64; OUTPUTS]],
        rows: &mut [f64],
        meanwhile: &mut impl Meanwhile,
    );
}

/// One pass.
pub(crate) struct Pass<'a, const NX: usize, E: Equations<NX>, K: Sink> {
    case: &'a Case<NX, E>,
    parameters: &'a [f64],
    start: SVector<f64, NX>,
    biases: [f64; OUTPUTS],
    stride: usize,
    outputs: &'a mut [[f64; OUTPUTS]],
    sink: &'a mut K,
}

impl<const NX: usize, E: Equations<NX>> Case<NX, E> {
    /// Integrates with these parameters in steps of `stride` samples: outputs to the front of
    /// `outputs`, sensitivities to the sink.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves the bounds of sense or is no number.
    pub(crate) fn pass(
        &self,
        parameters: &[f64],
        stride: usize,
        outputs: &mut [[f64; OUTPUTS]],
        sink: &mut impl Sink,
    ) -> Result<(), Diverged> {
        Arch::new().dispatch(self.prepared(parameters, stride, outputs, sink))
    }

    /// The same, yet to be done with the vectors of some width.
    pub(crate) fn prepared<'a, K: Sink>(
        &'a self,
        parameters: &'a [f64],
        stride: usize,
        outputs: &'a mut [[f64; OUTPUTS]],
        sink: &'a mut K,
    ) -> Pass<'a, NX, E, K> {
        let mut biases = [0.0; OUTPUTS];
        for (&o, bias) in self.biased.iter().zip(&parameters[self.derivatives()..]) {
            biases[o] += bias;
        }
        let first = self.parameters() - NX.min(self.parameters());
        let start = match self.initial_state {
            InitialState::Measured => self.start,
            InitialState::Estimated => SVector::from_fn(|i, _| parameters[first + i]),
        };
        Pass {
            case: self,
            parameters,
            start,
            biases,
            stride: stride.clamp(1, WIDEST_STRIDE),
            outputs,
            sink,
        }
    }
}

impl<const NX: usize, E: Equations<NX>, K: Sink> WithSimd for Pass<'_, NX, E, K> {
    type Output = Result<(), Diverged>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Result<(), Diverged> {
        let (case, lanes, stride) = (self.case, &self.case.lanes, self.stride);
        let samples = case.samples().div_ceil(stride);
        let length = |first: usize| CHUNK.min(samples - first);
        let mut sensitivities = at_start::<NX>(case.initial_state, lanes);
        let sensitivities = sensitivities.slice_mut();
        let row = OUTPUTS * lanes.width();
        let mut rows = Aligned::zeros(CHUNK * row);
        let rows = rows.slice_mut();
        let mut regressors = Aligned::zeros(POINTS * lanes.row);
        let regressors = regressors.slice_mut();
        let terms = case.terms(self.parameters);
        let mut near = Near::<NX>::NONE;
        let mut paths = [Path::<NX>::NONE; 2];
        let mut propagators = Propagators::<NX>::NONE;
        let mut x = self.start;
        if samples > 0 {
            let points = Spaced { first: 0, stride };
            case.near(&terms, points, &mut near);
            let mut course = Course::new(case, &near, &mut paths[0], x, points, length(0));
            course.finish();
            x = course.state();
        }
        for (chunk, first) in (0..samples).step_by(CHUNK).enumerate() {
            // What one chunk left is read while the states of the next one leave theirs beside it.
            let [even, odd] = &mut paths;
            let (path, ahead) = if chunk % 2 == 0 {
                (&*even, odd)
            } else {
                (&*odd, even)
            };
            let count = length(first);
            if let Some(sample) = path.senseless(count) {
                return Err(Diverged {
                    sample: stride * (first + sample),
                });
            }
            for k in 0..count {
                let y = propagators.read(case, &near, path, stride * (first + k), k);
                for o in 0..OUTPUTS {
                    self.outputs[first + k][o] = y[o] + self.biases[o];
                }
            }
            propagators.set::<S, E>(simd, path, count, stride as f64 * case.step_s);
            case.spread(
                Spaced {
                    first: 2 * stride * first,
                    stride,
                },
                regressors,
            );
            let next = first + count;
            let left = if next < samples { length(next) } else { 0 };
            let points = Spaced {
                first: 2 * stride * next.min(samples - 1),
                stride,
            };
            case.near(&terms, points, &mut near);
            let mut course = Course::new(case, &near, ahead, x, points, left);
            let mut work = Work {
                simd,
                lanes,
                regressors: S::as_simd_f64s(regressors).0,
                sensitivities: S::as_mut_simd_f64s(sensitivities).0,
                rows: S::as_mut_simd_f64s(rows).0,
                path,
                propagators: &propagators,
                count,
            };
            work.all::<E>();
            self.sink.take(
                simd,
                Spaced {
                    first: stride * first,
                    stride,
                },
                &self.outputs[first..next],
                rows,
                &mut course,
            );
            course.finish();
            x = course.state();
        }
        Ok(())
    }
}

/// Zero, but one for each free initial state along itself.
fn at_start<const NX: usize>(initial_state: InitialState, lanes: &Lanes) -> Aligned {
    let mut sensitivities = Aligned::zeros(NX * lanes.width());
    if initial_state == InitialState::Estimated {
        for i in 0..NX {
            sensitivities.slice_mut()[i * lanes.width() + lanes.derivatives() + i] = 1.0;
        }
    }
    sensitivities
}

/// A chunk's work on the lanes.
struct Work<'a, S: Simd, const NX: usize> {
    simd: S,
    lanes: &'a Lanes,
    /// Rows of regressors, point by point.
    regressors: &'a [S::f64s],
    sensitivities: &'a mut [S::f64s],
    rows: &'a mut [S::f64s],
    path: &'a Path<NX>,
    propagators: &'a Propagators<NX>,
    count: usize,
}

impl<S: Simd, const NX: usize> Work<'_, S, NX> {
    /// Reads the sensors and takes the chunk's steps: the groups of all coefficients side by side,
    /// so that the processor has several independent sums to work on, then that of the initial
    /// states.
    #[inline(always)]
    fn all<E: Equations<NX>>(&mut self) {
        let (from, end) = (self.lanes.groups[0].start, self.lanes.groups[0].end);
        for lane in (from..end).step_by(S::F64_LANES) {
            self.bundle::<E, COEFFICIENTS>(lane, [0, 1, 2]);
        }
        let initial = &self.lanes.groups[COEFFICIENTS];
        for lane in (0..initial.end - initial.start).step_by(S::F64_LANES) {
            self.bundle::<E, 1>(lane, [COEFFICIENTS]);
        }
    }

    /// The vectors that begin at a lane of each of some groups, over the chunk.
    #[inline(always)]
    fn bundle<E: Equations<NX>, const N: usize>(&mut self, lane: usize, groups: [usize; N]) {
        let width = self.lanes.width();
        let mut s = [[self.simd.splat_f64s(0.0); NX]; N];
        for n in 0..N {
            for i in 0..NX {
                s[n][i] = self.sensitivities
                    [(i * width + self.lanes.groups[groups[n]].start + lane) / S::F64_LANES];
            }
        }
        for k in 0..self.count {
            let r = self.regressors_at::<N>(lane, groups, k);
            let rows = &mut self.rows[k * OUTPUTS * width / S::F64_LANES..]
                [..OUTPUTS * width / S::F64_LANES];
            for n in 0..N {
                let y = read::<S, NX, E>(self.simd, groups[n], self.propagators, k, &s[n], r[n][0]);
                for o in 0..OUTPUTS {
                    rows[(o * width + self.lanes.groups[groups[n]].start + lane) / S::F64_LANES] =
                        y[o];
                }
            }
            s = step::<S, NX, E, N>(self.simd, groups, self.propagators, k, &s, &r);
        }
        for n in 0..N {
            for i in 0..NX {
                self.sensitivities
                    [(i * width + self.lanes.groups[groups[n]].start + lane) / S::F64_LANES] =
                    s[n][i];
            }
        }
    }

    /// What the derivatives of some groups' lanes multiply at the stages of a step; nothing for
    /// initial states.
    #[inline(always)]
    fn regressors_at<const N: usize>(
        &self,
        lane: usize,
        groups: [usize; N],
        k: usize,
    ) -> [[S::f64s; STAGES]; N] {
        let mut r = [[self.simd.splat_f64s(0.0); STAGES]; N];
        for n in 0..N {
            if groups[n] == COEFFICIENTS {
                continue;
            }
            for stage in 0..STAGES {
                let row = (2 * k + POINT[stage]) * self.lanes.row;
                let regressor =
                    self.regressors[(row + self.lanes.regressors[groups[n]] + lane) / S::F64_LANES];
                r[n][stage] = if lane < VECTOR {
                    self.simd
                        .mul_f64s(regressor, load::<S>(&self.path.times[stage][k], lane))
                } else {
                    regressor
                };
            }
        }
        r
    }
}

/// y = C s + D r for lanes of a coefficient.
#[inline(always)]
fn read<S: Simd, const NX: usize, E: Equations<NX>>(
    simd: S,
    coefficient: usize,
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
        if c == coefficient {
            y[o] = simd.mul_add_f64s(simd.splat_f64s(at.d[o][c][k]), r, y[o]);
        }
    }
    y
}

/// Φ s + Σ Γ r for lanes of some groups.
#[inline(always)]
fn step<S: Simd, const NX: usize, E: Equations<NX>, const N: usize>(
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
