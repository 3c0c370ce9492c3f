//! Flight-path reconstruction of one window for given errors of its instruments, with
//! sensitivities.
//!
//! An input is corrected before it drives the equations, x(t) = (y(t + delay) − bias)/(1 + scale).
//! States and readings are integrated sample by sample. Their sensitivities change as slowly as the
//! aircraft moves, so they obey the linearised equations over steps of a tenth of a second, from node
//! to node. The inputs' slopes enter a step by their means over its samples: then a delay moves an
//! integral of an input exactly as it moves the input, however noisy that is.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::Matrix3;
use pulp::{Arch, Simd, WithSimd};

use super::equations::{self, Inputs, RateSlopes, STATES, State};
use super::parameters::{INPUTS, KINDS, Kind, OUTPUTS, Parameters, place};
use super::window::{Window, input_factor};
use crate::aircraft::Aircraft;
use crate::flight::interpolation_kernel::InterpolationKernel;
use crate::numerics::runge_kutta::{POINT, STAGES, reaches_s, weights_s};
use crate::numerics::simd::{load, store};

/// Parameters of a window alone: its initial state, and the change of the wind north, east and
/// down, ft/s².
pub const LOCAL: usize = STATES + WIND;
pub const WIND: usize = 3;
/// Parameters that the states depend on: the local ones, then bias, scale and delay of each input.
pub const DRIVING: usize = LOCAL + INPUTS * KINDS;
/// Parameters that one output depends on: those of the states, then its own bias, scale and delay.
pub const ROW: usize = DRIVING + KINDS;
/// Length of a row: the parameters of an output and the residual, in whole vectors.
pub const WIDE: usize = (ROW + 1).next_multiple_of(8);

/// Step of the sensitivities, s: a tenth of the period of motions at 1 Hz, faster than which an aircraft
/// hardly turns.
const SENSITIVITY_STEP_S: f64 = 0.1;

pub type Local = [f64; LOCAL];
pub type Row = [f64; WIDE];

/// Readings of a window's output instruments without their own errors, with sensitivities.
#[derive(Debug)]
pub struct Reconstructed {
    /// At every sample.
    pub readings: Vec<[f64; OUTPUTS]>,
    /// Sensitivities along the driving parameters, at every node.
    pub rows: Vec<[Row; OUTPUTS]>,
    /// Samples from a node to the next.
    pub samples_per_node: usize,
}

/// One input without its error at one instant, in rad/s or ft/s², with its slopes along bias, scale
/// and delay.
#[derive(Clone, Copy, Debug, Default)]
struct CorrectedInput {
    value: f64,
    by_error: [f64; KINDS],
}

/// Inputs at one instant.
type Point = [CorrectedInput; INPUTS];

/// Reconstructs a window. `None` where the integration diverges.
pub fn reconstruct(
    window: &Window,
    aircraft: &Aircraft,
    local: &Local,
    shared: &Parameters,
) -> Option<Reconstructed> {
    Arch::new().dispatch(Reconstruction {
        window,
        aircraft,
        local,
        points: &corrected_inputs(window, shared),
        half_step: half_step(window.step_s),
    })
}

/// Samples from a node to the middle of its step.
fn half_step(step_s: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small positive number"
    )]
    let half = (0.5 * SENSITIVITY_STEP_S / step_s).round().max(1.0) as usize;
    half
}

/// Integration of a window, compiled for the processor at hand.
struct Reconstruction<'a> {
    window: &'a Window,
    aircraft: &'a Aircraft,
    local: &'a Local,
    /// Inputs at samples and at the halves between them.
    points: &'a [Point],
    half_step: usize,
}

/// Sensitivities of the states, a row for each state.
type Sensitivities = [Row; STATES];

/// Magnitude of a state (ft, ft/s, rad) from which the integration has diverged.
const DIVERGED: f64 = 1e7;

impl WithSimd for Reconstruction<'_> {
    type Output = Option<Reconstructed>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<Reconstructed> {
        let states = self.states()?;
        let mut readings = Vec::with_capacity(states.len());
        // A loop: an iterator's closure would not be compiled for the processor at hand.
        for (k, x) in states.iter().enumerate() {
            readings.push(self.readings(k, x));
        }
        Some(Reconstructed {
            readings,
            rows: self.rows(simd, &states),
            samples_per_node: 2 * self.half_step,
        })
    }
}

