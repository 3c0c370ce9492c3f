//! Gaps: dropouts and lost frames, bridged where they are short, left missing where they are long.

use std::ops::Range;

use crate::flight::Mark;

/// Method of bridging a short gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bridge {
    /// A straight line between the samples on either side.
    Line,
    /// The last recorded value.
    Held,
}

/// Bridges the gaps (NaN) of at most `longest` samples in place and returns the flag of every
/// sample.
///
/// A gap at either end of the record has one side only and stays missing, unless it lies between
/// two values of a slow channel: then the nearest value is held. `period` gives the channel's
/// samples per recorded value at a sample: a gap that is no longer than this lies between two
/// recorded values and is no fault.
pub fn bridge_gaps(
    values: &mut [f64],
    longest: usize,
    bridge: Bridge,
    period: impl Fn(usize) -> usize,
) -> Vec<Mark> {
    let mut marks = vec![Mark::Measured; values.len()];
    let mut from = 0;
    while let Some(gap) = next_gap(values, from) {
        let before = gap
            .start
            .checked_sub(1)
            .and_then(|k| values.get(k).copied());
        let after = values.get(gap.end).copied();
        let period = period(gap.start);
        let is_between = period > 1 && gap.len() <= period;
        let mark = match (before, after) {
            (Some(before), Some(after)) if is_between || gap.len() <= longest => {
                interpolate(&mut values[gap.clone()], before, after, bridge);
                if is_between {
                    Mark::Between
                } else {
                    Mark::Bridged
                }
            }
            (Some(value), None) | (None, Some(value)) if is_between => {
                values[gap.clone()].fill(value);
                Mark::Between
            }
            _ => Mark::Missing,
        };
        from = gap.end;
        marks[gap].fill(mark);
    }
    marks
}

/// The first gap from a sample on.
fn next_gap(values: &[f64], from: usize) -> Option<Range<usize>> {
    let start = from + values[from..].iter().position(|v| v.is_nan())?;
    let end = values[start..].iter().position(|v| !v.is_nan());
    Some(start..end.map_or(values.len(), |k| start + k))
}

fn interpolate(gap: &mut [f64], before: f64, after: f64, bridge: Bridge) {
    let steps = (gap.len() + 1) as f64;
    for (k, value) in gap.iter_mut().enumerate() {
        let share = (k + 1) as f64 / steps;
        *value = match bridge {
            Bridge::Line => before + share * (after - before),
            Bridge::Held => before,
        };
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "the values are exact")]

    use super::*;

    const GAP: f64 = f64::NAN;

    #[test]
    fn a_short_gap_is_bridged_by_a_straight_line_and_marked() {
        let mut values = [1.0, GAP, GAP, 4.0, 5.0];
        let marks = bridge_gaps(&mut values, 2, Bridge::Line, |_| 1);
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
        let marks = bridge_gaps(&mut values, 2, Bridge::Line, |_| 1);
        let missing: Vec<usize> = (0..7).filter(|&k| marks[k] == Mark::Missing).collect();
        assert_eq!(missing, [0, 2, 3, 4, 6]);
        assert!(missing.iter().all(|&k| values[k].is_nan()));
    }

    #[test]
    fn a_slow_channel_holds_its_value_at_the_ends() {
        let mut values = [GAP, GAP, 1.0, GAP, GAP, 4.0, GAP];
        let marks = bridge_gaps(&mut values, 0, Bridge::Line, |_| 3);
        assert_eq!(values, [1.0, 1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        assert_eq!(marks[0], Mark::Between);
        // A longer gap is no slow channel's.
        let mut values = [GAP, GAP, GAP, GAP, 1.0];
        bridge_gaps(&mut values, 0, Bridge::Line, |_| 3);
        assert!(values[0].is_nan());
    }

    #[test]
    fn a_flag_holds_its_last_value_and_never_takes_one_between() {
        let mut values = [0.0, GAP, GAP, 1.0];
        bridge_gaps(&mut values, 5, Bridge::Held, |_| 1);
        assert_eq!(values, [0.0, 0.0, 0.0, 1.0]);
    }
}
