//! One maneuver made ready for estimation: everything that does not depend on the parameters, laid out for the inner loop.
//!
//! Each coefficient is linear in the derivatives: c = Σ ξ_j r_j, where r_j is known at every point or proportional to a
//! state: c = offset + slope · x. Held derivatives are summed once into offset and slope, free ones once per iteration.
//!
//! Parameters in order: free derivatives (sorted by coefficient), free biases, then initial states if they are free.
#![expect(clippy::inline_always, reason = "compiled into the kernel for the processor at hand")]
#![expect(clippy::needless_range_loop, reason = "plain indices become straight code for the vectors")]

use std::marker::PhantomData;
use std::ops::Range;

use nalgebra::SVector;

use super::input_noise::NoisySurface;
use super::lanes::{Aligned, Lanes};
use crate::aero::{Bias, Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::Window;
use crate::dynamics::{COEFFICIENTS, Equations, Motion, OUTPUTS};
use crate::units::DEG;

/// Whether the initial states are estimated with the derivatives or taken from the record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InitialState {
    #[default]
    Estimated,
    Measured,
}

/// The three coefficients at every point as functions of the state: c = offset + slope · x.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coefficients<const NX: usize> {
    offset: [Vec<f64>; COEFFICIENTS],
    slope: [[Vec<f64>; NX]; COEFFICIENTS],
}

impl<const NX: usize> Coefficients<NX> {
    fn zero(points: usize) -> Self {
        // A step needs three points, also the one that would follow the last sample.
        let none = || vec![0.0; points + 2];
        Coefficients {
            offset: std::array::from_fn(|_| none()),
            slope: std::array::from_fn(|_| std::array::from_fn(|_| none())),
        }
    }

    /// Adds a derivative of this value.
    fn add(&mut self, value: f64, acting: Acting, column: &[f64]) {
        let sum = match acting.along {
            Some(state) => &mut self.slope[acting.coefficient][state],
            None => &mut self.offset[acting.coefficient],
        };
        sum.iter_mut().zip(column).for_each(|(sum, r)| *sum += value * r);
    }

    /// Those of a point.
    #[inline(always)]
    pub(super) fn at(&self, point: usize) -> At<NX> {
        self.near::<1>(point)[0]
    }

    /// Those of some points from one on.
    #[inline(always)]
    pub(super) fn near<const N: usize>(&self, point: usize) -> [At<NX>; N] {
        let mut near = [At { offset: [0.0; COEFFICIENTS], slope: [[0.0; NX]; COEFFICIENTS] }; N];
        for k in 0..COEFFICIENTS {
            let offset = &self.offset[k][point..point + N];
            for n in 0..N {
                near[n].offset[k] = offset[n];
            }
            for i in 0..NX {
                if let Some(slope) = self.slope[k][i].get(point..point + N) {
                    for n in 0..N {
                        near[n].slope[k][i] = slope[n];
                    }
                }
            }
        }
        near
    }
}

/// The coefficients at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct At<const NX: usize> {
    offset: [f64; COEFFICIENTS],
    pub(super) slope: [[f64; NX]; COEFFICIENTS],
}

impl<const NX: usize> At<NX> {
    /// Their values when the state is x.
    #[inline(always)]
    pub(super) fn with(&self, x: &SVector<f64, NX>) -> [f64; COEFFICIENTS] {
        let mut values = self.offset;
        for k in 0..COEFFICIENTS {
            // The first state last: it is the one that the sum would wait for.
            for i in (0..NX).rev() {
                values[k] = self.slope[k][i].mul_add(x[i], values[k]);
            }
        }
        values
    }
}

/// How a derivative acts: on which coefficient, along which state (where its regressor is one), and which column of
/// regressors or factors of proportion is its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Acting {
    pub coefficient: usize,
    pub along: Option<usize>,
    pub column: usize,
}

