//! The archive: Parquet files of flight records in a folder, under a glob, or in a hive-partitioned tree.
//!
//! Only the columns of the channel map are read, row group by row group, into numbers; what a file cannot give is a
//! problem of its flight, never a panic.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::panic::{self, UnwindSafe};
use std::path::{Path, PathBuf};
use std::sync::Once;

use arrow::array::{Array, AsArray, RecordBatch};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Field, Float64Type, TimeUnit};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder};

use crate::error::{Error, Problem};
use crate::flight::channel::RawColumn;
use crate::flight::{Channel, RawFlight};
use crate::units::Unit;

/// The files of one flight, in the order of its time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FlightFiles {
    pub flight_id: String,
    pub files: Vec<PathBuf>,
    /// Files of another place that would be the same flight.
    pub rivals: Vec<PathBuf>,
}

/// A tree deeper than this is a loop of links.
const DEPTH: usize = 16;

/// Rows decoded at a time: a few MB, whatever the size of the file's row groups.
const BATCH_ROWS: usize = 16_384;

/// The most numbers that are read of a flight, rows times mapped columns: 4 GB, ten hours of sixty channels at 200 Hz. A
/// file of a few kilobytes can claim any number of rows.
const LARGEST_FLIGHT: u64 = 500_000_000;

/// The field metadata that states a column's unit.
pub(super) const UNIT: &str = "unit";

/// The flights of an archive, sorted by flight: a folder (searched for `*.parquet`, sub-folders too), a glob or a single
/// file. The files of one folder `flight=007` are one flight of that name; otherwise a file is a flight named by its stem.
///
/// # Errors
/// No file is found, or the archive's own folder cannot be read. A folder below it that cannot be read stands among the
/// files, as one that cannot be read.
pub fn find(archive: &str) -> Result<Vec<FlightFiles>, Error> {
    let mut files = BTreeSet::new();
    if Path::new(archive).is_dir() {
        walk(Path::new(archive), DEPTH, &mut files)?;
    } else {
        let nonsense = |what: String| Error::Archive { place: archive.into(), what };
        let paths = glob::glob(archive).map_err(|e| nonsense(format!("not a glob: {e}")))?;
        for path in paths {
            let path = path.map_err(|e| nonsense(e.to_string()))?;
            if path.is_dir() {
                if walk(&path, DEPTH, &mut files).is_err() {
                    files.insert(path);
                }
            } else {
                files.insert(path);
            }
        }
    }
    if files.is_empty() {
        let what =
            "no flight records here: looked for files *.parquet in this folder and below it, or matching this glob";
        return Err(Error::Archive { place: archive.into(), what: what.to_owned() });
    }
    Ok(flights(files))
}

/// Adds the Parquet files below a folder; names that begin with a dot or an underscore are other programs' own.
fn walk(folder: &Path, depth: usize, files: &mut BTreeSet<PathBuf>) -> Result<(), Error> {
    let unreadable = |cause| Error::io(folder, "cannot read the archive's folder")(cause);
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let hidden = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with(['.', '_']));
        if hidden {
            continue;
        }
        if path.is_dir() {
            if depth > 0 && walk(&path, depth - 1, files).is_err() {
                files.insert(path);
            }
        } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet")) {
            files.insert(path);
        }
    }
    Ok(())
}

fn flights(files: BTreeSet<PathBuf>) -> Vec<FlightFiles> {
    let mut flights: BTreeMap<String, (PathBuf, FlightFiles)> = BTreeMap::new();
    for file in files {
        let (flight_id, source) = identity(&file);
        let new = || {
            let flight = FlightFiles { flight_id: flight_id.clone(), files: Vec::new(), rivals: Vec::new() };
            (source.clone(), flight)
        };
        let (first, flight) = flights.entry(flight_id.clone()).or_insert_with(new);
        if *first == source { flight.files.push(file) } else { flight.rivals.push(file) }
    }
    flights.into_values().map(|(_, flight)| flight).collect()
}

