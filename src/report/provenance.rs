//! Provenance of the results, enough to reproduce them: program, command, data with their
//! fingerprints, configuration.

use serde::Serialize;

use super::table_view::TableView;

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SourceFile {
    /// Name without the folder, which the command has.
    pub name: String,
    pub bytes: u64,
    /// BLAKE3 of the content, hexadecimal.
    pub blake3: String,
}

/// Everything that the results depend on.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Provenance {
    /// Program and methods with their versions.
    pub program: String,
    /// Command that reproduces the results.
    pub command: String,
    pub data: Vec<SourceFile>,
    /// Name and text of each configuration file.
    pub configuration: Vec<(String, String)>,
}

impl Provenance {
    /// Table of the data files.
    #[must_use]
    pub fn table(&self) -> TableView {
        let row = |f: &SourceFile| vec![f.name.clone(), f.bytes.to_string(), f.blake3.clone()];
        let note = "BLAKE3 of each file's content: equal digits mean equal data.";
        TableView::new(
            "Data",
            note,
            &["file", "bytes", "BLAKE3"],
            self.data.iter().map(row).collect(),
        )
    }
}
