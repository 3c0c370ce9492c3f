//! Search for the columns, units and signs with which the equations of motion hold.
//!
//! The cost of an assignment is the sum of the logarithms of the equations' misfits; names, stated units
//! and usual signs break ties. Descent changes one quantity at a time, then two.

use std::collections::{BTreeMap, BTreeSet};

use super::equations::{Equation, Misfit, Scaled, misfit};
use super::grid::Grid;
use super::quantity::Quantity;
use super::signs::{Reversal, SignCosts};

/// Cost of a column whose name does not suggest the quantity, relative to one whose name does.
const NAME_COST: f64 = 2.0;
/// Cost of an unusual sign: reversed signs are rarer than misleading motion.
const SIGN_COST: f64 = 0.2;
/// Cost of each place of a unit in the list of usual ones.
const UNIT_COST: f64 = 0.05;
/// Least gain that counts as an improvement: more than rounding.
const LEAST_GAIN: f64 = 1e-9;
/// Misfit up to which an equation holds. Wind, lever arms and slow channels leave a few hundredths.
pub const HOLDS: f64 = 0.1;
/// Largest misfit at which a column without a telling name is assigned.
const NAMELESS_FIT: f64 = 0.02;
/// Factor by which every other column without a telling name must fit worse.
const NAMELESS_LEAD: f64 = 10.0;
/// Least information in each such column, as the logarithm of a growth of misfits. A constant satisfies an
/// equation between levels, such as that of the dynamic pressure, if its value happens to fit.
const NAMELESS_INFORMATION: f64 = 0.4;
/// Largest number of combinations of such columns that are tried for one equation.
const MOST_TRIALS: usize = 4_000;
/// Largest misfit at which a column counts as the integral of another; it is large because bank
/// couples the attitudes.
const INTEGRAL_FIT: f64 = 0.3;
/// Largest number of such pairs.
const MOST_INTEGRALS: usize = 5;
/// Cost by which every other order of attitudes and rates must be worse than the best.
const ROTATION_LEAD: f64 = 2.0;
/// Units from which descent starts in place of the most usual ones: the cost has local minima with
/// all angles in the wrong unit.
const STARTS: [&[&str]; 4] = [&[], &["rad"], &["rad/s"], &["rad", "rad/s"]];
/// Units that all angles or rates of a recorder may have together.
const KINDS: [&[&str]; 6] = [
    &["deg"],
    &["rad"],
    &["deg/s"],
    &["rad/s"],
    &["deg", "deg/s"],
    &["rad", "rad/s"],
];
/// Attitudes with their rates.
const AXES: [(Quantity, Quantity); 3] = [
    (Quantity::Theta, Quantity::Q),
    (Quantity::Phi, Quantity::P),
    (Quantity::Psi, Quantity::R),
];
/// Largest number of rounds of descent.
const ROUNDS: usize = 60;

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

/// Result of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    pub assignment: Assignment,
    /// Quantities with the best of several columns without telling names that fit nearly as well.
    pub proposed: BTreeSet<Quantity>,
}

/// Search over one grid.
#[derive(Clone, Copy, Debug)]
pub struct Search<'a> {
    pub grid: &'a Grid,
    pub candidates: &'a Candidates,
}

