//! A table of the page, ready for the template.

use serde::Serialize;

use super::notation::DASH;

/// A table with its title, a note, column heads and cells of plain text.
#[derive(Clone, Debug, Serialize)]
pub struct TableView {
    /// Title with the number of rows.
    pub title: String,
    pub note: String,
    pub heads: Vec<String>,
    pub rows: Vec<Vec<String>>,
    /// Numeric columns, which are aligned right.
    pub numeric: Vec<bool>,
    /// Anchor that the first cell of each row links to; empty for a table without links.
    pub links: Vec<String>,
    /// Class token by which each row is hidden; empty for a table that is not filtered.
    pub classes: Vec<String>,
    /// Columns of each row that are marked as warnings; empty for a table without warnings.
    pub flagged: Vec<Vec<usize>>,
}

impl TableView {
    pub fn new(title: &str, note: &str, heads: &[&str], rows: Vec<Vec<String>>) -> TableView {
        let numeric = (0..heads.len())
            .map(|column| is_numeric(rows.iter().filter_map(|row| row.get(column))))
            .collect();
        TableView {
            title: format!("{title} ({})", rows.len()),
            note: note.to_owned(),
            heads: heads.iter().map(|head| (*head).to_owned()).collect(),
            rows,
            numeric,
            links: vec![],
            classes: vec![],
            flagged: vec![],
        }
    }
}

/// `true` if every cell that is not empty is a number, and at least one is.
fn is_numeric<'a>(cells: impl Iterator<Item = &'a String>) -> bool {
    let mut filled = cells
        .filter(|cell| !cell.is_empty() && *cell != DASH)
        .peekable();
    filled.peek().is_some() && filled.all(|cell| is_number(cell))
}

/// `true` for a number as the report writes it, with or without a trailing per cent or degree sign.
fn is_number(cell: &str) -> bool {
    cell.replace('\u{2212}', "-")
        .trim_end_matches(['%', '°', ' '])
        .parse::<f64>()
        .is_ok()
}
