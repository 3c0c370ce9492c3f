//! Tall text: one row a value, with the columns time, name, value and perhaps unit. It becomes tall
//! Parquet in a temporary file, which is imported like any other.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use arrow::datatypes::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;

use super::calendar_time::CalendarTime;
use super::delimited::{
    Delimiter, Dialect, Failures, HEAD_ROWS, fields, is_missing, name_and_unit, next_line, number,
};
use super::imported_contents::{ImportedContents, of_scratch, refused, scratch_in, unwritable};
use super::tall::{self, Role, Tall};
use crate::error::{Error, Result};
use crate::store::encoding;
use crate::store::recorder::UNIT;
use crate::units::Unit;

/// Rows that are written at once.
const WRITTEN_AT_ONCE: usize = 1 << 16;

/// Least share of rows at the beginning that must have a time and a name that is no number.
const TALL_SHARE: f64 = 0.9;

/// Layout of a tall text.
#[derive(Debug, PartialEq)]
pub struct TallLayout {
    dialect: Dialect,
    /// Lines before the first row.
    skipped: usize,
    time: (usize, String),
    time_unit: Option<String>,
    /// First time, of a clock with calendar times.
    origin: Option<CalendarTime>,
    name: usize,
    value: usize,
    unit: Option<usize>,
}

impl TallLayout {
    /// Layout that the beginning of a text has; `None` for a text that is not tall.
    pub fn of(lines: &[&str]) -> Option<TallLayout> {
        let delimiters = ['\t', ';', ',', '|'].map(Delimiter::Character);
        let delimiters = || delimiters.into_iter().chain([Delimiter::Space]);
        let mut headers = lines.iter().enumerate().take(HEAD_ROWS);
        headers.find_map(|(at, line)| {
            delimiters().find_map(|delimiter| TallLayout::below(lines, at, line, delimiter))
        })
    }

    /// Layout of the rows below a header.
    fn below(lines: &[&str], at: usize, line: &str, delimiter: Delimiter) -> Option<TallLayout> {
        let header = fields(line.trim_start_matches(['#', '%', '!']), delimiter);
        let heads: Vec<_> = header.iter().map(|field| name_and_unit(field)).collect();
        let find = |role: Role| heads.iter().position(|(name, _)| role.has(name));
        let (time, name, value) = (find(Role::Time)?, find(Role::Name)?, find(Role::Value)?);
        let (time_name, own_unit) = heads[time].clone();
        let mut layout = TallLayout {
            dialect: Dialect {
                delimiter,
                decimal_comma: false,
            },
            skipped: at + 1,
            time: (time, time_name),
            time_unit: own_unit,
            origin: None,
            name,
            value,
            unit: find(Role::Unit),
        };
        let mut rows = lines[at + 1..]
            .iter()
            .take(HEAD_ROWS)
            .map(|line| fields(line, delimiter));
        // A row of units may follow.
        let first = rows.clone().next()?;
        let first_time = first.get(time)?;
        if Unit::parse(first_time).is_ok() && number(first_time, false).is_none() {
            layout.time_unit.get_or_insert(first_time.clone());
            layout.skipped += 1;
            rows.next();
        }
        let rows: Vec<Vec<String>> = rows.collect();
        let fields = || {
            let fields = rows.iter().flat_map(|row| [row.get(time), row.get(value)]);
            fields.flatten()
        };
        let numbers = |comma: bool| fields().filter(|f| number(f, comma).is_some()).count();
        layout.dialect.decimal_comma = numbers(true) > numbers(false);
        let times = rows.iter().filter_map(|row| row.get(time));
        layout.origin = times.clone().find_map(|time| CalendarTime::parse(time));
        if layout.origin.is_some() {
            layout.time_unit = Some("s".to_owned());
        }
        let is_row = |row: &&Vec<String>| {
            let named = row.get(name).filter(|name| !name.is_empty());
            layout.time_of(row).is_some() && named.is_some_and(|name| number(name, true).is_none())
        };
        let fitting = rows.iter().filter(is_row).count();
        (fitting > 0 && fitting as f64 >= TALL_SHARE * rows.len() as f64).then_some(layout)
    }

    fn time_of(&self, row: &[String]) -> Option<f64> {
        let field = row.get(self.time.0)?;
        match self.origin {
            Some(origin) => CalendarTime::parse(field).map(|time| time.since(origin)),
            None => self.dialect.number(field),
        }
    }

    /// Imports a text of this layout.
    pub fn import(&self, source: &Path, file: &Path) -> Result<ImportedContents> {
        let folder = file.parent().unwrap_or(Path::new("."));
        let scratch = scratch_in(folder, "")?;
        let handle = scratch.reopen().map_err(unwritable(folder))?;
        let failures = self.write_parquet(source, handle)?;
        // The temporary file is gone when the message is read.
        let of_source = |error| of_scratch(error, source);
        let tall = Tall::open(scratch.path()).map_err(of_source)?;
        let tall = tall.ok_or_else(|| refused(source, "it has no values"))?;
        let mut contents = tall::import_opened(&tall, file).map_err(of_source)?;
        contents.notes.extend(failures.notes());
        if self.origin.is_some() {
            let note = "calendar times are seconds from the first row's";
            contents.notes.push(note.to_owned());
        }
        Ok(contents)
    }

