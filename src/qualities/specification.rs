//! Specification of flying qualities as the analyst writes it: `qualities.yaml`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::schema::words;
use crate::tables::{Airframe, FlyingQuality, Level};

words! {
    /// Category of flight phases.
    pub enum Category {
        /// Rapid maneuvering, precision tracking: air combat, ground attack.
        A = "A",
        /// Gradual maneuvers: climb, cruise, loiter.
        B = "B",
        /// Take-off, approach, landing.
        C = "C",
    }
}

words! {
    /// Class of aircraft.
    pub enum AirplaneClass {
        /// Small and light.
        Light = "I",
        /// Medium weight, land-based.
        MediumOnLand = "II-L",
        /// Medium weight, carrier-based.
        MediumOnCarriers = "II-C",
        /// Large and heavy.
        Heavy = "III",
        /// High maneuverability.
        Maneuverable = "IV",
    }
}

/// `qualities.yaml`.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Specification {
    /// Name of the specification.
    pub specification: String,
    pub category: Category,
    pub class: AirplaneClass,
    /// Gearing of the pitch control: deg of each surface.
    pub pitch_control: BTreeMap<String, f64>,
    /// Feedback: surface, state, deg per deg or deg per deg/s.
    #[serde(default)]
    pub feedback: BTreeMap<String, BTreeMap<String, f64>>,
    /// Models drawn from the posterior for the probabilities.
    pub draws: usize,
    pub requirements: Vec<Requirement>,
}

/// Requirement of one paragraph.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Requirement {
    pub paragraph: String,
    pub subject: String,
    pub limits: Vec<LevelLimit>,
}

/// Limits of one quantity.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LevelLimit {
    pub quantity: FlyingQuality,
    /// Categories and classes to which the limit applies; if not given, all.
    #[serde(default)]
    pub categories: Option<Vec<Category>>,
    #[serde(default)]
    pub classes: Option<Vec<AirplaneClass>>,
    /// `None` for a level without limit.
    #[serde(default)]
    pub level_1: Range,
    #[serde(default)]
    pub level_2: Range,
    #[serde(default)]
    pub level_3: Range,
    #[serde(default)]
    pub raised: Option<Raised>,
}

/// Range of a quantity that a level allows.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    #[serde(default)]
    pub min: Option<f64>,
    #[serde(default)]
    pub max: Option<f64>,
}

/// Rise of a limit's minimum with another quantity beyond a value. A level without a minimum rises from
/// zero.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Raised {
    pub by: FlyingQuality,
    pub above: f64,
    pub level_1: f64,
    pub level_2: f64,
    pub level_3: f64,
}

impl Specification {
    /// Airframes that are judged: without feedback, and also with it if the specification has gains.
    #[must_use]
    pub fn airframes(&self) -> Vec<Airframe> {
        if self.feedback.is_empty() {
            vec![Airframe::Bare]
        } else {
            vec![Airframe::Bare, Airframe::Augmented]
        }
    }

    /// Limits of a requirement that apply to the class and category.
    pub fn limits<'a>(
        &'a self,
        requirement: &'a Requirement,
    ) -> impl Iterator<Item = &'a LevelLimit> {
        let applies = |limit: &&LevelLimit| {
            let categories = limit.categories.as_ref();
            let classes = limit.classes.as_ref();
            categories.is_none_or(|c| c.contains(&self.category))
                && classes.is_none_or(|c| c.contains(&self.class))
        };
        requirement.limits.iter().filter(applies)
    }
}

impl Specification {
    /// Limits of a quantity that apply to the class and category.
    pub fn limits_of(&self, quantity: FlyingQuality) -> impl Iterator<Item = &LevelLimit> {
        let limits = self.requirements.iter().flat_map(|r| self.limits(r));
        limits.filter(move |limit| limit.quantity == quantity)
    }

    /// Range of a quantity that a level allows, over all its limits without their rises.
    #[must_use]
    pub fn range_of(&self, quantity: FlyingQuality, level: Level) -> Range {
        let ranges = self
            .limits_of(quantity)
            .filter_map(|limit| limit.range(level));
        ranges.fold(Range::default(), |all, range| Range {
            min: all.min.into_iter().chain(range.min).reduce(f64::max),
            max: all.max.into_iter().chain(range.max).reduce(f64::min),
        })
    }
}

impl LevelLimit {
    /// Range that a level allows; `None` for less than the lowest level.
    #[must_use]
    pub fn range(&self, level: Level) -> Option<Range> {
        match level {
            Level::One => Some(self.level_1),
            Level::Two => Some(self.level_2),
            Level::Three => Some(self.level_3),
            Level::Worse => None,
        }
    }
}

impl Raised {
    /// Rise of the minimum for a value of the other quantity.
    #[must_use]
    pub fn rise(&self, level: Level, value: f64) -> f64 {
        self.slope(level) * (value - self.above).max(0.0)
    }

    /// Rise of a level's minimum per unit of the other quantity.
    #[must_use]
    pub fn slope(&self, level: Level) -> f64 {
        match level {
            Level::One => self.level_1,
            Level::Two => self.level_2,
            Level::Three => self.level_3,
            Level::Worse => 0.0,
        }
    }
}
