//! Small text files: configuration, wind-tunnel database, the analyst's events, tables read back.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::{atomic, object, regular};
use crate::aero::wind_tunnel::TunnelPoint;
use crate::error::{Error, Result, did_you_mean};
use crate::maneuver::Event;
use crate::tables::PublishedTrend;

/// Reads a text file or object whole.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file.
pub fn text(path: &Path) -> Result<String> {
    if object::is_object(path) {
        let bytes = object::get(path).map_err(|e| e.at(path))?;
        let bytes = bytes.ok_or_else(|| Error::not_found(path, "there is no such object"))?;
        return String::from_utf8(bytes).map_err(|_| Error::config(path, None, "it is no text"));
    }
    String::from_utf8(bytes(path)?).map_err(|_| Error::config(path, None, "it is no text"))
}

/// Largest file that is read whole, bytes: a tunnel database of a million rows has a quarter of it.
const LARGEST_READ_WHOLE: u64 = 1 << 28;

/// Largest number of rows of a table that an analyst wrote: more than any tunnel's.
const MOST_ROWS: usize = 1_000_000;

/// Reads a file whole.
///
/// # Errors
/// [`Error::Io`], also for what is no file, such as a pipe; [`Error::Config`] for a file that is too
/// large.
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>> {
    let unreadable = |cause| Error::io(path, "cannot read it")(cause);
    let file = regular::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    file.take(LARGEST_READ_WHOLE + 1)
        .read_to_end(&mut bytes)
        .map_err(unreadable)?;
    if bytes.len() as u64 > LARGEST_READ_WHOLE {
        let what = "it is larger than 268 MB, more than any such file has";
        return Err(Error::config(path, None, what));
    }
    Ok(bytes)
}

/// Places a small text file or object, whole or not at all.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file.
pub fn place_text(path: &Path, text: &str) -> Result<()> {
    if object::is_object(path) {
        return object::put(path, text.as_bytes().to_vec()).map_err(|e| e.at(path));
    }
    atomic::place(path, text.as_bytes())
}

/// `true` for a folder that exists.
#[must_use]
pub fn is_folder(path: &Path) -> bool {
    path.is_dir()
}

/// `true` for a file that exists.
#[must_use]
pub fn is_file(path: &Path) -> bool {
    path.is_file()
}

/// Absolute path of the working folder.
///
/// # Errors
/// [`Error::Io`]: it was removed, or may not be read.
pub fn working_folder() -> Result<std::path::PathBuf> {
    std::env::current_dir().map_err(Error::io(Path::new("."), "there is no current folder"))
}

/// Temporary folder, removed when it is dropped.
///
/// # Errors
/// [`Error::Io`]: it cannot be created.
pub fn scratch_folder() -> Result<tempfile::TempDir> {
    tempfile::tempdir().map_err(Error::io(
        Path::new("."),
        "cannot create a temporary folder",
    ))
}

/// Path of the running program.
///
/// # Errors
/// [`Error::Io`]: the system does not report it.
pub fn program() -> Result<std::path::PathBuf> {
    std::env::current_exe().map_err(Error::io(Path::new("harvest"), "cannot find the program"))
}

/// Absolute path without links; `None` if there is no such file or folder.
#[must_use]
pub fn canonical(path: &Path) -> Option<std::path::PathBuf> {
    path.canonicalize().ok()
}

/// Files of a folder with this extension, sorted.
///
/// # Errors
/// [`Error::Io`] naming the folder.
pub fn with_extension(folder: &Path, extension: &str) -> Result<Vec<std::path::PathBuf>> {
    let entries = std::fs::read_dir(folder).map_err(Error::io(folder, "cannot list the folder"))?;
    let mut files: Vec<_> = entries
        .flatten()
        .map(|e| e.path())
        .filter(|p| p.extension().is_some_and(|e| e == extension))
        .collect();
    files.sort();
    Ok(files)
}

