//! A long signal made small enough to draw: per column of the picture the smallest and the largest
//! sample, so that no spike is lost however long the flight is, and runs of marked samples.

use crate::flight::Mark;
use crate::flight::record::Series;

/// The samples of one signal that a picture shows, on the record's clock.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// Time of the first value, s.
    pub start_s: f64,
    pub step_s: f64,
    pub values: &'a [f64],
}

/// The columns that a time axis is divided into.
#[derive(Clone, Copy, Debug)]
pub struct Columns {
    pub from_s: f64,
    pub to_s: f64,
    pub count: usize,
}

impl Columns {
    /// The column of a time; none outside the axis.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and the number of columns"
    )]
    fn of(self, time_s: f64) -> Option<usize> {
        let share = (time_s - self.from_s) / (self.to_s - self.from_s);
        let last = self.count.checked_sub(1)?;
        (0.0..=1.0)
            .contains(&share)
            .then(|| ((share * self.count as f64).floor() as usize).min(last))
    }

    /// The width of one, s.
    #[must_use]
    pub fn width_s(self) -> f64 {
        (self.to_s - self.from_s) / self.count.max(1) as f64
    }
}

/// The smallest and the largest sample of one column so far, each with its time.
#[derive(Clone, Copy, Debug)]
struct Extremes {
    column: usize,
    low: (f64, f64),
    high: (f64, f64),
}

impl Extremes {
    fn with(self, point: (f64, f64)) -> Extremes {
        let low = if point.1 < self.low.1 {
            point
        } else {
            self.low
        };
        let high = if point.1 > self.high.1 {
            point
        } else {
            self.high
        };
        Extremes { low, high, ..self }
    }

    /// In the order of time; one point where both are the same sample.
    fn put(self, piece: &mut Vec<(f64, f64)>) {
        let (first, second) = if self.low.0 <= self.high.0 {
            (self.low, self.high)
        } else {
            (self.high, self.low)
        };
        piece.push(first);
        if second.0 > first.0 {
            piece.push(second);
        }
    }
}

/// The line through a signal, in pieces between which samples are missing: at most two points per
/// column, among them the smallest and the largest sample of each.
#[must_use]
pub fn envelope(shown: Shown, columns: Columns) -> Vec<Vec<(f64, f64)>> {
    let (mut pieces, mut piece) = (Vec::new(), Vec::new());
    let mut open: Option<Extremes> = None;
    let mut gap = false;
    for (k, &value) in shown.values.iter().enumerate() {
        let time_s = shown.start_s + k as f64 * shown.step_s;
        let Some(column) = columns.of(time_s) else {
            continue;
        };
        if !value.is_finite() {
            gap = true;
            continue;
        }
        let point = (time_s, value);
        open = match open {
            Some(extremes) if extremes.column == column => Some(extremes.with(point)),
            last => {
                if let Some(last) = last {
                    last.put(&mut piece);
                }
                if gap && !piece.is_empty() {
                    pieces.push(std::mem::take(&mut piece));
                }
                Some(Extremes {
                    column,
                    low: point,
                    high: point,
                })
            }
        };
        gap = false;
    }
    if let Some(last) = open {
        last.put(&mut piece);
    }
    if !piece.is_empty() {
        pieces.push(piece);
    }
    pieces
}

