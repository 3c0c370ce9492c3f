//! Layout of a delimited text, found from its beginning: delimiter, decimal sign, header, columns.

use std::collections::{BTreeMap, BTreeSet};

use super::calendar_time::{CalendarTime, is_ambiguous, is_time_of_day};
use super::csv_header::{HeadLine, names_and_units};
use super::csv_times::{DateBesideTime, Origin, date_beside_time};
use super::delimited::{
    Delimiter, Dialect, Failures, HEAD_ROWS, is_clock_time, is_missing, name_and_unit,
};
use super::imported_contents::ImportedColumn;
use super::tall::Role;

/// Bytes at the beginning from which the layout follows.
pub const HEAD_BYTES: u64 = 1 << 18;

/// Message for a text without numbers.
pub const NO_TABLE: &str = "no table of numbers: harvest imports text with one row a sample and a header, MATLAB, HDF5 and tall Parquet";

/// Layout of a text.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    dialect: Dialect,
    /// Lines before the first row of numbers.
    pub skipped: usize,
    /// Number of fields of a row.
    width: usize,
    /// Columns of numbers.
    pub columns: Vec<NumberColumn>,
    /// Columns of text.
    pub dropped: Vec<String>,
    /// `false` if no line above the numbers names the columns.
    pub has_names: bool,
}

/// Column of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberColumn {
    /// Its place in a row.
    at: usize,
    pub head: ImportedColumn,
    /// Origin of its values, if these are calendar times.
    origin: Option<Origin>,
}

impl Layout {
    /// Layout that the beginning of a text has.
    ///
    /// # Errors
    /// A sentence: the text has no table of numbers, or its dates or decimal commas are ambiguous.
    pub fn of(head: &str) -> Result<Layout, String> {
        let lines = &whole_lines(head)[..];
        let layouts = dialects(head)
            .into_iter()
            .filter_map(|dialect| Layout::in_dialect(lines, dialect));
        // Of layouts that read as many numbers the first counts: a space also separates `1, 2`.
        let best = layouts.reduce(|best, other| if other.0 > best.0 { other } else { best });
        let layout = best.map(|(_, layout)| layout);
        if let Some(message) = ambiguous_dates(lines, layout.as_ref()) {
            return Err(message);
        }
        let layout = layout.ok_or_else(|| {
            if head.trim().is_empty() {
                return "it is empty".to_owned();
            }
            NO_TABLE.to_owned()
        })?;
        match layout.decimal_commas_between_commas(lines) {
            Some(message) => Err(message),
            None => Ok(layout),
        }
    }

    /// Layout in one dialect, and the count of numbers that it reads; `None` without a row of two or
    /// more numbers.
    fn in_dialect(lines: &[&str], dialect: Dialect) -> Option<(usize, Layout)> {
        let mut first = lines.iter().position(|line| is_data(line, dialect))?;
        let width = frequent_width(&lines[first..], dialect)?;
        let mut headers: Vec<HeadLine> = lines[..first]
            .iter()
            .enumerate()
            .map(|(at, line)| HeadLine::of(at, line, dialect.delimiter))
            .filter(|line| line.fields.len() == width)
            .collect();
        if let Some(row) = first_row_below_names(&headers) {
            first = headers[row].at;
            headers.truncate(row);
        }
        let (names, units) = names_and_units(&headers, width, dialect.delimiter);
        let rows: Vec<Vec<String>> = lines[first..]
            .iter()
            .take(HEAD_ROWS)
            .map(|line| dialect.fields(line))
            .collect();
        let fields_of = |at: usize| rows.iter().filter_map(move |row| row.get(at));
        let numbers = |at: usize| fields_of(at).filter(|f| is_value(f, dialect)).count();
        let is_text = |at: &usize| numbers(*at) == 0 && !fields_of(*at).all(|f| is_missing(f));
        let (mut dropped, kept): (Vec<usize>, Vec<usize>) = (0..width).partition(is_text);
        let dated = date_beside_time(&rows, width);
        dropped.retain(|at| dated.is_none_or(|dated| dated.date != *at));
        let column = |&at: &usize| {
            let origin = origin_of_times(at, &rows, dated);
            let is_time = origin.is_some() || fields_of(at).any(|field| is_clock_time(field));
            NumberColumn {
                at,
                head: column_head(&names[at], units.get(at), is_time),
                origin,
            }
        };
        let mut columns: Vec<NumberColumn> = kept.iter().map(column).collect();
        make_unique(&mut columns);
        let numbers_read = kept.iter().map(|at| numbers(*at)).sum();
        let layout = Layout {
            dialect,
            skipped: first,
            width,
            dropped: dropped.into_iter().map(|at| names[at].clone()).collect(),
            columns,
            has_names: !headers.is_empty(),
        };
        (layout.columns.len() >= 2).then_some((numbers_read, layout))
    }

