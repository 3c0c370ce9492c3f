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

// Physics: how the aircraft moves and what its sensors read.
pub mod dynamics;

// Method: how derivatives follow from motion.
pub mod output_error;

// Stages: functions of values, each from its predecessor's output.
pub mod compare;
pub mod estimate;
pub mod ingest;
pub mod report;
pub mod segment;
pub mod trend;

// Outside: disk and configuration.
pub mod config;
pub mod store;

// Conductor: the stages in order, and the command line.
pub mod cli;
pub mod pipeline;
