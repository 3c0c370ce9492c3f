//! Quantity of a mode as a linear function of the derivatives, with the limits between its levels.

use std::collections::BTreeMap;

use super::analysis::linearised;
use super::judged_aircraft::JudgedAircraft;
use super::levels::{meets, minimum};
use super::linear::Differentiation;
use super::linear::LinearModel;
use super::specification::{LevelLimit, Specification};
use super::trim::FlownConditions;
use crate::aero::{Axis, Condition};
use crate::model::{LocalPosterior, LocalValue};
use crate::tables::{Airframe, FlyingQuality, Level};

/// Quantity of a mode at an angle of attack, about the mean of the posterior.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgedQuantity {
    pub condition: Condition,
    pub value: f64,
    /// Slopes along the values of the posterior.
    pub slopes: Vec<(LocalValue, f64)>,
    /// Ascending values at which the level changes. A limit that rises with another quantity is
    /// taken at the other's mean.
    pub limits: Vec<f64>,
}

/// Quantity of an airframe in steady flight at an angle of attack. `None` if the angle was not
/// flown, the mode does not exist, or the quantity is not finite.
#[must_use]
pub fn judged_quantity(
    basis: &JudgedAircraft,
    conditions: &FlownConditions,
    airframe: Airframe,
    quantity: FlyingQuality,
    alpha_deg: f64,
) -> Option<JudgedQuantity> {
    let trim = conditions.trim(alpha_deg, basis.aircraft)?;
    [Axis::Longitudinal, Axis::Lateral]
        .into_iter()
        .find_map(|axis| {
            let (linear, posterior) = linearised(basis, airframe, &trim, axis);
            let own = at_mean(axis, &linear, &posterior, basis.specification, quantity)?;
            Some(JudgedQuantity {
                condition: trim.condition,
                value: own.value,
                slopes: own.slopes,
                limits: own.limits,
            })
        })
}

/// Value, slopes and limits of a quantity at the mean of a posterior, as in [`JudgedQuantity`].
pub struct QuantityAtMean {
    pub value: f64,
    pub slopes: Vec<(LocalValue, f64)>,
    pub limits: Vec<f64>,
}

/// Quantity at the mean of a posterior; `None` if it does not exist or is not finite.
pub fn at_mean(
    axis: Axis,
    linear: &LinearModel,
    posterior: &LocalPosterior,
    specification: &Specification,
    quantity: FlyingQuality,
) -> Option<QuantityAtMean> {
    let found = linear.quantities(axis, &posterior.mean, Differentiation::Slopes)?;
    let means = found.values();
    let (_, dual) = found.quantities.into_iter().find(|(q, _)| *q == quantity)?;
    let is_finite = dual.value.is_finite()
        && dual.slopes.len() == posterior.values.len()
        && dual.slopes.iter().all(|slope| slope.is_finite());
    is_finite.then(|| {
        let slopes = posterior.values.iter().cloned().zip(dual.slopes);
        QuantityAtMean {
            value: dual.value,
            slopes: slopes.collect(),
            limits: level_changes(specification, quantity, &means),
        }
    })
}

/// Ascending values of a quantity at which its level changes, with the other quantities at their means.
fn level_changes(
    specification: &Specification,
    quantity: FlyingQuality,
    means: &[(FlyingQuality, f64)],
) -> Vec<f64> {
    let limits: Vec<&LevelLimit> = specification.limits_of(quantity).collect();
    let mut ends: Vec<f64> = limits.iter().flat_map(|limit| ends(limit, means)).collect();
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    let level = |value: f64| {
        let mut values: BTreeMap<FlyingQuality, f64> = means.iter().copied().collect();
        values.insert(quantity, value);
        let values: Vec<(FlyingQuality, f64)> = values.into_iter().collect();
        let levels = [Level::One, Level::Two, Level::Three];
        let mut met = levels.into_iter();
        met.find(|level| limits.iter().all(|limit| meets(limit, *level, &values)))
            .unwrap_or(Level::Worse)
    };
    // A value in each interval between the ends, and beyond both.
    let mut inside: Vec<f64> = ends.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
    inside.insert(0, ends.first().map_or(0.0, |first| first - 1.0));
    inside.extend(ends.last().map(|last| last + 1.0));
    let changes = ends.iter().zip(inside.windows(2));
    let changes = changes.filter(|(_, sides)| level(sides[0]) != level(sides[1]));
    changes.map(|(end, _)| *end).collect()
}

/// Ends of the ranges of a limit.
fn ends(limit: &LevelLimit, means: &[(FlyingQuality, f64)]) -> Vec<f64> {
    let of_level = |level: Level| {
        let range = limit.range(level).unwrap_or_default();
        [minimum(limit, level, means), range.max]
    };
    let levels = [Level::One, Level::Two, Level::Three].into_iter();
    levels.flat_map(of_level).flatten().collect()
}
