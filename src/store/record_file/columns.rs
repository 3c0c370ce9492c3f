//! Columns of a record's file, read over a range of samples into the values and marks of a signal.

use std::ops::Range;
use std::sync::Arc;

use parquet::column::reader::{
    ColumnReader, ColumnReaderImpl, get_column_reader, get_typed_column_reader,
};
use parquet::data_type::{DataType, DoubleType, Int32Type};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::ParquetMetaData;
use parquet::file::serialized_reader::SerializedPageReader;

use super::layout::{MARK, PAGE};
use super::page_file::PageFile;
use crate::flight::record::Series;
use crate::flight::{Mark, Record};

/// Columns of an open record.
pub(super) struct Columns<'a> {
    file: Arc<PageFile>,
    metadata: &'a ParquetMetaData,
}

impl<'a> Columns<'a> {
    pub fn new(file: PageFile, metadata: &'a ParquetMetaData) -> Columns<'a> {
        Columns {
            file: Arc::new(file),
            metadata,
        }
    }

    /// Adds the samples of the wanted signals to a record.
    ///
    /// # Errors
    /// A column is of another type, or the file is damaged. A file with fewer samples is no error.
    pub fn add_to(
        &self,
        record: &mut Record,
        samples: &Range<usize>,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<()> {
        let schema = self.metadata.file_metadata().schema_descr();
        for (column, name) in schema.columns().iter().map(|c| c.name()).enumerate() {
            let signal = name.strip_suffix(MARK).unwrap_or(name);
            if samples.is_empty() || !wanted(signal) {
                continue;
            }
            let empty = || Series {
                values: Vec::with_capacity(samples.len()),
                marks: Vec::with_capacity(samples.len()),
            };
            let signals = &mut record.signals;
            let series = signals.entry(signal.to_owned()).or_insert_with(empty);
            if name.ends_with(MARK) {
                self.read_marks(column, samples, &mut series.marks)?;
            } else {
                self.read_values(column, samples, &mut series.values)?;
            }
        }
        Ok(())
    }

    fn read_values(
        &self,
        column: usize,
        samples: &Range<usize>,
        values: &mut Vec<f64>,
    ) -> Result<()> {
        self.read::<DoubleType>(column, 0, samples, &mut |reader, count| {
            Ok(reader.read_records(count, None, None, values)?.0)
        })
    }

    /// Appends the marks of some samples of a column; a sample without a code is as recorded.
    fn read_marks(
        &self,
        column: usize,
        samples: &Range<usize>,
        marks: &mut Vec<Mark>,
    ) -> Result<()> {
        let (mut levels, mut codes) = (Vec::new(), Vec::new());
        self.read::<Int32Type>(column, 1, samples, &mut |reader, count| {
            levels.clear();
            codes.clear();
            let (read, _, _) = reader.read_records(count, Some(&mut levels), None, &mut codes)?;
            let mut codes = codes.iter();
            marks.extend(levels.iter().map(|level| match level {
                0 => Mark::Measured,
                _ => mark_of(codes.next()),
            }));
            Ok(read)
        })
    }

    /// Reads some samples of a column, of `levels` levels of definition, group by group and at most a
    /// page at a time. `next` reads a number of samples and returns how many it read.
    fn read<T: DataType>(
        &self,
        column: usize,
        levels: i16,
        samples: &Range<usize>,
        next: &mut dyn FnMut(&mut ColumnReaderImpl<T>, usize) -> Result<usize>,
    ) -> Result<()> {
        let mut first = 0_usize;
        for group in 0..self.metadata.num_row_groups() {
            let rows = usize::try_from(self.metadata.row_group(group).num_rows())
                .map_err(|_| damaged("a group has no number of rows"))?;
            let of_group = first..first.saturating_add(rows);
            first = of_group.end;
            let wanted = samples.start.max(of_group.start)..samples.end.min(of_group.end);
            if wanted.is_empty() {
                continue;
            }
            let mut reader = self.reader::<T>(group, column, levels, rows)?;
            reader.skip_records(wanted.start - of_group.start)?;
            let mut left = wanted.len();
            while left > 0 {
                let read = next(&mut reader, left.min(PAGE))?;
                if read == 0 {
                    break;
                }
                left -= read;
            }
        }
        Ok(())
    }

    fn reader<T: DataType>(
        &self,
        group: usize,
        column: usize,
        levels: i16,
        rows: usize,
    ) -> Result<ColumnReaderImpl<T>> {
        let chunks = self.metadata.row_group(group).columns();
        let chunk = chunks
            .get(column)
            .ok_or_else(|| damaged("a group lacks columns"))?;
        let kind = chunk.column_descr_ptr();
        if kind.physical_type() != T::get_physical_type()
            || (kind.max_def_level(), kind.max_rep_level()) != (levels, 0)
        {
            let what = format!(
                "column `{}` is of type {}",
                kind.name(),
                kind.physical_type()
            );
            return Err(damaged(&what));
        }
        let index = self.metadata.offset_index();
        let index = index.and_then(|index| index.get(group)?.get(column));
        let pages = SerializedPageReader::new(
            Arc::clone(&self.file),
            chunk,
            rows,
            index.map(|index| index.page_locations().clone()),
        )?;
        let reader: ColumnReader = get_column_reader(kind, Box::new(pages));
        Ok(get_typed_column_reader(reader))
    }
}

fn mark_of(code: Option<&i32>) -> Mark {
    let code = code.and_then(|code| u8::try_from(*code).ok());
    code.map_or(Mark::Missing, Mark::from_u8)
}

fn damaged(what: &str) -> ParquetError {
    ParquetError::General(what.to_owned())
}
