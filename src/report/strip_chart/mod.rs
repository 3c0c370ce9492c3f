//! Strip charts of `harvest show`: a whole flight with its maneuvers, or one maneuver measured
//! against computed, as an SVG file.

mod annotations;
mod envelope;
mod flight;
mod maneuver;
mod signal_groups;
mod signal_strips;
#[cfg(test)]
mod tests;

pub use flight::{FlightView, draw_flight};
pub use maneuver::{ManeuverView, draw_maneuver};
pub use signal_groups::SignalGroups;
