//! The checked configuration of a pipeline.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::cluster::ClusterSettings;
use super::written::ReportSettings;
use crate::aero::{AeroModel, WindTunnel};
use crate::aircraft::Aircraft;
use crate::flight::Channel;
use crate::maneuver::{Class, Event};
use crate::proof_of_match;
use crate::qualities::Specification;
use crate::{compare, estimate, export, ingest, model, segment, trend};

/// Configuration of a pipeline: everything that decides a campaign's results.
#[derive(Clone, Debug)]
pub struct Config {
    /// Name of the pipeline's folder.
    pub name: String,
    pub title: String,
    /// Folder or glob of the flight archive, in the file system or in an object store
    /// (`s3://bucket/prefix`).
    pub archive: String,
    /// File of the wind-tunnel tables, as the report names it.
    pub wind_tunnel: Option<PathBuf>,
    /// Number of derivatives that classes hold, if the pipeline has no tunnel; they are then left
    /// out.
    pub held_at_nothing: usize,
    /// Folder of the artefacts.
    pub store: PathBuf,
    /// Place of the artefacts in an object store; `store` is then its cache.
    pub shared_store: Option<PathBuf>,
    pub reports: PathBuf,
    pub aircraft: Aircraft,
    pub channels: BTreeMap<String, Channel>,
    /// Columns of the channel map that give no signal, and that no formula uses.
    pub unused_columns: Vec<String>,
    pub constants: BTreeMap<String, f64>,
    pub aero_model: AeroModel,
    pub tunnel: WindTunnel,
    pub classes: Vec<Class>,
    pub events: Vec<Event>,
    pub ingest: ingest::Settings,
    pub segment: segment::Settings,
    pub estimate: estimate::Settings,
    pub trend: trend::Settings,
    pub model: model::Settings,
    /// Specification of flying qualities, where the pipeline has one.
    pub qualities: Option<Specification>,
    /// Models and tolerances of the proof of match, where the pipeline has them.
    pub proof_of_match: Option<proof_of_match::Specification>,
    /// Derivatives of the proof's model `database`; empty without one.
    pub match_database: WindTunnel,
    pub compare: compare::Settings,
    pub export: export::Settings,
    pub report: ReportSettings,
    pub cluster: ClusterSettings,
    /// Report template in place of the built-in one.
    pub template: Option<String>,
    /// Name and text of each file of the pipeline.
    pub files: Vec<(String, String)>,
}

impl Config {
    #[must_use]
    pub fn class(&self, name: &str) -> Option<&Class> {
        self.classes.iter().find(|c| c.name == name)
    }

    /// Name of the wind tunnel's file, or a phrase if there is none.
    #[must_use]
    pub fn tunnel_name(&self) -> String {
        let file = self.wind_tunnel.as_ref();
        file.map_or_else(|| "none".to_owned(), |file| file.display().to_string())
    }

    /// Names of derivatives and sums in the order of the model.
    #[must_use]
    pub fn derivative_names(&self) -> Vec<String> {
        let derivatives = self.aero_model.derivatives.iter().map(|d| &d.name);
        derivatives
            .chain(self.aero_model.combined.iter().map(|c| &c.name))
            .cloned()
            .collect()
    }
}