/// The flight that a file belongs to, and the folder or file that all of it comes from.
fn identity(file: &Path) -> (String, PathBuf) {
    for folder in file.ancestors().skip(1) {
        let name = folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if let Some((key, value)) = name.split_once('=')
            && matches!(key, "flight" | "flight_id")
            && !value.is_empty()
        {
            return (value.to_owned(), folder.to_owned());
        }
    }
    let stem = file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    (stem, file.to_owned())
}

/// The mapped columns of a flight as numbers, its files one after the other; a column that a file does not have is absent,
/// or NaN over that file where another has it.
///
/// # Errors
/// A file that cannot be read as Parquet, a column that is not numbers, or files that state different units.
pub fn read(files: &FlightFiles, channels: &BTreeMap<String, Channel>) -> Result<RawFlight, Problem> {
    let mut flight = RawFlight { flight_id: files.flight_id.clone(), columns: BTreeMap::new() };
    let mut rows = 0;
    for file in &files.files {
        // The Parquet reader is trusted with good files only: bytes that make it panic are a bad file, too.
        let appended = caught(|| decode(file, channels)).unwrap_or_else(|_| {
            Err("the Parquet reader gave up on its bytes; copy it again from its source".to_owned())
        });
        let append = appended.and_then(|part| append(&mut flight, part, &mut rows));
        append.map_err(|reason| Problem {
            stage: "ingest".to_owned(),
            flight_id: files.flight_id.clone(),
            place: file.display().to_string(),
            reason,
        })?;
    }
    Ok(flight)
}

thread_local! {
    /// Whether this thread is reading a file of which it need not be said that it made the reader panic.
    static READING: Cell<bool> = const { Cell::new(false) };
}

/// What `work` gives, or that it panicked: silently, for the reason goes into a table.
fn caught<T>(work: impl FnOnce() -> T + UnwindSafe) -> std::thread::Result<T> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !READING.get() {
                before(info);
            }
        }));
    });
    READING.set(true);
    let result = panic::catch_unwind(work);
    READING.set(false);
    result
}

/// The mapped columns of one file, and its number of rows.
struct Part {
    columns: BTreeMap<String, RawColumn>,
    rows: usize,
}

fn append(flight: &mut RawFlight, part: Part, rows: &mut usize) -> Result<(), String> {
    let total = *rows + part.rows;
    for (name, mut column) in part.columns {
        let whole = flight.columns.entry(name.clone()).or_default();
        let stated = whole.unit.take();
        if let (Some(a), Some(b)) = (&stated, &column.unit)
            && a != b
        {
            return Err(format!("column `{name}` is in `{b}` here and in `{a}` in an earlier file of the flight"));
        }
        whole.unit = stated.or(column.unit);
        whole.values.resize(*rows, f64::NAN);
        whole.values.append(&mut column.values);
    }
    flight.columns.values_mut().for_each(|c| c.values.resize(total, f64::NAN));
    *rows = total;
    Ok(())
}

