//! The night: a run's results, published together with everything that decided them, and commands
//! that inspect it the next morning.
//!
//! - [`run()`] publishes a night.
//! - [`status`] reports the artefacts that a run would make.
//! - [`diff`] reports the changes since the night before.
//! - [`explain`] reports everything about one maneuver.
//! - [`verify`] checks that a published night is still valid.
//! - [`gc`] removes artefacts that no night needs.

mod campaign_lineage;
mod changes;
mod damaged_artefacts;
pub mod diff;
pub mod explain;
pub mod gc;
pub mod model_export;
mod published_night;
mod published_tables;
mod run;
pub mod status;
mod table_metadata;
pub mod verify;

pub use run::{RunOutcome, has_rejections, run};

pub(crate) use campaign_lineage::campaign_lineage;
pub(crate) use table_metadata::shelf_of_stage;

/// Answer of a command that needs a published night if there is none.
const NONE_PUBLISHED: &str = "no night has been published here yet; `harvest run` publishes one";

/// Message for a night whose manifest is missing or damaged.
fn damaged(name: &str) -> String {
    format!("night {name} is damaged: its night.json is not as it was published")
}
