//! What the equations make of a window for given errors of its instruments, with exact sensitivities.
//!
//! An input is freed of its error before it drives the equations, x(t) = (y(t + delay) − bias)/(1 + scale); an output is
//! given its error after them, y(t) = (1 + scale) h(t − delay) + bias.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(clippy::needless_range_loop, reason = "plain indices become straight code for the vectors")]

use pulp::{Arch, Simd, WithSimd};

use super::equations::{self, Driven, STATES, State};
use super::instruments::{INPUTS, KINDS, Kind, OUTPUTS, PARAMETERS, place};
use super::window::{Window, factor};
use crate::aircraft::Aircraft;
use crate::dynamics::runge_kutta::{POINT, step};
use crate::flight::taps::Taps;

/// Parameters of a window alone: its first state, and the change of the wind north, east and down, ft/s².
pub const LOCAL: usize = STATES + 3;
/// Parameters that the states depend on: the local ones, then bias, scale and delay of each input.
const DRIVING: usize = LOCAL + INPUTS * KINDS;
/// Parameters that one output depends on: those, then its own bias, scale and delay.
pub const ROW: usize = DRIVING + KINDS;

pub type Local = [f64; LOCAL];

/// The same in whole vectors.
const WIDE: usize = DRIVING.next_multiple_of(8);

/// Slopes of the states along what they depend on, a row for each state.
type Slopes = [[f64; WIDE]; STATES];

/// One input freed of its error at one instant, in rad/s or ft/s², with its slopes along bias, scale and delay.
#[derive(Clone, Copy, Debug, Default)]
struct Freed {
    value: f64,
    by: [f64; KINDS],
}

/// Computed outputs of a window: for each sample and output the value and its slopes.
#[derive(Clone, Debug)]
pub struct Response {
    samples: usize,
    /// [`OUTPUTS`] × (1 + [`DRIVING`]) numbers per sample: the reading without error, and its slopes.
    exact: Vec<f64>,
    taps: [Taps; OUTPUTS],
    errors: [[f64; KINDS]; OUTPUTS],
    step_s: f64,
}

const CELL: usize = 1 + DRIVING;

/// The computed outputs of a window; none where the integration leaves sense.
pub fn respond(window: &Window, aircraft: &Aircraft, local: &Local, shared: &[f64; PARAMETERS]) -> Option<Response> {
    let points = freed(window, shared);
    let exact = Arch::new().dispatch(Flight { window, aircraft, local, points: &points })?;
    let own = |o: usize| std::array::from_fn(|kind| shared[(INPUTS + o) * KINDS + kind]);
    let errors: [[f64; KINDS]; OUTPUTS] = std::array::from_fn(own);
    let taps = errors.map(|e| Taps::at(-e[Kind::Delay as usize] / window.step_s));
    Some(Response { samples: window.samples, exact, taps, errors, step_s: window.step_s })
}

/// The integration of a window, compiled for the processor at hand.
struct Flight<'a> {
    window: &'a Window,
    aircraft: &'a Aircraft,
    local: &'a Local,
    points: &'a [[Freed; INPUTS]],
}

impl WithSimd for Flight<'_> {
    /// The outputs without their own errors, and their slopes.
    type Output = Option<Vec<f64>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<Vec<f64>> {
        let Flight { window, aircraft, local, points } = self;
        let mut at = (State::from_column_slice(&local[..STATES]), [[0.0; WIDE]; STATES]);
        for i in 0..STATES {
            at.1[i][i] = 1.0;
        }
        let mut exact = Vec::with_capacity(window.samples * OUTPUTS * CELL);
        for k in 0..window.samples {
            read(&mut exact, window, aircraft, k, &points[2 * k], &at);
            if k + 1 < window.samples {
                at = step(
                    at,
                    window.step_s,
                    #[inline(always)]
                    |stage, at| {
                        let sample = if POINT[stage] == 2 { k + 1 } else { k };
                        slope(window, sample, &points[2 * k + POINT[stage]], local, &at)
                    },
                    #[inline(always)]
                    |(x, mut s), h, (dx, ds)| {
                        for i in 0..STATES {
                            for c in 0..WIDE {
                                s[i][c] += h * ds[i][c];
                            }
                        }
                        (x + dx * h, s)
                    },
                );
            }
            if !at.0.iter().all(|x| x.is_finite() && x.abs() < 1e7) {
                return None;
            }
        }
        Some(exact)
    }
}

