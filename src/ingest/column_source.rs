//! Source of a flight's columns, file by file: files of the archive, or values in memory.

use std::ops::Range;

use crate::flight::RawFlight;

/// The files of one flight as columns of numbers. Columns are read in parallel, each in order.
pub trait ColumnSource: Sync {
    fn flight_id(&self) -> &str;

    /// Number of files; a file is named by its index.
    fn files(&self) -> usize;

    fn name(&self, file: usize) -> String;

    fn rows(&self, file: usize) -> usize;

    fn has(&self, file: usize, column: &str) -> bool;

    /// Unit that a file states for a column, where it states one.
    fn unit(&self, file: usize, column: &str) -> Option<&str>;

    /// Reason for which a column of a file holds no numbers, in words; such a column counts as absent.
    fn unreadable(&self, _file: usize, _column: &str) -> Option<&str> {
        None
    }

    /// Passes the values of some rows to `sink` in order and in pieces; a null is a NaN.
    ///
    /// # Errors
    /// The reason for which they cannot be read, in words.
    fn read(
        &self,
        file: usize,
        column: &str,
        rows: Range<usize>,
        sink: &mut dyn FnMut(&[f64]),
    ) -> Result<(), String>;
}

/// Several files in memory.
impl ColumnSource for [RawFlight] {
    fn flight_id(&self) -> &str {
        self.first().map_or("", |f| f.flight_id.as_str())
    }

    fn files(&self) -> usize {
        self.len()
    }

    fn name(&self, file: usize) -> String {
        format!("part {}", file + 1)
    }

    fn rows(&self, file: usize) -> usize {
        self.get(file).map_or(0, |f| {
            f.columns
                .values()
                .map(|c| c.values.len())
                .max()
                .unwrap_or(0)
        })
    }

    fn has(&self, file: usize, column: &str) -> bool {
        self.get(file)
            .is_some_and(|f| f.columns.contains_key(column))
    }

    fn unit(&self, file: usize, column: &str) -> Option<&str> {
        self.get(file)?.columns.get(column)?.unit.as_deref()
    }

    fn read(
        &self,
        file: usize,
        column: &str,
        rows: Range<usize>,
        sink: &mut dyn FnMut(&[f64]),
    ) -> Result<(), String> {
        let values = self
            .get(file)
            .and_then(|f| f.columns.get(column))
            .and_then(|c| c.values.get(rows));
        sink(values.ok_or_else(|| format!("column `{column}` has no such rows"))?);
        Ok(())
    }
}