impl Search<'_> {
    /// Best assignment that descent finds, from the best names with the usual units, and with
    /// angles or rates in the other unit. Columns without a telling name are added afterwards, if
    /// only one of them fits.
    #[must_use]
    pub fn best(&self) -> Found {
        let mut assignment = self.best_start();
        self.descend(&mut assignment, true);
        let proposed = self.seed_rotation(&mut assignment);
        loop {
            self.descend(&mut assignment, true);
            if !self.complete(&mut assignment) {
                return Found {
                    assignment,
                    proposed,
                };
            }
        }
    }

    /// Best assignment of the descents from all starts. Reversing several signs at once, which
    /// takes longest, is left out.
    fn best_start(&self) -> Assignment {
        let starts = STARTS.iter().map(|units| self.by_name(units));
        let mut starts: Vec<Assignment> = starts.collect();
        starts.dedup();
        let mut best: Option<(f64, Assignment)> = None;
        for mut assignment in starts {
            self.descend(&mut assignment, false);
            let cost = self.cost(&assignment, &Quantity::ALL);
            let is_done = self.all_hold(&assignment);
            if best.as_ref().is_none_or(|best| cost < best.0) {
                best = Some((cost, assignment));
            }
            if is_done {
                break;
            }
        }
        best.map(|best| best.1).unwrap_or_default()
    }

    fn descend(&self, assignment: &mut Assignment, turns_signs: bool) {
        for _ in 0..ROUNDS {
            let changed = self.improve_units(assignment)
                || self.improve_single(assignment)
                || self.improve_pairs(assignment)
                || self.improve_axes(assignment)
                || (turns_signs && self.improve_signs(assignment));
            if !changed {
                break;
            }
        }
    }

    /// Adds columns without a telling name that make an equation hold, if no others do; `true` if
    /// any were added.
    fn complete(&self, assignment: &mut Assignment) -> bool {
        for equation in Equation::ALL {
            let needed = equation.quantities().0.iter().copied();
            let missing: Vec<Quantity> = needed.filter(|q| !assignment.contains_key(q)).collect();
            let mut trials = vec![assignment.clone()];
            for quantity in &missing {
                trials = self.extended(&trials, *quantity);
            }
            if missing.is_empty() || trials.is_empty() || lacks_axis(&missing, assignment) {
                continue;
            }
            let fit = |trial: Assignment| Some((self.misfit(equation, &trial)?.ratio, trial));
            let mut fits: Vec<(f64, Assignment)> = trials.into_iter().filter_map(fit).collect();
            fits.sort_by(|a, b| a.0.total_cmp(&b.0));
            let Some((ratio, best)) = fits.first() else {
                continue;
            };
            let differs = |trial: &Assignment| {
                missing
                    .iter()
                    .any(|q| trial.get(q).map(|c| &c.column) != best.get(q).map(|c| &c.column))
            };
            let next = fits.iter().find(|(_, trial)| differs(trial));
            let next = next.map_or(f64::INFINITY, |next| next.0);
            let informs = |q: &Quantity| self.information(best, *q) > NAMELESS_INFORMATION;
            if *ratio < NAMELESS_FIT && next > NAMELESS_LEAD * ratio && missing.iter().all(informs)
            {
                *assignment = best.clone();
                return true;
            }
        }
        false
    }

    /// Assignments with each choice of one more quantity; empty if there are too many.
    fn extended(&self, assignments: &[Assignment], quantity: Quantity) -> Vec<Assignment> {
        let mut extended = Vec::new();
        for assignment in assignments {
            for choice in self.choices(quantity, assignment) {
                extended.push(with(assignment, [(quantity, choice)]));
            }
            if extended.len() > MOST_TRIALS {
                return Vec::new();
            }
        }
        extended
    }

    /// Adds attitudes and rates whose names tell nothing: pairs in which one column is the integral
    /// of the other, in the order in which the equations of all three attitudes hold best. Returns them if
    /// another order or other columns fit nearly as well.
    fn seed_rotation(&self, assignment: &mut Assignment) -> BTreeSet<Quantity> {
        let pairs = AXES;
        let rotation = pairs.iter().flat_map(|(a, b)| [a, b]);
        if rotation.clone().any(|q| assignment.contains_key(q)) {
            return BTreeSet::new();
        }
        let integrals = self.integrals();
        let mut ranked: Vec<(f64, Assignment)> = Vec::new();
        for order in orders(integrals.len()) {
            for signs in 0..8_u32 {
                let mut trial = assignment.clone();
                for (n, ((attitude, rate), member)) in pairs.iter().zip(&order).enumerate() {
                    let sign = if signs >> n & 1 == 1 { -1.0 } else { 1.0 };
                    let (angle, velocity) = &integrals[*member];
                    trial.insert(*attitude, with_sign(angle, sign));
                    trial.insert(*rate, with_sign(velocity, sign));
                }
                if columns(&trial).len() == trial.len() {
                    let changed = [Quantity::Theta, Quantity::Phi, Quantity::Psi];
                    ranked.push((self.physical_cost(&trial, &changed), trial));
                }
            }
        }
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let Some((cost, best)) = ranked.first() else {
            self.seed_without_heading(&integrals, assignment);
            return BTreeSet::new();
        };
        let differs =
            |trial: &Assignment| rotation.clone().any(|q| trial[q].column != best[q].column);
        let next = ranked.iter().find(|(_, trial)| differs(trial));
        let leads = next.is_none_or(|(next, _)| next - cost > ROTATION_LEAD);
        let is_plausible = self.all_hold(best);
        if !leads && !is_plausible {
            self.seed_without_heading(&integrals, assignment);
            return BTreeSet::new();
        }
        assignment.clone_from(best);
        let proposed = rotation.filter(|_| is_plausible && !leads);
        proposed.copied().collect()
    }

    /// Adds pitch and bank with all rates, whose names tell nothing, where no heading is recorded and no other
    /// columns fit nearly as well. Pitch and bank differ only by the terms of the yaw rate.
    fn seed_without_heading(&self, integrals: &[(Choice, Choice)], assignment: &mut Assignment) {
        use Quantity::{P, Phi, Q, R, Theta};
        let orders = (0..integrals.len())
            .flat_map(|a| (0..integrals.len()).map(move |b| [a, b]))
            .filter(|[a, b]| a != b);
        let mut ranked: Vec<(f64, Assignment)> = Vec::new();
        for [first, second] in orders {
            for signs in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
                let (pitch, bank) = (&integrals[first], &integrals[second]);
                let both = [
                    (Theta, with_sign(&pitch.0, signs[0])),
                    (Q, with_sign(&pitch.1, signs[0])),
                    (Phi, with_sign(&bank.0, signs[1])),
                    (P, with_sign(&bank.1, signs[1])),
                ];
                let attitudes = with(assignment, both);
                for yaw in self.choices(R, &attitudes) {
                    let trial = with(&attitudes, [(R, yaw)]);
                    if columns(&trial).len() == trial.len() {
                        ranked.push((self.physical_cost(&trial, &[Theta, Phi]), trial));
                    }
                }
            }
        }
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let rotation = [Theta, Q, Phi, P, R];
        let Some((cost, best)) = ranked.first().filter(|(_, best)| self.all_hold(best)) else {
            return;
        };
        let differs =
            |trial: &Assignment| rotation.iter().any(|q| trial[q].column != best[q].column);
        let next = ranked.iter().find(|(_, trial)| differs(trial));
        if next.is_none_or(|(next, _)| next - cost > ROTATION_LEAD) {
            assignment.clone_from(best);
        }
    }

    /// Pairs of columns of which the first is the integral of the second, the best first.
    fn integrals(&self) -> Vec<(Choice, Choice)> {
        let none = Assignment::new();
        let mut found: Vec<(f64, Choice, Choice)> = Vec::new();
        for rate in self
            .choices(Quantity::Q, &none)
            .into_iter()
            .filter(|c| c.sign > 0.0)
        {
            let trials = self
                .choices(Quantity::Theta, &none)
                .into_iter()
                .chain(self.choices(Quantity::Psi, &none));
            let fits = trials
                .filter(|angle| angle.column != rate.column)
                .filter_map(|angle| {
                    let trial = with(
                        &none,
                        [(Quantity::Psi, angle.clone()), (Quantity::R, rate.clone())],
                    );
                    let ratio = self.misfit(Equation::Heading, &trial)?.ratio;
                    (ratio < INTEGRAL_FIT).then_some((ratio, angle, rate.clone()))
                });
            found.extend(fits.min_by(|a, b| a.0.total_cmp(&b.0)));
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(MOST_INTEGRALS);
        found
            .into_iter()
            .map(|(_, angle, rate)| (angle, rate))
            .collect()
    }

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
        let reflected = about_mean(values);
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
    fn all_hold(&self, assignment: &Assignment) -> bool {
        let mut misfits = Equation::ALL
            .into_iter()
            .filter_map(|e| self.misfit(e, assignment));
        misfits.all(|misfit| misfit.ratio <= HOLDS)
    }

    fn cost(&self, assignment: &Assignment, changed: &[Quantity]) -> f64 {
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

    /// Each quantity by the best name, each column once, in one of some units where that is possible.
    fn by_name(&self, units: &[&str]) -> Assignment {
        let mut all: Vec<(Quantity, &Candidate)> = Vec::new();
        for (quantity, candidates) in self.candidates {
            all.extend(candidates.iter().map(|c| (*quantity, c)));
        }
        all.sort_by(|a, b| b.1.weight.total_cmp(&a.1.weight));
        let mut assignment = Assignment::new();
        for (quantity, candidate) in all.into_iter().filter(|(_, c)| c.weight > 0.0) {
            let is_taken = assignment
                .values()
                .any(|c: &Choice| c.column == candidate.column);
            let preferred = candidate.units.iter().find(|unit| units.contains(unit));
            let unit = preferred.or(candidate.units.first());
            if let Some(unit) = unit.filter(|_| !is_taken) {
                assignment.entry(quantity).or_insert(Choice {
                    column: candidate.column.clone(),
                    unit,
                    sign: candidate.signs.first().copied().unwrap_or(1.0),
                });
            }
        }
        assignment
    }

    /// All choices of a quantity whose column no other quantity has.
    fn choices(&self, quantity: Quantity, assignment: &Assignment) -> Vec<Choice> {
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

    /// Gives each quantity in turn its best choice; `true` if one changed.
    fn improve_single(&self, assignment: &mut Assignment) -> bool {
        let mut changed = false;
        for quantity in Quantity::ALL
            .into_iter()
            .filter(|q| assignment.contains_key(q))
            .collect::<Vec<_>>()
        {
            let before = self.cost(assignment, &[quantity]);
            let trials = self
                .choices(quantity, assignment)
                .into_iter()
                .map(|choice| {
                    let trial = with(assignment, [(quantity, choice.clone())]);
                    (self.cost(&trial, &[quantity]), choice)
                });
            let best = trials.min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, choice)) = best.filter(|(cost, _)| *cost < before - LEAST_GAIN) {
                assignment.insert(quantity, choice);
                changed = true;
            }
        }
        changed
    }

    /// Gives all angles or rates of one axis or of both the same unit; `true` if that improved the
    /// cost. Changing one at a time cannot leave the local minimum in which all are in the wrong
    /// unit.
    fn improve_units(&self, assignment: &mut Assignment) -> bool {
        let before = self.cost(assignment, &Quantity::ALL);
        let trials = KINDS.iter().flat_map(|units| {
            let groups = [(true, true), (true, false), (false, true)];
            groups.map(|group| self.in_units(assignment, units, group))
        });
        let costs = trials.map(|trial| (self.cost(&trial, &Quantity::ALL), trial));
        let best = costs.min_by(|a, b| a.0.total_cmp(&b.0));
        match best.filter(|(cost, _)| *cost < before - LEAST_GAIN) {
            Some((_, trial)) => {
                *assignment = trial;
                true
            }
            None => false,
        }
    }

    /// The assignment with the angles and rates of the longitudinal and the lateral axis in some units, where
    /// their columns may have them.
    fn in_units(
        &self,
        assignment: &Assignment,
        units: &[&str],
        (longitudinal, lateral): (bool, bool),
    ) -> Assignment {
        let mut trial = assignment.clone();
        for (quantity, choice) in &mut trial {
            let is_lateral = Quantity::LATERAL.contains(quantity);
            let is_member = if is_lateral { lateral } else { longitudinal };
            let candidates = self.candidates.get(quantity).into_iter().flatten();
            let own = candidates.filter(|c| c.column == choice.column);
            let mut possible = own.flat_map(|c| c.units.iter().copied());
            if let Some(unit) = possible.find(|unit| is_member && units.contains(unit)) {
                choice.unit = unit;
            }
        }
        trial
    }

    /// Changes unit or sign of two quantities at once; `true` if that improved.
    fn improve_pairs(&self, assignment: &mut Assignment) -> bool {
        for (n, first) in Quantity::ALL.into_iter().enumerate() {
            for second in Quantity::ALL.into_iter().skip(n + 1) {
                let changed = [first, second];
                let before = self.cost(assignment, &changed);
                for trial in self.pair_trials(changed, assignment) {
                    if self.cost(&trial, &changed) < before - LEAST_GAIN {
                        *assignment = trial;
                        return true;
                    }
                }
            }
        }
        false
    }

    /// Exchanges the columns of two quantities of one kind, such as two rates; `true` if that
    /// improved.
    fn improve_axes(&self, assignment: &mut Assignment) -> bool {
        for (first, own) in assignment.clone() {
            let akin = first.akin().iter().filter(|second| **second > first);
            for second in akin.filter(|second| assignment.contains_key(second)) {
                let changed = [first, *second];
                let before = self.cost(assignment, &changed);
                let exchanged = self.exchanged(changed, [&own, &assignment[second]], assignment);
                let costs = exchanged.map(|trial| (self.cost(&trial, &changed), trial));
                let best = costs.min_by(|a, b| a.0.total_cmp(&b.0));
                if let Some((_, trial)) = best.filter(|(cost, _)| *cost < before - LEAST_GAIN) {
                    *assignment = trial;
                    return true;
                }
            }
        }
        false
    }

    /// Assignments in which each of two quantities has the other's column, in all units and signs.
    fn exchanged<'a>(
        &'a self,
        pair: [Quantity; 2],
        [first, second]: [&Choice; 2],
        assignment: &'a Assignment,
    ) -> impl Iterator<Item = Assignment> + 'a {
        let of_column = |quantity: &Quantity, column: &str| -> Vec<Choice> {
            let candidates = self.candidates.get(quantity).into_iter().flatten();
            let own = candidates.filter(|c| c.column == column);
            own.flat_map(variants).collect()
        };
        let a = of_column(&pair[0], &second.column);
        let b = of_column(&pair[1], &first.column);
        a.into_iter().flat_map(move |x| {
            let trials = b.clone().into_iter();
            let of = move |y: Choice| with(assignment, [(pair[0], x.clone()), (pair[1], y)]);
            trials.map(of).collect::<Vec<_>>()
        })
    }

    /// Reverses the set of quantities that lowers the cost most; `true` if one does. Among sets
    /// that fit alike, the one with the fewest unusual signs is best: no equation distinguishes a
    /// flight from its mirror image.
    fn improve_signs(&self, assignment: &mut Assignment) -> bool {
        let signs = self.signs(assignment);
        let unusual = |reversal: Reversal| {
            let turned = signs.reversed(reversal).filter_map(|q| assignment.get(&q));
            turned.map(|choice| choice.sign).sum::<f64>()
        };
        let growth = |reversal: Reversal| signs.growth(reversal) + SIGN_COST * unusual(reversal);
        let costs = signs
            .reversals()
            .map(|reversal| (growth(reversal), reversal));
        let best = costs.min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, reversal)) = best.filter(|(cost, _)| *cost < -LEAST_GAIN) else {
            return false;
        };
        *assignment = turned(assignment, signs.reversed(reversal));
        true
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

