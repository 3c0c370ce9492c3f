//! Recordings on one uniform step: medians over blocks of samples, which remove spikes and single
//! lost frames, of the parts with the most motion.

use std::collections::BTreeMap;
use std::ops::Range;

use super::clock::ClockColumn;
use super::recording::{Recording, column_names};
use crate::flight::signal;
use crate::numerics::statistics::order_statistics::median;
use crate::units::Unit;

/// Step of the grid, s: aircraft move at up to about 2 Hz.
const STEP_S: f64 = 0.1;
/// Longest gap that is filled by a straight line, s: slow channels are recorded at 2 Hz or more.
const LONGEST_FILL_S: f64 = 1.1;
/// A jump of the clock of more than this begins another stretch, s.
const LONGEST_JUMP_S: f64 = 5.0;
/// Parts among which the liveliest are chosen, s.
const PART_S: f64 = 20.0;

/// Columns on one step.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    pub step_s: f64,
    /// Ranges of samples within which time runs evenly.
    pub stretches: Vec<Range<usize>>,
    pub columns: BTreeMap<String, Vec<f64>>,
}

impl Grid {
    /// Puts recordings on one step.
    #[must_use]
    pub fn of(recordings: &[Recording], clock: &ClockColumn) -> Grid {
        let factor = clock.unit.factor_to(Unit::of_signal(signal::TIME));
        let mut grid = Grid {
            step_s: STEP_S.max(clock.step_s),
            ..Grid::default()
        };
        let names = column_names(recordings);
        for recording in recordings {
            if let (Some(time), Some(factor)) = (recording.column(&clock.name), factor) {
                let times: Vec<f64> = time.values.iter().map(|t| t * factor).collect();
                grid.append(recording, &times, &names);
            }
        }
        grid
    }

    /// Appends a recording, in stretches of even time.
    fn append(&mut self, recording: &Recording, times_s: &[f64], names: &[&str]) {
        for rows in even_rows(times_s) {
            let blocks = blocks(times_s, rows, self.step_s);
            let start = self.stretches.last().map_or(0, |s| s.end);
            self.stretches.push(start..start + blocks.len());
            for name in names {
                let values = recording.column(name).map_or(&[][..], |c| &c.values);
                let medians = blocks.iter().map(|block| {
                    let block = values.get(block.clone()).unwrap_or_default();
                    median(block.iter().copied()).unwrap_or(f64::NAN)
                });
                let mut medians: Vec<f64> = medians.collect();
                fill(&mut medians, LONGEST_FILL_S / self.step_s);
                self.columns
                    .entry((*name).to_owned())
                    .or_default()
                    .extend(medians);
            }
        }
    }

    /// Grid of the parts in which the columns change most, up to a number of samples. Each further part of changes of a
    /// column counts less, so that no column is left out because others change elsewhere.
    #[must_use]
    pub fn liveliest(&self, most: usize) -> Grid {
        let total: usize = self.stretches.iter().map(Range::len).sum();
        if total <= most {
            return self.clone();
        }
        let parts = self.parts();
        let shares = self.shares_of_change(&parts);
        let mut covered = vec![0.0; shares.len()];
        let mut left: Vec<usize> = (0..parts.len()).collect();
        let (mut chosen, mut samples) = (Vec::new(), 0);
        while !left.is_empty() {
            let gain = |part: usize| {
                let columns = shares.iter().zip(&covered);
                let gains =
                    columns.map(|(share, covered)| (covered + share[part]).sqrt() - covered.sqrt());
                gains.sum::<f64>()
            };
            let gains = left.iter().map(|part| gain(*part)).enumerate();
            let best = gains.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            let Some(part) = best.map(|(at, _)| left.remove(at)) else {
                break;
            };
            samples += parts[part].len();
            if samples > most {
                break;
            }
            for (covered, share) in covered.iter_mut().zip(&shares) {
                *covered += share[part];
            }
            chosen.push(part);
        }
        chosen.sort_unstable();
        let parts: Vec<Range<usize>> = chosen.into_iter().map(|part| parts[part].clone()).collect();
        self.cut(&parts)
    }

