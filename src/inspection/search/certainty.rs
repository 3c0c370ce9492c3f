//! Certainty of an assignment: whether the recording allows another one as well.

use std::collections::BTreeMap;

use super::assignment::{Assignment, HOLDS, Search, with};
use super::descent::SearchResult;
use super::equations::Equation;
use super::rescaling::rescalings;
use super::signs::{Reversal, SignCosts};
use crate::inspection::quantity::Quantity;

/// Misfit above which an equation contradicts all of its columns: one of them is wrong. The columns that it
/// requires are not sure at a misfit above [`HOLDS`].
const CONTRADICTS: f64 = 0.3;
/// Misfit above which a column without a telling name is not sure: 5 % of the terms. A leading-edge flap that follows a
/// schedule of the angle of attack has 9 %, the vane itself 1 to 4 %.
const NAMELESS_HOLDS: f64 = 0.002_5;
/// Least cost of every other unit and sign, relative to the chosen ones: the logarithm of the
/// misfits' common growth.
const LEAST_MARGIN: f64 = 0.4;

/// Smallest rise of the cost when several linked quantities change unit together. Small-angle
/// kinematics separate such cases weakly, and a missing channel's terms are of the same size.
/// Without q, wrong units of five lateral channels have fitted better by 0.9.
const LEAST_JOINT_MARGIN: f64 = 1.5;
/// Excess of usual over reversed signs that is required among the lateral quantities, since no
/// equation determines their common sign.
const MAJORITY: usize = 2;

/// Certainty of one quantity's column, unit and sign.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    pub is_sure: bool,
    /// Cost of the best alternative, relative to the choice: the logarithm of the growth of the
    /// misfits.
    pub margin: f64,
    /// Reason, for the analyst.
    pub evidence: String,
}

/// Certainty of each quantity that has a column.
#[must_use]
pub fn verdicts(search: &Search, found: &SearchResult) -> BTreeMap<Quantity, Verdict> {
    let assignment = &found.assignment;
    let examination = Examination {
        search,
        assignment,
        signs: search.signs(assignment),
        rescalings: rescalings(search, assignment, LEAST_JOINT_MARGIN),
    };
    let quantities = assignment.keys();
    let mut verdicts: BTreeMap<Quantity, Verdict> = quantities
        .map(|quantity| (*quantity, examination.verdict(*quantity)))
        .collect();
    for quantity in &found.proposed {
        if let Some(verdict) = verdicts.get_mut(quantity) {
            verdict.is_sure = false;
            verdict.evidence += "; but other columns without telling names fit nearly as well";
        }
    }
    while let Some(quantity) = examination.unsupported(&verdicts) {
        if let Some(verdict) = verdicts.get_mut(&quantity) {
            verdict.is_sure = false;
            verdict.evidence += "; but a column of that equation is itself not sure";
        }
    }
    verdicts
}

/// An assignment with its rivals.
struct Examination<'a> {
    search: &'a Search<'a>,
    assignment: &'a Assignment,
    /// Costs of all reversals of signs.
    signs: SignCosts,
    /// For each quantity, the smallest set that fits nearly as well in other units.
    rescalings: BTreeMap<Quantity, Vec<Quantity>>,
}

