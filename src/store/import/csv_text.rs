//! Delimited text: any delimiter, a row of units, decimal commas, comments before the header.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use super::flight_file::{FlightWriter, batch_rows};
use super::imported_contents::{ImportedColumn, ImportedContents, refused};
use crate::error::{Error, Result};

/// Bytes at the beginning from which the layout follows.
const HEAD_BYTES: u64 = 1 << 18;
/// Rows at the beginning that must hold a number for a column to be one of numbers.
const HEAD_ROWS: usize = 500;
/// Longest line: far more than any recorder's.
const LONGEST_LINE: u64 = 1 << 20;

/// Layout of a text.
#[derive(Clone, Debug, PartialEq)]
struct Layout {
    delimiter: Delimiter,
    decimal_comma: bool,
    /// Lines before the first row of numbers.
    skipped: usize,
    /// Columns of numbers, with their places in a row.
    columns: Vec<(usize, ImportedColumn)>,
    /// Columns of text.
    dropped: Vec<String>,
}

/// Separator of fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Delimiter {
    Character(char),
    /// One or more spaces or tabs.
    Space,
}

/// Imports a delimited text.
pub fn import(source: &Path, file: &Path) -> Result<ImportedContents> {
    let unreadable = |e| Error::io(source, "cannot read it")(e);
    let opened = || File::open(source).map_err(Error::io(source, "cannot open it"));
    let mut head = Vec::new();
    opened()?
        .take(HEAD_BYTES)
        .read_to_end(&mut head)
        .map_err(unreadable)?;
    if let Some(what) = other_text(&head) {
        return Err(refused(source, what));
    }
    let head = String::from_utf8_lossy(&head).into_owned();
    let layout = Layout::of(&head).map_err(|what| refused(source, &what))?;
    let columns: Vec<ImportedColumn> = layout
        .columns
        .iter()
        .map(|(_, column)| column.clone())
        .collect();
    let mut reader = BufReader::new(opened()?);
    let mut failures = Failures::default();
    let mut writer = FlightWriter::of(file, &columns)?;
    let mut batch = vec![Vec::new(); columns.len()];
    let at_once = batch_rows(columns.len());
    let mut line = Vec::new();
    let mut number = 0;
    loop {
        line.clear();
        let read = (&mut reader)
            .take(LONGEST_LINE)
            .read_until(b'\n', &mut line)
            .map_err(unreadable)?;
        if read == 0 {
            break;
        }
        number += 1;
        let text = String::from_utf8_lossy(&line);
        if number > layout.skipped && !text.trim().is_empty() {
            layout.append(&text, number, &mut batch, &mut failures);
        }
        if batch.first().is_some_and(|column| column.len() == at_once) {
            writer.write(&batch)?;
            batch.iter_mut().for_each(Vec::clear);
        }
    }
    writer.write(&batch)?;
    let rows = writer.place()?;
    let mut notes = failures.notes();
    if !layout.dropped.is_empty() {
        notes.push(format!(
            "columns of text are left out: {}",
            layout.dropped.join(", ")
        ));
    }
    Ok(ImportedContents {
        rows,
        columns,
        notes,
        folder: None,
    })
}

/// Kind of a text whose lines cannot be read, in words.
fn other_text(head: &[u8]) -> Option<&'static str> {
    if head.starts_with(b"\xff\xfe") || head.starts_with(b"\xfe\xff") {
        return Some("it is UTF-16 text; save it as UTF-8");
    }
    let has = |byte: u8| head.contains(&byte);
    (has(b'\r') && !has(b'\n'))
        .then_some("its lines end with carriage returns alone; save it with line feeds")
}

/// Fields in rows of numbers that are no numbers.
#[derive(Debug, Default)]
struct Failures {
    fields: usize,
    first: Option<(usize, String)>,
    short_rows: usize,
}

impl Failures {
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if let Some((line, field)) = &self.first {
            notes.push(format!(
                "{} fields that are no numbers are missing values, the first on line {line}: `{field}`",
                self.fields
            ));
        }
        if self.short_rows > 0 {
            notes.push(format!(
                "{} rows have fewer fields than the header",
                self.short_rows
            ));
        }
        notes
    }
}