    /// Message for rows that have twice as many fields as the line of names above them: their
    /// decimal commas look like separators.
    fn decimal_commas_between_commas(&self, lines: &[&str]) -> Option<String> {
        let count = |line: &&str| self.dialect.fields(line).len();
        let rows = lines.get(self.skipped).map_or(0, count);
        let above = self.skipped.checked_sub(1).and_then(|k| lines.get(k));
        let above = above.filter(|line| !line.starts_with(['#', '%', '!']));
        let names = above.map_or(0, count);
        let is_comma = self.dialect
            == Dialect {
                delimiter: Delimiter::Character(','),
                decimal_comma: false,
            };
        (is_comma && names >= 2 && rows == 2 * names).then(|| {
            format!(
                "its rows have {rows} fields and the line above them {names}: decimal commas between commas cannot be \
                 distinguished; save it with semicolons or decimal points"
            )
        })
    }

    /// Origins of the columns of calendar times, in words.
    pub fn notes_on_times(&self) -> Vec<String> {
        let of = |is_own: fn(&Origin) -> bool| {
            let own = self
                .columns
                .iter()
                .filter(|c| c.origin.is_some_and(|o| is_own(&o)));
            let names: Vec<&str> = own.map(|c| c.head.name.as_str()).collect();
            names.join(", ")
        };
        let first = of(|origin| matches!(origin, Origin::First(_)));
        let midnight = of(|origin| matches!(origin, Origin::Midnight { .. }));
        [
            ("calendar times are seconds from the first row's", first),
            (
                "times with a date are seconds from the first date's midnight",
                midnight,
            ),
        ]
        .into_iter()
        .filter(|(_, names)| !names.is_empty())
        .map(|(note, names)| format!("{note}: {names}"))
        .collect()
    }

    /// Appends a row to a batch; a field that is no number is missing.
    pub fn append(
        &self,
        line: &str,
        number_of_line: usize,
        batch: &mut [Vec<f64>],
        failures: &mut Failures,
    ) {
        let fields = self.dialect.fields(line);
        for (column, NumberColumn { at, origin, .. }) in batch.iter_mut().zip(&self.columns) {
            let field = fields.get(*at);
            let value = match origin {
                Some(origin) => origin.seconds(&fields, *at),
                None => field.and_then(|field| self.dialect.number(field)),
            };
            match (field, value) {
                (None, _) => failures.short_rows += 1,
                (Some(field), None) if !is_missing(field) => {
                    failures.add(number_of_line, field);
                }
                _ => {}
            }
            column.push(value.unwrap_or(f64::NAN));
        }
        failures.long_rows += usize::from(fields.len() > self.width);
    }
}

/// Number of fields that most of the rows at the beginning have: single rows may be short or long.
fn frequent_width(lines: &[&str], dialect: Dialect) -> Option<usize> {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    let rows = lines.iter().filter(|line| is_data(line, dialect));
    for line in rows.take(HEAD_ROWS) {
        *counts.entry(dialect.fields(line).len()).or_default() += 1;
    }
    let most = counts
        .into_iter()
        .max_by_key(|(width, rows)| (*rows, *width));
    most.map(|(width, _)| width)
}

/// Place of the first line with a number below a line of names alone, among lines of words above the numbers: it is
/// a row that begins the table with text in its columns.
fn first_row_below_names(headers: &[HeadLine]) -> Option<usize> {
    let names = headers.iter().position(HeadLine::is_all_names)?;
    let below = headers
        .iter()
        .skip(names + 1)
        .position(HeadLine::has_number);
    below.map(|row| names + 1 + row)
}

/// Characters that separate fields in rare recorders. Signs of numbers, dates, brackets, quotes and comments are not
/// among them.
const RARE_DELIMITERS: [char; 8] = ['~', '^', '&', '$', '@', '\u{1}', '\u{1e}', '\u{1f}'];

