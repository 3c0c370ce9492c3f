//! The pipeline: the stages of a campaign, brought up to date in order.
//!
//! Ingest, segment, surfaces, estimate, joint estimate, prediction and proof of match are steps
//! ([`steps::step::Step`]): artefacts of the store, each a function of a key.
//! [`steps::step_runner::StepRunner`] loads an artefact or makes it, so nothing is computed twice,
//! and a killed run continues where it ended. Trends, posterior, flying qualities, comparison and
//! report are small and made anew each time. [`Conductor`] runs the stages in order. A run,
//! `status`, `explain` and the shards of a cluster all use it. Its [`Campaign`] carries the state
//! of each flight and maneuver. Results do not depend on threads: they are collected in the order
//! of flights and maneuvers.

mod records;
mod steps;
mod stages;
mod campaign;
mod conductor;
pub mod draft;
mod problems;
mod progress;
pub mod show;

pub use progress::Progress;
pub use records::archive_columns::{ArchiveColumns, examine_columns};

pub(crate) use campaign::{Campaign, Failure, MissingArtefact, StageState};
pub(crate) use conductor::{Conductor, method_versions};
pub(crate) use problems::problem;
pub(crate) use records::ingested::{Flight, IngestedFlight};
pub(crate) use stages::model_stage::evidence;
pub(crate) use stages::qualities_stage::flown_means;
pub(crate) use stages::report_stage::{PAGE, PRINTED_PAGE, Report, make_report};
pub(crate) use steps::estimate_step::{
    EstimateStep, LazyRecord, estimate_basis, estimate_maneuver, load_or_make_maneuvers,
};
pub(crate) use steps::match_step::decisive_differences;
pub(crate) use steps::segment_step::SegmentStep;
pub(crate) use steps::step::Step;
pub(crate) use steps::step_runner::AbsentArtefacts;
