//! The wide table of a part: one column a name, one row a time.

use std::collections::{BTreeMap, BTreeSet};

use super::source::Tall;
use super::survey::Survey;
use crate::error::Result;
use crate::store::import::flight_file::{BATCH_ROWS, Sink};
use crate::store::import::imported_contents::ImportedColumn;

/// Place of a name without a column.
const NO_COLUMN: usize = usize::MAX;

/// Rows being filled: one for each time.
pub(super) struct RowsOfTime {
    batch: Vec<Vec<f64>>,
    /// Values that came again for a time and a name.
    pub replaced: usize,
}

impl RowsOfTime {
    pub(super) fn new(columns: usize) -> RowsOfTime {
        RowsOfTime {
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

impl Tall {
    /// The clock, and the names that are wanted, sorted.
    pub(super) fn columns(
        &self,
        survey: &Survey,
        is_wanted: impl Fn(&str) -> bool,
    ) -> Vec<ImportedColumn> {
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
    pub(super) fn fill(
        &self,
        survey: &Survey,
        part: &BTreeSet<String>,
        columns: &[ImportedColumn],
        table: &mut RowsOfTime,
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
}