/// Dialects that a text may have, the likeliest first.
fn dialects(head: &str) -> Vec<Dialect> {
    // Between commas only quotes make a decimal comma: `"1,5","2,5"`.
    let has_quotes = head.contains('"');
    let rare = RARE_DELIMITERS.into_iter().filter(|c| head.contains(*c));
    let delimiters = ['\t', ';', ',', '|'].into_iter().chain(rare);
    let mut dialects: Vec<Dialect> = delimiters
        .map(Delimiter::Character)
        .chain([Delimiter::Space])
        .flat_map(|delimiter| {
            [false, true].map(|decimal_comma| Dialect {
                delimiter,
                decimal_comma,
            })
        })
        .collect();
    dialects.retain(|dialect| {
        let is_comma = dialect.delimiter == Delimiter::Character(',');
        has_quotes || !(dialect.decimal_comma && is_comma)
    });
    dialects
}

/// `true` for a number or a calendar time.
fn is_value(field: &str, dialect: Dialect) -> bool {
    dialect.number(field).is_some() || CalendarTime::parse(field).is_some()
}

/// `true` for a row of numbers. A recording may begin with missing values; lines above it have text
/// beside their numbers.
fn is_data(line: &str, dialect: Dialect) -> bool {
    let fields = dialect.fields(line);
    let numbers = fields.iter().filter(|f| is_value(f, dialect)).count();
    let is_dated = fields.iter().any(|f| CalendarTime::midnight(f).is_some())
        && fields.iter().any(|f| is_time_of_day(f));
    let is_date = |f: &str| is_dated && CalendarTime::midnight(f).is_some();
    let is_text = |f: &String| !is_value(f, dialect) && !is_missing(f) && !is_date(f);
    let has_text = || fields.iter().any(is_text);
    fields.len() >= 2 && (numbers * 2 > fields.len() || numbers > 0 && !has_text())
}

/// Origin of the calendar times in the column `at`; `None` for a column of other numbers.
fn origin_of_times(
    at: usize,
    rows: &[Vec<String>],
    dated: Option<DateBesideTime>,
) -> Option<Origin> {
    if let Some(dated) = dated.filter(|dated| dated.time == at) {
        return Some(dated.origin);
    }
    let first = rows
        .iter()
        .find_map(|row| CalendarTime::parse(row.get(at)?));
    first.map(Origin::First)
}

/// Name and unit of a column from its header, and from the row of units if there is one. Times of day become
/// seconds, whatever the header states.
fn column_head(header: &str, unit: Option<&String>, is_time: bool) -> ImportedColumn {
    let (name, unit_in_header) = name_and_unit(header);
    let stated = unit.filter(|unit| !unit.is_empty()).cloned();
    let unit = if is_time {
        Some("s".to_owned())
    } else {
        stated.or(unit_in_header)
    };
    ImportedColumn { name, unit }
}

/// Lines of the beginning of a text, without one that may be cut off.
pub fn whole_lines(head: &str) -> Vec<&str> {
    let mut lines: Vec<&str> = head.lines().collect();
    if head.len() as u64 >= HEAD_BYTES {
        lines.pop();
    }
    lines
}

/// Message for dates that may be others, in a text without another clock.
fn ambiguous_dates(lines: &[&str], layout: Option<&Layout>) -> Option<String> {
    let has_clock = |layout: &Layout| layout.columns.iter().any(|c| Role::Time.has(&c.head.name));
    if layout.is_some_and(has_clock) {
        return None;
    }
    let separators = ['\t', ';', ',', '|', '"'];
    let ambiguous = |line: &&str| {
        let mut fields = line.split(separators);
        fields.find(|field| is_ambiguous(field)).map(str::to_owned)
    };
    let head = lines.iter().take(HEAD_ROWS);
    let found: Vec<String> = head.clone().filter_map(ambiguous).collect();
    let first = found.first().filter(|_| 2 * found.len() > head.len())?;
    Some(format!(
        "`{}` may have the day or the month first: write 2026-02-01, or 01.02.2026 with the day first and four digits of \
         the year",
        first.trim()
    ))
}

