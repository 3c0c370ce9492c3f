//! What the equations make of a window for given errors of its instruments, with exact
//! sensitivities.
//!
//! An input is freed of its error before it drives the equations, x(t) = (y(t + delay) − bias)/(1 +
//! scale); an output is given its error after them, y(t) = (1 + scale) h(t − delay) + bias. Outputs
//! are handed over sample by sample as soon as all that a delay reaches is there, so that no more
//! than that is kept.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::equations::{self, STATES, State};
use super::parameters::{INPUTS, KINDS, Kind, OUTPUTS, PARAMETERS, place};
use super::window::{Window, factor};
use crate::aircraft::Aircraft;
use crate::flight::taps::Taps;
use crate::numerics::runge_kutta::{POINT, STAGES, reaches_s, weights_s};
use crate::numerics::simd::{load, store};

/// Parameters of a window alone: its first state, and the change of the wind north, east and down,
/// ft/s².
pub const LOCAL: usize = STATES + WIND;
const WIND: usize = 3;
/// Parameters that the states depend on: the local ones, then bias, scale and delay of each input.
const DRIVING: usize = LOCAL + INPUTS * KINDS;
/// Parameters that one output depends on: those, then its own bias, scale and delay.
pub const ROW: usize = DRIVING + KINDS;
/// The same, and a place for the residual, in whole vectors.
pub const WIDE: usize = (ROW + 1).next_multiple_of(8);

pub type Local = [f64; LOCAL];
pub type Row = [f64; WIDE];

/// What becomes of the outputs of a window.
pub trait Sink {
    /// Whether an output is looked at at a sample.
    fn looks_at(&self, sample: usize, output: usize) -> bool;

    /// Takes an output with its slopes along what it depends on; nobody needs the row afterwards.
    fn take<S: Simd>(&mut self, simd: S, sample: usize, output: usize, value: f64, row: &mut Row);
}

/// One input freed of its error at one instant, in rad/s or ft/s², with its slopes along bias,
/// scale and delay.
#[derive(Clone, Copy, Debug, Default)]
struct Freed {
    value: f64,
    by: [f64; KINDS],
}

/// Hands the outputs of some samples of a window over; none where the integration leaves sense.
pub fn respond(
    window: &Window,
    aircraft: &Aircraft,
    local: &Local,
    shared: &[f64; PARAMETERS],
    samples: Range<usize>,
    sink: &mut impl Sink,
) -> Option<()> {
    let points = freed(window, shared);
    let own = |o: usize| std::array::from_fn(|kind| shared[(INPUTS + o) * KINDS + kind]);
    let errors: [[f64; KINDS]; OUTPUTS] = std::array::from_fn(own);
    let taps = errors.map(|e| Taps::at(-e[Kind::Delay as usize] / window.step_s));
    Arch::new().dispatch(Flight {
        window,
        aircraft,
        local,
        points: &points,
        errors,
        taps,
        samples,
        sink,
    })
}

/// The integration of a window, compiled for the processor at hand.
struct Flight<'a, K: Sink> {
    window: &'a Window,
    aircraft: &'a Aircraft,
    local: &'a Local,
    points: &'a [[Freed; INPUTS]],
    errors: [[f64; KINDS]; OUTPUTS],
    taps: [Taps; OUTPUTS],
    samples: Range<usize>,
    sink: &'a mut K,
}

/// Slopes of the states along what they depend on, a row for each state.
type Slopes = [Row; STATES];
/// Readings without error with their slopes, and the reading itself where an output's own errors
/// will stand.
type Cells = [Row; OUTPUTS];

/// The states on their way with their slopes.
struct Way {
    x: State,
    s: Slopes,
    /// Room for a step: the slopes at a stage and at the next one, and at the end of the step as
    /// far as it is known.
    stages: [Slopes; 2],
    end: Slopes,
}

impl<K: Sink> WithSimd for Flight<'_, K> {
    type Output = Option<()>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Option<()> {
        const NOTHING: Slopes = [[0.0; WIDE]; STATES];
        let count = self.window.samples;
        let mut way = Way {
            x: State::from_column_slice(&self.local[..STATES]),
            s: NOTHING,
            stages: [NOTHING; 2],
            end: NOTHING,
        };
        for i in 0..STATES {
            way.s[i][i] = 1.0;
        }
        let ahead = self
            .taps
            .iter()
            .map(|taps| taps.last().max(0).unsigned_abs())
            .max()
            .unwrap_or(0);
        let behind = self
            .taps
            .iter()
            .map(|taps| taps.first().min(0).unsigned_abs())
            .max()
            .unwrap_or(0);
        let mut kept = vec![[[0.0; WIDE]; OUTPUTS]; (ahead + behind + 1).next_power_of_two()];
        for k in 0..count + ahead {
            if k < count {
                let place = k & (kept.len() - 1);
                self.read(simd, k, &way, &mut kept[place]);
            }
            if let Some(sample) = k.checked_sub(ahead)
                && self.samples.contains(&sample)
            {
                self.hand_over(simd, sample, &kept);
            }
            if k + 1 < count {
                self.advance(simd, k, &mut way);
                if !way.x.iter().all(|x| x.is_finite() && x.abs() < 1e7) {
                    return None;
                }
            }
        }
        Some(())
    }
}

