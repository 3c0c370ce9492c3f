//! The published tables: columns to Parquet and CSV.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow::datatypes::{Field, Schema};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::reader::{FileReader, SerializedFileReader};
use polars::prelude::{CsvWriter, DataFrame, NamedFrom, PolarsError, SerWriter, Series};
use serde_json::json;

use super::{atomic, encoding, regular, visible_text};
use crate::error::{Error, Result};
use crate::schema::{Cells, Column, Row, Table};
use crate::tables::{ExportRow, FitRow, PredictedRow};

/// Folder of published tables, with the metadata of their Parquet files.
#[derive(Clone, Debug, Default)]
pub struct TableFolder {
    /// `None` publishes nothing.
    folder: Option<PathBuf>,
    provenance: Vec<(String, String)>,
}

impl TableFolder {
    /// A folder for tables without provenance.
    #[must_use]
    pub fn of(folder: &Path) -> TableFolder {
        TableFolder {
            folder: Some(folder.to_owned()),
            provenance: Vec::new(),
        }
    }

    /// Adds pairs to the key-value metadata of each Parquet file; the CSV beside it has no
    /// metadata.
    #[must_use]
    pub fn with(mut self, provenance: Vec<(String, String)>) -> TableFolder {
        self.provenance = provenance;
        self
    }
}

/// The key-value metadata of a published Parquet file.
///
/// # Errors
/// [`Error::Io`] or [`Error::Damaged`] naming the file.
pub fn provenance(path: &Path) -> Result<BTreeMap<String, String>> {
    let file = regular::open(path).map_err(Error::io(path, "cannot open the table"))?;
    let reader = SerializedFileReader::new(file).map_err(|e| Error::damaged(path, &e))?;
    let pairs = reader
        .metadata()
        .file_metadata()
        .key_value_metadata()
        .cloned()
        .unwrap_or_default();
    Ok(pairs
        .into_iter()
        .filter_map(|pair| Some((pair.key, pair.value?)))
        .collect())
}

/// Publishes `fits`: each fit beside the prediction of the same maneuver. Fits beyond the end of
/// `predicted` have none.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file.
pub fn publish_fits(
    shelf: &TableFolder,
    fits: &[FitRow],
    predicted: &[PredictedRow],
) -> Result<()> {
    let none = PredictedRow::default();
    let beside: Vec<&PredictedRow> = (0..fits.len())
        .map(|i| predicted.get(i).unwrap_or(&none))
        .collect();
    let mut columns = FitRow::columns(&fits.iter().collect::<Vec<_>>());
    columns.extend(PredictedRow::columns(&beside));
    place(shelf, FitRow::NAME, fits.len(), &columns)
}

/// Publishes the export's rows. The column `third` has the third variable's name, and is absent
/// without one.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file.
pub fn publish_export(shelf: &TableFolder, rows: &[ExportRow], third: Option<&str>) -> Result<()> {
    let columns = ExportRow::columns(&rows.iter().collect::<Vec<_>>());
    let named = columns.into_iter().filter_map(|mut column| {
        if column.name == ExportRow::THIRD {
            third?.clone_into(&mut column.name);
        }
        Some(column)
    });
    place(
        shelf,
        ExportRow::NAME,
        rows.len(),
        &named.collect::<Vec<_>>(),
    )
}

/// Publishes rows as `<name>.parquet` and `<name>.csv` on a shelf, each placed whole.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file.
pub fn publish<T: Table>(shelf: &TableFolder, rows: &[T]) -> Result<()> {
    publish_as(shelf, T::NAME, rows)
}

/// Publishes rows as [`publish`] does, under another name: a second table of the same columns.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file.
pub fn publish_as<T: Table>(shelf: &TableFolder, name: &str, rows: &[T]) -> Result<()> {
    let columns = T::columns(&rows.iter().collect::<Vec<_>>());
    place(shelf, name, rows.len(), &columns)
}

fn place(shelf: &TableFolder, name: &str, rows: usize, columns: &[Column]) -> Result<()> {
    let Some(folder) = &shelf.folder else {
        return Ok(());
    };
    let (parquet, csv) = (
        folder.join(format!("{name}.parquet")),
        folder.join(format!("{name}.csv")),
    );
    let mut metadata = shelf.provenance.clone();
    metadata.push((COLUMNS.to_owned(), explanations(columns)));
    let bytes = parquet_bytes(columns, metadata).map_err(|e| Error::store(&parquet, &e))?;
    atomic::place(&parquet, &bytes)?;
    let bytes = csv_bytes(columns, rows).map_err(|e| Error::store(&csv, &e))?;
    atomic::place(&csv, &bytes)
}

fn parquet_bytes(
    columns: &[Column],
    metadata: Vec<(String, String)>,
) -> Result<Vec<u8>, ParquetError> {
    let arrays: Vec<ArrayRef> = columns.iter().map(array).collect();
    let fields = columns
        .iter()
        .zip(&arrays)
        .map(|(column, array)| Field::new(&column.name, array.data_type().clone(), true));
    let schema = Schema::new(fields.collect::<Vec<_>>());
    let batch = RecordBatch::try_new(Arc::new(schema), arrays)?;
    let pairs = metadata
        .into_iter()
        .map(|(key, value)| KeyValue::new(key, value));
    let properties = encoding::properties()?.set_key_value_metadata(Some(pairs.collect()));
    encoding::bytes(&batch, properties.build())
}

