//! Import: recordings in other formats, written as Parquet of the archive with the units of the
//! columns. A manifest names the source of each file.
//!
//! CSV and tall Parquet are read row by row, in bounded memory. A MATLAB or HDF5 file is read
//! whole, since its columns follow one another.

mod calendar_time;
mod csv_header;
mod csv_layout;
mod csv_text;
mod csv_times;
mod delimited;
mod flight_file;
mod foreign;
mod gzip;
mod imported_contents;
mod matlab;
mod naming;
pub(super) mod tall;
mod tall_text;
mod time_order;
mod utf16;

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::{Digest, atomic, regular};
use crate::error::{Error, Result};
use crate::units::Unit;

use imported_contents::{ImportedContents, of_scratch, refused};

pub use imported_contents::{Imported, ImportedColumn};
pub use naming::Naming;

/// Name of the manifest in the folder of imported files.
const IMPORT_MANIFEST: &str = "import.json";

/// Extensions of files that may be recordings.
const EXTENSIONS: [&str; 12] = [
    "csv", "txt", "tsv", "tab", "prn", "lvm", "dat", "asc", "mat", "h5", "hdf5", "parquet",
];

/// Sources in a file or a folder, sorted.
///
/// # Errors
/// [`Error::Io`] or [`Error::NotFound`] naming the place.
pub fn sources(place: &Path) -> Result<Vec<PathBuf>> {
    if !place.is_dir() {
        return Ok(vec![place.to_owned()]);
    }
    let entries = std::fs::read_dir(place).map_err(Error::io(place, "cannot list the folder"))?;
    let paths = entries.flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> = paths.filter(|path| has_known_name(path)).collect();
    files.sort();
    if files.is_empty() {
        let what = format!(
            "no recording here: looked for files *.{}",
            EXTENSIONS.join(", *.")
        );
        return Err(Error::not_found(place, what));
    }
    Ok(files)
}

/// `true` for a file that is no Parquet, and whose name is that of a recording.
#[must_use]
pub fn is_foreign(source: &Path) -> bool {
    let is_parquet = || Format::of(source).is_ok_and(|format| format == Format::Parquet);
    let is_named_parquet = source
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("parquet"));
    source.is_file() && has_known_name(source) && !is_named_parquet && !is_parquet()
}

fn has_known_name(path: &Path) -> bool {
    let name = gzip::unpacked_name(path);
    let extension = name.extension().map(|e| e.to_string_lossy().to_lowercase());
    extension.is_some_and(|e| EXTENSIONS.contains(&e.as_str()))
}

/// File of the archive that a source becomes.
#[must_use]
pub fn target(source: &Path, folder: &Path) -> PathBuf {
    let name = gzip::unpacked_name(source);
    let stem = name.file_stem().map(|s| s.to_string_lossy().into_owned());
    folder.join(format!("{}.parquet", stem.unwrap_or_default()))
}

/// Imports a file into a folder, its columns named as the source or the analyst does.
///
/// # Errors
/// [`Error::Archive`] for a file that is no recording, with the reason; [`Error::Io`] for the disk.
pub fn import(source: &Path, folder: &Path, naming: &Naming) -> Result<Imported> {
    let file = target(source, folder);
    let same = source.canonicalize().ok().zip(file.canonicalize().ok());
    if same.is_some_and(|(a, b)| a == b) {
        return Err(refused(
            source,
            "the imported file would take its place: choose another folder",
        ));
    }
    let contents = match Format::of(source)? {
        Format::Gzip => {
            let unpacked = gzip::unpacked(source, folder)?;
            let place = unpacked.path();
            let contents = import_format(Format::of(place)?, place, &file, naming);
            // The temporary file is gone when the message is read.
            contents.map_err(|e| of_scratch(e, source))?
        }
        format => import_format(format, source, &file, naming)?,
    };
    let mut notes = contents.notes;
    notes.extend(unknown_units(&contents.columns));
    let digest = Digest::of_file(source)?;
    Ok(Imported {
        source: source.to_owned(),
        fingerprint: digest.blake3,
        file: contents.folder.unwrap_or(file),
        rows: contents.rows,
        columns: contents.columns,
        notes,
    })
}

