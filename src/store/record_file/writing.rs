//! Writing of a record: row groups of encoded signals, in whole pages.

use std::io::Write;
use std::sync::Arc;

use arrow::array::{Array, ArrayRef, Float64Array, UInt8Array};
use arrow::buffer::{BooleanBuffer, NullBuffer};
use arrow::datatypes::{DataType, Field, Schema};
use parquet::arrow::ArrowSchemaConverter;
use parquet::arrow::arrow_writer::{
    ArrowColumnChunk, ArrowColumnWriter, ArrowRowGroupWriterFactory, compute_leaves,
};
use parquet::basic::{Compression, Encoding};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::ColumnPath;

use super::header::RecordHeader;
use super::layout::{MARK, PAGE};
use crate::flight::Mark;
use crate::flight::record::Series;

/// Writer of a record.
#[expect(missing_debug_implementations, reason = "the writer within has none")]
pub struct Writer<W: Write + Send> {
    file: SerializedFileWriter<W>,
    factory: ArrowRowGroupWriterFactory,
    groups: usize,
}

fn refused(e: &dyn std::fmt::Display) -> String {
    format!("cannot write the record: {e}")
}

impl<W: Write + Send> Writer<W> {
    /// Begins a record of these signals.
    ///
    /// # Errors
    /// The reason.
    pub fn create<'s>(
        header: &RecordHeader,
        signals: impl Iterator<Item = &'s str>,
        out: W,
    ) -> Result<Writer<W>, String> {
        let mut fields = Vec::new();
        // Values stay uncompressed: noise hardly compresses, and writing it is faster. An unchanged
        // sample has a null mark: pages of nulls cost nothing.
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::UNCOMPRESSED)
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::None)
            .set_data_page_row_count_limit(PAGE)
            .set_key_value_metadata(Some(header.metadata()));
        for signal in signals {
            fields.push(Field::new(signal, DataType::Float64, false));
            let marks = format!("{signal}{MARK}");
            let path = ColumnPath::from(marks.clone());
            properties = properties.set_column_encoding(path, Encoding::DELTA_BINARY_PACKED);
            fields.push(Field::new(marks, DataType::UInt8, true));
        }
        // Without the serialised Arrow schema the order of the metadata is fixed here.
        let schema = Arc::new(Schema::new(fields));
        let parquet = ArrowSchemaConverter::new()
            .convert(&schema)
            .map_err(|e| refused(&e))?;
        let file =
            SerializedFileWriter::new(out, parquet.root_schema_ptr(), Arc::new(properties.build()));
        let file = file.map_err(|e| refused(&e))?;
        let factory = ArrowRowGroupWriterFactory::new(&file, schema);
        Ok(Writer {
            file,
            factory,
            groups: 0,
        })
    }

    /// Begins a row group: one writer for each signal, in their order.
    ///
    /// # Errors
    /// The reason.
    pub fn group(&mut self) -> Result<Vec<SignalWriter>, String> {
        let mut columns = self
            .factory
            .create_column_writers(self.groups)
            .map_err(|e| refused(&e))?
            .into_iter();
        self.groups += 1;
        let mut signals = Vec::new();
        while let (Some(values), Some(marks)) = (columns.next(), columns.next()) {
            signals.push(SignalWriter {
                values,
                marks,
                page: Series::default(),
            });
        }
        Ok(signals)
    }

    /// Writes the row group, whose encoded signals `next` yields in batches, in their order. While
    /// one batch is written the next is encoded.
    ///
    /// # Errors
    /// The reason.
    pub fn append(
        &mut self,
        mut next: impl FnMut() -> Result<Option<Vec<SignalChunk>>, String> + Send,
    ) -> Result<(), String> {
        let mut group = self.file.next_row_group().map_err(|e| refused(&e))?;
        let mut made = next()?;
        while let Some(chunks) = made {
            let write = || {
                chunks
                    .into_iter()
                    .flat_map(|c| c.0)
                    .try_for_each(|c| c.append_to_row_group(&mut group))
            };
            let (written, following) = rayon::join(write, &mut next);
            written.map_err(|e| refused(&e))?;
            made = following?;
        }
        group.close().map_err(|e| refused(&e))?;
        Ok(())
    }

    /// Ends the record.
    ///
    /// # Errors
    /// The reason.
    pub fn finish(self) -> Result<(), String> {
        self.file.close().map(|_| ()).map_err(|e| refused(&e))
    }
}

/// Writer of one signal's part of a row group.
#[expect(missing_debug_implementations, reason = "the writers within have none")]
pub struct SignalWriter {
    values: ArrowColumnWriter,
    marks: ArrowColumnWriter,
    /// Samples of the page that is not whole yet.
    page: Series,
}

/// Encoded part of one signal in a row group: values and flags.
#[expect(missing_debug_implementations, reason = "the columns within have none")]
pub struct SignalChunk([ArrowColumnChunk; 2]);

impl SignalWriter {
    /// Adds the next samples.
    ///
    /// # Errors
    /// The reason.
    pub fn push(&mut self, values: &[f64], marks: &[Mark]) -> Result<(), String> {
        if values.len() != marks.len() {
            return Err(refused(&"a series with more values than marks, or fewer"));
        }
        let (mut values, mut marks) = (values, marks);
        // Whole pages make the bytes independent of the pieces.
        while !values.is_empty() {
            let count = values.len().min(PAGE - self.page.values.len());
            self.page.values.extend_from_slice(&values[..count]);
            self.page.marks.extend_from_slice(&marks[..count]);
            (values, marks) = (&values[count..], &marks[count..]);
            if self.page.values.len() == PAGE {
                self.write_page()?;
            }
        }
        Ok(())
    }

    fn write_page(&mut self) -> Result<(), String> {
        let whole = Vec::with_capacity(PAGE);
        let values = std::mem::replace(&mut self.page.values, whole);
        let marks = &self.page.marks;
        let values: ArrayRef = Arc::new(Float64Array::from(values));
        let is_measured = |mark: &Mark| *mark == Mark::Measured;
        // Without an early exit, for the vectors.
        let marks = if marks.iter().fold(true, |all, mark| all & is_measured(mark)) {
            UInt8Array::new_null(marks.len())
        } else {
            let is_marked = |k: usize| !is_measured(&marks[k]);
            let marked = BooleanBuffer::collect_bool(marks.len(), is_marked);
            let codes: Vec<u8> = marks.iter().map(|mark| *mark as u8).collect();
            UInt8Array::new(codes.into(), Some(NullBuffer::new(marked)))
        };
        let marks: ArrayRef = Arc::new(marks);
        for (writer, array, nullable) in [
            (&mut self.values, values, false),
            (&mut self.marks, marks, true),
        ] {
            let field = Field::new("", array.data_type().clone(), nullable);
            for leaf in compute_leaves(&field, &array).map_err(|e| refused(&e))? {
                writer.write(&leaf).map_err(|e| refused(&e))?;
            }
        }
        self.page.marks.clear();
        Ok(())
    }

    /// Ends the row group of this signal.
    ///
    /// # Errors
    /// The reason.
    pub fn close(mut self) -> Result<SignalChunk, String> {
        if !self.page.values.is_empty() {
            self.write_page()?;
        }
        let close = |writer: ArrowColumnWriter| writer.close().map_err(|e| refused(&e));
        Ok(SignalChunk([close(self.values)?, close(self.marks)?]))
    }
}
