//! Goals: derivatives with the bound that is wanted of them, as written in YAML.

use serde::{Deserialize, Serialize};

/// A file of goals.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goals {
    pub goals: Vec<Goal>,
}

/// A derivative over a range of angles of attack. Default: over all that the cards reach.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goal {
    /// Derivative or sum of the posterior.
    pub derivative: String,
    /// Lowest and highest angle of attack.
    #[serde(default)]
    pub alpha_deg: Option<(f64, f64)>,
    /// Wanted standard deviation, in the derivative's unit; without it each reduction counts.
    #[serde(default)]
    pub bound: Option<f64>,
    /// Weight beside other goals.
    #[serde(default = "one")]
    pub weight: f64,
}

fn one() -> f64 {
    1.0
}

impl Goal {
    /// Goal without a wanted bound.
    #[must_use]
    pub fn of(derivative: &str) -> Goal {
        Goal {
            derivative: derivative.to_owned(),
            alpha_deg: None,
            bound: None,
            weight: one(),
        }
    }

    /// Mistake in the goal; `None` without one.
    #[must_use]
    pub fn mistake(&self) -> Option<&'static str> {
        let is_positive = |value: f64| value > 0.0 && value.is_finite();
        if self.bound.is_some_and(|bound| !is_positive(bound)) {
            Some("`bound` must be a positive standard deviation")
        } else if !is_positive(self.weight) {
            Some("`weight` must be positive")
        } else if self
            .alpha_deg
            .is_some_and(|(from, to)| from > to || (from - to).is_nan())
        {
            Some("`alpha_deg` must be a lowest and a highest angle of attack")
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
