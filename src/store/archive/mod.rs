//! The archive: Parquet files of flights in a folder, under a glob, or in a hive-partitioned tree;
//! or objects of an object store under the same names.
//!
//! Only the columns of the channel map are read, one at a time, page by page, into numbers. A tall
//! file (time, name, value) is first written with one column a name. A fault of a file is a problem
//! of its flight, never a panic.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::ops::Range;
use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};
use std::sync::Once;

use arrow::array::{Array, AsArray, RecordBatch};
use arrow::datatypes::{DataType, Field, Float64Type};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder, RowSelection,
};
use parquet::file::metadata::PageIndexPolicy;
use parquet::file::reader::ChunkReader;

use crate::error::{Error, Problem, ProblemStage};
use crate::flight::channel::{RawColumn, columns};
use crate::flight::{Channel, RawFlight};
use crate::ingest::ColumnSource;
use crate::units::Unit;

use super::atomic::Draft;
use super::clock_column::{as_floats, tick_unit};
use super::import::tall::Tall;
use super::object;
use super::recorder::UNIT;
use file_rules::{flight_id, unreadable};
use walk::Walk;

/// Files of one flight, in the order of their names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FlightFiles {
    pub flight_id: String,
    pub files: Vec<PathBuf>,
    /// Files elsewhere in the archive that claim to be the same flight.
    pub rivals: Vec<PathBuf>,
}

/// Rows decoded at a time: a few MB for row groups of any size.
const BATCH_ROWS: usize = 16_384;

/// Most numbers of a file, rows times mapped columns: more than ten hours of sixty channels at 200
/// Hz. A damaged file of a few kilobytes can claim any number of rows.
const LARGEST_FILE: u64 = 500_000_000;

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
        for path in matches(archive)? {
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

/// Paths that match a glob.
fn matches(pattern: &str) -> Result<Vec<PathBuf>, Error> {
    let nonsense = |what: String| Error::Archive {
        place: pattern.into(),
        what,
    };
    let paths = glob::glob(pattern).map_err(|e| nonsense(format!("not a glob: {e}")))?;
    let paths = paths.map(|path| path.map_err(|e| nonsense(e.to_string())));
    paths.collect()
}

/// Adds the files of a glob with `**` at a place: the folders above it are searched as an archive is,
/// because a glob follows links in circles.
fn add_below(archive: &str, at: usize, files: &mut BTreeSet<PathBuf>) -> Result<(), Error> {
    let (above, below) = archive.split_at(at);
    let above = match above.trim_end_matches('/') {
        "" if above.is_empty() => ".",
        "" => "/",
        above => above,
    };
    // `**` alone is every flight below.
    let mut walk = if below.trim_end_matches('/') == "**" {
        Walk::of_flights()
    } else {
        Walk::of_files()
    };
    let mut found = BTreeSet::new();
    for folder in matches(above)?.iter().filter(|path| path.is_dir()) {
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

thread_local! {
    /// `true` while this thread reads a file whose panic is not printed.
    static READING: Cell<bool> = const { Cell::new(false) };
}

/// Files of a flight with their footers. Columns are read one at a time, so memory holds one page
/// of one column.
#[derive(Debug)]
pub struct Opened {
    flight_id: String,
    files: Vec<OpenFile>,
}

#[derive(Debug)]
struct OpenFile {
    path: PathBuf,
    /// Set for an object.
    object: Option<object::Reader>,
    /// Set for a tall file: a part of its content with one column a name.
    wide: Option<Draft>,
    metadata: ArrowReaderMetadata,
    columns: BTreeMap<String, OpenColumn>,
    rows: usize,
}

#[derive(Debug)]
struct OpenColumn {
    at: usize,
    unit: Option<String>,
    /// Factor from the ticks of timestamps and durations to the channel map's unit.
    clock_factor: Option<f64>,
}

/// Opens the files of a flight. A tall file is written with one column a name beside `scratch`, into
/// files that go with the flight.
///
/// # Errors
/// A fault of the disk. Inside, a problem of the flight: a file that is no readable Parquet, or a
/// mapped column that is not numbers.
pub fn open(
    files: &FlightFiles,
    channels: &BTreeMap<String, Channel>,
    scratch: &Path,
) -> Result<Result<Opened, Problem>, Error> {
    let columns = columns(channels);
    let mut opened = Vec::with_capacity(files.files.len());
    for path in &files.files {
        let file = guarded(|| match open_file(path, &columns, scratch) {
            Err(Error::Archive { what, .. }) => Err(what),
            opened => Ok(opened),
        });
        match file {
            Ok(parts) => opened.extend(parts?),
            Err(reason) => {
                return Ok(Err(Problem {
                    stage: ProblemStage::Ingest,
                    flight_id: files.flight_id.clone(),
                    place: path.display().to_string(),
                    reason,
                }));
            }
        }
    }
    Ok(Ok(Opened {
        flight_id: files.flight_id.clone(),
        files: opened,
    }))
}

/// Runs the Parquet reader and treats its panic as a fault of the file. The panic is not printed:
/// its reason becomes a problem.
pub(super) fn guarded<T>(read: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !READING.get() {
                before(info);
            }
        }));
    });
    let outside = READING.replace(true);
    let result = panic::catch_unwind(AssertUnwindSafe(read));
    READING.set(outside);
    result.unwrap_or_else(|_| {
        Err("the Parquet reader gave up on its bytes; copy it again from its source".to_owned())
    })
}