impl Examination<'_> {
    fn verdict(&self, quantity: Quantity) -> Verdict {
        let (search, assignment) = (self.search, self.assignment);
        let unsure = |evidence: String| Verdict {
            is_sure: false,
            margin: 0.0,
            evidence,
        };
        let Some((equation, ratio)) = best_equation(search, assignment, quantity) else {
            return unsure(
                "by its name; no equation of motion relates it to the other recorded quantities"
                    .to_owned(),
            );
        };
        let held = format!("{} holds to {:.1} %", equation.name(), 100.0 * ratio.sqrt());
        if ratio > HOLDS {
            return unsure(format!("{held} only"));
        }
        if ratio > NAMELESS_HOLDS && !search.is_named(quantity, assignment) {
            return unsure(format!("{held} only, and its name means nothing"));
        }
        if let Some(other) = contradiction(search, assignment, quantity) {
            return unsure(format!("{held}; but {} does not", other.name()));
        }
        let margin = margin(search, assignment, quantity);
        let objection = self.objection(quantity, margin);
        Verdict {
            is_sure: objection.is_none(),
            margin,
            evidence: objection.map_or_else(|| held.clone(), |o| format!("{held}; but {o}")),
        }
    }

    /// Reason for which a quantity is not sure although its equations hold.
    fn objection(&self, quantity: Quantity, margin: f64) -> Option<String> {
        let (search, assignment) = (self.search, self.assignment);
        let listed = |quantities: &[Quantity]| {
            let names: Vec<&str> = quantities.iter().map(|q| q.signal()).collect();
            names.join(", ")
        };
        if Quantity::LATERAL.contains(&quantity) && !has_usual_side(assignment) {
            return Some("as many lateral signs would be usual in the mirror image".to_owned());
        }
        if margin < LEAST_MARGIN {
            return Some("another unit or sign fits nearly as well".to_owned());
        }
        if let Some(rival) = rival(&self.signs, quantity) {
            return Some(format!(
                "{} reversed together fit nearly as well",
                listed(&rival)
            ));
        }
        if let Some(rival) = self.rescalings.get(&quantity) {
            return Some(format!(
                "{} in other units fit nearly as well",
                listed(rival)
            ));
        }
        if Quantity::LATERAL.contains(&quantity) {
            // They vary about zero, so that the margin has compared their reflection.
            return None;
        }
        let information = search.information(assignment, quantity);
        (information < LEAST_MARGIN)
            .then(|| "noise or a constant in its place would fit as well".to_owned())
    }

    /// A quantity that counts as sure although each of its equations rests on a column that neither a name nor
    /// other equations confirm.
    fn unsupported(&self, verdicts: &BTreeMap<Quantity, Verdict>) -> Option<Quantity> {
        let holding = |quantity: Quantity| {
            let equations = own_equations(self.search, self.assignment, quantity).into_iter();
            let holding = equations.filter(|(_, ratio)| *ratio <= HOLDS);
            holding.map(|(equation, _)| equation)
        };
        let is_supported = |quantity: Quantity| {
            let is_named = self.search.is_named(quantity, self.assignment);
            holding(quantity).any(|equation| {
                // Such an equation may hold for two wrong columns whose names mean nothing. Pairs of an attitude and its
                // rate are compared with all others before they are assigned.
                let confirms_both = is_named || equation.is_of_attitude();
                let (needed, _) = equation.quantities();
                let mut others = needed.iter().filter(|q| **q != quantity);
                others.all(|other| {
                    let is_sure = verdicts.get(other).is_some_and(|v| v.is_sure);
                    let has_another = || holding(*other).any(|another| another != equation);
                    self.search.is_named(*other, self.assignment)
                        || is_sure && (confirms_both || has_another())
                })
            })
        };
        let mut sure = verdicts.iter().filter(|(_, verdict)| verdict.is_sure);
        sure.find(|(quantity, _)| !is_supported(**quantity))
            .map(|(quantity, _)| *quantity)
    }
}

/// The smallest set of quantities, this one included, that fits nearly as well with all of them
/// reversed. Of a set and its mirror image, in which the other lateral quantities are reversed, the
/// one with fewer lateral quantities is returned.
fn rival(signs: &SignCosts, quantity: Quantity) -> Option<Vec<Quantity>> {
    let mirror = signs.mirror_image();
    let is_smaller = |reversal: &Reversal| {
        2 * (reversal & mirror).count_ones() <= mirror.count_ones() && *reversal != mirror
    };
    let rivals = signs.reversals().filter(is_smaller);
    let rivals = rivals.filter(|r| signs.reversed(*r).any(|q| q == quantity));
    let fitting = rivals.filter(|reversal| signs.growth(*reversal) < LEAST_MARGIN);
    let fewest = fitting.min_by_key(|reversal| reversal.count_ones())?;
    Some(signs.reversed(fewest).collect())
}

