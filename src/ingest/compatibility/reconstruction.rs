//! Flight-path reconstruction of one window for given errors of its instruments, with
//! sensitivities.
//!
//! The *inputs* are the rates and accelerations, which drive the equations; the *outputs* are the
//! other instruments, which the reconstructed motion predicts. The true value x of an input follows
//! from the recorded value y, both in rad/s or ft/s²:
//!
//! x(t) = (y(t + delay) − bias)/(1 + scale).
//!
//! Bias (same unit), scale (a ratio) and delay (s) are the errors of its instrument.
//!
//! Two grids of time are used:
//!
//! - *Points*, a twentieth of a second apart, to which Runge-Kutta steps integrate the states.
//!   Within a step an input is a parabola through its values at the two points, with the mean of
//!   its samples. Its integral is therefore exact. Readings between points are interpolated.
//! - *Nodes*, every second point, at which sensitivities are computed from the linearised equations.
//!   They change as slowly as the aircraft moves.
//!
//! The slopes of an input along its errors enter the linearised equations by their means over a step
//! between nodes. The computed effect of a delay on an integral is then exact for noisy inputs too.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::{Matrix3, SMatrix};
use pulp::{Arch, Simd, WithSimd};

use super::equations::{self, Inputs, RateSlopes, STATES, State};
use super::parameters::{INPUTS, KINDS, Kind, OUTPUTS, Parameters, input_factor, place};
use super::window::Window;
use crate::aircraft::Aircraft;
use crate::flight::interpolation_kernel::InterpolationKernel;
use crate::numerics::runge_kutta::{POINT, STAGES, reaches_s, weights_s};
use crate::numerics::vectors::simd::{VECTOR, load, store};

/// Number of parameters of a window alone: its initial state, and the rates of change of the wind.
pub const LOCAL: usize = STATES + WIND;
/// Number of wind parameters: rates of change of the wind north, east and down, ft/s².
pub const WIND: usize = 3;
/// Number of parameters that the states depend on: the local ones, then bias, scale and delay of each
/// input.
pub const DRIVING: usize = LOCAL + INPUTS * KINDS;
/// Number of parameters that one output depends on: those of the states, then its own bias, scale and
/// delay.
pub const ROW: usize = DRIVING + KINDS;
/// Length of a row in whole vectors.
pub const WIDE: usize = ROW.next_multiple_of(VECTOR);

/// Values of a window's own parameters.
pub type LocalParameters = [f64; LOCAL];
/// Slopes of one state or reading along the parameters, padded to whole vectors.
pub type Row = [f64; WIDE];

/// Reconstructed motion of a window at its points.
#[derive(Clone, Debug)]
pub struct Trajectory {
    inputs: CorrectedInputs,
    states: Vec<State>,
    /// Reading of each output at the points, as an instrument without errors would give it.
    pub readings: [Vec<f64>; OUTPUTS],
}

/// Sensitivities of a window at its nodes.
#[derive(Clone, Debug)]
pub struct TrajectorySensitivities {
    /// At each node, slopes of each output's reading, errors included, along the parameters of a row.
    pub rows: Vec<[Row; OUTPUTS]>,
    /// Slopes of the states along the initial state.
    pub transitions: Vec<SMatrix<f64, STATES, STATES>>,
    /// Slopes of the states' rates along the inputs.
    pub by_input: Vec<SMatrix<f64, STATES, INPUTS>>,
}

/// Inputs without the errors of their instruments, in rad/s and ft/s².
#[derive(Clone, Debug)]
struct CorrectedInputs {
    /// At points and at the middles between them.
    values: Vec<Inputs>,
    /// Slopes in time at points, per s.
    slopes: Vec<Inputs>,
    /// Slope of the corrected input along the instrument's bias.
    by_bias: Inputs,
    /// Scale factors of the instruments, 1 + scale.
    gains: Inputs,
}

/// Reconstructs the motion of a window. `None` if the integration diverges.
pub fn reconstruct(
    window: &Window,
    aircraft: &Aircraft,
    local: &LocalParameters,
    shared: &Parameters,
) -> Option<Trajectory> {
    let inputs = CorrectedInputs::of(window, shared);
    let (states, readings) = Arch::new().dispatch(Integration {
        window,
        aircraft,
        local,
        inputs: &inputs,
    })?;
    Some(Trajectory {
        inputs,
        states,
        readings,
    })
}

/// Computes the sensitivities of a reconstructed window.
pub fn sensitivities(
    window: &Window,
    aircraft: &Aircraft,
    shared: &Parameters,
    trajectory: &Trajectory,
) -> TrajectorySensitivities {
    Arch::new().dispatch(Linearisation {
        window,
        aircraft,
        shared,
        trajectory,
    })
}

