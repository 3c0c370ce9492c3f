//! Flight simulator: flies a test card from trim with a rigid body whose aerodynamics are the
//! build-up with known derivatives.
//!
//! The record is that of perfect instruments; [`FlownManeuver::recorded`] adds the errors of real
//! ones. The equations of motion ([`crate::rigid_body`]) are independent of the estimator's
//! ([`crate::dynamics`]), so that each checks the other.

mod gust;
mod shaping_filter;
pub mod turbulence;
pub mod discrete_gusts;
pub mod inputs;
pub mod instruments;
pub mod card;
pub mod flown;
pub mod actuators;
pub mod engine;
pub mod law;
pub mod settings;
pub mod aerodynamics;
pub mod plant;
pub mod sensors;
pub mod trim;
pub mod control;
mod flight;

use crate::aero::{AeroModel, WindTunnel};
use crate::aircraft::Aircraft;
use crate::error::{Problem, ProblemStage};

pub use card::{Card, DerivativeLookup, FlightCondition, Program};
pub use discrete_gusts::DiscreteGusts;
pub use flown::{FlownManeuver, TrueDerivative};
pub use inputs::TestInput;
pub use instruments::{Instrument, Instruments};
pub use sensors::{AIR_TEMPERATURE, STATIC_PRESSURE};
pub use settings::Settings;
pub use turbulence::{Turbulence, TurbulenceModel};

/// The simulated aircraft.
#[derive(Clone, Debug)]
pub struct Simulator {
    plant: plant::Plant,
    settings: Settings,
}

impl Simulator {
    /// Builds the aircraft from geometry, build-up, true derivatives and settings.
    ///
    /// # Errors
    /// The message for contradictory settings, a derivative without true value, or a surface that is
    /// not simulated.
    pub fn new(
        aircraft: &Aircraft,
        aero_model: &AeroModel,
        truth: WindTunnel,
        settings: Settings,
    ) -> Result<Simulator, String> {
        let settings = settings.checked()?;
        let aerodynamics =
            aerodynamics::Aerodynamics::new(aero_model, truth, &settings.surface_names)?;
        Ok(Simulator {
            plant: plant::Plant {
                aircraft: aircraft.clone(),
                aerodynamics,
                loadings: settings.loadings.clone(),
            },
            settings,
        })
    }

    /// Flies a card from trim.
    ///
    /// # Errors
    /// The card cannot be trimmed, its law cannot hold the trim, or the aircraft departs.
    pub fn fly(&self, card: &Card) -> Result<FlownManeuver, Problem> {
        flight::fly(&self.plant, &self.settings, card).map_err(|reason| Problem {
            stage: ProblemStage::Simulate,
            flight_id: card.flight_id.clone(),
            place: format!("{} at α = {}°", card.class, card.alpha_deg),
            reason,
        })
    }

    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}

#[cfg(test)]
pub(crate) mod tests;
