//! Columns, units and signs of quantities, and the cost of their assignment.
//!
//! The cost of an assignment is the sum of the logarithms of the equations' misfits; names, stated units
//! and usual signs break ties.

use std::collections::BTreeMap;

use super::equations::{Equation, Misfit, Scaled, misfit};
use super::signs::SignCosts;
use crate::inspection::grid::Grid;
use crate::inspection::quantity::Quantity;

/// Cost of a column whose name does not suggest the quantity, relative to one whose name does.
const NAME_COST: f64 = 2.0;
/// Cost of an unusual sign: reversed signs are rarer than misleading motion.
pub const SIGN_COST: f64 = 0.2;
/// Cost of each place of a unit in the list of usual ones.
const UNIT_COST: f64 = 0.05;
/// Misfit up to which an equation holds. Wind, lever arms and slow channels leave a few hundredths.
pub const HOLDS: f64 = 0.1;

/// A column that may be a quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    pub column: String,
    /// Weight of its name, 0 to 1.
    pub weight: f64,
    /// Units in which it may be written.
    pub units: Vec<&'static str>,
    /// Signs that it may have, 1 or -1, the usual one first.
    pub signs: Vec<f64>,
}

/// Column, unit and sign of a quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    pub column: String,
    pub unit: &'static str,
    pub sign: f64,
}

/// Column, unit and sign of each quantity that has one.
pub type Assignment = BTreeMap<Quantity, Choice>;

/// Candidates of each quantity.
pub type Candidates = BTreeMap<Quantity, Vec<Candidate>>;

/// Search over one grid.
#[derive(Clone, Copy, Debug)]
pub struct Search<'a> {
    pub grid: &'a Grid,
    pub candidates: &'a Candidates,
}