/// Integration of a window, compiled for the processor at hand.
struct Integration<'a> {
    window: &'a Window,
    aircraft: &'a Aircraft,
    local: &'a LocalParameters,
    inputs: &'a CorrectedInputs,
}

/// Magnitude of a state (ft, ft/s, rad) from which the integration has diverged.
const DIVERGED: f64 = 1e7;

impl WithSimd for Integration<'_> {
    type Output = Option<(Vec<State>, [Vec<f64>; OUTPUTS])>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let states = self.states()?;
        let mut readings = [const { Vec::new() }; OUTPUTS];
        for of_output in &mut readings {
            of_output.reserve_exact(states.len());
        }
        // A loop: an iterator's closure would not be compiled for the processor at hand.
        for (point, x) in states.iter().enumerate() {
            let (input, terms) = (&self.inputs.values[2 * point], &self.window.terms[point]);
            let now = equations::readings(self.aircraft, x, input, terms);
            for o in 0..OUTPUTS {
                readings[o].push(now[o]);
            }
        }
        Some((states, readings))
    }
}

impl Integration<'_> {
    /// States at every point; `None` if they diverge.
    #[inline(always)]
    fn states(&self) -> Option<Vec<State>> {
        let points = self.window.points();
        let mut states = Vec::with_capacity(points);
        let mut x = State::from_column_slice(&self.local[..STATES]);
        for point in 0..points {
            if !x.iter().all(|x| x.is_finite() && x.abs() < DIVERGED) {
                return None;
            }
            states.push(x);
            if point + 1 < points {
                x = self.next_state(point, &x);
            }
        }
        Some(states)
    }

    /// State one point later, by a Runge-Kutta step.
    #[inline(always)]
    fn next_state(&self, point: usize, x: &State) -> State {
        let h = self.window.point_step_s();
        let (reaches_s, weights_s) = (reaches_s(h), weights_s(h));
        let (mut at, mut end) = (*x, *x);
        for stage in 0..STAGES {
            let terms = &self.window.terms[point + POINT[stage] / 2];
            let input = &self.inputs.values[2 * point + POINT[stage]];
            let mut rates = equations::rates(&at, input, terms);
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
}

/// Linearised equations of a window, compiled for the processor at hand.
struct Linearisation<'a> {
    window: &'a Window,
    aircraft: &'a Aircraft,
    shared: &'a Parameters,
    trajectory: &'a Trajectory,
}

/// Sensitivities of the states, a row for each state.
type Sensitivities = [Row; STATES];

impl WithSimd for Linearisation<'_> {
    type Output = TrajectorySensitivities;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> TrajectorySensitivities {
        let nodes = self.window.nodes();
        // Steps alternate between buffers: copies would take a third of the time.
        let mut ends = [const { [[0.0; WIDE]; STATES] }; 2];
        let [mut s, mut end] = ends.each_mut();
        let mut within = StepBuffers::zeros();
        for i in 0..STATES {
            s[i][i] = 1.0;
        }
        let mut out = TrajectorySensitivities {
            rows: vec![[[0.0; WIDE]; OUTPUTS]; nodes],
            transitions: Vec::with_capacity(nodes),
            by_input: Vec::with_capacity(nodes),
        };
        let mut start = self.linearised(0);
        for node in 0..nodes {
            self.write_reading_rows(simd, node, s, &mut out.rows[node]);
            out.transitions.push(SMatrix::from_fn(|i, j| s[i][j]));
            out.by_input.push(start.slopes.by_input);
            if node + 1 < nodes {
                let middle = self.linearised(2 * node + 1);
                let later = self.linearised(2 * node + 2);
                self.advance(simd, node, [&start, &middle, &later], [s, end], &mut within);
                std::mem::swap(&mut s, &mut end);
                start = later;
            }
        }
        out
    }
}

