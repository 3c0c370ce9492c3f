//! The inner loop: one pass over a maneuver integrates the states, and beside them the sensitivities of all parameters.
//!
//! With A = ∂ẋ/∂x (coefficients included) and B = ∂ẋ/∂c at each stage, all sensitivities obey ṡ_j = A s_j + B_k r_j, k being
//! the coefficient of derivative j: one A for all, so parameters lie side by side in the lanes of the processor's vectors
//! ([`Lanes`]) and each lane takes the same Runge-Kutta step. Outputs read y_j = C s_j + D_k r_j. The states themselves
//! are a chain of dependent operations that the processor works off between those of the lanes.
//!
//! Compiled for several widths of vectors, chosen when the program runs. Each lane is computed alike in all of them, with
//! fused multiplication, so the width does not show in the results.
#![expect(clippy::inline_always, reason = "compiled into one loop for the processor at hand")]

use nalgebra::SVector;
use pulp::{Arch, Simd, WithSimd};

use super::case::{Case, Coefficients, InitialState};
use super::lanes::Lanes;
use super::response::Diverged;
use crate::dynamics::runge_kutta::{self, STAGES};
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};

/// Samples between two calls of the sink: what they leave fits into the fastest memory.
pub(super) const CHUNK: usize = 20;

/// A state beyond this (rad, rad/s) is no flight: it stops the integration before the numbers overflow.
const BEYOND_SENSE: f64 = 50.0;

/// What becomes of the sensitivities of the outputs.
pub(super) trait Sink {
    /// Takes the outputs of some samples from `first` on and their sensitivities: sample by sample, output by output one
    /// row of packed lanes. Nobody needs the rows afterwards.
    fn take<S: Simd>(&mut self, simd: S, first: usize, outputs: &[[f64; OUTPUTS]], rows: &mut [f64]);
}

/// Slopes at one stage of a step.
#[derive(Clone, Copy)]
struct Slopes<const NX: usize> {
    /// The state that they are taken at.
    x: [f64; NX],
    a: [[f64; NX]; NX],
    b: [[f64; COEFFICIENTS]; NX],
}

/// Slopes of the outputs.
#[derive(Clone, Copy)]
struct Reading<const NX: usize> {
    x: [f64; NX],
    c: [[f64; NX]; OUTPUTS],
    d: [[f64; COEFFICIENTS]; OUTPUTS],
}

/// One pass.
struct Pass<'a, const NX: usize, E: Equations<NX>, K: Sink> {
    case: &'a Case<NX, E>,
    coefficients: Coefficients<NX>,
    start: SVector<f64, NX>,
    biases: [f64; OUTPUTS],
    outputs: &'a mut [[f64; OUTPUTS]],
    sink: &'a mut K,
}

impl<const NX: usize, E: Equations<NX>> Case<NX, E> {
    /// Integrates with these parameters: outputs to `outputs`, sensitivities to the sink.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves the bounds of sense or is no number.
    pub(super) fn pass(
        &self,
        parameters: &[f64],
        outputs: &mut [[f64; OUTPUTS]],
        sink: &mut impl Sink,
    ) -> Result<(), Diverged> {
        let mut biases = [0.0; OUTPUTS];
        for (&o, bias) in self.biased.iter().zip(&parameters[self.derivatives()..]) {
            biases[o] += bias;
        }
        let first = self.parameters() - NX.min(self.parameters());
        let start = match self.initial_state {
            InitialState::Measured => self.start,
            InitialState::Estimated => SVector::from_fn(|i, _| parameters[first + i]),
        };
        let coefficients = self.with(parameters);
        Arch::new().dispatch(Pass { case: self, coefficients, start, biases, outputs, sink })
    }
}

