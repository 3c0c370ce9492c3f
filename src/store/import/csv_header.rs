//! Header of a delimited text: names of the columns, and their units in a row below.

use std::collections::BTreeSet;

use super::delimited::{Delimiter, fields, is_number, plain_unit};
use crate::units::Unit;

/// A line above the numbers.
#[derive(Clone, Debug)]
pub struct HeadLine {
    /// Its place in the text.
    pub at: usize,
    is_comment: bool,
    pub fields: Vec<String>,
}

impl HeadLine {
    pub fn of(at: usize, line: &str, delimiter: Delimiter) -> HeadLine {
        let signs = ['#', '%', '!'];
        let text = line.trim_start_matches(signs).trim_start();
        HeadLine {
            at,
            is_comment: line.starts_with(signs),
            fields: fields(text, delimiter),
        }
    }

    /// `true` if each field is a word, as in a line of names. Comments are above tables.
    pub fn is_all_names(&self) -> bool {
        let is_word = |field: &String| !field.is_empty() && !is_number(field);
        !self.is_comment && self.fields.iter().all(is_word)
    }

    pub fn has_number(&self) -> bool {
        self.fields.iter().any(|field| is_number(field))
    }

    /// `true` if the line names every column that the line below has a field for, each by another
    /// word.
    fn names_columns_of(&self, below: &HeadLine) -> bool {
        let is_word = |name: &&String| !is_number(name);
        let names = || self.fields.iter().filter(|name| !name.is_empty());
        let distinct: BTreeSet<&String> = names().filter(is_word).collect();
        let mut pairs = self.fields.iter().zip(&below.fields);
        distinct.len() >= 2
            && distinct.len() == names().count()
            && !below.fields.iter().any(|field| is_number(field))
            && pairs.all(|(name, below)| !name.is_empty() || below.is_empty())
    }
}

/// Names and units from the lines above the numbers. The upper of two lines is the header in two
/// cases: the lower one holds units known to harvest, or the upper one names every column by
/// another word. A line alone is the header.
pub fn names_and_units(
    headers: &[HeadLine],
    width: usize,
    delimiter: Delimiter,
) -> (Vec<String>, Vec<String>) {
    let numbered = || (1..=width).map(|n| format!("column_{n}")).collect();
    match headers {
        [] => (numbered(), Vec::new()),
        [.., names, units] if is_above_units(names, units, delimiter) => {
            let units = units.fields.iter().map(|unit| plain_unit(unit));
            (names.fields.clone(), units.collect())
        }
        [.., names] => (names.fields.clone(), Vec::new()),
    }
}

/// `true` if a line is the header above a line of units.
fn is_above_units(names: &HeadLine, units: &HeadLine, delimiter: Delimiter) -> bool {
    if units.at - names.at != 1 {
        return false;
    }
    // Between spaces, prose has fields as well, and a comment may be above the header.
    let is_prose = delimiter == Delimiter::Space || names.is_comment && !units.is_comment;
    are_units(&units.fields) || !is_prose && names.names_columns_of(units)
}

/// `true` for a row of units: most fields are units that harvest has, or in brackets, or empty.
fn are_units(fields: &[String]) -> bool {
    let is_unit = |field: &&String| {
        let field = field.trim();
        field.is_empty() || field.starts_with(['[', '(']) || Unit::parse(field).is_ok()
    };
    2 * fields.iter().filter(is_unit).count() > fields.len()
}
