//! The stretches of a flight: pieces of its files put in the order of their clock, without what is
//! there twice.
//!
//! A piece that goes on where another ended belongs to its stretch. One whose times are there
//! already is either the same rows again, which are left out, or a clock that was started anew,
//! which begins a new stretch; the rows themselves tell.

use super::Settings;
use super::pieces::{Piece, Scanned};

/// A piece as a stretch uses it: its rows later than `after_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Used {
    pub piece: Piece,
    pub after_s: f64,
}

/// Rows of a flight on one clock that runs forward with no long gap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stretch {
    pub pieces: Vec<Used>,
    pub step_s: f64,
    pub start_s: f64,
    pub end_s: f64,
    /// Why it does not belong to the stretch before it, in words.
    pub because: Option<String>,
}

/// How the files of a flight make its stretches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    pub stretches: Vec<Stretch>,
    /// Scanned whose rows, or some of them, are there already.
    pub again: Vec<Piece>,
    /// Single rows whose time fits nowhere.
    pub stray: Vec<Piece>,
}

/// Fewer rows than this between two jumps of the time are strays if they do not fit where they
/// stand.
const STRAY_ROWS: usize = 3;

/// Puts the pieces of files that hold the same channels in order. `same` says whether rows of the
/// second piece that have times of the first one are the same rows; `name` names a file.
///
/// # Errors
/// What `same` cannot read.
pub fn plan(
    files: &[Scanned],
    settings: &Settings,
    name: &dyn Fn(usize) -> String,
    same: &mut dyn FnMut(&Piece, &Piece) -> Result<bool, String>,
) -> Result<Plan, String> {
    let mut files: Vec<&Scanned> = files.iter().filter(|f| !f.pieces.is_empty()).collect();
    let starts = |f: &&Scanned| f.pieces.first().map_or(0.0, |p| p.start_s);
    files.sort_by(|a, b| starts(a).total_cmp(&starts(b)));
    let all: Vec<(&Piece, f64)> = files
        .iter()
        .flat_map(|f| f.pieces.iter().map(|p| (p, f.step_s)))
        .collect();
    let mut plan = Plan::default();
    for (i, (piece, step_s)) in all.iter().enumerate() {
        let next = all.get(i + 1).map(|(p, _)| *p);
        plan.add(piece, *step_s, next, settings, name, same)?;
    }
    Ok(plan)
}

impl Plan {
    fn add(
        &mut self,
        piece: &Piece,
        step_s: f64,
        next: Option<&Piece>,
        settings: &Settings,
        name: &dyn Fn(usize) -> String,
        same: &mut dyn FnMut(&Piece, &Piece) -> Result<bool, String>,
    ) -> Result<(), String> {
        let Some((start_s, end_s)) = self.stretches.last().map(|s| (s.start_s, s.end_s)) else {
            self.begin(piece, step_s, None);
            return Ok(());
        };
        let gap_s = piece.start_s - end_s;
        let short = piece.rows < STRAY_ROWS;
        let next_fits = next.is_none_or(|n| n.file != piece.file || n.start_s > piece.end_s);
        if gap_s > 0.0 {
            let too_long = (piece.end_s - start_s) / 3600.0 > settings.longest_stretch_h;
            if short && !next_fits {
                self.stray.push(*piece);
            } else if gap_s > settings.longest_clock_gap_s {
                let because = format!(
                    "the clock lacks {gap_s:.1} s from {end_s:.1} s to {:.1} s",
                    piece.start_s
                );
                self.begin(piece, step_s, Some(because));
            } else if too_long {
                let because = format!("a stretch is at most {} h long", settings.longest_stretch_h);
                self.begin(piece, step_s, Some(because));
            } else if let Some(current) = self.stretches.last_mut() {
                current.go_on(piece, f64::NEG_INFINITY);
            }
            return Ok(());
        }
        let met = self.meeting(piece, same)?;
        if let Some(stretch) = met.and_then(|i| self.stretches.get_mut(i)) {
            self.again.push(*piece);
            let after_s = stretch.end_s + 0.5 * step_s;
            if piece.end_s > after_s {
                stretch.go_on(piece, after_s);
            }
        } else if short {
            self.stray.push(*piece);
        } else {
            let because = format!(
                "time jumps back from {end_s:.3} s to {:.3} s in row {} of {}",
                piece.start_s,
                piece.row + 1,
                name(piece.file)
            );
            self.begin(piece, step_s, Some(because));
        }
        Ok(())
    }

