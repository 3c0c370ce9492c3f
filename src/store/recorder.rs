//! Flights as a recorder writes them: Parquet, one column a channel in the recorder's unit, the
//! unit in the field's metadata.
//!
//! [`super::archive::read`] reads these files. A lost value is a null.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, RecordBatch};
use arrow::datatypes::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::properties::WriterProperties;

use super::archive::UNIT;
use crate::flight::channel::RawColumn;

/// Encodes columns of one length as the bytes of a Parquet file.
///
/// # Errors
/// The reason.
pub fn bytes(columns: &BTreeMap<String, RawColumn>) -> Result<Vec<u8>, String> {
    let field = |(name, column): (&String, &RawColumn)| {
        let unit = column
            .unit
            .iter()
            .map(|unit| (UNIT.to_owned(), unit.clone()));
        Field::new(name, DataType::Float64, true).with_metadata(unit.collect::<HashMap<_, _>>())
    };
    let array = |column: &RawColumn| {
        let values = column.values.iter().map(|v| v.is_finite().then_some(*v));
        Arc::new(values.collect::<Float64Array>()) as ArrayRef
    };
    let schema = Arc::new(Schema::new(columns.iter().map(field).collect::<Vec<_>>()));
    let batch = RecordBatch::try_new(schema.clone(), columns.values().map(array).collect())
        .map_err(|e| format!("cannot lay out the flight: {e}"))?;
    let level = ZstdLevel::try_new(3).map_err(|e| e.to_string())?;
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(level))
        .build();
    let refused = |e: parquet::errors::ParquetError| format!("cannot write the flight: {e}");
    let mut bytes = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut bytes, schema, Some(properties)).map_err(refused)?;
    writer.write(&batch).map_err(refused)?;
    writer.close().map_err(refused)?;
    Ok(bytes)
}