/// Gives columns without a name, or with the name of another, a number.
fn make_unique(columns: &mut [NumberColumn]) {
    let mut taken = BTreeSet::new();
    for NumberColumn {
        at, head: column, ..
    } in columns
    {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(text: &str) -> Layout {
        Layout::of(text).unwrap()
    }

    fn names(layout: &Layout) -> Vec<(&str, &str)> {
        let columns = layout.columns.iter().map(|c| &c.head);
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
            (german.dialect.delimiter, german.dialect.decimal_comma),
            (Delimiter::Character(';'), true)
        );
        assert_eq!(names(&german), [("Zeit", "s"), ("Alpha", "deg")]);
        let tabs = layout("# recorded by nobody\ntime\tV\n[s]\t[m/s]\n0\t50\n1\t51\n");
        assert_eq!(names(&tabs), [("time", "s"), ("V", "m/s")]);
        let spaces = layout("  t     q\n 0.0   1.0e-3\n 0.1  -2.0D+1\n");
        assert_eq!(
            (spaces.dialect.delimiter, names(&spaces).len()),
            (Delimiter::Space, 2)
        );
        let bare = layout("0 1 2\n1 2 3\n");
        assert_eq!(names(&bare)[2].0, "column_3");
    }

    #[test]
    fn times_of_day_are_in_seconds_whatever_the_header_states() {
        let text = "IRIG,q\nd:h:m:s,deg/s\n214:23:59:59.9,1\n215:00:00:00.0,2\n";
        assert_eq!(names(&layout(text)), [("IRIG", "s"), ("q", "deg/s")]);
    }

    #[test]
    fn a_row_of_words_below_the_header_is_one_of_units_known_or_not() {
        let german = layout("Zeit;q;alpha\ns;Grad/s;Grad\n0,1;1,5;2\n0,2;1,6;2\n");
        assert_eq!(
            names(&german),
            [("Zeit", "s"), ("q", "Grad/s"), ("alpha", "Grad")]
        );
        let unknown = layout("t\tp\tq\nsek.\tGrd/s\tGrd/s\n0\t1\t2\n1\t2\t3\n");
        assert_eq!(
            names(&unknown),
            [("t", "sek."), ("p", "Grd/s"), ("q", "Grd/s")]
        );
        // A title names no column, and prose between spaces or behind a comment sign is no header.
        for text in [
            "Flight 12;;\ntime;p;q\n0;1;2\n1;2;3\n",
            "Rates;Rates;Rates\ntime;p;q\n0;1;2\n1;2;3\n",
            "# left;right;both\ntime;p;q\n0;1;2\n1;2;3\n",
            "recorded by nobody\ntime p q\n0 1 2\n1 2 3\n",
        ] {
            let layout = layout(text);
            let found = names(&layout).into_iter().map(|(name, _)| name);
            assert_eq!(found.collect::<Vec<_>>(), ["time", "p", "q"], "{text}");
        }
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
    fn rows_with_text_or_another_number_of_fields_are_no_header() {
        let text = layout("time,q,mode\n0.0,ERR,AUTO\n0.1,1,AUTO\n0.2,2,AUTO\n");
        assert_eq!(names(&text), [("time", ""), ("q", "")]);
        assert_eq!(
            (text.skipped, &text.dropped[..]),
            (1, &["mode".to_owned()][..])
        );
        let short = layout("time,q,p\n0,1\n1,2,3\n2,3,4\n3,4,5,6\n");
        assert_eq!((short.skipped, names(&short).len()), (1, 3));
        let (mut batch, mut failures) = (vec![Vec::new(); 3], Failures::default());
        short.append("0,1", 2, &mut batch, &mut failures);
        short.append("3,4,5,6", 5, &mut batch, &mut failures);
        assert!(
            batch[2][0].is_nan() && failures.notes().len() == 2,
            "{failures:?}"
        );
    }

    #[test]
    fn rare_delimiters_are_found() {
        for delimiter in ['~', '^', '\u{1f}'] {
            let text = "time,q,p\n0.0,1,2\n0.1,2,3\n".replace(',', &delimiter.to_string());
            assert_eq!(names(&layout(&text)).len(), 3, "{delimiter:?}");
        }
    }

    #[test]
    fn decimal_commas_between_commas_are_read_in_quotes_and_else_named() {
        let quoted = layout("time,q\n\"0,0\",\"1,5\"\n\"0,1\",\"2,5\"\n");
        assert_eq!(
            (
                quoted.dialect.delimiter,
                quoted.dialect.decimal_comma,
                names(&quoted).len()
            ),
            (Delimiter::Character(','), true, 2)
        );
        let bare = Layout::of("time,q\n0,0,1,5\n0,1,2,5\n").unwrap_err();
        assert!(bare.contains("decimal commas between commas"), "{bare}");
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
    fn calendar_times_are_seconds_from_the_first() {
        let text = "time [UTC];q\n2024-05-01T12:30:05.25Z;1,5\n2024-05-01T12:30:05.27Z;1,6\n";
        let layout = layout(text);
        assert_eq!(names(&layout), [("time", "s"), ("q", "")]);
        let (mut batch, mut failures) = (vec![Vec::new(), Vec::new()], Failures::default());
        layout.append("2024-05-02T00:00:05.25Z;1,5", 2, &mut batch, &mut failures);
        layout.append("05.25;1,5", 3, &mut batch, &mut failures);
        assert_eq!(batch[0][0].to_bits(), 41_400.0_f64.to_bits());
        assert!(batch[0][1].is_nan());
        assert!(failures.notes()[0].contains("line 3: `05.25`"));
    }

    /// First column of some lines in a layout.
    fn first_column(layout: &Layout, lines: &[&str]) -> Vec<f64> {
        let mut batch = vec![Vec::new(); layout.columns.len()];
        let mut failures = Failures::default();
        for line in lines {
            layout.append(line, 2, &mut batch, &mut failures);
        }
        batch.swap_remove(0)
    }

    #[test]
    fn dates_with_points_are_calendar_times() {
        let rows = ["25.11.2026 13:45:12,5;1,5", "25.11.2026 13:45:12,6;1,6"];
        let layout = layout(&format!("Zeit;q\n{}\n", rows.join("\n")));
        assert_eq!(names(&layout), [("Zeit", "s"), ("q", "")]);
        let times = first_column(&layout, &rows);
        assert!(
            times[0].abs() < 1e-9 && (times[1] - 0.1).abs() < 1e-9,
            "{times:?}"
        );
    }

    #[test]
    fn a_date_beside_its_time_counts_days_from_the_first_midnight() {
        for (first, second) in [("25.11.2026", "26.11.2026"), ("2026-11-25", "2026-11-26")] {
            let rows = [
                format!("{first};23:59:59,5;1,5"),
                format!("{second};00:00:00,5;1,6"),
            ];
            let layout = layout(&format!("Datum;Uhrzeit;q\n{}\n", rows.join("\n")));
            assert_eq!(names(&layout), [("Uhrzeit", "s"), ("q", "")]);
            assert!(layout.dropped.is_empty());
            assert!(layout.notes_on_times()[0].contains("midnight: Uhrzeit"));
            let rows = rows.each_ref().map(String::as_str);
            let times = first_column(&layout, &rows);
            assert!((times[0] - 86_399.5).abs() < 1e-9, "{times:?}");
            assert!((times[1] - 86_400.5).abs() < 1e-9, "{times:?}");
        }
        // Without a date the times of day are as they were.
        let plain = layout("Uhrzeit;q\n13:45:12,5;1\n13:45:12,6;2\n");
        let times = first_column(&plain, &["13:45:12,5;1"]);
        assert!((times[0] - 49_512.5).abs() < 1e-9);
    }

    #[test]
    fn a_date_that_may_be_another_is_refused_where_it_is_the_clock() {
        let stamped = "stamp;q\n01/02/2026 13:45:12;1,5\n01/02/2026 13:45:13;1,6\n";
        let refused = Layout::of(stamped).unwrap_err();
        assert!(
            refused.contains("`01/02/2026 13:45:12` may have the day or the month first"),
            "{refused}"
        );
        let with_clock = "time;stamp;q\n0;01/02/2026 13:45:12;1,5\n1;01/02/2026 13:45:13;1,6\n";
        assert_eq!(layout(with_clock).dropped, ["stamp"]);
    }

    #[test]
    fn a_text_without_numbers_is_refused() {
        assert!(Layout::of("Dear reader,\nthis is prose\n").is_err());
        assert!(Layout::of("\n").unwrap_err().contains("empty"));
    }
}
