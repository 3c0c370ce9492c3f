//! Opened files of a flight: footers, mapped columns, reading by ranges of rows.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};

use arrow::array::{Array, RecordBatch};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder, RowSelection,
};
use parquet::file::metadata::PageIndexPolicy;
use parquet::file::reader::ChunkReader;

use super::file_rules::unreadable;
use super::flight_files::FlightFiles;
use super::guard::guarded;
use super::numbers::{clock_factor, hand_over, refuse_other_types};
use super::remote;
use crate::error::{Error, Problem, ProblemStage};
use crate::flight::channel::{RawColumn, columns};
use crate::flight::{Channel, RawFlight, signal};
use crate::ingest::ColumnSource;
use crate::store::atomic::Draft;
use crate::store::import::tall::Tall;
use crate::store::object;
use crate::store::recorder::{BATCH_ROWS, UNIT};

/// Largest number of numbers of a file, rows times mapped columns: more than ten hours of sixty
/// channels at 200 Hz. A damaged file of a few kilobytes can claim any number of rows.
const LARGEST_FILE: u64 = 500_000_000;

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
    /// Mapped columns that hold no numbers and that a flight can do without, with the reason.
    unreadable: BTreeMap<String, String>,
    rows: usize,
}

#[derive(Debug)]
struct OpenColumn {
    at: usize,
    unit: Option<String>,
    /// Factor from the ticks of timestamps and durations to the channel map's unit.
    clock_factor: Option<f64>,
}

/// Opens the files of a flight. A tall file is rewritten beside `scratch` with one column per name;
/// these files are removed with the flight.
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

/// Opens one file. A tall file becomes several if its names have several clocks.
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
    let (object, metadata) = object_and_footer(path).map_err(refused)?;
    let is_channel = |name: &str| channels.contains_key(name);
    let tall = Tall::of(path, object.clone(), &metadata);
    let Some(tall) = tall.filter(|tall| tall.is_unmapped(is_channel)) else {
        let opened = open_columns(path, channels, metadata).map_err(refused)?;
        return Ok(vec![OpenFile { object, ..opened }]);
    };
    check_size(&metadata, 1).map_err(refused)?;
    let wide = tall.widened(scratch, is_channel).map_err(|e| {
        // A fault of the network explains the reader's message.
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

/// Mapped columns of a flight's files, file by file, with their units and without values. Of a file with
/// one column a channel the footer is read alone.
///
/// # Errors
/// As [`open`].
pub fn mapped_columns(
    files: &FlightFiles,
    channels: &BTreeMap<String, Channel>,
) -> Result<Vec<RawFlight>, Problem> {
    let columns = columns(channels);
    let of_file = |path: &PathBuf| {
        let columns = guarded(|| columns_of_file(path, &columns));
        let columns = columns.map_err(|reason| Problem {
            stage: ProblemStage::Ingest,
            flight_id: files.flight_id.clone(),
            place: path.display().to_string(),
            reason,
        })?;
        Ok(RawFlight {
            flight_id: files.flight_id.clone(),
            columns,
        })
    };
    files.files.iter().map(of_file).collect()
}

fn columns_of_file(
    path: &Path,
    channels: &BTreeMap<String, Channel>,
) -> Result<BTreeMap<String, RawColumn>, String> {
    let (object, metadata) = object_and_footer(path)?;
    let is_channel = |name: &str| channels.contains_key(name);
    let column = |unit: Option<String>| RawColumn {
        unit,
        values: vec![],
    };
    if let Some(tall) =
        Tall::of(path, object, &metadata).filter(|tall| tall.is_unmapped(is_channel))
    {
        let wanted: BTreeSet<&str> = channels.keys().map(String::as_str).collect();
        let units = tall.units_of(&wanted).map_err(|e| e.to_string())?;
        let stated = |unit: String| Some(unit).filter(|unit| !unit.is_empty());
        let units = units.into_iter();
        return Ok(units
            .map(|(name, unit)| (name, column(stated(unit))))
            .collect());
    }
    let opened = open_columns(path, channels, metadata)?;
    let columns = opened.columns.into_iter();
    Ok(columns
        .map(|(name, one)| (name, column(one.unit)))
        .collect())
}

/// Reader of an object, `None` for a file of the disk, and the footer.
fn object_and_footer(path: &Path) -> Result<(Option<object::Reader>, ArrowReaderMetadata), String> {
    let object = object::is_object(path)
        .then(|| object::Reader::open(path))
        .transpose()
        .map_err(|e| e.to_string())?;
    let metadata = footer(path, object.as_ref())?;
    Ok((object, metadata))
}

/// Footer of a file or object.
fn footer(path: &Path, object: Option<&object::Reader>) -> Result<ArrowReaderMetadata, String> {
    if let Some(object) = object {
        // The page index of an object avoids fetching other pages.
        let options =
            ArrowReaderOptions::default().with_offset_index_policy(PageIndexPolicy::Optional);
        return ArrowReaderMetadata::load(object, options)
            .map_err(|e| remote::failure_reason(path, &e));
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
    let (mut columns, mut unreadable) = (BTreeMap::new(), BTreeMap::new());
    for (at, field) in metadata.schema().fields().iter().enumerate() {
        let Some(channel) = channels.get(field.name()) else {
            continue;
        };
        match refuse_other_types(field, channel) {
            Err(reason) if is_dispensable(&channel.signal) => {
                unreadable.insert(field.name().clone(), reason);
                continue;
            }
            checked => checked?,
        }
        let unit = field.metadata().get(UNIT).cloned();
        let column = OpenColumn {
            at,
            unit,
            clock_factor: clock_factor(field.data_type(), channel),
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
        unreadable,
        rows,
    })
}

/// `true` for a signal without which a flight may be read. Columns of formulas have none.
fn is_dispensable(signal: &str) -> bool {
    !signal.is_empty() && signal != signal::TIME && !signal::is_indispensable(signal)
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

    fn unreadable(&self, file: usize, column: &str) -> Option<&str> {
        self.files
            .get(file)?
            .unreadable
            .get(column)
            .map(String::as_str)
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
            let ranges = remote::byte_ranges(self.metadata.metadata(), column.at, &rows);
            let read = self.read_from(object.of_ranges(ranges), column, rows, sink);
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
        let (mut read, mut numbers) = (0, Vec::new());
        for batch in builder.build().map_err(|e| unreadable(&e))? {
            let batch: RecordBatch = batch.map_err(|e| unreadable(&e))?;
            let array = batch
                .columns()
                .first()
                .ok_or_else(|| unreadable(&"a batch without its column"))?;
            read += array.len();
            hand_over(array, column.clock_factor, &mut numbers, sink)
                .map_err(|e| unreadable(&e))?;
        }
        if read == rows.len() {
            Ok(())
        } else {
            Err(unreadable(&format!("{read} of {} rows", rows.len())))
        }
    }
}
