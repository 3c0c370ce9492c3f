//! The simulator: one maneuver of a test card, flown from trim by a rigid body whose aerodynamics
//! are the build-up with known derivatives, and recorded as perfect instruments would;
//! [`Flown::recorded`] makes the record that real ones leave.
//!
//! Its equations of motion are its own ([`body`]): it uses nothing of the estimator's dynamics, so
//! that each is a check of the other.

pub mod actuators;
pub mod aerodynamics;
pub mod air_data;
pub mod body;
pub mod control;
pub mod engine;
mod flight;
pub mod inputs;
pub mod instruments;
pub mod loading;
pub mod noise;
pub mod plant;
pub mod sensors;
pub mod settings;
pub mod trim;
pub mod turbulence;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::aero::{Axis, Buildup, WindTunnel};
use crate::aircraft::Aircraft;
use crate::error::Problem;
use crate::flight::Record;
use crate::maneuver::Maneuver;

pub use inputs::Input;
pub use instruments::{Instrument, Instruments};
pub use settings::Settings;
pub use turbulence::Turbulence;

/// Where the derivatives' tables are read during a maneuver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tables {
    /// At the card's α and the trim's Mach number: the estimator's assumption of constant
    /// derivatives.
    #[default]
    Frozen,
    /// At the instant's α and Mach number.
    Varying,
}

/// What is done in a maneuver: the law in force, flags, and test inputs, on a clock that begins at
/// 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Program {
    pub law: String,
    pub duration_s: f64,
    /// Start and end of the maneuver.
    pub maneuver_s: (f64, f64),
    /// Flag's signal → from when to when it is up.
    #[serde(default)]
    pub flags: BTreeMap<String, (f64, f64)>,
    pub inputs: Vec<Input>,
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
    /// The record's time at which the card begins.
    pub start_s: f64,
    pub tables: Tables,
    pub turbulence: Option<Turbulence>,
    /// Of the turbulence.
    pub seed: u64,
    pub program: Program,
}

/// A derivative that was true in a maneuver.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueDerivative {
    pub derivative: String,
    pub unit: &'static str,
    pub value: f64,
}

/// A maneuver that was flown.
#[derive(Clone, Debug, PartialEq)]
pub struct Flown {
    /// What perfect instruments at their positions recorded.
    pub record: Record,
    pub maneuver: Maneuver,
    /// At the card's α and Mach; where tables vary, at the maneuver's means.
    pub truth: Vec<TrueDerivative>,
}

impl Flown {
    /// The record that these instruments make of the maneuver; nothing is integrated again.
    #[must_use]
    pub fn recorded(&self, instruments: &Instruments, seed: u64) -> Record {
        instruments.read(&self.record, seed)
    }
}

/// The simulated aircraft.
#[derive(Clone, Debug)]
pub struct Simulator {
    plant: plant::Plant,
    settings: Settings,
}

impl Simulator {
    /// # Errors
    /// A sentence: settings that contradict each other, a derivative without truth, a surface that
    /// is not simulated.
    pub fn new(
        aircraft: &Aircraft,
        buildup: &Buildup,
        truth: WindTunnel,
        settings: Settings,
    ) -> Result<Simulator, String> {
        let settings = settings.checked()?;
        let aerodynamics =
            aerodynamics::Aerodynamics::new(buildup, truth, &settings.surface_names)?;
        let loadings = settings.loadings.clone();
        Ok(Simulator {
            plant: plant::Plant {
                aircraft: aircraft.clone(),
                aerodynamics,
                loadings,
            },
            settings,
        })
    }

    /// Flies a card from trim.
    ///
    /// # Errors
    /// The card cannot be trimmed, its law cannot hold the trim, or the aircraft departs.
    pub fn fly(&self, card: &Card) -> Result<Flown, Problem> {
        flight::fly(self, card).map_err(|reason| Problem {
            stage: "simulate".into(),
            flight_id: card.flight_id.clone(),
            place: format!("{} at α = {}°", card.class, card.alpha_deg),
            reason,
        })
    }

    /// The trim that a card starts from.
    ///
    /// # Errors
    /// A sentence: nothing balances the aircraft there within the limits.
    pub fn trim(&self, card: &Card) -> Result<trim::Trim, String> {
        let point = trim::Point {
            alpha_deg: card.alpha_deg,
            altitude_ft: card.altitude_ft,
            mass_slug: card.mass_slug,
            heading_deg: card.heading_deg,
        };
        trim::trim(&self.plant, &self.settings, point)
    }

    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}

#[cfg(test)]
mod tests;