/// Opens one file, which is several if it is tall and its names have several clocks.
///
/// # Errors
/// [`Error::Archive`] for a fault of the file, another one for a fault of the disk.
fn open_file(
    path: &Path,
    channels: &BTreeMap<String, Channel>,
    scratch: &Path,
) -> Result<Vec<OpenFile>, Error> {
    let refused = |what: String| Error::Archive {
        place: path.to_owned(),
        what,
    };
    let object = object::is_object(path)
        .then(|| object::Reader::open(path))
        .transpose()
        .map_err(|e| refused(e.to_string()))?;
    let metadata = footer(path, object.as_ref()).map_err(refused)?;
    let is_channel = |name: &str| channels.contains_key(name);
    let tall = Tall::of(path, object.clone(), &metadata);
    let Some(tall) = tall.filter(|tall| tall.is_unmapped(is_channel)) else {
        let opened = open_columns(path, channels, metadata).map_err(refused)?;
        return Ok(vec![OpenFile { object, ..opened }]);
    };
    check_size(&metadata, 1).map_err(refused)?;
    let wide = tall.widened(scratch, is_channel).map_err(|e| {
        // A fault of the network is the reason for what the reader says.
        match object::failed(path) {
            Some(failed) if matches!(e, Error::Archive { .. }) => refused(failed),
            _ => e,
        }
    })?;
    let open_part = |wide: Draft| {
        let metadata = footer(wide.draft(), None).map_err(refused)?;
        let opened = open_columns(path, channels, metadata).map_err(refused)?;
        Ok(OpenFile {
            wide: Some(wide),
            ..opened
        })
    };
    wide.into_iter().map(open_part).collect()
}

/// Footer of a file or object.
fn footer(path: &Path, object: Option<&object::Reader>) -> Result<ArrowReaderMetadata, String> {
    if let Some(object) = object {
        // The page index of an object avoids fetching other pages.
        let options =
            ArrowReaderOptions::default().with_offset_index_policy(PageIndexPolicy::Optional);
        return ArrowReaderMetadata::load(object, options).map_err(|e| remote::why(path, &e));
    }
    let opened = File::open(path).map_err(|e| format!("cannot open the file: {e}"))?;
    ArrowReaderMetadata::load(&opened, ArrowReaderOptions::default()).map_err(|e| unreadable(&e))
}

/// The mapped columns of a file with one column a channel.
fn open_columns(
    path: &Path,
    channels: &BTreeMap<String, Channel>,
    metadata: ArrowReaderMetadata,
) -> Result<OpenFile, String> {
    let mut columns = BTreeMap::new();
    for (at, field) in metadata.schema().fields().iter().enumerate() {
        let Some(channel) = channels.get(field.name()) else {
            continue;
        };
        refuse_other_types(field, Some(channel))?;
        let unit = field.metadata().get(UNIT).cloned();
        let column = OpenColumn {
            at,
            unit,
            clock_factor: clock_factor(field.data_type(), Some(channel)),
        };
        if columns.insert(field.name().clone(), column).is_some() {
            return Err(format!("two columns are named `{}`", field.name()));
        }
    }
    let rows = check_size(&metadata, columns.len())?;
    Ok(OpenFile {
        path: path.to_owned(),
        object: None,
        wide: None,
        metadata,
        columns,
        rows,
    })
}

/// Number of rows of a file.
///
/// # Errors
/// In words, for a file that claims more than any recorder writes.
fn check_size(metadata: &ArrowReaderMetadata, columns: usize) -> Result<usize, String> {
    let claimed = |rows: i64| u64::try_from(rows).unwrap_or(u64::MAX);
    let in_groups = metadata
        .metadata()
        .row_groups()
        .iter()
        .map(|g| claimed(g.num_rows()));
    let all = claimed(metadata.metadata().file_metadata().num_rows());
    let most = in_groups.fold(0, u64::saturating_add).max(all);
    if most.saturating_mul(columns as u64) > LARGEST_FILE {
        return Err(format!(
            "claims {most} rows of {columns} mapped columns, more than any recorder writes"
        ));
    }
    Ok(usize::try_from(all).unwrap_or_default())
}

impl ColumnSource for Opened {
    fn flight_id(&self) -> &str {
        &self.flight_id
    }

    fn files(&self) -> usize {
        self.files.len()
    }

    fn name(&self, file: usize) -> String {
        self.files
            .get(file)
            .map(|f| f.path.display().to_string())
            .unwrap_or_default()
    }

    fn rows(&self, file: usize) -> usize {
        self.files.get(file).map_or(0, |f| f.rows)
    }

    fn has(&self, file: usize, column: &str) -> bool {
        self.files
            .get(file)
            .is_some_and(|f| f.columns.contains_key(column))
    }

