//! The lineage of a night: code, configuration and input, each part with the first stage that reads
//! it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::stage::Stage;

/// The code: the program's version, a fingerprint of its sources, and the version of each method.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Code {
    pub version: String,
    pub source: String,
    /// By method, e.g. `estimate`; one goes up when its numbers change for the same input.
    pub methods: BTreeMap<String, u32>,
}

/// What decides the results of a stage and of all before it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lineage {
    pub code: Code,
    /// Per stage and part, e.g. `segment` → `recognition`, the configuration as it was checked.
    pub configuration: BTreeMap<Stage, BTreeMap<String, Value>>,
    /// Fingerprint of the content of each flight's files, or why it could not be read.
    pub flights: BTreeMap<String, String>,
    /// Fingerprints of the other files that are read, per stage: events, wind-tunnel table.
    pub tables: BTreeMap<Stage, BTreeMap<String, String>>,
}

impl Lineage {
    /// The part of it that decides a stage: what only later stages read is left out.
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

/// The stage of a method: joint estimates and predictions belong to `estimate`.
pub(super) fn method_stage(method: &str) -> Stage {
    Stage::from_word(method).unwrap_or(Stage::Estimate)
}
