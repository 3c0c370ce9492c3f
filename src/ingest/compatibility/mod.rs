//! Data compatibility by flight-path reconstruction: what is wrong with each instrument of a flight, by how much and how
//! surely, from the kinematic equations alone, before any aerodynamics.
//!
//! The rates and accelerations drive the equations of motion through windows of the flight in which much moves; what comes
//! out is matched to the vanes, the airspeed, the attitudes, the altitude and the pressures by output error. Biases, scale
//! errors and delays of all of them are shared by the windows. Surfaces, thrust and mass are in no kinematic equation: a
//! fault of theirs is not found here.

mod equations;
mod finding;
mod fit;
mod instruments;
mod response;
mod settings;
mod taps;
mod window;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

pub use finding::{Estimate, Finding, Findings};
pub use settings::{Action, Compatibility, Error, Errors, OnFault};

use crate::aircraft::Aircraft;
use crate::flight::{Channel, Record};
use window::Window;

/// What a record tells of its instruments; `recorded` are the signals that come from channels.
#[must_use]
pub fn examine(
    record: &Record,
    channels: &BTreeMap<String, Channel>,
    recorded: &[String],
    aircraft: &Aircraft,
    settings: &Compatibility,
) -> Findings {
    if !settings.reconstruct {
        return Findings::default();
    }
    let stretches = window::choose(record, settings);
    let windows: Vec<Window> = stretches.into_iter().map(|w| Window::of(record, w, aircraft, settings)).collect();
    let errors = fit::fit(&windows, aircraft, settings);
    Findings::of(errors.as_ref(), channels, recorded, settings)
}