/// `true` if an attitude and its rate are missing while those of another axis have no column. A column and
/// its integral may then belong to either axis.
fn lacks_axis(missing: &[Quantity], assignment: &Assignment) -> bool {
    let is_missing = |(attitude, rate): &(Quantity, Quantity)| {
        missing.contains(attitude) && missing.contains(rate)
    };
    let is_open = |(attitude, rate): &(Quantity, Quantity)| {
        !assignment.contains_key(attitude) && !assignment.contains_key(rate)
    };
    AXES.iter().any(is_missing) && AXES.iter().filter(|axis| is_open(axis)).count() > 1
}

/// Columns that an assignment uses.
fn columns(assignment: &Assignment) -> BTreeSet<&String> {
    assignment.values().map(|choice| &choice.column).collect()
}

/// Orders of three members of a list.
fn orders(members: usize) -> Vec<[usize; 3]> {
    let all = (0..members)
        .flat_map(|a| (0..members).flat_map(move |b| (0..members).map(move |c| [a, b, c])));
    all.filter(|[a, b, c]| a != b && b != c && a != c).collect()
}

/// The assignment with the signs of some quantities reversed.
fn turned(assignment: &Assignment, reversed: impl Iterator<Item = Quantity>) -> Assignment {
    let mut trial = assignment.clone();
    for quantity in reversed {
        if let Some(choice) = trial.get_mut(&quantity) {
            choice.sign = -choice.sign;
        }
    }
    trial
}

