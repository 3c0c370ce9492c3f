//! Tolerances of the proof of match as the analyst writes them: `match.yaml`.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::aero::Axis;
use crate::tables::{MatchedQuantity, ModelSource};

/// `match.yaml`.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Specification {
    /// Name of the standard.
    pub standard: String,
    /// Models that fly the maneuvers again; the report shows the first.
    pub models: Vec<ModelSource>,
    /// File of the model `database`: as the wind tunnel's, or DAVE-ML.
    #[serde(default)]
    pub database: Option<PathBuf>,
    /// Longest time at the start of a maneuver over which initial state and trim are matched, s. It
    /// ends at the first input.
    pub trim_s: f64,
    /// Share of the samples that must be inside, %.
    pub inside_pct: f64,
    /// Repeat flights drawn for the probabilities.
    pub draws: usize,
    pub tests: Vec<Test>,
}

/// One test of the standard.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Test {
    /// Number in the standard.
    pub test: String,
    pub subject: String,
    /// Set of equations whose maneuvers it judges.
    pub axis: Axis,
    /// Classes that it judges; if not given, all of the axis.
    #[serde(default)]
    pub classes: Option<Vec<String>>,
    /// Requirements, all of which must be met.
    pub all_of: Vec<Requirement>,
}

/// Alternative tolerances, one of which must be met.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Requirement {
    pub one_of: Vec<Tolerance>,
}

/// Tolerance of one quantity: the larger of both widths holds at each sample.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Tolerance {
    pub quantity: MatchedQuantity,
    /// In the unit of the quantity.
    #[serde(default)]
    pub within: Option<f64>,
    /// Per cent of the measured value.
    #[serde(default)]
    pub within_pct: Option<f64>,
}

impl Test {
    /// `true` if the test judges maneuvers of this axis and class.
    #[must_use]
    pub fn judges(&self, axis: Axis, class: &str) -> bool {
        let classes = self.classes.as_ref();
        self.axis == axis && classes.is_none_or(|names| names.iter().any(|name| name == class))
    }
}

impl Tolerance {
    /// Width on either side of a measured value.
    #[must_use]
    pub fn width(&self, measured: f64) -> f64 {
        let absolute = self.within.unwrap_or(0.0);
        let relative = self
            .within_pct
            .map_or(0.0, |pct| 0.01 * pct * measured.abs());
        absolute.max(relative)
    }
}