/// Words that recorders write for a missing value.
const MISSING: [&str; 8] = ["", "nan", "na", "n/a", "null", "none", "-", "inf"];

impl Layout {
    /// Layout that the beginning of a text has.
    fn of(head: &str) -> std::result::Result<Layout, String> {
        let lines: Vec<&str> = head.lines().collect();
        let usable = if head.len() as u64 >= HEAD_BYTES {
            lines.len().saturating_sub(1)
        } else {
            lines.len()
        };
        let lines = &lines[..usable];
        let delimiters = ['\t', ';', ',', '|'].map(Delimiter::Character);
        let layouts = delimiters
            .into_iter()
            .chain([Delimiter::Space])
            .flat_map(|delimiter| [false, true].map(|comma| (delimiter, comma)));
        // Between commas only quotes make a decimal comma: `"1,5","2,5"`.
        let has_quotes = head.contains('"');
        let sensible = layouts.filter(|(delimiter, comma)| {
            has_quotes || !(*comma && *delimiter == Delimiter::Character(','))
        });
        let best = sensible
            .filter_map(|(delimiter, comma)| Layout::with(lines, delimiter, comma))
            // Of layouts that read as many numbers the first counts: a space also separates `1, 2`.
            .reduce(|best, other| if other.0 > best.0 { other } else { best });
        let layout = best.map(|(_, layout)| layout).ok_or_else(|| {
            "no table of numbers: harvest imports text with one row a sample and a header, MATLAB, HDF5 and tall Parquet"
                .to_owned()
        })?;
        match layout.decimal_commas_between_commas(lines) {
            Some(what) => Err(what),
            None => Ok(layout),
        }
    }

    /// Layout with one delimiter, and the count of numbers that it reads; `None` without a row of two or
    /// more numbers.
    fn with(lines: &[&str], delimiter: Delimiter, decimal_comma: bool) -> Option<(usize, Layout)> {
        let head = Head::of(lines, delimiter, decimal_comma)?;
        let (dropped, kept): (Vec<usize>, Vec<usize>) =
            (0..head.names.len()).partition(|at| head.is_text(*at));
        let mut columns: Vec<(usize, ImportedColumn)> =
            kept.iter().map(|at| (*at, head.column(*at))).collect();
        make_unique(&mut columns);
        let all = kept.iter().map(|at| head.count_numbers(*at)).sum();
        let dropped = dropped.into_iter().map(|at| head.names[at].clone());
        let layout = Layout {
            delimiter,
            decimal_comma,
            skipped: head.skipped,
            dropped: dropped.collect(),
            columns,
        };
        (layout.columns.len() >= 2).then_some((all, layout))
    }

    /// Message for rows that have twice as many fields as the line of names above them: their
    /// decimal commas look like separators.
    fn decimal_commas_between_commas(&self, lines: &[&str]) -> Option<String> {
        let count = |line: &&str| fields(line, self.delimiter).len();
        let rows = lines.get(self.skipped).map_or(0, count);
        let above = self.skipped.checked_sub(1).and_then(|k| lines.get(k));
        let above = above.filter(|line| !line.starts_with(['#', '%', '!']));
        let names = above.map_or(0, count);
        let is_comma = self.delimiter == Delimiter::Character(',') && !self.decimal_comma;
        (is_comma && names >= 2 && rows == 2 * names).then(|| {
            format!(
                "its rows have {rows} fields and the line above them {names}: decimal commas between commas cannot be \
                 told apart; save it with semicolons or decimal points"
            )
        })
    }

