//! Parquet: tall files (time, name, value) become one column a name; other files keep their columns.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use arrow::array::{Array, AsArray, RecordBatch};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Float64Type};
use parquet::arrow::arrow_reader::{ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder};

use super::contents::{Contents, ImportedColumn, refused};
use super::flight_file::{BATCH_ROWS, Sink, write};
use crate::error::{Error, Result};

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

/// Values that are in memory at once where rows are not in the order of time: 0.8 GB.
const MOST_VALUES: usize = 50_000_000;

/// Imports a Parquet file of three or four columns.
pub fn import(source: &Path, file: &Path) -> Result<Contents> {
    let tall = Tall::open(source)?;
    let survey = tall.survey()?;
    let time = ImportedColumn {
        name: tall.time.clone(),
        unit: tall.time_unit.clone(),
    };
    let named = survey.units.iter().map(|(name, unit)| ImportedColumn {
        name: name.clone(),
        unit: unit.clone(),
    });
    let columns: Vec<ImportedColumn> = std::iter::once(time).chain(named).collect();
    let places: BTreeMap<&str, usize> = survey.units.keys().map(String::as_str).zip(1..).collect();
    let mut table = Rows::new(columns.len());
    let rows = write(file, &columns, |sink| {
        if survey.is_in_order {
            tall.each(|time, name, value| table.put(time, places.get(name).copied(), value, sink))?;
        } else {
            if survey.rows > MOST_VALUES {
                let what = format!(
                    "{} values out of the order of time do not fit into memory: sort the file by time",
                    survey.rows
                );
                return Err(refused(source, &what));
            }
            let mut sorted = Vec::with_capacity(survey.rows);
            tall.each(|time, name, value| {
                sorted.extend(places.get(name).map(|place| (time, *place, value)));
                Ok(())
            })?;
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (time, place, value) in sorted {
                table.put(time, Some(place), value, sink)?;
            }
        }
        table.finish(sink)
    })?;
    let mut notes = Vec::new();
    if table.replaced > 0 {
        notes.push(format!(
            "{} values came twice for a time and a name; the last one counts",
            table.replaced
        ));
    }
    Ok(Contents {
        rows,
        columns,
        notes,
    })
}

/// A tall file and the names of its columns.
struct Tall<'a> {
    source: &'a Path,
    time: String,
    time_unit: Option<String>,
    name: String,
    value: String,
    unit: Option<String>,
}

/// Names with their units, and the order of the rows.
#[derive(Default)]
struct Survey {
    units: BTreeMap<String, Option<String>>,
    is_in_order: bool,
    rows: usize,
}

