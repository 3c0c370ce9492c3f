//! Lineage in the key-value metadata of a published Parquet file.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::{Error, Result};
use crate::lineage::{Lineage, Stage};
use crate::store::table::{self, TableFolder};

const STAGE: &str = "harvest.stage";
const CODE: &str = "harvest.code";
const CONFIGURATION: &str = "harvest.configuration";
const FLIGHTS: &str = "harvest.flights";
const TABLES: &str = "harvest.tables";

/// A folder for the tables of a stage, whose files carry the lineage as far as that stage.
#[must_use]
pub fn shelf_of_stage(folder: &Path, lineage: &Lineage, stage: Stage) -> TableFolder {
    let part = lineage.until(stage);
    let pairs = [
        (STAGE, stage.name().to_owned()),
        (CODE, json(&part.code)),
        (CONFIGURATION, json(&part.configuration)),
        (FLIGHTS, json(&part.flights)),
        (TABLES, json(&part.tables)),
    ];
    let pairs = pairs.map(|(key, value)| (key.to_owned(), value));
    TableFolder::of(folder).with(pairs.to_vec())
}

/// Lineage as text. Only a map whose keys are no strings would fail; a lineage has none.
fn json(part: &impl Serialize) -> String {
    serde_json::to_string(part).unwrap_or_default()
}

/// Reads the stage of a published Parquet file and its lineage.
///
/// # Errors
/// [`Error::Io`] or [`Error::Damaged`] naming the file and the missing key.
pub fn read_lineage(path: &Path) -> Result<(Stage, Lineage)> {
    let metadata = Metadata {
        path,
        pairs: table::provenance(path)?,
    };
    let name = metadata.text(STAGE)?;
    let stage = Stage::from_word(name);
    let stage = stage.ok_or_else(|| metadata.error(&format!("has no stage `{name}`")))?;
    let lineage = Lineage {
        code: metadata.part(CODE)?,
        configuration: metadata.part(CONFIGURATION)?,
        flights: metadata.part(FLIGHTS)?,
        tables: metadata.part(TABLES)?,
    };
    Ok((stage, lineage))
}

struct Metadata<'a> {
    path: &'a Path,
    pairs: BTreeMap<String, String>,
}

impl Metadata<'_> {
    fn error(&self, what: &str) -> Error {
        Error::damaged(self.path, &format!("its metadata {what}"))
    }

    fn text(&self, key: &str) -> Result<&str> {
        let text = self.pairs.get(key).map(String::as_str);
        text.ok_or_else(|| self.error(&format!("has no `{key}`")))
    }

    fn part<T: DeserializeOwned>(&self, key: &str) -> Result<T> {
        serde_json::from_str(self.text(key)?).map_err(|e| self.error(&format!("`{key}`: {e}")))
    }
}