impl<const NX: usize, E: Equations<NX>, K: Sink> WithSimd for Pass<'_, NX, E, K> {
    type Output = Result<(), Diverged>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Result<(), Diverged> {
        let (case, lanes) = (self.case, &self.case.lanes);
        let samples = case.samples();
        let mut x = self.start;
        let mut sensitivities = at_start::<NX>(case.initial_state, lanes);
        let row = OUTPUTS * lanes.width;
        let mut rows = vec![0.0; CHUNK * row];
        let mut slopes = [Slopes { x: [0.0; NX], a: [[0.0; NX]; NX], b: [[0.0; COEFFICIENTS]; NX] }; STAGES];
        for sample in 0..samples {
            let mut sensible = true;
            for i in 0..NX {
                sensible &= x[i].abs() < BEYOND_SENSE;
            }
            if !sensible {
                return Err(Diverged { sample });
            }
            let (c, c_by_state) = self.coefficients.at(2 * sample, &x);
            let read = E::outputs(&case.known[2 * sample], &case.sensed[sample], &x, &c);
            let reading = Reading {
                x: x.into(),
                c: total(E::OUTPUTS_BY_STATE, E::OUTPUTS_BY_COEFFICIENT, &read.by_state, &read.by_coefficient, &c_by_state),
                d: rows_of(&read.by_coefficient),
            };
            for o in 0..OUTPUTS {
                self.outputs[sample][o] = read.outputs[o] + self.biases[o];
            }
            let steps = sample + 1 < samples;
            if steps {
                x = runge_kutta::step(
                    x,
                    case.step_s,
                    #[inline(always)]
                    |stage, x| {
                        let point = 2 * sample + runge_kutta::POINT[stage];
                        let (c, c_by_state) = self.coefficients.at(point, &x);
                        let rates = E::rates(&case.known[point], &x, &c);
                        let (by_state, by_coefficient) = (&rates.by_state, &rates.by_coefficient);
                        slopes[stage] = Slopes {
                            x: x.into(),
                            a: total(E::RATES_BY_STATE, E::RATES_BY_COEFFICIENT, by_state, by_coefficient, &c_by_state),
                            b: rows_of(by_coefficient),
                        };
                        rates.rates
                    },
                    #[inline(always)]
                    |x, h, k| x + k * h,
                );
            }
            let at = sample % CHUNK;
            let mut work = Work {
                simd,
                lanes,
                regressors: &case.regressors[2 * sample * lanes.derivatives()..],
                sensitivities: &mut sensitivities,
                rows: &mut rows[at * row..],
                slopes: steps.then_some(&slopes),
                reading: &reading,
                step_s: case.step_s,
            };
            work.group::<E, 0>();
            work.group::<E, 1>();
            work.group::<E, 2>();
            work.group::<E, COEFFICIENTS>();
            if at + 1 == CHUNK || !steps {
                self.sink.take(simd, sample - at, &self.outputs[sample - at..=sample], &mut rows);
            }
        }
        Ok(())
    }
}

/// Zero, but one for each free initial state along itself.
fn at_start<const NX: usize>(initial_state: InitialState, lanes: &Lanes) -> Vec<f64> {
    let mut sensitivities = vec![0.0; NX * lanes.padded()];
    if initial_state == InitialState::Estimated {
        for i in 0..NX {
            sensitivities[i * lanes.padded() + lanes.initial() + i] = 1.0;
        }
    }
    sensitivities
}

/// Slopes along the states with those through the coefficients, where they can be other than zero.
#[inline(always)]
fn total<const N: usize, const NX: usize>(
    along_states: &[(usize, usize)],
    along_coefficients: &[(usize, usize)],
    by_state: &nalgebra::SMatrix<f64, N, NX>,
    by_coefficient: &nalgebra::SMatrix<f64, N, COEFFICIENTS>,
    c_by_state: &[[f64; NX]; COEFFICIENTS],
) -> [[f64; NX]; N] {
    let mut sum = [[0.0; NX]; N];
    for &(i, j) in along_states {
        sum[i][j] = by_state[(i, j)];
        for &(row, k) in along_coefficients {
            if row == i {
                sum[i][j] = by_coefficient[(i, k)].mul_add(c_by_state[k][j], sum[i][j]);
            }
        }
    }
    sum
}

/// The rows of a matrix.
#[inline(always)]
fn rows_of<const N: usize, const M: usize>(matrix: &nalgebra::SMatrix<f64, N, M>) -> [[f64; M]; N] {
    let mut rows = [[0.0; M]; N];
    for i in 0..N {
        for j in 0..M {
            rows[i][j] = matrix[(i, j)];
        }
    }
    rows
}

/// One sample's work on the lanes.
struct Work<'a, S: Simd, const NX: usize> {
    simd: S,
    lanes: &'a Lanes,
    /// Rows of regressors from the sample's point on.
    regressors: &'a [f64],
    sensitivities: &'a mut [f64],
    rows: &'a mut [f64],
    /// None at the last sample.
    slopes: Option<&'a [Slopes<NX>; STAGES]>,
    reading: &'a Reading<NX>,
    step_s: f64,
}