    fn write_parquet(&self, source: &Path, handle: File) -> Result<Failures> {
        let unwritable = |e: parquet::errors::ParquetError| Error::store(source, &e);
        let schema = self.schema();
        let properties = encoding::properties().map_err(unwritable)?;
        let mut writer = ArrowWriter::try_new(handle, schema.clone(), Some(properties.build()))
            .map_err(unwritable)?;
        let opened = File::open(source).map_err(Error::io(source, "cannot open it"))?;
        let mut reader = BufReader::new(opened);
        let (mut line, mut number_of_line) = (Vec::new(), 0);
        let (mut rows, mut failures) = (TallRows::default(), Failures::default());
        while next_line(&mut reader, &mut line).map_err(Error::io(source, "cannot read it"))? {
            number_of_line += 1;
            let text = String::from_utf8_lossy(&line);
            if number_of_line > self.skipped && !text.trim().is_empty() {
                self.append(&text, number_of_line, &mut rows, &mut failures);
            }
            if rows.times.len() == WRITTEN_AT_ONCE {
                rows.write(&mut writer, &schema).map_err(unwritable)?;
            }
        }
        rows.write(&mut writer, &schema).map_err(unwritable)?;
        writer.close().map_err(unwritable)?;
        Ok(failures)
    }

    fn schema(&self) -> Arc<Schema> {
        let unit = self.time_unit.iter().map(|u| (UNIT.to_owned(), u.clone()));
        let field = |name: &str, kind: DataType| Field::new(name, kind, true);
        let time = field(&self.time.1, DataType::Float64).with_metadata(unit.collect());
        Arc::new(Schema::new(vec![
            time,
            field("name", DataType::Utf8),
            field("value", DataType::Float64),
            field("unit", DataType::Utf8),
        ]))
    }

    /// Appends a row. A row without a time is left out, and a value that is no number is missing.
    fn append(&self, text: &str, line: usize, rows: &mut TallRows, failures: &mut Failures) {
        let row = self.dialect.fields(text);
        let Some(name) = row.get(self.name).filter(|name| !name.is_empty()) else {
            failures.short_rows += 1;
            return;
        };
        let Some(time) = self.time_of(&row) else {
            failures.add(line, row.get(self.time.0).map_or("", String::as_str));
            return;
        };
        let field = row.get(self.value).map_or("", String::as_str);
        let value = self.dialect.number(field);
        if value.is_none() && !is_missing(field) {
            failures.add(line, field);
        }
        rows.times.push(time);
        rows.names.push(name.clone());
        rows.values.push(value.unwrap_or(f64::NAN));
        let unit = self.unit.and_then(|unit| row.get(unit));
        rows.units
            .push(unit.filter(|unit| !unit.is_empty()).cloned());
    }
}

/// Rows that are not written yet.
#[derive(Debug, Default)]
struct TallRows {
    times: Vec<f64>,
    names: Vec<String>,
    values: Vec<f64>,
    units: Vec<Option<String>>,
}

impl TallRows {
    /// Writes the rows and forgets them.
    fn write(
        &mut self,
        writer: &mut ArrowWriter<File>,
        schema: &Arc<Schema>,
    ) -> parquet::errors::Result<()> {
        let rows = std::mem::take(self);
        let columns: Vec<ArrayRef> = vec![
            Arc::new(Float64Array::from(rows.times)),
            Arc::new(StringArray::from(rows.names)),
            Arc::new(Float64Array::from(rows.values)),
            Arc::new(StringArray::from(rows.units)),
        ];
        writer.write(&RecordBatch::try_new(schema.clone(), columns)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(text: &str) -> Option<TallLayout> {
        let lines: Vec<&str> = text.lines().collect();
        TallLayout::of(&lines)
    }

    #[test]
    fn time_name_and_value_make_a_text_tall_in_any_order_and_language() {
        let plain = layout("# log\nname,time,value\nq,0.0,1.5\nde,0.0,2\n").unwrap();
        assert_eq!(
            (plain.skipped, plain.name, plain.time.0, plain.value),
            (2, 0, 1, 2)
        );
        let german = layout("Zeit [s];Kanal;Wert;Einheit\n0,1;q;1,5;Grad/s\n0,1;de;2;Grad\n");
        let german = german.unwrap();
        assert!(german.dialect.decimal_comma && german.unit == Some(3));
        assert_eq!(german.time_unit.as_deref(), Some("s"));
        let units = layout("time\tsignal\tvalue\nms\t\t\n0\tq\t1\n20\tq\t2\n").unwrap();
        assert_eq!((units.skipped, units.time_unit.as_deref()), (2, Some("ms")));
        let dated = "timestamp,parameter,value\n2024-05-01T12:30:05.25Z,q,1\n";
        assert!(layout(dated).unwrap().origin.is_some());
    }

    #[test]
    fn a_text_with_numbers_in_its_column_of_names_is_not_tall() {
        for text in [
            "time,signal,data\n0,1,2\n1,2,3\n",
            "time,q,value\n0,1,2\n1,2,3\n",
            "time,name,value\n",
            "",
        ] {
            assert_eq!(layout(text), None, "{text}");
        }
    }

    #[test]
    fn a_row_without_a_time_is_left_out_and_counted() {
        let layout = layout("time,name,value\n0,q,1\n").unwrap();
        let (mut rows, mut failures) = (TallRows::default(), Failures::default());
        for (k, text) in ["0.5,q,2", "oops,q,3", "1.0,q,AUTO", "1.5"]
            .iter()
            .enumerate()
        {
            layout.append(text, k + 2, &mut rows, &mut failures);
        }
        assert_eq!(
            (rows.times, rows.names),
            (vec![0.5, 1.0], vec!["q".to_owned(); 2])
        );
        let notes = failures.notes();
        assert!(
            notes[0].starts_with("2 fields") && notes[0].contains("line 3: `oops`"),
            "{notes:?}"
        );
        assert!(
            notes[1].starts_with("1 rows have fewer fields"),
            "{notes:?}"
        );
    }
}
