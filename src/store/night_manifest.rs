//! Manifest of a published night: its counts, lineage, artefacts and files.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::artefact_name::ArtefactName;
use super::atomic;
use super::fingerprint::Digest;
use crate::error::{Error, Problem, Result};
use crate::lineage::{Lineage, Stage};

/// File of the manifest in the folder of a night.
pub const MANIFEST: &str = "night.json";

/// Counts and problems of a night.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    pub flights: usize,
    /// Number of flights that ingest rejected.
    pub refused: usize,
    pub maneuvers: usize,
    pub converged: usize,
    pub problems: Vec<Problem>,
    /// `true` if a published value moved, vanished or changed.
    pub alert: bool,
}

/// Manifest of a published night.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Night {
    /// Number of the night, the name of its folder.
    pub name: String,
    /// Last stage of the night; only a night with a report is complete.
    pub until: Stage,
    /// The complete night before it, for its changes.
    pub since: Option<String>,
    /// Names that the report prints and that affect no number, such as the archive's.
    pub shown: BTreeMap<String, String>,
    pub lineage: Lineage,
    pub summary: Summary,
    /// Artefacts from which the night was made, with their sizes, bytes.
    pub artefacts: BTreeMap<ArtefactName, u64>,
    /// Published files with their digests.
    pub files: BTreeMap<String, Digest>,
    /// Fingerprint of the fields above.
    pub seal: String,
}

impl Night {
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.until == Stage::Report
    }

    /// This manifest with the fingerprint of its fields.
    pub(super) fn sealed(mut self) -> Night {
        self.seal = String::new();
        let text = serde_json::to_vec(&self).unwrap_or_default();
        Night {
            seal: blake3::hash(&text).to_hex()[..16].to_owned(),
            ..self
        }
    }
}

/// Writes the manifest of a night into its folder.
pub fn write_manifest(folder: &Path, night: &Night) -> Result<()> {
    let path = folder.join(MANIFEST);
    atomic::place(
        &path,
        &serde_json::to_vec(night).map_err(|e| Error::store(&path, &e))?,
    )
}

/// Digests of a folder's files except the manifest.
pub fn digests(folder: &Path) -> Result<BTreeMap<String, Digest>> {
    let mut files = BTreeMap::new();
    let entries = fs::read_dir(folder).map_err(Error::io(folder, "cannot list the folder"))?;
    for entry in entries.flatten() {
        let (name, path) = (
            entry.file_name().to_string_lossy().into_owned(),
            entry.path(),
        );
        if name != MANIFEST {
            files.insert(name, Digest::of_file(&path)?);
        }
    }
    Ok(files)
}
