//! Attitudes and rates with names outside the vocabulary: an attitude is nearly the integral of its rate.

use std::collections::{BTreeMap, BTreeSet};

use super::assignment::{Assignment, Choice, HOLDS, Search, with};
use super::equations::Equation;
use crate::inspection::quantity::Quantity;

/// Largest misfit at which a column counts as the integral of another; it is large because bank
/// couples the attitudes.
const INTEGRAL_FIT: f64 = 0.3;
/// Largest number of such pairs.
const MOST_INTEGRALS: usize = 5;
/// Cost by which every other order of attitudes and rates must be worse than the best.
const ROTATION_LEAD: f64 = 2.0;
/// Largest number of speeds and axial accelerations that are tried for a pitch attitude: those of 40 columns without
/// units, in a second.
const MOST_AXIAL_TRIALS: usize = 40_000;
/// Attitudes with their rates.
const AXES: [(Quantity, Quantity); 3] = [
    (Quantity::Theta, Quantity::Q),
    (Quantity::Phi, Quantity::P),
    (Quantity::Psi, Quantity::R),
];

impl Search<'_> {
    /// Adds attitudes and rates whose names are not in the vocabulary. It pairs columns of which
    /// one is the integral of the other, in the order in which all three attitude equations fit
    /// best. Returns them if another order or other columns fit nearly as well.
    pub fn seed_rotation(&self, assignment: &mut Assignment) -> BTreeSet<Quantity> {
        let rotation: Vec<Quantity> = AXES.iter().flat_map(|(a, b)| [*a, *b]).collect();
        if rotation.iter().any(|q| assignment.contains_key(q)) {
            return BTreeSet::new();
        }
        let integrals = self.integrals();
        let mut ranked: Vec<(f64, Assignment)> = Vec::new();
        for order in orders(integrals.len()) {
            for signs in 0..8_u32 {
                let mut trial = assignment.clone();
                for (n, ((attitude, rate), member)) in AXES.iter().zip(&order).enumerate() {
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
        let best = best_of(ranked, &rotation);
        if let Some((best, true)) = &best {
            assignment.clone_from(best);
            return BTreeSet::new();
        }
        let proposed = self.seed_without_heading(&integrals, assignment);
        if rotation.iter().any(|q| assignment.contains_key(q)) {
            return proposed;
        }
        let Some((best, _)) = best.filter(|(best, _)| self.all_hold(best)) else {
            return self.seed_pitch(&integrals, assignment);
        };
        *assignment = best;
        rotation.into_iter().collect()
    }

    /// Adds a pitch attitude and its rate, with names outside the vocabulary, where no other axis is found. Gravity in the
    /// axial acceleration distinguishes them from a bank and its rate. Returns both.
    fn seed_pitch(
        &self,
        integrals: &[(Choice, Choice)],
        assignment: &mut Assignment,
    ) -> BTreeSet<Quantity> {
        let pitch = [Quantity::Theta, Quantity::Q];
        let mut ranked: Vec<(f64, Assignment)> = Vec::new();
        for (angle, rate) in integrals {
            for sign in [1.0, -1.0] {
                let both = [
                    (Quantity::Theta, with_sign(angle, sign)),
                    (Quantity::Q, with_sign(rate, sign)),
                ];
                let trial = with(assignment, both);
                ranked.push((self.physical_cost(&trial, &[Quantity::Theta]), trial));
            }
        }
        match best_of(self.with_gravity(ranked), &pitch) {
            Some((best, true)) => {
                *assignment = best;
                pitch.into()
            }
            _ => BTreeSet::new(),
        }
    }

    /// Adds pitch and bank with all rates, with names outside the vocabulary, where no heading is recorded. Pitch and
    /// bank differ only by the terms of the yaw rate. If other columns fit nearly as well, gravity decides: the axial
    /// acceleration contains the sine of the pitch attitude. Returns what only gravity decides.
    fn seed_without_heading(
        &self,
        integrals: &[(Choice, Choice)],
        assignment: &mut Assignment,
    ) -> BTreeSet<Quantity> {
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
        ranked.retain(|(_, trial)| self.all_hold(trial));
        let rotation = [Theta, Q, Phi, P, R];
        match best_of(ranked.clone(), &rotation) {
            Some((best, true)) => *assignment = best,
            Some(_) => {
                let pitch = [Theta, Q];
                if let Some((best, true)) = best_of(self.with_gravity(ranked), &pitch) {
                    *assignment = best;
                    return rotation.into();
                }
            }
            None => {}
        }
        BTreeSet::new()
    }

    /// Assignments of a ranking with the cost of the axial equation, for the speed and acceleration that fit best. It is
    /// computed once for each pitch attitude. Gravity also decides between degrees and radians.
    fn with_gravity(&self, ranked: Vec<(f64, Assignment)>) -> Vec<(f64, Assignment)> {
        let attitudes = [Quantity::Theta, Quantity::Phi];
        let mut costs: BTreeMap<String, Option<f64>> = BTreeMap::new();
        let mut found = Vec::new();
        for (_, trial) in ranked {
            for units in [["deg", "deg/s"], ["rad", "rad/s"]] {
                let trial = self.in_units(&trial, &units, (true, true));
                let pitch = format!("{:?}", trial.get(&Quantity::Theta));
                let gravity = *costs
                    .entry(pitch)
                    .or_insert_with(|| self.axial_cost(&trial));
                let cost = self.physical_cost(&trial, &attitudes);
                found.extend(gravity.map(|gravity| (cost + gravity, trial)));
            }
        }
        found
    }

    /// Least cost of the axial equation over all speeds and axial accelerations; `None` unless it holds.
    fn axial_cost(&self, assignment: &Assignment) -> Option<f64> {
        let missing = [Quantity::Velocity, Quantity::Ax];
        let trials = self
            .extended(assignment, &missing, MOST_AXIAL_TRIALS)
            .into_iter();
        let misfits = trials.filter_map(|trial| self.misfit(Equation::Forward, &trial));
        let least = misfits.map(|misfit| misfit.ratio).reduce(f64::min)?;
        (least <= HOLDS).then(|| least.ln())
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
}

/// Assignment of the least cost, and `true` if all that have other columns for a rotation are worse by
/// [`ROTATION_LEAD`]. `None` without any.
fn best_of(mut costs: Vec<(f64, Assignment)>, rotation: &[Quantity]) -> Option<(Assignment, bool)> {
    costs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (cost, best) = costs.first()?;
    let differs = |trial: &Assignment| rotation.iter().any(|q| trial[q].column != best[q].column);
    let next = costs.iter().find(|(_, trial)| differs(trial));
    let leads = next.is_none_or(|(next, _)| next - cost > ROTATION_LEAD);
    Some((best.clone(), leads))
}

/// `true` if an attitude and its rate are missing while those of another axis have no column. A column and
/// its integral may then belong to either axis.
pub fn lacks_axis(missing: &[Quantity], assignment: &Assignment) -> bool {
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

/// A choice with its sign multiplied.
fn with_sign(choice: &Choice, sign: f64) -> Choice {
    Choice {
        sign: choice.sign * sign,
        ..choice.clone()
    }
}