fn decode(file: &Path, channels: &BTreeMap<String, Channel>) -> Result<Part, String> {
    let opened = File::open(file).map_err(|e| format!("cannot open the file: {e}"))?;
    let unreadable =
        |e: &dyn std::fmt::Display| format!("not a readable Parquet file (truncated, or another format?): {e}");
    let builder = ParquetRecordBatchReaderBuilder::try_new(opened).map_err(|e| unreadable(&e))?;
    let fields = builder.schema().fields().clone();
    let wanted: Vec<usize> = (0..fields.len()).filter(|&i| channels.contains_key(fields[i].name())).collect();
    let mut columns = BTreeMap::new();
    for field in wanted.iter().filter_map(|&i| fields.get(i)) {
        let channel = channels.get(field.name());
        refuse_other_types(field, channel)?;
        let unit = field.metadata().get(UNIT).cloned();
        if columns.insert(field.name().clone(), RawColumn { unit, values: Vec::new() }).is_some() {
            return Err(format!("two columns are named `{}`", field.name()));
        }
    }
    let claimed = |rows: i64| u64::try_from(rows).unwrap_or(u64::MAX);
    let in_groups = builder.metadata().row_groups().iter().map(|g| claimed(g.num_rows()));
    let rows = in_groups.fold(0, u64::saturating_add).max(claimed(builder.metadata().file_metadata().num_rows()));
    if rows.saturating_mul(wanted.len() as u64) > LARGEST_FLIGHT {
        return Err(format!("claims {rows} rows of {} mapped columns, more than any flight has", wanted.len()));
    }
    let mask = ProjectionMask::roots(builder.parquet_schema(), wanted);
    let reader = builder.with_projection(mask).with_batch_size(BATCH_ROWS).build().map_err(|e| unreadable(&e))?;
    let rows = fill(reader, &mut columns, channels).map_err(|e| unreadable(&e))?;
    Ok(Part { columns, rows })
}

fn fill(
    reader: ParquetRecordBatchReader,
    columns: &mut BTreeMap<String, RawColumn>,
    channels: &BTreeMap<String, Channel>,
) -> Result<usize, arrow::error::ArrowError> {
    let mut rows = 0;
    for batch in reader {
        let batch: RecordBatch = batch?;
        rows += batch.num_rows();
        if (rows as u64).saturating_mul(columns.len() as u64) > LARGEST_FLIGHT {
            return Err(arrow::error::ArrowError::ParquetError("it has more rows than it claims".to_owned()));
        }
        let schema = batch.schema();
        for (field, array) in schema.fields().iter().zip(batch.columns()) {
            if let Some(column) = columns.get_mut(field.name()) {
                let numbers = numbers(array, clock_factor(field.data_type(), channels.get(field.name())))?;
                column.values.extend(numbers);
            }
        }
    }
    Ok(rows)
}

fn refuse_other_types(field: &Field, channel: Option<&Channel>) -> Result<(), String> {
    let found = field.data_type();
    let clock = matches!(found, DataType::Timestamp(..) | DataType::Duration(_));
    let fits = found.is_numeric() || *found == DataType::Boolean || *found == DataType::Null;
    if fits || (clock && clock_factor(found, channel).is_some()) {
        return Ok(());
    }
    let signal = channel.map(|c| c.signal.as_str()).unwrap_or_default();
    let number = if Unit::of_signal(signal).quantity == crate::units::Quantity::Time {
        "a number, a timestamp or a duration"
    } else {
        "a number (float, integer or boolean)"
    };
    Err(format!("column `{}` (signal `{signal}`) is of type {found}; expected {number}", field.name()))
}

/// For timestamps and durations, the factor from their ticks to the unit that the channel map states.
fn clock_factor(found: &DataType, channel: Option<&Channel>) -> Option<f64> {
    let (DataType::Timestamp(tick, _) | DataType::Duration(tick)) = found else { return None };
    let name = match tick {
        TimeUnit::Second => "s",
        TimeUnit::Millisecond => "ms",
        TimeUnit::Microsecond => "us",
        TimeUnit::Nanosecond => "ns",
    };
    let mapped = Unit::parse(&channel?.unit).ok()?;
    Unit::parse(name).ok()?.factor_to(mapped)
}

/// An array as numbers, a null as NaN.
fn numbers(array: &dyn Array, clock_factor: Option<f64>) -> Result<Vec<f64>, arrow::error::ArrowError> {
    let plain = if clock_factor.is_some() { cast(array, &DataType::Int64)? } else { cast(array, &DataType::Float64)? };
    let plain = cast(&plain, &DataType::Float64)?;
    let factor = clock_factor.unwrap_or(1.0);
    Ok(plain.as_primitive::<Float64Type>().iter().map(|v| v.map_or(f64::NAN, |v| v * factor)).collect())
}

#[cfg(test)]
mod tests;
