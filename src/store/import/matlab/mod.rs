//! MATLAB files: `level_5` and `hdf5` read the variables, `columns` makes the columns of a recording.

mod columns;
mod hdf5;
mod level_5;

use std::io::Read;
use std::path::Path;

use super::flight_file::batch_rows;
use super::imported_contents::{ImportedColumn, ImportedContents, refused};
use super::naming::{Naming, note_on_nameless};
use crate::error::{Error, Result};
use columns::{Table, Value};

/// Largest file: more than any flight.
const LARGEST_MATLAB: u64 = 4 << 30;

type Variables = std::result::Result<Vec<(String, Value)>, String>;

/// Imports a MATLAB file of level 5.
pub fn import_level_5(source: &Path, file: &Path, naming: &Naming) -> Result<ImportedContents> {
    let variables = level_5::variables(&bytes(source)?);
    write_columns(source, file, variables, naming)
}

/// Imports an HDF5 file: MATLAB 7.3, or another program's.
pub fn import_hdf5(source: &Path, file: &Path, naming: &Naming) -> Result<ImportedContents> {
    let variables = hdf5::variables(bytes(source)?);
    write_columns(source, file, variables, naming)
}

fn bytes(source: &Path) -> Result<Vec<u8>> {
    let opened = std::fs::File::open(source).map_err(Error::io(source, "cannot open it"))?;
    let mut bytes = Vec::new();
    let mut limited = opened.take(LARGEST_MATLAB);
    let read = limited.read_to_end(&mut bytes);
    read.map_err(Error::io(source, "cannot read it"))?;
    Ok(bytes)
}

/// Writes the columns that the variables of a file make.
fn write_columns(
    source: &Path,
    file: &Path,
    variables: Variables,
    naming: &Naming,
) -> Result<ImportedContents> {
    let variables = variables.map_err(|what| refused(source, &what))?;
    let mut table = Table::default();
    let single = variables.len() == 1;
    for (name, value) in variables {
        table.add(if single { "" } else { &name }, &name, value);
    }
    let is_named = table.name_matrix_columns();
    table.add_stated_units();
    let rows = table.frequent_length();
    let (columns, mut notes) = table.of_length(rows);
    if columns.len() < 2 || rows < 2 {
        let what = "it has no two vectors of one length, which could be a recording's columns";
        return Err(refused(source, what));
    }
    let heads: Vec<ImportedColumn> = columns.iter().map(|(head, _)| head.clone()).collect();
    if !is_named && !naming.has_names() {
        notes.push(note_on_nameless(&heads));
    }
    notes.extend(naming.note_on_time(&heads));
    let mut writer = naming.writer(source, file, &heads)?;
    let heads = writer.heads.clone();
    let at_once = batch_rows(columns.len());
    for from in (0..rows).step_by(at_once) {
        let to = (from + at_once).min(rows);
        let batch: Vec<Vec<f64>> = columns
            .iter()
            .map(|(_, values)| values[from..to].to_vec())
            .collect();
        writer.write(&batch)?;
    }
    Ok(ImportedContents {
        rows: writer.place()?,
        columns: heads,
        notes,
        folder: None,
    })
}
