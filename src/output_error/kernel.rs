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
#![expect(clippy::needless_range_loop, reason = "plain indices become straight code for the vectors")]

use nalgebra::SVector;
use pulp::{Arch, Simd, WithSimd};

use super::case::{Case, Coefficients, InitialState};
use super::lanes::{Aligned, Lanes, VECTOR};
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
    /// row of lanes. Nobody needs the rows afterwards.
    fn take<S: Simd>(&mut self, simd: S, first: usize, outputs: &[[f64; OUTPUTS]], rows: &mut [f64]);
}

/// What the first lanes of a group multiply their regressors by: the states that they follow, else one.
type Times = [f64; VECTOR];

#[inline(always)]
fn set_times<const NX: usize>(times: &mut Times, followed: &[usize], x: &SVector<f64, NX>) {
    for (slot, &state) in followed.iter().enumerate() {
        times[slot] = x[state];
    }
}

/// Slopes at one stage of a step.
#[derive(Clone, Copy)]
struct Slopes<const NX: usize> {
    times: Times,
    a: [[f64; NX]; NX],
    b: [[f64; COEFFICIENTS]; NX],
}

/// Slopes of the outputs.
#[derive(Clone, Copy)]
struct Reading<const NX: usize> {
    times: Times,
    c: [[f64; NX]; OUTPUTS],
    d: [[f64; COEFFICIENTS]; OUTPUTS],
}

/// What the lanes need to know of a sample and the step from it.
#[derive(Clone, Copy)]
struct Linear<const NX: usize> {
    reading: Reading<NX>,
    slopes: [Slopes<NX>; STAGES],
}

impl<const NX: usize> Linear<NX> {
    const NONE: Linear<NX> = Linear {
        reading: Reading { times: [1.0; VECTOR], c: [[0.0; NX]; OUTPUTS], d: [[0.0; COEFFICIENTS]; OUTPUTS] },
        slopes: [Slopes { times: [1.0; VECTOR], a: [[0.0; NX]; NX], b: [[0.0; COEFFICIENTS]; NX] }; STAGES],
    };
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
        let sensitivities = sensitivities.slice_mut();
        let row = OUTPUTS * lanes.width();
        let mut rows = Aligned::zeros(CHUNK * row);
        let rows = rows.slice_mut();
        let regressors = case.regressors.slice();
        // The lanes are a sample behind the states, so that both are under way at once; what they need of a sample lies in
        // one of two places in turn.
        let mut linear = [Linear::<NX>::NONE; 2];
        for sample in 0..=samples {
            let [even, odd] = &mut linear;
            let (now, before) = if sample % 2 == 0 { (even, &*odd) } else { (odd, &*even) };
            let behind = sample.saturating_sub(1);
            let mut work = Work {
                simd,
                lanes,
                regressors: S::as_simd_f64s(&regressors[2 * behind * lanes.derivatives()..]).0,
                sensitivities: S::as_mut_simd_f64s(sensitivities).0,
                rows: S::as_mut_simd_f64s(&mut rows[behind % CHUNK * row..]).0,
                linear: before,
                step_s: case.step_s,
                steps: behind + 1 < samples,
            };
            let near = self.coefficients.near::<3>((2 * sample).min(2 * samples - 2));
            if sample < samples {
                let mut sensible = true;
                for i in 0..NX {
                    sensible &= x[i].abs() < BEYOND_SENSE;
                }
                if !sensible {
                    return Err(Diverged { sample });
                }
                let c = near[0].with(&x);
                let read = E::outputs(&case.known[2 * sample], &case.sensed[sample], &x, &c);
                let reading = &mut now.reading;
                set_times(&mut reading.times, E::FOLLOWED, &x);
                set(&mut reading.d, E::OUTPUTS_BY_COEFFICIENT, &read.by_coefficient);
                set(&mut reading.c, E::OUTPUTS_BY_STATE, &read.by_state);
                let slopes = &near[0].slope;
                add_through(&mut reading.c, E::OUTPUTS_BY_COEFFICIENT, E::FOLLOWED, &read.by_coefficient, slopes);
                for o in 0..OUTPUTS {
                    self.outputs[sample][o] = read.outputs[o] + self.biases[o];
                }
            }
            if sample + 1 < samples {
                let known = &case.known[2 * sample..2 * sample + 3];
                x = runge_kutta::step(
                    x,
                    case.step_s,
                    #[inline(always)]
                    |stage, x| {
                        let point = runge_kutta::POINT[stage];
                        let rates = E::rates(&known[point], &x, &near[point].with(&x));
                        let at = &mut now.slopes[stage];
                        set_times(&mut at.times, E::FOLLOWED, &x);
                        set(&mut at.b, E::RATES_BY_COEFFICIENT, &rates.by_coefficient);
                        set(&mut at.a, E::RATES_BY_STATE, &rates.by_state);
                        let slopes = &near[point].slope;
                        add_through(&mut at.a, E::RATES_BY_COEFFICIENT, E::FOLLOWED, &rates.by_coefficient, slopes);
                        rates.rates
                    },
                    #[inline(always)]
                    |x, h, k| {
                        let mut moved = x;
                        for i in 0..NX {
                            moved[i] = k[i].mul_add(h, x[i]);
                        }
                        moved
                    },
                );
            }
            if sample > 0 {
                work.all::<E>();
            }
            let at = behind % CHUNK;
            if sample > 0 && (at + 1 == CHUNK || sample == samples) {
                self.sink.take(simd, behind - at, &self.outputs[behind - at..=behind], rows);
            }
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

/// Takes over what can be other than zero.
#[inline(always)]
fn set<const N: usize, const M: usize>(
    rows: &mut [[f64; M]; N],
    places: &[(usize, usize)],
    slopes: &nalgebra::SMatrix<f64, N, M>,
) {
    for &(i, j) in places {
        rows[i][j] = slopes[(i, j)];
    }
}

/// Adds to slopes along states those through the coefficients.
#[inline(always)]
fn add_through<const N: usize, const NX: usize>(
    by_state: &mut [[f64; NX]; N],
    places: &[(usize, usize)],
    followed: &[usize],
    by_coefficient: &nalgebra::SMatrix<f64, N, COEFFICIENTS>,
    c_by_state: &[[f64; NX]; COEFFICIENTS],
) {
    for &(i, k) in places {
        for &j in followed {
            by_state[i][j] = by_coefficient[(i, k)].mul_add(c_by_state[k][j], by_state[i][j]);
        }
    }
}

/// One sample's work on the lanes.
struct Work<'a, S: Simd, const NX: usize> {
    simd: S,
    lanes: &'a Lanes,
    /// Rows of regressors from the sample's point on.
    regressors: &'a [S::f64s],
    sensitivities: &'a mut [S::f64s],
    rows: &'a mut [S::f64s],
    linear: &'a Linear<NX>,
    step_s: f64,
    /// Whether a step follows: not after the last sample.
    steps: bool,
}

impl<S: Simd, const NX: usize> Work<'_, S, NX> {
    /// Reads the sensors and takes a step: the groups of all coefficients side by side, so that the processor has several
    /// independent sums to work on, then that of the initial states.
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

