//! One maneuver made ready for estimation: everything that does not depend on the parameters, laid
//! out for the inner loop.
//!
//! Each coefficient is linear in the derivatives: c = Σ ξ_j r_j, where r_j is known at every point
//! or proportional to a state: c = offset + slope · x. Held derivatives are summed once into offset
//! and slope, free ones once per iteration.
//!
//! Parameters in order: free derivatives (sorted by coefficient), free biases, then initial states
//! if they are free.

pub(crate) mod blocks;
pub(crate) mod build_up;
pub(crate) mod chunking;
pub(crate) mod layout;
pub(crate) mod regressors;
pub mod surface_noise;

use std::marker::PhantomData;
use std::ops::Range;

use nalgebra::SVector;

use self::build_up::{Acting, At, Coefficients, Term};
use self::chunking::{BEYOND, WIDEST_STRIDE};
use self::layout::Lanes;
use self::regressors::{Along, Columns};
use self::surface_noise::NoisySurface;
use crate::aero::{Bias, Derivative};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::Window;
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};

/// Whether the initial states are estimated with the derivatives or taken from the record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InitialState {
    #[default]
    Estimated,
    Measured,
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
    pub(crate) step_s: f64,
    pub(crate) known: Vec<E::Known>,
    pub(crate) sensed: Vec<E::Sensed>,
    /// What the held derivatives make of the coefficients.
    pub(crate) held: Coefficients<NX>,
    /// The distinct regressors and factors of proportion, each at every point.
    pub(crate) columns: Vec<Vec<f64>>,
    /// How each free derivative acts.
    pub(crate) acting: Vec<Acting>,
    pub(crate) lanes: Lanes,
    /// The free derivatives of each coefficient.
    pub(crate) ranges: [Range<usize>; COEFFICIENTS],
    /// The output that each free bias shifts.
    pub(crate) biased: Vec<usize>,
    pub(crate) start: SVector<f64, NX>,
    pub(crate) initial_state: InitialState,
    /// The measured states at every sample, and the coefficients that the measured motion implies.
    pub(crate) states: Vec<SVector<f64, NX>>,
    pub(crate) implied: Vec<[f64; COEFFICIENTS]>,
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
    pub(crate) fn with(&self, parameters: &[f64]) -> Coefficients<NX> {
        let mut sum = self.held.clone();
        for (acting, value) in self.acting.iter().zip(parameters) {
            sum.add(*value, *acting, &self.columns[acting.column]);
        }
        sum
    }

    /// The coefficients with these parameters, at one point.
    pub(crate) fn coefficients_at(&self, parameters: &[f64], point: usize) -> At<NX> {
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
    pub(crate) fn terms(&self, parameters: &[f64]) -> Vec<Term> {
        self.acting
            .iter()
            .zip(parameters)
            .map(|(acting, value)| Term {
                acting: *acting,
                value: *value,
            })
            .collect()
    }

    /// The regressor of each free derivative at a point and state.
    pub(crate) fn regressors_at(&self, point: usize, x: &SVector<f64, NX>, regressors: &mut [f64]) {
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

/// Samples from which the initial state is averaged: there the maneuver is still trimmed.
const TRIMMED: usize = 10;

fn mean<'a, const NX: usize>(
    states: impl ExactSizeIterator<Item = &'a SVector<f64, NX>>,
) -> SVector<f64, NX> {
    let count = states.len().max(1) as f64;
    states.fold(SVector::zeros(), |sum: SVector<f64, NX>, x| sum + x) / count
}
