//! Records as Parquet files: for each signal a column of values and one of marks, the clock in the
//! file's key-value metadata.
//!
//! A record is written row group by row group, the signals of a group in parallel, and read by
//! signals and windows of time, so no whole record is ever in memory. Reading back returns every
//! bit. The bytes depend on the record alone: not on time, host, or the pieces in which it was
//! written.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{Array, ArrayRef, AsArray, Float64Array, RecordBatch, UInt8Array};
use arrow::buffer::{BooleanBuffer, NullBuffer};
use arrow::datatypes::{DataType, Field, Float64Type, Schema, UInt8Type};
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder, RowSelection,
};
use parquet::arrow::arrow_writer::{
    ArrowColumnChunk, ArrowColumnWriter, ArrowRowGroupWriterFactory, compute_leaves,
};
use parquet::arrow::{ArrowSchemaConverter, ProjectionMask};
use parquet::basic::{Compression, Encoding};
use parquet::file::metadata::{KeyValue, PageIndexPolicy};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::ColumnPath;

use crate::error::Error;
use crate::flight::record::{Series, with_margin};
use crate::flight::{Correction, Mark, Record, StandIn};

/// Suffix of a signal's column of marks.
const MARK: &str = ":mark";

const FLIGHT: &str = "flight_id";
const START: &str = "start_s";
const STEP: &str = "step_s";
const SAMPLES: &str = "samples";

/// Prefix of the metadata key of a constant signal.
const CONSTANT: &str = "constant:";

/// Samples of a row group; the encoded signal stays in memory until its group is written.
pub const GROUP: usize = 1 << 19;

/// Samples of a page, which is decoded whole for any of its samples.
const PAGE: usize = 1 << 11;

/// Id, clock and constants of a record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordHeader {
    pub flight_id: String,
    pub start_s: f64,
    pub step_s: f64,
    pub samples: usize,
    /// Values of constant signals.
    pub constants: BTreeMap<String, f64>,
}

impl RecordHeader {
    fn metadata(&self) -> Vec<KeyValue> {
        let constants = self
            .constants
            .iter()
            .map(|(name, v)| KeyValue::new(format!("{CONSTANT}{name}"), v.to_string()));
        let own = [
            KeyValue::new(FLIGHT.to_owned(), self.flight_id.clone()),
            KeyValue::new(START.to_owned(), self.start_s.to_string()),
            KeyValue::new(STEP.to_owned(), self.step_s.to_string()),
            KeyValue::new(SAMPLES.to_owned(), self.samples.to_string()),
        ];
        own.into_iter().chain(constants).collect()
    }

    fn record(&self, samples: &Range<usize>) -> Record {
        Record {
            flight_id: self.flight_id.clone(),
            start_s: self.start_s + samples.start as f64 * self.step_s,
            step_s: self.step_s,
            samples: samples.len(),
            signals: BTreeMap::new(),
        }
    }
}

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
                pending: Series {
                    values: Vec::new(),
                    marks: Vec::new(),
                },
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
    pending: Series,
}

/// Encoded part of one signal in a row group: values and marks.
#[expect(missing_debug_implementations, reason = "the columns within have none")]
pub struct SignalChunk([ArrowColumnChunk; 2]);

impl SignalWriter {
    /// Adds the next samples.
    ///
    /// # Errors
    /// The reason.
    pub fn push(&mut self, series: &Series) -> Result<(), String> {
        if series.values.len() != series.marks.len() {
            return Err(refused(&"a series with more values than marks, or fewer"));
        }
        self.pending.values.extend_from_slice(&series.values);
        self.pending.marks.extend_from_slice(&series.marks);
        // Whole pages make the bytes independent of the pieces.
        let whole = self.pending.values.len() / PAGE * PAGE;
        for from in (0..whole).step_by(PAGE) {
            self.page(from..from + PAGE)?;
        }
        self.pending.values.drain(..whole);
        self.pending.marks.drain(..whole);
        Ok(())
    }