impl Search<'_> {
    /// Misfit of an equation.
    #[must_use]
    pub fn misfit(&self, equation: Equation, assignment: &Assignment) -> Option<Misfit> {
        self.misfit_of(equation, assignment, |_| None)
    }

    /// Misfit of an equation with other values in place of the columns of some quantities.
    fn misfit_of<'a>(
        &'a self,
        equation: Equation,
        assignment: &Assignment,
        replaced: impl Fn(Quantity) -> Option<&'a [f64]>,
    ) -> Option<Misfit> {
        misfit(
            equation,
            &self.grid.stretches,
            self.grid.step_s,
            |quantity| {
                let choice = assignment.get(&quantity)?;
                let recorded = || self.grid.columns.get(&choice.column).map(Vec::as_slice);
                Some(Scaled {
                    values: replaced(quantity).or_else(recorded)?,
                    factor: choice.sign * quantity.factor(choice.unit)?,
                })
            },
        )
    }

    /// Growth of the physical cost when the values of a quantity are reflected about their mean. Motion that the
    /// equations confirm would fit worse; noise and constants fit as well. 0 without a column.
    #[must_use]
    pub fn information(&self, assignment: &Assignment, quantity: Quantity) -> f64 {
        let own = assignment.get(&quantity);
        let Some(values) = own.and_then(|choice| self.grid.columns.get(&choice.column)) else {
            return 0.0;
        };
        let reflected = reflected_about_mean(values);
        let growth = |equation: Equation| {
            let own = self.misfit(equation, assignment)?.ratio;
            let replaced = |q: Quantity| (q == quantity).then_some(&reflected[..]);
            let other = self.misfit_of(equation, assignment, replaced)?.ratio;
            Some((other / own).ln())
        };
        let equations = Equation::ALL.into_iter();
        let equations = equations.filter(|e| e.contains(quantity));
        equations.filter_map(growth).sum()
    }

    /// `true` if the name of a quantity's column suggests the quantity.
    #[must_use]
    pub fn is_named(&self, quantity: Quantity, assignment: &Assignment) -> bool {
        let own = assignment.get(&quantity);
        let candidates = self.candidates.get(&quantity).into_iter().flatten();
        let mut named = candidates.filter(|candidate| candidate.weight > 0.0);
        own.is_some_and(|own| named.any(|candidate| candidate.column == own.column))
    }

    /// Sum of the logarithms of the misfits of the equations that contain one of some quantities.
    #[must_use]
    pub fn physical_cost(&self, assignment: &Assignment, changed: &[Quantity]) -> f64 {
        let contains = |e: &Equation| changed.iter().any(|q| e.contains(*q));
        let equations = Equation::ALL.into_iter().filter(contains);
        equations
            .filter_map(|e| Some(self.misfit(e, assignment)?.ratio.ln()))
            .sum()
    }

    /// `true` if every equation holds whose quantities are all assigned.
    pub fn all_hold(&self, assignment: &Assignment) -> bool {
        let mut misfits = Equation::ALL
            .into_iter()
            .filter_map(|e| self.misfit(e, assignment));
        misfits.all(|misfit| misfit.ratio <= HOLDS)
    }

    pub fn cost(&self, assignment: &Assignment, changed: &[Quantity]) -> f64 {
        let own = changed.iter().filter_map(|q| {
            let choice = assignment.get(q)?;
            Some(self.prior_cost(*q, choice))
        });
        self.physical_cost(assignment, changed) + own.sum::<f64>()
    }

    /// Cost of a choice by its name, unit and sign alone.
    fn prior_cost(&self, quantity: Quantity, choice: &Choice) -> f64 {
        let candidates = self
            .candidates
            .get(&quantity)
            .map_or(&[][..], Vec::as_slice);
        let candidate = candidates.iter().find(|c| c.column == choice.column);
        let weight = candidate.map_or(0.0, |c| c.weight);
        let place = candidate.and_then(|c| c.units.iter().position(|u| *u == choice.unit));
        let sign = if choice.sign < 0.0 { SIGN_COST } else { 0.0 };
        -NAME_COST * weight + sign + UNIT_COST * place.unwrap_or(0) as f64
    }

    /// All choices of a quantity whose column no other quantity has.
    pub fn choices(&self, quantity: Quantity, assignment: &Assignment) -> Vec<Choice> {
        let candidates = self
            .candidates
            .get(&quantity)
            .map_or(&[][..], Vec::as_slice);
        let is_free = |candidate: &&Candidate| {
            let mut others = assignment.iter().filter(|(other, _)| **other != quantity);
            !others.any(|(_, choice)| choice.column == candidate.column)
        };
        let candidates = candidates.iter().filter(is_free);
        candidates.flat_map(variants).collect()
    }

    /// Other units and signs of an assigned quantity's column.
    #[must_use]
    pub fn alternatives(&self, quantity: Quantity, assignment: &Assignment) -> Vec<Choice> {
        let Some(own) = assignment.get(&quantity) else {
            return Vec::new();
        };
        let choices = self.choices(quantity, assignment).into_iter();
        choices
            .filter(|choice| choice.column == own.column && choice != own)
            .collect()
    }

    /// Costs of all reversals of the quantities whose columns may have either sign.
    #[must_use]
    pub fn signs(&self, assignment: &Assignment) -> SignCosts {
        let either = assignment
            .iter()
            .filter(|(quantity, choice)| self.has_either_sign(**quantity, choice));
        let either: Vec<Quantity> = either.map(|(quantity, _)| *quantity).collect();
        SignCosts::of(either, |equation, reversed| {
            let trial = turned(assignment, reversed.iter().copied());
            Some(self.misfit(equation, &trial)?.ratio.ln())
        })
    }

    /// `true` if the range of a quantity's column allows both signs.
    fn has_either_sign(&self, quantity: Quantity, choice: &Choice) -> bool {
        let candidates = self.candidates.get(&quantity).into_iter().flatten();
        let mut own = candidates.filter(|c| c.column == choice.column);
        own.any(|candidate| candidate.signs.len() > 1)
    }

    /// Assignments in which unit or sign of two quantities that share an equation are others.
    #[must_use]
    pub fn pair_trials(&self, pair: [Quantity; 2], assignment: &Assignment) -> Vec<Assignment> {
        let shared = |e: &Equation| pair.iter().all(|q| e.contains(*q));
        if !Equation::ALL.iter().any(shared) {
            return Vec::new();
        }
        let [a, b] = pair.map(|q| self.alternatives(q, assignment));
        let both = a.iter().flat_map(|x| b.iter().map(move |y| (x, y)));
        both.map(|(x, y)| with(assignment, [(pair[0], x.clone()), (pair[1], y.clone())]))
            .collect()
    }
}

/// The assignment with the signs of some quantities reversed.
pub fn turned(assignment: &Assignment, reversed: impl Iterator<Item = Quantity>) -> Assignment {
    let mut trial = assignment.clone();
    for quantity in reversed {
        if let Some(choice) = trial.get_mut(&quantity) {
            choice.sign = -choice.sign;
        }
    }
    trial
}

/// A series reflected about its mean.
fn reflected_about_mean(values: &[f64]) -> Vec<f64> {
    let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let mean = finite.iter().sum::<f64>() / finite.len() as f64;
    values.iter().map(|value| 2.0 * mean - value).collect()
}

/// A candidate's column in all of its units and signs.
pub fn variants(candidate: &Candidate) -> Vec<Choice> {
    let choice = |(unit, sign): (&&'static str, &f64)| Choice {
        column: candidate.column.clone(),
        unit,
        sign: *sign,
    };
    let units = candidate.units.iter();
    units
        .flat_map(|unit| candidate.signs.iter().map(move |sign| (unit, sign)))
        .map(choice)
        .collect()
}

/// The assignment with other choices of some quantities.
#[must_use]
pub fn with<const N: usize>(
    assignment: &Assignment,
    changes: [(Quantity, Choice); N],
) -> Assignment {
    let mut trial = assignment.clone();
    trial.extend(changes);
    trial
}
