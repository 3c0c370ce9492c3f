//! Recordings whose channels nobody has mapped: all columns of numbers.

use std::collections::BTreeMap;
use std::path::Path;

use arrow::datatypes::DataType;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};

use super::archive::{FlightFiles, UNIT, guarded, open};
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
        let refused = |what: String| Error::Archive {
            place: path.clone(),
            what,
        };
        let channels = guarded(|| channels(path)).map_err(refused)?;
        let one = FlightFiles {
            flight_id: files.flight_id.clone(),
            files: vec![path.clone()],
            rivals: Vec::new(),
        };
        let opened = open(&one, &channels).map_err(|problem| refused(problem.reason))?;
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
        recordings.push(Recording {
            name: path.display().to_string(),
            columns: channels.iter().map(column).collect::<Result<_>>()?,
        });
    }
    Ok(recordings)
}

/// A channel for each column of numbers or times. Times of day count in seconds.
fn channels(path: &Path) -> Result<BTreeMap<String, Channel>, String> {
    let file = std::fs::File::open(path).map_err(|e| format!("cannot open the file: {e}"))?;
    let metadata = ArrowReaderMetadata::load(&file, ArrowReaderOptions::default())
        .map_err(|e| format!("not a readable Parquet file: {e}"))?;
    let fields = metadata.schema().fields().iter();
    let channel = |field: &arrow::datatypes::FieldRef| {
        let kind = field.data_type();
        let is_clock = matches!(kind, DataType::Timestamp(..) | DataType::Duration(_));
        let is_number = kind.is_numeric() || *kind == DataType::Boolean;
        let unit = field.metadata().get(UNIT).cloned();
        let (signal, unit) = if is_clock {
            (signal::TIME.to_owned(), "s".to_owned())
        } else {
            (field.name().clone(), unit.unwrap_or_default())
        };
        (is_clock || is_number).then(|| {
            let channel = Channel {
                signal,
                unit,
                sign: 1.0,
                scale: 1.0,
                wraps_at: None,
            };
            (field.name().clone(), channel)
        })
    };
    Ok(fields.filter_map(channel).collect())
}
