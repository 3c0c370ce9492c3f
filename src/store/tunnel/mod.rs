//! Wind-tunnel databases in CSV, Parquet or DAVE-ML, by the file's extension, read to the same
//! rows.

mod daveml;
#[cfg(test)]
mod tests;
mod xml_bounds;

use std::collections::BTreeMap;
use std::path::Path;

use arrow::array::{ArrayRef, AsArray, RecordBatch};
use arrow::compute::{CastOptions, cast_with_options, concat_batches};
use arrow::datatypes::{DataType, Float64Type};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use super::archive::guarded;
use super::files::{self, TunnelRow};
use crate::error::{Error, Result};

/// Reads the rows of a tunnel database, each with its line in the file (in Parquet its row, from
/// 1).
///
/// `third` names the third variable of the tables, if any. Of a DAVE-ML file only the functions of
/// the `wanted` variables are read: a model has many that are no derivatives.
///
/// # Errors
/// [`Error::Config`] naming file, line and column of what cannot be read.
pub fn rows(
    path: &Path,
    third: Option<&str>,
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<(usize, TunnelRow)>> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let rows = match extension.as_str() {
        "parquet" | "pq" => of_parquet(path, third),
        "dml" | "xml" => {
            let text = files::text(path)?;
            daveml::rows(&text, third, wanted)
                .map_err(|(line, what)| Error::config(path, line, what))
        }
        _ => of_csv(path, third),
    }?;
    if rows.is_empty() {
        return Err(Error::config(path, None, "the tunnel database has no rows"));
    }
    Ok(rows)
}

/// Columns that a tunnel database needs.
const COLUMNS: [&str; 4] = ["derivative", "alpha_deg", "value", "unit"];

/// Rows of a CSV with a header.
fn of_csv(path: &Path, third: Option<&str>) -> Result<Vec<(usize, TunnelRow)>> {
    let text = files::written(path)?;
    let mut rows: Vec<(usize, TunnelRow)> = files::rows(path, &text, &COLUMNS)?;
    let Some(third) = third else { return Ok(rows) };
    let fields: Vec<(usize, BTreeMap<String, String>)> = files::rows(path, &text, &[])?;
    for ((line, row), (_, fields)) in rows.iter_mut().zip(fields) {
        let Some(text) = fields.get(third).filter(|text| !text.is_empty()) else {
            continue;
        };
        let number = text.parse().map_err(|_| {
            Error::config(
                path,
                Some(*line),
                format!("column `{third}`: `{text}` is no number"),
            )
        });
        row.third = Some(number?);
    }
    Ok(rows)
}

fn of_parquet(path: &Path, third: Option<&str>) -> Result<Vec<(usize, TunnelRow)>> {
    let bytes = files::bytes(path)?;
    let batch = guarded(|| batch_of(bytes)).map_err(|reason| Error::config(path, None, reason))?;
    let table = ParquetTable {
        path,
        batch: &batch,
    };
    let columns = TunnelColumns::of(&table, third)?;
    (0..batch.num_rows())
        .map(|i| Ok((i + 1, columns.row(i, path)?)))
        .collect()
}

/// All rows of a Parquet file.
fn batch_of(bytes: Vec<u8>) -> Result<RecordBatch, String> {
    let unreadable = |e: &dyn std::fmt::Display| format!("not a readable Parquet file: {e}");
    let builder = ParquetRecordBatchReaderBuilder::try_new(bytes::Bytes::from(bytes))
        .map_err(|e| unreadable(&e))?;
    let schema = builder.schema().clone();
    let reader = builder.build().map_err(|e| unreadable(&e))?;
    let batches: Vec<RecordBatch> = reader
        .collect::<Result<_, _>>()
        .map_err(|e| unreadable(&e))?;
    concat_batches(&schema, &batches).map_err(|e| unreadable(&e))
}

/// Columns of a Parquet table; `None` for a column that it lacks.
struct TunnelColumns {
    derivative: Option<Vec<Option<String>>>,
    unit: Option<Vec<Option<String>>>,
    source: Option<Vec<Option<String>>>,
    alpha_deg: Option<Vec<Option<f64>>>,
    mach: Option<Vec<Option<f64>>>,
    value: Option<Vec<Option<f64>>>,
    uncertainty: Option<Vec<Option<f64>>>,
    third: Option<Vec<Option<f64>>>,
}

impl TunnelColumns {
    fn of(table: &ParquetTable, third: Option<&str>) -> Result<TunnelColumns> {
        Ok(TunnelColumns {
            third: third.map_or(Ok(None), |name| table.numbers(name))?,
            derivative: table.words("derivative")?,
            unit: table.words("unit")?,
            source: table.words("source")?,
            alpha_deg: table.numbers("alpha_deg")?,
            mach: table.numbers("mach")?,
            value: table.numbers("value")?,
            uncertainty: table.numbers("uncertainty")?,
        })
    }

    /// Row `i` of the table.
    fn row(&self, i: usize, path: &Path) -> Result<TunnelRow> {
        let lacks = |name: &str| {
            let what = format!("column `{name}` has no value here, or is missing");
            Error::config(path, Some(i + 1), what)
        };
        Ok(TunnelRow {
            derivative: at(self.derivative.as_ref(), i).ok_or_else(|| lacks("derivative"))?,
            alpha_deg: at(self.alpha_deg.as_ref(), i).ok_or_else(|| lacks("alpha_deg"))?,
            mach: at(self.mach.as_ref(), i),
            value: at(self.value.as_ref(), i).ok_or_else(|| lacks("value"))?,
            unit: at(self.unit.as_ref(), i).ok_or_else(|| lacks("unit"))?,
            uncertainty: at(self.uncertainty.as_ref(), i),
            source: at(self.source.as_ref(), i),
            third: at(self.third.as_ref(), i),
        })
    }
}

/// Value of a column in a row; `None` for a column that the table lacks.
fn at<T: Clone>(column: Option<&Vec<Option<T>>>, row: usize) -> Option<T> {
    column?.get(row).cloned().flatten()
}

/// Rows of a Parquet table.
struct ParquetTable<'a> {
    path: &'a Path,
    batch: &'a RecordBatch,
}

impl ParquetTable<'_> {
    /// A column in another type; `None` for one that the table lacks.
    fn column_as(&self, name: &str, to: &DataType) -> Result<Option<ArrayRef>> {
        let Some(column) = self.batch.column_by_name(name) else {
            return Ok(None);
        };
        let strict = CastOptions {
            safe: false,
            ..CastOptions::default()
        };
        cast_with_options(column, to, &strict)
            .map(Some)
            .map_err(|e| Error::config(self.path, None, format!("column `{name}`: {e}")))
    }

    fn numbers(&self, name: &str) -> Result<Option<Vec<Option<f64>>>> {
        let column = self.column_as(name, &DataType::Float64)?;
        Ok(column.map(|c| c.as_primitive::<Float64Type>().iter().collect()))
    }

    fn words(&self, name: &str) -> Result<Option<Vec<Option<String>>>> {
        let column = self.column_as(name, &DataType::Utf8)?;
        let texts = |column: ArrayRef| {
            let texts = column.as_string::<i32>();
            texts.iter().map(|word| word.map(str::to_owned)).collect()
        };
        Ok(column.map(texts))
    }
}