impl Reconstruction<'_> {
    /// States at every sample; `None` where they diverge.
    #[inline(always)]
    fn states(&self) -> Option<Vec<State>> {
        let mut states = Vec::with_capacity(self.window.samples);
        let mut x = State::from_column_slice(&self.local[..STATES]);
        for k in 0..self.window.samples {
            if !x.iter().all(|x| x.is_finite() && x.abs() < DIVERGED) {
                return None;
            }
            states.push(x);
            if k + 1 < self.window.samples {
                x = self.next_state(k, &x);
            }
        }
        Some(states)
    }

    /// State one sample later, by a Runge-Kutta step.
    #[inline(always)]
    fn next_state(&self, k: usize, x: &State) -> State {
        let h = self.window.step_s;
        let (reaches_s, weights_s) = (reaches_s(h), weights_s(h));
        let (mut at, mut end) = (*x, *x);
        for stage in 0..STAGES {
            let sample = if POINT[stage] == 2 { k + 1 } else { k };
            let input = self.points[2 * k + POINT[stage]].map(|input| input.value);
            let terms = &self.window.terms[sample];
            let mut rates = equations::rates(&at, &input, terms);
            for i in 0..WIND {
                for j in 0..WIND {
                    rates[i] -= terms.to_body[(i, j)] * self.local[STATES + j];
                }
            }
            end += rates * weights_s[stage];
            at = x + rates * reaches_s[stage];
        }
        end
    }

    /// Readings at a sample, without instrument errors.
    #[inline(always)]
    fn readings(&self, k: usize, x: &State) -> [f64; OUTPUTS] {
        equations::readings(self.aircraft, x, &self.inputs(k), &self.window.terms[k])
    }

    #[inline(always)]
    fn inputs(&self, k: usize) -> equations::Inputs {
        self.points[2 * k].map(|input| input.value)
    }

    /// Sensitivities of the readings at every node.
    #[inline(always)]
    fn rows<S: Simd>(&self, simd: S, states: &[State]) -> Vec<[Row; OUTPUTS]> {
        let step = 2 * self.half_step;
        let mut s = [[0.0; WIDE]; STATES];
        for i in 0..STATES {
            s[i][i] = 1.0;
        }
        let mut rows = Vec::with_capacity(states.len() / step + 1);
        let mut start = self.linearised(0, states);
        for k in (0..states.len()).step_by(step) {
            rows.push(self.reading_rows(simd, k, &states[k], &s));
            if k + step < states.len() {
                let middle = self.linearised(k + self.half_step, states);
                let end = self.linearised(k + step, states);
                s = self.advanced(simd, k, &s, [&start, &middle, &end]);
                start = end;
            }
        }
        rows
    }

    /// Slopes of the equations at a sample.
    #[inline(always)]
    fn linearised(&self, k: usize, states: &[State]) -> Linearised {
        let terms = &self.window.terms[k];
        Linearised {
            slopes: equations::rate_slopes(&states[k], &self.inputs(k), terms),
            by_wind: -terms.to_body,
        }
    }

    /// Sensitivities one node later, by a Runge-Kutta step of the linearised equations from sample `k`.
    #[inline(always)]
    fn advanced<S: Simd>(
        &self,
        simd: S,
        k: usize,
        s: &Sensitivities,
        linearised: [&Linearised; 3],
    ) -> Sensitivities {
        let step = 2 * self.half_step;
        let h = step as f64 * self.window.step_s;
        let (reaches_s, weights_s) = (reaches_s(h), weights_s(h));
        let by_error = mean_slopes(&self.points[2 * k..=2 * (k + step)]);
        let forcing = linearised.map(|at| at.forcing(&by_error));
        let (mut at, mut end) = (*s, *s);
        for stage in 0..STAGES {
            let (reach, weight) = (
                simd.splat_f64s(reaches_s[stage]),
                simd.splat_f64s(weights_s[stage]),
            );
            let by_state = &linearised[POINT[stage]].slopes.by_state;
            let mut next = at;
            for i in 0..STATES {
                for lane in (0..WIDE).step_by(SIDE_BY_SIDE * S::F64_LANES) {
                    let mut slope = Sum::<S>::of(&forcing[POINT[stage]][i], lane);
                    for &j in equations::RATES_BY_STATE[i] {
                        slope.add(simd, by_state[(i, j)], &at[j]);
                    }
                    slope.each(|lane, slope| {
                        let so_far = load::<S>(&end[i], lane);
                        let start = load::<S>(&s[i], lane);
                        store::<S>(&mut end[i], lane, simd.mul_add_f64s(weight, slope, so_far));
                        store::<S>(&mut next[i], lane, simd.mul_add_f64s(reach, slope, start));
                    });
                }
            }
            at = next;
        }
        end
    }

    /// Sensitivities of the readings at a sample.
    #[inline(always)]
    fn reading_rows<S: Simd>(
        &self,
        simd: S,
        k: usize,
        x: &State,
        s: &Sensitivities,
    ) -> [Row; OUTPUTS] {
        let terms = &self.window.terms[k];
        let at = equations::reading_slopes(self.aircraft, x, &self.inputs(k), terms);
        let by_error = self.points[2 * k].map(|input| input.by_error);
        let mut rows = [[0.0; WIDE]; OUTPUTS];
        for o in 0..OUTPUTS {
            for &rate in equations::READINGS_BY_RATES[o] {
                let errors = &mut rows[o][error_columns(rate)];
                for (slope, by_error) in errors.iter_mut().zip(by_error[rate]) {
                    *slope = at.by_rates[(o, rate)] * by_error;
                }
            }
            for lane in (0..WIDE).step_by(SIDE_BY_SIDE * S::F64_LANES) {
                let mut slope = Sum::<S>::of(&rows[o], lane);
                for &i in equations::READINGS_BY_STATE[o] {
                    slope.add(simd, at.by_state[(o, i)], &s[i]);
                }
                slope.each(|lane, slope| store::<S>(&mut rows[o], lane, slope));
            }
        }
        rows
    }
}

