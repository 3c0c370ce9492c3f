//! One maneuver prepared for estimation: everything that does not depend on the parameters, laid out
//! for the inner loop.
//!
//! Held derivatives are summed once into the build-up ([`build_up`]), free ones once per iteration.
//! Parameters in order: free derivatives (sorted by coefficient), free biases, then the initial
//! states if they are free.

pub(crate) mod blocks;
pub(crate) mod build_up;
pub(crate) mod chunking;
pub(crate) mod layout;
pub(crate) mod regressors;
mod model;
pub mod noisy_inputs;
pub mod pressure_noise;
pub mod surface_noise;

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::SVector;

use self::build_up::{BuildUp, BuildUpTerm, PointBuildUp, ValuedTerm};
use self::layout::LaneLayout;
use self::noisy_inputs::NoisyInputs;
use self::regressors::{PreparedMotion, RegressorColumns};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::ManeuverSignals;
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};

pub use self::model::{InitialState, Model};

/// Measured outputs (deg, deg/s, g), and a mask of the samples that count.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measurements {
    pub values: Vec<[f64; OUTPUTS]>,
    pub used: Vec<[bool; OUTPUTS]>,
}

impl Measurements {
    /// `true` if a sample of an output counts.
    #[must_use]
    pub fn have(&self, output: usize) -> bool {
        self.used.iter().any(|used| used[output])
    }
}

/// One maneuver prepared for estimation.
#[derive(Debug)]
pub struct Case<const NX: usize, E: Equations<NX>> {
    pub(crate) step_s: f64,
    /// Measured motion, which cases of one maneuver share.
    pub(crate) motion: Arc<PreparedMotion<NX, E>>,
    /// Build-up of the held derivatives.
    pub(crate) held: BuildUp<NX>,
    /// Distinct regressors and factors of proportion, each at every point.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Term of each free derivative.
    pub(crate) terms: Vec<BuildUpTerm>,
    pub(crate) layout: LaneLayout,
    /// Free derivatives of each coefficient.
    pub(crate) ranges: [Range<usize>; COEFFICIENTS],
    /// Output that each free bias shifts.
    pub(crate) biased_outputs: Vec<usize>,
    /// State at which the integration starts unless it is estimated.
    pub(crate) start: SVector<f64, NX>,
    pub(crate) initial_state: InitialState,
    /// Inputs whose noise the corrected bounds count; none by default.
    pub noisy_inputs: NoisyInputs,
    pub measurements: Measurements,
    /// Names of the parameters in order; initial states are named `initial alpha` and so on.
    pub names: Vec<String>,
    equations: PhantomData<E>,
}

impl<const NX: usize, E: Equations<NX>> Case<NX, E> {
    /// Prepares a maneuver. `signals` must contain the surfaces of the model's derivatives.
    #[must_use]
    pub fn new(
        aircraft: &Aircraft,
        signals: &ManeuverSignals,
        measurements: Measurements,
        model: &Model,
    ) -> Self {
        let motion = Arc::new(PreparedMotion::new(aircraft, signals));
        Case::of_motion(motion, aircraft, signals, measurements, model)
    }

    /// Prepares a maneuver for passes alone: equation error cannot use it.
    #[must_use]
    pub fn for_passes(
        aircraft: &Aircraft,
        signals: &ManeuverSignals,
        measurements: Measurements,
        model: &Model,
    ) -> Self {
        let motion = Arc::new(PreparedMotion::for_passes(aircraft, signals));
        Case::of_motion(motion, aircraft, signals, measurements, model)
    }

    /// Prepares the same maneuver with another model. `signals` may have other surfaces than the
    /// signals of this case, but the same motion.
    #[must_use]
    pub fn with_model(
        &self,
        aircraft: &Aircraft,
        signals: &ManeuverSignals,
        model: &Model,
    ) -> Self {
        let measurements = self.measurements.clone();
        Case::of_motion(
            Arc::clone(&self.motion),
            aircraft,
            signals,
            measurements,
            model,
        )
    }

    /// Prepares the same maneuver as another recorder would have recorded it, for passes alone.
    /// `recordings` are the signals of this case and those of the other recorder.
    #[must_use]
    pub fn as_recorded(
        &self,
        aircraft: &Aircraft,
        recordings: [&ManeuverSignals; 2],
        measurements: Measurements,
        model: &Model,
    ) -> Self {
        let [of_this_case, signals] = recordings;
        let motion = if signals.shares_motion_with(of_this_case) {
            Arc::clone(&self.motion)
        } else {
            Arc::new(PreparedMotion::for_passes(aircraft, signals))
        };
        Case::of_motion(motion, aircraft, signals, measurements, model)
    }

