//! The wind-tunnel database: derivatives tabulated over angle of attack and, where the tunnel has
//! them, Mach number and a third variable.
//!
//! A table is interpolated along α at the Mach numbers and third values on either side, then across
//! Mach, then across the third variable. The interpolation is linear or a monotone cubic
//! ([`super::interpolation`]). Beyond its ends a table has the value at the end (clamped) or none
//! (refused), by the settings; [`WindTunnel::extrapolations`] lists such readings.

mod condition;
mod database;
mod entries;
mod extrapolation;
mod reading;
mod settings;
#[cfg(test)]
mod tests;

pub use condition::Condition;
pub use database::{WindTunnel, key};
pub use entries::{TunnelPoint, TunnelValue, each_or_none};
pub use extrapolation::ExtrapolatedReading;
pub use reading::TableReader;
pub use settings::{Extrapolation, Settings, Third};