impl Linearisation<'_> {
    /// Slopes of the equations at a point.
    #[inline(always)]
    fn linearised(&self, point: usize) -> Linearised {
        let Trajectory { inputs, states, .. } = self.trajectory;
        let terms = &self.window.terms[point];
        Linearised {
            slopes: equations::rate_slopes(&states[point], &inputs.values[2 * point], terms),
            by_wind: -terms.to_body,
        }
    }

    /// Writes the sensitivities one node later to `end`, by a Runge-Kutta step of the linearised equations
    /// from `s`.
    #[inline(always)]
    fn advance<S: Simd>(
        &self,
        simd: S,
        node: usize,
        linearised: [&Linearised; 3],
        [s, end]: [&mut Sensitivities; 2],
        StepBuffers { forcing, stages }: &mut StepBuffers,
    ) {
        let h = 2.0 * self.window.point_step_s();
        let (reaches_s, weights_s) = (reaches_s(h), weights_s(h));
        let by_error = self.trajectory.inputs.mean_by_error(2 * node, h);
        for n in 0..forcing.len() {
            linearised[n].write_forcing(&by_error, &mut forcing[n]);
        }
        let [mut at, mut next] = stages.each_mut();
        for stage in 0..STAGES {
            let is_first = stage == 0;
            let (reach, weight) = (
                simd.splat_f64s(reaches_s[stage]),
                simd.splat_f64s(weights_s[stage]),
            );
            let by_state = &linearised[POINT[stage]].slopes.by_state;
            for i in 0..STATES {
                for lane in (0..WIDE).step_by(SIDE_BY_SIDE * S::F64_LANES) {
                    let mut slope = Sum::<S>::of(simd, &forcing[POINT[stage]][i], lane);
                    for &j in equations::RATES_BY_STATE[i] {
                        let at = if is_first { &s[j] } else { &at[j] };
                        slope.add(simd, by_state[(i, j)], at);
                    }
                    slope.each(|lane, slope| {
                        let start = load::<S>(&s[i], lane);
                        let so_far = if is_first {
                            start
                        } else {
                            load::<S>(&end[i], lane)
                        };
                        store::<S>(&mut end[i], lane, simd.mul_add_f64s(weight, slope, so_far));
                        store::<S>(&mut next[i], lane, simd.mul_add_f64s(reach, slope, start));
                    });
                }
            }
            std::mem::swap(&mut at, &mut next);
        }
    }

    /// Writes the sensitivities of the readings at a node to rows of zeros. They act through the states
    /// and through the body rates in a reading, and are to bias, scale and delay of the output.
    #[inline(always)]
    fn write_reading_rows<S: Simd>(
        &self,
        simd: S,
        node: usize,
        s: &Sensitivities,
        rows: &mut [Row; OUTPUTS],
    ) {
        let Trajectory {
            inputs,
            states,
            readings,
        } = self.trajectory;
        let point = 2 * node;
        let (x, input) = (&states[point], &inputs.values[2 * point]);
        let at = equations::reading_slopes(self.aircraft, x, input, &self.window.terms[point]);
        let by_error = inputs.by_error(point);
        for o in 0..OUTPUTS {
            let gain = 1.0 + self.shared[place(INPUTS + o, Kind::Scale)];
            for &rate in equations::READINGS_BY_RATES[o] {
                let errors = &mut rows[o][error_columns(rate)];
                for (slope, by_error) in errors.iter_mut().zip(by_error[rate]) {
                    *slope = gain * at.by_rates[(o, rate)] * by_error;
                }
            }
            for lane in (0..WIDE).step_by(SIDE_BY_SIDE * S::F64_LANES) {
                let mut slope = Sum::<S>::of(simd, &rows[o], lane);
                for &i in equations::READINGS_BY_STATE[o] {
                    slope.add(simd, gain * at.by_state[(o, i)], &s[i]);
                }
                slope.each(|lane, slope| store::<S>(&mut rows[o], lane, slope));
            }
            let rate = slope_at(&readings[o], point) / self.window.point_step_s();
            rows[o][DRIVING..ROW].copy_from_slice(&[1.0, readings[o][point], -gain * rate]);
        }
    }
}

/// Slope of a series at index `k`, per step, by the fourth-order central difference. Beyond an end
/// the end value is repeated.
#[inline(always)]
fn slope_at(values: &[f64], k: usize) -> f64 {
    let last = values.len() - 1;
    let difference = |reach: usize| values[(k + reach).min(last)] - values[k.saturating_sub(reach)];
    (8.0 * difference(1) - difference(2)) / 12.0
}

/// Buffers of a step between nodes.
struct StepBuffers {
    /// Forcing at the start, the middle and the end. Only columns with a slope are ever written.
    forcing: [Sensitivities; 3],
    /// Sensitivities at the stages, in turn.
    stages: [Sensitivities; 2],
}

impl StepBuffers {
    #[inline(always)]
    fn zeros() -> StepBuffers {
        StepBuffers {
            forcing: [[[0.0; WIDE]; STATES]; 3],
            stages: [[[0.0; WIDE]; STATES]; 2],
        }
    }
}

/// Slopes of the equations at one instant along states, inputs and the wind's change.
struct Linearised {
    slopes: RateSlopes,
    by_wind: Matrix3<f64>,
}

impl Linearised {
    /// Writes the slopes of the states' rates along the wind's change and the inputs' errors to rows.
    #[inline(always)]
    fn write_forcing(&self, by_error: &ByError, rows: &mut Sensitivities) {
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
    }
}