    fn of_motion(
        motion: Arc<PreparedMotion<NX, E>>,
        aircraft: &Aircraft,
        signals: &ManeuverSignals,
        measurements: Measurements,
        model: &Model,
    ) -> Self {
        let free = model.free_in_order();
        let mut columns = RegressorColumns::<NX, E>::new(aircraft, signals);
        let terms: Vec<BuildUpTerm> = free.iter().map(|d| columns.term(d)).collect();
        let held = model.held.iter().map(|(d, value)| ValuedTerm {
            term: columns.term(d),
            value: *value,
        });
        let held: Vec<ValuedTerm> = held.collect();
        let columns = columns.values(&motion);
        let biased_outputs = model.biased_outputs::<NX, E>();
        let initial_states = match model.initial_state {
            InitialState::Estimated => NX,
            InitialState::Measured => 0,
        };
        let layout = LaneLayout::new(
            &terms,
            E::REGRESSOR_STATES,
            initial_states,
            biased_outputs.len(),
        );
        Case {
            step_s: signals.step_s,
            held: build_up_of(&held, &columns),
            columns,
            ranges: ranges_by_coefficient(&terms),
            terms,
            layout,
            biased_outputs,
            start: mean_state(motion.states.iter().take(TRIMMED_SAMPLES)),
            motion,
            initial_state: model.initial_state,
            noisy_inputs: NoisyInputs::default(),
            measurements,
            names: model.parameter_names(&E::STATES),
            equations: PhantomData,
        }
    }

    /// Starts the integration at the mean of the first measured states.
    pub fn start_from_mean_of(&mut self, samples: usize) {
        self.start = mean_state(self.motion.states.iter().take(samples));
    }

    #[must_use]
    pub fn samples(&self) -> usize {
        self.measurements.values.len()
    }

    #[must_use]
    pub fn parameters(&self) -> usize {
        self.names.len()
    }

    /// Number of free derivatives, which are the first parameters.
    #[must_use]
    pub fn derivatives(&self) -> usize {
        self.terms.len()
    }

    /// Number of samples of each output that count.
    #[must_use]
    pub fn used(&self) -> [usize; OUTPUTS] {
        std::array::from_fn(|o| self.measurements.used.iter().filter(|used| used[o]).count())
    }

    /// History of a free derivative's regressor along the measured motion: deg, rad of a reduced
    /// rate, for a vane deg over q̄S (and the reference length).
    #[must_use]
    pub fn measured_regressor(&self, derivative: usize) -> Vec<f64> {
        let term = self.terms[derivative];
        let states = self.motion.states.iter().enumerate();
        states
            .map(|(sample, x)| self.regressor(term, 2 * sample, x))
            .collect()
    }

    /// Build-up with these parameters at every point.
    pub(crate) fn build_up(&self, parameters: &[f64]) -> BuildUp<NX> {
        let mut sum = self.held.clone();
        for valued in self.valued_terms(parameters) {
            sum.add(valued, &self.columns[valued.term.column]);
        }
        sum
    }

    /// Build-up with these parameters at one point.
    pub(crate) fn build_up_at(&self, parameters: &[f64], point: usize) -> PointBuildUp<NX> {
        let mut sum = self.held.at(point);
        for valued in self.valued_terms(parameters) {
            sum.add(valued, self.columns[valued.term.column][point]);
        }
        sum
    }

    /// Terms of the free derivatives with their values.
    pub(crate) fn valued_terms(&self, parameters: &[f64]) -> impl Iterator<Item = ValuedTerm> {
        let both = self.terms.iter().zip(parameters);
        both.map(|(term, value)| ValuedTerm {
            term: *term,
            value: *value,
        })
    }

    /// Regressor of each free derivative at a point and state.
    pub(crate) fn regressors_at(&self, point: usize, x: &SVector<f64, NX>, regressors: &mut [f64]) {
        for (r, term) in regressors.iter_mut().zip(&self.terms) {
            *r = self.regressor(*term, point, x);
        }
    }

    fn regressor(&self, term: BuildUpTerm, point: usize, x: &SVector<f64, NX>) -> f64 {
        self.columns[term.column][point] * term.state.map_or(1.0, |i| x[i])
    }

    /// Starting values: `derivative` by name, biases zero, initial states as measured (rad, rad/s).
    #[must_use]
    pub fn starting_values(&self, derivative: impl Fn(&str) -> f64) -> Vec<f64> {
        let derivatives = self.names.iter().take(self.derivatives());
        let mut values: Vec<f64> = derivatives.map(|name| derivative(name)).collect();
        values.extend(self.biased_outputs.iter().map(|_| 0.0));
        if self.initial_state == InitialState::Estimated {
            values.extend(self.start.iter());
        }
        values
    }
}

fn build_up_of<const NX: usize>(terms: &[ValuedTerm], columns: &[Vec<f64>]) -> BuildUp<NX> {
    let mut sum = BuildUp::zero();
    for valued in terms {
        sum.add(*valued, &columns[valued.term.column]);
    }
    sum
}

/// Ranges of the terms of each coefficient, sorted by coefficient.
fn ranges_by_coefficient(terms: &[BuildUpTerm]) -> [Range<usize>; COEFFICIENTS] {
    let first_of = |k: usize| terms.partition_point(|term| term.coefficient < k);
    std::array::from_fn(|k| first_of(k)..first_of(k + 1))
}

/// Number of samples over which the initial state is averaged: the aircraft is still trimmed there.
const TRIMMED_SAMPLES: usize = 10;

fn mean_state<'a, const NX: usize>(
    states: impl ExactSizeIterator<Item = &'a SVector<f64, NX>>,
) -> SVector<f64, NX> {
    let count = states.len().max(1) as f64;
    states.fold(SVector::zeros(), |sum: SVector<f64, NX>, x| sum + x) / count
}
