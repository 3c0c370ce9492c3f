//! harvest: flight-test archives in, trusted aerodynamic derivatives out.
//!
//! The modules in order; a module uses only modules listed above it (`tests/house.rs` holds that).

// Vocabulary: what the words mean.
pub mod aero;
pub mod aircraft;
pub mod error;
pub mod flight;
pub mod maneuver;
pub mod tables;
pub mod units;

// Stages: pure functions of values.
pub mod segment;
pub mod trend;
pub mod compare;
