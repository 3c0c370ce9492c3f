//! Test point of a flight.

use serde::{Deserialize, Serialize};

/// A maneuver class at several angles of attack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestPoint {
    pub class: String,
    pub alpha_deg: Vec<f64>,
    /// Scale of all inputs of the program.
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}
