//! Tall Parquet (time, name, value) as one column a name: written by import, and beside its records by
//! ingest, which then reads it as any flight.
//!
//! Names whose times are mostly times of the name with the most values are one part, with a value where
//! they have one. The other names are further parts, one for each set of times: files with clocks of
//! their own.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};

use arrow::array::{Array, AsArray, RecordBatch, StringArray};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Field, Float64Type};
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReader,
    ParquetRecordBatchReaderBuilder,
};

use super::contents::{Contents, ImportedColumn, refused};
use super::flight_file::{BATCH_ROWS, Sink, write, write_draft};
use crate::error::{Error, Result};
use crate::store::atomic::Draft;
use crate::store::clock_column::{as_floats, is_clock, tick_unit};
use crate::store::object;
use crate::store::recorder::UNIT;
use crate::units::Unit;

/// Names of the columns of tall files.
const TIMES: [&str; 5] = ["time", "t", "timestamp", "time_s", "times"];
const NAMES: [&str; 8] = [
    "name",
    "signal",
    "channel",
    "parameter",
    "variable",
    "tag",
    "sensor",
    "param",
];
const VALUES: [&str; 3] = ["value", "val", "data"];
const UNITS: [&str; 2] = ["unit", "units"];

/// Values that are sorted at once where rows are not in the order of time: 32 MB.
const SORTED_AT_ONCE: usize = 1 << 20;

/// Most values that are sorted at once, where a sixteen-thousandth of the time span has so many.
const MOST_AT_ONCE: usize = 20_000_000;

/// Parts of the time span from which the parts that are sorted at once are composed.
const BINS: usize = 1 << 14;

/// Most names of a file: more than any recorder has channels.
const MOST_NAMES: usize = 20_000;

/// Imports a Parquet file of three or four columns. One of several parts becomes a folder of files.
pub fn import(source: &Path, file: &Path) -> Result<Contents> {
    let Some(tall) = Tall::open(source)? else {
        let what = "Parquet with one column a channel is read as it is: name it as the archive, or give it to `harvest \
                    init --from`; import takes tall files with the columns time, name, value and perhaps unit";
        return Err(refused(source, what));
    };
    let survey = tall.survey()?;
    let parts = tall.parts(&survey)?;
    let folder = (parts.len() > 1).then(|| folder_of(file));
    let mut contents = Contents::default();
    let mut replaced = 0;
    for (k, part) in parts.iter().enumerate() {
        let columns = tall.columns(&survey, |name| part.contains(name));
        let mut table = Rows::new(columns.len());
        let own = folder
            .as_ref()
            .map(|folder| folder.join(format!("part_{:03}.parquet", k + 1)));
        contents.rows += write(own.as_deref().unwrap_or(file), &columns, |sink| {
            tall.fill(&survey, part, &columns, &mut table, sink)
        })?;
        replaced += table.replaced;
        contents
            .columns
            .extend(columns.into_iter().skip(usize::from(k > 0)));
    }
    if replaced > 0 {
        contents.notes.push(format!(
            "{replaced} values came twice for a time and a name; the last one counts"
        ));
    }
    if folder.is_some() {
        contents.notes.push(format!(
            "{} files: the names have values at {} sets of times",
            parts.len(),
            parts.len()
        ));
    }
    Ok(Contents { folder, ..contents })
}

/// Folder whose files are one flight, in the place of a file.
fn folder_of(file: &Path) -> PathBuf {
    let stem = file.file_stem().map(|s| s.to_string_lossy().into_owned());
    file.with_file_name(format!("flight={}", stem.unwrap_or_default()))
}

/// A tall file and the names of its columns.
#[derive(Debug)]
pub struct Tall {
    source: PathBuf,
    /// Set for an object.
    object: Option<object::Reader>,
    metadata: ArrowReaderMetadata,
    time: String,
    time_unit: Option<String>,
    name: String,
    value: String,
    unit: Option<String>,
}

/// Values of one name.
#[derive(Default)]
struct Values {
    unit: Option<String>,
    count: usize,
    /// Sum of the hashes of the times: equal for equal times in any order.
    times: u64,
}

