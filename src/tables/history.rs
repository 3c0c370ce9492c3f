//! Time histories of a maneuver, for the report.

use serde::{Deserialize, Deserializer, Serialize};

/// Time histories of one maneuver, measured and computed (Figures 4 and 12).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct History {
    pub maneuver_id: String,
    pub class: String,
    pub alpha_deg: f64,
    pub time_s: Vec<f64>,
    pub outputs: Vec<HistoryOutput>,
    /// Inputs: label with unit, values.
    pub controls: Vec<(String, Vec<f64>)>,
}

/// One output of a [`History`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HistoryOutput {
    pub label: String,
    pub unit: String,
    #[serde(deserialize_with = "null_as_nan")]
    pub measured: Vec<f64>,
    #[serde(deserialize_with = "null_as_nan")]
    pub computed: Vec<f64>,
    /// Samples that the cost leaves out.
    pub marked: Vec<bool>,
}

/// Reads numbers that may be null: JSON has no NaN.
fn null_as_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let values = Vec::<Option<f64>>::deserialize(deserializer)?;
    Ok(values.into_iter().map(|v| v.unwrap_or(f64::NAN)).collect())
}
