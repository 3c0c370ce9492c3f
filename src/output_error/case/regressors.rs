//! The measured motion and the regressors at every point of a maneuver.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use std::marker::PhantomData;

use nalgebra::SVector;
use pulp::{Arch, Simd, WithSimd};

use super::build_up::BuildUpTerm;
use super::chunking::{WIDEST_STRIDE, ZERO_POINTS};
use crate::aero::{Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::ManeuverSignals;
use crate::dynamics::{COEFFICIENTS, Equations, Longitudinal, Motion};
use crate::flight::signal;
use crate::units::DEG;

/// Measured motion of a maneuver, prepared for the equations of one axis.
#[derive(Debug)]
pub(crate) struct PreparedMotion<const NX: usize, E: Equations<NX>> {
    /// Inputs of the rates at every point.
    pub rate_inputs: Vec<E::RateInputs>,
    /// α and β at the c.g. at every point, rad.
    flow: Vec<[f64; 2]>,
    /// Inputs of the sensors at every sample.
    pub sensor_inputs: Vec<E::SensorInputs>,
    /// Measured states at every sample.
    pub states: Vec<SVector<f64, NX>>,
    /// Coefficients that the motion implies at every sample; none in a motion for passes alone.
    pub implied: Vec<[f64; COEFFICIENTS]>,
    /// The implied coefficients without their part that is proportional to the angular
    /// accelerations.
    pub implied_without_accelerations: Vec<[f64; COEFFICIENTS]>,
}

impl<const NX: usize, E: Equations<NX>> PreparedMotion<NX, E> {
    pub fn new(aircraft: &Aircraft, signals: &ManeuverSignals) -> Self {
        Self::prepare(aircraft, signals, true)
    }

    /// Motion for passes alone. Only equation error reads the implied coefficients, which take as long as
    /// the rest.
    pub fn for_passes(aircraft: &Aircraft, signals: &ManeuverSignals) -> Self {
        Self::prepare(aircraft, signals, false)
    }

    fn prepare(aircraft: &Aircraft, signals: &ManeuverSignals, with_implied: bool) -> Self {
        let (points, samples) = (signals.len(), signals.samples);
        let implied = if with_implied { samples } else { 0 };
        let mut prepared = PreparedMotion {
            rate_inputs: Vec::with_capacity(points + 2 * WIDEST_STRIDE),
            flow: Vec::with_capacity(points),
            sensor_inputs: Vec::with_capacity(samples),
            states: Vec::with_capacity(samples),
            implied: Vec::with_capacity(implied),
            implied_without_accelerations: Vec::with_capacity(implied),
        };
        Arch::new().dispatch(Preparation {
            aircraft,
            signals,
            with_implied,
            prepared: &mut prepared,
        });
        // A step reads three points, also the one that begins at the last sample.
        let last = prepared.rate_inputs.last().cloned();
        let repeated = last.into_iter().cycle().take(2 * WIDEST_STRIDE);
        prepared.rate_inputs.extend(repeated);
        prepared
    }
}

/// Preparation point by point, compiled for the processor at hand.
struct Preparation<'a, const NX: usize, E: Equations<NX>> {
    aircraft: &'a Aircraft,
    signals: &'a ManeuverSignals,
    with_implied: bool,
    prepared: &'a mut PreparedMotion<NX, E>,
}

impl<const NX: usize, E: Equations<NX>> WithSimd for Preparation<'_, NX, E> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Preparation {
            aircraft,
            signals,
            with_implied,
            prepared,
        } = self;
        let measured = signals.motion(aircraft);
        for point in 0..signals.len() {
            let motion = measured.at(point);
            let inputs = E::rate_inputs(aircraft, &motion);
            prepared.flow.push([motion.alpha, motion.beta]);
            if signals.is_sample(point) {
                let sensors = E::sensor_inputs(aircraft, &motion);
                prepared.sensor_inputs.push(sensors);
                prepared.states.push(E::measured_state(&motion));
            }
            if with_implied && signals.is_sample(point) {
                let implied = E::implied_coefficients(aircraft, &motion, &inputs);
                prepared.implied.push(implied);
                let rest = measured.without_angular_accelerations(point);
                let rest = E::implied_coefficients(aircraft, &rest, &inputs);
                prepared.implied_without_accelerations.push(rest);
            }
            prepared.rate_inputs.push(inputs);
        }
    }
}

/// Distinct columns of regressors, collected term by term.
pub(super) struct RegressorColumns<'a, const NX: usize, E: Equations<NX>> {
    aircraft: &'a Aircraft,
    signals: &'a ManeuverSignals,
    /// One derivative that has each column.
    derivatives: Vec<&'a Derivative>,
    equations: PhantomData<E>,
}

impl<'a, const NX: usize, E: Equations<NX>> RegressorColumns<'a, NX, E> {
    pub fn new(aircraft: &'a Aircraft, signals: &'a ManeuverSignals) -> Self {
        RegressorColumns {
            aircraft,
            signals,
            derivatives: vec![],
            equations: PhantomData,
        }
    }

    /// Term of a derivative, with a new column where no earlier derivative has the same.
    pub fn term(&mut self, derivative: &'a Derivative) -> BuildUpTerm {
        let known = self
            .derivatives
            .iter()
            .position(|d| have_same_column(d, derivative));
        let column = known.unwrap_or_else(|| {
            self.derivatives.push(derivative);
            self.derivatives.len() - 1
        });
        BuildUpTerm {
            coefficient: derivative.coefficient.index(),
            state: derivative.regressor.find(E::state_of),
            column,
        }
    }