impl Values {
    fn add(&mut self, time: f64, unit: Option<&str>) {
        self.count += 1;
        self.times = self.times.wrapping_add(hash(time));
        if self.unit.is_none() {
            self.unit = unit.map(str::to_owned);
        }
    }

    /// Mark of a set of times.
    fn clock(&self) -> (usize, u64) {
        (self.count, self.times)
    }
}

/// Hash of a time (the finaliser of Steele, Lea and Flood).
fn hash(time: f64) -> u64 {
    let z = time.to_bits();
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Names with their values, and the order of the rows.
#[derive(Default)]
struct Survey {
    names: BTreeMap<String, Values>,
    is_in_order: bool,
    rows: usize,
    /// Least and largest finite time.
    span_s: (f64, f64),
}

impl Survey {
    fn add_time(&mut self, time: f64, before: f64) {
        self.rows += 1;
        self.is_in_order &= time >= before;
        if time.is_finite() {
            self.span_s = (self.span_s.0.min(time), self.span_s.1.max(time));
        }
    }

    /// Part of the time span; a time that is no number is in the last one.
    fn bin(&self, time: f64) -> usize {
        let (first, last) = self.span_s;
        let share = (time - first) / (last - first);
        if share.is_nan() {
            return BINS - 1;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped to a range of counts"
        )]
        let bin = (share * BINS as f64).clamp(0.0, (BINS - 1) as f64) as usize;
        bin
    }
}

/// Columns of a tall file of this schema: time, name, value, unit.
fn roles(fields: &[std::sync::Arc<Field>]) -> Option<(String, String, String, Option<String>)> {
    let find = |names: &[&str]| {
        let mut fields = fields.iter();
        fields
            .find(|f| names.contains(&f.name().to_lowercase().as_str()))
            .map(|f| f.name().clone())
    };
    Some((find(&TIMES)?, find(&NAMES)?, find(&VALUES)?, find(&UNITS)))
}

impl Tall {
    /// Opens a file; `None` for a file that is not tall.
    ///
    /// # Errors
    /// [`Error::Archive`] for a file that is no readable Parquet.
    pub fn open(source: &Path) -> Result<Option<Tall>> {
        let file = File::open(source)
            .map_err(|e| refused(source, &format!("cannot open the file: {e}")))?;
        let metadata = ArrowReaderMetadata::load(&file, ArrowReaderOptions::default())
            .map_err(|e| refused(source, &format!("not a readable Parquet file: {e}")))?;
        Ok(Tall::of(source, None, &metadata))
    }

    /// File or object with this footer; `None` for one that is not tall.
    #[must_use]
    pub fn of(
        source: &Path,
        object: Option<object::Reader>,
        metadata: &ArrowReaderMetadata,
    ) -> Option<Tall> {
        let schema = metadata.schema();
        let (time, name, value, unit) = roles(schema.fields())?;
        let field = schema.field_with_name(&time).ok();
        let is_clock = field.is_some_and(|f| is_clock(f.data_type()));
        let stated = field.and_then(|f| f.metadata().get(UNIT).cloned());
        Some(Tall {
            source: source.to_owned(),
            object,
            metadata: metadata.clone(),
            time,
            time_unit: if is_clock {
                Some("s".to_owned())
            } else {
                stated
            },
            name,
            value,
            unit,
        })
    }

    /// `true` where none of the columns but the clock is a channel of its own, and the names are text.
    #[must_use]
    pub fn is_unmapped(&self, is_channel: impl Fn(&str) -> bool) -> bool {
        let field = self.metadata.schema().field_with_name(&self.name).ok();
        let is_text = field.is_some_and(|f| is_text(f.data_type()));
        is_text && !is_channel(&self.name) && !is_channel(&self.value)
    }

    /// Writes a draft beside `place` for each part that has a name which is wanted, with one column
    /// for each of these names.
    ///
    /// # Errors
    /// [`Error::Archive`] for the file; [`Error::Io`] or [`Error::Store`] for the disk.
    pub fn widened(&self, place: &Path, is_wanted: impl Fn(&str) -> bool) -> Result<Vec<Draft>> {
        let survey = self.survey()?;
        let mut drafts = Vec::new();
        for part in self.parts(&survey)? {
            let columns = self.columns(&survey, |name| part.contains(name) && is_wanted(name));
            if columns.len() > 1 {
                let mut table = Rows::new(columns.len());
                let filled =
                    |sink: &mut Sink| self.fill(&survey, &part, &columns, &mut table, sink);
                drafts.push(write_draft(place, &columns, filled)?.0);
            }
        }
        Ok(drafts)
    }