impl<S: Simd, const NX: usize> Work<'_, S, NX> {
    /// Reads the sensors and takes a step for the lanes of coefficient `K`; for those of the initial states where `K` is
    /// none.
    #[inline(always)]
    fn group<E: Equations<NX>, const K: usize>(&mut self) {
        let (simd, lanes) = (self.simd, self.lanes);
        let padded = lanes.padded();
        for lane in lanes.groups[K].clone().step_by(S::F64_LANES) {
            let mut s = [simd.splat_f64s(0.0); NX];
            for i in 0..NX {
                s[i] = load::<S>(self.sensitivities, i * padded + lane);
            }
            let r = self.regressor::<E, K>(lane, 0, &self.reading.x);
            let packed = lanes.packed[K] + lane - lanes.groups[K].start;
            let y = read::<S, NX, E, K>(simd, self.reading, &s, r);
            for o in 0..OUTPUTS {
                store::<S>(self.rows, o * lanes.width + packed, y[o]);
            }
            let Some(slopes) = self.slopes else { continue };
            let next = runge_kutta::step(
                s,
                self.step_s,
                #[inline(always)]
                |stage, s| {
                    let at = &slopes[stage];
                    let r = if stage == 0 { r } else { self.regressor::<E, K>(lane, runge_kutta::POINT[stage], &at.x) };
                    rates::<S, NX, E, K>(simd, at, &s, r)
                },
                #[inline(always)]
                |s, h, k| {
                    let (mut moved, h) = (s, simd.splat_f64s(h));
                    for i in 0..NX {
                        moved[i] = simd.mul_add_f64s(h, k[i], s[i]);
                    }
                    moved
                },
            );
            for i in 0..NX {
                store::<S>(self.sensitivities, i * padded + lane, next[i]);
            }
        }
    }

    /// What the derivatives of these lanes multiply at a point, when the state is x.
    #[inline(always)]
    fn regressor<E: Equations<NX>, const K: usize>(&self, lane: usize, point: usize, x: &[f64; NX]) -> S::f64s {
        let (simd, lanes) = (self.simd, self.lanes);
        if K == COEFFICIENTS {
            return simd.splat_f64s(0.0);
        }
        let mut times = load::<S>(&lanes.along[0], lane);
        for &i in E::FOLLOWED {
            times = simd.mul_add_f64s(load::<S>(&lanes.along[i + 1], lane), simd.splat_f64s(x[i]), times);
        }
        simd.mul_f64s(load::<S>(self.regressors, point * lanes.derivatives() + lane), times)
    }
}

/// y = C s + D r for lanes of coefficient `K`.
#[inline(always)]
fn read<S: Simd, const NX: usize, E: Equations<NX>, const K: usize>(
    simd: S,
    at: &Reading<NX>,
    s: &[S::f64s; NX],
    r: S::f64s,
) -> [S::f64s; OUTPUTS] {
    let mut y = [simd.splat_f64s(0.0); OUTPUTS];
    for &(o, i) in E::OUTPUTS_BY_STATE {
        y[o] = simd.mul_add_f64s(simd.splat_f64s(at.c[o][i]), s[i], y[o]);
    }
    for &(o, k) in E::OUTPUTS_BY_COEFFICIENT {
        if k == K {
            y[o] = simd.mul_add_f64s(simd.splat_f64s(at.d[o][k]), r, y[o]);
        }
    }
    y
}

/// ṡ = A s + B r for lanes of coefficient `K`.
#[inline(always)]
fn rates<S: Simd, const NX: usize, E: Equations<NX>, const K: usize>(
    simd: S,
    at: &Slopes<NX>,
    s: &[S::f64s; NX],
    r: S::f64s,
) -> [S::f64s; NX] {
    let mut rates = [simd.splat_f64s(0.0); NX];
    for &(i, j) in E::RATES_BY_STATE {
        rates[i] = simd.mul_add_f64s(simd.splat_f64s(at.a[i][j]), s[j], rates[i]);
    }
    for &(i, k) in E::RATES_BY_COEFFICIENT {
        if k == K {
            rates[i] = simd.mul_add_f64s(simd.splat_f64s(at.b[i][k]), r, rates[i]);
        }
    }
    rates
}

/// The vector that begins at a place of a slice.
#[inline(always)]
pub(super) fn load<S: Simd>(from: &[f64], at: usize) -> S::f64s {
    S::as_simd_f64s(&from[at..at + S::F64_LANES]).0[0]
}

/// Writes a vector to a place of a slice.
#[inline(always)]
pub(super) fn store<S: Simd>(to: &mut [f64], at: usize, value: S::f64s) {
    S::as_mut_simd_f64s(&mut to[at..at + S::F64_LANES]).0[0] = value;
}
