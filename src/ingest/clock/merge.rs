//! The pieces of a flight's files merged into sequences: rows in the order of their clock, each
//! used once.
//!
//! A piece that continues after the end of another belongs to its sequence. A piece may have times
//! that are already in a sequence. Either it repeats rows of the sequence, and they are left out;
//! or the recorder's clock was restarted, and the piece begins a new sequence. The values of the
//! rows decide.

use super::pieces::{Piece, ScannedFile};
use crate::ingest::settings::Settings;

/// A piece in a sequence, which uses its rows later than `after_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PiecePart {
    pub piece: Piece,
    pub after_s: f64,
}

impl PiecePart {
    /// `true` if a part holds later rows of the same file.
    pub fn is_before(&self, later: &PiecePart) -> bool {
        self.piece.file == later.piece.file && self.piece.end_row() <= later.piece.row
    }
}

/// Rows of a flight on one clock that runs forward without a long gap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PieceSequence {
    pub parts: Vec<PiecePart>,
    pub step_s: f64,
    pub start_s: f64,
    pub end_s: f64,
    /// Reason for which it does not belong to the sequence before it, in words.
    pub cause: Option<String>,
}

/// The sequences that a flight's files make.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MergedPieces {
    pub sequences: Vec<PieceSequence>,
    /// Pieces of which some or all rows are already in a sequence.
    pub duplicates: Vec<Piece>,
    /// Single rows whose time fits nowhere.
    pub strays: Vec<Piece>,
}

/// Least rows of a piece between two jumps of the time. A shorter piece is a stray if it does not
/// fit at its place. Two rows have a single step, which an outlier can imitate.
const LEAST_ROWS: usize = 3;

/// Largest number of sequences of a flight: a recorder that starts for each maneuver makes some
/// hundreds in a day.
const MOST_SEQUENCES: usize = 1000;

/// Largest number of comparisons of rows in a flight; each reads the files again. Overlapping files
/// of five minutes make 288 in a day; a clock that starts anew 32 times makes 496.
const MOST_COMPARISONS: usize = 512;

/// Share of a step by which a row must be later than the end of a sequence to be a new row.
const LATER: f64 = 0.5;

/// Compares the rows of two pieces whose times overlap; `true` if they are the same rows.
type CompareRows<'a> = dyn FnMut(&Piece, &Piece) -> Result<bool, String> + 'a;

/// Puts the pieces of files that hold the same channels in order. `file_name` names a file.
///
/// # Errors
/// The reason for which `same_rows` cannot read; more sequences or overlaps than a recorder makes.
pub fn merge_pieces(
    files: &[ScannedFile],
    settings: &Settings,
    file_name: &dyn Fn(usize) -> String,
    same_rows: &mut CompareRows,
) -> Result<MergedPieces, String> {
    let mut files: Vec<&ScannedFile> = files.iter().filter(|f| !f.pieces.is_empty()).collect();
    let start = |f: &ScannedFile| f.pieces.first().map_or(0.0, |p| p.start_s);
    files.sort_by(|a, b| start(a).total_cmp(&start(b)));
    let pieces: Vec<(&Piece, f64)> = files
        .iter()
        .flat_map(|f| f.pieces.iter().map(|p| (p, f.step_s)))
        .collect();
    let mut merger = Merger {
        settings,
        file_name,
        same_rows,
        comparisons: 0,
        merged: MergedPieces::default(),
    };
    for (i, (piece, step_s)) in pieces.iter().enumerate() {
        let next = pieces.get(i + 1).map(|(p, _)| *p);
        merger.add(piece, *step_s, next)?;
    }
    Ok(merger.merged)
}

struct Merger<'a, 'b> {
    settings: &'a Settings,
    file_name: &'a dyn Fn(usize) -> String,
    same_rows: &'a mut CompareRows<'b>,
    comparisons: usize,
    merged: MergedPieces,
}