fn import_format(
    format: Format,
    source: &Path,
    file: &Path,
    naming: &Naming,
) -> Result<ImportedContents> {
    match format {
        Format::Csv => csv_text::import(source, file, naming),
        Format::Utf16 => {
            let folder = file.parent().unwrap_or(file);
            let text = utf16::as_utf8(source, folder)?;
            csv_text::import(text.path(), file, naming).map_err(|e| of_scratch(e, source))
        }
        Format::Matlab => matlab::import_level_5(source, file, naming),
        Format::Hdf5 => matlab::import_hdf5(source, file, naming),
        Format::Parquet => tall::import(source, file, naming),
        Format::Gzip => Err(refused(source, "it is packed twice; unpack it first")),
    }
}

/// Note about units that harvest does not have.
fn unknown_units(columns: &[ImportedColumn]) -> Option<String> {
    let mut unknown: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for column in columns {
        let unit = column.unit.as_deref().map(str::trim).unwrap_or_default();
        if !unit.is_empty() && Unit::parse(unit).is_err() {
            unknown.entry(unit).or_default().push(&column.name);
        }
    }
    let in_words = |(unit, names): (&str, Vec<&str>)| format!("`{unit}` of {}", names.join(", "));
    let words: Vec<String> = unknown.into_iter().map(in_words).collect();
    let is_one = words.len() == 1;
    let what = if is_one {
        "this unit is"
    } else {
        "these units are"
    };
    (!words.is_empty()).then(|| {
        format!(
            "{what} unknown to harvest and kept as text: {}",
            words.join("; ")
        )
    })
}

/// `true` for the error of a text without numbers in a folder: a note beside the recordings.
#[must_use]
pub fn is_note_in(place: &Path, error: &Error) -> bool {
    let is_without_table =
        matches!(error, Error::Archive { what, .. } if what == csv_layout::NO_TABLE);
    place.is_dir() && is_without_table
}

/// Writes the manifest of imported files beside them.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the manifest.
pub fn write_manifest(folder: &Path, imported: &[Imported]) -> Result<PathBuf> {
    let path = folder.join(IMPORT_MANIFEST);
    let mut text = serde_json::to_string_pretty(imported).map_err(|e| Error::store(&path, &e))?;
    text.push('\n');
    atomic::place(&path, text.as_bytes())?;
    Ok(path)
}

/// First bytes of HDF5, at the beginning or behind MATLAB's header.
const HDF5_SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Format of a source, by its first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Csv,
    Utf16,
    Gzip,
    Matlab,
    Parquet,
    Hdf5,
}

impl Format {
    fn of(source: &Path) -> Result<Format> {
        let file = regular::open(source).map_err(Error::io(source, "cannot open it"))?;
        let mut head = Vec::new();
        file.take(520)
            .read_to_end(&mut head)
            .map_err(Error::io(source, "cannot read it"))?;
        let is_hdf5 = head.starts_with(HDF5_SIGNATURE)
            || head
                .get(512..)
                .is_some_and(|rest| rest.starts_with(HDF5_SIGNATURE));
        Ok(if head.starts_with(gzip::SIGNATURE) {
            Format::Gzip
        } else if is_hdf5 {
            Format::Hdf5
        } else if head.starts_with(b"MATLAB 5.0") {
            Format::Matlab
        } else if head.starts_with(b"PAR1") {
            Format::Parquet
        } else if source
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("mat"))
        {
            let what = "neither a MATLAB 5 file nor one of MATLAB 7.3: save it with `save('flight.mat', '-v7')`";
            return Err(refused(source, what));
        } else if utf16::SIGNATURES.iter().any(|mark| head.starts_with(mark)) {
            Format::Utf16
        } else if let Some(what) = foreign::foreign_format(source, &head) {
            return Err(refused(source, &what));
        } else {
            Format::Csv
        })
    }
}