/// Equation with the quantity that contradicts what is recorded.
fn contradiction(search: &Search, assignment: &Assignment, quantity: Quantity) -> Option<Equation> {
    let mut equations = Equation::ALL.into_iter().filter(|e| e.contains(quantity));
    equations.find(|e| {
        let is_required = e.quantities().0.contains(&quantity);
        let most = if is_required { HOLDS } else { CONTRADICTS };
        let misfit = search.misfit(*e, assignment);
        misfit.is_some_and(|misfit| misfit.ratio > most)
    })
}

/// Equation that holds best among those of a quantity.
fn best_equation(
    search: &Search,
    assignment: &Assignment,
    quantity: Quantity,
) -> Option<(Equation, f64)> {
    let own = own_equations(search, assignment, quantity).into_iter();
    own.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Equations that require a quantity, with their misfits; if there are none, those that contain it.
fn own_equations(
    search: &Search,
    assignment: &Assignment,
    quantity: Quantity,
) -> Vec<(Equation, f64)> {
    let of = |is_own: fn(Equation, Quantity) -> bool| -> Vec<(Equation, f64)> {
        let equations = Equation::ALL.into_iter().filter(|e| is_own(*e, quantity));
        equations
            .filter_map(|e| Some((e, search.misfit(e, assignment)?.ratio)))
            .collect()
    };
    let required = of(|equation, quantity| equation.quantities().0.contains(&quantity));
    if required.is_empty() {
        of(Equation::contains)
    } else {
        required
    }
}

/// Least growth of the physical cost over all other units and signs of a quantity, alone or together
/// with those of another quantity.
fn margin(search: &Search, assignment: &Assignment, quantity: Quantity) -> f64 {
    let own = search.physical_cost(assignment, &[quantity]);
    let single = search
        .alternatives(quantity, assignment)
        .into_iter()
        .map(|choice| {
            let trial = with(assignment, [(quantity, choice)]);
            search.physical_cost(&trial, &[quantity]) - own
        });
    let least = single.fold(f64::INFINITY, f64::min);
    if least < LEAST_MARGIN {
        return least;
    }
    let others = Quantity::ALL.into_iter().filter(|other| *other != quantity);
    let pairs = others.map(|other| {
        let pair = [quantity, other];
        let before = search.physical_cost(assignment, &pair);
        let trials = search.pair_trials(pair, assignment).into_iter();
        let growths = trials
            .filter(|trial| !is_mirror_image(trial, assignment))
            .map(|trial| search.physical_cost(&trial, &pair) - before);
        growths.fold(f64::INFINITY, f64::min)
    });
    pairs.fold(least, f64::min)
}

/// `true` if two assignments differ in the signs of all lateral quantities and in nothing else.
fn is_mirror_image(trial: &Assignment, assignment: &Assignment) -> bool {
    trial.iter().all(|(quantity, choice)| {
        let own = assignment.get(quantity);
        let turned = if Quantity::LATERAL.contains(quantity) {
            -1.0
        } else {
            1.0
        };
        own.is_some_and(|own| {
            #[expect(clippy::float_cmp, reason = "signs are 1 or -1")]
            let same = choice.sign == turned * own.sign;
            same && own.unit == choice.unit
        })
    })
}

/// `true` if usual signs outnumber reversed ones among the lateral quantities.
fn has_usual_side(assignment: &Assignment) -> bool {
    let signs = || {
        Quantity::LATERAL
            .into_iter()
            .filter_map(|q| assignment.get(&q))
    };
    let reversed = signs().filter(|choice| choice.sign < 0.0).count();
    signs().count() - reversed >= reversed + MAJORITY
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::inspection::recording::Recording;
    use crate::inspection::test_flight::{
        Recorded, TestFlight, assigned, searched, test_column, times,
    };

    const COLUMNS: [Recorded; 12] = [
        ("alpha", Quantity::Alpha, "deg"),
        ("beta", Quantity::Beta, "deg"),
        ("tas", Quantity::Velocity, "ft/s"),
        ("altitude", Quantity::Altitude, "ft"),
        ("p", Quantity::P, "deg/s"),
        ("q", Quantity::Q, "deg/s"),
        ("r", Quantity::R, "deg/s"),
        ("theta", Quantity::Theta, "deg"),
        ("phi", Quantity::Phi, "deg"),
        ("nz", Quantity::An, "g"),
        ("ax", Quantity::Ax, "g"),
        ("ay", Quantity::Ay, "g"),
    ];

    fn verdicts_of(recording: &Recording, columns: &[Recorded]) -> BTreeMap<Quantity, Verdict> {
        let (grid, candidates) = searched(recording);
        let search = Search {
            grid: &grid,
            candidates: &candidates,
        };
        let found = SearchResult {
            assignment: assigned(columns),
            proposed: BTreeSet::new(),
        };
        verdicts(&search, &found)
    }

    /// A recording with other values in a column.
    fn with_values(recording: &Recording, name: &str, values: Vec<f64>) -> Recording {
        let mut changed = recording.clone();
        changed.columns.retain(|column| column.name != name);
        changed.columns.push(test_column(name, values));
        changed
    }

    #[test]
    fn columns_that_obey_the_equations_are_sure() {
        let verdicts = verdicts_of(&TestFlight::default().recording(&COLUMNS), &COLUMNS);
        let unsure: Vec<_> = verdicts.iter().filter(|(_, v)| !v.is_sure).collect();
        assert!(unsure.is_empty(), "{unsure:#?}");
    }

    #[test]
    fn noise_with_the_right_mean_is_not_sure() {
        let flight = TestFlight {
            bank: 0.1,
            pitching: 0.1,
            ..TestFlight::default()
        };
        let recording = flight.recording(&COLUMNS);
        let noise = |t: &f64| 1.0 + 0.1 * (40.0 * t * t).sin();
        let noisy = with_values(&recording, "nz", times().iter().map(noise).collect());
        let verdict = &verdicts_of(&noisy, &COLUMNS)[&Quantity::An];
        assert!(!verdict.is_sure, "{verdict:?}");
        assert!(verdict.evidence.contains("noise"), "{verdict:?}");
    }

    #[test]
    fn no_column_is_sure_by_an_equation_with_an_unnamed_column_that_is_not() {
        let columns = [
            ("altitude", Quantity::Altitude, "ft"),
            ("mach", Quantity::Mach, "-"),
            ("x1", Quantity::Velocity, "ft/s"),
        ];
        let (grid, candidates) = searched(&TestFlight::default().recording(&columns));
        let search = Search {
            grid: &grid,
            candidates: &candidates,
        };
        let assignment = assigned(&columns);
        let examination = Examination {
            search: &search,
            assignment: &assignment,
            signs: search.signs(&assignment),
            rescalings: BTreeMap::new(),
        };
        let unsupported = |velocity_is_sure: bool| {
            let verdict = |quantity: &Quantity| Verdict {
                is_sure: *quantity != Quantity::Velocity || velocity_is_sure,
                margin: 1.0,
                evidence: String::new(),
            };
            let verdicts = assignment.keys().map(|q| (*q, verdict(q))).collect();
            examination.unsupported(&verdicts)
        };
        assert_eq!(unsupported(true), None);
        assert!(unsupported(false).is_some());
    }

    #[test]
    fn an_altitude_that_contradicts_the_climb_is_not_sure() {
        // Feet that the name states as metres: the speed of sound is nearly the same.
        let columns = [
            ("alpha", Quantity::Alpha, "deg"),
            ("tas", Quantity::Velocity, "ft/s"),
            ("mach", Quantity::Mach, "-"),
            ("altitude [m]", Quantity::Altitude, "ft"),
            ("theta", Quantity::Theta, "deg"),
        ];
        let recording = TestFlight {
            bank: 0.0,
            ..TestFlight::default()
        }
        .recording(&columns);
        let stated = columns.map(|column| match column {
            (name, Quantity::Altitude, _) => (name, Quantity::Altitude, "m"),
            column => column,
        });
        let verdict = &verdicts_of(&recording, &stated)[&Quantity::Altitude];
        assert!(!verdict.is_sure, "{verdict:?}");
    }
}