    /// The vectors that begin at a lane of each of some groups.
    #[inline(always)]
    fn bundle<E: Equations<NX>, const N: usize>(&mut self, lane: usize, groups: [usize; N]) {
        let (simd, lanes, linear) = (self.simd, self.lanes, self.linear);
        let width = lanes.width();
        let mut s = [[simd.splat_f64s(0.0); NX]; N];
        let mut r = [simd.splat_f64s(0.0); N];
        for n in 0..N {
            let at = lanes.groups[groups[n]].start + lane;
            for i in 0..NX {
                s[n][i] = self.sensitivities[(i * width + at) / S::F64_LANES];
            }
            r[n] = self.regressor(groups[n], lane, 0, &linear.reading.times);
            let y = read::<S, NX, E>(simd, groups[n], &linear.reading, &s[n], r[n]);
            for o in 0..OUTPUTS {
                self.rows[(o * width + at) / S::F64_LANES] = y[o];
            }
        }
        if !self.steps {
            return;
        }
        let next = runge_kutta::step(
            s,
            self.step_s,
            #[inline(always)]
            |stage, s| {
                let at = &linear.slopes[stage];
                let point = runge_kutta::POINT[stage];
                let mut slope = s;
                for n in 0..N {
                    let r = if stage == 0 { r[n] } else { self.regressor(groups[n], lane, point, &at.times) };
                    slope[n] = rates::<S, NX, E>(simd, groups[n], at, &s[n], r);
                }
                slope
            },
            #[inline(always)]
            |s, h, k| {
                let (mut moved, h) = (s, simd.splat_f64s(h));
                for n in 0..N {
                    for i in 0..NX {
                        moved[n][i] = simd.mul_add_f64s(h, k[n][i], s[n][i]);
                    }
                }
                moved
            },
        );
        for n in 0..N {
            let at = lanes.groups[groups[n]].start + lane;
            for i in 0..NX {
                self.sensitivities[(i * width + at) / S::F64_LANES] = next[n][i];
            }
        }
    }

    /// What the derivatives of a group's lanes multiply at a point; nothing for initial states.
    #[inline(always)]
    fn regressor(&self, group: usize, lane: usize, point: usize, times: &Times) -> S::f64s {
        if group == COEFFICIENTS {
            return self.simd.splat_f64s(0.0);
        }
        let at = point * self.lanes.derivatives() + self.lanes.groups[group].start + lane;
        let regressor = self.regressors[at / S::F64_LANES];
        if lane < VECTOR { self.simd.mul_f64s(regressor, load::<S>(times, lane)) } else { regressor }
    }
}

/// y = C s + D r for lanes of a coefficient.
#[inline(always)]
fn read<S: Simd, const NX: usize, E: Equations<NX>>(
    simd: S,
    coefficient: usize,
    at: &Reading<NX>,
    s: &[S::f64s; NX],
    r: S::f64s,
) -> [S::f64s; OUTPUTS] {
    let mut y = [simd.splat_f64s(0.0); OUTPUTS];
    for &(o, i) in E::OUTPUTS_BY_STATE {
        y[o] = simd.mul_add_f64s(simd.splat_f64s(at.c[o][i]), s[i], y[o]);
    }
    for &(o, k) in E::OUTPUTS_BY_COEFFICIENT {
        if k == coefficient {
            y[o] = simd.mul_add_f64s(simd.splat_f64s(at.d[o][k]), r, y[o]);
        }
    }
    y
}

/// ṡ = A s + B r for lanes of a coefficient.
#[inline(always)]
fn rates<S: Simd, const NX: usize, E: Equations<NX>>(
    simd: S,
    coefficient: usize,
    at: &Slopes<NX>,
    s: &[S::f64s; NX],
    r: S::f64s,
) -> [S::f64s; NX] {
    let mut rates = [simd.splat_f64s(0.0); NX];
    for &(i, j) in E::RATES_BY_STATE {
        rates[i] = simd.mul_add_f64s(simd.splat_f64s(at.a[i][j]), s[j], rates[i]);
    }
    for &(i, k) in E::RATES_BY_COEFFICIENT {
        if k == coefficient {
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
