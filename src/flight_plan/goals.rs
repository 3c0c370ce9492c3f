//! Goals as written in YAML: derivatives with their wanted bounds, and levels and matches to be
//! decided.

use serde::{Deserialize, Serialize};

use crate::tables::{Airframe, FlyingQuality, ModelSource};

/// A file of goals.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goals {
    pub goals: Vec<Goal>,
}

/// A goal over a range of angles of attack. Default: over all that the cards reach. It has one of
/// `derivative`, `quantity` and `match`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goal {
    /// Derivative or sum of the posterior.
    #[serde(default)]
    pub derivative: Option<String>,
    /// Quantity of a mode whose level is to be decided.
    #[serde(default)]
    pub quantity: Option<FlyingQuality>,
    /// Airframe of the quantity; bare unless given.
    #[serde(default)]
    pub airframe: Option<Airframe>,
    /// Class of the maneuvers whose proof of match is to be decided.
    #[serde(default, rename = "match")]
    pub class: Option<String>,
    /// Simulator of the match; the first of the proof of match unless given.
    #[serde(default)]
    pub model: Option<ModelSource>,
    /// Lowest and highest angle of attack.
    #[serde(default)]
    pub alpha_deg: Option<(f64, f64)>,
    /// Wanted standard deviation, in the derivative's unit; without it each reduction counts.
    #[serde(default)]
    pub bound: Option<f64>,
    /// Probability that decides a level or a match.
    #[serde(default)]
    pub decided: Option<f64>,
    /// Weight beside other goals.
    #[serde(default = "one")]
    pub weight: f64,
}

/// Subject of a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GoalSubject<'a> {
    Derivative(&'a str),
    Level(Airframe, FlyingQuality),
    /// Class, and simulator unless it is the first.
    Match(&'a str, Option<ModelSource>),
}

/// Largest angle of attack of either sign.
const HIGHEST_ALPHA_DEG: f64 = 180.0;

/// Probability that decides unless given.
const DECIDED: f64 = 0.95;

fn one() -> f64 {
    1.0
}

impl Goal {
    /// Goal without a wanted bound.
    #[must_use]
    pub fn of(derivative: &str) -> Goal {
        Goal {
            derivative: Some(derivative.to_owned()),
            quantity: None,
            airframe: None,
            class: None,
            model: None,
            alpha_deg: None,
            bound: None,
            decided: None,
            weight: one(),
        }
    }

    /// Name by which messages point at the goal.
    #[must_use]
    pub fn name(&self) -> &str {
        let quantity = self.quantity.map(FlyingQuality::name);
        let name = self.derivative.as_deref().or(quantity);
        name.or(self.class.as_deref()).unwrap_or("goals")
    }

    /// Subject of the goal; `None` if it has none or more than one.
    #[must_use]
    pub fn subject(&self) -> Option<GoalSubject<'_>> {
        match (&self.derivative, self.quantity, &self.class) {
            (Some(name), None, None) => Some(GoalSubject::Derivative(name)),
            (None, Some(quantity), None) => {
                let airframe = self.airframe.unwrap_or(Airframe::Bare);
                Some(GoalSubject::Level(airframe, quantity))
            }
            (None, None, Some(class)) => Some(GoalSubject::Match(class, self.model)),
            _ => None,
        }
    }

    /// Probability from which the goal counts as decided.
    #[must_use]
    pub fn deciding_probability(&self) -> f64 {
        self.decided.unwrap_or(DECIDED)
    }

    /// Mistake in the goal; `None` without one.
    #[must_use]
    pub fn mistake(&self) -> Option<&'static str> {
        let is_positive = |value: f64| value > 0.0 && value.is_finite();
        let is_of_derivative = self.derivative.is_some();
        if self.subject().is_none() {
            Some("a goal has one of `derivative`, `quantity` and `match`")
        } else if self.bound.is_some_and(|bound| !is_positive(bound)) {
            Some("`bound` must be a positive standard deviation")
        } else if !is_of_derivative && self.bound.is_some() {
            Some("`bound` is of a derivative; a level or a match has `decided`, a probability")
        } else if is_of_derivative && self.decided.is_some() {
            Some("`decided` is of a level or a match; a derivative has `bound`")
        } else if self.decided.is_some_and(|p| !(p > 0.5 && p < 1.0)) {
            Some("`decided` must be a probability over 0.5 and below 1")
        } else if self.airframe.is_some() && self.quantity.is_none() {
            Some("`airframe` is of a `quantity`")
        } else if self.model.is_some() && self.class.is_none() {
            Some("`model` is of a `match`")
        } else if !is_positive(self.weight) {
            Some("`weight` must be positive")
        } else if self
            .alpha_deg
            .is_some_and(|(from, to)| from > to || (from - to).is_nan())
        {
            Some("`alpha_deg` must be a lowest and a highest angle of attack")
        } else if self
            .alpha_deg
            .is_some_and(|(from, to)| from < -HIGHEST_ALPHA_DEG || to > HIGHEST_ALPHA_DEG)
        {
            Some("`alpha_deg` must lie between -180 and 180")
        } else {
            None
        }
    }

    /// Angles of attack of the goal: the breakpoints of its table in the range, or the range's ends.
    #[must_use]
    pub fn alphas_deg(&self, breakpoints_deg: &[f64], reach_deg: (f64, f64)) -> Vec<f64> {
        let (from, to) = self.alpha_deg.unwrap_or(reach_deg);
        let inside = breakpoints_deg.iter().copied();
        let inside: Vec<f64> = inside.filter(|a| (from..=to).contains(a)).collect();
        if !inside.is_empty() {
            inside
        } else if from < to {
            vec![from, to]
        } else {
            vec![from]
        }
    }
}
