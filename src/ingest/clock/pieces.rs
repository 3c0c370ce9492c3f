//! The times of a file cut into pieces: rows whose clock runs forward. A first pass over the time
//! channel alone makes them.
//!
//! Single rows with an impossible time (no number, an outlier, the time of the row before) are left
//! out. A jump of the time, back or far ahead, begins a new piece. [`super::merge`] decides about
//! the jump when all pieces are scanned.

use crate::numerics::statistics::order_statistics::upper_median;

/// Consecutive rows of one file, from the first time to the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    pub file: usize,
    pub row: usize,
    pub rows: usize,
    pub start_s: f64,
    pub end_s: f64,
}

impl Piece {
    pub(super) fn overlaps(&self, other: &Piece) -> bool {
        self.start_s <= other.end_s && other.start_s <= self.end_s
    }

    /// Row after its last one.
    pub(super) fn end_row(&self) -> usize {
        self.row + self.rows
    }
}

/// Count of rows without a usable time, and the first of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnusableRows {
    pub rows: usize,
    /// File, and row counted from 1 as a reader counts them.
    pub first: Option<(usize, usize)>,
}

impl UnusableRows {
    pub(super) fn add(&mut self, file: usize, row: usize) {
        self.rows += 1;
        self.first.get_or_insert((file, row + 1));
    }

    /// Adds the rows of a later file.
    pub(super) fn merge(&mut self, later: &UnusableRows) {
        self.rows += later.rows;
        self.first = self.first.or(later.first);
    }
}

/// Result of the first pass over one file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScannedFile {
    pub pieces: Vec<Piece>,
    /// The recorder's step: the mean of the steps without lost frames, s.
    pub step_s: f64,
    /// Rows whose time is no number or an outlier.
    pub unreadable: UnusableRows,
    /// Rows whose time is that of the row before.
    pub repeated: UnusableRows,
    pub rows: usize,
}

/// Rows from which the median step is taken: enough for a median, and half a megabyte.
const HEAD_ROWS: usize = 1 << 16;

/// Jump ahead that begins a new piece, s. An outlier among the times then is a piece of its own;
/// frames lost for less than a second stay inside a piece.
const JUMP_S: f64 = 1.0;

/// Jump ahead that begins a new piece, in median steps, for recorders slower than 4 Hz.
const JUMP_STEPS: f64 = 4.0;

/// Largest number of rows of a piece: a stretch can end only between pieces.
const LONGEST_PIECE: usize = 1 << 20;

/// Largest step backwards that counts as jitter, in median steps: a row further back cannot be the
/// next sample.
const JITTER: f64 = 0.5;

/// Largest step, in median steps, across a single row whose time was an outlier: two steps and the
/// jitter of both ends.
const ACROSS_OUTLIER: f64 = 3.0;

/// Steps within this range, in median steps, lost no frame; their mean is the recorder's step.
const WHOLE_STEP: std::ops::Range<f64> = 0.5..1.5;

/// First pass over the times of one file.
#[derive(Clone, Debug, Default)]
pub struct PieceScanner {
    file: usize,
    /// Times that are kept until the median step is found.
    head: Vec<f64>,
    median_s: Option<f64>,
    /// Times of the last two rows of the open piece.
    last: Option<f64>,
    before_last: Option<f64>,
    /// `true` if a row was left out after them; the next row then begins a piece.
    is_closed: bool,
    whole_steps: MeanStep,
    found: ScannedFile,
}

/// Sum and count of steps without lost frames.
#[derive(Clone, Copy, Debug, Default)]
struct MeanStep {
    sum_s: f64,
    count: f64,
}

impl PieceScanner {
    #[must_use]
    pub fn of_file(file: usize) -> PieceScanner {
        PieceScanner {
            file,
            ..PieceScanner::default()
        }
    }

    /// Takes the next times, s.
    pub fn push(&mut self, times: &[f64]) {
        if self.median_s.is_some() {
            self.scan_rows(times);
            return;
        }
        self.head.extend_from_slice(times);
        if self.head.len() >= HEAD_ROWS {
            self.begin();
        }
    }

    /// Takes the median step from a fixed number of rows, for any parts in which they come, and
    /// scans the rows kept so far.
    fn begin(&mut self) {
        let head = std::mem::take(&mut self.head);
        self.median_s = Some(median_step(head.get(..HEAD_ROWS).unwrap_or(&head)));
        self.scan_rows(&head);
    }

    fn scan_rows(&mut self, times: &[f64]) {
        for time in times {
            self.scan_row(*time);
        }
    }

