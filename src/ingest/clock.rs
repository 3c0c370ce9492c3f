//! The uniform clock of a record, and the slot on it that each recorded row belongs to.
//!
//! A recorder's time jitters by some tenths of a millisecond, loses frames and runs a little off its nominal rate. Rows
//! keep their values: they are put into the slot nearest to their time, nothing is interpolated.

use std::collections::BTreeMap;

use super::{Settings, Spoilt, TIME};
use crate::flight::{Channel, RawFlight};
use crate::units::Unit;

/// Sample `k` is at `start_s + k step_s`; row `i` of the file is sample `slots[i]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    pub start_s: f64,
    pub step_s: f64,
    pub samples: usize,
    pub slots: Vec<usize>,
}

/// More empty slots than this per recorded row, and the median step is not the recorder's.
const SLOTS_PER_ROW: usize = 10;

/// How far a configured rate may be from the recorded one, relative.
const RATE_TOLERANCE: f64 = 0.05;

/// How fast the clock follows a drift of the recorder's phase, per sample: slow against jitter, fast against drift.
const PHASE_GAIN: f64 = 0.05;

/// The clock of a flight from its time channel.
pub fn of(raw: &RawFlight, channels: &BTreeMap<String, Channel>, settings: &Settings) -> Result<Clock, Spoilt> {
    let no_clock = || ("channel map".to_owned(), format!("no channel is mapped to `{TIME}`; the record has no clock"));
    let (name, channel) = channels.iter().find(|(_, c)| c.signal == TIME).ok_or_else(no_clock)?;
    let at = |reason: String| (format!("channel `{name}`"), reason);
    let column = raw.columns.get(name).ok_or_else(|| at(format!("the time channel `{name}` is not in the file")))?;
    let factor = Unit::parse(&channel.unit).ok().and_then(|u| u.factor_to(Unit::of_signal(TIME)));
    let factor = factor.ok_or_else(|| at(format!("`{}` is not a unit of time", channel.unit)))?;
    let times: Vec<f64> = column.values.iter().map(|t| t * factor * channel.sign * channel.scale).collect();
    from_times(&times, settings).map_err(at)
}

/// The clock of rows at these times, s.
///
/// # Errors
/// In words, with row and time: too few rows, a time that is not a number, stands still, runs backwards or leaves a gap
/// that is too long, or a rate other than the configured one.
pub fn from_times(times: &[f64], settings: &Settings) -> Result<Clock, String> {
    refuse_broken(times, settings)?;
    let step = step_of(times, settings)?;
    let slots = slots_of(times, step)?;
    let (Some(&last_slot), Some(&first), Some(&last)) = (slots.last(), times.first(), times.last()) else {
        return Err("no rows".to_owned());
    };
    if last_slot / SLOTS_PER_ROW > times.len() {
        let rows = times.len();
        return Err(format!(
            "{rows} rows span {:.1} s, {last_slot} steps of the median {:.3} ms: the time step is not steady",
            last - first,
            step * 1e3
        ));
    }
    Ok(Clock { start_s: first, step_s: (last - first) / last_slot as f64, samples: last_slot + 1, slots })
}

/// Rows are counted from 1, as a reader counts them.
fn refuse_broken(times: &[f64], settings: &Settings) -> Result<(), String> {
    if times.len() < 2 {
        return Err(format!("{} rows are no record; at least 2 are needed", times.len()));
    }
    if let Some(row) = times.iter().position(|t| !t.is_finite()) {
        let before = row.checked_sub(1).and_then(|i| times.get(i));
        let after = before.map(|t| format!(" (after {t:.4} s)")).unwrap_or_default();
        return Err(format!("the time in row {}{after} is missing or not a number", row + 1));
    }
    for (i, pair) in times.windows(2).enumerate() {
        let (before, now, row) = (pair[0], pair[1], i + 2);
        if now < before {
            return Err(format!("time runs backwards in row {row}: from {before:.4} s to {now:.4} s"));
        }
        if now <= before {
            return Err(format!("time stands still in row {row} at {now:.4} s"));
        }
        let gap = now - before;
        if gap > settings.longest_clock_gap_s {
            return Err(format!(
                "time jumps by {gap:.1} s in row {row}, from {before:.4} s to {now:.4} s: more than longest_clock_gap_s \
                 = {} s; are these two flights?",
                settings.longest_clock_gap_s
            ));
        }
    }
    Ok(())
}

/// The mean of the steps without lost frames; the median alone is off by the jitter, which would slip over a long gap.
fn step_of(times: &[f64], settings: &Settings) -> Result<f64, String> {
    let mut steps: Vec<f64> = times.windows(2).map(|p| p[1] - p[0]).collect();
    steps.sort_by(f64::total_cmp);
    let median = steps.get(steps.len() / 2).copied().unwrap_or_default();
    if let Some(rate) = settings.sampling_rate_hz
        && (median * rate - 1.0).abs() > RATE_TOLERANCE
    {
        return Err(format!("the record runs at {:.2} Hz, sampling_rate_hz says {rate} Hz", 1.0 / median));
    }
    let whole: Vec<f64> = steps.into_iter().filter(|s| (0.5..1.5).contains(&(s / median))).collect();
    Ok(whole.iter().sum::<f64>() / whole.len() as f64)
}