/// One line of a wind-tunnel table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TunnelRow {
    pub derivative: String,
    pub alpha_deg: f64,
    #[serde(default)]
    pub mach: Option<f64>,
    pub value: f64,
    pub unit: String,
    #[serde(default)]
    pub uncertainty: Option<f64>,
    #[serde(default)]
    pub source: Option<String>,
    /// Third variable, whose column the analyst names.
    #[serde(skip)]
    pub third: Option<f64>,
}

impl TunnelRow {
    #[must_use]
    pub fn point(&self) -> TunnelPoint {
        TunnelPoint {
            alpha_deg: self.alpha_deg,
            mach: self.mach,
            value: self.value,
            uncertainty: self.uncertainty,
            source: self.source.clone(),
        }
    }
}

/// Reads the analyst's events, CSV with columns `flight_id,class,start_s,end_s`, each with its line
/// number.
///
/// # Errors
/// [`Error::Config`] naming file, line and column of what cannot be read.
pub fn events(path: &Path) -> Result<Vec<(usize, Event)>> {
    let columns = ["flight_id", "class", "start_s", "end_s"];
    rows(path, &written(path)?, &columns)
}

/// Reads the rows of a published CSV. Columns that the row type lacks are ignored.
///
/// # Errors
/// [`Error::Io`] or [`Error::Config`] naming the file, and line and column of what cannot be read.
pub fn published<T: DeserializeOwned>(folder: &Path, table: &str) -> Result<Vec<T>> {
    let path = folder.join(format!("{table}.csv"));
    Ok(rows(&path, &text(&path)?, &[])?
        .into_iter()
        .map(|(_, row)| row)
        .collect())
}

/// Reads the columns of a CSV of numbers, by the names of its header.
///
/// # Errors
/// [`Error::Io`] for a file that cannot be opened, [`Error::Config`] naming the line of a value
/// that is no number.
pub fn columns(path: &Path) -> Result<BTreeMap<String, Vec<f64>>> {
    let text = text(path)?;
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let wrong = |e: &csv::Error| Error::config(path, None, e.to_string());
    let names: Vec<String> = reader
        .headers()
        .map_err(|e| wrong(&e))?
        .iter()
        .map(str::to_owned)
        .collect();
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    for row in reader.deserialize() {
        let row: Vec<f64> = row.map_err(|e| wrong(&e))?;
        columns
            .iter_mut()
            .zip(row)
            .for_each(|(column, value)| column.push(value));
    }
    Ok(names.into_iter().zip(columns).collect())
}

/// Reads the table `trends` of an earlier campaign's folder.
///
/// # Errors
/// [`Error::Config`] naming file, line and column of what cannot be read, or that the folder has no
/// such table.
pub fn earlier_trends(folder: &Path) -> Result<Vec<PublishedTrend>> {
    let path = folder.join("trends.csv");
    if !path.is_file() {
        let what = "nothing to compare against: an earlier campaign's folder of reports has the table trends.csv";
        return Err(Error::config(&path, None, what));
    }
    published(folder, "trends")
}

/// Places rows as CSV with a header, whole or not at all.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file.
pub fn place_rows<T: Serialize>(path: &Path, rows: &[T]) -> Result<()> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(|e| Error::store(path, &e))?;
    }
    let bytes = writer.into_inner().map_err(|e| Error::store(path, &e))?;
    atomic::place(path, &bytes)
}

/// Fault of a field in words.
fn fault(error: &csv::DeserializeError, value: &str) -> String {
    let point = value.replace(',', ".");
    if value.contains(',') && point.trim().parse::<f64>().is_ok() {
        format!("`{value}` has a decimal comma; write `{point}`")
    } else {
        error.kind().to_string()
    }
}

/// Format of a text that is no CSV, in words; `None` for a CSV.
fn other_form(text: &str) -> Option<&'static str> {
    let header = text.lines().find(|line| !line.trim().is_empty());
    let Some(header) = header else {
        return Some("the file is empty: its first line must name its columns");
    };
    match (
        header.contains(','),
        header.contains(';'),
        header.contains('\t'),
    ) {
        (false, true, _) => Some(
            "its columns are separated by semicolons; separate them by commas, and write numbers \
             with a decimal point",
        ),
        (false, _, true) => Some("its columns are separated by tabs; separate them by commas"),
        _ => None,
    }
}