    fn unit(&self, file: usize, column: &str) -> Option<&str> {
        self.files.get(file)?.columns.get(column)?.unit.as_deref()
    }

    fn read(
        &self,
        file: usize,
        column: &str,
        rows: Range<usize>,
        sink: &mut dyn FnMut(&[f64]),
    ) -> Result<(), String> {
        let known = self
            .files
            .get(file)
            .and_then(|f| Some((f, f.columns.get(column)?)));
        let (file, column) = known.ok_or_else(|| format!("there is no column `{column}`"))?;
        guarded(|| file.read(column, rows, sink))
    }
}

impl OpenFile {
    fn read(
        &self,
        column: &OpenColumn,
        rows: Range<usize>,
        sink: &mut dyn FnMut(&[f64]),
    ) -> Result<(), String> {
        if rows.is_empty() {
            return Ok(());
        }
        if let Some(object) = &self.object {
            let stretches = remote::stretches(self.metadata.metadata(), column.at, &rows);
            let read = self.read_from(object.of_stretches(stretches), column, rows, sink);
            return read.map_err(|e| object::failed(&self.path).unwrap_or(e));
        }
        let path = self.wide.as_ref().map_or(self.path.as_path(), Draft::draft);
        let opened = File::open(path).map_err(|e| format!("cannot open the file: {e}"))?;
        self.read_from(opened, column, rows, sink)
    }

    fn read_from(
        &self,
        source: impl ChunkReader + 'static,
        column: &OpenColumn,
        rows: Range<usize>,
        sink: &mut dyn FnMut(&[f64]),
    ) -> Result<(), String> {
        let builder =
            ParquetRecordBatchReaderBuilder::new_with_metadata(source, self.metadata.clone());
        let mask = ProjectionMask::roots(builder.parquet_schema(), [column.at]);
        let selection =
            RowSelection::from_consecutive_ranges(std::iter::once(rows.clone()), self.rows);
        let builder = builder
            .with_projection(mask)
            .with_row_selection(selection)
            .with_batch_size(BATCH_ROWS);
        let mut read = 0;
        for batch in builder.build().map_err(|e| unreadable(&e))? {
            let batch: RecordBatch = batch.map_err(|e| unreadable(&e))?;
            let array = batch
                .columns()
                .first()
                .ok_or_else(|| unreadable(&"a batch without its column"))?;
            read += array.len();
            hand_over(array, column.clock_factor, sink).map_err(|e| unreadable(&e))?;
        }
        if read == rows.len() {
            Ok(())
        } else {
            Err(unreadable(&format!("{read} of {} rows", rows.len())))
        }
    }
}

/// Passes an array on as numbers, a null as NaN.
fn hand_over(
    array: &dyn Array,
    clock_factor: Option<f64>,
    sink: &mut dyn FnMut(&[f64]),
) -> Result<(), arrow::error::ArrowError> {
    if clock_factor.is_none()
        && array.null_count() == 0
        && let Some(plain) = array.as_primitive_opt::<Float64Type>()
    {
        sink(plain.values());
        return Ok(());
    }
    let plain = as_floats(array)?;
    let factor = clock_factor.unwrap_or(1.0);
    let mut numbers: Vec<f64> = plain
        .as_primitive::<Float64Type>()
        .values()
        .iter()
        .map(|v| v * factor)
        .collect();
    if let Some(nulls) = plain.nulls().filter(|n| n.null_count() > 0) {
        numbers
            .iter_mut()
            .zip(nulls)
            .filter(|(_, valid)| !valid)
            .for_each(|(number, _)| *number = f64::NAN);
    }
    sink(&numbers);
    Ok(())
}

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

fn refuse_other_types(field: &Field, channel: Option<&Channel>) -> Result<(), String> {
    let found = field.data_type();
    let fits = found.is_numeric() || *found == DataType::Boolean || *found == DataType::Null;
    if fits || clock_factor(found, channel).is_some() {
        return Ok(());
    }
    let signal = channel.map(|c| c.signal.as_str()).unwrap_or_default();
    let number = if Unit::of_signal(signal).quantity == crate::units::Quantity::Time {
        "a number, a timestamp or a duration"
    } else {
        "a number (float, integer or boolean)"
    };
    let of_signal = match signal {
        "" => String::new(),
        signal => format!(" (signal `{signal}`)"),
    };
    let remedy = match found {
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => {
            "; write its numbers as numbers, or import the recording from CSV (`harvest import`)"
        }
        _ => "",
    };
    Err(format!(
        "column `{}`{of_signal} is of type {found}; expected {number}{remedy}",
        field.name()
    ))
}

/// Factor from the ticks of timestamps and durations to the unit of the channel map.
fn clock_factor(found: &DataType, channel: Option<&Channel>) -> Option<f64> {
    let mapped = Unit::parse(&channel?.unit).ok()?;
    Unit::parse(tick_unit(found)?).ok()?.factor_to(mapped)
}

mod file_rules;
mod remote;
mod walk;
#[cfg(test)]
mod tests;