/// The inputs at samples and the halves between them.
fn freed(window: &Window, shared: &[f64; PARAMETERS]) -> Vec<[Freed; INPUTS]> {
    let mut points = vec![[Freed::default(); INPUTS]; 2 * window.samples - 1];
    for i in 0..INPUTS {
        let parameter = |kind| shared[place(i, kind)];
        let (bias, gain, delay) = (parameter(Kind::Bias), 1.0 + parameter(Kind::Scale), parameter(Kind::Delay));
        let values = &window.inputs[i];
        let unit = factor(i) / gain;
        let halves = [0.0, 0.5].map(|half| Taps::at(delay / window.step_s + half));
        for (j, point) in points.iter_mut().enumerate() {
            let (sum, by_shift) = halves[j % 2].sum(window.margin + j / 2, values.len(), |k| values[k]);
            let value = unit * (sum - bias);
            point[i] = Freed { value, by: [-unit, -value / gain, unit * by_shift / window.step_s] };
        }
    }
    points
}

/// Rates of the states and of their slopes.
#[inline(always)]
fn slope(
    window: &Window,
    sample: usize,
    point: &[Freed; INPUTS],
    local: &Local,
    (x, s): &(State, Slopes),
) -> (State, Slopes) {
    let driven: Driven = point.map(|p| p.value);
    let known = &window.known[sample];
    let at = equations::rates(x, &driven, known);
    let (mut rates, mut slopes) = (at.rates, [[0.0; WIDE]; STATES]);
    for i in 0..STATES {
        for j in 0..STATES {
            // Most of them are zero.
            let by = at.by_state[(i, j)];
            if by != 0.0 {
                for c in 0..WIDE {
                    slopes[i][c] += by * s[j][c];
                }
            }
        }
        for (input, freed) in point.iter().enumerate() {
            let by_input = at.by_input[(i, input)];
            if by_input != 0.0 {
                for (kind, by) in freed.by.iter().enumerate() {
                    slopes[i][LOCAL + input * KINDS + kind] += by_input * by;
                }
            }
        }
    }
    for i in 0..3 {
        for j in 0..3 {
            rates[i] -= known.to_body[(i, j)] * local[STATES + j];
            slopes[i][STATES + j] -= known.to_body[(i, j)];
        }
    }
    (rates, slopes)
}

/// Adds the outputs of a sample, without their own errors.
#[inline(always)]
fn read(
    exact: &mut Vec<f64>,
    window: &Window,
    aircraft: &Aircraft,
    k: usize,
    point: &[Freed; INPUTS],
    (x, s): &(State, Slopes),
) {
    let driven: Driven = point.map(|p| p.value);
    let at = equations::readings(aircraft, x, &driven, &window.known[k]);
    for o in 0..OUTPUTS {
        let mut row = [0.0; WIDE];
        for i in 0..STATES {
            let by = at.by_state[(o, i)];
            if by != 0.0 {
                for c in 0..WIDE {
                    row[c] += by * s[i][c];
                }
            }
        }
        for (input, freed) in point.iter().enumerate().take(3) {
            let by = at.by_rates[(o, input)];
            for (kind, slope) in freed.by.iter().enumerate() {
                row[LOCAL + input * KINDS + kind] += by * slope;
            }
        }
        exact.push(at.values[o]);
        exact.extend_from_slice(&row[..DRIVING]);
    }
}

impl Response {
    /// One output at one sample with the slopes along what it depends on.
    #[inline(always)]
    pub fn output(&self, k: usize, o: usize) -> (f64, [f64; ROW]) {
        let [bias, scale, _] = self.errors[o];
        let mut row = [0.0; ROW];
        let (mut value, mut by_shift) = (0.0, 0.0);
        for (sample, weight, slope) in self.taps[o].each(k, self.samples) {
            let cell = &self.exact[(sample * OUTPUTS + o) * CELL..][..CELL];
            value += weight * cell[0];
            by_shift += slope * cell[0];
            if weight != 0.0 {
                let weight = weight * (1.0 + scale);
                row.iter_mut().zip(&cell[1..]).for_each(|(r, c)| *r += weight * c);
            }
        }
        row[DRIVING] = 1.0;
        row[DRIVING + 1] = value;
        row[DRIVING + 2] = -(1.0 + scale) * by_shift / self.step_s;
        ((1.0 + scale) * value + bias, row)
    }
}

/// Where the columns of an output's row are: among the local parameters first, among the shared ones the rest.
pub fn shared_place(column: usize, o: usize) -> usize {
    if column < DRIVING { column - LOCAL } else { (INPUTS + o) * KINDS + column - DRIVING }
}
