//! Joint changes of units: the cost of an assignment with any set of its quantities in other units.
//!
//! Kinematics of small angles are linear: attitudes and rates in degrees obey them as well as in radians,
//! if all that are linked change together. Such a set may contain any number of quantities, so all combinations of units are
//! tried. The misfit of an equation is computed once for each combination of its own quantities.

use std::collections::BTreeMap;

use super::assignment::{Assignment, Choice, Search};
use super::equations::Equation;
use crate::inspection::quantity::Quantity;

/// A combination of units: for each quantity the place of its unit, 0 for the assigned one.
type Combination = Vec<usize>;

/// Physical costs of an assignment in all combinations of units.
struct UnitCosts {
    /// Quantities whose columns may have several units.
    quantities: Vec<Quantity>,
    /// Number of units of each quantity.
    units: Vec<usize>,
    equations: Vec<EquationCosts>,
}

/// Costs of one equation.
struct EquationCosts {
    /// Places of its quantities among those with several units.
    members: Vec<usize>,
    /// Logarithm of the misfit in each combination of the members' units.
    costs: Vec<f64>,
}

/// For each quantity, the smallest set of quantities with this one that fits nearly as well in other units.
/// The cost of such a set grows by less than `least_growth` against the best fit with the quantity's unit.
#[must_use]
pub fn rescalings(
    search: &Search,
    assignment: &Assignment,
    least_growth: f64,
) -> BTreeMap<Quantity, Vec<Quantity>> {
    let costs = UnitCosts::of(search, assignment);
    let mut least = vec![f64::INFINITY; costs.quantities.len()];
    for combination in combinations(&costs.units) {
        let cost = costs.cost(&combination);
        for (least, unit) in least.iter_mut().zip(&combination) {
            if *unit == 0 {
                *least = least.min(cost);
            }
        }
    }
    let mut fewest: BTreeMap<Quantity, Vec<Quantity>> = BTreeMap::new();
    for combination in combinations(&costs.units) {
        let cost = costs.cost(&combination);
        let changed = costs.changed(&combination);
        for (quantity, least) in costs.quantities.iter().zip(&least) {
            let is_rival = changed.contains(quantity) && cost < least + least_growth;
            let is_fewest = |known: &Vec<Quantity>| known.len() <= changed.len();
            if is_rival && !fewest.get(quantity).is_some_and(is_fewest) {
                fewest.insert(*quantity, changed.clone());
            }
        }
    }
    fewest
}

impl UnitCosts {
    fn of(search: &Search, assignment: &Assignment) -> UnitCosts {
        let several = assignment.iter().filter_map(|(quantity, own)| {
            let others = search.alternatives(*quantity, assignment).into_iter();
            #[expect(clippy::float_cmp, reason = "signs are 1 or -1")]
            let rescaled = others.filter(|choice| choice.sign == own.sign);
            let choices: Vec<Choice> = std::iter::once(own.clone()).chain(rescaled).collect();
            (choices.len() > 1).then_some((*quantity, choices))
        });
        let several: Vec<(Quantity, Vec<Choice>)> = several.collect();
        let equations = Equation::ALL.into_iter();
        let equations = equations.filter_map(|e| equation_costs(search, assignment, &several, e));
        UnitCosts {
            equations: equations.collect(),
            units: several.iter().map(|(_, choices)| choices.len()).collect(),
            quantities: several.into_iter().map(|(quantity, _)| quantity).collect(),
        }
    }

    /// Quantities in another unit than the assigned one.
    fn changed(&self, combination: &[usize]) -> Vec<Quantity> {
        let units = self.quantities.iter().zip(combination);
        units
            .filter(|(_, unit)| **unit != 0)
            .map(|(quantity, _)| *quantity)
            .collect()
    }

    fn cost(&self, combination: &[usize]) -> f64 {
        let own = |equation: &EquationCosts| {
            let digits = equation.members.iter();
            let place = digits.fold(0, |place, m| place * self.units[*m] + combination[*m]);
            equation.costs[place]
        };
        self.equations.iter().map(own).sum()
    }
}

/// Costs of an equation; `None` for one that lacks a quantity.
fn equation_costs(
    search: &Search,
    assignment: &Assignment,
    several: &[(Quantity, Vec<Choice>)],
    equation: Equation,
) -> Option<EquationCosts> {
    let places = several.iter().enumerate();
    let members: Vec<usize> = places
        .filter(|(_, (quantity, _))| equation.contains(*quantity))
        .map(|(place, _)| place)
        .collect();
    let units: Vec<usize> = members.iter().map(|m| several[*m].1.len()).collect();
    let cost = |combination: Combination| {
        let mut trial = assignment.clone();
        for (member, unit) in members.iter().zip(combination) {
            let (quantity, choices) = &several[*member];
            trial.insert(*quantity, choices[unit].clone());
        }
        Some(search.misfit(equation, &trial)?.ratio.ln())
    };
    let costs: Option<Vec<f64>> = combinations(&units).map(cost).collect();
    Some(EquationCosts {
        costs: costs?,
        members,
    })
}

/// All combinations of places below some numbers, the last place first to change. They are made one by one: a
/// recording without units has hundreds of thousands.
fn combinations(numbers: &[usize]) -> impl Iterator<Item = Combination> {
    let count: usize = numbers.iter().product();
    (0..count).map(|index| {
        let mut rest = index;
        let mut places: Combination = numbers
            .iter()
            .rev()
            .map(|number| {
                let place = rest % number;
                rest /= number;
                place
            })
            .collect();
        places.reverse();
        places
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inspection::test_flight::{Recorded, TestFlight, assigned, searched};

    #[test]
    fn combinations_are_those_of_an_odometer() {
        let all: Vec<Combination> = combinations(&[2, 3]).collect();
        assert_eq!(all, [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2]]);
        assert_eq!(combinations(&[]).collect::<Vec<_>>(), [Combination::new()]);
    }

    #[test]
    fn small_lateral_angles_and_rates_may_all_be_in_the_other_unit() {
        use Quantity::{P, Phi, Psi, Q, R, Theta};
        let lateral = [
            ("theta_deg", Theta, "deg"),
            ("phi", Phi, "rad"),
            ("p", P, "rad/s"),
            ("psi", Psi, "rad"),
            ("r", R, "rad/s"),
        ];
        let rivals = |bank: f64, columns: &[Recorded]| {
            let flight = TestFlight {
                bank,
                pitch: 0.5,
                ..TestFlight::default()
            };
            let (grid, candidates) = searched(&flight.recording(columns));
            let search = Search {
                grid: &grid,
                candidates: &candidates,
            };
            let least_growth = 0.4;
            rescalings(&search, &assigned(columns), least_growth)
        };
        // All four are linked: the yaw rate is part of the roll equation.
        let linked = rivals(0.03, &lateral);
        for quantity in [P, R, Phi, Psi] {
            assert_eq!(linked.get(&quantity), Some(&vec![P, R, Phi, Psi]));
        }
        // Large angles are not linear.
        let with_pitch = [&lateral[..], &[("q_dps", Q, "deg/s")]].concat();
        assert_eq!(rivals(0.6, &with_pitch), BTreeMap::new());
    }
}
