//! Gaps: dropouts and lost frames, bridged where they are short, left missing where they are long.

use crate::flight::Mark;

/// How a short gap is bridged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bridge {
    /// A straight line between the samples on either side.
    Line,
    /// What was last recorded.
    Held,
}

/// Bridges the gaps (NaN) of at most `longest` samples in place and says what every sample is now.
/// A gap at either end of the record has only one side and stays missing. Where a channel is
/// recorded once in several samples (`period`), a gap that is no longer is none: it lies between
/// two samples.
pub fn fill(
    values: &mut [f64],
    longest: usize,
    bridge: Bridge,
    period: impl Fn(usize) -> usize,
) -> Vec<Mark> {
    let mut marks = vec![Mark::Measured; values.len()];
    let mut from = 0;
    while let Some(start) = values[from..]
        .iter()
        .position(|v| v.is_nan())
        .map(|k| from + k)
    {
        let end = values[start..]
            .iter()
            .position(|v| !v.is_nan())
            .map_or(values.len(), |k| start + k);
        let sides = start
            .checked_sub(1)
            .and_then(|k| values.get(k).copied())
            .zip(values.get(end).copied());
        let period = period(start);
        let between = period > 1 && end - start <= period;
        let mark = match sides {
            Some((before, after)) if between || end - start <= longest => {
                let steps = (end - start + 1) as f64;
                for (k, value) in values[start..end].iter_mut().enumerate() {
                    let share = (k + 1) as f64 / steps;
                    *value = if bridge == Bridge::Line {
                        before + share * (after - before)
                    } else {
                        before
                    };
                }
                if between {
                    Mark::Between
                } else {
                    Mark::Bridged
                }
            }
            _ => Mark::Missing,
        };
        marks[start..end].fill(mark);
        from = end;
    }
    marks
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "the values are exact")]

    use super::*;

    const GAP: f64 = f64::NAN;

    #[test]
    fn a_short_gap_is_bridged_by_a_straight_line_and_marked() {
        let mut values = [1.0, GAP, GAP, 4.0, 5.0];
        let marks = fill(&mut values, 2, Bridge::Line, |_| 1);
        assert_eq!(values, [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(
            marks,
            [
                Mark::Measured,
                Mark::Bridged,
                Mark::Bridged,
                Mark::Measured,
                Mark::Measured
            ]
        );
    }

    #[test]
    fn a_long_gap_and_gaps_at_the_ends_stay_missing() {
        let mut values = [GAP, 1.0, GAP, GAP, GAP, 4.0, GAP];
        let marks = fill(&mut values, 2, Bridge::Line, |_| 1);
        let missing: Vec<usize> = (0..7).filter(|&k| marks[k] == Mark::Missing).collect();
        assert_eq!(missing, [0, 2, 3, 4, 6]);
        assert!(missing.iter().all(|&k| values[k].is_nan()));
    }

    #[test]
    fn a_flag_holds_its_last_value_and_never_takes_one_between() {
        let mut values = [0.0, GAP, GAP, 1.0];
        fill(&mut values, 5, Bridge::Held, |_| 1);
        assert_eq!(values, [0.0, 0.0, 0.0, 1.0]);
    }
}
