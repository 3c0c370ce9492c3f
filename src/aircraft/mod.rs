//! The aircraft in the equations of motion: reference dimensions, engines, sensor positions, and the
//! latitude at which it flies.
//!
//! Positions are in ft, positive aft (x), right (y) and above (z) of a reference point about 5 ft
//! ahead of the nose.

mod position;
mod thrust_line;
mod geometry;
mod vanes;

pub use geometry::{Aircraft, Sensors, Vane, VaneModel};
pub use position::Position;
pub use thrust_line::{Thrust, ThrustLine};
pub use vanes::{Reading, VaneFlow};
