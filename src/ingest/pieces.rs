//! The times of a file cut into pieces: rows whose clock runs forward. A first pass over the time
//! channel alone makes them.
//!
//! Single rows with a time that cannot be (no number, an outlier, one that stands still) are left
//! out where they stand. Where time jumps, back or far ahead, a new piece begins; what the jump
//! means is decided when all pieces are known.

/// Rows of one file, one after the other, from the first time to the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    pub file: usize,
    pub row: usize,
    pub rows: usize,
    pub start_s: f64,
    pub end_s: f64,
}

/// Rows without a usable time: how many of them, and the first one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unusable {
    pub rows: usize,
    /// Counted from 1 with its file, as a reader counts them.
    pub first: Option<(usize, usize)>,
}

impl Unusable {
    pub(super) fn add(&mut self, file: usize, row: usize) {
        self.rows += 1;
        self.first.get_or_insert((file, row + 1));
    }
}

/// What the first pass knows of one file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scanned {
    pub pieces: Vec<Piece>,
    /// The recorder's step: the mean of those without lost frames, s.
    pub step_s: f64,
    /// Times that are no number, and outliers.
    pub unreadable: Unusable,
    /// Times that stand still.
    pub still: Unusable,
    pub rows: usize,
}

/// The rows from which the recorder's step is first taken.
const HEAD_ROWS: usize = 1 << 16;

/// A jump ahead by more than this begins a new piece, s: so an outlier among the times is a piece
/// of its own.
const JUMP_S: f64 = 1.0;

/// A piece is cut after this many rows, so that a stretch can end there.
const LONGEST_PIECE: usize = 1 << 20;

/// Rows whose times lie back by less than this share of a step are the clock's jitter.
const JITTER: f64 = 0.5;

/// The first pass over the times of one file.
#[derive(Clone, Debug, Default)]
pub struct Scan {
    file: usize,
    head: Vec<f64>,
    median_s: Option<f64>,
    /// The last two rows' times of the open piece.
    last: Option<f64>,
    before_last: Option<f64>,
    /// Whether a row was left out after them.
    closed: bool,
    whole: (f64, f64),
    found: Scanned,
}

impl Scan {
    #[must_use]
    pub fn of_file(file: usize) -> Scan {
        Scan {
            file,
            ..Scan::default()
        }
    }

    /// The next times, s.
    pub fn push(&mut self, times: &[f64]) {
        if self.median_s.is_some() {
            self.rows(times);
            return;
        }
        self.head.extend_from_slice(times);
        if self.head.len() >= HEAD_ROWS {
            self.begin();
        }
    }

    fn begin(&mut self) {
        let head = std::mem::take(&mut self.head);
        // Of a fixed number of rows, whatever the pieces in which they come.
        self.median_s = Some(median_step(head.get(..HEAD_ROWS).unwrap_or(&head)));
        self.rows(&head);
    }

    fn rows(&mut self, times: &[f64]) {
        for time in times {
            self.row(*time);
        }
    }

    /// What was found; the scan is over.
    #[must_use]
    pub fn finish(mut self) -> Scanned {
        if self.median_s.is_none() {
            self.begin();
        }
        let (sum, count) = self.whole;
        self.found.step_s = if count > 0.0 {
            sum / count
        } else {
            self.median_s.unwrap_or_default()
        };
        self.found
    }

    fn row(&mut self, t: f64) {
        let row = self.found.rows;
        self.found.rows += 1;
        if !t.is_finite() {
            self.found.unreadable.add(self.file, row);
            self.closed = true;
            return;
        }
        let median = self.median_s.unwrap_or_default();
        let Some(last) = self.last else {
            return self.open(row, t);
        };
        let step = t - last;
        if step == 0.0 {
            // Left out; the next row begins a piece that goes on.
            self.found.still.add(self.file, row);
            self.closed = true;
            return;
        }
        if step <= -JITTER * median {
            let near = |before: &f64| !self.closed && t > *before && t - before < 3.0 * median;
            let goes_on = self.before_last.filter(near);
            if let Some(before) = goes_on {
                self.take_back(row, before);
            }
            return self.open(row, t);
        }
        let full = self
            .found
            .pieces
            .last()
            .is_some_and(|p| p.rows >= LONGEST_PIECE);
        if step > JUMP_S.max(4.0 * median) || full || self.closed {
            return self.open(row, t);
        }
        if (0.5..1.5).contains(&(step / median)) {
            self.whole = (self.whole.0 + step, self.whole.1 + 1.0);
        }
        self.before_last = self.last;
        self.last = Some(t);
        if let Some(piece) = self.found.pieces.last_mut() {
            piece.rows += 1;
            piece.end_s = piece.end_s.max(t);
        }
    }

    fn open(&mut self, row: usize, t: f64) {
        self.found.pieces.push(Piece {
            file: self.file,
            row,
            rows: 1,
            start_s: t,
            end_s: t,
        });
        (self.before_last, self.last, self.closed) = (None, Some(t), false);
    }

    /// The row before `row` had a time too far ahead: it leaves the open piece.
    fn take_back(&mut self, row: usize, before: f64) {
        self.found.unreadable.add(self.file, row - 1);
        if let Some(piece) = self.found.pieces.last_mut() {
            piece.rows -= 1;
            piece.end_s = before;
        }
    }
}

/// The median step of times, s; zero where there are too few.
pub fn median_step(times: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times
        .windows(2)
        .map(|p| p[1] - p[0])
        .filter(|s| s.is_finite() && *s > 0.0)
        .collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        0.0
    } else {
        *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(times: &[f64]) -> Scanned {
        let mut scan = Scan::of_file(0);
        for part in times.chunks(3) {
            scan.push(part);
        }
        scan.finish()
    }

    fn clock(rows: usize) -> Vec<f64> {
        (0..rows).map(|k| k as f64 * 0.025).collect()
    }

    fn rows(pieces: &Scanned) -> Vec<(usize, usize)> {
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
            Unusable {
                rows: 2,
                first: Some((0, 21))
            }
        );
        assert_eq!(
            found.still,
            Unusable {
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
