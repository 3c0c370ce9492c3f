//! Comparison of pieces whose times overlap: the same rows recorded twice, or a clock that was
//! started anew.

use std::collections::BTreeSet;

use super::pieces::Piece;
use super::time_channels::TimeChannels;
use crate::ingest::column_source::ColumnSource;

/// Rows of each piece that are compared: some seconds of a usual recorder.
const COMPARED_ROWS: usize = 256;

/// Share of equal values above which two pieces hold the same rows. A file exported twice may round
/// or lose some values. Rows of different times agree only in constant channels.
const EQUAL_SHARE: f64 = 0.9;

/// Times that differ by less are equal, s: a microsecond, the finest resolution of usual recorders.
const SAME_TIME_S: f64 = 1e-6;

/// Relative difference below which two times are equal: the resolution of times since 1970 in
/// double precision.
const SAME_TIME: f64 = 1e-9;

/// `true` if the second piece repeats the values of the first piece at the same times. Only those
/// of the named channels count that change at all.
///
/// # Errors
/// The reason for which a file cannot be read.
pub fn are_same_rows<S: ColumnSource + ?Sized>(
    times: &TimeChannels<S>,
    columns: &BTreeSet<String>,
    first: &Piece,
    second: &Piece,
) -> Result<bool, String> {
    let from_s = first.start_s.max(second.start_s);
    let a = Rows::from_time(times, first, from_s)?;
    let b = Rows::from_time(times, second, from_s)?;
    let pairs = simultaneous(&a, &b);
    if pairs.is_empty() {
        return Ok(false);
    }
    let source = times.source;
    let in_both = |name: &&String| source.has(first.file, name) && source.has(second.file, name);
    let in_both: Vec<&String> = columns.iter().filter(in_both).collect();
    let (mut equal, mut all) = (0_usize, 0_usize);
    for (compared, name) in in_both.iter().enumerate() {
        // The values of the other columns may be too few, even if all are equal.
        let pending = pairs.len() * (in_both.len() - compared);
        if ((equal + pending) as f64) < EQUAL_SHARE * (all + pending) as f64 {
            return Ok(false);
        }
        let x = a.values(source, first.file, name)?;
        let y = b.values(source, second.file, name)?;
        let is_constant = x.windows(2).all(|p| p[0].to_bits() == p[1].to_bits());
        if is_constant {
            continue;
        }
        for (i, j) in &pairs {
            if let (Some(x), Some(y)) = (x.get(*i), y.get(*j)) {
                all += 1;
                equal += usize::from(x.to_bits() == y.to_bits() || (x.is_nan() && y.is_nan()));
            }
        }
    }
    Ok(all > 0 && equal as f64 >= EQUAL_SHARE * all as f64)
}

/// Consecutive rows with their times.
struct Rows {
    /// The first row.
    row: usize,
    times: Vec<f64>,
}

impl Rows {
    /// The first rows of a piece at or after a time.
    fn from_time<S: ColumnSource + ?Sized>(
        times: &TimeChannels<S>,
        piece: &Piece,
        from_s: f64,
    ) -> Result<Rows, String> {
        let mut found = Rows {
            row: piece.row,
            times: Vec::new(),
        };
        let mut row = piece.row;
        let mut collect = |times: &[f64]| {
            for time in times {
                if *time >= from_s && found.times.len() < COMPARED_ROWS {
                    if found.times.is_empty() {
                        found.row = row;
                    }
                    found.times.push(*time);
                }
                row += 1;
            }
        };
        let rows = piece.row..piece.row + piece.rows;
        times
            .read(piece.file, rows, &mut collect)
            .map_err(|refusal| refusal.reason)?;
        Ok(found)
    }

    /// Values of a column in these rows.
    fn values<S: ColumnSource + ?Sized>(
        &self,
        source: &S,
        file: usize,
        column: &str,
    ) -> Result<Vec<f64>, String> {
        let mut values = Vec::new();
        let range = self.row..self.row + self.times.len();
        let mut append = |part: &[f64]| values.extend_from_slice(part);
        source.read(file, column, range, &mut append)?;
        Ok(values)
    }
}

/// Pairs of rows that have the same time.
fn simultaneous(a: &Rows, b: &Rows) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    let mut j = 0;
    for (i, time) in a.times.iter().enumerate() {
        let tolerance = SAME_TIME_S.max(SAME_TIME * time.abs());
        while b.times.get(j).is_some_and(|t| *t < time - tolerance) {
            j += 1;
        }
        let other = b.times.get(j);
        if other.is_some_and(|t| (t - time).abs() <= tolerance) {
            pairs.push((i, j));
        }
    }
    pairs
}
