//! Flight-path reconstruction of one window for given errors of its instruments, with exact
//! sensitivities.
//!
//! An input is corrected before it drives the equations, x(t) = (y(t + delay) − bias)/(1 + scale).
//! An output gets its error after them, y(t) = (1 + scale) h(t − delay) + bias. Outputs are passed
//! on sample by sample as soon as the readings that a delay reaches are computed, so that no more
//! readings are kept.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::equations::{self, STATES, State};
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
const DRIVING: usize = LOCAL + INPUTS * KINDS;
/// Parameters that one output depends on: those of the states, then its own bias, scale and delay.
pub const ROW: usize = DRIVING + KINDS;
/// Length of a row: the parameters of an output and the residual, in whole vectors.
pub const WIDE: usize = (ROW + 1).next_multiple_of(8);

pub type Local = [f64; LOCAL];
pub type Row = [f64; WIDE];

/// Receiver of the outputs of a window.
pub trait Sink {
    /// `true` where an output is wanted at a sample.
    fn counts(&self, sample: usize, output: usize) -> bool;

    /// Takes an output with its sensitivities. The row is the sink's to overwrite.
    fn take<S: Simd>(&mut self, simd: S, sample: usize, output: usize, value: f64, row: &mut Row);
}

/// One input without its error at one instant, in rad/s or ft/s², with its slopes along bias, scale
/// and delay.
#[derive(Clone, Copy, Debug, Default)]
struct CorrectedInput {
    value: f64,
    by_error: [f64; KINDS],
}

/// Reconstructs a window and passes the outputs of some samples to `sink`. `None` where the
/// integration diverges.
pub fn reconstruct(
    window: &Window,
    aircraft: &Aircraft,
    local: &Local,
    shared: &Parameters,
    samples: Range<usize>,
    sink: &mut impl Sink,
) -> Option<()> {
    let points = corrected_inputs(window, shared);
    let own = |o: usize| std::array::from_fn(|kind| shared[(INPUTS + o) * KINDS + kind]);
    let errors: [[f64; KINDS]; OUTPUTS] = std::array::from_fn(own);
    let kernels = errors.map(|e| InterpolationKernel::at(-e[Kind::Delay as usize] / window.step_s));
    Arch::new().dispatch(Reconstruction {
        window,
        aircraft,
        local,
        points: &points,
        errors,
        kernels,
        samples,
        sink,
    })
}

/// Integration of a window, compiled for the processor at hand.
struct Reconstruction<'a, K: Sink> {
    window: &'a Window,
    aircraft: &'a Aircraft,
    local: &'a Local,
    points: &'a [[CorrectedInput; INPUTS]],
    errors: [[f64; KINDS]; OUTPUTS],
    kernels: [InterpolationKernel; OUTPUTS],
    samples: Range<usize>,
    sink: &'a mut K,
}

/// Sensitivities of the states, a row for each state.
type Sensitivities = [Row; STATES];
/// Readings without instrument error: their sensitivities, and the reading itself in the place of
/// the output's own bias.
type ReadingRows = [Row; OUTPUTS];

/// Magnitude of a state (ft, ft/s, rad) from which the integration has diverged.
const DIVERGED: f64 = 1e7;

/// States and sensitivities at the present sample.
struct StateWithSensitivities {
    x: State,
    s: Sensitivities,
    /// Workspace of a step: the sensitivities at a stage and at the next one, and those at the end
    /// of the step summed so far.
    stages: [Sensitivities; 2],
    end: Sensitivities,
}

