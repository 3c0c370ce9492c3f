//! Contents of an imported file, and the refusal of a file that is no recording.

use std::path::{Path, PathBuf};

use serde::Serialize;
use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// A file that was imported.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Imported {
    pub source: PathBuf,
    /// Fingerprint of the source's bytes.
    pub fingerprint: String,
    pub file: PathBuf,
    pub rows: usize,
    pub columns: Vec<ImportedColumn>,
    /// Things that were left out or replaced, in words.
    pub notes: Vec<String>,
}

/// A column of an imported file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImportedColumn {
    pub name: String,
    pub unit: Option<String>,
}

/// Rows, columns and notes of one source.
#[derive(Debug, Default)]
pub struct ImportedContents {
    pub rows: usize,
    pub columns: Vec<ImportedColumn>,
    pub notes: Vec<String>,
    /// Folder of the files, if the source became several.
    pub folder: Option<PathBuf>,
}

/// Error of a file that is no recording.
pub fn refused(source: &Path, what: &str) -> Error {
    Error::Archive {
        place: source.to_owned(),
        what: what.to_owned(),
    }
}

/// Temporary file in a folder, which is made if it is missing; its name ends in `suffix`.
pub fn scratch_in(folder: &Path, suffix: &str) -> Result<NamedTempFile> {
    std::fs::create_dir_all(folder).map_err(Error::io(folder, "cannot create the folder"))?;
    let mut builder = tempfile::Builder::new();
    let file = builder.suffix(suffix).tempfile_in(folder);
    file.map_err(unwritable(folder))
}

/// Error of writing a temporary file in a folder.
pub fn unwritable(folder: &Path) -> impl FnOnce(std::io::Error) -> Error {
    Error::io(folder, "cannot write a temporary file in it")
}

/// Error of a temporary file as one of the source that it was made from.
pub fn of_scratch(error: Error, source: &Path) -> Error {
    match error {
        Error::Archive { what, .. } => refused(source, &what),
        other => other,
    }
}
