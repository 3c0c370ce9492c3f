//! The lineage of a night: code, configuration and input, each part with the first stage that reads
//! it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::stage::Stage;

/// Code behind a night: version and fingerprint of the program, and versions of its methods.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Code {
    pub version: String,
    pub source: String,
    /// Versions by method; one goes up when its numbers change for the same input.
    pub methods: BTreeMap<String, u32>,
}

/// Everything that decides the results of a night, or of its stages up to a given stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lineage {
    pub code: Code,
    /// Checked configuration by stage and part, e.g. `segment`, `recognition`.
    pub configuration: BTreeMap<Stage, BTreeMap<String, Value>>,
    /// Fingerprint of each flight's content, or the reason that it was rejected.
    pub flights: BTreeMap<String, String>,
    /// Fingerprints of the other input files by stage: events, wind-tunnel table, earlier trends.
    pub tables: BTreeMap<Stage, BTreeMap<String, String>>,
}

impl Lineage {
    /// Lineage up to a stage, without the parts that only later stages read.
    #[must_use]
    pub fn until(&self, stage: Stage) -> Lineage {
        let mut part = self.clone();
        part.configuration.retain(|s, _| *s <= stage);
        part.tables.retain(|s, _| *s <= stage);
        part.code
            .methods
            .retain(|method, _| method_stage(method) <= stage);
        part
    }
}

/// Stage to which a method belongs. Joint estimates and predictions belong to `estimate`.
pub(super) fn method_stage(method: &str) -> Stage {
    Stage::from_word(method).unwrap_or(Stage::Estimate)
}
