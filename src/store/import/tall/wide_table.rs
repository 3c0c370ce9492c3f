//! Wide tables of the parts: one column per name, one row per time.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::source::Tall;
use super::survey::Survey;
use crate::error::Result;
use crate::store::import::flight_file::{FlightWriter, batch_rows};
use crate::store::import::imported_contents::{ImportedColumn, refused};

/// Largest number of files that a tall one becomes: more clocks than a recorder has, and few enough
/// for a system to keep open.
const MOST_CLOCKS: usize = 256;

/// Largest number of values, missing ones included, of a file that a tall one becomes: the same as
/// for a file of the archive.
const MOST_NUMBERS: usize = 500_000_000;

/// Place of a name without a column.
const NO_COLUMN: usize = usize::MAX;

/// A part being filled: its names, its file, and the rows that are not written yet.
pub(super) struct PartTable<'p> {
    names: &'p BTreeSet<String>,
    /// The clock, and the wanted names, sorted.
    pub columns: Vec<ImportedColumn>,
    rows: Rows,
    pub writer: FlightWriter,
    /// Number of values that another value for the same time and name has replaced.
    pub replaced: usize,
}

/// Rows of a part, one for each time: columns of one length.
struct Rows {
    columns: Vec<Vec<f64>>,
    /// Rows that are in memory at once.
    at_once: usize,
}

impl Rows {
    fn new(columns: usize, at_once: usize) -> Rows {
        Rows {
            columns: vec![Vec::new(); columns],
            at_once,
        }
    }

    fn are_full(&self) -> bool {
        self.columns[0].len() >= self.at_once
    }

    /// Bits of the last row's time.
    fn last(&self) -> Option<u64> {
        self.columns[0].last().map(|time| time.to_bits())
    }

    /// Adds a row without values.
    fn push(&mut self, time: f64) {
        for column in &mut self.columns {
            column.push(f64::NAN);
        }
        if let Some(own) = self.columns[0].last_mut() {
            *own = time;
        }
    }
}

impl PartTable<'_> {
    /// Column of a name.
    fn column(&self, name: &str) -> usize {
        let named = self.columns.get(1..).unwrap_or_default();
        let own = named.binary_search_by(|column| column.name.as_str().cmp(name));
        own.map_or(NO_COLUMN, |k| k + 1)
    }

    /// Puts a value into the row of its time; times come in order.
    fn put(&mut self, time: f64, column: usize, value: f64) -> Result<()> {
        if self.rows.last() != Some(time.to_bits()) {
            if self.rows.are_full() {
                self.write()?;
            }
            self.rows.push(time);
        }
        let column = self.rows.columns.get_mut(column);
        if let Some(cell) = column.and_then(|column| column.last_mut()) {
            self.replaced += usize::from(!cell.is_nan());
            *cell = value;
        }
        Ok(())
    }

    /// Writes the rows.
    fn write(&mut self) -> Result<()> {
        self.writer.write(&self.rows.columns)?;
        self.rows.columns.iter_mut().for_each(Vec::clear);
        Ok(())
    }
}

impl Tall {
    /// Empty tables of the parts that have a wanted name, one column for each of these names.
    ///
    /// # Errors
    /// There are more files, or larger ones, than a recorder's names can make.
    pub(super) fn tables<'p>(
        &self,
        survey: &Survey,
        parts: &'p [BTreeSet<String>],
        place: &dyn Fn(usize) -> PathBuf,
        is_wanted: impl Fn(&str) -> bool,
    ) -> Result<Vec<PartTable<'p>>> {
        let columns =
            |part: &BTreeSet<String>| self.columns(survey, |n| part.contains(n) && is_wanted(n));
        let parts = parts.iter().map(|part| (part, columns(part)));
        let parts: Vec<_> = parts.filter(|(_, columns)| columns.len() > 1).collect();
        if parts.len() > MOST_CLOCKS {
            let what = format!(
                "its names have values at {} different sets of times, more than {MOST_CLOCKS}: as an archive it is \
                 read with the names of the channel map alone",
                parts.len()
            );
            return Err(refused(&self.source, &what));
        }
        for (part, columns) in &parts {
            self.check_size(survey, part, columns.len())?;
        }
        let at_once = batch_rows(parts.iter().map(|(_, columns)| columns.len()).sum());
        let table =
            |(k, (names, columns)): (usize, (&'p BTreeSet<String>, Vec<ImportedColumn>))| {
                Ok(PartTable {
                    names,
                    rows: Rows::new(columns.len(), at_once),
                    replaced: 0,
                    writer: FlightWriter::of(&place(k), &columns)?,
                    columns,
                })
            };
        parts.into_iter().enumerate().map(table).collect()
    }

    /// The clock, and the wanted names, sorted.
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

    /// Refuses a part whose table has more numbers than a file may have.
    fn check_size(&self, survey: &Survey, part: &BTreeSet<String>, columns: usize) -> Result<()> {
        let times = part.iter().filter_map(|name| survey.names.get(name));
        let times = times.map(|values| values.count).max().unwrap_or_default();
        if times.saturating_mul(columns) <= MOST_NUMBERS {
            return Ok(());
        }
        let names = columns - 1;
        let what = format!("{names} names at {times} times are more than {MOST_NUMBERS} numbers");
        Err(refused(&self.source, &what))
    }

    /// Fills the tables in one pass, with a row for each time at which any name of a part has a
    /// value. Names without a column also make rows, since the clock is that of all names. Values
    /// are sorted beside `scratch`.
    pub(super) fn filled<'p>(
        &self,
        survey: &Survey,
        mut tables: Vec<PartTable<'p>>,
        scratch: &Path,
    ) -> Result<Vec<PartTable<'p>>> {
        let mut columns = Vec::new();
        let mut places: BTreeMap<&str, usize> = BTreeMap::new();
        for (k, table) in tables.iter().enumerate() {
            for name in table.names {
                places.insert(name, columns.len());
                columns.push((k, table.column(name)));
            }
        }
        let place = |name: &str| places.get(name).copied();
        self.in_order(survey, scratch, &place, &mut |time, place, value| {
            let (table, column) = columns[place];
            tables[table].put(time, column, value)
        })?;
        tables.iter_mut().try_for_each(PartTable::write)?;
        Ok(tables)
    }
}
