//! Flights as a recorder writes them: Parquet, one column a channel in the recorder's unit, the
//! unit in the field's metadata.
//!
//! [`super::archive::read`] reads these files. A lost value is a null.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, RecordBatch, StringDictionaryBuilder};
use arrow::datatypes::{DataType, Field, Int32Type, Schema};

use super::encoding;
use crate::flight::channel::RawColumn;

/// Key of the field metadata that states a column's unit.
pub(super) const UNIT: &str = "unit";

/// Largest number of rows that are encoded or decoded at a time: 128 kB of a column. A file of ten
/// columns needs a few MB, whatever the size of its row groups.
pub(super) const BATCH_ROWS: usize = 16_384;

/// Encodes columns of one length as the bytes of a Parquet file.
///
/// # Errors
/// The reason.
pub fn bytes(columns: &BTreeMap<String, RawColumn>) -> Result<Vec<u8>, String> {
    let heads = columns
        .iter()
        .map(|(name, c)| (name.as_str(), c.unit.as_deref()));
    let schema = schema(heads);
    let arrays = columns.values().map(|column| array(&column.values));
    let batch = RecordBatch::try_new(schema, arrays.collect())
        .map_err(|e| format!("cannot lay out the flight: {e}"))?;
    encode(&batch)
}

/// Encodes columns of one length, one of them the clock, as a tall Parquet file with time, name and
/// value, sorted by time and name. A value that is not finite has no row.
///
/// # Errors
/// The reason.
pub fn tall_bytes(time: &str, columns: &BTreeMap<String, RawColumn>) -> Result<Vec<u8>, String> {
    let clock = columns.get(time).ok_or("a tall file needs a clock")?;
    let (mut times, mut values) = (Vec::new(), Vec::new());
    let mut names = StringDictionaryBuilder::<Int32Type>::new();
    for (row, at) in clock.values.iter().enumerate() {
        let others = columns.iter().filter(|(name, _)| *name != time);
        for (name, column) in others {
            let value = column.values.get(row).copied();
            if let Some(value) = value.filter(|value| value.is_finite()) {
                times.push(*at);
                names.append_value(name);
                values.push(value);
            }
        }
    }
    let columns: [(&str, ArrayRef); 3] = [
        (time, array(&times)),
        ("name", Arc::new(names.finish())),
        ("value", array(&values)),
    ];
    let batch = RecordBatch::try_from_iter(columns)
        .map_err(|e| format!("cannot lay out the flight: {e}"))?;
    encode(&batch)
}

fn encode(batch: &RecordBatch) -> Result<Vec<u8>, String> {
    encoding::properties()
        .and_then(|properties| encoding::bytes(batch, properties.build()))
        .map_err(|e| format!("cannot write the flight: {e}"))
}

/// Schema of columns with their units.
pub(super) fn schema<'a>(columns: impl Iterator<Item = (&'a str, Option<&'a str>)>) -> Arc<Schema> {
    let field = |(name, unit): (&str, Option<&str>)| {
        let unit = unit.map(|unit| (UNIT.to_owned(), unit.to_owned()));
        let metadata: HashMap<String, String> = unit.into_iter().collect();
        Field::new(name, DataType::Float64, true).with_metadata(metadata)
    };
    Arc::new(Schema::new(columns.map(field).collect::<Vec<_>>()))
}

/// Values as a column; a value that is not finite is a null.
pub(super) fn array(values: &[f64]) -> ArrayRef {
    let values = values.iter().map(|v| v.is_finite().then_some(*v));
    Arc::new(values.collect::<Float64Array>())
}
