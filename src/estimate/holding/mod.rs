//! Derivatives that a maneuver holds: those that an absent output or a resting surface cannot
//! determine, and those that its own data cannot.

pub mod absent_outputs;
pub mod resting_surfaces;
pub mod maneuver_class;
pub mod held_by_evidence;