/// From when to when samples bear a mark, s; runs that no column separates are one.
#[must_use]
pub fn runs(
    series: &Series,
    start_s: f64,
    step_s: f64,
    mark: Mark,
    columns: Columns,
) -> Vec<(f64, f64)> {
    let half = 0.5 * step_s;
    let marked = series.marks.iter().enumerate().filter(|(_, m)| **m == mark);
    let times = marked
        .map(|(k, _)| start_s + k as f64 * step_s)
        .filter(|t| columns.of(*t).is_some());
    let mut runs: Vec<(f64, f64)> = Vec::new();
    for time_s in times {
        match runs.last_mut() {
            Some(run) if time_s - half - run.1 < columns.width_s() => run.1 = time_s + half,
            _ => runs.push((time_s - half, time_s + half)),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::scale::extent;
    use proptest::prelude::*;

    const COLUMNS: Columns = Columns {
        from_s: 0.0,
        to_s: 1000.0,
        count: 50,
    };

    fn shown(values: &[f64]) -> Shown<'_> {
        Shown {
            start_s: 0.0,
            step_s: 1000.0 / values.len() as f64,
            values,
        }
    }

    #[test]
    fn a_spike_of_one_sample_in_ten_hours_is_drawn_at_its_time() {
        let mut values = vec![1.0; 1_440_000];
        values[777_777] = -42.0;
        let pieces = envelope(shown(&values), COLUMNS);
        let drawn = pieces
            .iter()
            .flatten()
            .find(|p| p.1 < 0.0)
            .expect("the spike");
        assert_eq!(*drawn, (777_777.0 * (1000.0 / 1_440_000.0), -42.0));
        assert_eq!(pieces.len(), 1);
    }

    #[test]
    fn a_few_samples_are_all_drawn_as_they_are() {
        let values = [1.0, 3.0, 2.0, 5.0, 4.0];
        let points: Vec<f64> = envelope(shown(&values), COLUMNS)
            .concat()
            .iter()
            .map(|p| p.1)
            .collect();
        assert_eq!(points, values);
    }

    #[test]
    fn nothing_is_drawn_across_missing_samples() {
        let mut values = vec![1.0; 1000];
        values[300..400].fill(f64::NAN);
        let pieces = envelope(shown(&values), COLUMNS);
        assert_eq!(pieces.len(), 2);
        assert!(pieces[0].iter().all(|p| p.0 < 300.0) && pieces[1].iter().all(|p| p.0 >= 400.0));
        assert!(envelope(shown(&[f64::NAN; 10]), COLUMNS).is_empty());
    }

    #[test]
    fn runs_of_marks_are_where_the_marks_are_and_no_finer_than_the_columns() {
        let mut marks = vec![Mark::Measured; 1000];
        marks[100..110].fill(Mark::Bridged);
        for k in (500..600).step_by(2) {
            marks[k] = Mark::Bridged;
        }
        marks[900] = Mark::Missing;
        let series = Series {
            values: vec![0.0; 1000],
            marks,
        };
        assert_eq!(
            runs(&series, 0.0, 1.0, Mark::Bridged, COLUMNS),
            [(99.5, 109.5), (499.5, 598.5)]
        );
        assert_eq!(
            runs(&series, 0.0, 1.0, Mark::Missing, COLUMNS),
            [(899.5, 900.5)]
        );
        assert!(runs(&series, 0.0, 1.0, Mark::Despiked, COLUMNS).is_empty());
    }

    proptest! {
        #[test]
        fn extremes_of_every_column_are_drawn_with_at_most_two_points(
            values in prop::collection::vec(prop_oneof![9 => -1e3..1e3, 1 => Just(f64::NAN)], 1..2000),
        ) {
            let shown = shown(&values);
            let drawn = envelope(shown, COLUMNS).concat();
            for column in 0..COLUMNS.count {
                let time = |k: usize| k as f64 * shown.step_s;
                let inside = |t: f64| COLUMNS.of(t) == Some(column);
                let of_signal = (0..values.len()).filter(|k| inside(time(*k)) && values[*k].is_finite()).map(|k| values[k]);
                let of_line: Vec<f64> = drawn.iter().filter(|p| inside(p.0)).map(|p| p.1).collect();
                prop_assert!(of_line.len() <= 2);
                prop_assert_eq!(extent(of_signal), extent(of_line));
            }
            prop_assert!(drawn.windows(2).all(|w| w[0].0 < w[1].0), "in the order of time");
        }
    }
}