impl<'a> Tall<'a> {
    fn open(source: &'a Path) -> Result<Tall<'a>> {
        let reader = builder(source)?;
        let schema = reader.schema();
        let find = |names: &[&str]| {
            let mut fields = schema.fields().iter();
            fields
                .find(|f| names.contains(&f.name().to_lowercase().as_str()))
                .map(|f| f.name().clone())
        };
        let (Some(time), Some(name), Some(value)) = (find(&TIMES), find(&NAMES), find(&VALUES))
        else {
            let what = "Parquet with one column a channel is read as it is: name it as the archive, or give it to `harvest \
                        init --from`; import takes tall files with the columns time, name, value and perhaps unit";
            return Err(refused(source, what));
        };
        let field = schema.field_with_name(&time).ok();
        let is_clock = field.is_some_and(|f| {
            matches!(
                f.data_type(),
                DataType::Timestamp(..) | DataType::Duration(_)
            )
        });
        let stated = field.and_then(|f| f.metadata().get(crate::store::archive::UNIT).cloned());
        let time_unit = if is_clock {
            Some("s".to_owned())
        } else {
            stated
        };
        Ok(Tall {
            source,
            time,
            time_unit,
            name,
            value,
            unit: find(&UNITS),
        })
    }

    fn survey(&self) -> Result<Survey> {
        let mut survey = Survey {
            is_in_order: true,
            ..Survey::default()
        };
        let mut before = f64::NEG_INFINITY;
        let mut units: BTreeMap<String, String> = BTreeMap::new();
        for batch in self.batches()? {
            let batch = batch?;
            let texts = self.texts(&batch, &self.name)?;
            let of_unit = self
                .unit
                .as_ref()
                .map(|unit| self.texts(&batch, unit))
                .transpose()?;
            for (row, time) in self.times(&batch)?.into_iter().enumerate() {
                survey.rows += 1;
                survey.is_in_order &= time >= before;
                before = time;
                let name = &texts[row];
                if !survey.units.contains_key(name) {
                    survey.units.insert(name.clone(), None);
                }
                if let Some(unit) = of_unit.as_ref().map(|u| &u[row]).filter(|u| !u.is_empty())
                    && !units.contains_key(name)
                {
                    units.insert(name.clone(), unit.clone());
                }
            }
        }
        for (name, unit) in units {
            survey.units.insert(name, Some(unit));
        }
        // A channel may have the clock's name.
        survey.units.remove(&self.time);
        Ok(survey)
    }

    /// Passes each row on in the order of the file.
    fn each(&self, mut row: impl FnMut(f64, &str, f64) -> Result<()>) -> Result<()> {
        for batch in self.batches()? {
            let batch = batch?;
            let names = self.texts(&batch, &self.name)?;
            let values = self.numbers(&batch, &self.value)?;
            for ((time, name), value) in self.times(&batch)?.into_iter().zip(&names).zip(values) {
                row(time, name, value)?;
            }
        }
        Ok(())
    }

    fn batches(&self) -> Result<impl Iterator<Item = Result<RecordBatch>>> {
        let damaged = |e: &dyn std::fmt::Display| {
            refused(self.source, &format!("not a readable Parquet file: {e}"))
        };
        let reader: ParquetRecordBatchReader = builder(self.source)?
            .with_batch_size(BATCH_ROWS)
            .build()
            .map_err(|e| damaged(&e))?;
        let source = self.source.to_owned();
        Ok(reader.map(move |batch| {
            batch.map_err(|e| refused(&source, &format!("not a readable Parquet file: {e}")))
        }))
    }

    fn column<'b>(&self, batch: &'b RecordBatch, name: &str) -> Result<&'b dyn Array> {
        let column = batch.column_by_name(name).map(AsRef::as_ref);
        column.ok_or_else(|| {
            refused(
                self.source,
                &format!("a part of the file lacks the column `{name}`"),
            )
        })
    }

    /// Times; those of a calendar in seconds since its beginning.
    fn times(&self, batch: &RecordBatch) -> Result<Vec<f64>> {
        use arrow::datatypes::TimeUnit;
        let ticks = match self.column(batch, &self.time)?.data_type() {
            DataType::Timestamp(unit, _) | DataType::Duration(unit) => Some(match unit {
                TimeUnit::Second => 1.0,
                TimeUnit::Millisecond => 1e-3,
                TimeUnit::Microsecond => 1e-6,
                TimeUnit::Nanosecond => 1e-9,
            }),
            _ => None,
        };
        let numbers = self.numbers(batch, &self.time)?;
        Ok(match ticks {
            Some(tick) => numbers.into_iter().map(|t| t * tick).collect(),
            None => numbers,
        })
    }

    fn numbers(&self, batch: &RecordBatch, name: &str) -> Result<Vec<f64>> {
        let column = self.column(batch, name)?;
        let no_numbers = |_| refused(self.source, &format!("column `{name}` holds no numbers"));
        let is_clock = matches!(
            column.data_type(),
            DataType::Timestamp(..) | DataType::Duration(_)
        );
        let plain = if is_clock {
            cast(column, &DataType::Int64)
        } else {
            cast(column, &DataType::Float64)
        };
        let plain = cast(&plain.map_err(no_numbers)?, &DataType::Float64).map_err(no_numbers)?;
        let numbers = plain.as_primitive::<Float64Type>();
        Ok(numbers.iter().map(|v| v.unwrap_or(f64::NAN)).collect())
    }

    fn texts(&self, batch: &RecordBatch, name: &str) -> Result<Vec<String>> {
        let column = self.column(batch, name)?;
        let plain = cast(column, &DataType::Utf8)
            .map_err(|_| refused(self.source, &format!("column `{name}` holds no text")))?;
        Ok(plain
            .as_string::<i32>()
            .iter()
            .map(|t| t.unwrap_or_default().to_owned())
            .collect())
    }
}

fn builder(source: &Path) -> Result<ParquetRecordBatchReaderBuilder<File>> {
    let file = File::open(source).map_err(Error::io(source, "cannot open it"))?;
    ParquetRecordBatchReaderBuilder::try_new(file)
        .map_err(|e| refused(source, &format!("not a readable Parquet file: {e}")))
}

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
    fn put(&mut self, time: f64, place: Option<usize>, value: f64, sink: &mut Sink) -> Result<()> {
        let Some(place) = place else {
            return Ok(());
        };
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
        if let Some(cell) = self.batch[place].last_mut() {
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
