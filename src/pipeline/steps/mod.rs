//! Steps: artefacts of the store, each with its key and the function that makes it.

pub mod estimate_step;
pub mod group_steps;
pub mod ingest_step;
pub mod match_step;
pub mod segment_step;
pub mod step;
pub mod step_runner;
pub mod surfaces_step;
