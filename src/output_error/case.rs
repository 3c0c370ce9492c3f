//! One maneuver made ready for estimation: everything that does not depend on the parameters, laid
//! out for the inner loop.
//!
//! Each coefficient is linear in the derivatives: c = Σ ξ_j r_j, where r_j is known at every point
//! or proportional to a state: c = offset + slope · x. Held derivatives are summed once into offset
//! and slope, free ones once per iteration.
//!
//! Parameters in order: free derivatives (sorted by coefficient), free biases, then initial states
//! if they are free.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use std::marker::PhantomData;
use std::ops::Range;

use nalgebra::SVector;
use pulp::{Arch, Simd, WithSimd};

use super::input_noise::NoisySurface;
use super::kernel::{CHUNK, Spaced};
use super::lanes::{Lanes, VECTOR};
use crate::aero::{Bias, Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::Window;
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};
use crate::flight::signal;
use crate::units::DEG;

/// Whether the initial states are estimated with the derivatives or taken from the record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InitialState {
    #[default]
    Estimated,
    Measured,
}

/// A pass may take every so many samples at most.
pub(super) const WIDEST_STRIDE: usize = 8;

/// Points kept beyond the last sample: those of a chunk that begins there, of the widest strides.
const BEYOND: usize = POINTS * WIDEST_STRIDE;

/// The three coefficients at every point as functions of the state: c = offset + slope · x; empty
/// where zero throughout.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coefficients<const NX: usize> {
    offset: [Vec<f64>; COEFFICIENTS],
    slope: [[Vec<f64>; NX]; COEFFICIENTS],
}

impl<const NX: usize> Coefficients<NX> {
    fn zero() -> Self {
        Coefficients {
            offset: std::array::from_fn(|_| vec![]),
            slope: std::array::from_fn(|_| std::array::from_fn(|_| vec![])),
        }
    }

    /// Adds a derivative of this value.
    fn add(&mut self, value: f64, acting: Acting, column: &[f64]) {
        let sum = match acting.along {
            Some(state) => &mut self.slope[acting.coefficient][state],
            None => &mut self.offset[acting.coefficient],
        };
        sum.resize(column.len(), 0.0);
        sum.iter_mut()
            .zip(column)
            .for_each(|(sum, r)| *sum += value * r);
    }

    /// Those of a point.
    #[inline(always)]
    pub(super) fn at(&self, point: usize) -> At<NX> {
        let value = |of: &Vec<f64>| of.get(point).copied().unwrap_or(0.0);
        At {
            offset: std::array::from_fn(|k| value(&self.offset[k])),
            slope: std::array::from_fn(|k| std::array::from_fn(|i| value(&self.slope[k][i]))),
        }
    }
}

/// Points of a chunk's samples and of the one that follows, and the same in whole vectors.
pub(super) const POINTS: usize = 2 * CHUNK + 1;
const WHOLE: usize = POINTS.next_multiple_of(VECTOR);

/// The three coefficients at the points of a chunk.
#[repr(align(64))]
pub(super) struct Near<const NX: usize> {
    pub offset: [[f64; WHOLE]; COEFFICIENTS],
    pub slope: [[[f64; WHOLE]; NX]; COEFFICIENTS],
}

impl<const NX: usize> Near<NX> {
    pub const NONE: Near<NX> = Near {
        offset: [[0.0; WHOLE]; COEFFICIENTS],
        slope: [[[0.0; WHOLE]; NX]; COEFFICIENTS],
    };

    /// Their values at one of the points when the state is x.
    #[inline(always)]
    pub fn coefficients<E: Equations<NX>>(
        &self,
        point: usize,
        x: &SVector<f64, NX>,
    ) -> [f64; COEFFICIENTS] {
        let mut values = [0.0; COEFFICIENTS];
        for k in 0..COEFFICIENTS {
            values[k] = self.offset[k][point];
            // The first state last: it is the one that the sum would wait for.
            for &i in E::FOLLOWED.iter().rev() {
                values[k] = self.slope[k][i][point].mul_add(x[i], values[k]);
            }
        }
        values
    }
}

