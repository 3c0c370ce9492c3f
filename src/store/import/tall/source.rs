//! A tall file: its columns, and its rows in the order of the file.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{Array, AsArray, RecordBatch, StringArray};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Field, Float64Type};
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReader,
    ParquetRecordBatchReaderBuilder,
};

use crate::error::{Error, Result};
use crate::store::clock_column::{as_floats, is_clock, tick_unit};
use crate::store::import::imported_contents::refused;
use crate::store::object;
use crate::store::recorder::UNIT;
use crate::store::regular;
use crate::units::Unit;

/// Role of a column of a tall file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    Time,
    Name,
    Value,
    Unit,
}

impl Role {
    /// `true` if a column of this name has the role.
    #[must_use]
    pub fn has(self, name: &str) -> bool {
        let names: &[&str] = match self {
            Role::Time => &["time", "t", "timestamp", "time_s", "times", "zeit"],
            Role::Name => &[
                "name",
                "signal",
                "channel",
                "parameter",
                "variable",
                "tag",
                "sensor",
                "param",
                "kanal",
            ],
            Role::Value => &["value", "val", "data", "wert"],
            Role::Unit => &["unit", "units", "einheit"],
        };
        names.contains(&name.to_lowercase().as_str())
    }
}

/// Rows that are read at once.
const READ_ROWS: usize = 16_384;

/// A tall file and the names of its columns.
#[derive(Debug)]
pub struct Tall {
    pub(super) source: PathBuf,
    /// Set for an object.
    object: Option<object::Reader>,
    metadata: ArrowReaderMetadata,
    pub(super) time: String,
    pub(super) time_unit: Option<String>,
    pub(super) name: String,
    value: String,
    pub(super) unit: Option<String>,
}

/// Names of the columns that a tall file has.
struct Roles {
    time: String,
    name: String,
    value: String,
    unit: Option<String>,
}

/// Columns of a tall file of this schema; `None` for a schema that lacks time, name or value.
fn roles(fields: &[Arc<Field>]) -> Option<Roles> {
    let find = |role: Role| {
        let mut fields = fields.iter();
        fields
            .find(|f| role.has(f.name()))
            .map(|f| f.name().clone())
    };
    Some(Roles {
        time: find(Role::Time)?,
        name: find(Role::Name)?,
        value: find(Role::Value)?,
        unit: find(Role::Unit),
    })
}

impl Tall {
    /// Opens a file; `None` for a file that is not tall.
    ///
    /// # Errors
    /// [`Error::Archive`] for a file that is no readable Parquet.
    pub fn open(source: &Path) -> Result<Option<Tall>> {
        let file = regular::open(source)
            .map_err(|e| refused(source, &format!("cannot open the file: {e}")))?;
        let metadata = ArrowReaderMetadata::load(&file, ArrowReaderOptions::default())
            .map_err(|e| refused(source, &format!("not a readable Parquet file: {e}")))?;
        Ok(Tall::of(source, None, &metadata))
    }

    /// File or object with this footer; `None` for one that is not tall.
    #[must_use]
    pub fn of(
        source: &Path,
        object: Option<object::Reader>,
        metadata: &ArrowReaderMetadata,
    ) -> Option<Tall> {
        let schema = metadata.schema();
        let Roles {
            time,
            name,
            value,
            unit,
        } = roles(schema.fields())?;
        let field = schema.field_with_name(&time).ok();
        let is_clock = field.is_some_and(|f| is_clock(f.data_type()));
        let stated = field.and_then(|f| f.metadata().get(UNIT).cloned());
        Some(Tall {
            source: source.to_owned(),
            object,
            metadata: metadata.clone(),
            time,
            time_unit: if is_clock {
                Some("s".to_owned())
            } else {
                stated
            },
            name,
            value,
            unit,
        })
    }

    /// `true` if no column besides the clock is a mapped channel, and the names are text.
    #[must_use]
    pub fn is_unmapped(&self, is_channel: impl Fn(&str) -> bool) -> bool {
        let field = self.metadata.schema().field_with_name(&self.name).ok();
        let is_text = field.is_some_and(|f| is_text(f.data_type()));
        is_text && !is_channel(&self.name) && !is_channel(&self.value)
    }