/// Slopes of the equations at one instant along states, inputs and the wind's change.
struct Linearised {
    slopes: RateSlopes,
    by_wind: Matrix3<f64>,
}

impl Linearised {
    /// Slopes of the states' rates along the wind's change and the inputs' errors, as rows.
    #[inline(always)]
    fn forcing(&self, by_error: &[[f64; KINDS]; INPUTS]) -> Sensitivities {
        let mut rows = [[0.0; WIDE]; STATES];
        for i in 0..STATES {
            for &input in equations::RATES_BY_INPUT[i] {
                let errors = &mut rows[i][error_columns(input)];
                for (slope, by_error) in errors.iter_mut().zip(by_error[input]) {
                    *slope = self.slopes.by_input[(i, input)] * by_error;
                }
            }
        }
        for i in 0..WIND {
            for j in 0..WIND {
                rows[i][STATES + j] = self.by_wind[(i, j)];
            }
        }
        rows
    }
}

/// Columns of an input's errors in a row.
#[inline(always)]
fn error_columns(input: usize) -> std::ops::Range<usize> {
    LOCAL + input * KINDS..LOCAL + (input + 1) * KINDS
}

/// Means of the inputs' slopes over points that begin and end at samples, by Simpson's rule from
/// sample to sample.
#[inline(always)]
fn mean_slopes(points: &[Point]) -> [[f64; KINDS]; INPUTS] {
    let per_weight = 1.0 / (3 * (points.len() - 1)) as f64;
    let mut means = [[0.0; KINDS]; INPUTS];
    for (n, point) in points.iter().enumerate() {
        let weight = match n {
            _ if n % 2 == 1 => 4.0,
            _ if n == 0 || n + 1 == points.len() => 1.0,
            _ => 2.0,
        };
        for input in 0..INPUTS {
            for kind in 0..KINDS {
                means[input][kind] += per_weight * weight * point[input].by_error[kind];
            }
        }
    }
    means
}

/// Vectors of a row that are summed side by side: independent sums hide the latency of each.
const SIDE_BY_SIDE: usize = 4;

/// Lanes of a sum of rows, in the processor's registers.
struct Sum<S: Simd> {
    first: usize,
    lanes: [S::f64s; SIDE_BY_SIDE],
}

impl<S: Simd> Sum<S> {
    /// Sum that begins with a row.
    #[inline(always)]
    fn of(row: &Row, first: usize) -> Self {
        Sum {
            first,
            lanes: std::array::from_fn(|n| load::<S>(row, first + n * S::F64_LANES)),
        }
    }

    #[inline(always)]
    fn add(&mut self, simd: S, factor: f64, row: &Row) {
        let factor = simd.splat_f64s(factor);
        for n in 0..SIDE_BY_SIDE {
            self.lanes[n] = simd.mul_add_f64s(
                factor,
                load::<S>(row, self.first + n * S::F64_LANES),
                self.lanes[n],
            );
        }
    }

    /// Calls `give` with each vector and its first lane.
    #[inline(always)]
    fn each(self, mut give: impl FnMut(usize, S::f64s)) {
        for n in 0..SIDE_BY_SIDE {
            give(self.first + n * S::F64_LANES, self.lanes[n]);
        }
    }
}

/// Inputs without their errors at samples and at the halves between them, in rad/s and ft/s².
pub fn input_values(window: &Window, shared: &Parameters) -> Vec<Inputs> {
    let points = corrected_inputs(window, shared);
    points.iter().map(|point| point.map(|p| p.value)).collect()
}

/// Corrected inputs at samples and at the halves between them.
fn corrected_inputs(window: &Window, shared: &Parameters) -> Vec<Point> {
    let mut points = vec![[CorrectedInput::default(); INPUTS]; 2 * window.samples - 1];
    for i in 0..INPUTS {
        let parameter = |kind| shared[place(i, kind)];
        let (bias, gain, delay) = (
            parameter(Kind::Bias),
            1.0 + parameter(Kind::Scale),
            parameter(Kind::Delay),
        );
        let values = &window.inputs[i];
        let unit = input_factor(i) / gain;
        let halves = [0.0, 0.5].map(|half| InterpolationKernel::at(delay / window.step_s + half));
        for (j, point) in points.iter_mut().enumerate() {
            let (sum, by_shift) =
                halves[j % 2].interpolate(window.margin + j / 2, values.len(), |k| values[k]);
            let value = unit * (sum - bias);
            point[i] = CorrectedInput {
                value,
                by_error: [-unit, -value / gain, unit * by_shift / window.step_s],
            };
        }
    }
    points
}

/// Place among the shared parameters of a column of an output's row; the columns before `LOCAL` are
/// local parameters.
pub fn shared_place(column: usize, o: usize) -> usize {
    if column < DRIVING {
        column - LOCAL
    } else {
        (INPUTS + o) * KINDS + column - DRIVING
    }
}