impl<K: Sink> WithSimd for Reconstruction<'_, K> {
    type Output = Option<()>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Option<()> {
        const ZERO: Sensitivities = [[0.0; WIDE]; STATES];
        let count = self.window.samples;
        let mut states = StateWithSensitivities {
            x: State::from_column_slice(&self.local[..STATES]),
            s: ZERO,
            stages: [ZERO; 2],
            end: ZERO,
        };
        for i in 0..STATES {
            states.s[i][i] = 1.0;
        }
        let ahead = self.longest_offset(|kernel| kernel.last_offset().max(0));
        let behind = self.longest_offset(|kernel| kernel.first_offset().min(0));
        let mut kept = vec![[[0.0; WIDE]; OUTPUTS]; (ahead + behind + 1).next_power_of_two()];
        for k in 0..count + ahead {
            if k < count {
                let place = k & (kept.len() - 1);
                self.read_outputs(simd, k, &states, &mut kept[place]);
            }
            if let Some(sample) = k.checked_sub(ahead)
                && self.samples.contains(&sample)
            {
                self.pass_outputs(simd, sample, &kept);
            }
            if k + 1 < count {
                self.advance(simd, k, &mut states);
                if !states.x.iter().all(|x| x.is_finite() && x.abs() < DIVERGED) {
                    return None;
                }
            }
        }
        Some(())
    }
}

impl<K: Sink> Reconstruction<'_, K> {
    /// Largest magnitude of an offset among the outputs' kernels.
    fn longest_offset(&self, offset: impl Fn(&InterpolationKernel) -> isize) -> usize {
        let offsets = self
            .kernels
            .iter()
            .map(|kernel| offset(kernel).unsigned_abs());
        offsets.max().unwrap_or(0)
    }

    /// One Runge-Kutta step of the states and of their sensitivities.
    #[inline(always)]
    fn advance<S: Simd>(&self, simd: S, k: usize, states: &mut StateWithSensitivities) {
        let h = self.window.step_s;
        let (ahead_s, part_s) = (reaches_s(h), weights_s(h));
        let StateWithSensitivities { x, s, stages, end } = states;
        let (mut at, mut x_end) = (*x, *x);
        *end = *s;
        for stage in 0..STAGES {
            let sample = if POINT[stage] == 2 { k + 1 } else { k };
            let [even, odd] = &mut *stages;
            let (here, next) = if stage % 2 == 0 {
                (&*even, odd)
            } else {
                (&*odd, even)
            };
            let slopes = if stage == 0 { &*s } else { here };
            let point = &self.points[2 * k + POINT[stage]];
            let mut rates =
                equations::rates(&at, &point.map(|p| p.value), &self.window.terms[sample]);
            let to_body = &self.window.terms[sample].to_body;
            for i in 0..WIND {
                for j in 0..WIND {
                    rates.rates[i] -= to_body[(i, j)] * self.local[STATES + j];
                }
            }
            let error_rows = error_rows(point);
            let (part, ahead) = (
                simd.splat_f64s(part_s[stage]),
                simd.splat_f64s(ahead_s[stage]),
            );
            for i in 0..STATES {
                let (s, end, next) = (&s[i], &mut end[i], &mut next[i]);
                for lane in (0..WIDE).step_by(SIDE_BY_SIDE * S::F64_LANES) {
                    let mut slope = Sum::<S>::zero(simd, lane);
                    for &j in equations::RATES_BY_STATE[i] {
                        slope.add(simd, rates.by_state[(i, j)], &slopes[j]);
                    }
                    for &input in equations::RATES_BY_INPUT[i] {
                        slope.add(simd, rates.by_input[(i, input)], &error_rows[input]);
                    }
                    if i < WIND {
                        for j in 0..WIND {
                            slope.add(simd, -to_body[(i, j)], &WIND_ROWS[j]);
                        }
                    }
                    slope.each(|lane, slope| {
                        let so_far = load::<S>(end, lane);
                        store::<S>(end, lane, simd.mul_add_f64s(part, slope, so_far));
                        store::<S>(
                            next,
                            lane,
                            simd.mul_add_f64s(ahead, slope, load::<S>(s, lane)),
                        );
                    });
                }
            }
            x_end += rates.rates * part_s[stage];
            at = *x + rates.rates * ahead_s[stage];
        }
        (states.x, states.s) = (x_end, states.end);
    }

    /// Computes the readings at a sample, without instrument errors.
    #[inline(always)]
    fn read_outputs<S: Simd>(
        &self,
        simd: S,
        k: usize,
        states: &StateWithSensitivities,
        cells: &mut ReadingRows,
    ) {
        let point = &self.points[2 * k];
        let at = equations::readings(
            self.aircraft,
            &states.x,
            &point.map(|p| p.value),
            &self.window.terms[k],
        );
        let error_rows = error_rows(point);
        for o in 0..OUTPUTS {
            for lane in (0..WIDE).step_by(SIDE_BY_SIDE * S::F64_LANES) {
                let mut slope = Sum::<S>::zero(simd, lane);
                for &i in equations::READINGS_BY_STATE[o] {
                    slope.add(simd, at.by_state[(o, i)], &states.s[i]);
                }
                for &rate in equations::READINGS_BY_RATES[o] {
                    slope.add(simd, at.by_rates[(o, rate)], &error_rows[rate]);
                }
                slope.each(|lane, slope| store::<S>(&mut cells[o], lane, slope));
            }
            cells[o][DRIVING] = at.values[o];
        }
    }

    /// Passes the outputs at a sample, with their errors, to the sink.
    #[inline(always)]
    fn pass_outputs<S: Simd>(&mut self, simd: S, k: usize, kept: &[ReadingRows]) {
        for o in 0..OUTPUTS {
            if !self.sink.counts(k, o) {
                continue;
            }
            let [bias, scale, _] = self.errors[o];
            let (mut value, mut by_shift, gain) = (0.0, 0.0, 1.0 + scale);
            let mut weighted = [(0.0, &kept[0][o]); 4];
            for (entry, (sample, weight, slope)) in weighted
                .iter_mut()
                .zip(self.kernels[o].weights_at(k, self.window.samples))
            {
                let cell = &kept[sample & (kept.len() - 1)][o];
                value += weight * cell[DRIVING];
                by_shift += slope * cell[DRIVING];
                *entry = (gain * weight, cell);
            }
            let mut row = [0.0; WIDE];
            for lane in (0..WIDE).step_by(SIDE_BY_SIDE * S::F64_LANES) {
                let mut slope = Sum::<S>::zero(simd, lane);
                for (weight, cell) in weighted {
                    slope.add(simd, weight, cell);
                }
                slope.each(|lane, slope| store::<S>(&mut row, lane, slope));
            }
            row[DRIVING] = 1.0;
            row[DRIVING + 1] = value;
            row[DRIVING + 2] = -gain * by_shift / self.window.step_s;
            self.sink.take(simd, k, o, gain * value + bias, &mut row);
        }
    }
}

