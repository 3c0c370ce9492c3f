//! Flights read whole into memory, for tests and benchmarks.

use std::collections::BTreeMap;

use super::flight_files::FlightFiles;
use super::opened::open;
use crate::error::{Problem, ProblemStage};
use crate::flight::channel::{RawColumn, columns};
use crate::flight::{Channel, RawFlight};
use crate::ingest::ColumnSource;

/// Reads the mapped columns of a flight into memory, file by file.
///
/// # Errors
/// As [`open`]; a column that cannot be read.
pub fn read(
    files: &FlightFiles,
    channels: &BTreeMap<String, Channel>,
) -> Result<Vec<RawFlight>, Problem> {
    let scratch = std::env::temp_dir().join("archive");
    let opened = open(files, channels, &scratch).map_err(|e| Problem {
        stage: ProblemStage::Ingest,
        flight_id: files.flight_id.clone(),
        place: scratch.display().to_string(),
        reason: e.to_string(),
    })??;
    let columns = columns(channels);
    let one = |file: usize| {
        let mut flight = RawFlight {
            flight_id: files.flight_id.clone(),
            columns: BTreeMap::new(),
        };
        for name in columns.keys().filter(|name| opened.has(file, name)) {
            let unit = opened.unit(file, name).map(str::to_owned);
            let mut values = Vec::with_capacity(opened.rows(file));
            let read = opened.read(file, name, 0..opened.rows(file), &mut |v| {
                values.extend_from_slice(v);
            });
            read.map_err(|reason| Problem {
                stage: ProblemStage::Ingest,
                flight_id: files.flight_id.clone(),
                place: opened.name(file),
                reason,
            })?;
            flight
                .columns
                .insert(name.clone(), RawColumn { unit, values });
        }
        Ok(flight)
    };
    (0..opened.files()).map(one).collect()
}
