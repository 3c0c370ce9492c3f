//! Level of flying qualities that values meet.

use super::specification::{LevelLimit, Requirement, Specification};
use crate::tables::{FlyingQuality, Level};

/// Values of the modes that exist.
pub type Values = [(FlyingQuality, f64)];

/// Best level of one requirement whose limits the values meet.
///
/// A mode that does not exist has no limit. A quantity that is not a number meets no limit.
#[must_use]
pub fn level(specification: &Specification, requirement: &Requirement, values: &Values) -> Level {
    let levels = [Level::One, Level::Two, Level::Three];
    let is_met = |level: &Level| {
        let mut limits = specification.limits(requirement);
        limits.all(|limit| meets(limit, *level, values))
    };
    levels.into_iter().find(is_met).unwrap_or(Level::Worse)
}

/// `true` if values are within the limit of a level.
#[must_use]
pub fn meets(limit: &LevelLimit, level: Level, values: &Values) -> bool {
    let Some(value) = value_of(values, limit.quantity) else {
        return true;
    };
    let Some(range) = limit.range(level) else {
        return false;
    };
    // A comparison with what is not a number is false.
    minimum(limit, level, values).is_none_or(|min| value >= min)
        && range.max.is_none_or(|max| value <= max)
}

/// Minimum of a level with its rise. The rise starts from zero if the level states no minimum.
/// `None` for a level with neither minimum nor rise.
#[must_use]
pub fn minimum(limit: &LevelLimit, level: Level, values: &Values) -> Option<f64> {
    let own = limit.range(level)?.min;
    let rise = limit.raised.and_then(|raised| {
        let by = value_of(values, raised.by)?;
        (raised.slope(level) > 0.0).then(|| raised.rise(level, by))
    });
    match (own, rise) {
        (None, None) => None,
        (own, rise) => Some(own.unwrap_or(0.0) + rise.unwrap_or(0.0)),
    }
}

/// Value of a quantity; `None` if the mode does not exist.
#[must_use]
pub fn value_of(values: &Values, quantity: FlyingQuality) -> Option<f64> {
    let found = values.iter().find(|(other, _)| *other == quantity);
    found.map(|(_, value)| *value)
}