/// A series reflected about its mean.
fn about_mean(values: &[f64]) -> Vec<f64> {
    let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let mean = finite.iter().sum::<f64>() / finite.len() as f64;
    values.iter().map(|value| 2.0 * mean - value).collect()
}

/// A choice with its sign multiplied.
fn with_sign(choice: &Choice, sign: f64) -> Choice {
    Choice {
        sign: choice.sign * sign,
        ..choice.clone()
    }
}

fn variants(candidate: &Candidate) -> Vec<Choice> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inspection::test_flight::{TestFlight, searched, test_column, times};

    /// A column and its values over time.
    type Motion = (&'static str, fn(f64) -> f64);

    fn best(values: &[Motion]) -> Assignment {
        let altitude = ("altitude [ft]", Quantity::Altitude, "ft");
        let mut recording = TestFlight::default().recording(&[altitude]);
        let column =
            |(name, value): &Motion| test_column(name, times().into_iter().map(value).collect());
        recording.columns.extend(values.iter().map(column));
        let (grid, candidates) = searched(&recording);
        let search = Search {
            grid: &grid,
            candidates: &candidates,
        };
        search.best().assignment
    }

    #[test]
    fn columns_that_hardly_move_are_no_mach_number_and_no_speed() {
        // 480 ft/s have Mach 0.45 at the mean altitude.
        let found = best(&[("x1", |t| 480.0 + 1e-3 * t), ("x2", |t| 0.45 - 1e-6 * t)]);
        let quantities: Vec<&Quantity> = found.keys().collect();
        assert_eq!(quantities, [&Quantity::Altitude]);
    }

    #[test]
    fn a_rotation_without_names_that_two_columns_fit_is_proposed() {
        use Quantity::{P, Phi, Psi, Q, R, Theta};
        let columns = [
            ("x1", Theta, "rad"),
            ("x2", Q, "rad/s"),
            ("x3", Phi, "rad"),
            ("x4", P, "rad/s"),
            ("x5", Psi, "rad"),
            ("x6", R, "rad/s"),
            ("x7", Q, "rad/s"),
        ];
        let (grid, candidates) = searched(&TestFlight::default().recording(&columns));
        let search = Search {
            grid: &grid,
            candidates: &candidates,
        };
        let found = search.best();
        assert_eq!(found.proposed, BTreeSet::from([P, Q, R, Theta, Phi, Psi]));
        let choice = |quantity: &Quantity| found.assignment[quantity].column.as_str();
        assert_eq!(
            [Theta, Phi, P, Psi, R].each_ref().map(choice),
            ["x1", "x3", "x4", "x5", "x6"]
        );
        assert!(["x2", "x7"].contains(&choice(&Q)));
    }

    /// Columns that a search gives to quantities, from a flight with columns of opaque names.
    fn found(columns: &[(&'static str, Quantity, &'static str)]) -> Found {
        let (grid, candidates) = searched(&TestFlight::default().recording(columns));
        let search = Search {
            grid: &grid,
            candidates: &candidates,
        };
        search.best()
    }

    #[test]
    fn one_attitude_and_its_rate_without_names_are_of_no_axis() {
        use Quantity::{P, Phi, Q, Theta};
        for (attitude, rate) in [(Phi, P), (Theta, Q)] {
            let found = found(&[("x1", attitude, "rad"), ("x2", rate, "rad/s")]);
            assert_eq!(found.assignment, Assignment::new(), "{attitude:?}");
        }
    }

    #[test]
    fn without_a_heading_pitch_is_not_confused_with_bank() {
        use Quantity::{P, Phi, Q, R, Theta};
        let columns = [
            ("x1", Phi, "rad"),
            ("x2", P, "rad/s"),
            ("x3", R, "rad/s"),
            ("x4", Theta, "rad"),
            ("x5", Q, "rad/s"),
        ];
        let found = found(&columns);
        for (name, quantity, _) in columns {
            assert_eq!(found.assignment[&quantity].column, name, "{found:?}");
        }
    }
}
