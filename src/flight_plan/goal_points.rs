//! Goals at each of their angles of attack.

use std::collections::BTreeMap;

use super::decision::Decision;
use super::goals::{Goal, GoalSubject};
use crate::aero::Condition;
use crate::model::{Model, OutlookPoint, PointQuantity};
use crate::proof_of_match::DecisiveDifference;
use crate::qualities::{self, FlownConditions, judged_quantity};
use crate::tables::{Airframe, FlyingQuality, GoalKind, ModelSource};

/// A goal at one angle of attack.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalPoint {
    pub point: OutlookPoint,
    pub kind: GoalKind,
    /// Derivative, quantity, or class.
    pub name: String,
    /// Airframe of a level, or simulator of a match; empty for a derivative.
    pub of: &'static str,
    /// Maneuver and quantity that decide a match.
    pub decided_by: String,
    pub unit: &'static str,
    /// Share of the goals' weight.
    pub weight: f64,
    pub target: Target,
}

/// Criterion that a goal point is to meet.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// Wanted standard deviation; if it is `None`, every reduction counts.
    Bound(Option<f64>),
    Decision(Decision),
}

impl Target {
    /// Wanted standard deviation, given the one before the flight: zero if every reduction counts,
    /// and the present one if no reduction does.
    #[must_use]
    pub fn wanted(&self, before: f64) -> f64 {
        match self {
            Target::Bound(bound) => bound.unwrap_or(0.0),
            Target::Decision(decision) if decision.is_open(before) => {
                decision.largest_deciding_deviation(before)
            }
            Target::Decision(_) => before,
        }
    }
}

/// Unit of a match.
const TOLERANCE: &str = "tolerance";

/// Matches to be decided, by the index of their goal: the simulator, and what decides each
/// maneuver.
pub type Matches = BTreeMap<usize, (ModelSource, Vec<DecisiveDifference>)>;

/// Sources of goals.
#[derive(Clone, Copy, Debug)]
pub struct GoalBasis<'a> {
    pub model: &'a Model,
    /// Qualities whose levels may be goals, with the flown conditions; `None` without a specification.
    pub qualities: Option<(&'a qualities::JudgedAircraft<'a>, &'a FlownConditions)>,
    pub matches: &'a Matches,
    /// Lowest and highest angle of attack of the cards.
    pub reach_deg: (f64, f64),
}

impl GoalBasis<'_> {
    /// Goals at each of their angles of attack. The weight of a goal is divided among its angles,
    /// so that the worth of a plan is the goals' weighted mean. `condition` returns the flight
    /// condition in which the cards are flown at an angle of attack.
    #[must_use]
    pub fn points(
        &self,
        goals: &[Goal],
        condition: &dyn Fn(f64) -> Option<Condition>,
    ) -> Vec<GoalPoint> {
        let all: f64 = goals.iter().map(|goal| goal.weight).sum();
        let of_goal = |(i, goal): (usize, &Goal)| {
            let mut points = self.points_of(i, goal, condition);
            let weight = goal.weight / all / points.len() as f64;
            for point in &mut points {
                point.weight = weight;
            }
            points
        };
        goals.iter().enumerate().flat_map(of_goal).collect()
    }

    /// A goal, with its place among all, at each of its angles of attack, without weight.
    #[must_use]
    pub fn points_of(
        &self,
        place: usize,
        goal: &Goal,
        condition: &dyn Fn(f64) -> Option<Condition>,
    ) -> Vec<GoalPoint> {
        match goal.subject() {
            Some(GoalSubject::Derivative(name)) => self.derivative(goal, name, condition),
            Some(GoalSubject::Level(airframe, quantity)) => self.levels(goal, airframe, quantity),
            Some(GoalSubject::Match(class, _)) => self.matches(place, goal, class),
            None => vec![],
        }
    }

    fn derivative(
        &self,
        goal: &Goal,
        name: &str,
        condition: &dyn Fn(f64) -> Option<Condition>,
    ) -> Vec<GoalPoint> {
        let Some((unit, breakpoints)) = self.model.breakpoints_deg(name) else {
            return vec![];
        };
        let alphas = goal.alphas_deg(breakpoints, self.reach_deg);
        let points = alphas.into_iter().filter_map(|alpha_deg| {
            Some(GoalPoint {
                point: OutlookPoint {
                    quantity: PointQuantity::Published(name.to_owned()),
                    condition: condition(alpha_deg)?,
                },
                kind: GoalKind::Derivative,
                name: name.to_owned(),
                of: "",
                decided_by: String::new(),
                unit,
                weight: 0.0,
                target: Target::Bound(goal.bound),
            })
        });
        points.collect()
    }

    /// Levels of a quantity at the angles of attack at which flying qualities are judged.
    fn levels(&self, goal: &Goal, airframe: Airframe, quantity: FlyingQuality) -> Vec<GoalPoint> {
        let Some((basis, conditions)) = self.qualities else {
            return vec![];
        };
        let (from, to) = goal.alpha_deg.unwrap_or(self.reach_deg);
        let alphas = qualities::angles_deg(self.model).into_iter();
        let inside = alphas.filter(|alpha| (from..=to).contains(alpha));
        let points = inside.filter_map(|alpha_deg| {
            let own = judged_quantity(basis, conditions, airframe, quantity, alpha_deg)?;
            Some(GoalPoint {
                point: OutlookPoint {
                    quantity: PointQuantity::Combination(own.slopes),
                    condition: own.condition,
                },
                kind: GoalKind::Level,
                name: quantity.name().to_owned(),
                of: airframe.name(),
                decided_by: String::new(),
                unit: quantity.unit(),
                weight: 0.0,
                target: Target::Decision(Decision {
                    mean: own.value,
                    limits: own.limits,
                    fixed_deviation: 0.0,
                    required_probability: goal.deciding_probability(),
                    follows_mean: false,
                }),
            })
        });
        points.collect()
    }

    /// Matches of the maneuvers of a class that were flown within the angles of attack.
    fn matches(&self, place: usize, goal: &Goal, class: &str) -> Vec<GoalPoint> {
        let Some((model, differences)) = self.matches.get(&place) else {
            return vec![];
        };
        let (from, to) = goal.alpha_deg.unwrap_or(self.reach_deg);
        let inside = differences.iter();
        let inside = inside.filter(|own| (from..=to).contains(&own.condition.alpha_deg));
        let point = |own: &DecisiveDifference| GoalPoint {
            point: OutlookPoint {
                quantity: PointQuantity::Combination(own.slopes.clone()),
                condition: own.condition,
            },
            kind: GoalKind::Match,
            name: class.to_owned(),
            of: model.name(),
            decided_by: format!("{} {}", own.maneuver_id, own.quantity),
            unit: TOLERANCE,
            weight: 0.0,
            target: Target::Decision(Decision {
                mean: own.mean,
                limits: vec![-1.0, 1.0],
                fixed_deviation: own.fixed_deviation,
                required_probability: goal.deciding_probability(),
                follows_mean: own.follows_mean,
            }),
        };
        inside.map(point).collect()
    }
}
