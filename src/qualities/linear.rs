//! Linear equations of an axis about steady flight. Their matrix is linear in the derivatives, so its
//! slopes along them are exact.

use std::collections::BTreeMap;

use nalgebra::{DVector, SMatrix, SVector};

use super::trim::Trim;
use crate::aero::{AeroModel, Coefficient, Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::dynamics::COEFFICIENTS;
use crate::model::{LocalKind, LocalPosterior, LocalValue};
use crate::units::DEG;

/// Number of states of either axis.
pub const STATES: usize = 4;

pub type Matrix = SMatrix<f64, STATES, STATES>;
pub type Vector = SVector<f64, STATES>;
pub type ByCoefficient = SMatrix<f64, STATES, COEFFICIENTS>;

/// Linear equations of an axis, with their slopes along each value of the posterior. The rates of
/// the states x with the pitch control u are A x + B u. With a term along the rate of the angle of
/// attack they are A x + B u + m α̇.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearModel {
    /// Matrix A without aerodynamics.
    pub rigid: Matrix,
    pub slopes: Vec<Matrix>,
    pub control_slopes: Vec<Vector>,
    /// `None` if no derivative is along α̇.
    pub alpha_rate: Option<AlphaRateTerm>,
    pub velocity: f64,
    pub gravity: f64,
}

/// Effect of α̇ on the rates of the states.
#[derive(Clone, Debug, PartialEq)]
pub struct AlphaRateTerm {
    /// Index of α among the states.
    pub alpha: usize,
    /// Slopes of m along each value of the posterior.
    pub slopes: Vec<Vector>,
}

/// Equations solved for the rates of the states, ẋ = A x + B u.
#[derive(Clone, Debug, PartialEq)]
pub struct SolvedEquations {
    pub matrix: Matrix,
    pub control: Vector,
    /// Slopes of A and B along each value; empty unless they are requested.
    pub slopes: Vec<Matrix>,
    pub control_slopes: Vec<Vector>,
}

impl LinearModel {
    /// Equations at values of the derivatives, solved for the rates.
    #[must_use]
    pub fn solved(
        &self,
        values: &DVector<f64>,
        differentiation: Differentiation,
    ) -> SolvedEquations {
        let terms = self.slopes.iter().zip(values.iter());
        let matrix = terms.fold(self.rigid, |sum, (slope, value)| sum + slope * *value);
        let control = weighted_sum(&self.control_slopes, values);
        let has_slopes = differentiation == Differentiation::Slopes;
        let count = if has_slopes { self.slopes.len() } else { 0 };
        let explicit = SolvedEquations {
            matrix,
            control,
            slopes: self.slopes[..count].to_vec(),
            control_slopes: self.control_slopes[..count].to_vec(),
        };
        match &self.alpha_rate {
            None => explicit,
            Some(term) => term.solved(&explicit, values),
        }
    }
}

impl AlphaRateTerm {
    /// Solves the equations with a term along α̇ for the rates. Let e be the unit vector of α and I
    /// the identity. Then ẋ = (I − m eᵀ)⁻¹ (A x + B u), and the inverse is I + m eᵀ/(1 − eᵀm). The
    /// slopes follow from the slopes of (I − m eᵀ) A.
    fn solved(&self, explicit: &SolvedEquations, values: &DVector<f64>) -> SolvedEquations {
        let effect = weighted_sum(&self.slopes, values);
        let share = effect / (1.0 - effect[self.alpha]);
        let solve = |matrix: Matrix| matrix + share * matrix.row(self.alpha);
        let solve_vector = |vector: Vector| vector + share * vector[self.alpha];
        let matrix = solve(explicit.matrix);
        let control = solve_vector(explicit.control);
        let of_matrix = explicit.slopes.iter().zip(&self.slopes);
        let of_control = explicit.control_slopes.iter().zip(&self.slopes);
        let slope =
            |(slope, effect): (&Matrix, &Vector)| solve(slope + effect * matrix.row(self.alpha));
        let control_slope = |(slope, effect): (&Vector, &Vector)| {
            solve_vector(slope + effect * control[self.alpha])
        };
        SolvedEquations {
            matrix,
            control,
            slopes: of_matrix.map(slope).collect(),
            control_slopes: of_control.map(control_slope).collect(),
        }
    }
}

fn weighted_sum(slopes: &[Vector], values: &DVector<f64>) -> Vector {
    let terms = slopes.iter().zip(values.iter());
    terms.fold(Vector::zeros(), |sum, (slope, value)| sum + slope * *value)
}

/// Slopes along the derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Differentiation {
    Slopes,
    ValuesAlone,
}

/// Effect of one value of the posterior on its coefficient.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effect {
    /// Index of the coefficient in its axis.
    pub coefficient: usize,
    /// Change of the coefficient with each state.
    pub by_state: [f64; STATES],
    /// Change with the pitch control, rad.
    pub by_control: f64,
    /// Change with α̇, s.
    pub by_alpha_rate: f64,
    /// Part of the coefficient at trim.
    pub at_trim: f64,
}

impl Effect {
    fn constant(at_trim: f64) -> Effect {
        Effect {
            at_trim,
            ..Effect::default()
        }
    }

