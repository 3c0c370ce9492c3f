//! Wind-tunnel databases in CSV, Parquet or DAVE-ML, by the file's extension, read to the same
//! rows.

mod daveml;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::Path;

use arrow_array::cast::AsArray;
use arrow_array::{Array, RecordBatch};
use bytes::Bytes;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use super::archive;
use super::files::{self, TunnelRow};
use super::numbers::numbers;
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

/// Rows of a CSV with a header.
fn of_csv(path: &Path, third: Option<&str>) -> Result<Vec<(usize, TunnelRow)>> {
    let mut rows: Vec<(usize, TunnelRow)> = files::rows(path)?;
    let Some(third) = third else { return Ok(rows) };
    let fields: Vec<(usize, BTreeMap<String, String>)> = files::rows(path)?;
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
    let refused = |what: String| Error::config(path, None, what);
    let batches =
        archive::guarded(|| batches(bytes).map_err(|e| e.to_string())).map_err(refused)?;
    let mut rows = Vec::new();
    for batch in &batches {
        rows.extend(Batch { path, batch }.rows(rows.len(), third)?);
    }
    Ok(rows)
}

fn batches(bytes: Vec<u8>) -> parquet::errors::Result<Vec<RecordBatch>> {
    let reader = ParquetRecordBatchReaderBuilder::try_new(Bytes::from(bytes))?.build()?;
    Ok(reader.collect::<std::result::Result<_, _>>()?)
}

/// Rows of a Parquet table.
struct Batch<'a> {
    path: &'a Path,
    batch: &'a RecordBatch,
}

impl Batch<'_> {
    /// Rows with their numbers, after `before` rows of earlier batches.
    fn rows(&self, before: usize, third: Option<&str>) -> Result<Vec<(usize, TunnelRow)>> {
        let [derivative, unit, source] =
            ["derivative", "unit", "source"].map(|name| self.words(name));
        let numbers = |name: &str| self.numbers(name);
        let [alpha, mach, value, uncertainty] =
            ["alpha_deg", "mach", "value", "uncertainty"].map(numbers);
        let third = third.map_or(Ok(Vec::new()), numbers)?;
        let (derivative, unit, source) = (derivative?, unit?, source?);
        let (alpha, mach, value, uncertainty) = (alpha?, mach?, value?, uncertainty?);
        let row = |i: usize| {
            let lacks = |name: &str| {
                let what = format!("column `{name}` has no value here, or is missing");
                Error::config(self.path, Some(before + i + 1), what)
            };
            let number = |column: &[Option<f64>]| column.get(i).copied().flatten();
            let word = |column: &[Option<String>]| column.get(i).cloned().flatten();
            let row = TunnelRow {
                derivative: word(&derivative).ok_or_else(|| lacks("derivative"))?,
                alpha_deg: number(&alpha).ok_or_else(|| lacks("alpha_deg"))?,
                mach: number(&mach),
                value: number(&value).ok_or_else(|| lacks("value"))?,
                unit: word(&unit).ok_or_else(|| lacks("unit"))?,
                uncertainty: number(&uncertainty),
                source: word(&source),
                third: number(&third),
            };
            Ok((before + i + 1, row))
        };
        (0..self.batch.num_rows()).map(row).collect()
    }

    /// A column of numbers, or of texts that are numbers; empty where the table has no such column.
    fn numbers(&self, name: &str) -> Result<Vec<Option<f64>>> {
        let Some(column) = self.batch.column_by_name(name) else {
            return Ok(Vec::new());
        };
        if let Some(numbers) = numbers(column) {
            return Ok(numbers.iter().collect());
        }
        let number = |text: Option<String>| {
            let Some(text) = text else { return Ok(None) };
            let refused = |_| self.refused(name, &format!("`{text}` is no number"));
            text.trim().parse().map(Some).map_err(refused)
        };
        self.words(name)?.into_iter().map(number).collect()
    }

    /// A column of texts; empty where the table has no such column.
    fn words(&self, name: &str) -> Result<Vec<Option<String>>> {
        let Some(column) = self.batch.column_by_name(name) else {
            return Ok(Vec::new());
        };
        let texts = texts(column);
        texts.ok_or_else(|| self.refused(name, &format!("type {} is no text", column.data_type())))
    }

    fn refused(&self, column: &str, what: &str) -> Error {
        Error::config(self.path, None, format!("column `{column}`: {what}"))
    }
}

/// Texts of an array, also of a dictionary (a category of pandas); `None` for other types.
fn texts(array: &dyn Array) -> Option<Vec<Option<String>>> {
    if let Some(dictionary) = array.as_any_dictionary_opt() {
        let words = texts(dictionary.values())?;
        if words.is_empty() {
            return Some(vec![None; array.len()]);
        }
        let keys = dictionary.normalized_keys();
        let word = |(row, key): (usize, usize)| {
            let word = words.get(key).cloned().flatten();
            word.filter(|_| array.is_valid(row))
        };
        return Some(keys.into_iter().enumerate().map(word).collect());
    }
    let owned = |text: Option<&str>| text.map(str::to_owned);
    if let Some(texts) = array.as_string_opt::<i32>() {
        return Some(texts.iter().map(owned).collect());
    }
    if let Some(texts) = array.as_string_opt::<i64>() {
        return Some(texts.iter().map(owned).collect());
    }
    let texts = array.as_string_view_opt()?;
    Some(texts.iter().map(owned).collect())
}
