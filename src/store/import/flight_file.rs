//! A flight written as Parquet, batch by batch.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use arrow::array::RecordBatch;
use arrow::datatypes::SchemaRef;
use parquet::arrow::ArrowWriter;

use super::imported_contents::{ImportedColumn, refused};
use crate::error::{Error, Result};
use crate::store::atomic::Draft;
use crate::store::encoding;
use crate::store::recorder::{BATCH_ROWS, array, schema};

/// Numbers that are in memory at once: those of 256 columns.
const BATCH_NUMBERS: usize = BATCH_ROWS << 8;

/// Number of rows that are in memory at once, for this number of columns.
pub fn batch_rows(columns: usize) -> usize {
    (BATCH_NUMBERS / columns.max(1)).min(BATCH_ROWS)
}

/// Largest number of columns of a file: each takes some hundred kilobytes while it is written.
const MOST_COLUMNS: usize = 4000;

/// A file being written; it appears whole or not at all.
pub struct FlightWriter {
    draft: Draft,
    writer: ArrowWriter<BufWriter<File>>,
    schema: SchemaRef,
    rows: usize,
}

impl FlightWriter {
    /// Begins a file that is to be at `path`.
    ///
    /// # Errors
    /// [`Error::Archive`] for more columns than a file may have; [`Error::Io`] or [`Error::Store`] for the
    /// disk.
    pub fn of(path: &Path, columns: &[ImportedColumn]) -> Result<FlightWriter> {
        if columns.len() > MOST_COLUMNS {
            let what = format!(
                "{} columns are more than the {MOST_COLUMNS} that a file may have",
                columns.len()
            );
            return Err(refused(path, &what));
        }
        let heads = columns.iter().map(|c| (c.name.as_str(), c.unit.as_deref()));
        let schema = schema(heads);
        let properties = encoding::properties().map_err(|e| Error::store(path, &e))?;
        let draft = Draft::create(path)?;
        let file = BufWriter::with_capacity(1 << 16, draft.handle()?);
        let writer = ArrowWriter::try_new(file, schema.clone(), Some(properties.build()))
            .map_err(|e| Error::store(path, &e))?;
        Ok(FlightWriter {
            draft,
            writer,
            schema,
            rows: 0,
        })
    }

    /// Writes columns of one length, NaN for a value that is missing.
    ///
    /// # Errors
    /// [`Error::Store`] naming the file.
    pub fn write<C: AsRef<[f64]>>(&mut self, values: &[C]) -> Result<()> {
        self.rows += values.first().map_or(0, |column| column.as_ref().len());
        let arrays = values.iter().map(|values| array(values.as_ref()));
        let path = self.draft.path();
        let batch = RecordBatch::try_new(self.schema.clone(), arrays.collect())
            .map_err(|e| Error::store(path, &e))?;
        self.writer
            .write(&batch)
            .map_err(|e| Error::store(path, &e))
    }

    /// Ends the file, whose draft is yet to be placed. Returns it with the number of rows.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Store`] naming the file.
    pub fn finish(self) -> Result<(Draft, usize)> {
        let path = self.draft.path();
        let file = self.writer.into_inner();
        let mut file = file.map_err(|e| Error::store(path, &e))?;
        file.flush().map_err(Error::io(path, "cannot write it"))?;
        Ok((self.draft, self.rows))
    }

    /// Puts the file in its place and returns the number of rows.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Store`] naming the file.
    pub fn place(self) -> Result<usize> {
        let (draft, rows) = self.finish()?;
        draft.place()?;
        Ok(rows)
    }
}