/// What a free derivative adds to a coefficient: its value times a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Term {
    acting: Acting,
    value: f64,
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

/// How a derivative acts: on which coefficient, along which state (where its regressor is one), and
/// which column of regressors or factors of proportion is its own.
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
    pub fn new(
        aircraft: &Aircraft,
        window: &Window,
        measurements: Measurements,
        model: &Model,
    ) -> Self {
        let mut free = model.free.clone();
        free.sort_by_key(|d| d.coefficient.index());
        let mut columns = Columns::<NX, E>::new(aircraft, window);
        let acting: Vec<Acting> = free.iter().map(|d| columns.acting(d)).collect();
        let held: Vec<(Acting, f64)> = model
            .held
            .iter()
            .map(|(d, value)| (columns.acting(d), *value))
            .collect();
        let mut along = Along::<NX, E>::over(aircraft, window);
        let mut columns = columns.filled(&along);
        for column in &mut columns {
            column.extend([0.0; BEYOND]);
        }
        // A step needs three points, also the one that would follow the last sample.
        along.known.extend(
            along
                .known
                .last()
                .cloned()
                .into_iter()
                .cycle()
                .take(2 * WIDEST_STRIDE),
        );
        let mut held_part = Coefficients::zero();
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
        let biased: Vec<usize> = model
            .biases
            .iter()
            .filter_map(|b| outputs.iter().position(|o| *o == b.output))
            .collect();
        let initial = if model.initial_state == InitialState::Estimated {
            NX
        } else {
            0
        };
        let lanes = Lanes::new(&acting, E::FOLLOWED, initial, biased.len());
        Case {
            step_s: window.step_s,
            known: along.known,
            sensed: along.sensed,
            held: held_part,
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

    /// The history of a free derivative's regressor along the measured motion, in what the
    /// derivative multiplies: deg, rad of a reduced rate, for a vane deg over q̄S (and the
    /// reference length).
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

    /// The coefficients with these parameters, at one point.
    pub(super) fn coefficients_at(&self, parameters: &[f64], point: usize) -> At<NX> {
        let mut sum = self.held.at(point);
        for (acting, value) in self.acting.iter().zip(parameters) {
            let own = match acting.along {
                Some(state) => &mut sum.slope[acting.coefficient][state],
                None => &mut sum.offset[acting.coefficient],
            };
            *own += value * self.columns[acting.column][point];
        }
        sum
    }

    /// What the free derivatives add to the coefficients.
    pub(super) fn terms(&self, parameters: &[f64]) -> Vec<Term> {
        self.acting
            .iter()
            .zip(parameters)
            .map(|(acting, value)| Term {
                acting: *acting,
                value: *value,
            })
            .collect()
    }

    /// The coefficients at the points of a chunk.
    #[inline(always)]
    pub(super) fn near(&self, terms: &[Term], points: Spaced, near: &mut Near<NX>) {
        for k in 0..COEFFICIENTS {
            near.offset[k].fill(0.0);
            add(1.0, &self.held.offset[k], points, &mut near.offset[k]);
            for &i in E::FOLLOWED {
                near.slope[k][i].fill(0.0);
                add(1.0, &self.held.slope[k][i], points, &mut near.slope[k][i]);
            }
        }
        for Term { acting, value } in terms {
            let sum = match acting.along {
                Some(state) => &mut near.slope[acting.coefficient][state],
                None => &mut near.offset[acting.coefficient],
            };
            add(*value, &self.columns[acting.column], points, sum);
        }
    }

    /// What the derivatives multiply at the points of a chunk, in the rows that the lanes read.
    #[inline(always)]
    pub(super) fn spread(&self, points: Spaced, rows: &mut [f64]) {
        for &(place, column) in &self.lanes.columns {
            let column = &self.columns[column][points.first..][..=points.stride * (POINTS - 1)];
            for k in 0..POINTS {
                rows[k * self.lanes.row + place] = column[k * points.stride];
            }
        }
    }

    /// The regressor of each free derivative at a point and state.
    pub(super) fn regressors_at(&self, point: usize, x: &SVector<f64, NX>, regressors: &mut [f64]) {
        for (r, acting) in regressors.iter_mut().zip(&self.acting) {
            *r = self.columns[acting.column][point] * acting.along.map_or(1.0, |i| x[i]);
        }
    }

    /// The parameters to start from: `derivative` by name, biases zero, initial states as measured
    /// (rad, rad/s).
    #[must_use]
    pub fn starting_values(&self, derivative: impl Fn(&str) -> f64) -> Vec<f64> {
        let mut values: Vec<f64> = self
            .names
            .iter()
            .take(self.derivatives())
            .map(|name| derivative(name))
            .collect();
        values.extend(self.biased.iter().map(|_| 0.0));
        if self.initial_state == InitialState::Estimated {
            values.extend(self.start.iter());
        }
        values
    }
}

/// Adds a value times a column's points; a column that is empty is zero throughout.
#[inline(always)]
fn add(value: f64, column: &[f64], points: Spaced, sum: &mut [f64; WHOLE]) {
    let Some(column) = column.get(points.first..) else {
        return;
    };
    if points.stride == 1 {
        let Some(column) = column.first_chunk::<WHOLE>() else {
            return;
        };
        for k in 0..WHOLE {
            sum[k] = value.mul_add(column[k], sum[k]);
        }
    } else {
        sum.iter_mut()
            .zip(column.iter().step_by(points.stride))
            .for_each(|(sum, c)| *sum = value.mul_add(*c, *sum));
    }
}

/// What a case keeps of the motion.
struct Along<const NX: usize, E: Equations<NX>> {
    known: Vec<E::Known>,
    /// α and β at the c.g. at every point, rad.
    flow: Vec<[f64; 2]>,
    sensed: Vec<E::Sensed>,
    states: Vec<SVector<f64, NX>>,
    implied: Vec<[f64; COEFFICIENTS]>,
}

impl<const NX: usize, E: Equations<NX>> Along<NX, E> {
    fn over(aircraft: &Aircraft, window: &Window) -> Self {
        let (points, samples) = (window.len(), window.samples);
        let mut along = Along {
            known: Vec::with_capacity(points + 2 * WIDEST_STRIDE),
            flow: Vec::with_capacity(points),
            sensed: Vec::with_capacity(samples),
            states: Vec::with_capacity(samples),
            implied: Vec::with_capacity(samples),
        };
        Arch::new().dispatch(Over {
            aircraft,
            window,
            along: &mut along,
        });
        along
    }
}

/// Takes over the motion point by point, compiled for the processor at hand.
struct Over<'a, const NX: usize, E: Equations<NX>> {
    aircraft: &'a Aircraft,
    window: &'a Window,
    along: &'a mut Along<NX, E>,
}

