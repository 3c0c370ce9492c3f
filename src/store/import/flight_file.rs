//! A flight written as Parquet, batch by batch.

use std::path::Path;

use arrow::array::RecordBatch;
use parquet::arrow::ArrowWriter;

use super::imported_contents::ImportedColumn;
use crate::error::{Error, Result};
use crate::store::atomic::Draft;
use crate::store::recorder::{array, properties, schema};

/// Rows that are in memory at once.
pub const BATCH_ROWS: usize = 16_384;

/// Sink of batches: columns of one length, NaN for a value that is missing.
pub type Sink<'a> = dyn FnMut(&[Vec<f64>]) -> Result<()> + 'a;

/// Writes a file from batches; it appears whole or not at all. Returns the number of rows.
pub fn write(
    path: &Path,
    columns: &[ImportedColumn],
    batches: impl FnOnce(&mut Sink) -> Result<()>,
) -> Result<usize> {
    let (draft, rows) = write_draft(path, columns, batches)?;
    draft.place()?;
    Ok(rows)
}

/// Writes a draft beside a path from batches. Returns it with the number of rows.
pub fn write_draft(
    path: &Path,
    columns: &[ImportedColumn],
    batches: impl FnOnce(&mut Sink) -> Result<()>,
) -> Result<(Draft, usize)> {
    let heads = columns.iter().map(|c| (c.name.as_str(), c.unit.as_deref()));
    let schema = schema(heads);
    let properties = properties().map_err(|e| Error::store(path, &e))?;
    let mut draft = Draft::of(path)?;
    let mut rows = 0;
    {
        let mut writer = ArrowWriter::try_new(draft.writer(), schema.clone(), Some(properties))
            .map_err(|e| Error::store(path, &e))?;
        batches(&mut |values: &[Vec<f64>]| {
            rows += values.first().map_or(0, Vec::len);
            let arrays = values.iter().map(|values| array(values));
            let batch = RecordBatch::try_new(schema.clone(), arrays.collect())
                .map_err(|e| Error::store(path, &e))?;
            writer.write(&batch).map_err(|e| Error::store(path, &e))
        })?;
        writer.close().map_err(|e| Error::store(path, &e))?;
    }
    Ok((draft, rows))
}
