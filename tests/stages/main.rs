//! The program from outside, stage by stage: exit codes, messages, published tables.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on ends here")]

mod absences;
mod browser;
mod check;
mod compare;
mod estimate;
mod export;
mod faults;
mod fuzz;
mod house;
mod import;
mod ingest;
mod init;
mod joint_estimation;
mod lab;
mod memory;
mod navion;
mod next_flight;
mod nights;
#[cfg(feature = "s3")]
mod object_store;
mod pages;
mod paper;
mod proof_of_match;
mod qualities;
mod python;
mod report;
mod rows;
mod run;
mod segment;
mod shards;
mod show;
mod sources;
mod support;
mod surfaces;
mod trend;
mod weather;