/// Unit sensitivities to the wind's change north, east and down, as rows.
const WIND_ROWS: [Row; WIND] = {
    let mut rows = [[0.0; WIDE]; WIND];
    rows[0][STATES] = 1.0;
    rows[1][STATES + 1] = 1.0;
    rows[2][STATES + 2] = 1.0;
    rows
};

/// Vectors of a row that are summed side by side: independent sums hide the latency of each.
const SIDE_BY_SIDE: usize = 4;

/// Lanes of a sum of rows, in the processor's registers.
struct Sum<S: Simd> {
    first: usize,
    lanes: [S::f64s; SIDE_BY_SIDE],
}

impl<S: Simd> Sum<S> {
    #[inline(always)]
    fn zero(simd: S, first: usize) -> Self {
        Sum {
            first,
            lanes: [simd.splat_f64s(0.0); SIDE_BY_SIDE],
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

/// Slopes of each input along its own errors, as rows.
#[inline(always)]
fn error_rows(point: &[CorrectedInput; INPUTS]) -> [Row; INPUTS] {
    let mut rows = [[0.0; WIDE]; INPUTS];
    for (input, corrected) in point.iter().enumerate() {
        rows[input][LOCAL + input * KINDS..][..KINDS].copy_from_slice(&corrected.by_error);
    }
    rows
}

/// Corrected inputs at samples and at the halves between them.
fn corrected_inputs(window: &Window, shared: &Parameters) -> Vec<[CorrectedInput; INPUTS]> {
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
