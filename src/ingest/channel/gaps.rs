//! Gaps: dropouts and lost frames, bridged where they are short, left missing where they are long.

use std::ops::Range;

use crate::flight::Mark;
use crate::flight::signal as s;
use crate::numerics::series::sample_count::whole_steps;

/// Method of bridging a short gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bridge {
    /// A straight line between the samples on either side.
    Line,
    /// The last recorded value.
    Held,
}

/// Longest gap of a signal of [`SLOW`] that is bridged, s. Within 3 s a fighter's altitude departs from
/// a straight line by less than 100 ft, and its Mach number by less than 0.02.
const SLOW_BRIDGE_S: f64 = 3.0;

/// Signals whose gaps of some seconds are bridged. In a maneuver they affect only gravity, the
/// gyroscopic moment, the place in the tunnel tables and the inertia.
const SLOW: [&str; 12] = [
    s::RPM_LEFT,
    s::RPM_RIGHT,
    s::ALTITUDE,
    s::MACH,
    s::MASS,
    s::X_CG,
    s::Y_CG,
    s::Z_CG,
    s::IX,
    s::IY,
    s::IZ,
    s::IXZ,
];

/// Further signals that change little from one update of a slow channel to the next.
const STEADY: [&str; 3] = [s::VELOCITY, s::QBAR, s::THRUST];

/// Longest gaps of a signal that are bridged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BridgedGaps {
    /// Samples of any gap.
    longest: usize,
    /// Samples of a gap at an end of the record, over which the nearest value is held.
    longest_at_end: usize,
    /// `true` where one lost update of a slow channel is bridged.
    spans_lost_update: bool,
}

impl BridgedGaps {
    /// Gaps of a signal in a record with this step, where any signal's gaps of `longest_bridge_s`
    /// are bridged.
    pub fn of(signal: &str, longest_bridge_s: f64, step_s: f64) -> BridgedGaps {
        let usual = whole_steps(longest_bridge_s, step_s);
        let is_slow = SLOW.contains(&signal) && longest_bridge_s > 0.0;
        let spans_lost_update = is_slow || STEADY.contains(&signal) && longest_bridge_s > 0.0;
        let longest = if is_slow {
            usual.max(whole_steps(SLOW_BRIDGE_S, step_s))
        } else {
            usual
        };
        BridgedGaps {
            longest,
            longest_at_end: if spans_lost_update { usual } else { 0 },
            spans_lost_update,
        }
    }

    /// Samples of a gap that may be bridged where a channel has a value every `period` samples. The
    /// samples between two values are no part of what was lost.
    fn between(self, period: usize) -> usize {
        let lost = self.longest + period.saturating_sub(1);
        lost.max(self.lost_update(period))
    }

    /// Samples of a gap at an end that may be filled.
    fn at_end(self, period: usize) -> usize {
        self.longest_at_end.max(self.lost_update(period))
    }

    /// Samples between the two updates beside a lost one, and one for a clock of its own.
    fn lost_update(self, period: usize) -> usize {
        if self.spans_lost_update && period > 1 {
            2 * period
        } else {
            0
        }
    }
}

/// Samples that are looked at together for a gap, since few of them begin one.
const LOOKED_AT_ONCE: usize = 16;

/// Bridges the gaps (NaN) within reach in place and marks every sample.
///
/// A gap at an end of the record has one neighbour only and stays missing. There are two
/// exceptions: a gap between two values of a slow channel, and a gap within the reach at an end. It
/// then takes the neighbour's value. `period` gives the channel's samples per recorded value at a
/// sample. A gap that is no longer lies between two recorded values and is no fault.
pub fn bridge_gaps(
    values: &mut [f64],
    marks: &mut Vec<Mark>,
    reach: BridgedGaps,
    bridge: Bridge,
    period: impl Fn(usize) -> usize,
) {
    marks.clear();
    marks.resize(values.len(), Mark::Measured);
    let mut from = 0;
    while let Some(gap) = next_gap(values, from) {
        let before = gap
            .start
            .checked_sub(1)
            .and_then(|k| values.get(k).copied());
        let after = values.get(gap.end).copied();
        let period = period(gap.start);
        let is_between = period > 1 && gap.len() <= period;
        let filled = if is_between {
            Mark::Between
        } else {
            Mark::Bridged
        };
        let mark = match (before, after) {
            (Some(before), Some(after)) if is_between || gap.len() <= reach.between(period) => {
                interpolate(&mut values[gap.clone()], before, after, bridge);
                filled
            }
            (Some(value), None) | (None, Some(value))
                if is_between || gap.len() <= reach.at_end(period) =>
            {
                values[gap.clone()].fill(value);
                filled
            }
            _ => Mark::Missing,
        };
        from = gap.end;
        marks[gap].fill(mark);
    }
}

