//! Where everything came from, enough to do it again: program, command, data with their
//! fingerprints, configuration.

use serde::Serialize;

use super::table_view::TableView;

/// A file that was read, as anyone can check it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SourceFile {
    /// Without the folder: where the archive lies is said by the command.
    pub name: String,
    pub bytes: u64,
    /// BLAKE3 of its content, hexadecimal.
    pub blake3: String,
}

/// What decided the results.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Provenance {
    /// The program with its version, and the versions of its methods.
    pub program: String,
    /// What does it again.
    pub command: String,
    pub data: Vec<SourceFile>,
    /// The configuration's files as they were: name and text.
    pub configuration: Vec<(String, String)>,
}

impl Provenance {
    /// The data as a table.
    #[must_use]
    pub fn table(&self) -> TableView {
        let row = |f: &SourceFile| vec![f.name.clone(), f.bytes.to_string(), f.blake3.clone()];
        let note = "BLAKE3 of each file's content: the same digits are the same data.";
        TableView::new(
            "Data",
            note,
            &["file", "bytes", "BLAKE3"],
            self.data.iter().map(row).collect(),
        )
    }
}