/// The slot of each row: its time in whole steps, after the phase that the rows before it have shown.
fn slots_of(times: &[f64], step: f64) -> Result<Vec<usize>, String> {
    let start = times.first().copied().unwrap_or_default();
    let (mut phase, mut slots) = (0.0, Vec::<usize>::with_capacity(times.len()));
    for (row, time) in times.iter().enumerate() {
        let steps = (time - start) / step;
        let slot = (steps - phase).round().max(0.0);
        phase += PHASE_GAIN * (steps - slot - phase);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded and not negative")]
        let slot = slot as usize;
        if slots.last().is_some_and(|&before| slot <= before) {
            return Err(format!(
                "row {} at {time:.4} s follows the row before it in less than half a step of {:.3} ms: two rows for one \
                 sample",
                row + 1,
                step * 1e3
            ));
        }
        slots.push(slot);
    }
    Ok(slots)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    fn clock(times: &[f64]) -> Result<Clock, String> {
        from_times(times, &Settings::default())
    }

    #[test]
    fn lost_frames_are_missing_slots() {
        let clock = clock(&[0.0, 0.025, 0.05, 0.125, 0.15]).expect("a clock");
        assert_eq!(clock.slots, [0, 1, 2, 5, 6]);
        assert_eq!(clock.samples, 7);
    }

    #[test]
    fn jitter_does_not_move_a_row_into_another_slot() {
        let jitter = [0.0, 0.0011, -0.0009, 0.0004, -0.0012, 0.0007];
        let times: Vec<f64> = (0..3000).map(|k| k as f64 * 0.025 + jitter[k % 6]).collect();
        let clock = clock(&times).expect("a clock");
        assert!(clock.slots.iter().enumerate().all(|(k, slot)| k == *slot));
    }

    #[test]
    fn a_clock_slightly_off_its_nominal_rate_does_not_slip() {
        let settings = Settings { sampling_rate_hz: Some(40.0), ..Settings::default() };
        let times: Vec<f64> = (0..100_000).map(|k| f64::from(k) * 0.025_01).collect();
        let clock = from_times(&times, &settings).expect("a clock");
        assert_eq!(clock.samples, 100_000);
        assert_abs_diff_eq!(clock.step_s, 0.025_01, epsilon = 1e-12);
    }

    #[test]
    fn a_long_gap_is_counted_in_whole_steps_despite_jitter() {
        let jitter = [0.0, 0.0008, -0.0006, 0.0002, -0.0005];
        let slots: Vec<usize> = (0..2000).chain(14_000..16_000).collect();
        let times: Vec<f64> = slots.iter().map(|&k| k as f64 * 0.025 + jitter[k % 5]).collect();
        let clock = clock(&times).expect("a clock");
        assert_eq!(clock.slots, slots);
    }

    #[test]
    fn time_that_runs_backwards_is_named_with_row_and_time() {
        let what = clock(&[0.0, 0.025, 0.05, 0.04]).expect_err("backwards");
        assert_eq!(what, "time runs backwards in row 4: from 0.0500 s to 0.0400 s");
    }

    #[test]
    fn time_that_stands_still_is_named_with_row_and_time() {
        let what = clock(&[0.0, 0.025, 0.025, 0.05]).expect_err("still");
        assert_eq!(what, "time stands still in row 3 at 0.0250 s");
    }

    #[test]
    fn a_missing_time_a_short_record_and_a_long_gap_are_refused() {
        let what = clock(&[0.0, f64::NAN, 0.05]).expect_err("NaN");
        assert!(what.contains("row 2 (after 0.0000 s)"), "{what}");
        assert!(clock(&[1.0]).expect_err("one row").contains("1 rows"));
        assert!(clock(&[0.0, 0.025, 0.05, 700.0]).expect_err("a gap").contains("in row 4"));
    }

    #[test]
    fn a_rate_other_than_the_configured_one_is_refused() {
        let settings = Settings { sampling_rate_hz: Some(50.0), ..Settings::default() };
        let what = from_times(&[0.0, 0.025, 0.05, 0.075], &settings).expect_err("40 Hz");
        assert_eq!(what, "the record runs at 40.00 Hz, sampling_rate_hz says 50 Hz");
    }

    #[test]
    fn two_rows_within_half_a_step_are_refused() {
        let what = clock(&[0.0, 0.025, 0.05, 0.051, 0.075, 0.1]).expect_err("two rows for one sample");
        assert!(what.starts_with("row 4 at 0.0510 s"), "{what}");
    }

    #[test]
    fn times_without_a_steady_step_are_refused_before_memory_is_asked_for() {
        let mut times: Vec<f64> = (0..20).map(|k| f64::from(k) * 1e-7).collect();
        times.extend((1..15).map(|k| f64::from(k) * 500.0));
        assert!(clock(&times).expect_err("unsteady").contains("not steady"));
    }
}
