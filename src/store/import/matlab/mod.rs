//! MATLAB files: `level_5` and `hdf5` read the variables, `columns` makes the columns of a recording.

mod columns;
mod hdf5;
mod level_5;

use std::io::Read;
use std::path::Path;

use super::contents::{Contents, ImportedColumn, refused};
use super::flight_file::{BATCH_ROWS, write};
use crate::error::{Error, Result};
use columns::Table;

/// Largest file: more than any flight.
const LARGEST: u64 = 4 << 30;

/// Imports a MATLAB file of level 5, or an HDF5 file.
pub fn import(source: &Path, file: &Path, is_hdf5: bool) -> Result<Contents> {
    let opened = std::fs::File::open(source).map_err(Error::io(source, "cannot open it"))?;
    let mut bytes = Vec::new();
    opened
        .take(LARGEST)
        .read_to_end(&mut bytes)
        .map_err(Error::io(source, "cannot read it"))?;
    let variables = if is_hdf5 {
        hdf5::variables(bytes)
    } else {
        level_5::variables(&bytes)
    };
    let variables = variables.map_err(|what| refused(source, &what))?;
    let mut table = Table::default();
    let single = variables.len() == 1;
    for (name, value) in variables {
        table.add(if single { "" } else { &name }, &name, value);
    }
    table.name_matrix_columns();
    let rows = table.frequent_length();
    let (columns, notes) = table.of_length(rows);
    if columns.len() < 2 || rows < 2 {
        let what = "it has no two vectors of one length, which could be a recording's columns";
        return Err(refused(source, what));
    }
    let heads: Vec<ImportedColumn> = columns.iter().map(|(head, _)| head.clone()).collect();
    let rows = write(file, &heads, |sink| {
        for from in (0..rows).step_by(BATCH_ROWS) {
            let to = (from + BATCH_ROWS).min(rows);
            let batch: Vec<Vec<f64>> = columns
                .iter()
                .map(|(_, values)| values[from..to].to_vec())
                .collect();
            sink(&batch)?;
        }
        Ok(())
    })?;
    Ok(Contents {
        rows,
        columns: heads,
        notes,
        folder: None,
    })
}