/// Columns of an input's errors in a row.
#[inline(always)]
fn error_columns(input: usize) -> std::ops::Range<usize> {
    LOCAL + input * KINDS..LOCAL + (input + 1) * KINDS
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
    fn of(simd: S, row: &Row, first: usize) -> Self {
        let mut lanes = [simd.splat_f64s(0.0); SIDE_BY_SIDE];
        for n in 0..SIDE_BY_SIDE {
            lanes[n] = load::<S>(row, first + n * S::F64_LANES);
        }
        Sum { first, lanes }
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

/// Slopes of the inputs along bias, scale and delay.
type ByError = [[f64; KINDS]; INPUTS];

impl CorrectedInputs {
    fn of(window: &Window, shared: &Parameters) -> CorrectedInputs {
        let (points, spacing) = (window.points(), window.samples_per_point);
        let mut values = vec![[0.0; INPUTS]; 2 * points - 1];
        let mut slopes = vec![[0.0; INPUTS]; points];
        let gains = std::array::from_fn(|i| 1.0 + shared[place(i, Kind::Scale)]);
        let by_bias = std::array::from_fn(|i| -input_factor(i) / gains[i]);
        // One sample more on either side than the window has.
        let mut corrected = vec![0.0; window.samples + 2];
        for i in 0..INPUTS {
            let [bias, delay] = [Kind::Bias, Kind::Delay].map(|kind| shared[place(i, kind)]);
            let kernel = InterpolationKernel::at(delay / window.step_s);
            kernel.interpolate_from(window.margin - 1, &window.inputs[i], &mut corrected);
            for value in &mut corrected {
                *value = -by_bias[i] * (*value - bias);
            }
            for point in 0..points {
                let around = &corrected[point * spacing..];
                values[2 * point][i] = around[1];
                slopes[point][i] = (around[2] - around[0]) / (2.0 * window.step_s);
            }
            for point in 1..points {
                let mean = mean_over_step(&corrected[(point - 1) * spacing..][..spacing + 3]);
                let ends = values[2 * point - 2][i] + values[2 * point][i];
                // Simpson's rule, mean = (y₀ + 4 y½ + y₁)/6, solved for the middle value y½.
                values[2 * point - 1][i] = 1.5 * mean - 0.25 * ends;
            }
        }
        CorrectedInputs {
            values,
            slopes,
            by_bias,
            gains,
        }
    }

    /// Slopes of the corrected inputs along bias, scale and delay at a point.
    #[inline(always)]
    fn by_error(&self, point: usize) -> ByError {
        let mut by_error = [[0.0; KINDS]; INPUTS];
        for i in 0..INPUTS {
            let by_scale = -self.values[2 * point][i] / self.gains[i];
            by_error[i] = [self.by_bias[i], by_scale, self.slopes[point][i]];
        }
        by_error
    }

    /// Means of these slopes over the two steps from a point, together `length_s` long. The scale's
    /// mean is by Simpson's rule; the mean slope in time is the rise over the time.
    #[inline(always)]
    fn mean_by_error(&self, point: usize, length_s: f64) -> ByError {
        let values = &self.values[2 * point..2 * point + 5];
        let mut by_error = [[0.0; KINDS]; INPUTS];
        for i in 0..INPUTS {
            let middles = 4.0 * (values[1][i] + values[3][i]);
            let sum = values[0][i] + middles + 2.0 * values[2][i] + values[4][i];
            let by_scale = -sum / 12.0 / self.gains[i];
            let rise = values[4][i] - values[0][i];
            by_error[i] = [self.by_bias[i], by_scale, rise / length_s];
        }
        by_error
    }
}

/// Mean of a signal between its second and its last but one sample. The trapezoidal rule has
/// Gregory's correction for the slopes at the ends. It is exact for cubics.
fn mean_over_step(samples: &[f64]) -> f64 {
    let last = samples.len() - 2;
    let sum: f64 = samples[1..=last].iter().sum();
    let rise = |k: usize| samples[k + 1] - samples[k - 1];
    let trapezoids = sum - 0.5 * (samples[1] + samples[last]);
    (trapezoids - (rise(last) - rise(1)) / 24.0) / (last - 1) as f64
}

/// Index among the parameters shared by all windows of column `column` in the row of output `o`.
/// Columns before [`LOCAL`] are the window's own parameters and have no such index.
pub fn shared_place(column: usize, o: usize) -> usize {
    if column < DRIVING {
        column - LOCAL
    } else {
        (INPUTS + o) * KINDS + column - DRIVING
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    #[test]
    fn the_mean_over_a_step_is_exact_for_cubics() {
        let integral = |t: f64| 2.0 * t - 0.5 * t.powi(2) + 0.3 * t.powi(3) - 0.1 * t.powi(4);
        let slope = |t: f64| 2.0 - t + 0.9 * t.powi(2) - 0.4 * t.powi(3);
        for steps in [1_u32, 2, 4, 5] {
            let samples: Vec<f64> = (0..steps + 3).map(|k| slope(f64::from(k) - 1.0)).collect();
            let exact = integral(f64::from(steps)) / f64::from(steps);
            assert_abs_diff_eq!(mean_over_step(&samples), exact, epsilon = 1e-12);
        }
    }
}
