//! What the equations make of a window for given errors of its instruments, with exact sensitivities.
//!
//! An input is freed of its error before it drives the equations, x(t) = (y(t + delay) − bias)/(1 + scale); an output is
//! given its error after them, y(t) = (1 + scale) h(t − delay) + bias.

use super::equations::{self, Driven, STATES, State};
use super::instruments::{INPUTS, KINDS, Kind, OUTPUTS, PARAMETERS, place};
use super::taps::Taps;
use super::window::{Window, factor};
use crate::aircraft::Aircraft;
use crate::dynamics::runge_kutta::{Integrator, Stage};

/// Parameters of a window alone: its first state, and the change of the wind north, east and down, ft/s².
pub const LOCAL: usize = STATES + 3;
/// Parameters that the states depend on: the local ones, then bias, scale and delay of each input.
const DRIVING: usize = LOCAL + INPUTS * KINDS;
/// Parameters that one output depends on: those, then its own bias, scale and delay.
pub const ROW: usize = DRIVING + KINDS;

pub type Local = [f64; LOCAL];

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
    let mut it = Integrator::<STATES>::new(State::from_column_slice(&local[..STATES]), DRIVING);
    for i in 0..STATES {
        it.sensitivity[i][i] = 1.0;
    }
    let mut exact = Vec::with_capacity(window.samples * OUTPUTS * CELL);
    for k in 0..window.samples {
        read(&mut exact, window, aircraft, k, &points[2 * k], &it);
        if k + 1 < window.samples {
            it.step(window.step_s, |stage, x, s, ds| {
                let (point, sample) = match stage {
                    Stage::Start => (2 * k, k),
                    Stage::Middle => (2 * k + 1, k),
                    Stage::End => (2 * k + 2, k + 1),
                };
                slope(window, sample, &points[point], local, x, s, ds)
            });
        }
        if !it.state.iter().all(|x| x.is_finite() && x.abs() < 1e7) {
            return None;
        }
    }
    let own = |o: usize| std::array::from_fn(|kind| shared[(INPUTS + o) * KINDS + kind]);
    let errors: [[f64; KINDS]; OUTPUTS] = std::array::from_fn(own);
    let taps = errors.map(|e| Taps::at(-e[Kind::Delay as usize] / window.step_s));
    Some(Response { samples: window.samples, exact, taps, errors, step_s: window.step_s })
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

/// Rates of the states and of their sensitivities.
fn slope(
    window: &Window,
    sample: usize,
    point: &[Freed; INPUTS],
    local: &Local,
    x: &State,
    s: &[Vec<f64>; STATES],
    ds: &mut [Vec<f64>; STATES],
) -> State {
    let driven: Driven = point.map(|p| p.value);
    let known = &window.known[sample];
    let at = equations::rates(x, &driven, known);
    let mut rates = at.rates;
    for (i, row) in ds.iter_mut().enumerate() {
        row.fill(0.0);
        for (j, s) in s.iter().enumerate() {
            let a = at.by_state[(i, j)];
            if a != 0.0 {
                row.iter_mut().zip(s).for_each(|(d, s)| *d += a * s);
            }
        }
        for (input, freed) in point.iter().enumerate() {
            let b = at.by_input[(i, input)];
            let first = LOCAL + input * KINDS;
            row[first..first + KINDS].iter_mut().zip(freed.by).for_each(|(d, by)| *d += b * by);
        }
    }
    for i in 0..3 {
        for j in 0..3 {
            rates[i] -= known.to_body[(i, j)] * local[STATES + j];
            ds[i][STATES + j] -= known.to_body[(i, j)];
        }
    }
    rates
}

/// Adds the outputs of a sample, without their own errors.
fn read(
    exact: &mut Vec<f64>,
    window: &Window,
    aircraft: &Aircraft,
    k: usize,
    point: &[Freed; INPUTS],
    it: &Integrator<STATES>,
) {
    let driven: Driven = point.map(|p| p.value);
    let at = equations::readings(aircraft, &it.state, &driven, &window.known[k]);
    for o in 0..OUTPUTS {
        let first = exact.len() + 1;
        exact.push(at.values[o]);
        exact.resize(first + DRIVING, 0.0);
        let row = &mut exact[first..];
        for (i, s) in it.sensitivity.iter().enumerate() {
            let by = at.by_state[(o, i)];
            if by != 0.0 {
                row.iter_mut().zip(s).for_each(|(r, s)| *r += by * s);
            }
        }
        for (input, freed) in point.iter().enumerate().take(3) {
            let by = at.by_rates[(o, input)];
            for (kind, slope) in freed.by.iter().enumerate() {
                row[LOCAL + input * KINDS + kind] += by * slope;
            }
        }
    }
}

impl Response {
    /// One output at one sample with the slopes along what it depends on.
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