    fn page(&mut self, range: Range<usize>) -> Result<(), String> {
        let values = self.pending.values.get(range.clone()).unwrap_or_default();
        let marks = self.pending.marks.get(range).unwrap_or_default();
        let values: ArrayRef = Arc::new(Float64Array::from(values.to_vec()));
        let repaired = |k: usize| marks[k] != Mark::Measured;
        let repaired = BooleanBuffer::collect_bool(marks.len(), repaired);
        let marks = if repaired.count_set_bits() == 0 {
            UInt8Array::new_null(marks.len())
        } else {
            let codes: Vec<u8> = marks.iter().map(|mark| *mark as u8).collect();
            UInt8Array::new(codes.into(), Some(NullBuffer::new(repaired)))
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
        Ok(())
    }

    /// Ends the row group of this signal.
    ///
    /// # Errors
    /// The reason.
    pub fn close(mut self) -> Result<SignalChunk, String> {
        let rest = self.pending.values.len();
        if rest > 0 {
            self.page(0..rest)?;
        }
        let close = |writer: ArrowColumnWriter| writer.close().map_err(|e| refused(&e));
        Ok(SignalChunk([close(self.values)?, close(self.marks)?]))
    }
}

/// Writes a record that is in memory.
///
/// # Errors
/// The reason: a series of another length than the record, or a disk that failed.
pub fn write(record: &Record, out: impl Write + Send) -> Result<(), String> {
    let header = RecordHeader {
        flight_id: record.flight_id.clone(),
        start_s: record.start_s,
        step_s: record.step_s,
        samples: record.samples,
        constants: BTreeMap::new(),
    };
    let whole = |s: &Series| s.values.len() == record.samples && s.marks.len() == record.samples;
    if let Some((name, _)) = record.signals.iter().find(|(_, s)| !whole(s)) {
        return Err(refused(&format!(
            "signal `{name}` has not {} samples",
            record.samples
        )));
    }
    let mut writer = Writer::create(&header, record.signals.keys().map(String::as_str), out)?;
    for from in (0..record.samples).step_by(GROUP) {
        let to = (from + GROUP).min(record.samples);
        let mut parts = writer.group()?.into_iter().zip(record.signals.values());
        writer.append(|| {
            let Some((mut signal, series)) = parts.next() else {
                return Ok(None);
            };
            signal.push(&Series {
                values: series.values[from..to].to_vec(),
                marks: series.marks[from..to].to_vec(),
            })?;
            Ok(Some(vec![signal.close()?]))
        })?;
    }
    writer.finish()
}

/// A record on the disk, read by signals and windows of time.
#[derive(Clone, Debug)]
pub struct RecordFile {
    path: PathBuf,
    metadata: ArrowReaderMetadata,
    pub header: RecordHeader,
    /// Corrections applied as samples are read.
    corrections: Vec<Correction>,
    /// Stand-ins of signals, in the order in which they are computed.
    stand_ins: Vec<(String, StandIn)>,
}

/// Opens a record.
///
/// # Errors
/// The file cannot be opened, is no Parquet file, or is not a record.
pub fn open(path: &Path) -> Result<RecordFile, Error> {
    let file = File::open(path).map_err(Error::io(path, "cannot open the record"))?;
    let bad = |what: &dyn std::fmt::Display| not_a_record(path, what);
    let options = ArrowReaderOptions::new().with_offset_index_policy(PageIndexPolicy::Optional);
    let metadata = ArrowReaderMetadata::load(&file, options).map_err(|e| bad(&e))?;
    let keys = metadata.schema().metadata();
    let text = |key: &str| {
        keys.get(key)
            .ok_or_else(|| bad(&format!("its metadata has no `{key}`")))
    };
    let number = |key: &str| {
        text(key)?
            .parse::<f64>()
            .map_err(|e| bad(&format!("`{key}`: {e}")))
    };
    let mut constants = BTreeMap::new();
    for (key, name) in keys
        .keys()
        .filter_map(|key| Some((key, key.strip_prefix(CONSTANT)?)))
    {
        constants.insert(name.to_owned(), number(key)?);
    }
    let header = RecordHeader {
        flight_id: text(FLIGHT)?.clone(),
        start_s: number(START)?,
        step_s: number(STEP)?,
        samples: text(SAMPLES)?
            .parse::<usize>()
            .map_err(|e| bad(&format!("`{SAMPLES}`: {e}")))?,
        constants,
    };
    Ok(RecordFile {
        path: path.to_owned(),
        metadata,
        header,
        corrections: vec![],
        stand_ins: vec![],
    })
}

fn not_a_record(path: &Path, what: &dyn std::fmt::Display) -> Error {
    Error::damaged(
        path,
        &format!("not a record; remove it and run again: {what}"),
    )
}

/// Reads a whole record. A long flight is better read by windows.
///
/// # Errors
/// As [`open`], and samples that cannot be read.
pub fn read(path: &Path) -> Result<Record, Error> {
    let file = open(path)?;
    file.window(None, 0..file.header.samples)
}

impl RecordFile {
    /// Applies corrections to the record as it is read.
    #[must_use]
    pub fn corrected(self, corrections: Vec<Correction>) -> RecordFile {
        RecordFile {
            corrections,
            ..self
        }
    }

