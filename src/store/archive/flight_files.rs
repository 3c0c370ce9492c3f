//! Flights of an archive: the list of its files, and the files of each flight.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::file_rules::flight_id;
use super::glob_paths;
use super::remote;
use super::walk::Walk;
use crate::error::Error;
use crate::store::object;

/// Files of one flight, in the order of their names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FlightFiles {
    pub flight_id: String,
    pub files: Vec<PathBuf>,
    /// Files elsewhere in the archive that claim to be the same flight.
    pub rivals: Vec<PathBuf>,
}

/// Finds the flights of an archive, sorted by flight. An archive is a folder (searched for
/// `*.parquet` with its sub-folders), a glob or a single file. The files of one folder `flight=007`
/// are one flight of that name; any other file is a flight named by its stem.
///
/// # Errors
/// No file is found, or the archive's own folder cannot be read. An unreadable folder below it is
/// listed like an unreadable file.
pub fn find(archive: &str) -> Result<Vec<FlightFiles>, Error> {
    let mut files = BTreeSet::new();
    if object::is_object(Path::new(archive)) {
        files = remote::find(archive)?;
    } else if Path::new(archive).is_dir() {
        Walk::of_flights().add(Path::new(archive), &mut files)?;
    } else if let Some(at) = archive.find("**") {
        add_below(archive, at, &mut files)?;
    } else {
        let mut walk = Walk::of_flights();
        for path in glob_paths::matching(archive)? {
            if !path.is_dir() || walk.add(&path, &mut files).is_err() {
                files.insert(path);
            }
        }
    }
    if files.is_empty() {
        let what = "no flight records here: looked for files *.parquet in this folder and below it, or matching this glob";
        return Err(Error::not_found(Path::new(archive), what));
    }
    Ok(flights(files))
}

/// Adds the files of a glob with `**` at a place. The folders above it are searched as an archive
/// is, because a glob follows circular links.
fn add_below(archive: &str, at: usize, files: &mut BTreeSet<PathBuf>) -> Result<(), Error> {
    let (above, below) = archive.split_at(at);
    let above = match above.trim_end_matches('/') {
        "" if above.is_empty() => ".",
        "" => "/",
        above => above,
    };
    // `**` alone matches every flight below.
    let mut walk = if below.trim_end_matches('/') == "**" {
        Walk::of_flights()
    } else {
        Walk::of_files()
    };
    let mut found = BTreeSet::new();
    for folder in glob_paths::matching(above)?
        .iter()
        .filter(|path| path.is_dir())
    {
        walk.add(folder, &mut found)?;
    }
    let pattern = glob::Pattern::new(archive).map_err(|e| Error::Archive {
        place: archive.into(),
        what: format!("not a glob: {e}"),
    })?;
    let options = glob::MatchOptions {
        require_literal_separator: true,
        ..glob::MatchOptions::new()
    };
    let plain = |path: PathBuf| path.strip_prefix("./").map(Path::to_owned).unwrap_or(path);
    let is_wanted = |path: &PathBuf| path.is_dir() || pattern.matches_path_with(path, options);
    files.extend(found.into_iter().map(plain).filter(is_wanted));
    Ok(())
}

fn flights(files: BTreeSet<PathBuf>) -> Vec<FlightFiles> {
    let mut flights: BTreeMap<String, (PathBuf, FlightFiles)> = BTreeMap::new();
    for file in files {
        let (flight_id, source) = identity(&file);
        let new = || {
            let flight = FlightFiles {
                flight_id: flight_id.clone(),
                files: Vec::new(),
                rivals: Vec::new(),
            };
            (source.clone(), flight)
        };
        let (first, flight) = flights.entry(flight_id.clone()).or_insert_with(new);
        if *first == source {
            flight.files.push(file);
        } else {
            flight.rivals.push(file);
        }
    }
    flights.into_values().map(|(_, flight)| flight).collect()
}

/// Flight of a file, and the folder or file that holds the whole flight.
fn identity(file: &Path) -> (String, PathBuf) {
    for folder in file.ancestors().skip(1) {
        let name = folder
            .file_name()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default();
        if let Some((key, value)) = name.split_once('=')
            && matches!(key, "flight" | "flight_id")
            && !value.is_empty()
        {
            return (flight_id(value), folder.to_owned());
        }
    }
    let stem = file
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    (flight_id(&stem), file.to_owned())
}