    /// Appends a row to a batch; a field that is no number is missing.
    fn append(
        &self,
        line: &str,
        number_of_line: usize,
        batch: &mut [Vec<f64>],
        failures: &mut Failures,
    ) {
        let fields = fields(line, self.delimiter);
        for (column, (at, _)) in batch.iter_mut().zip(&self.columns) {
            let field = fields.get(*at);
            let value = field.and_then(|field| number(field, self.decimal_comma));
            match (field, value) {
                (None, _) => failures.short_rows += 1,
                (Some(field), None) if !is_missing(field) => {
                    failures.fields += 1;
                    failures
                        .first
                        .get_or_insert((number_of_line, field.clone()));
                }
                _ => {}
            }
            column.push(value.unwrap_or(f64::NAN));
        }
    }
}

/// Beginning of a text in fields, as one delimiter and decimal sign read it.
struct Head {
    decimal_comma: bool,
    /// Lines above the first row of numbers.
    skipped: usize,
    /// Name of each column.
    names: Vec<String>,
    /// Unit of each column, empty where there is none; no units without a line of units.
    units: Vec<String>,
    /// First rows of numbers.
    rows: Vec<Vec<String>>,
}

impl Head {
    /// `None` without a row of two or more numbers.
    fn of(lines: &[&str], delimiter: Delimiter, decimal_comma: bool) -> Option<Head> {
        let skipped = lines
            .iter()
            .position(|line| is_data(&fields(line, delimiter), decimal_comma))?;
        let width = fields(lines[skipped], delimiter).len();
        let above = lines[..skipped].iter().enumerate().map(|(at, line)| {
            let line = line.trim_start_matches(['#', '%', '!']).trim_start();
            (at, fields(line, delimiter))
        });
        let headers: Vec<(usize, Vec<String>)> =
            above.filter(|(_, fields)| fields.len() == width).collect();
        let (names, units) = names_and_units(&headers, width);
        let rows = lines[skipped..].iter().take(HEAD_ROWS);
        Some(Head {
            decimal_comma,
            skipped,
            names,
            units,
            rows: rows.map(|line| fields(line, delimiter)).collect(),
        })
    }

    /// Fields of a column, where a row has it.
    fn fields(&self, at: usize) -> impl Iterator<Item = &String> {
        self.rows.iter().filter_map(move |row| row.get(at))
    }

    fn count_numbers(&self, at: usize) -> usize {
        self.fields(at)
            .filter(|field| number(field, self.decimal_comma).is_some())
            .count()
    }

    /// `true` for a column of text without any number.
    fn is_text(&self, at: usize) -> bool {
        self.count_numbers(at) == 0 && self.fields(at).any(|field| !is_missing(field))
    }

    fn column(&self, at: usize) -> ImportedColumn {
        let (name, own) = name_and_unit(&self.names[at]);
        let stated = self.units.get(at).cloned();
        let unit = stated.filter(|unit| !unit.is_empty()).or(own);
        ImportedColumn { name, unit }
    }
}

/// `true` for the fields of a row of numbers. A recording may begin with missing values; lines above it have
/// text beside their numbers.
fn is_data(fields: &[String], decimal_comma: bool) -> bool {
    let is_number = |field: &&String| number(field, decimal_comma).is_some();
    let numbers = fields.iter().filter(is_number).count();
    let has_text = || fields.iter().any(|f| !is_number(&f) && !is_missing(f));
    fields.len() >= 2 && (numbers * 2 > fields.len() || numbers > 0 && !has_text())
}

/// Names and units from the lines above the numbers: the header is the nearest line of text, and the line
/// below it holds units if there are two.
fn names_and_units(headers: &[(usize, Vec<String>)], width: usize) -> (Vec<String>, Vec<String>) {
    let numbered = || (1..=width).map(|n| format!("column_{n}")).collect();
    match headers {
        [] => (numbered(), Vec::new()),
        [.., (first, names), (second, units)] if second - first == 1 && are_units(units) => (
            names.clone(),
            units.iter().map(|unit| plain_unit(unit)).collect(),
        ),
        [.., (_, names)] => (names.clone(), Vec::new()),
    }
}

/// `true` for a row of units: most fields are units that harvest has, or in brackets, or empty.
fn are_units(fields: &[String]) -> bool {
    let is_unit = |field: &&String| {
        let field = field.trim();
        field.is_empty()
            || field.starts_with(['[', '('])
            || crate::units::Unit::parse(field).is_ok()
    };
    2 * fields.iter().filter(is_unit).count() > fields.len()
}

