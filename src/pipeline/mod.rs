//! The pipeline: the stages of a campaign, brought up to date in order.
//!
//! Ingest, segment, surfaces, estimate, joint estimate, prediction and proof of match are steps
//! ([`step::Step`]): artefacts of the store, each a function of a key. [`step_runner::StepRunner`]
//! loads an artefact or makes it, so nothing is computed twice, and a killed run continues where it
//! ended. Trends, posterior, flying qualities, comparison and report are small and made anew each
//! time. [`Conductor`] runs the stages in order. A run, `status`, `explain` and the shards of a
//! cluster all use it. Its [`Campaign`] carries the state of each flight and maneuver. Results do
//! not depend on threads: they are collected in the order of flights and maneuvers.

mod archive_columns;
mod campaign;
mod conductor;
mod estimate_step;
pub mod draft;
mod flight_contents;
mod group_steps;
mod ingest_step;
mod ingested;
mod lift_check;
mod match_step;
mod memory_shares;
mod problems;
mod progress;
mod qualities_stage;
mod record_windows;
mod record_writing;
mod repeated_rows;
mod report_stage;
mod segment_step;
pub mod show;
mod step;
mod step_runner;
mod surfaces_step;
mod model_stage;
mod trend_stage;

pub use archive_columns::{ArchiveColumns, examine_columns};
pub use progress::Progress;

pub(crate) use campaign::{Campaign, Failure, MissingArtefact, StageState};
pub(crate) use conductor::{Conductor, method_versions};
pub(crate) use estimate_step::{
    EstimateStep, LazyRecord, estimate_maneuver, load_or_make_maneuvers,
};
pub(crate) use ingested::{Flight, IngestedFlight};
pub(crate) use match_step::decisive_differences;
pub(crate) use model_stage::evidence;
pub(crate) use problems::problem;
pub(crate) use qualities_stage::flown_means;
pub(crate) use report_stage::{PAGE, PRINTED_PAGE, Report, make_report};
pub(crate) use segment_step::SegmentStep;
pub(crate) use step::Step;
pub(crate) use step_runner::AbsentArtefacts;
