//! Stream of a flight: the files that hold the same channels, with their merged rows.

use std::cmp::Ordering;
use std::collections::BTreeSet;

use super::merge::MergedPieces;
use super::pieces::{ScannedFile, UnusableRows};

/// Files that hold the same channels.
pub struct Stream {
    pub columns: BTreeSet<String>,
    pub files: Vec<ScannedFile>,
    pub merged: MergedPieces,
}

impl Stream {
    /// `true` if a file holds at least half of the stream's columns, or the stream at least half of
    /// the file's.
    pub fn shares_half(&self, columns: &BTreeSet<String>) -> bool {
        let common = self.columns.intersection(columns).count();
        2 * common >= self.columns.len().min(columns.len())
    }

    /// Step between the rows, of the first file.
    pub fn step_s(&self) -> f64 {
        self.files.first().map_or(f64::INFINITY, |f| f.step_s)
    }

    /// Order of streams: the most values per second first, then the most channels. The clock of a
    /// few fast rates thus precedes that of many slow engine channels.
    pub fn by_size(a: &Stream, b: &Stream) -> Ordering {
        let values_per_s = b.values_per_s().total_cmp(&a.values_per_s());
        values_per_s.then(b.columns.len().cmp(&a.columns.len()))
    }

    fn values_per_s(&self) -> f64 {
        let per_s = self.columns.len() as f64 / self.step_s();
        if per_s.is_finite() { per_s } else { 0.0 }
    }

    /// Number of rows of all files.
    pub fn rows(&self) -> usize {
        self.files.iter().map(|f| f.rows).sum()
    }

    /// Rows whose time is no number or fits nowhere.
    pub fn unreadable(&self) -> UnusableRows {
        let mut unreadable = UnusableRows::default();
        for file in &self.files {
            unreadable.merge(&file.unreadable);
        }
        for piece in &self.merged.strays {
            for row in piece.row..piece.row + piece.rows {
                unreadable.add(piece.file, row);
            }
        }
        unreadable
    }

    /// Rows whose time is that of the row before.
    pub fn repeated(&self) -> UnusableRows {
        let mut repeated = UnusableRows::default();
        for file in &self.files {
            repeated.merge(&file.repeated);
        }
        repeated
    }
}
