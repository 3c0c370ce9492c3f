//! harvest: flight-test archives in, trusted aerodynamic derivatives out.
//!
//! The modules in order; a module uses only modules listed above it (`tests/stages/house.rs` holds
//! that).

// Vocabulary: what the words mean.
pub mod schema;
pub mod units;
pub mod numerics;
pub mod error;
pub mod settings;
pub mod earth;
pub mod flight;
pub mod aircraft;
pub mod aero;
pub mod maneuver;
pub mod tables;
pub mod lineage;

// Physics: how the aircraft moves and what its sensors read.
pub mod dynamics;

// Method: how derivatives follow from motion.
pub mod output_error;

// Stages: functions of values, each from its predecessor's output.
pub mod ingest;
pub mod segment;
pub mod estimate;
pub mod trend;
pub mod compare;
pub mod export;
pub mod pdf;
pub mod report;

// Outside: disk and configuration.
pub mod store;
pub mod config;

// Conductor: the stages in order; their results as published nights; campaigns on a cluster.
pub mod memory;
pub mod pipeline;
pub mod night;
pub mod cluster;

// Laboratory: simulator, study of the bounds, timing. The nightly job needs none of it.
pub mod lab;

// Command line.
pub mod cli;
