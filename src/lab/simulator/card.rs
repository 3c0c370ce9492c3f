//! Test card: one maneuver to be flown, from trim.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::discrete_gusts::DiscreteGusts;
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

/// Air and aerodynamics of a maneuver. Default: the estimator's assumptions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightCondition {
    pub derivatives: DerivativeLookup,
    /// Continuous turbulence; `None` in still air.
    pub turbulence: Option<Turbulence>,
    pub discrete_gusts: Option<DiscreteGusts>,
}

impl FlightCondition {
    /// `true` if each flight of a card differs from the others because the air is random.
    #[must_use]
    pub fn is_random(&self) -> bool {
        self.turbulence.is_some() || self.discrete_gusts.is_some()
    }

    /// Checks the air.
    ///
    /// # Errors
    /// The message for the first setting that is wrong.
    pub fn check(&self) -> Result<(), String> {
        self.turbulence.as_ref().map_or(Ok(()), Turbulence::check)?;
        self.discrete_gusts
            .as_ref()
            .map_or(Ok(()), DiscreteGusts::check)
    }
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
    pub condition: FlightCondition,
    /// Seed of turbulence and gusts.
    pub seed: u64,
    pub program: Program,
}