impl<K: Sink> Flight<'_, K> {
    /// One Runge-Kutta step of the states and of their slopes.
    #[inline(always)]
    fn advance<S: Simd>(&self, simd: S, k: usize, way: &mut Way) {
        let h = self.window.step_s;
        let (ahead_s, part_s) = (reaches_s(h), weights_s(h));
        let Way { x, s, stages, end } = way;
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
                equations::rates(&at, &point.map(|p| p.value), &self.window.known[sample]);
            let to_body = &self.window.known[sample].to_body;
            for i in 0..WIND {
                for j in 0..WIND {
                    rates.rates[i] -= to_body[(i, j)] * self.local[STATES + j];
                }
            }
            let along = along(point);
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
                        slope.add(simd, rates.by_input[(i, input)], &along[input]);
                    }
                    if i < WIND {
                        for j in 0..WIND {
                            slope.add(simd, -to_body[(i, j)], &ALONG_WIND[j]);
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
        (way.x, way.s) = (x_end, way.end);
    }

    /// The outputs at a sample, without their own errors.
    #[inline(always)]
    fn read<S: Simd>(&self, simd: S, k: usize, way: &Way, cells: &mut Cells) {
        let point = &self.points[2 * k];
        let at = equations::readings(
            self.aircraft,
            &way.x,
            &point.map(|p| p.value),
            &self.window.known[k],
        );
        let along = along(point);
        for o in 0..OUTPUTS {
            for lane in (0..WIDE).step_by(SIDE_BY_SIDE * S::F64_LANES) {
                let mut slope = Sum::<S>::zero(simd, lane);
                for &i in equations::READINGS_BY_STATE[o] {
                    slope.add(simd, at.by_state[(o, i)], &way.s[i]);
                }
                for &rate in equations::READINGS_BY_RATES[o] {
                    slope.add(simd, at.by_rates[(o, rate)], &along[rate]);
                }
                slope.each(|lane, slope| store::<S>(&mut cells[o], lane, slope));
            }
            cells[o][DRIVING] = at.values[o];
        }
    }

    /// The outputs at a sample with their own errors.
    #[inline(always)]
    fn hand_over<S: Simd>(&mut self, simd: S, k: usize, kept: &[Cells]) {
        for o in 0..OUTPUTS {
            if !self.sink.looks_at(k, o) {
                continue;
            }
            let [bias, scale, _] = self.errors[o];
            let (mut value, mut by_shift, gain) = (0.0, 0.0, 1.0 + scale);
            let mut taps = [(0.0, &kept[0][o]); 4];
            for (tap, (sample, weight, slope)) in taps
                .iter_mut()
                .zip(self.taps[o].each(k, self.window.samples))
            {
                let cell = &kept[sample & (kept.len() - 1)][o];
                value += weight * cell[DRIVING];
                by_shift += slope * cell[DRIVING];
                *tap = (gain * weight, cell);
            }
            let mut row = [0.0; WIDE];
            for lane in (0..WIDE).step_by(SIDE_BY_SIDE * S::F64_LANES) {
                let mut slope = Sum::<S>::zero(simd, lane);
                for (weight, cell) in taps {
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

/// Slopes along the wind's change north, east and down, as rows.
const ALONG_WIND: [Row; WIND] = {
    let mut rows = [[0.0; WIDE]; WIND];
    rows[0][STATES] = 1.0;
    rows[1][STATES + 1] = 1.0;
    rows[2][STATES + 2] = 1.0;
    rows
};

/// Vectors of a row that are summed side by side, so that the processor has something to do while
/// one waits.
const SIDE_BY_SIDE: usize = 4;

/// Some lanes of a sum of rows, in the processor's registers.
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

    /// Gives each vector with its first lane.
    #[inline(always)]
    fn each(self, mut give: impl FnMut(usize, S::f64s)) {
        for n in 0..SIDE_BY_SIDE {
            give(self.first + n * S::F64_LANES, self.lanes[n]);
        }
    }
}

/// The slopes of each input along its own errors, as rows.
#[inline(always)]
fn along(point: &[Freed; INPUTS]) -> [Row; INPUTS] {
    let mut rows = [[0.0; WIDE]; INPUTS];
    for (input, freed) in point.iter().enumerate() {
        rows[input][LOCAL + input * KINDS..][..KINDS].copy_from_slice(&freed.by);
    }
    rows
}

/// The inputs at samples and the halves between them.
fn freed(window: &Window, shared: &[f64; PARAMETERS]) -> Vec<[Freed; INPUTS]> {
    let mut points = vec![[Freed::default(); INPUTS]; 2 * window.samples - 1];
    for i in 0..INPUTS {
        let parameter = |kind| shared[place(i, kind)];
        let (bias, gain, delay) = (
            parameter(Kind::Bias),
            1.0 + parameter(Kind::Scale),
            parameter(Kind::Delay),
        );
        let values = &window.inputs[i];
        let unit = factor(i) / gain;
        let halves = [0.0, 0.5].map(|half| Taps::at(delay / window.step_s + half));
        for (j, point) in points.iter_mut().enumerate() {
            let (sum, by_shift) =
                halves[j % 2].sum(window.margin + j / 2, values.len(), |k| values[k]);
            let value = unit * (sum - bias);
            point[i] = Freed {
                value,
                by: [-unit, -value / gain, unit * by_shift / window.step_s],
            };
        }
    }
    points
}

/// Where the columns of an output's row are: among the local parameters first, among the shared
/// ones the rest.
pub fn shared_place(column: usize, o: usize) -> usize {
    if column < DRIVING {
        column - LOCAL
    } else {
        (INPUTS + o) * KINDS + column - DRIVING
    }
}