/// Reads a CSV that an analyst wrote.
///
/// # Errors
/// As [`text`], and [`Error::Config`] for one of more rows than any tunnel has.
pub(super) fn written(path: &Path) -> Result<String> {
    let content = text(path)?;
    if content.bytes().filter(|byte| *byte == b'\n').count() > MOST_ROWS {
        let what = format!("it has more than {MOST_ROWS} lines");
        return Err(Error::config(path, None, what));
    }
    Ok(content)
}

/// Message for columns that a header lacks.
fn lacking(header: &csv::StringRecord, columns: &[&str]) -> Option<String> {
    let column = columns
        .iter()
        .find(|name| !header.iter().any(|own| own == **name))?;
    let near = did_you_mean(column, header.iter());
    Some(format!(
        "no column `{column}`{near}: the first line names the columns, among them {}",
        columns.join(", ")
    ))
}

/// Rows of a CSV that needs some columns, each with its line number.
///
/// # Errors
/// [`Error::Config`] naming the file, and line and column of what cannot be read.
pub(super) fn rows<T: DeserializeOwned>(
    path: &Path,
    content: &str,
    columns: &[&str],
) -> Result<Vec<(usize, T)>> {
    if let Some(what) = other_form(content) {
        return Err(Error::config(path, None, what));
    }
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(content.as_bytes());
    let header = reader.headers().cloned().unwrap_or_default();
    if let Some(what) = lacking(&header, columns) {
        return Err(Error::config(path, Some(1), what));
    }
    let line =
        |position: Option<&csv::Position>| position.and_then(|p| usize::try_from(p.line()).ok());
    let wrong = |e: csv::Error| Error::config(path, line(e.position()), e.to_string());
    let (mut rows, mut record) = (Vec::new(), csv::StringRecord::new());
    while reader.read_record(&mut record).map_err(wrong)? {
        let at = line(record.position());
        rows.push((
            at.unwrap_or(0),
            record.deserialize(Some(&header)).map_err(|e| {
                let column = match e.kind() {
                    csv::ErrorKind::Deserialize { err, .. } => {
                        let field = err.field().and_then(|f| usize::try_from(f).ok());
                        field
                            .and_then(|f| Some((header.get(f)?, record.get(f)?)))
                            .map(|(name, value)| format!("column `{name}`: {}", fault(err, value)))
                    }
                    _ => None,
                };
                Error::config(path, at, column.unwrap_or_else(|| e.to_string()))
            })?,
        ));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decimal_comma_and_too_many_rows_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.csv");
        let header = "flight_id,class,start_s,end_s\n";
        let error = |rows: &str| {
            std::fs::write(&path, format!("{header}{rows}")).unwrap();
            events(&path).unwrap_err().to_string()
        };
        let comma = error("f,A,\"11,5\",20\n");
        let wanted = ":2: column `start_s`: `11,5` has a decimal comma; write `11.5`";
        assert!(comma.ends_with(wanted), "{comma}");
        std::fs::write(&path, "f,A,11.5,20\n").unwrap();
        let error_without = events(&path).unwrap_err().to_string();
        assert!(
            error_without.contains(":1: no column `flight_id`"),
            "{error_without}"
        );
        let many = error(&"f,A,1,2\n".repeat(1_000_001));
        assert!(many.ends_with("it has more than 1000000 lines"), "{many}");
    }

    #[test]
    fn a_text_of_another_form_is_named_as_that() {
        let form = |text: &str| other_form(text).unwrap_or_default();
        assert!(form("").contains("is empty") && form(" \n\n").contains("is empty"));
        assert!(form("flight_id;start_s\n1;2,5").contains("semicolons"));
        assert!(form("flight_id\tstart_s").contains("tabs"));
        assert_eq!(other_form("flight_id,start_s"), None);
        assert_eq!(other_form("flight_id"), None);
    }
}