/// What the outputs read, deg, deg/s and g, and which samples count.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measurements {
    pub values: Vec<[f64; OUTPUTS]>,
    pub used: Vec<[bool; OUTPUTS]>,
}

/// What is free and what is held in a maneuver.
#[derive(Clone, Debug, Default)]
pub struct Model<'a> {
    pub free: Vec<&'a Derivative>,
    pub held: Vec<(&'a Derivative, f64)>,
    pub biases: Vec<&'a Bias>,
    pub initial_state: InitialState,
}

/// One maneuver made ready.
#[derive(Debug)]
pub struct Case<const NX: usize, E: Equations<NX>> {
    pub(super) step_s: f64,
    pub(super) known: Vec<E::Known>,
    pub(super) sensed: Vec<E::Sensed>,
    /// What the held derivatives make of the coefficients.
    held: Coefficients<NX>,
    /// The distinct regressors and factors of proportion, each at every point.
    columns: Vec<Vec<f64>>,
    /// How each free derivative acts.
    pub(super) acting: Vec<Acting>,
    /// The same columns point by point in the order of the lanes ([`Lanes`]).
    pub(super) regressors: Aligned,
    pub(super) lanes: Lanes,
    /// The free derivatives of each coefficient.
    pub(super) ranges: [Range<usize>; COEFFICIENTS],
    /// The output that each free bias shifts.
    pub(super) biased: Vec<usize>,
    pub(super) start: SVector<f64, NX>,
    pub(super) initial_state: InitialState,
    /// The measured states at every sample, and the coefficients that the measured motion implies.
    pub(super) states: Vec<SVector<f64, NX>>,
    pub(super) implied: Vec<[f64; COEFFICIENTS]>,
    /// Surfaces whose noise the corrected bounds count; none unless asked for.
    pub noisy_surfaces: Vec<NoisySurface>,
    pub measurements: Measurements,
    /// Names of the parameters in order; initial states are called `initial alpha` and so on.
    pub names: Vec<String>,
    equations: PhantomData<E>,
}

impl<const NX: usize, E: Equations<NX>> Case<NX, E> {
    /// Makes a maneuver ready. `window` must contain the surfaces of the model's derivatives.
    #[must_use]
    pub fn new(aircraft: &Aircraft, window: &Window, measurements: Measurements, model: &Model) -> Self {
        let mut free = model.free.clone();
        free.sort_by_key(|d| d.coefficient.index());
        let mut columns = Columns::<NX, E>::new(aircraft, window);
        let acting: Vec<Acting> = free.iter().map(|d| columns.acting(d)).collect();
        let held: Vec<(Acting, f64)> = model.held.iter().map(|(d, value)| (columns.acting(d), *value)).collect();
        let mut along = Along::<NX, E>::default();
        for (point, motion) in window.motion(aircraft).enumerate() {
            along.known.push(E::known(aircraft, &motion));
            columns.take(point, &motion);
            if point % 2 == 0 {
                along.sensed.push(E::sensed(aircraft, &motion));
                along.states.push(E::measured_state(&motion));
                along.implied.push(E::coefficients(aircraft, &motion));
            }
        }
        let columns = columns.values;
        let mut held_part = Coefficients::zero(window.len());
        for (acting, value) in held {
            held_part.add(value, acting, &columns[acting.column]);
        }
        let before = |k: usize| free.iter().filter(|d| d.coefficient.index() < k).count();
        let mut names: Vec<String> = free.iter().map(|d| d.name.clone()).collect();
        names.extend(model.biases.iter().map(|b| b.name.clone()));
        if model.initial_state == InitialState::Estimated {
            names.extend(E::STATES.iter().map(|s| format!("initial {s}")));
        }
        let outputs = E::AXIS.outputs();
        let ranges = std::array::from_fn(|k| before(k)..before(k + 1));
        let biased: Vec<usize> =
            model.biases.iter().filter_map(|b| outputs.iter().position(|o| *o == b.output)).collect();
        let initial = if model.initial_state == InitialState::Estimated { NX } else { 0 };
        let lanes = Lanes::new(&acting, E::FOLLOWED, initial, biased.len());
        Case {
            step_s: window.step_s,
            known: along.known,
            sensed: along.sensed,
            held: held_part,
            regressors: lanes.spread(&acting, &columns, window.len()),
            columns,
            acting,
            lanes,
            ranges,
            biased,
            start: mean(along.states.iter().take(TRIMMED)),
            initial_state: model.initial_state,
            states: along.states,
            implied: along.implied,
            noisy_surfaces: vec![],
            measurements,
            names,
            equations: PhantomData,
        }
    }

