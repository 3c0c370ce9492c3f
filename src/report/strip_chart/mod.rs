//! Strip charts as SVG files. `harvest show` draws a whole flight with its maneuvers, or one
//! maneuver measured against computed. `harvest init` draws a recording as it finds it.

mod annotations;
mod envelope;
mod flight;
mod maneuver;
mod channel_strips;
mod signal_groups;
mod signal_strips;
#[cfg(test)]
mod tests;

pub use channel_strips::{draw_channels, draw_unused};
pub use flight::{FlightView, draw_flight};
pub use maneuver::{ManeuverView, draw_maneuver};
pub use signal_groups::SignalGroups;