    /// Names of each part: those on the clock of the name with the most values, then the others by
    /// their clocks.
    fn parts(&self, survey: &Survey) -> Result<Vec<BTreeSet<String>>> {
        let names = || survey.names.iter();
        let most = names().max_by_key(|(_, values)| values.count);
        let Some(main) = most.map(|(_, values)| values.count) else {
            return Ok(vec![BTreeSet::new()]);
        };
        let is_main = |(_, values): &(&String, &Values)| values.count == main;
        let Some((main, clock)) = names().find(is_main).map(|(n, v)| (n, v.clock())) else {
            return Ok(vec![BTreeSet::new()]);
        };
        let shared = if names().all(|(_, values)| values.clock() == clock) {
            BTreeMap::new()
        } else {
            self.times_shared(survey, main)?
        };
        let mut on_main = BTreeSet::new();
        let mut others: BTreeMap<(usize, u64), BTreeSet<String>> = BTreeMap::new();
        for (name, values) in names() {
            let shared = shared.get(name).copied().unwrap_or_default();
            if values.clock() == clock || 2 * shared >= values.count {
                on_main.insert(name.clone());
            } else {
                let same_clock = others.entry(values.clock()).or_default();
                same_clock.insert(name.clone());
            }
        }
        Ok(std::iter::once(on_main)
            .chain(others.into_values())
            .collect())
    }

