//! Test card: one maneuver to be flown, from trim.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::inputs::TestInput;
use super::turbulence::Turbulence;
use crate::aero::Axis;

/// Source of the derivatives during a maneuver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DerivativeLookup {
    /// Constant, from the tables at the card's α and the Mach number of the trim: the assumption of
    /// the estimator.
    #[default]
    Frozen,
    /// From the tables at the present α and Mach number.
    Varying,
}

/// Actions of a maneuver on a clock that begins at 0: control law, flags, test inputs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Program {
    pub law: String,
    pub duration_s: f64,
    /// Start and end of the maneuver.
    pub maneuver_s: (f64, f64),
    /// Start and end of each flag, by signal.
    #[serde(default)]
    pub flags: BTreeMap<String, (f64, f64)>,
    pub inputs: Vec<TestInput>,
}

impl Program {
    /// Scales the amplitudes of all inputs.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Program {
        let scaled_input = |input: &TestInput| TestInput {
            size: scale * input.size,
            ..input.clone()
        };
        Program {
            inputs: self.inputs.iter().map(scaled_input).collect(),
            ..self.clone()
        }
    }
}

/// One test card.
#[derive(Clone, Debug, PartialEq)]
pub struct Card {
    pub flight_id: String,
    pub class: String,
    pub axis: Axis,
    pub alpha_deg: f64,
    pub altitude_ft: f64,
    pub heading_deg: f64,
    pub mass_slug: f64,
    /// Record time at which the card begins.
    pub start_s: f64,
    pub derivatives: DerivativeLookup,
    pub turbulence: Option<Turbulence>,
    /// Seed of the turbulence.
    pub seed: u64,
    pub program: Program,
}