    /// Units of the clock and of the wanted names that the file has, by name; empty where it states
    /// none. Reads no further than to the last of them.
    ///
    /// # Errors
    /// [`Error::Archive`] for a file that is no readable Parquet.
    pub fn units_of(&self, wanted: &BTreeSet<&str>) -> Result<BTreeMap<String, String>> {
        let of_clock = self.time_unit.clone().unwrap_or_default();
        let mut units = BTreeMap::from([(self.time.clone(), of_clock)]);
        for batch in self.batches()? {
            let batch = batch?;
            let names = self.texts(&batch, &self.name)?;
            let stated = self.unit.as_ref().map(|unit| self.texts(&batch, unit));
            let stated = stated.transpose()?;
            for row in 0..names.len() {
                let name = text(&names, row);
                if units.contains_key(name) || !wanted.contains(name) {
                    continue;
                }
                let unit = stated.as_ref().map_or("", |stated| text(stated, row));
                units.insert(name.to_owned(), unit.to_owned());
            }
            if wanted.iter().all(|name| units.contains_key(*name)) {
                break;
            }
        }
        Ok(units)
    }

    /// Passes each row on in the order of the file.
    pub(super) fn each(&self, row: &mut dyn FnMut(f64, &str, f64) -> Result<()>) -> Result<()> {
        for batch in self.batches()? {
            let batch = batch?;
            let names = self.texts(&batch, &self.name)?;
            let values = self.numbers(&batch, &self.value)?;
            let times = self.times(&batch)?;
            for (k, (time, value)) in times.into_iter().zip(values).enumerate() {
                row(time, text(&names, k), value)?;
            }
        }
        Ok(())
    }

    pub(super) fn batches(&self) -> Result<impl Iterator<Item = Result<RecordBatch>>> {
        let reader = self.reader()?;
        let source = self.source.clone();
        Ok(reader.map(move |batch| batch.map_err(|e| damaged(&source, &e))))
    }

    fn reader(&self) -> Result<ParquetRecordBatchReader> {
        let metadata = self.metadata.clone();
        let reader = if let Some(object) = &self.object {
            ParquetRecordBatchReaderBuilder::new_with_metadata(object.clone(), metadata)
                .with_batch_size(READ_ROWS)
                .build()
        } else {
            let file =
                File::open(&self.source).map_err(|e| refused(&self.source, &e.to_string()))?;
            ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata)
                .with_batch_size(READ_ROWS)
                .build()
        };
        reader.map_err(|e| damaged(&self.source, &e))
    }

    fn column<'b>(&self, batch: &'b RecordBatch, name: &str) -> Result<&'b dyn Array> {
        let column = batch.column_by_name(name).map(AsRef::as_ref);
        column.ok_or_else(|| {
            refused(
                &self.source,
                &format!("a part of the file lacks the column `{name}`"),
            )
        })
    }

    /// Times, s. Calendar times are in seconds since the calendar's beginning.
    pub(super) fn times(&self, batch: &RecordBatch) -> Result<Vec<f64>> {
        let unit = tick_unit(self.column(batch, &self.time)?.data_type());
        let seconds = |unit: &str| Unit::parse(unit).ok()?.factor_to(Unit::parse("s").ok()?);
        let numbers = self.numbers(batch, &self.time)?;
        Ok(match unit.and_then(seconds) {
            Some(tick) => numbers.into_iter().map(|t| t * tick).collect(),
            None => numbers,
        })
    }

    fn numbers(&self, batch: &RecordBatch, name: &str) -> Result<Vec<f64>> {
        let column = self.column(batch, name)?;
        let no_numbers = |_| refused(&self.source, &format!("column `{name}` holds no numbers"));
        let plain = as_floats(column).map_err(no_numbers)?;
        let numbers = plain.as_primitive::<Float64Type>();
        Ok(numbers.iter().map(|v| v.unwrap_or(f64::NAN)).collect())
    }

    pub(super) fn texts(&self, batch: &RecordBatch, name: &str) -> Result<StringArray> {
        let column = self.column(batch, name)?;
        let plain = cast(column, &DataType::Utf8)
            .map_err(|_| refused(&self.source, &format!("column `{name}` holds no text")))?;
        Ok(plain.as_string::<i32>().clone())
    }
}

/// Text of a row; empty for a null.
pub(super) fn text(texts: &StringArray, row: usize) -> &str {
    if texts.is_null(row) {
        ""
    } else {
        texts.value(row)
    }
}

fn damaged(source: &Path, e: &dyn std::fmt::Display) -> Error {
    refused(source, &format!("not a readable Parquet file: {e}"))
}

fn is_text(kind: &DataType) -> bool {
    match kind {
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => true,
        DataType::Dictionary(_, values) => is_text(values),
        _ => false,
    }
}