impl Merger<'_, '_> {
    fn add(&mut self, piece: &Piece, step_s: f64, next: Option<&Piece>) -> Result<(), String> {
        match self.merged.sequences.last() {
            None => self.begin_sequence(piece, step_s, None),
            Some(current) if piece.start_s > current.end_s => self.add_later(piece, step_s, next),
            Some(current) if piece.rows < LEAST_ROWS && current.ends_in(piece.file) => {
                self.merged.strays.push(*piece);
            }
            Some(_) => self.add_overlapping(piece, step_s)?,
        }
        if self.merged.sequences.len() > MOST_SEQUENCES {
            return Err(self.too_often("time jumps", MOST_SEQUENCES, piece));
        }
        Ok(())
    }

    /// Reason for which a clock with too many jumps is refused. `piece` is the piece after the last
    /// jump.
    fn too_often(&self, event: &str, most: usize, piece: &Piece) -> String {
        format!(
            "{event} more than {most} times, the last time in row {} of {}: its rows are out of \
             order, or its bytes are damaged, or it is not the recorder's time",
            piece.row + 1,
            (self.file_name)(piece.file)
        )
    }

    /// Adds a piece that begins after the end of the current sequence.
    fn add_later(&mut self, piece: &Piece, step_s: f64, next: Option<&Piece>) {
        let Some(current) = self.merged.sequences.last_mut() else {
            return;
        };
        let gap_s = piece.start_s - current.end_s;
        let length_h = (piece.end_s - current.start_s) / 3600.0;
        let next_fits = next.is_none_or(|n| n.file != piece.file || n.start_s > piece.end_s);
        if piece.rows < LEAST_ROWS && !next_fits {
            self.merged.strays.push(*piece);
        } else if gap_s > self.settings.longest_clock_gap_s {
            let cause = format!(
                "the clock lacks {gap_s:.1} s from {:.1} s to {:.1} s",
                current.end_s, piece.start_s
            );
            self.begin_sequence(piece, step_s, Some(cause));
        } else if length_h > self.settings.longest_stretch_h {
            let longest = self.settings.longest_stretch_h;
            let cause = format!("a stretch is at most {longest} h long");
            self.begin_sequence(piece, step_s, Some(cause));
        } else {
            current.append(piece, f64::NEG_INFINITY);
        }
    }

    /// Adds a piece that begins before the end of the current sequence.
    fn add_overlapping(&mut self, piece: &Piece, step_s: f64) -> Result<(), String> {
        if let Some(sequence) = self.sequence_with_rows_of(piece)? {
            let after_s = sequence.end_s + LATER * step_s;
            if piece.end_s > after_s {
                sequence.append(piece, after_s);
            }
            self.merged.duplicates.push(*piece);
        } else if piece.rows < LEAST_ROWS {
            self.merged.strays.push(*piece);
        } else {
            let end_s = self.merged.sequences.last().map_or(f64::NAN, |s| s.end_s);
            let cause = format!(
                "time jumps back from {end_s:.3} s to {:.3} s in row {} of {}",
                piece.start_s,
                piece.row + 1,
                (self.file_name)(piece.file)
            );
            self.begin_sequence(piece, step_s, Some(cause));
        }
        Ok(())
    }

    fn begin_sequence(&mut self, piece: &Piece, step_s: f64, cause: Option<String>) {
        let part = PiecePart {
            piece: *piece,
            after_s: f64::NEG_INFINITY,
        };
        self.merged.sequences.push(PieceSequence {
            parts: vec![part],
            step_s,
            start_s: piece.start_s,
            end_s: piece.end_s,
            cause,
        });
    }

    /// The latest sequence that holds rows of this piece already.
    fn sequence_with_rows_of(
        &mut self,
        piece: &Piece,
    ) -> Result<Option<&mut PieceSequence>, String> {
        for index in (0..self.merged.sequences.len()).rev() {
            if self.holds_rows_of(index, piece)? {
                return Ok(self.merged.sequences.get_mut(index));
            }
        }
        Ok(None)
    }

