//! One maneuver made ready for estimation: everything that does not depend on the parameters, laid out for the inner loop.
//!
//! Each coefficient is linear in the derivatives: c = offset + slope · x + Σ ξ_j r_j. Held derivatives are summed once into
//! offset and slope; a free one keeps its regressor r_j at every point, or its factor where r_j is proportional to a state.
//!
//! Parameters in order: free derivatives (sorted by coefficient), free biases, then initial states if they are free.

use std::marker::PhantomData;
use std::ops::Range;

use nalgebra::SVector;

use super::input_noise::NoisySurface;
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

/// The part of a coefficient that the held derivatives make: offset and slopes along the states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HeldPart<const NX: usize> {
    pub offset: f64,
    pub slope: SVector<f64, NX>,
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
    pub(super) held: Vec<[HeldPart<NX>; COEFFICIENTS]>,
    /// Regressor or factor of each free derivative at each point, point by point.
    pub(super) regressors: Vec<f64>,
    /// Free derivatives whose regressor is a state: (parameter, state).
    pub(super) along_state: Vec<(usize, usize)>,
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
        let motion = window.motion(aircraft);
        let mut free = model.free.clone();
        free.sort_by_key(|d| d.coefficient.index());
        let regressor = |d: &Derivative, i: usize| regressor::<NX, E>(aircraft, window, &motion[i], d, i);
        let mut regressors = Vec::with_capacity(motion.len() * free.len());
        for i in 0..motion.len() {
            regressors.extend(free.iter().map(|d| regressor(d, i).1));
        }
        let held = (0..motion.len()).map(|i| held_parts(&model.held, |d| regressor(d, i))).collect();
        let state_of = |d: &Derivative| {
            motion.first().and_then(|m| E::state_regressor(aircraft, m, &d.regressor)).map(|(state, _)| state)
        };
        let along_state = free.iter().enumerate().filter_map(|(j, d)| state_of(d).map(|state| (j, state))).collect();
        let before = |k: usize| free.iter().filter(|d| d.coefficient.index() < k).count();
        let mut names: Vec<String> = free.iter().map(|d| d.name.clone()).collect();
        names.extend(model.biases.iter().map(|b| b.name.clone()));
        if model.initial_state == InitialState::Estimated {
            names.extend(E::STATES.iter().map(|s| format!("initial {s}")));
        }
        let outputs = E::AXIS.outputs();
        Case {
            step_s: window.step_s,
            known: motion.iter().map(|m| E::known(aircraft, m)).collect(),
            held,
            regressors,
            along_state,
            ranges: std::array::from_fn(|k| before(k)..before(k + 1)),
            biased: model.biases.iter().filter_map(|b| outputs.iter().position(|o| *o == b.output)).collect(),
            start: start_state::<NX, E>(&motion),
            initial_state: model.initial_state,
            states: motion.iter().step_by(2).map(E::measured_state).collect(),
            implied: motion.iter().step_by(2).map(|m| E::coefficients(aircraft, m)).collect(),
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
        let n = self.derivatives();
        let along = self.along_state.iter().find(|(j, _)| *j == derivative).map(|(_, state)| *state);
        let at = |(sample, state): (usize, &SVector<f64, NX>)| {
            let factor = self.regressors[2 * sample * n + derivative];
            along.map_or(factor, |i| factor * state[i])
        };
        self.states.iter().enumerate().map(at).collect()
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

/// The state a derivative acts along in this axis and its regressor at a point; for a state the factor of proportion.
fn regressor<const NX: usize, E: Equations<NX>>(
    aircraft: &Aircraft,
    window: &Window,
    motion: &Motion,
    derivative: &Derivative,
    point: usize,
) -> (Option<usize>, f64) {
    if let Some((state, factor)) = E::state_regressor(aircraft, motion, &derivative.regressor) {
        return (Some(state), factor);
    }
    let [p, q, r] = motion.rates;
    let rate = |length: f64, rate: f64| rate * length / (2.0 * motion.velocity);
    let value = match &derivative.regressor {
        Regressor::Constant => 1.0,
        Regressor::Alpha => motion.alpha * DEG,
        Regressor::Beta => motion.beta * DEG,
        Regressor::RollRate => rate(aircraft.span_ft, p),
        Regressor::PitchRate => rate(aircraft.chord_ft, q),
        Regressor::YawRate => rate(aircraft.span_ft, r),
        Regressor::Surface(name) | Regressor::Vane(name) => {
            window.signal(name)[point] * surface_factor(aircraft, motion, derivative)
        }
    };
    (None, value)
}

/// Regressor per deflection, 1/deg times deg or per lbf: one for a surface; a vane's force and moment are made coefficients.
pub(super) fn surface_factor(aircraft: &Aircraft, motion: &Motion, derivative: &Derivative) -> f64 {
    if !matches!(derivative.regressor, Regressor::Vane(_)) {
        return 1.0;
    }
    let force = motion.qbar * aircraft.wing_area_ft2;
    let length = match derivative.coefficient.axis() {
        crate::aero::Axis::Longitudinal => aircraft.chord_ft,
        crate::aero::Axis::Lateral => aircraft.span_ft,
    };
    1.0 / if derivative.coefficient.is_moment() { force * length } else { force }
}

fn held_parts<const NX: usize>(
    held: &[(&Derivative, f64)],
    regressor: impl Fn(&Derivative) -> (Option<usize>, f64),
) -> [HeldPart<NX>; COEFFICIENTS] {
    let mut parts = [HeldPart { offset: 0.0, slope: SVector::zeros() }; COEFFICIENTS];
    for (derivative, value) in held {
        let part = &mut parts[derivative.coefficient.index()];
        match regressor(derivative) {
            (Some(state), factor) => part.slope[state] += value * factor,
            (None, r) => part.offset += value * r,
        }
    }
    parts
}

/// The measured state averaged over the first samples, where the maneuver is still trimmed.
fn start_state<const NX: usize, E: Equations<NX>>(motion: &[Motion]) -> SVector<f64, NX> {
    const TRIMMED: usize = 10;
    let states: Vec<SVector<f64, NX>> = motion.iter().step_by(2).take(TRIMMED).map(E::measured_state).collect();
    mean(states.iter())
}

fn mean<'a, const NX: usize>(states: impl ExactSizeIterator<Item = &'a SVector<f64, NX>>) -> SVector<f64, NX> {
    let count = states.len().max(1) as f64;
    states.fold(SVector::zeros(), |sum: SVector<f64, NX>, x| sum + x) / count
}