    /// Starts the integration at the measured state averaged over the first samples.
    pub fn start_from_mean_of(&mut self, samples: usize) {
        self.start = mean(self.states.iter().take(samples));
    }

    #[must_use]
    pub fn samples(&self) -> usize {
        self.measurements.values.len()
    }

    #[must_use]
    pub fn parameters(&self) -> usize {
        self.names.len()
    }

    /// Number of free derivatives; the first parameters.
    #[must_use]
    pub fn derivatives(&self) -> usize {
        self.ranges[COEFFICIENTS - 1].end
    }

    /// Output samples that count, of each output.
    #[must_use]
    pub fn used(&self) -> [usize; OUTPUTS] {
        std::array::from_fn(|o| self.measurements.used.iter().filter(|used| used[o]).count())
    }

    /// The history of a free derivative's regressor along the measured motion, in what the derivative multiplies: deg,
    /// rad of a reduced rate, for a vane deg over q̄S (and the reference length).
    #[must_use]
    pub fn regressor_as_flown(&self, derivative: usize) -> Vec<f64> {
        let acting = self.acting[derivative];
        let at = |(sample, state): (usize, &SVector<f64, NX>)| {
            let factor = self.columns[acting.column][2 * sample];
            acting.along.map_or(factor, |i| factor * state[i])
        };
        self.states.iter().enumerate().map(at).collect()
    }

    /// The coefficients with these parameters, at every point.
    pub(super) fn with(&self, parameters: &[f64]) -> Coefficients<NX> {
        let mut sum = self.held.clone();
        for (acting, value) in self.acting.iter().zip(parameters) {
            sum.add(*value, *acting, &self.columns[acting.column]);
        }
        sum
    }

    /// The regressor of each free derivative at a point and state.
    pub(super) fn regressors_at(&self, point: usize, x: &SVector<f64, NX>, regressors: &mut [f64]) {
        for (r, acting) in regressors.iter_mut().zip(&self.acting) {
            *r = self.columns[acting.column][point] * acting.along.map_or(1.0, |i| x[i]);
        }
    }

    /// The parameters to start from: `derivative` by name, biases zero, initial states as measured (rad, rad/s).
    #[must_use]
    pub fn starting_values(&self, derivative: impl Fn(&str) -> f64) -> Vec<f64> {
        let mut values: Vec<f64> = self.names.iter().take(self.derivatives()).map(|name| derivative(name)).collect();
        values.extend(self.biased.iter().map(|_| 0.0));
        if self.initial_state == InitialState::Estimated {
            values.extend(self.start.iter());
        }
        values
    }
}

/// What a case keeps of the motion.
struct Along<const NX: usize, E: Equations<NX>> {
    known: Vec<E::Known>,
    sensed: Vec<E::Sensed>,
    states: Vec<SVector<f64, NX>>,
    implied: Vec<[f64; COEFFICIENTS]>,
}

impl<const NX: usize, E: Equations<NX>> Default for Along<NX, E> {
    fn default() -> Self {
        Along { known: vec![], sensed: vec![], states: vec![], implied: vec![] }
    }
}

