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

// Stages: functions of values, in the order of the pipeline.
pub mod ingest;

// Outside: the only code that touches the disk.
pub mod store;
