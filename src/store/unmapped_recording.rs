//! Recordings without a channel map: all columns of numbers.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use arrow::datatypes::DataType;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};

use super::archive::{FlightFiles, guarded, open};
use super::atomic::Draft;
use super::clock_column::is_clock;
use super::import::tall::Tall;
use super::recorder::UNIT;
use super::regular;
use crate::error::{Error, Result};
use crate::flight::{Channel, signal};
use crate::ingest::ColumnSource;
use crate::inspection::{Column, Recording};

/// Reads all columns of numbers of a flight's files, the first rows of each.
///
/// # Errors
/// [`Error::Archive`] naming a file that cannot be read.
pub fn first_rows(files: &FlightFiles, rows: usize) -> Result<Vec<Recording>> {
    let mut recordings = Vec::new();
    for path in &files.files {
        let wide = widened(path)?;
        let mut places: Vec<&Path> = wide.iter().map(Draft::draft).collect();
        if places.is_empty() {
            places.push(path);
        }
        for file in places {
            recordings.push(first_rows_of(path, file, rows)?);
        }
    }
    Ok(recordings)
}

/// Reads the first rows of a file, whose content may be at another path.
fn first_rows_of(path: &Path, file: &Path, rows: usize) -> Result<Recording> {
    let refused = |what: String| Error::Archive {
        place: path.to_owned(),
        what,
    };
    let channels = guarded(|| channels(file)).map_err(refused)?;
    let one = FlightFiles {
        flight_id: String::new(),
        files: vec![file.to_owned()],
        rivals: Vec::new(),
    };
    let opened = open(&one, &channels, &scratch())?;
    let opened = opened.map_err(|problem| refused(problem.reason))?;
    let column = |(name, channel): (&String, &Channel)| {
        let mut values = Vec::new();
        let range = 0..opened.rows(0).min(rows);
        opened
            .read(0, name, range, &mut |v| values.extend_from_slice(v))
            .map_err(refused)?;
        let is_clock = channel.signal == signal::TIME;
        let stated = opened.unit(0, name).map(str::to_owned);
        Ok(Column {
            name: name.clone(),
            stated: stated.or_else(|| is_clock.then(|| channel.unit.clone())),
            values,
        })
    };
    Ok(Recording {
        name: path.display().to_string(),
        columns: channels.iter().map(column).collect::<Result<_>>()?,
    })
}

/// Path beside which temporary files are written.
fn scratch() -> PathBuf {
    std::env::temp_dir().join("recording")
}

/// The parts of a tall file with one column per name; empty for another file.
fn widened(path: &Path) -> Result<Vec<Draft>> {
    let refused = |what: String| Error::Archive {
        place: path.to_owned(),
        what,
    };
    let widen = || {
        let tall = Tall::open(path)?.filter(|tall| tall.is_unmapped(|_| false));
        tall.map_or(Ok(Vec::new()), |tall| tall.widened(&scratch(), |_| true))
    };
    guarded(|| Ok(widen())).map_err(refused)?
}

/// A channel for each column of numbers or times. Times of day count in seconds.
fn channels(path: &Path) -> Result<BTreeMap<String, Channel>, String> {
    let file = regular::open(path).map_err(|e| format!("cannot open the file: {e}"))?;
    let metadata = ArrowReaderMetadata::load(&file, ArrowReaderOptions::default())
        .map_err(|e| {
            format!("not a readable Parquet file: {e}; `harvest import` makes one of CSV, MATLAB or HDF5")
        })?;
    let fields = metadata.schema().fields().iter();
    let channel = |field: &arrow::datatypes::FieldRef| {
        let kind = field.data_type();
        let is_clock = is_clock(kind);
        let is_number = kind.is_numeric() || *kind == DataType::Boolean;
        let unit = field.metadata().get(UNIT).cloned();
        let (signal, unit) = if is_clock {
            (signal::TIME.to_owned(), "s".to_owned())
        } else {
            (field.name().clone(), unit.unwrap_or_default())
        };
        (is_clock || is_number).then(|| (field.name().clone(), Channel::plain(&signal, &unit)))
    };
    Ok(fields.filter_map(channel).collect())
}
