//! Certainty of an assignment: whether the recording allows another one as well.

use super::assignment::{Assignment, HOLDS, Search, with};
use super::equations::Equation;
use super::quantity::Quantity;
use super::signs::{Reversal, SignCosts};

/// Misfit above which an equation contradicts its columns: one of them is wrong.
const CONTRADICTS: f64 = 0.3;
/// Least cost of every other unit and sign, relative to the chosen ones: the logarithm of the
/// misfits' common growth.
const LEAST_MARGIN: f64 = 0.4;
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

/// Certainty of a quantity that has a column; `signs` are the costs of all reversals of the assignment.
#[must_use]
pub fn verdict(
    (search, signs): (&Search, &SignCosts),
    assignment: &Assignment,
    quantity: Quantity,
) -> Verdict {
    let Some((equation, ratio)) = best_equation(search, assignment, quantity) else {
        return Verdict {
            is_sure: false,
            margin: 0.0,
            evidence:
                "by its name; no equation of motion relates it to the other recorded quantities"
                    .to_owned(),
        };
    };
    let held = format!("{} holds to {:.1} %", equation.name(), 100.0 * ratio.sqrt());
    if ratio > HOLDS {
        return Verdict {
            is_sure: false,
            margin: 0.0,
            evidence: format!("{held} only"),
        };
    }
    if let Some(other) = contradiction(search, assignment, quantity) {
        return Verdict {
            is_sure: false,
            margin: 0.0,
            evidence: format!("{held}; but {} does not", other.name()),
        };
    }
    let margin = margin(search, assignment, quantity);
    let rival = rival(signs, quantity);
    let mirrored = Quantity::LATERAL.contains(&quantity) && !has_usual_side(assignment);
    let evidence = if mirrored {
        format!("{held}; but as many lateral signs would be usual in the mirror image")
    } else if margin < LEAST_MARGIN {
        format!("{held}; but another unit or sign fits nearly as well")
    } else if let Some(rival) = &rival {
        let names: Vec<&str> = rival.iter().map(|q| q.signal()).collect();
        format!(
            "{held}; but {} reversed together fit nearly as well",
            names.join(", ")
        )
    } else {
        held
    };
    Verdict {
        is_sure: margin >= LEAST_MARGIN && rival.is_none() && !mirrored,
        margin,
        evidence,
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
        let misfit = search.misfit(*e, assignment);
        misfit.is_some_and(|misfit| misfit.ratio > CONTRADICTS)
    })
}

/// Equation that holds best among those that contain a quantity.
fn best_equation(
    search: &Search,
    assignment: &Assignment,
    quantity: Quantity,
) -> Option<(Equation, f64)> {
    let best = |is_own: fn(Equation, Quantity) -> bool| {
        let equations = Equation::ALL.into_iter().filter(|e| is_own(*e, quantity));
        equations
            .filter_map(|e| Some((e, search.misfit(e, assignment)?.ratio)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
    };
    best(|equation, quantity| equation.quantities().0.contains(&quantity))
        .or_else(|| best(Equation::contains))
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