fn array(column: &Column) -> ArrayRef {
    match &column.cells {
        Cells::Text(cells) => {
            let texts = cells.iter().map(|text| text.map(visible_text::of));
            Arc::new(texts.collect::<StringArray>())
        }
        Cells::Number(cells) => Arc::new(Float64Array::from(cells.clone())),
        Cells::Whole(cells) => Arc::new(Int64Array::from(cells.clone())),
    }
}

fn csv_bytes(columns: &[Column], rows: usize) -> Result<Vec<u8>, PolarsError> {
    let series = columns.iter().map(|column| series(column).into());
    let mut frame = DataFrame::new(rows, series.collect())?;
    let mut bytes = Vec::new();
    CsvWriter::new(&mut bytes).finish(&mut frame)?;
    Ok(bytes)
}

/// A column of a CSV, without text that a spreadsheet would take for a formula.
fn series(column: &Column) -> Series {
    let name = column.name.as_str().into();
    match &column.cells {
        Cells::Text(cells) => {
            let written = |text| no_formula(visible_text::of(text));
            let texts = cells.iter().map(|text| text.map(written));
            Series::new(name, texts.collect::<Vec<Option<Cow<str>>>>())
        }
        Cells::Number(cells) => Series::new(name, cells),
        Cells::Whole(cells) => Series::new(name, cells),
    }
}

/// Text with an apostrophe before it if a spreadsheet would take it for a formula. A single
/// character, such as the unit `-`, is never one.
fn no_formula(text: Cow<'_, str>) -> Cow<'_, str> {
    if text.len() > 1 && text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        format!("'{text}").into()
    } else {
        text
    }
}

/// Key of the Parquet metadata for the columns' units and explanations.
const COLUMNS: &str = "harvest.columns";

/// Name, unit and meaning of each column as JSON; the unit of text is null.
fn explanations(columns: &[Column]) -> String {
    let explain = |column: &Column| {
        json!({
            "name": column.name,
            "unit": Some(column.unit).filter(|unit| !unit.is_empty()),
            "meaning": column.explanation(),
        })
    };
    json!(columns.iter().map(explain).collect::<Vec<_>>()).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::{CheckRow, CheckVerdict};

    #[test]
    fn a_table_without_rows_has_its_columns() {
        let folder = tempfile::tempdir().unwrap();
        publish::<FitRow>(&TableFolder::of(folder.path()), &[]).unwrap();
        let csv = std::fs::read_to_string(folder.path().join("fits.csv")).unwrap();
        assert!(
            csv.starts_with(
                "maneuver_id,class,outcome,reason,start,iterations,initial_cost,final_cost,condition_number"
            )
        );
    }

    #[test]
    fn what_does_not_exist_is_an_empty_field() {
        let folder = tempfile::tempdir().unwrap();
        let row = CheckRow {
            flight_id: "f1".into(),
            relation: "theta rate, against q".into(),
            signals: "theta_deg q_deg_s".into(),
            slope: None,
            correlation: Some(f64::NAN),
            verdict: CheckVerdict::NotExcited,
        };
        publish(&TableFolder::of(folder.path()), &[row]).unwrap();
        let csv = std::fs::read_to_string(folder.path().join("checks.csv")).unwrap();
        assert_eq!(
            csv.lines().nth(1),
            Some("f1,\"theta rate, against q\",theta_deg q_deg_s,,,not excited")
        );
    }

    #[test]
    fn no_text_of_a_csv_is_a_formula_in_a_spreadsheet() {
        for (text, written) in [
            ("=1+1", "'=1+1"),
            ("-1", "'-1"),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("+x", "'+x"),
            ("\tx", "'\tx"),
            ("flights/a=1.parquet", "flights/a=1.parquet"),
            ("-", "-"),
            ("", ""),
        ] {
            assert_eq!(no_formula(text.into()), written);
        }
        let folder = tempfile::tempdir().unwrap();
        let row = CheckRow {
            flight_id: "=1+1".into(),
            relation: String::new(),
            signals: String::new(),
            slope: Some(-1.5),
            correlation: None,
            verdict: CheckVerdict::NotExcited,
        };
        publish(&TableFolder::of(folder.path()), std::slice::from_ref(&row)).unwrap();
        let csv = std::fs::read_to_string(folder.path().join("checks.csv")).unwrap();
        let written = csv.lines().nth(1).unwrap();
        assert!(
            written.starts_with("'=1+1,") && written.contains(",-1.5,"),
            "{written}"
        );
        let row = CheckRow {
            flight_id: "a\u{1}\u{202e}b".into(),
            ..row
        };
        publish(&TableFolder::of(folder.path()), &[row]).unwrap();
        let csv = std::fs::read_to_string(folder.path().join("checks.csv")).unwrap();
        assert!(csv.lines().nth(1).unwrap().starts_with("a__b,"), "{csv}");
    }

    #[test]
    fn parquet_has_the_unit_and_meaning_of_each_column() {
        let folder = tempfile::tempdir().unwrap();
        publish::<FitRow>(&TableFolder::of(folder.path()), &[]).unwrap();
        let metadata = provenance(&folder.path().join("fits.parquet")).unwrap();
        let columns: serde_json::Value = serde_json::from_str(&metadata[COLUMNS]).unwrap();
        assert_eq!(columns[0]["name"], "maneuver_id");
        assert_eq!(columns[0]["unit"], serde_json::Value::Null);
        assert_eq!(columns[5]["unit"], "1");
        assert_eq!(columns[5]["meaning"], "Number of steps of the iteration.");
    }
}