    fn times(self, factor: f64) -> Effect {
        Effect {
            by_state: self.by_state.map(|slope| slope * factor),
            by_control: self.by_control * factor,
            by_alpha_rate: self.by_alpha_rate * factor,
            at_trim: self.at_trim * factor,
            ..self
        }
    }
}

/// State that a regressor is proportional to, and the factor of proportion.
pub type RegressorState<'a> = &'a dyn Fn(&Regressor) -> Option<(usize, f64)>;

/// States of an axis, as the computation of effects needs them.
#[derive(Clone, Copy)]
pub struct AxisStates<'a> {
    pub of_regressor: RegressorState<'a>,
    /// Index of the velocity, if it is a state.
    pub velocity: Option<usize>,
    /// Names of the states that feedback may use, with their indices.
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
pub struct SteadyFlight<'a> {
    pub aircraft: &'a Aircraft,
    pub aero_model: &'a AeroModel,
    pub trim: &'a Trim,
    pub controls: Controls<'a>,
}

impl SteadyFlight<'_> {
    /// Effects of the values of a posterior. A value without a derivative in the model has no
    /// effect.
    #[must_use]
    pub fn effects(&self, posterior: &LocalPosterior, states: &AxisStates) -> Vec<Effect> {
        let values = posterior.values.iter();
        values
            .map(|value| {
                let derivative = self.aero_model.derivative(&value.derivative);
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
        let mut effect = match value.kind {
            LocalKind::Sum => Effect::constant(1.0),
            LocalKind::Derivative => {
                let regressor = self.regressor(&derivative.regressor, states);
                regressor.times(derivative.coefficient_factor(self.aircraft, self.trim.qbar))
            }
        };
        effect.coefficient = value.coefficient.index();
        if derivative.regressor == Regressor::Alpha && has_sum(posterior, value.coefficient) {
            // The sum has α's share at trim.
            effect.at_trim = 0.0;
        }
        if value.is_mach_slope {
            let at_trim = effect.at_trim;
            effect = Effect::constant(0.0);
            effect.coefficient = value.coefficient.index();
            if let Some(velocity) = states.velocity {
                effect.by_state[velocity] = at_trim * self.trim.condition.mach / self.trim.velocity;
            }
        } else if let (Regressor::Vane(_), Some(velocity)) =
            (&derivative.regressor, states.velocity)
        {
            // The force of a vane does not grow with dynamic pressure, as a coefficient's does.
            effect.by_state[velocity] = -2.0 * effect.at_trim / self.trim.velocity;
        }
        effect
    }

    /// Value and slopes of a regressor at trim.
    fn regressor(&self, regressor: &Regressor, states: &AxisStates) -> Effect {
        match regressor {
            Regressor::Magnitude(of) => {
                let own = self.regressor(of, states);
                // At zero the magnitude has no slope.
                let sign = if own.at_trim == 0.0 {
                    0.0
                } else {
                    own.at_trim.signum()
                };
                own.times(sign)
            }
            Regressor::Product(both) => {
                let [first, second] = [&both[0], &both[1]].map(|r| self.regressor(r, states));
                let (by_first, by_second) =
                    (first.times(second.at_trim), second.times(first.at_trim));
                Effect {
                    at_trim: by_first.at_trim,
                    by_control: by_first.by_control + by_second.by_control,
                    by_alpha_rate: by_first.by_alpha_rate + by_second.by_alpha_rate,
                    by_state: std::array::from_fn(|i| by_first.by_state[i] + by_second.by_state[i]),
                    ..Effect::default()
                }
            }
            part => self.single_regressor(part, states),
        }
    }

    fn single_regressor(&self, regressor: &Regressor, states: &AxisStates) -> Effect {
        let trim = self.trim;
        let mut effect = Effect::constant(match regressor {
            Regressor::Constant => 1.0,
            Regressor::Alpha => DEG * trim.alpha,
            Regressor::Surface(_) if regressor.is_velocity() => trim.velocity,
            Regressor::Surface(_) if regressor.is_mach() => trim.condition.mach,
            Regressor::Surface(name) | Regressor::Vane(name) => {
                trim.surfaces_deg.get(name).copied().unwrap_or(0.0)
            }
            _ => 0.0,
        });
        if *regressor == Regressor::AlphaRate {
            effect.by_alpha_rate = self.aircraft.chord_ft / (2.0 * trim.velocity);
        }
        if let Some((state, factor)) = (states.of_regressor)(regressor) {
            effect.by_state[state] = factor;
        }
        let is_of_velocity = regressor.is_velocity() || regressor.is_mach();
        if let Some(velocity) = states.velocity.filter(|_| is_of_velocity) {
            effect.by_state[velocity] = effect.at_trim / trim.velocity;
        } else if let Some(surface) = regressor.surface() {
            self.add_surface(surface, DEG, states, &mut effect);
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
}

/// `true` if a sum replaces a coefficient's constant and slope over α.
fn has_sum(posterior: &LocalPosterior, coefficient: Coefficient) -> bool {
    let mut values = posterior.values.iter();
    values.any(|v| v.coefficient == coefficient && v.kind == LocalKind::Sum)
}