    /// Ends the scan.
    #[must_use]
    pub fn finish(mut self) -> ScannedFile {
        if self.median_s.is_none() {
            self.begin();
        }
        let MeanStep { sum_s, count } = self.whole_steps;
        self.found.step_s = if count > 0.0 {
            sum_s / count
        } else {
            self.median_s.unwrap_or_default()
        };
        self.found
    }

    fn scan_row(&mut self, time: f64) {
        let row = self.found.rows;
        self.found.rows += 1;
        if !time.is_finite() {
            self.found.unreadable.add(self.file, row);
            self.is_closed = true;
            return;
        }
        let median = self.median_s.unwrap_or_default();
        let Some(last) = self.last else {
            return self.open_piece(row, time);
        };
        let step = time - last;
        if step == 0.0 {
            self.found.repeated.add(self.file, row);
            self.is_closed = true;
        } else if step <= -JITTER * median {
            self.remove_outlier(row, time);
            self.open_piece(row, time);
        } else if step > JUMP_S.max(JUMP_STEPS * median) || self.is_full() || self.is_closed {
            self.open_piece(row, time);
        } else {
            self.continue_piece(time, step / median);
        }
    }

    fn is_full(&self) -> bool {
        let open = self.found.pieces.last();
        open.is_some_and(|piece| piece.rows >= LONGEST_PIECE)
    }

    fn open_piece(&mut self, row: usize, time: f64) {
        self.found.pieces.push(Piece {
            file: self.file,
            row,
            rows: 1,
            start_s: time,
            end_s: time,
        });
        self.before_last = None;
        self.last = Some(time);
        self.is_closed = false;
    }

    /// Adds a row to the open piece; `steps` is its distance from the row before in median steps.
    fn continue_piece(&mut self, time: f64, steps: f64) {
        if let (true, Some(last)) = (WHOLE_STEP.contains(&steps), self.last) {
            self.whole_steps.sum_s += time - last;
            self.whole_steps.count += 1.0;
        }
        self.before_last = self.last;
        self.last = Some(time);
        if let Some(piece) = self.found.pieces.last_mut() {
            piece.rows += 1;
            piece.end_s = piece.end_s.max(time);
        }
    }

    /// Removes the last row of the open piece if only that row's time was too far ahead. The time
    /// of `row` then continues the row before it.
    fn remove_outlier(&mut self, row: usize, time: f64) {
        let median = self.median_s.unwrap_or_default();
        let Some(before) = self.before_last else {
            return;
        };
        let continues = time > before && time - before < ACROSS_OUTLIER * median;
        if self.is_closed || !continues {
            return;
        }
        self.found.unreadable.add(self.file, row - 1);
        if let Some(piece) = self.found.pieces.last_mut() {
            piece.rows -= 1;
            piece.end_s = before;
        }
    }
}

/// Median step of times, s; zero where there are too few.
fn median_step(times: &[f64]) -> f64 {
    let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
    upper_median(steps.filter(|step| *step > 0.0)).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(times: &[f64]) -> ScannedFile {
        let mut scanner = PieceScanner::of_file(0);
        for part in times.chunks(3) {
            scanner.push(part);
        }
        scanner.finish()
    }

    fn clock(rows: usize) -> Vec<f64> {
        (0..rows).map(|k| k as f64 * 0.025).collect()
    }

    fn rows(pieces: &ScannedFile) -> Vec<(usize, usize)> {
        pieces.pieces.iter().map(|p| (p.row, p.rows)).collect()
    }

    #[test]
    fn lost_frames_and_jitter_are_one_piece() {
        let mut times = clock(200);
        times.drain(50..55);
        times[100] -= 0.004;
        let found = scan(&times);
        assert_eq!(rows(&found), [(0, 195)]);
        assert!((found.step_s - 0.025).abs() < 1e-5);
    }

    #[test]
    fn rows_without_a_usable_time_are_left_out_and_counted() {
        let mut times = clock(200);
        (times[20], times[60], times[90], times[150]) =
            (f64::NAN, 900.0, times[89], times[150] + 0.6);
        let found = scan(&times);
        assert_eq!(
            rows(&found),
            [(0, 20), (21, 39), (60, 1), (61, 29), (91, 59), (151, 49)]
        );
        assert_eq!(
            found.unreadable,
            UnusableRows {
                rows: 2,
                first: Some((0, 21))
            }
        );
        assert_eq!(
            found.repeated,
            UnusableRows {
                rows: 1,
                first: Some((0, 91))
            }
        );
    }

    #[test]
    fn a_jump_back_or_far_ahead_begins_a_piece() {
        let mut times = clock(200);
        times[100..].iter_mut().for_each(|t| *t -= 2.5);
        times[150..].iter_mut().for_each(|t| *t += 70.0);
        assert_eq!(rows(&scan(&times)), [(0, 100), (100, 50), (150, 50)]);
    }
}
