//! harvest: flight-test archives in, trusted aerodynamic derivatives out.
//!
//! The modules in order; a module uses only modules listed above it (`tests/stages/house.rs` holds
//! that).

// Vocabulary: what the words mean.
pub mod units;
pub mod numerics;
pub mod error;
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
pub mod simulate;

// Stages: functions of values, each from its predecessor's output.
pub mod ingest;
pub mod segment;
pub mod estimate;
pub mod trend;
pub mod compare;
pub mod overnight;
pub mod export;
pub mod pdf;
pub mod report;

// Studies: is what the stages say of themselves true?
pub mod validate;

// Past one machine: work dealt to shards, scripts for a scheduler.
pub mod cluster;

// Outside: disk and configuration.
pub mod store;
pub mod config;

// Conductor: the stages in order, and the command line.
pub mod memory;
pub mod pipeline;
pub mod simulation;
pub mod validation;
pub mod bench_case;
pub mod cli;