/// A unit without brackets.
fn plain_unit(text: &str) -> String {
    text.trim()
        .trim_matches(['[', ']', '(', ')', '{', '}'])
        .trim()
        .to_owned()
}

/// Name of a column, and the unit in brackets after it.
fn name_and_unit(header: &str) -> (String, Option<String>) {
    let header = header.trim();
    let bracket = header.find(['[', '(', '{']).filter(|at| *at > 0);
    match bracket {
        Some(at) if header.ends_with([']', ')', '}']) => {
            let unit = plain_unit(&header[at..]);
            (
                header[..at].trim().to_owned(),
                Some(unit).filter(|u| !u.is_empty()),
            )
        }
        _ => (header.to_owned(), None),
    }
}

/// Gives columns without a name, or with the name of another, a number.
fn make_unique(columns: &mut [(usize, ImportedColumn)]) {
    let mut taken = std::collections::BTreeSet::new();
    for (at, column) in columns {
        if column.name.is_empty() {
            column.name = format!("column_{}", *at + 1);
        }
        let base = column.name.clone();
        let mut n = 2;
        while !taken.insert(column.name.clone()) {
            column.name = format!("{base}_{n}");
            n += 1;
        }
    }
}

/// Fields of a line without quotes and spaces around them.
fn fields(line: &str, delimiter: Delimiter) -> Vec<String> {
    let plain = |field: &str| field.trim().trim_matches('"').trim().to_owned();
    let line = line
        .trim_end_matches(['\r', '\n'])
        .trim_start_matches('\u{feff}');
    match delimiter {
        Delimiter::Space => line.split_whitespace().map(plain).collect(),
        Delimiter::Character(c) if line.contains('"') => {
            quoted(line, c).iter().map(|f| plain(f)).collect()
        }
        Delimiter::Character(c) => line.split(c).map(plain).collect(),
    }
}

/// Fields of a line in which quotes protect delimiters.
fn quoted(line: &str, delimiter: char) -> Vec<String> {
    let mut fields = vec![String::new()];
    let mut inside = false;
    for c in line.chars() {
        inside ^= c == '"';
        if c == delimiter && !inside {
            fields.push(String::new());
        } else if let Some(field) = fields.last_mut() {
            field.push(c);
        }
    }
    fields
}

fn is_missing(field: &str) -> bool {
    MISSING.contains(&field.to_lowercase().as_str())
}