/// The first gap from a sample on.
fn next_gap(values: &[f64], from: usize) -> Option<Range<usize>> {
    // Without an early exit, for the vectors.
    let has_gap = |part: &[f64]| part.iter().fold(false, |any, v| any | v.is_nan());
    let later = &values[from..];
    let searched = LOOKED_AT_ONCE * later.chunks(LOOKED_AT_ONCE).position(has_gap)?;
    let start = from + searched + later[searched..].iter().position(|v| v.is_nan())?;
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

    /// Marks of values whose gaps are bridged.
    fn bridged(
        values: &mut [f64],
        reach: BridgedGaps,
        bridge: Bridge,
        period: impl Fn(usize) -> usize,
    ) -> Vec<Mark> {
        let mut marks = vec![Mark::Missing; 3];
        bridge_gaps(values, &mut marks, reach, bridge, period);
        marks
    }

    /// Gaps of a rate over a number of samples.
    fn samples(longest: usize) -> BridgedGaps {
        BridgedGaps::of(s::Q, longest as f64, 1.0)
    }

    #[test]
    fn a_short_gap_is_bridged_by_a_straight_line_and_marked() {
        let mut values = [1.0, GAP, GAP, 4.0, 5.0];
        let marks = bridged(&mut values, samples(2), Bridge::Line, |_| 1);
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
        let marks = bridged(&mut values, samples(2), Bridge::Line, |_| 1);
        let missing: Vec<usize> = (0..7).filter(|&k| marks[k] == Mark::Missing).collect();
        assert_eq!(missing, [0, 2, 3, 4, 6]);
        assert!(missing.iter().all(|&k| values[k].is_nan()));
    }

    #[test]
    fn a_slow_channel_holds_its_value_at_the_ends() {
        let mut values = [GAP, GAP, 1.0, GAP, GAP, 4.0, GAP];
        let marks = bridged(&mut values, samples(0), Bridge::Line, |_| 3);
        assert_eq!(values, [1.0, 1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        assert_eq!(marks[0], Mark::Between);
        // A longer gap is no slow channel's.
        let mut values = [GAP, GAP, GAP, GAP, 1.0];
        bridged(&mut values, samples(0), Bridge::Line, |_| 3);
        assert!(values[0].is_nan());
    }

    #[test]
    fn a_flag_holds_its_last_value_and_never_takes_one_between() {
        let mut values = [0.0, GAP, GAP, 1.0];
        bridged(&mut values, samples(5), Bridge::Held, |_| 1);
        assert_eq!(values, [0.0, 0.0, 0.0, 1.0]);
    }

    /// Number of missing samples of a 2 Hz channel of a record at 40 Hz, of which some updates are
    /// lost, after bridging with the default of 0.25 s.
    fn missing_at_2_hz(signal: &str, lost: &[usize]) -> usize {
        let period = 20;
        let value = |k: usize| {
            if k.is_multiple_of(period) {
                k as f64
            } else {
                GAP
            }
        };
        let mut values: Vec<f64> = (0..=10 * period).map(value).collect();
        for update in lost {
            values[update * period] = GAP;
        }
        let marks = bridged(
            &mut values,
            BridgedGaps::of(signal, 0.25, 0.025),
            Bridge::Line,
            |_| period,
        );
        let is_true = |k: usize| values[k].is_nan() || (values[k] - k as f64).abs() < 1e-9;
        assert!((0..values.len()).all(is_true));
        assert!(marks.iter().any(|mark| mark.is_fault()));
        values.iter().filter(|v| v.is_nan()).count()
    }

    #[test]
    fn one_lost_update_of_air_data_is_bridged_and_of_a_rate_it_is_not() {
        for signal in [s::VELOCITY, s::QBAR, s::THRUST, s::ALTITUDE, s::RPM_LEFT] {
            assert_eq!(missing_at_2_hz(signal, &[3]), 0, "{signal}");
        }
        for signal in [s::Q, s::ALPHA_VANE, s::AN, s::PHI, "de_deg"] {
            assert_eq!(missing_at_2_hz(signal, &[3]), 39, "{signal}");
        }
        // Two lost updates of the velocity are too many, of the altitude they are not.
        assert_eq!(missing_at_2_hz(s::VELOCITY, &[3, 4]), 59);
        assert_eq!(missing_at_2_hz(s::ALTITUDE, &[3, 4]), 0);
    }

    #[test]
    fn a_dropout_of_a_slow_channel_is_as_long_as_its_lost_updates() {
        // At 10 Hz two lost updates are 0.2 s, though their gap has 11 samples of 0.025 s.
        let missing = |lost: Range<usize>| {
            let mut values: Vec<f64> = (0..60)
                .map(|k| if k % 4 == 0 { f64::from(k) } else { GAP })
                .collect();
            lost.for_each(|update| values[4 * update] = GAP);
            let reach = BridgedGaps::of(s::BETA_VANE, 0.25, 0.025);
            bridged(&mut values[..57], reach, Bridge::Line, |_| 4);
            values[..57].iter().filter(|v| v.is_nan()).count()
        };
        assert_eq!(missing(5..7), 0);
        assert_eq!(missing(5..8), 15);
    }

    #[test]
    fn a_slow_signal_is_bridged_over_seconds_and_held_shortly_at_the_ends() {
        let missing = |signal: &str, gap: Range<usize>| {
            let mut values: Vec<f64> = (0..400).map(f64::from).collect();
            values[gap].fill(GAP);
            let reach = BridgedGaps::of(signal, 0.25, 0.025);
            let marks = bridged(&mut values, reach, Bridge::Line, |_| 1);
            assert!(marks.iter().any(|mark| mark.is_fault()));
            values.iter().filter(|v| v.is_nan()).count()
        };
        for signal in SLOW {
            assert_eq!(missing(signal, 100..180), 0, "{signal}");
            assert_eq!(missing(signal, 100..300), 200, "{signal}");
            assert_eq!(missing(signal, 0..2), 0, "{signal}");
            assert_eq!(missing(signal, 398..400), 0, "{signal}");
            assert_eq!(missing(signal, 0..80), 80, "{signal}");
        }
        assert_eq!(missing(s::VELOCITY, 100..180), 80);
        assert_eq!(missing(s::VELOCITY, 0..2), 0);
        assert_eq!(missing(s::Q, 0..2), 2);
    }

    #[test]
    fn a_bridge_of_zero_bridges_nothing() {
        let mut values = [1.0, GAP, 3.0];
        bridged(
            &mut values,
            BridgedGaps::of(s::MACH, 0.0, 0.025),
            Bridge::Line,
            |_| 1,
        );
        assert!(values[1].is_nan());
    }
}
