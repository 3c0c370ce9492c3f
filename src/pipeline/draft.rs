//! Draft of a pipeline for a recorder without a description, from its recordings.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::inspection::draft::{self, Draft};
use crate::inspection::{Inspection, inspect};
use crate::report::recording_page;
use crate::store::archive::{self, FlightFiles};
use crate::store::{atomic, files, import, unmapped_recording};

/// Largest number of rows that are read of a file: half an hour at 200 Hz.
const MOST_ROWS: usize = 360_000;
/// Largest number of files that are read: one maneuver a file, or a day's flights.
const MOST_FILES: usize = 24;

/// Files of a draft, and what was read for it.
#[derive(Debug)]
pub struct Drafted {
    pub folder: PathBuf,
    /// Page with the strip charts.
    pub page: PathBuf,
    pub inspection: Inspection,
    /// Number of files read, and number of files found.
    pub files: (usize, usize),
}

/// Inspects recordings and writes a pipeline's folder, with a page of strip charts beside its reports.
///
/// # Errors
/// The folder exists; no recording is found or readable; no column counts time; the disk failed.
pub fn write(name: &str, from: &[String]) -> Result<Drafted> {
    let folder = Path::new("pipelines").join(name);
    if files::is_folder(&folder) {
        let what =
            "there is a pipeline of this name already; choose another name, or remove it first";
        return Err(Error::config(&folder, None, what));
    }
    let mut flights: Vec<FlightFiles> = Vec::new();
    for place in from {
        flights.extend(flights_in(place, name)?);
    }
    let (mut recordings, mut found) = (Vec::new(), 0);
    for flight in &flights {
        found += flight.files.len();
        if recordings.len() < MOST_FILES {
            recordings.extend(unmapped_recording::first_rows(flight, MOST_ROWS)?);
        }
    }
    let read = recordings.len();
    let archive = archive_of(from);
    let inspection = inspect(&recordings).map_err(|what| Error::Archive {
        place: archive.clone().into(),
        what,
    })?;
    let draft = Draft {
        name,
        archive: &archive,
        inspection: &inspection,
    };
    let page = Path::new("reports").join(name).join("recording.html");
    let html = recording_page(name, &inspection).map_err(|e| Error::store(&page, &e))?;
    atomic::place(&page, html.as_bytes())?;
    for file in draft::files(&draft) {
        atomic::place(&folder.join(&file.path), file.text.as_bytes())?;
    }
    Ok(Drafted {
        folder,
        page,
        inspection,
        files: (read, found),
    })
}

/// Flights in a place. The error for recordings of another format names the command that imports
/// them.
fn flights_in(place: &str, name: &str) -> Result<Vec<FlightFiles>> {
    let found = archive::find(place);
    let files: Vec<PathBuf> = match &found {
        Ok(flights) => flights
            .iter()
            .flat_map(|flight| flight.files.clone())
            .collect(),
        Err(_) => import::sources(Path::new(place)).unwrap_or_default(),
    };
    let is_foreign = files.iter().any(|file| import::is_foreign(file));
    if !is_foreign {
        return found;
    }
    let to = format!("data/{name}/flights");
    let what = format!(
        "no Parquet, but recordings that `harvest import` reads: first `harvest import {place} --to {to}`, then `harvest init \
         {name} --from {to}`"
    );
    Err(Error::Archive {
        place: place.into(),
        what,
    })
}

/// Archive that holds all places: the place itself, or the folder of several.
fn archive_of(from: &[String]) -> String {
    match from {
        [one] => one.clone(),
        several => {
            let parents = several.iter().filter_map(|place| Path::new(place).parent());
            let shortest = parents.min_by_key(|parent| parent.components().count());
            let folder = shortest.filter(|folder| !folder.as_os_str().is_empty());
            folder.unwrap_or(Path::new(".")).display().to_string()
        }
    }
}
