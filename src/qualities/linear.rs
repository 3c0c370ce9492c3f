//! Linear equations of an axis about steady flight. Their matrix is linear in the derivatives, so its
//! slopes along them are exact.

use std::collections::BTreeMap;

use nalgebra::{DVector, SMatrix, SVector};

use super::trim::Trim;
use crate::aero::{Buildup, Coefficient, Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::dynamics::COEFFICIENTS;
use crate::model::{LocalKind, LocalPosterior, LocalValue};
use crate::units::DEG;

/// Number of states of either axis.
pub const STATES: usize = 4;

pub type Matrix = SMatrix<f64, STATES, STATES>;
pub type Vector = SVector<f64, STATES>;
pub type ByCoefficient = SMatrix<f64, STATES, COEFFICIENTS>;

/// Matrix A of the states' rates and vector B of the pitch control, with their slopes along each value
/// of the posterior.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearModel {
    /// A without aerodynamics.
    pub rigid: Matrix,
    pub slopes: Vec<Matrix>,
    pub control_slopes: Vec<Vector>,
    pub velocity: f64,
    pub gravity: f64,
}

impl LinearModel {
    /// A at values of the derivatives.
    #[must_use]
    pub fn matrix(&self, values: &DVector<f64>) -> Matrix {
        let terms = self.slopes.iter().zip(values.iter());
        terms.fold(self.rigid, |sum, (slope, value)| sum + slope * *value)
    }

    /// B at values of the derivatives.
    #[must_use]
    pub fn control(&self, values: &DVector<f64>) -> Vector {
        let terms = self.control_slopes.iter().zip(values.iter());
        terms.fold(Vector::zeros(), |sum, (slope, value)| sum + slope * *value)
    }
}

/// Effect of one value of the posterior on its coefficient.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effect {
    /// Place of the coefficient in its axis.
    pub coefficient: usize,
    /// Change of the coefficient with each state.
    pub by_state: [f64; STATES],
    /// Change with the pitch control, rad.
    pub by_control: f64,
    /// Share of the coefficient at trim.
    pub at_trim: f64,
}

/// State that a regressor is proportional to, and the factor of proportion.
pub type RegressorState<'a> = &'a dyn Fn(&Regressor) -> Option<(usize, f64)>;

/// States of an axis as its effects need them.
#[derive(Clone, Copy)]
pub struct AxisStates<'a> {
    pub of_regressor: RegressorState<'a>,
    /// Place of the velocity, where it is a state.
    pub velocity: Option<usize>,
    /// Names of the states that feedback may use, with their places.
    pub feedback: &'a [(&'a str, usize)],
}

/// Controls: surfaces that follow the states, and the pitch control.
#[derive(Clone, Copy, Debug)]
pub struct Controls<'a> {
    /// Empty for the bare airframe.
    pub feedback: &'a BTreeMap<String, BTreeMap<String, f64>>,
    pub pitch: &'a BTreeMap<String, f64>,
}

/// Aircraft in steady flight, with its build-up and controls.
#[derive(Clone, Copy, Debug)]
pub struct Flight<'a> {
    pub aircraft: &'a Aircraft,
    pub buildup: &'a Buildup,
    pub trim: &'a Trim,
    pub controls: Controls<'a>,
}

impl Flight<'_> {
    /// Effects of the values of a posterior. A value without a derivative in the model has none.
    #[must_use]
    pub fn effects(&self, posterior: &LocalPosterior, states: &AxisStates) -> Vec<Effect> {
        let values = posterior.values.iter();
        values
            .map(|value| {
                let derivative = self.buildup.derivative(&value.derivative);
                derivative.map_or_else(Effect::default, |derivative| {
                    self.effect(value, derivative, posterior, states)
                })
            })
            .collect()
    }

    fn effect(
        &self,
        value: &LocalValue,
        derivative: &Derivative,
        posterior: &LocalPosterior,
        states: &AxisStates,
    ) -> Effect {
        let per_pressure = self.per_pressure(derivative);
        let has_sum = has_sum(posterior, value.coefficient);
        let at_trim = self.at_trim(value, &derivative.regressor, has_sum) * per_pressure;
        let mut effect = Effect {
            coefficient: value.coefficient.index(),
            ..Effect::default()
        };
        if value.is_mach_slope {
            if let Some(velocity) = states.velocity {
                effect.by_state[velocity] = at_trim * self.trim.condition.mach / self.trim.velocity;
            }
            return effect;
        }
        effect.at_trim = at_trim;
        if value.kind == LocalKind::Sum {
            return effect;
        }
        if let Some((state, factor)) = (states.of_regressor)(&derivative.regressor) {
            effect.by_state[state] = factor;
        }
        if let Some(surface) = derivative.regressor.surface() {
            self.add_surface(surface, DEG * per_pressure, states, &mut effect);
        }
        if let (Regressor::Vane(_), Some(velocity)) = (&derivative.regressor, states.velocity) {
            // The force of a vane does not grow with dynamic pressure, as a coefficient's does.
            effect.by_state[velocity] = -2.0 * at_trim / self.trim.velocity;
        }
        effect
    }

    fn add_surface(&self, surface: &str, factor: f64, states: &AxisStates, effect: &mut Effect) {
        if let Some(gains) = self.controls.feedback.get(surface) {
            for (name, state) in states.feedback {
                effect.by_state[*state] += factor * gains.get(*name).copied().unwrap_or(0.0);
            }
        }
        let gearing = self.controls.pitch.get(surface);
        effect.by_control = factor * gearing.copied().unwrap_or(0.0);
    }

    /// Regressor at trim.
    fn at_trim(&self, value: &LocalValue, regressor: &Regressor, has_sum: bool) -> f64 {
        let surface = |name: &String| self.trim.surfaces_deg.get(name).copied();
        match (value.kind, regressor) {
            (LocalKind::Sum, _) | (_, Regressor::Constant) => 1.0,
            (_, Regressor::Alpha) if !has_sum => DEG * self.trim.alpha,
            (_, Regressor::Surface(name) | Regressor::Vane(name)) => surface(name).unwrap_or(0.0),
            _ => 0.0,
        }
    }

    /// Factor to a coefficient: one, for a vane 1/q̄S and, of a moment, one over the reference length.
    fn per_pressure(&self, derivative: &Derivative) -> f64 {
        if !matches!(derivative.regressor, Regressor::Vane(_)) {
            return 1.0;
        }
        let length = match derivative.coefficient {
            Coefficient::Cm => self.aircraft.chord_ft,
            Coefficient::Cl | Coefficient::Cn => self.aircraft.span_ft,
            Coefficient::CN | Coefficient::CA | Coefficient::CY => 1.0,
        };
        1.0 / (self.trim.qbar * self.aircraft.wing_area_ft2 * length)
    }
}

/// `true` where a sum has the place of a coefficient's constant and slope over α.
fn has_sum(posterior: &LocalPosterior, coefficient: Coefficient) -> bool {
    let mut values = posterior.values.iter();
    values.any(|v| v.coefficient == coefficient && v.kind == LocalKind::Sum)
}