    fn begin(&mut self, piece: &Piece, step_s: f64, because: Option<String>) {
        let pieces = vec![Used {
            piece: *piece,
            after_s: f64::NEG_INFINITY,
        }];
        self.stretches.push(Stretch {
            pieces,
            step_s,
            start_s: piece.start_s,
            end_s: piece.end_s,
            because,
        });
    }

    /// The stretch that holds rows of this piece already.
    fn meeting(
        &self,
        piece: &Piece,
        same: &mut dyn FnMut(&Piece, &Piece) -> Result<bool, String>,
    ) -> Result<Option<usize>, String> {
        for (i, stretch) in self.stretches.iter().enumerate().rev() {
            for used in &stretch.pieces {
                let overlap =
                    used.piece.start_s <= piece.end_s && piece.start_s <= used.piece.end_s;
                if overlap && same(&used.piece, piece)? {
                    return Ok(Some(i));
                }
            }
        }
        Ok(None)
    }
}

impl Stretch {
    fn go_on(&mut self, piece: &Piece, after_s: f64) {
        self.pieces.push(Used {
            piece: *piece,
            after_s,
        });
        self.end_s = self.end_s.max(piece.end_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(pieces: &[(usize, usize, f64)]) -> Scanned {
        let piece = |&(file, row, start_s): &(usize, usize, f64)| Piece {
            file,
            row,
            rows: 400,
            start_s,
            end_s: start_s + 9.975,
        };
        Scanned {
            pieces: pieces.iter().map(piece).collect(),
            step_s: 0.025,
            ..Scanned::default()
        }
    }

    fn planned(files: &[Scanned], same: bool) -> Plan {
        let name = |file: usize| format!("part-{file}");
        plan(files, &Settings::default(), &name, &mut |_, _| Ok(same)).unwrap()
    }

    #[test]
    fn files_in_any_order_are_one_stretch() {
        let plan = planned(&[file(&[(0, 0, 10.0)]), file(&[(1, 0, 0.0)])], false);
        assert_eq!(plan.stretches.len(), 1);
        let order: Vec<usize> = plan.stretches[0]
            .pieces
            .iter()
            .map(|u| u.piece.file)
            .collect();
        assert_eq!(order, [1, 0]);
    }

    #[test]
    fn overlapping_rows_are_used_once() {
        let plan = planned(&[file(&[(0, 0, 0.0)]), file(&[(1, 0, 5.0)])], true);
        assert_eq!((plan.stretches.len(), plan.again.len()), (1, 1));
        assert!((plan.stretches[0].pieces[1].after_s - 9.9875).abs() < 1e-9);
        let copy = planned(&[file(&[(0, 0, 0.0)]), file(&[(1, 0, 0.0)])], true);
        assert_eq!((copy.stretches[0].pieces.len(), copy.again.len()), (1, 1));
    }

    #[test]
    fn a_clock_that_starts_anew_begins_a_stretch_and_says_where() {
        let plan = planned(&[file(&[(0, 0, 0.0), (0, 400, 0.0)])], false);
        assert_eq!(plan.stretches.len(), 2);
        let because = plan.stretches[1].because.clone().unwrap();
        assert_eq!(
            because,
            "time jumps back from 9.975 s to 0.000 s in row 401 of part-0"
        );
    }

    #[test]
    fn a_long_gap_begins_a_stretch_and_a_short_one_does_not() {
        let plan = planned(
            &[file(&[(0, 0, 0.0), (0, 400, 30.0), (0, 800, 200.0)])],
            false,
        );
        assert_eq!(plan.stretches.len(), 2);
        assert_eq!(
            plan.stretches[1].because.as_deref(),
            Some("the clock lacks 160.0 s from 40.0 s to 200.0 s")
        );
    }

    #[test]
    fn a_row_with_a_time_of_its_own_is_a_stray() {
        let mut pieces = file(&[(0, 0, 0.0), (0, 400, 30.0), (0, 401, 10.0)]);
        (pieces.pieces[1].rows, pieces.pieces[1].end_s) = (1, 30.0);
        let plan = planned(&[pieces], false);
        assert_eq!((plan.stretches.len(), plan.stray.len()), (1, 1));
    }
}