/// A number, or a time of day as seconds: `12:30:05.25`.
fn number(field: &str, decimal_comma: bool) -> Option<f64> {
    if is_missing(field) {
        return None;
    }
    let parse = |text: &str| {
        let text = text.trim();
        let is_number = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        match text.split_once(',') {
            _ if !is_number => None,
            Some((whole, part)) if decimal_comma => format!("{whole}.{part}").parse().ok(),
            Some(_) => None,
            None => text.replace(['D', 'd'], "e").parse().ok(),
        }
    };
    let parts: Vec<&str> = field.split(':').collect();
    match parts.as_slice() {
        [one] => parse(one),
        [hours, minutes, seconds] => {
            Some(parse(hours)? * 3600.0 + parse(minutes)? * 60.0 + parse(seconds)?)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(text: &str) -> Layout {
        Layout::of(text).unwrap()
    }

    fn names(layout: &Layout) -> Vec<(&str, &str)> {
        let columns = layout.columns.iter().map(|(_, c)| c);
        columns
            .map(|c| (c.name.as_str(), c.unit.as_deref().unwrap_or("")))
            .collect()
    }

    #[test]
    fn delimiters_decimal_commas_and_units_are_found() {
        let comma = layout("time,alpha [deg],q (deg/s)\n0,1.5,2\n0.1,1.6,3\n");
        assert_eq!(
            names(&comma),
            [("time", ""), ("alpha", "deg"), ("q", "deg/s")]
        );
        let german = layout("Zeit;Alpha\ns;deg\n0,00;1,5\n0,10;1,6\n");
        assert_eq!(
            (german.delimiter, german.decimal_comma),
            (Delimiter::Character(';'), true)
        );
        assert_eq!(names(&german), [("Zeit", "s"), ("Alpha", "deg")]);
        let tabs = layout("# recorded by nobody\ntime\tV\n[s]\t[m/s]\n0\t50\n1\t51\n");
        assert_eq!(names(&tabs), [("time", "s"), ("V", "m/s")]);
        let spaces = layout("  t     q\n 0.0   1.0e-3\n 0.1  -2.0D+1\n");
        assert_eq!(
            (spaces.delimiter, names(&spaces).len()),
            (Delimiter::Space, 2)
        );
        let bare = layout("0 1 2\n1 2 3\n");
        assert_eq!(names(&bare)[2].0, "column_3");
    }

    #[test]
    fn a_recording_may_begin_with_missing_values() {
        let slow = layout("time,mach,q,note\n0.0,nan,,\n0.1,nan,1,\n0.2,0.5,2,\n");
        assert_eq!(slow.skipped, 1);
        assert_eq!(names(&slow)[..3], [("time", ""), ("mach", ""), ("q", "")]);
        let empty = layout("time;q\n0,0;nan\n0,1;nan\n");
        assert_eq!((empty.skipped, names(&empty).len()), (1, 2));
        let padded = layout("Sample rate,40,,\ntime,a,b,c\n0,1,2,3\n1,2,3,4\n");
        assert_eq!((padded.skipped, names(&padded)[1].0), (2, "a"));
    }

    #[test]
    fn decimal_commas_between_commas_are_read_in_quotes_and_else_named() {
        let quoted = layout("time,q\n\"0,0\",\"1,5\"\n\"0,1\",\"2,5\"\n");
        assert_eq!(
            (quoted.delimiter, quoted.decimal_comma, names(&quoted).len()),
            (Delimiter::Character(','), true, 2)
        );
        let bare = Layout::of("time,q\n0,0,1,5\n0,1,2,5\n").unwrap_err();
        assert!(bare.contains("decimal commas between commas"), "{bare}");
    }

    #[test]
    fn other_encodings_and_line_ends_are_named() {
        let said = |head: &[u8]| other_text(head).unwrap_or_default();
        assert!(said(b"\xff\xfet\0").contains("UTF-16"));
        assert!(said(b"time,q\r0,1\r1,2\r").contains("carriage returns"));
        assert_eq!(said(b"time,q\r\n0,1\r\n"), "");
    }

    #[test]
    fn text_columns_are_dropped_and_what_is_no_number_is_missing() {
        let layout = layout("time,mode,q\n00:00:01.5,AUTO,1\n00:00:02.5,MAN,2\n");
        assert_eq!(layout.dropped, ["mode"]);
        let (mut batch, mut failures) = (vec![Vec::new(), Vec::new()], Failures::default());
        layout.append("01:00:00.25,AUTO,oops", 4, &mut batch, &mut failures);
        assert_eq!(batch[0], [3600.25]);
        assert!(batch[1][0].is_nan());
        assert!(failures.notes()[0].contains("line 4: `oops`"));
    }

    #[test]
    fn numbers_are_read_to_the_last_bit() {
        for value in [
            0.1_f64 + 0.2,
            1.0 / 3.0,
            -5e-324,
            1.797e308,
            123_456_789.123_456_78,
        ] {
            assert_eq!(
                number(&format!("{value:?}"), false).map(f64::to_bits),
                Some(value.to_bits())
            );
            let comma = format!("{value:?}").replace('.', ",");
            assert_eq!(
                number(&comma, true).map(f64::to_bits),
                Some(value.to_bits())
            );
        }
        assert_eq!(number("1,5", false), None);
        assert_eq!(number("e5", false), None);
    }

    #[test]
    fn a_text_without_numbers_is_refused() {
        assert!(Layout::of("Dear reader,\nthis is prose\n").is_err());
        assert!(Layout::of("").is_err());
    }
}