impl<const NX: usize, E: Equations<NX>> WithSimd for Over<'_, NX, E> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Over {
            aircraft,
            window,
            along,
        } = self;
        let motion = window.motion(aircraft);
        for point in 0..window.len() {
            let motion = motion.at(point);
            let known = E::known(aircraft, &motion);
            along.flow.push([motion.alpha, motion.beta]);
            if point % 2 == 0 {
                along.sensed.push(E::sensed(aircraft, &motion));
                along.states.push(E::measured_state(&motion));
                along
                    .implied
                    .push(E::coefficients(aircraft, &motion, &known));
            }
            along.known.push(known);
        }
    }
}

/// Distinct columns of regressors.
struct Columns<'a, const NX: usize, E: Equations<NX>> {
    aircraft: &'a Aircraft,
    window: &'a Window,
    /// Of each column a derivative that has it.
    asked: Vec<&'a Derivative>,
    equations: PhantomData<E>,
}

impl<'a, const NX: usize, E: Equations<NX>> Columns<'a, NX, E> {
    fn new(aircraft: &'a Aircraft, window: &'a Window) -> Self {
        Columns {
            aircraft,
            window,
            asked: vec![],
            equations: PhantomData,
        }
    }

    /// How a derivative acts. Two share a column when they have the same regressor, but a vane's
    /// moment is not its force.
    fn acting(&mut self, derivative: &'a Derivative) -> Acting {
        let moment =
            |d: &Derivative| matches!(d.regressor, Regressor::Vane(_)) && d.coefficient.is_moment();
        let same = |d: &&Derivative| {
            d.regressor == derivative.regressor && moment(d) == moment(derivative)
        };
        let column = self.asked.iter().position(same).unwrap_or_else(|| {
            self.asked.push(derivative);
            self.asked.len() - 1
        });
        Acting {
            coefficient: derivative.coefficient.index(),
            along: E::state_of(&derivative.regressor),
            column,
        }
    }

