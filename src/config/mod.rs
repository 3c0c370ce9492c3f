//! Configuration: YAML as written, checked whole before any flight is opened, as checked types.
//!
//! A pipeline is a folder:
//!
//! | file | content |
//! |---|---|
//! | `pipeline.yaml` | archive, store, reports, settings of the stages |
//! | `aircraft.yaml` | geometry, sensors, channel map, errors of instruments |
//! | `model.yaml` | build-up |
//! | `maneuvers/*.yaml` | one class per file |
//! | `qualities.yaml` | requirements on flying qualities, where these are judged |
//! | `match.yaml` | tolerances of a simulator, where its match is judged |

mod absences;
mod channel_map;
mod channel_table;
mod check;
mod checked;
mod cluster;
mod events;
mod instruments;
mod load;
mod moved;
mod places;
mod questions;
mod source;
mod tunnel_tables;
mod written;
mod yaml_bounds;

pub(crate) use check::cards_in_range;
pub use checked::Config;
pub use cluster::ClusterSettings;
pub use load::Overrides;
pub use questions::{Note, doubts};
pub(crate) use source::Source;
pub(crate) use tunnel_tables::tunnel_rows;
pub use written::ReportSettings;

#[cfg(test)]
mod settings_page;
#[cfg(test)]
mod tests;
