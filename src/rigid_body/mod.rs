//! Rigid body in flight: Newton's and Euler's equations in vector form with their mass properties, air
//! data, and the readings of its sensors.
//!
//! The proof of match and the simulator of the laboratory fly with it. It is written independently of
//! the estimator's equations ([`crate::dynamics`]), so that each checks the other.

pub mod air_data;
pub mod loading;
pub mod body;
pub mod readings;
pub(crate) mod first_order_changes;
pub(crate) mod reading_changes;
#[cfg(test)]
mod tests;

pub use air_data::{AirData, DEPARTURE_DEG};
pub use body::{BodyState, Euler, Loads, StateRate};
pub(crate) use first_order_changes::{AirChange, AirSlopes, BodySlopes, CHANGING, StateChange};
pub use loading::{Loading, Mass};
pub(crate) use reading_changes::ReadingSlopes;
pub use readings::{Instant, Readings};
