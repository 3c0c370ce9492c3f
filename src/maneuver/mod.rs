//! Maneuver classes, each a column of the paper's Tables 1-4 with its recognition, and maneuvers
//! flown.

pub mod class;
pub mod found;
mod means;

pub use class::{Class, ClassOverrides, Pulses, Recognition, Status, StepCount, Sweep};
pub use found::{
    Acceptance, Event, Maneuver, ManeuverOrigin, Quality, Recognised, UnclassifiedExcitation,
};
pub use means::Means;
