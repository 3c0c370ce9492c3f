//! Search for the assignment with which the equations of motion hold. Descent changes one quantity at a time, then
//! two; then it reverses sets of signs.

use std::collections::BTreeSet;

use super::assignment::{Assignment, Candidate, Choice, SIGN_COST, Search, turned, variants, with};
use super::equations::Equation;
use super::rotation::lacks_axis;
use super::signs::Reversal;
use crate::inspection::quantity::Quantity;

/// Least gain that counts as an improvement: more than rounding.
const LEAST_GAIN: f64 = 1e-9;
/// Largest misfit at which a column without a telling name is assigned.
const NAMELESS_FIT: f64 = 0.02;
/// Factor by which every other column without a telling name must fit worse.
const NAMELESS_LEAD: f64 = 10.0;
/// Least information in each such column, as the logarithm of a growth of misfits. A constant satisfies an
/// equation between levels, such as that of the dynamic pressure, if its value happens to fit.
const NAMELESS_INFORMATION: f64 = 0.4;
/// Largest number of combinations of such columns that are tried for one equation.
const MOST_TRIALS: usize = 4_000;
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
/// Largest number of rounds of descent.
const ROUNDS: usize = 60;

/// Result of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchResult {
    pub assignment: Assignment,
    /// Quantities with the best of several columns without telling names that fit nearly as well.
    pub proposed: BTreeSet<Quantity>,
}

impl Search<'_> {
    /// Best assignment that descent finds, from the best names with the usual units, and with
    /// angles or rates in the other unit. Columns without a telling name are added afterwards, if
    /// only one of them fits.
    #[must_use]
    pub fn best(&self) -> SearchResult {
        let mut assignment = self.best_start();
        self.descend(&mut assignment, true);
        let proposed = self.seed_rotation(&mut assignment);
        loop {
            self.descend(&mut assignment, true);
            if !self.complete(&mut assignment) {
                return SearchResult {
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
            if missing.is_empty() || lacks_axis(&missing, assignment) {
                continue;
            }
            let trials = self.extended(assignment, &missing, MOST_TRIALS);
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

    /// Assignments with each choice of some more quantities; empty if there are more than `most`.
    pub fn extended(
        &self,
        assignment: &Assignment,
        missing: &[Quantity],
        most: usize,
    ) -> Vec<Assignment> {
        let mut trials = vec![assignment.clone()];
        for quantity in missing {
            let mut extended = Vec::new();
            for trial in &trials {
                for choice in self.choices(*quantity, trial) {
                    extended.push(with(trial, [(*quantity, choice)]));
                }
                if extended.len() > most {
                    return Vec::new();
                }
            }
            trials = extended;
        }
        trials
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
    pub fn in_units(
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inspection::Recording;
    use crate::inspection::test_flight::{TestFlight, searched, test_column, times};

    /// A column and its values over time.
    type Motion = (&'static str, fn(f64) -> f64);

    /// Result of a search over one recording.
    fn search(recording: &Recording) -> SearchResult {
        let (grid, candidates) = searched(recording);
        let search = Search {
            grid: &grid,
            candidates: &candidates,
        };
        search.best()
    }

    fn best(values: &[Motion]) -> Assignment {
        let altitude = ("altitude [ft]", Quantity::Altitude, "ft");
        let mut recording = TestFlight::default().recording(&[altitude]);
        let column =
            |(name, value): &Motion| test_column(name, times().into_iter().map(value).collect());
        recording.columns.extend(values.iter().map(column));
        search(&recording).assignment
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
        let found = found(&columns);
        assert_eq!(found.proposed, BTreeSet::from([P, Q, R, Theta, Phi, Psi]));
        let choice = |quantity: &Quantity| found.assignment[quantity].column.as_str();
        assert_eq!(
            [Theta, Phi, P, Psi, R].each_ref().map(choice),
            ["x1", "x3", "x4", "x5", "x6"]
        );
        assert!(["x2", "x7"].contains(&choice(&Q)));
    }

    /// Columns that a search gives to quantities, from a flight with columns of opaque names.
    fn found(columns: &[(&'static str, Quantity, &'static str)]) -> SearchResult {
        search(&TestFlight::default().recording(columns))
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
    fn a_pitch_attitude_alone_is_proposed_where_gravity_confirms_it() {
        use Quantity::{Alpha, An, Ax, Q, Theta, Velocity};
        let level = TestFlight {
            bank: 0.0,
            ..TestFlight::default()
        };
        let columns = [
            ("x1", Theta, "rad"),
            ("x2", Q, "rad/s"),
            ("x3", Velocity, "m/s"),
            ("x4", Ax, "m/s2"),
            ("x5", Alpha, "rad"),
            ("x6", An, "m/s2"),
        ];
        let found = search(&level.recording(&columns));
        assert_eq!(found.proposed, BTreeSet::from([Theta, Q]));
        for (name, quantity, _) in columns.into_iter().take(2) {
            assert_eq!(found.assignment[&quantity].column, name, "{found:?}");
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