    /// Number of the times of each name at which another one has a value, too.
    fn times_shared<'s>(
        &self,
        survey: &'s Survey,
        main: &str,
    ) -> Result<BTreeMap<&'s String, usize>> {
        let places: BTreeMap<&str, usize> =
            survey.names.keys().map(String::as_str).zip(0..).collect();
        let main = places.get(main).copied();
        let mut shared = vec![0_usize; places.len()];
        let mut at_once: Vec<usize> = Vec::new();
        let mut now = f64::NAN;
        let mut count = |at_once: &mut Vec<usize>| {
            if at_once.iter().any(|place| Some(*place) == main) {
                for place in at_once.iter() {
                    shared[*place] += 1;
                }
            }
            at_once.clear();
        };
        let place = |name: &str| places.get(name).copied();
        self.in_order(survey, &place, &mut |time, place, _| {
            if time.to_bits() != now.to_bits() {
                count(&mut at_once);
                now = time;
            }
            at_once.push(place);
            Ok(())
        })?;
        count(&mut at_once);
        Ok(survey.names.keys().zip(shared).collect())
    }

    /// The clock, and the names that are wanted, sorted.
    fn columns(&self, survey: &Survey, is_wanted: impl Fn(&str) -> bool) -> Vec<ImportedColumn> {
        let time = ImportedColumn {
            name: self.time.clone(),
            unit: self.time_unit.clone(),
        };
        let wanted = survey.names.iter().filter(|(name, _)| is_wanted(name));
        let named = wanted.map(|(name, values)| ImportedColumn {
            name: name.clone(),
            unit: values.unit.clone(),
        });
        std::iter::once(time).chain(named).collect()
    }

    /// Fills the rows of a table, one for each time at which any name of the part has a value. A name
    /// without a column makes a row all the same: the clock is that of all names.
    fn fill(
        &self,
        survey: &Survey,
        part: &BTreeSet<String>,
        columns: &[ImportedColumn],
        table: &mut Rows,
        sink: &mut Sink,
    ) -> Result<()> {
        let named = columns.iter().enumerate().skip(1);
        let columns: BTreeMap<&str, usize> = named.map(|(k, c)| (c.name.as_str(), k)).collect();
        let places: BTreeMap<&str, usize> = part
            .iter()
            .map(|name| {
                let name = name.as_str();
                (name, columns.get(name).copied().unwrap_or(NO_COLUMN))
            })
            .collect();
        let place = |name: &str| places.get(name).copied();
        self.in_order(survey, &place, &mut |time, place, value| {
            table.put(time, place, value, sink)
        })?;
        table.finish(sink)
    }

    /// Passes the rows of the names that have a place on in the order of time.
    fn in_order(
        &self,
        survey: &Survey,
        place: &dyn Fn(&str) -> Option<usize>,
        row: &mut dyn FnMut(f64, usize, f64) -> Result<()>,
    ) -> Result<()> {
        if survey.is_in_order {
            return self.each(&mut |time, name, value| {
                place(name).map_or(Ok(()), |place| row(time, place, value))
            });
        }
        for bins in self.spans(survey)? {
            let mut sorted = Vec::new();
            self.each(&mut |time, name, value| {
                if bins.contains(&survey.bin(time)) {
                    sorted.extend(place(name).map(|place| (time, place, value)));
                }
                Ok(())
            })?;
            // Stable: of two values for a time and a name the last one counts.
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (time, place, value) in sorted {
                row(time, place, value)?;
            }
        }
        Ok(())
    }

    /// Spans of time whose values are sorted at once.
    fn spans(&self, survey: &Survey) -> Result<Vec<Range<usize>>> {
        let mut counts = vec![0_usize; BINS];
        self.each(&mut |time, _, _| {
            counts[survey.bin(time)] += 1;
            Ok(())
        })?;
        if let Some(most) = counts.iter().find(|count| **count > MOST_AT_ONCE) {
            let what = format!(
                "{most} values out of the order of time do not fit into memory: sort the file by time"
            );
            return Err(refused(&self.source, &what));
        }
        let mut spans: Vec<Range<usize>> = Vec::new();
        let mut values = usize::MAX;
        for (bin, count) in counts.into_iter().enumerate() {
            values = values.saturating_add(count);
            match spans.last_mut() {
                Some(span) if values <= SORTED_AT_ONCE => span.end = bin + 1,
                _ => {
                    spans.push(bin..bin + 1);
                    values = count;
                }
            }
        }
        Ok(spans)
    }

    fn survey(&self) -> Result<Survey> {
        let mut survey = Survey {
            is_in_order: true,
            span_s: (f64::INFINITY, f64::NEG_INFINITY),
            ..Survey::default()
        };
        let mut before = f64::NEG_INFINITY;
        for batch in self.batches()? {
            let batch = batch?;
            let names = self.texts(&batch, &self.name)?;
            let units = self.unit.as_ref().map(|unit| self.texts(&batch, unit));
            let units = units.transpose()?;
            for (row, time) in self.times(&batch)?.into_iter().enumerate() {
                survey.add_time(time, before);
                before = time;
                let name = text(&names, row);
                let unit = units.as_ref().map(|units| text(units, row));
                let unit = unit.filter(|unit| !unit.is_empty());
                if let Some(values) = survey.names.get_mut(name) {
                    values.add(time, unit);
                } else {
                    let mut values = Values::default();
                    values.add(time, unit);
                    survey.names.insert(name.to_owned(), values);
                }
            }
            if survey.names.len() > MOST_NAMES {
                let what = format!("more than {MOST_NAMES} names in the column `{}`", self.name);
                return Err(refused(&self.source, &what));
            }
        }
        // A channel may have the clock's name.
        survey.names.remove(&self.time);
        Ok(survey)
    }

    /// Passes each row on in the order of the file.
    fn each(&self, row: &mut dyn FnMut(f64, &str, f64) -> Result<()>) -> Result<()> {
        for batch in self.batches()? {
            let batch = batch?;
            let names = self.texts(&batch, &self.name)?;
            let values = self.numbers(&batch, &self.value)?;
            let times = self.times(&batch)?;
            for (k, (time, value)) in times.into_iter().zip(values).enumerate() {
                row(time, text(&names, k), value)?;
            }
        }
        Ok(())
    }

    fn batches(&self) -> Result<impl Iterator<Item = Result<RecordBatch>>> {
        let reader = self.reader()?;
        let source = self.source.clone();
        Ok(reader.map(move |batch| batch.map_err(|e| damaged(&source, &e))))
    }

    fn reader(&self) -> Result<ParquetRecordBatchReader> {
        let metadata = self.metadata.clone();
        let reader = if let Some(object) = &self.object {
            ParquetRecordBatchReaderBuilder::new_with_metadata(object.clone(), metadata)
                .with_batch_size(BATCH_ROWS)
                .build()
        } else {
            let file =
                File::open(&self.source).map_err(|e| refused(&self.source, &e.to_string()))?;
            ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata)
                .with_batch_size(BATCH_ROWS)
                .build()
        };
        reader.map_err(|e| damaged(&self.source, &e))
    }

    fn column<'b>(&self, batch: &'b RecordBatch, name: &str) -> Result<&'b dyn Array> {
        let column = batch.column_by_name(name).map(AsRef::as_ref);
        column.ok_or_else(|| {
            refused(
                &self.source,
                &format!("a part of the file lacks the column `{name}`"),
            )
        })
    }

    /// Times; those of a calendar in seconds since its beginning.
    fn times(&self, batch: &RecordBatch) -> Result<Vec<f64>> {
        let unit = tick_unit(self.column(batch, &self.time)?.data_type());
        let seconds = |unit: &str| Unit::parse(unit).ok()?.factor_to(Unit::parse("s").ok()?);
        let numbers = self.numbers(batch, &self.time)?;
        Ok(match unit.and_then(seconds) {
            Some(tick) => numbers.into_iter().map(|t| t * tick).collect(),
            None => numbers,
        })
    }

    fn numbers(&self, batch: &RecordBatch, name: &str) -> Result<Vec<f64>> {
        let column = self.column(batch, name)?;
        let no_numbers = |_| refused(&self.source, &format!("column `{name}` holds no numbers"));
        let plain = as_floats(column).map_err(no_numbers)?;
        let numbers = plain.as_primitive::<Float64Type>();
        Ok(numbers.iter().map(|v| v.unwrap_or(f64::NAN)).collect())
    }

    fn texts(&self, batch: &RecordBatch, name: &str) -> Result<StringArray> {
        let column = self.column(batch, name)?;
        let plain = cast(column, &DataType::Utf8)
            .map_err(|_| refused(&self.source, &format!("column `{name}` holds no text")))?;
        Ok(plain.as_string::<i32>().clone())
    }
}