    /// Values of every column at every point. Zero points follow for the passes, which take the
    /// points between samples too.
    pub fn values(&self, motion: &PreparedMotion<NX, E>) -> Vec<Vec<f64>> {
        let zero_points = if self.signals.has_points_between_samples() {
            ZERO_POINTS
        } else {
            0
        };
        let mut columns = Vec::with_capacity(self.derivatives.len());
        for derivative in &self.derivatives {
            let mut column = self.column(derivative, motion);
            column.resize(column.len() + zero_points, 0.0);
            columns.push(column);
        }
        columns
    }

    /// A derivative's regressor at every point, or its factor of proportion to a state; in coefficients.
    fn column(&self, derivative: &Derivative, motion: &PreparedMotion<NX, E>) -> Vec<f64> {
        let mut column = self.factor(&derivative.regressor, motion);
        if matches!(derivative.regressor, Regressor::Vane(_)) {
            let qbar = self.signals.signal(signal::QBAR).iter();
            for (force, qbar) in column.iter_mut().zip(qbar) {
                *force *= derivative.coefficient_factor(self.aircraft, *qbar);
            }
        }
        column
    }

    /// Factor of proportion to the first state in a regressor; without a state its measured values.
    fn factor(&self, regressor: &Regressor, motion: &PreparedMotion<NX, E>) -> Vec<f64> {
        let measured = |part: &Regressor| self.measured(part, motion);
        match regressor {
            Regressor::Magnitude(of) => {
                let mut column = self.factor(of, motion);
                let signs = measured(of).into_iter().map(f64::signum);
                column.iter_mut().zip(signs).for_each(|(c, s)| *c *= s);
                column
            }
            Regressor::Product(both) => {
                let [first, second] = &**both;
                if first.find(E::state_of).is_some() {
                    product(self.factor(first, motion), &measured(second))
                } else {
                    product(self.factor(second, motion), &measured(first))
                }
            }
            state if E::state_of(state).is_some() => self.state_factor(state),
            part => measured(part),
        }
    }

    fn state_factor(&self, regressor: &Regressor) -> Vec<f64> {
        let velocity = self.signals.signal(signal::VELOCITY).iter();
        let factor = |v: &f64| E::state_regressor(self.aircraft, *v, regressor);
        column_of(velocity.map(|v| factor(v).map_or(0.0, |(_, factor)| factor)))
    }

    /// Measured values of a regressor at every point; a vane's values are in deg.
    fn measured(&self, regressor: &Regressor, motion: &PreparedMotion<NX, E>) -> Vec<f64> {
        let aircraft = self.aircraft;
        match regressor {
            Regressor::RollRate => self.reduced_rate(signal::P, aircraft.span_ft),
            Regressor::PitchRate => self.reduced_rate(signal::Q, aircraft.chord_ft),
            Regressor::YawRate => self.reduced_rate(signal::R, aircraft.span_ft),
            Regressor::AlphaRate => self.reduced_alpha_rate(),
            Regressor::Constant => column_of((0..self.signals.len()).map(|_| 1.0)),
            Regressor::Alpha => column_of(motion.flow.iter().map(|[alpha, _]| alpha * DEG)),
            Regressor::Beta => column_of(motion.flow.iter().map(|[_, beta]| beta * DEG)),
            Regressor::Surface(name) | Regressor::Vane(name) => {
                column_of(self.signals.signal(name).iter().copied())
            }
            Regressor::Magnitude(of) => {
                let values = self.measured(of, motion);
                values.into_iter().map(f64::abs).collect()
            }
            Regressor::Product(both) => {
                let [first, second] = &**both;
                product(self.measured(first, motion), &self.measured(second, motion))
            }
        }
    }

    /// Reduced rate α̇ c̄/2V that the measured motion implies.
    fn reduced_alpha_rate(&self) -> Vec<f64> {
        let aircraft = self.aircraft;
        let reduced = |motion: Motion| {
            let rate = Longitudinal::alpha_rate(aircraft, &motion);
            rate * aircraft.chord_ft / (2.0 * motion.velocity)
        };
        self.signals
            .motion(aircraft)
            .points()
            .map(reduced)
            .collect()
    }

    fn reduced_rate(&self, rate: &str, length_ft: f64) -> Vec<f64> {
        let rate = self.signals.signal(rate).iter();
        let both = rate.zip(self.signals.signal(signal::VELOCITY));
        column_of(both.map(|(rate, v)| rate / DEG * length_ft / (2.0 * v)))
    }
}

/// Values with room for the zero points that follow them.
fn column_of(values: impl ExactSizeIterator<Item = f64>) -> Vec<f64> {
    let mut column = Vec::with_capacity(values.len() + ZERO_POINTS);
    column.extend(values);
    column
}

fn product(mut first: Vec<f64>, second: &[f64]) -> Vec<f64> {
    first.iter_mut().zip(second).for_each(|(a, b)| *a *= b);
    first
}

/// `true` if two derivatives have the same column: the same regressor, except that a vane's moment
/// is not its force.
fn have_same_column(a: &Derivative, b: &Derivative) -> bool {
    a.regressor == b.regressor && is_vane_moment(a) == is_vane_moment(b)
}

fn is_vane_moment(derivative: &Derivative) -> bool {
    matches!(derivative.regressor, Regressor::Vane(_)) && derivative.coefficient.is_moment()
}
