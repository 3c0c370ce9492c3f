//! Data compatibility by flight-path reconstruction: what is wrong with each instrument of a
//! flight, by how much and how surely, from the kinematic equations alone, before any aerodynamics.
//!
//! The rates and accelerations drive the equations of motion through windows of the flight in which
//! much moves; what comes out is matched to the vanes, the airspeed, the attitudes, the altitude
//! and the pressures by output error. Biases, scale errors and delays of all of them are shared by
//! the windows. Surfaces, thrust and mass are in no kinematic equation: a fault of theirs is not
//! found here.

mod equations;
mod error_sizes;
mod findings;
mod joint_fit;
mod parameters;
mod reconstruction;
mod settings;
mod window;

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

pub use error_sizes::{ErrorSize, ErrorSizes};
pub use findings::{Estimate, Finding, Findings};
pub use settings::{Action, Compatibility, OnFault};

use crate::aircraft::Aircraft;
use crate::flight::{Channel, Record, signal};
use window::Window;

/// The signals that are read of a record.
#[must_use]
pub fn signals() -> BTreeSet<String> {
    parameters::SIGNALS
        .iter()
        .chain(&[signal::X_CG, signal::Y_CG, signal::Z_CG])
        .map(|s| (*s).to_owned())
        .collect()
}

/// What a record tells of its instruments; `recorded` are the signals that come from channels. A
/// long record comes in `count` parts, each of which has its share of the windows.
#[must_use]
pub fn examine(
    parts: impl Iterator<Item = Record>,
    count: usize,
    channels: &BTreeMap<String, Channel>,
    recorded: &[String],
    aircraft: &Aircraft,
    settings: &Compatibility,
) -> Findings {
    if !settings.reconstruct {
        return Findings::default();
    }
    let share = Compatibility {
        windows: settings.windows.div_ceil(count.max(1)),
        ..settings.clone()
    };
    let of_part = |record: Record| -> Vec<Window> {
        let stretches = window::choose(&record, &share);
        stretches
            .into_iter()
            .map(|w| Window::of(&record, w, aircraft, settings))
            .collect()
    };
    let windows: Vec<Window> = parts.flat_map(of_part).collect();
    let errors = joint_fit::fit(&windows, aircraft, settings);
    Findings::of(errors.as_ref(), channels, recorded, settings)
}
