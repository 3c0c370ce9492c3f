//! A record as a Parquet file: per signal a column of values and one of marks, the clock in the file's key-value metadata.
//!
//! Writing and reading back returns the record to the bit. Nothing but the record is in the bytes: no time, no host.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, AsArray, Float64Array, RecordBatch, RecordBatchOptions, UInt8Array};
use arrow::datatypes::{DataType, Field, Float64Type, Schema, UInt8Type};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};

use crate::error::Error;
use crate::flight::record::Series;
use crate::flight::{Mark, Record};

/// The end of the name of a signal's column of marks.
const MARK: &str = ":mark";

const FLIGHT: &str = "flight_id";
const START: &str = "start_s";
const STEP: &str = "step_s";
const SAMPLES: &str = "samples";

/// Writes a record as Parquet.
///
/// # Errors
/// The reason in words: a series of another length than the record, or a disk that said no.
pub fn write(record: &Record, out: impl Write + Send) -> Result<(), String> {
    let batch = batch(record).map_err(|e| format!("cannot lay out the record: {e}"))?;
    let level = ZstdLevel::try_new(1).map_err(|e| e.to_string())?;
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(level))
        .set_statistics_enabled(EnabledStatistics::None)
        .set_key_value_metadata(Some(clock(record)))
        .build();
    // Without the serialised Arrow schema, the key-value metadata is all there is and its order is ours.
    let options = ArrowWriterOptions::new().with_properties(properties).with_skip_arrow_metadata(true);
    let refused = |e: parquet::errors::ParquetError| format!("cannot write the record: {e}");
    let mut writer = ArrowWriter::try_new_with_options(out, batch.schema(), options).map_err(refused)?;
    writer.write(&batch).map_err(refused)?;
    writer.close().map_err(refused)?;
    Ok(())
}

fn clock(record: &Record) -> Vec<KeyValue> {
    vec![
        KeyValue::new(FLIGHT.to_owned(), record.flight_id.clone()),
        KeyValue::new(START.to_owned(), record.start_s.to_string()),
        KeyValue::new(STEP.to_owned(), record.step_s.to_string()),
        KeyValue::new(SAMPLES.to_owned(), record.samples.to_string()),
    ]
}

fn batch(record: &Record) -> Result<RecordBatch, arrow::error::ArrowError> {
    let (mut fields, mut arrays) = (Vec::new(), Vec::<ArrayRef>::new());
    for (name, series) in &record.signals {
        fields.push(Field::new(name, DataType::Float64, false));
        arrays.push(Arc::new(Float64Array::from(series.values.clone())));
        fields.push(Field::new(format!("{name}{MARK}"), DataType::UInt8, false));
        arrays.push(Arc::new(series.marks.iter().map(|m| *m as u8).collect::<UInt8Array>()));
    }
    let schema = Arc::new(Schema::new(fields));
    RecordBatch::try_new_with_options(schema, arrays, &RecordBatchOptions::new().with_row_count(Some(record.samples)))
}

/// Whether a record lies here whole, as far as its footer tells: one that was cut short or overwritten has none.
#[must_use]
pub fn is_whole(path: &Path) -> bool {
    File::open(path).is_ok_and(|file| {
        ParquetRecordBatchReaderBuilder::try_new(file).is_ok_and(|r| r.schema().metadata().contains_key(SAMPLES))
    })
}

/// Reads a record back.
///
/// # Errors
/// The file cannot be opened, is no Parquet file, or is not a record.
pub fn read(path: &Path) -> Result<Record, Error> {
    let file = File::open(path).map_err(Error::io(path, "cannot open the record"))?;
    let bad =
        |what: &dyn std::fmt::Display| Error::store(path, &format!("not a record; remove it and run again: {what}"));
    let reader = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| bad(&e))?;
    let metadata = reader.schema().metadata().clone();
    let text = |key: &str| metadata.get(key).ok_or_else(|| bad(&format!("its metadata has no `{key}`")));
    let number = |key: &str| text(key)?.parse::<f64>().map_err(|e| bad(&format!("`{key}`: {e}")));
    let samples = text(SAMPLES)?.parse::<usize>().map_err(|e| bad(&format!("`{SAMPLES}`: {e}")))?;
    let mut record = Record {
        flight_id: text(FLIGHT)?.clone(),
        start_s: number(START)?,
        step_s: number(STEP)?,
        samples,
        signals: BTreeMap::new(),
    };
    for batch in reader.build().map_err(|e| bad(&e))? {
        add(&mut record, &batch.map_err(|e| bad(&e))?).map_err(|e| bad(&e))?;
    }
    let whole = |s: &Series| s.values.len() == samples && s.marks.len() == samples;
    match record.signals.iter().find(|(_, s)| !whole(s)) {
        Some((name, _)) => Err(bad(&format!("signal `{name}` has not {samples} samples"))),
        None => Ok(record),
    }
}

fn add(record: &mut Record, batch: &RecordBatch) -> Result<(), String> {
    for (field, array) in batch.schema().fields().iter().zip(batch.columns()) {
        let name = field.name().strip_suffix(MARK).unwrap_or(field.name());
        let empty = || Series { values: Vec::new(), marks: Vec::new() };
        let series = record.signals.entry(name.to_owned()).or_insert_with(empty);
        let other = || format!("column `{}` is of type {}", field.name(), field.data_type());
        if field.name().ends_with(MARK) {
            let marks = array.as_primitive_opt::<UInt8Type>().ok_or_else(other)?;
            series.marks.extend(marks.values().iter().map(|code| Mark::from_u8(*code)));
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
        let values = vec![1.5, f64::from_bits(0x7ff8_0000_0000_0001), -0.0, 1e-310, 57.295_779_513_082_32];
        let marks = vec![Mark::Measured, Mark::Missing, Mark::Bridged, Mark::Despiked, Mark::Measured];
        let flag = Series { values: vec![0.0, 0.0, 1.0, 1.0, 1.0], marks: vec![Mark::Measured; 5] };
        Record {
            flight_id: "flight 007 ä".to_owned(),
            start_s: 0.1 + 0.2,
            step_s: 0.025_000_000_000_000_3,
            samples: 5,
            signals: [("alpha_vane_deg".to_owned(), Series { values, marks }), ("obes".to_owned(), flag)].into(),
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
        assert_eq!((&back.flight_id, back.samples), (&given.flight_id, given.samples));
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

    #[test]
    fn a_series_of_another_length_is_refused() {
        let mut short = record();
        if let Some(series) = short.signals.get_mut("obes") {
            series.values.pop();
        }
        assert!(write(&short, Vec::new()).expect_err("refused").starts_with("cannot lay out the record"));
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