    /// Every column at every point, with room for points beyond.
    fn filled(&self, along: &Along<NX, E>) -> Vec<Vec<f64>> {
        let filled = |derivative: &&Derivative| {
            let mut column = Vec::with_capacity(self.window.len() + BEYOND);
            self.fill(derivative, along, &mut column);
            column
        };
        self.asked.iter().map(filled).collect()
    }

    /// A derivative's regressor at every point; where it is a state the factor of proportion.
    fn fill(&self, derivative: &Derivative, along: &Along<NX, E>, column: &mut Vec<f64>) {
        let (aircraft, velocity) = (self.aircraft, self.window.signal(signal::VELOCITY));
        let regressor = &derivative.regressor;
        if E::state_of(regressor).is_some() {
            let factor = |v: &f64| {
                E::state_regressor(aircraft, *v, regressor).map_or(0.0, |(_, factor)| factor)
            };
            return column.extend(velocity.iter().map(factor));
        }
        let mut rate = |name: &str, length: f64| {
            let both = self.window.signal(name).iter().zip(velocity);
            column.extend(both.map(|(rate, v)| rate / DEG * length / (2.0 * v)));
        };
        match regressor {
            Regressor::RollRate => rate(signal::P, aircraft.span_ft),
            Regressor::PitchRate => rate(signal::Q, aircraft.chord_ft),
            Regressor::YawRate => rate(signal::R, aircraft.span_ft),
            Regressor::Constant => column.resize(self.window.len(), 1.0),
            Regressor::Alpha => column.extend(along.flow.iter().map(|[alpha, _]| alpha * DEG)),
            Regressor::Beta => column.extend(along.flow.iter().map(|[_, beta]| beta * DEG)),
            Regressor::Surface(name) => column.extend(self.window.signal(name)),
            Regressor::Vane(name) => {
                let both = self
                    .window
                    .signal(name)
                    .iter()
                    .zip(self.window.signal(signal::QBAR));
                column.extend(
                    both.map(|(force, qbar)| force * surface_factor(aircraft, *qbar, derivative)),
                );
            }
        }
    }
}

/// Regressor per deflection, 1/deg times deg or per lbf: one for a surface; a vane's force and
/// moment are made coefficients.
pub(super) fn surface_factor(aircraft: &Aircraft, qbar: f64, derivative: &Derivative) -> f64 {
    if !matches!(derivative.regressor, Regressor::Vane(_)) {
        return 1.0;
    }
    let force = qbar * aircraft.wing_area_ft2;
    let length = match derivative.coefficient.axis() {
        crate::aero::Axis::Longitudinal => aircraft.chord_ft,
        crate::aero::Axis::Lateral => aircraft.span_ft,
    };
    1.0 / if derivative.coefficient.is_moment() {
        force * length
    } else {
        force
    }
}

/// Samples from which the initial state is averaged: there the maneuver is still trimmed.
const TRIMMED: usize = 10;

fn mean<'a, const NX: usize>(
    states: impl ExactSizeIterator<Item = &'a SVector<f64, NX>>,
) -> SVector<f64, NX> {
    let count = states.len().max(1) as f64;
    states.fold(SVector::zeros(), |sum: SVector<f64, NX>, x| sum + x) / count
}
