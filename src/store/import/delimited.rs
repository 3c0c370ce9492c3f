//! Lines of delimited text: their fields, the numbers in them, and the names and units of headers.

use std::io::{BufRead, Read, Result};

/// Rows at the beginning that must hold a number for a column to be one of numbers.
pub const HEAD_ROWS: usize = 500;
/// Longest line: far more than any recorder's.
const LONGEST_LINE: u64 = 1 << 20;

/// Separator of fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delimiter {
    Character(char),
    /// One or more spaces or tabs.
    Space,
}

/// Delimiter and decimal sign of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dialect {
    pub delimiter: Delimiter,
    pub decimal_comma: bool,
}

impl Dialect {
    /// Fields of a line, as [`fields`].
    pub fn fields(self, line: &str) -> Vec<String> {
        fields(line, self.delimiter)
    }

    /// Number in a field, as [`number`].
    pub fn number(self, field: &str) -> Option<f64> {
        number(field, self.decimal_comma)
    }
}

/// Reads the next line, with its end; `false` at the end of the text.
///
/// # Errors
/// The disk fails.
pub fn next_line(reader: &mut impl BufRead, line: &mut Vec<u8>) -> Result<bool> {
    line.clear();
    let mut limited = reader.take(LONGEST_LINE);
    Ok(limited.read_until(b'\n', line)? > 0)
}

/// Fields in rows of numbers that are no numbers.
#[derive(Debug, Default)]
pub struct Failures {
    fields: usize,
    first: Option<(usize, String)>,
    pub short_rows: usize,
    pub long_rows: usize,
}

impl Failures {
    /// Counts a field that is no number.
    pub fn add(&mut self, line: usize, field: &str) {
        self.fields += 1;
        self.first.get_or_insert_with(|| (line, field.to_owned()));
    }

    pub fn notes(&self) -> Vec<String> {
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
        if self.long_rows > 0 {
            notes.push(format!(
                "{} rows have more fields than the others, which are left out",
                self.long_rows
            ));
        }
        notes
    }
}

/// Words that recorders write for a missing value.
const MISSING: [&str; 8] = ["", "nan", "na", "n/a", "null", "none", "-", "inf"];

/// `true` for a number with a decimal point or comma.
pub fn is_number(field: &str) -> bool {
    [false, true]
        .iter()
        .any(|comma| number(field, *comma).is_some())
}

/// A unit without brackets.
pub fn plain_unit(text: &str) -> String {
    text.trim()
        .trim_matches(['[', ']', '(', ')', '{', '}'])
        .trim()
        .to_owned()
}

/// Name of a column, and the unit in brackets after it.
pub fn name_and_unit(header: &str) -> (String, Option<String>) {
    let header = header.trim();
    let bracket = header.find(['[', '(', '{']).filter(|at| *at > 0);
    // A function of time is no mass in tonnes.
    let has_argument = header.ends_with("(t)") && !header.contains(" (");
    match bracket {
        Some(at) if has_argument => (header[..at].to_owned(), None),
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

/// Fields of a line without quotes and spaces around them.
pub fn fields(line: &str, delimiter: Delimiter) -> Vec<String> {
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

pub fn is_missing(field: &str) -> bool {
    MISSING.contains(&field.to_lowercase().as_str())
}

/// A number, or a time as seconds: `12:30:05.25`, `30:05.25` without the hour, or `214:12:30:05.25` with the day of the year.
pub fn number(field: &str, decimal_comma: bool) -> Option<f64> {
    if is_missing(field) {
        return None;
    }
    let parse = |text: &str| {
        let text = text.trim();
        let is_number = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        match text.split_once(',') {
            _ if !is_number => None,
            Some((whole, part)) if decimal_comma && !whole.contains('.') => {
                format!("{whole}.{part}").parse().ok()
            }
            Some(_) => without_thousands(text, decimal_comma)?.parse().ok(),
            None => text.replace(['D', 'd'], "e").parse().ok(),
        }
    };
    let parts: Vec<&str> = field.split(':').collect();
    match parts.as_slice() {
        [one] => parse(one),
        // Without a decimal sign they may be hours and minutes.
        [minutes, seconds] if seconds.contains(['.', ',']) => {
            Some(parse(minutes)? * 60.0 + parse(seconds)?)
        }
        [hours, minutes, seconds] => {
            Some(parse(hours)? * 3600.0 + parse(minutes)? * 60.0 + parse(seconds)?)
        }
        [days, hours, minutes, seconds] => {
            let hours = parse(days)? * 24.0 + parse(hours)?;
            Some(hours * 3600.0 + parse(minutes)? * 60.0 + parse(seconds)?)
        }
        _ => None,
    }
}

/// `true` for a number that is a time of day, perhaps with the day of the year.
pub fn is_clock_time(field: &str) -> bool {
    field.contains(':') && is_number(field)
}

/// A number without the separators of its thousands: 1234.5 of `1,234.5`, and of `1.234,5` with a decimal comma. A
/// number without a decimal sign is none, since its separator may be the decimal sign.
fn without_thousands(text: &str, decimal_comma: bool) -> Option<String> {
    let (separator, sign) = if decimal_comma {
        ('.', ',')
    } else {
        (',', '.')
    };
    let (whole, part) = text.split_once(sign)?;
    let mut groups = whole.trim_start_matches(['+', '-']).split(separator);
    let is_digits = |group: &str| !group.is_empty() && group.chars().all(|c| c.is_ascii_digit());
    let is_first = |group: &str| group.len() <= 3 && is_digits(group);
    let is_grouped = groups.next().is_some_and(is_first)
        && groups.all(|group| group.len() == 3 && is_digits(group));
    is_grouped.then(|| format!("{}.{part}", whole.replace(separator, "")))
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn separators_of_thousands_are_left_out_beside_a_decimal_sign() {
        assert_eq!(number("-25,300.5", false), Some(-25_300.5));
        assert_eq!(number("1.025.300,5", true), Some(1_025_300.5));
        for (text, decimal_comma) in [
            ("25,300", false),
            ("25,30.5", false),
            ("2530,300.5", false),
            ("1.5,2.5", true),
        ] {
            assert_eq!(number(text, decimal_comma), None, "{text}");
        }
    }

    #[test]
    fn a_time_may_have_the_day_of_the_year() {
        assert_eq!(number("12:30:05.25", false), Some(45_005.25));
        assert_eq!(number("214:12:30:05.25", false), Some(18_534_605.25));
        assert_eq!(number("30:05.25", false), Some(1_805.25));
        assert_eq!(number("12:30", false), None);
        assert!(is_clock_time("214:12:30:05.25") && !is_clock_time("12.5"));
    }
}