    fn parts(&self) -> Vec<Range<usize>> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few hundred samples"
        )]
        let length = ((PART_S / self.step_s).round() as usize).max(1);
        let split = |stretch: &Range<usize>| {
            let end = stretch.end;
            let starts = stretch.clone().step_by(length);
            starts
                .map(move |from| from..(from + length).min(end))
                .collect::<Vec<_>>()
        };
        self.stretches.iter().flat_map(split).collect()
    }

    /// Change of each column in each part, in units of its change over all parts. Columns that do not change are left
    /// out.
    fn shares_of_change(&self, parts: &[Range<usize>]) -> Vec<Vec<f64>> {
        let shares = |values: &Vec<f64>| {
            let changes = parts.iter().map(|part| {
                let values = values.get(part.clone()).unwrap_or_default();
                let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
                steps.filter(|step| step.is_finite()).sum::<f64>()
            });
            let changes: Vec<f64> = changes.collect();
            let all: f64 = changes.iter().sum();
            let changes_at_all = all > 0.0 && all.is_finite();
            changes_at_all.then(|| changes.into_iter().map(|change| change / all).collect())
        };
        self.columns.values().filter_map(shares).collect()
    }

    fn cut(&self, parts: &[Range<usize>]) -> Grid {
        let mut grid = Grid {
            step_s: self.step_s,
            ..Grid::default()
        };
        for part in parts {
            let start = grid.stretches.last().map_or(0, |s| s.end);
            grid.stretches.push(start..start + part.len());
        }
        for (name, values) in &self.columns {
            let kept = parts.iter().filter_map(|part| values.get(part.clone()));
            grid.columns
                .insert(name.clone(), kept.flatten().copied().collect());
        }
        grid
    }
}

/// Ranges of rows within which time neither jumps nor goes back.
fn even_rows(times_s: &[f64]) -> Vec<Range<usize>> {
    let mut ranges: Vec<Range<usize>> = Vec::new();
    let mut before = f64::NAN;
    for (row, time_s) in times_s.iter().enumerate().filter(|(_, t)| t.is_finite()) {
        let goes_on = (-1.0..LONGEST_JUMP_S).contains(&(time_s - before));
        match ranges.last_mut() {
            Some(range) if goes_on => range.end = row + 1,
            _ => ranges.push(row..row + 1),
        }
        before = *time_s;
    }
    ranges
}

/// Rows of each step of the grid.
fn blocks(times_s: &[f64], rows: Range<usize>, step_s: f64) -> Vec<Range<usize>> {
    let mut blocks: Vec<Range<usize>> = Vec::new();
    let start_s = times_s.get(rows.start).copied().unwrap_or(f64::NAN);
    for row in rows {
        let place = ((times_s[row] - start_s) / step_s).floor();
        while blocks.is_empty() || (blocks.len() as f64) < place + 1.0 {
            blocks.push(row..row);
        }
        if let Some(block) = blocks.last_mut() {
            block.end = row + 1;
        }
    }
    blocks
}

/// Fills gaps of up to `longest` values by straight lines.
fn fill(values: &mut [f64], longest: f64) {
    let mut last: Option<usize> = None;
    for k in 0..values.len() {
        if !values[k].is_finite() {
            continue;
        }
        if let Some(from) = last.filter(|from| ((k - from) as f64) <= longest + 1.0) {
            let (start, slope) = (values[from], (values[k] - values[from]) / (k - from) as f64);
            for (n, value) in values[from + 1..k].iter_mut().enumerate() {
                *value = start + slope * (n + 1) as f64;
            }
        }
        last = Some(k);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_liveliest_parts_have_the_motion_of_each_column() {
        // Three columns move in the first two minutes, one in the last.
        let moves = |from: usize, to: usize| -> Vec<f64> {
            let value = |k: usize| {
                if (from..to).contains(&k) {
                    (k as f64).sin()
                } else {
                    0.0
                }
            };
            (0..1800).map(value).collect()
        };
        let mut grid = Grid {
            step_s: 0.1,
            stretches: vec![0..1800; 1],
            columns: (0..3).map(|n| (format!("a{n}"), moves(0, 1200))).collect(),
        };
        grid.columns.insert("b".to_owned(), moves(1200, 1800));
        let lively = grid.liveliest(1000);
        assert!(lively.columns["b"].iter().any(|value| value.abs() > 0.1));
        assert!(
            lively.columns["a0"]
                .iter()
                .filter(|value| value.abs() > 0.0)
                .count()
                >= 600
        );
    }

    #[test]
    fn a_block_is_the_median_of_its_samples_and_short_gaps_are_filled() {
        let times: Vec<f64> = (0..80).map(|k| f64::from(k) * 0.025).collect();
        let mut values: Vec<f64> = times.iter().map(|t| 3.0 * t).collect();
        values[41] = 1e6;
        values[20..24].fill(f64::NAN);
        let column = |name: &str, values: Vec<f64>| super::super::recording::Column {
            name: name.to_owned(),
            stated: None,
            values,
        };
        let recording = Recording {
            name: "f".to_owned(),
            columns: vec![column("t", times), column("x", values)],
        };
        let clock = super::super::clock::find_clock(std::slice::from_ref(&recording)).unwrap();
        let grid = Grid::of(&[recording], &clock);
        assert_eq!(grid.stretches, vec![0..20; 1]);
        let x = &grid.columns["x"];
        for (k, value) in x.iter().enumerate() {
            assert!(
                (value - 3.0 * (0.1 * k as f64 + 0.0375)).abs() < 0.08,
                "{k}: {value}"
            );
        }
    }
}
