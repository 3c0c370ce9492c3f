//! A maneuver class is one column of the paper's Tables 1-4 with the way it is recognised; a
//! maneuver is one flown.

pub mod class;
pub mod found;

pub use class::{Class, Overrides, Pulses, Recognition, Status, StepCount, Sweep};
pub use found::{Acceptance, Event, Maneuver, ManeuverOrigin, Quality, Recognised, Unknown};
