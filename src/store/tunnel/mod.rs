//! Wind-tunnel databases in CSV, Parquet or DAVE-ML, by the file's extension, read to the same
//! rows.

mod daveml;
#[cfg(test)]
mod tests;
mod xml_bounds;

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use polars::prelude::{Column, DataFrame, DataType, ParquetReader, SerReader};

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
    let frame = ParquetReader::new(Cursor::new(bytes))
        .finish()
        .map_err(|e| Error::config(path, None, e.to_string()))?;
    let table = Frame {
        path,
        frame: &frame,
    };
    let [derivative, unit, source] = ["derivative", "unit", "source"].map(|name| table.words(name));
    let numbers = |name: &str| table.numbers(name);
    let [alpha, mach, value, uncertainty] =
        ["alpha_deg", "mach", "value", "uncertainty"].map(numbers);
    let third = third.map_or(Ok(None), numbers)?;
    let (derivative, unit, source) = (derivative?, unit?, source?);
    let (alpha, mach, value, uncertainty) = (alpha?, mach?, value?, uncertainty?);
    let row = |i: usize| {
        let lacks = |name: &str| {
            Error::config(
                path,
                Some(i + 1),
                format!("column `{name}` has no value here, or is missing"),
            )
        };
        let at = |column: &Option<Vec<Option<f64>>>| {
            column.as_ref().and_then(|c| c.get(i).copied().flatten())
        };
        let word = |column: &Option<Vec<Option<String>>>| {
            column.as_ref().and_then(|c| c.get(i).cloned().flatten())
        };
        let row = TunnelRow {
            derivative: word(&derivative).ok_or_else(|| lacks("derivative"))?,
            alpha_deg: at(&alpha).ok_or_else(|| lacks("alpha_deg"))?,
            mach: at(&mach),
            value: at(&value).ok_or_else(|| lacks("value"))?,
            unit: word(&unit).ok_or_else(|| lacks("unit"))?,
            uncertainty: at(&uncertainty),
            source: word(&source),
            third: at(&third),
        };
        Ok((i + 1, row))
    };
    (0..frame.height()).map(row).collect()
}

/// Rows of a Parquet table.
struct Frame<'a> {
    path: &'a Path,
    frame: &'a DataFrame,
}

impl Frame<'_> {
    fn cast(&self, name: &str, to: &DataType) -> Result<Option<Column>> {
        let Ok(column) = self.frame.column(name) else {
            return Ok(None);
        };
        let cast = column.strict_cast(to);
        cast.map(Some)
            .map_err(|e| Error::config(self.path, None, format!("column `{name}`: {e}")))
    }

    fn numbers(&self, name: &str) -> Result<Option<Vec<Option<f64>>>> {
        let column = self.cast(name, &DataType::Float64)?;
        Ok(column.and_then(|c| c.f64().map(|c| c.iter().collect()).ok()))
    }

    fn words(&self, name: &str) -> Result<Option<Vec<Option<String>>>> {
        let column = self.cast(name, &DataType::String)?;
        Ok(column.and_then(|c| {
            c.str()
                .map(|c| c.iter().map(|w| w.map(str::to_owned)).collect())
                .ok()
        }))
    }
}