    /// Puts stand-ins in the place of signals, computed from the corrected others.
    #[must_use]
    pub fn completed(self, stand_ins: Vec<(String, StandIn)>) -> RecordFile {
        RecordFile { stand_ins, ..self }
    }

    /// Applies further corrections.
    #[must_use]
    pub fn corrected_further(mut self, further: impl Iterator<Item = Correction>) -> RecordFile {
        self.corrections.extend(further);
        self
    }

    /// Index of the sample nearest to a time, inside the record.
    #[must_use]
    pub fn sample_at(&self, time_s: f64) -> usize {
        self.header
            .record(&(0..self.header.samples))
            .sample_at(time_s)
    }

    /// Reads from one time to another with a few samples more on each side, as [`Record::part`]
    /// does.
    ///
    /// # Errors
    /// As [`RecordFile::window`].
    pub fn part(
        &self,
        signals: Option<&BTreeSet<String>>,
        start_s: f64,
        end_s: f64,
    ) -> Result<Record, Error> {
        let (first, last) = (self.sample_at(start_s), self.sample_at(end_s));
        let (samples, step_s) = (self.header.samples, self.header.step_s);
        self.window(signals, with_margin(first, last, samples, step_s))
    }

    /// Reads a range of samples of some signals, or of all. Signals that the record lacks are left
    /// out.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Store`] naming the file.
    pub fn window(
        &self,
        signals: Option<&BTreeSet<String>>,
        samples: Range<usize>,
    ) -> Result<Record, Error> {
        let samples = samples.start.min(self.header.samples)..samples.end.min(self.header.samples);
        let reach = self
            .corrections
            .iter()
            .map(|c| c.reach(self.header.step_s))
            .max()
            .unwrap_or(0);
        let wide =
            samples.start.saturating_sub(reach)..(samples.end + reach).min(self.header.samples);
        let sources = signals.map(|signals| self.with_sources(signals));
        let mut record = self.as_written(sources.as_ref(), wide.clone())?;
        self.corrections
            .iter()
            .for_each(|correction| correction.apply(&mut record));
        for (signal, stand_in) in &self.stand_ins {
            stand_in.fill(signal, &mut record);
        }
        if let Some(signals) = signals {
            record.signals.retain(|name, _| signals.contains(name));
        }
        if wide == samples {
            return Ok(record);
        }
        let inside = samples.start - wide.start..samples.end - wide.start;
        Ok(Record {
            start_s: self.header.record(&samples).start_s,
            ..record.cut(None, inside)
        })
    }

    /// Some signals, and those from which the stand-ins of the record are computed.
    fn with_sources(&self, signals: &BTreeSet<String>) -> BTreeSet<String> {
        let sources = self.stand_ins.iter().flat_map(|(_, s)| s.sources());
        let sources = sources.map(|name| (*name).to_owned());
        signals.iter().cloned().chain(sources).collect()
    }

