//! Reduction of a long signal to the columns of a picture. Each column has its smallest and largest
//! sample, so that no spike is lost, and intervals of flagged samples.

use crate::flight::Mark;
use crate::flight::record::Series;

/// Samples of one signal on the record's clock.
#[derive(Clone, Copy, Debug)]
pub struct SampledSignal<'a> {
    /// Time of the first value, s.
    pub start_s: f64,
    pub step_s: f64,
    pub values: &'a [f64],
}

/// Columns of equal width along a time axis.
#[derive(Clone, Copy, Debug)]
pub struct Columns {
    pub from_s: f64,
    pub to_s: f64,
    pub count: usize,
}

impl Columns {
    /// Column of a time; `None` outside the axis.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and the number of columns"
    )]
    fn column_at(self, time_s: f64) -> Option<usize> {
        let share = (time_s - self.from_s) / (self.to_s - self.from_s);
        let last = self.count.checked_sub(1)?;
        (0.0..=1.0)
            .contains(&share)
            .then(|| ((share * self.count as f64).floor() as usize).min(last))
    }

    /// Width of a column, s.
    #[must_use]
    fn width_s(self) -> f64 {
        (self.to_s - self.from_s) / self.count.max(1) as f64
    }
}

/// Smallest and largest sample of a column, each with its time.
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

    /// Appends both in the order of time; one point if they are the same sample.
    fn append_to(self, piece: &mut Vec<(f64, f64)>) {
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

/// The line through a signal, in pieces between which samples are missing.
///
/// Each column has at most two points: its smallest and its largest sample.
#[must_use]
pub fn envelope(signal: SampledSignal, columns: Columns) -> Vec<Vec<(f64, f64)>> {
    let (mut pieces, mut piece) = (Vec::new(), Vec::new());
    let mut open: Option<Extremes> = None;
    let mut gap = false;
    for (k, &value) in signal.values.iter().enumerate() {
        let time_s = signal.start_s + k as f64 * signal.step_s;
        let Some(column) = columns.column_at(time_s) else {
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
                    last.append_to(&mut piece);
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
        last.append_to(&mut piece);
    }
    if !piece.is_empty() {
        pieces.push(piece);
    }
    pieces
}

/// Intervals (s) of samples with a mark. Intervals less than a column apart are joined.
#[must_use]
pub fn flagged_spans(
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
        .filter(|t| columns.column_at(*t).is_some());
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for time_s in times {
        match spans.last_mut() {
            Some(span) if time_s - half - span.1 < columns.width_s() => span.1 = time_s + half,
            _ => spans.push((time_s - half, time_s + half)),
        }
    }
    spans
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

    fn sampled(values: &[f64]) -> SampledSignal<'_> {
        SampledSignal {
            start_s: 0.0,
            step_s: 1000.0 / values.len() as f64,
            values,
        }
    }

    #[test]
    fn a_spike_of_one_sample_in_ten_hours_is_drawn_at_its_time() {
        let mut values = vec![1.0; 1_440_000];
        values[777_777] = -42.0;
        let pieces = envelope(sampled(&values), COLUMNS);
        let drawn = pieces
            .iter()
            .flatten()
            .find(|p| p.1 < 0.0)
            .expect("the spike");
        assert_eq!(*drawn, (777_777.0 * (1000.0 / 1_440_000.0), -42.0));
        assert_eq!(pieces.len(), 1);
    }

    #[test]
    fn few_samples_are_all_drawn() {
        let values = [1.0, 3.0, 2.0, 5.0, 4.0];
        let points: Vec<f64> = envelope(sampled(&values), COLUMNS)
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
        let pieces = envelope(sampled(&values), COLUMNS);
        assert_eq!(pieces.len(), 2);
        assert!(pieces[0].iter().all(|p| p.0 < 300.0) && pieces[1].iter().all(|p| p.0 >= 400.0));
        assert!(envelope(sampled(&[f64::NAN; 10]), COLUMNS).is_empty());
    }

    #[test]
    fn flagged_spans_are_where_the_marks_are_and_no_finer_than_the_columns() {
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
            flagged_spans(&series, 0.0, 1.0, Mark::Bridged, COLUMNS),
            [(99.5, 109.5), (499.5, 598.5)]
        );
        assert_eq!(
            flagged_spans(&series, 0.0, 1.0, Mark::Missing, COLUMNS),
            [(899.5, 900.5)]
        );
        assert!(flagged_spans(&series, 0.0, 1.0, Mark::Despiked, COLUMNS).is_empty());
    }

    proptest! {
        #[test]
        fn extremes_of_every_column_are_drawn_with_at_most_two_points(
            values in prop::collection::vec(prop_oneof![9 => -1e3..1e3, 1 => Just(f64::NAN)], 1..2000),
        ) {
            let signal = sampled(&values);
            let drawn = envelope(signal, COLUMNS).concat();
            for column in 0..COLUMNS.count {
                let time = |k: usize| k as f64 * signal.step_s;
                let inside = |t: f64| COLUMNS.column_at(t) == Some(column);
                let of_signal = (0..values.len()).filter(|k| inside(time(*k)) && values[*k].is_finite()).map(|k| values[k]);
                let of_line: Vec<f64> = drawn.iter().filter(|p| inside(p.0)).map(|p| p.1).collect();
                prop_assert!(of_line.len() <= 2);
                prop_assert_eq!(extent(of_signal), extent(of_line));
            }
            prop_assert!(drawn.windows(2).all(|w| w[0].0 < w[1].0), "in the order of time");
        }
    }
}