/// Distinct columns of regressors.
struct Columns<'a, const NX: usize, E: Equations<NX>> {
    aircraft: &'a Aircraft,
    window: &'a Window,
    /// Of each column a derivative that has it, and its surface's deflections.
    asked: Vec<(&'a Derivative, &'a [f64])>,
    values: Vec<Vec<f64>>,
    equations: PhantomData<E>,
}

impl<'a, const NX: usize, E: Equations<NX>> Columns<'a, NX, E> {
    fn new(aircraft: &'a Aircraft, window: &'a Window) -> Self {
        Columns { aircraft, window, asked: vec![], values: vec![], equations: PhantomData }
    }

    /// How a derivative acts. Two share a column when they have the same regressor, but a vane's moment is not its force.
    fn acting(&mut self, derivative: &'a Derivative) -> Acting {
        let moment = |d: &Derivative| matches!(d.regressor, Regressor::Vane(_)) && d.coefficient.is_moment();
        let same = |d: &Derivative| d.regressor == derivative.regressor && moment(d) == moment(derivative);
        let column = self.asked.iter().position(|(d, _)| same(d)).unwrap_or_else(|| {
            let deflections = derivative.regressor.surface().map_or::<&[f64], _>(&[], |name| self.window.signal(name));
            self.asked.push((derivative, deflections));
            self.values.push(Vec::with_capacity(self.window.len()));
            self.values.len() - 1
        });
        Acting { coefficient: derivative.coefficient.index(), along: E::state_of(&derivative.regressor), column }
    }

    /// Adds a point to every column.
    fn take(&mut self, point: usize, motion: &Motion) {
        for ((derivative, deflections), values) in self.asked.iter().zip(&mut self.values) {
            values.push(regressor::<NX, E>(self.aircraft, motion, derivative, deflections, point));
        }
    }
}

/// A derivative's regressor at a point; where it is a state the factor of proportion.
fn regressor<const NX: usize, E: Equations<NX>>(
    aircraft: &Aircraft,
    motion: &Motion,
    derivative: &Derivative,
    deflections: &[f64],
    point: usize,
) -> f64 {
    if let Some((_, factor)) = E::state_regressor(aircraft, motion, &derivative.regressor) {
        return factor;
    }
    let [p, q, r] = motion.rates;
    let rate = |length: f64, rate: f64| rate * length / (2.0 * motion.velocity);
    match &derivative.regressor {
        Regressor::Constant => 1.0,
        Regressor::Alpha => motion.alpha * DEG,
        Regressor::Beta => motion.beta * DEG,
        Regressor::RollRate => rate(aircraft.span_ft, p),
        Regressor::PitchRate => rate(aircraft.chord_ft, q),
        Regressor::YawRate => rate(aircraft.span_ft, r),
        Regressor::Surface(_) | Regressor::Vane(_) => {
            deflections[point] * surface_factor(aircraft, motion.qbar, derivative)
        }
    }
}

/// Regressor per deflection, 1/deg times deg or per lbf: one for a surface; a vane's force and moment are made coefficients.
pub(super) fn surface_factor(aircraft: &Aircraft, qbar: f64, derivative: &Derivative) -> f64 {
    if !matches!(derivative.regressor, Regressor::Vane(_)) {
        return 1.0;
    }
    let force = qbar * aircraft.wing_area_ft2;
    let length = match derivative.coefficient.axis() {
        crate::aero::Axis::Longitudinal => aircraft.chord_ft,
        crate::aero::Axis::Lateral => aircraft.span_ft,
    };
    1.0 / if derivative.coefficient.is_moment() { force * length } else { force }
}

/// Samples from which the initial state is averaged: there the maneuver is still trimmed.
const TRIMMED: usize = 10;

fn mean<'a, const NX: usize>(states: impl ExactSizeIterator<Item = &'a SVector<f64, NX>>) -> SVector<f64, NX> {
    let count = states.len().max(1) as f64;
    states.fold(SVector::zeros(), |sum: SVector<f64, NX>, x| sum + x) / count
}