/// Text of a row; empty for a null.
fn text(texts: &StringArray, row: usize) -> &str {
    if texts.is_null(row) {
        ""
    } else {
        texts.value(row)
    }
}

fn damaged(source: &Path, e: &dyn std::fmt::Display) -> Error {
    refused(source, &format!("not a readable Parquet file: {e}"))
}

fn is_text(kind: &DataType) -> bool {
    match kind {
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => true,
        DataType::Dictionary(_, values) => is_text(values),
        _ => false,
    }
}

/// Place of a name without a column.
const NO_COLUMN: usize = usize::MAX;

/// Rows being filled: one for each time.
struct Rows {
    batch: Vec<Vec<f64>>,
    replaced: usize,
}

impl Rows {
    fn new(columns: usize) -> Rows {
        Rows {
            batch: vec![Vec::new(); columns],
            replaced: 0,
        }
    }

    /// Puts a value into the row of its time; times come in order.
    fn put(&mut self, time: f64, place: usize, value: f64, sink: &mut Sink) -> Result<()> {
        let last = self.batch[0].last().map(|t| t.to_bits());
        if last != Some(time.to_bits()) {
            if self.batch[0].len() >= BATCH_ROWS {
                self.finish(sink)?;
            }
            self.batch
                .iter_mut()
                .for_each(|column| column.push(f64::NAN));
            if let Some(row) = self.batch[0].last_mut() {
                *row = time;
            }
        }
        let column = self.batch.get_mut(place);
        if let Some(cell) = column.and_then(|column| column.last_mut()) {
            self.replaced += usize::from(!cell.is_nan());
            *cell = value;
        }
        Ok(())
    }

    /// Passes the rows on.
    fn finish(&mut self, sink: &mut Sink) -> Result<()> {
        sink(&self.batch)?;
        self.batch.iter_mut().for_each(Vec::clear);
        Ok(())
    }
}