    /// `true` if a sequence holds rows of this piece.
    fn holds_rows_of(&mut self, index: usize, piece: &Piece) -> Result<bool, String> {
        let sequence = self.merged.sequences.get(index);
        let parts = sequence.iter().flat_map(|sequence| &sequence.parts);
        for part in parts.filter(|part| part.piece.overlaps(piece)) {
            if self.comparisons == MOST_COMPARISONS {
                return Err(self.too_often(
                    "time returns to times before it",
                    self.comparisons,
                    piece,
                ));
            }
            self.comparisons += 1;
            if (self.same_rows)(&part.piece, piece)? {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

impl PieceSequence {
    pub fn length_s(&self) -> f64 {
        self.end_s - self.start_s
    }

    /// `true` if its last rows are of this file.
    fn ends_in(&self, file: usize) -> bool {
        self.parts
            .last()
            .is_some_and(|part| part.piece.file == file)
    }

    fn append(&mut self, piece: &Piece, after_s: f64) {
        self.parts.push(PiecePart {
            piece: *piece,
            after_s,
        });
        self.end_s = self.end_s.max(piece.end_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(pieces: &[(usize, usize, f64)]) -> ScannedFile {
        let piece = |&(file, row, start_s): &(usize, usize, f64)| Piece {
            file,
            row,
            rows: 400,
            start_s,
            end_s: start_s + 9.975,
        };
        ScannedFile {
            pieces: pieces.iter().map(piece).collect(),
            step_s: 0.025,
            ..ScannedFile::default()
        }
    }

    fn merged(files: &[ScannedFile], same: bool) -> MergedPieces {
        let name = |file: usize| format!("part-{file}");
        merge_pieces(files, &Settings::default(), &name, &mut |_, _| Ok(same)).unwrap()
    }

    #[test]
    fn files_in_any_order_are_one_stretch() {
        let merged_pieces = merged(&[file(&[(0, 0, 10.0)]), file(&[(1, 0, 0.0)])], false);
        assert_eq!(merged_pieces.sequences.len(), 1);
        let order: Vec<usize> = merged_pieces.sequences[0]
            .parts
            .iter()
            .map(|u| u.piece.file)
            .collect();
        assert_eq!(order, [1, 0]);
    }

    #[test]
    fn overlapping_rows_are_used_once() {
        let merged_pieces = merged(&[file(&[(0, 0, 0.0)]), file(&[(1, 0, 5.0)])], true);
        assert_eq!(
            (
                merged_pieces.sequences.len(),
                merged_pieces.duplicates.len()
            ),
            (1, 1)
        );
        assert!((merged_pieces.sequences[0].parts[1].after_s - 9.9875).abs() < 1e-9);
        let copy = merged(&[file(&[(0, 0, 0.0)]), file(&[(1, 0, 0.0)])], true);
        assert_eq!(
            (copy.sequences[0].parts.len(), copy.duplicates.len()),
            (1, 1)
        );
    }

    #[test]
    fn a_clock_that_starts_anew_begins_a_stretch_and_says_where() {
        let merged_pieces = merged(&[file(&[(0, 0, 0.0), (0, 400, 0.0)])], false);
        assert_eq!(merged_pieces.sequences.len(), 2);
        let cause = merged_pieces.sequences[1].cause.clone().unwrap();
        assert_eq!(
            cause,
            "time jumps back from 9.975 s to 0.000 s in row 401 of part-0"
        );
    }

    #[test]
    fn a_long_gap_begins_a_stretch_and_a_short_one_does_not() {
        let merged_pieces = merged(
            &[file(&[(0, 0, 0.0), (0, 400, 30.0), (0, 800, 2000.0)])],
            false,
        );
        assert_eq!(merged_pieces.sequences.len(), 2);
        assert_eq!(
            merged_pieces.sequences[1].cause.as_deref(),
            Some("the clock lacks 1960.0 s from 40.0 s to 2000.0 s")
        );
    }

    #[test]
    fn a_row_with_a_time_of_its_own_is_a_stray() {
        let mut pieces = file(&[(0, 0, 0.0), (0, 400, 30.0), (0, 401, 10.0)]);
        (pieces.pieces[1].rows, pieces.pieces[1].end_s) = (1, 30.0);
        let merged_pieces = merged(&[pieces], false);
        assert_eq!(
            (merged_pieces.sequences.len(), merged_pieces.strays.len()),
            (1, 1)
        );
    }
}