    fn as_written(
        &self,
        signals: Option<&BTreeSet<String>>,
        samples: Range<usize>,
    ) -> Result<Record, Error> {
        let mut record = self.header.record(&samples);
        let wanted = |name: &str| signals.is_none_or(|s| s.contains(name));
        for (name, value) in self
            .header
            .constants
            .iter()
            .filter(|(name, _)| wanted(name))
        {
            let constant = Series::assumed(vec![*value; samples.len()]);
            record.signals.insert(name.clone(), constant);
        }
        let bad = |what: &dyn std::fmt::Display| not_a_record(&self.path, what);
        let file =
            File::open(&self.path).map_err(Error::io(&self.path, "cannot open the record"))?;
        let builder =
            ParquetRecordBatchReaderBuilder::new_with_metadata(file, self.metadata.clone());
        let fields = builder.schema().fields().iter().enumerate();
        let columns: Vec<usize> = fields
            .filter(|(_, f)| wanted(f.name().strip_suffix(MARK).unwrap_or(f.name())))
            .map(|(i, _)| i)
            .collect();
        if samples.is_empty() || columns.is_empty() {
            return Ok(record);
        }
        let mask = ProjectionMask::roots(builder.parquet_schema(), columns);
        let selection = RowSelection::from_consecutive_ranges(
            std::iter::once(samples.clone()),
            self.header.samples,
        );
        let reader = builder
            .with_projection(mask)
            .with_row_selection(selection)
            .with_batch_size(PAGE)
            .build();
        for batch in reader.map_err(|e| bad(&e))? {
            add(&mut record, &batch.map_err(|e| bad(&e))?, samples.len()).map_err(|e| bad(&e))?;
        }
        let whole = |s: &Series| s.values.len() == samples.len() && s.marks.len() == samples.len();
        match record.signals.iter().find(|(_, s)| !whole(s)) {
            Some((name, _)) => Err(bad(&format!(
                "signal `{name}` has not {} samples",
                self.header.samples
            ))),
            None => Ok(record),
        }
    }
}

impl RecordFile {
    /// Reads the whole record for a chart. Of more samples than `most`, the smallest and the
    /// largest of several neighbours are kept in their order. Signals are read one at a time.
    ///
    /// # Errors
    /// As [`RecordFile::window`].
    pub fn outline(&self, most: usize) -> Result<Record, Error> {
        let all = 0..self.header.samples;
        if all.len() <= most {
            return self.window(None, all);
        }
        let width = (2 * all.len()).div_ceil(most.max(2)).max(2);
        let mut outline = self.header.record(&(0..2 * all.len().div_ceil(width)));
        outline.step_s = self.header.step_s * width as f64 / 2.0;
        let fields = self.metadata.schema().fields().iter().map(|f| f.name());
        let recorded = fields
            .filter(|name| !name.ends_with(MARK))
            .chain(self.header.constants.keys());
        for name in recorded {
            let signals = BTreeSet::from([name.clone()]);
            for (name, series) in self.window(Some(&signals), all.clone())?.signals {
                outline.signals.insert(name, extremes(&series, width));
            }
        }
        Ok(outline)
    }
}

/// Smallest and largest of every `step` samples, in their order, with the mark of a faulty sample
/// if there is one.
fn extremes(series: &Series, width: usize) -> Series {
    let mut outline = Series {
        values: Vec::new(),
        marks: Vec::new(),
    };
    for (values, marks) in series.values.chunks(width).zip(series.marks.chunks(width)) {
        let finite = || {
            values
                .iter()
                .copied()
                .enumerate()
                .filter(|(_, v)| v.is_finite())
        };
        let low = finite().min_by(|a, b| a.1.total_cmp(&b.1));
        let high = finite().max_by(|a, b| a.1.total_cmp(&b.1));
        let pair = match (low, high) {
            (Some(low), Some(high)) if low.0 <= high.0 => [low.1, high.1],
            (Some(low), Some(high)) => [high.1, low.1],
            _ => [f64::NAN; 2],
        };
        outline.values.extend(pair);
        let mark = marks
            .iter()
            .find(|m| m.is_fault())
            .copied()
            .unwrap_or(Mark::Measured);
        outline.marks.extend([mark; 2]);
    }
    outline
}

fn add(record: &mut Record, batch: &RecordBatch, samples: usize) -> Result<(), String> {
    for (field, array) in batch.schema().fields().iter().zip(batch.columns()) {
        let name = field.name().strip_suffix(MARK).unwrap_or(field.name());
        let empty = || Series {
            values: Vec::with_capacity(samples),
            marks: Vec::with_capacity(samples),
        };
        let series = record.signals.entry(name.to_owned()).or_insert_with(empty);
        let other = || format!("column `{}` is of type {}", field.name(), field.data_type());
        if field.name().ends_with(MARK) {
            let marks = array.as_primitive_opt::<UInt8Type>().ok_or_else(other)?;
            if marks.null_count() == marks.len() {
                series
                    .marks
                    .resize(series.marks.len() + marks.len(), Mark::Measured);
            } else {
                series.marks.extend(
                    marks
                        .iter()
                        .map(|code| code.map_or(Mark::Measured, Mark::from_u8)),
                );
            }
        } else {
            let values = array.as_primitive_opt::<Float64Type>().ok_or_else(other)?;
            series.values.extend_from_slice(values.values());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> Record {
        let values = vec![
            1.5,
            f64::from_bits(0x7ff8_0000_0000_0001),
            -0.0,
            1e-310,
            57.295_779_513_082_32,
        ];
        let marks = vec![
            Mark::Measured,
            Mark::Missing,
            Mark::Bridged,
            Mark::Despiked,
            Mark::Measured,
        ];
        let flag = Series {
            values: vec![0.0, 0.0, 1.0, 1.0, 1.0],
            marks: vec![Mark::Measured; 5],
        };
        let dead = Series {
            values: vec![f64::NAN; 5],
            marks: vec![Mark::Missing; 5],
        };
        let alpha = Series { values, marks };
        Record {
            flight_id: "flight 007 ä".to_owned(),
            start_s: 0.1 + 0.2,
            step_s: 0.025_000_000_000_000_3,
            samples: 5,
            signals: [
                ("alpha_vane_deg".to_owned(), alpha),
                ("mach".to_owned(), dead),
                ("obes".to_owned(), flag),
            ]
            .into(),
        }
    }

    fn bytes(record: &Record) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(record, &mut bytes).expect("written");
        bytes
    }

    fn saved(bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("record.parquet");
        std::fs::write(&path, bytes).expect("written");
        (folder, path)
    }

    #[test]
    fn a_record_comes_back_to_the_bit() {
        let (given, (_folder, path)) = (record(), saved(&bytes(&record())));
        let back = read(&path).expect("a record");
        assert_eq!(
            (&back.flight_id, back.samples),
            (&given.flight_id, given.samples)
        );
        assert_eq!(back.start_s.to_bits(), given.start_s.to_bits());
        assert_eq!(back.step_s.to_bits(), given.step_s.to_bits());
        assert!(back.signals.keys().eq(given.signals.keys()));
        for (a, b) in back.signals.values().zip(given.signals.values()) {
            assert_eq!(a.marks, b.marks);
            let bits = |s: &Series| s.values.iter().map(|v| v.to_bits()).collect::<Vec<u64>>();
            assert_eq!(bits(a), bits(b));
        }
    }

    #[test]
    fn the_same_record_is_the_same_bytes() {
        assert_eq!(bytes(&record()), bytes(&record()));
    }

    /// A signal of several row groups and pages.
    fn long() -> Record {
        let samples = GROUP + 3 * PAGE + 77;
        let values: Vec<f64> = (0..samples).map(|k| (k as f64 * 0.01).sin()).collect();
        let mark = |k: usize| {
            if k % 1000 == 3 {
                Mark::Bridged
            } else {
                Mark::Measured
            }
        };
        let q = Series {
            values,
            marks: (0..samples).map(mark).collect(),
        };
        Record {
            samples,
            signals: [("q_deg_s".to_owned(), q)].into(),
            ..record()
        }
    }

    #[test]
    fn a_window_is_the_part_of_the_record() {
        let (given, (_folder, path)) = (long(), saved(&bytes(&long())));
        let file = open(&path).expect("a record");
        let (start_s, end_s) = (given.time_s(GROUP - 40), given.time_s(GROUP + 90));
        let (part, own) = (
            given.part(start_s, end_s),
            file.part(None, start_s, end_s).expect("a part"),
        );
        assert_eq!(own.signals, part.signals);
        assert_eq!(
            (own.samples, own.start_s.to_bits()),
            (part.samples, part.start_s.to_bits())
        );
        let none = BTreeSet::from(["mach".to_owned()]);
        assert!(
            file.window(Some(&none), 0..10)
                .expect("a window")
                .signals
                .is_empty()
        );
        assert_eq!(
            file.window(None, given.samples - 5..given.samples + 5)
                .expect("a window")
                .samples,
            5
        );
    }

    #[test]
    fn an_outline_keeps_the_extremes_and_the_marks() {
        let mut given = long();
        given
            .signals
            .values_mut()
            .for_each(|s| s.values[300_001] = 40.0);
        let (_folder, path) = saved(&bytes(&given));
        let outline = open(&path)
            .expect("a record")
            .outline(5000)
            .expect("an outline");
        let q = &outline.signals["q_deg_s"];
        assert!((4000..=5000).contains(&outline.samples) && q.values.len() == outline.samples);
        let k = q.values.iter().position(|v| *v > 2.0).expect("the peak");
        assert!((outline.time_s(k) - given.time_s(300_001)).abs() < 2.0 * outline.step_s);
        assert!(q.marks.contains(&Mark::Bridged));
    }

    #[test]
    fn constants_come_back_in_every_window() {
        let header = RecordHeader {
            samples: 3,
            step_s: 0.1,
            constants: [("mach".to_owned(), 0.3)].into(),
            ..RecordHeader::default()
        };
        let mut out = Vec::new();
        let mut writer = Writer::create(&header, ["obes"].into_iter(), &mut out).expect("a writer");
        let mut parts = writer.group().expect("a group").into_iter();
        let flag = Series {
            values: vec![0.0; 3],
            marks: vec![Mark::Measured; 3],
        };
        let mut next = || {
            let Some(mut signal) = parts.next() else {
                return Ok(None);
            };
            signal.push(&flag)?;
            Ok(Some(vec![signal.close()?]))
        };
        writer.append(&mut next).expect("appended");
        writer.finish().expect("finished");
        let (_folder, path) = saved(&out);
        let window = open(&path)
            .expect("a record")
            .window(None, 1..3)
            .expect("a window");
        assert_eq!(window.values("mach"), Some(&[0.3, 0.3][..]));
        assert_eq!(window.values("obes"), Some(&[0.0, 0.0][..]));
    }

    #[test]
    fn a_series_of_another_length_is_refused() {
        let mut short = record();
        if let Some(series) = short.signals.get_mut("obes") {
            series.values.pop();
        }
        assert!(
            write(&short, Vec::new())
                .expect_err("refused")
                .contains("has not 5 samples")
        );
    }

    #[test]
    fn what_is_not_a_record_is_refused_and_named() {
        let whole = bytes(&record());
        for broken in [&whole[..whole.len() / 2], b"PAR1", b""] {
            let (_folder, path) = saved(broken);
            let error = read(&path).expect_err("refused").to_string();
            assert!(error.contains("record.parquet: not a record"), "{error}");
        }
        assert!(read(Path::new("no such record.parquet")).is_err());
    }
}
