//! Steps of a signal: a change between two levels, averaged shortly before and shortly after it,
//! that is beyond the smallest step.
//!
//! At each time t the level before is averaged over [t − transit/2 − level, t − transit/2], the
//! level after over [t + transit/2, t + transit/2 + level]. A run of times at which their
//! difference has one sign and exceeds the smallest step is one step, at the middle of the run's
//! near-maximum. What this sees and what it does not:
//! - the trim does not matter, only the change;
//! - smooth motion counts only where it is as fast as an actuator: it must cross the smallest step within
//!   transit + level;
//! - chatter from sample to sample averages out, so ordinary stick activity leaves no steps;
//! - a level leaves out its largest and smallest sample, so one spike that ingest did not find makes no step;
//! - NaN samples are skipped; a level of fewer than half its samples does not exist, and neither does a step there.

use std::collections::BTreeMap;

use crate::flight::Record;
use crate::numerics::order_statistics::upper_median_in_place;

use super::Settings;

/// One step of one signal: when (s on the record's clock), from which level to which.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    pub time_s: f64,
    pub before: f64,
    pub after: f64,
}

impl Step {
    #[must_use]
    pub fn change(&self) -> f64 {
        self.after - self.before
    }
}

/// The steps of a record by signal, each in order of time, and the smallest change that counts as
/// one.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Steps {
    pub of: BTreeMap<String, Vec<Step>>,
    pub smallest: BTreeMap<String, f64>,
    /// The standard deviation of the signal's own changes, where turbulence has raised its smallest
    /// step; else 0.
    pub noise: BTreeMap<String, f64>,
}

impl Steps {
    /// The steps of a signal from one time to another.
    pub fn between(&self, signal: &str, from_s: f64, to_s: f64) -> &[Step] {
        let steps = self.of.get(signal).map_or(&[][..], Vec::as_slice);
        let first = steps.partition_point(|s| s.time_s < from_s);
        let end = steps.partition_point(|s| s.time_s <= to_s);
        steps.get(first..end.max(first)).unwrap_or_default()
    }
}

/// The steps of every signal that has a smallest step and is in the record, and the deflections:
/// those and all changes of at least the deflection's share of the smallest step. The smallest step
/// is the one set, or the noise of the signal's own changes times `steps_over_noise` where that is
/// larger: a surface that works in turbulence.
pub(super) fn of_record(record: &Record, settings: &Settings) -> (Steps, Steps) {
    let window = Window::of(record, settings);
    let (mut steps, mut deflections) = (Steps::default(), Steps::default());
    for (signal, set) in &settings.steps {
        let Some(values) = record.values(signal) else {
            continue;
        };
        let levels = levels(values, window.level);
        let noise = noise(&levels, window);
        let smallest = set.max(settings.steps_over_noise * noise);
        let raised = if smallest > *set { noise } else { 0.0 };
        for (kept, size) in [
            (&mut steps, smallest),
            (&mut deflections, settings.deflection_share * smallest),
        ] {
            let mut found = of_levels(&levels, size, window);
            for step in &mut found {
                step.time_s = record.start_s + step.time_s * record.step_s;
            }
            kept.of.insert(signal.clone(), found);
            kept.smallest.insert(signal.clone(), size);
            kept.noise.insert(signal.clone(), raised);
        }
    }
    (steps, deflections)
}

/// The largest change of a signal, between levels as those of a step, from one time to another; 0
/// where nothing is known.
pub(super) fn largest_change(
    record: &Record,
    signal: &str,
    settings: &Settings,
    (from_s, to_s): (f64, f64),
) -> f64 {
    let window = Window::of(record, settings);
    let reach = window.half_transit + window.level;
    let first = record.sample_at(from_s).saturating_sub(reach);
    let end = (record.sample_at(to_s) + reach).min(record.samples);
    let values = record
        .values(signal)
        .and_then(|v| v.get(first..end))
        .unwrap_or_default();
    changes(&levels(values, window.level), window)
        .map(|change| change.size())
        .fold(0.0, f64::max)
}

/// The standard deviation of changes that nobody commanded: from the median of all, of which steps
/// are few.
fn noise(levels: &[f64], window: Window) -> f64 {
    let mut sizes: Vec<f64> = changes(levels, window)
        .map(|change| change.size())
        .collect();
    if sizes.len() < 2 {
        return 0.0;
    }
    1.4826 * upper_median_in_place(&mut sizes).unwrap_or(0.0)
}

/// A time in whole samples, at least one.
fn samples(time_s: f64, step_s: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "rounded and at least one"
    )]
    let n = (time_s / step_s).round().max(1.0) as usize;
    n
}

/// The detector's windows in samples.
#[derive(Clone, Copy, Debug)]
struct Window {
    half_transit: usize,
    level: usize,
}

impl Window {
    fn of(record: &Record, settings: &Settings) -> Window {
        Window {
            half_transit: samples(settings.transit_s / 2.0, record.step_s),
            level: samples(settings.level_s, record.step_s),
        }
    }
}

/// The level before and the level after a time, in samples.
#[derive(Clone, Copy, Debug)]
struct Change {
    at: usize,
    before: f64,
    after: f64,
}

impl Change {
    fn size(&self) -> f64 {
        (self.after - self.before).abs()
    }
}

/// The changes between levels at each time at which both exist.
fn changes(levels: &[f64], window: Window) -> impl Iterator<Item = Change> {
    let reach = window.half_transit + window.level;
    let after = levels
        .get(reach + window.half_transit..)
        .unwrap_or_default();
    let change = move |(k, (before, after)): (usize, (&f64, &f64))| Change {
        at: k + reach,
        before: *before,
        after: *after,
    };
    levels
        .iter()
        .zip(after)
        .enumerate()
        .map(change)
        .filter(|change| change.size().is_finite())
}

/// The steps among the changes between levels, their times in samples (a step between samples 9 and
/// 10 is at 9.5).
fn of_levels(levels: &[f64], smallest: f64, window: Window) -> Vec<Step> {
    let reach = window.half_transit + window.level;
    let mut steps = Vec::new();
    let mut run: Vec<Change> = Vec::new();
    // Where a level is missing the run neither goes on nor ends, unless the gap is longer than a
    // step.
    for change in changes(levels, window) {
        let big = change.size() >= smallest;
        let goes_on = |last: &Change| {
            big && (change.after - change.before) * (last.after - last.before) > 0.0
                && change.at - last.at <= reach
        };
        if !run.last().is_none_or(goes_on) {
            steps.extend(peak(&run));
            run.clear();
        }
        if big {
            run.push(change);
        }
    }
    steps.extend(peak(&run));
    steps
}

/// The one step of a run: where the change is within 5% of its maximum, in the middle.
fn peak(run: &[Change]) -> Option<Step> {
    let (top, largest) = run
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.size().total_cmp(&b.1.size()))?;
    let near = |c: &&Change| c.size() >= 0.95 * largest.size();
    let first = run[..top]
        .iter()
        .rev()
        .take_while(near)
        .last()
        .unwrap_or(largest);
    let last = run[top..].iter().take_while(near).last().unwrap_or(largest);
    let between_samples = (first.at + last.at) as f64 / 2.0 - 0.5;
    Some(Step {
        time_s: between_samples,
        before: largest.before,
        after: largest.after,
    })
}

/// Levels that are averaged side by side, in the processor's vectors.
const SIDE: usize = 64;

/// The level that begins at each sample: the mean of its finite samples without the largest and the
/// smallest of them; NaN where fewer than half are finite.
fn levels(values: &[f64], length: usize) -> Vec<f64> {
    let mut levels = vec![f64::NAN; (values.len() + 1).saturating_sub(length)];
    let side_by_side = pulp::Arch::new();
    for (from, levels) in levels
        .chunks_mut(SIDE)
        .enumerate()
        .map(|(i, levels)| (i * SIDE, levels))
    {
        let samples = &values[from..from + levels.len() + length - 1];
        side_by_side.dispatch(|| level_each(samples, length, levels));
    }
    levels
}

#[expect(clippy::inline_always, reason = "compiled for each width of vectors")]
#[inline(always)]
fn level_each(samples: &[f64], length: usize, levels: &mut [f64]) {
    let (mut known, mut sum) = ([0.0; SIDE], [0.0; SIDE]);
    let (mut low, mut high) = ([f64::INFINITY; SIDE], [f64::NEG_INFINITY; SIDE]);
    for later in samples.windows(levels.len()).take(length) {
        let of_level = known
            .iter_mut()
            .zip(&mut sum)
            .zip(low.iter_mut().zip(&mut high));
        for (v, ((known, sum), (low, high))) in later.iter().zip(of_level) {
            let finite = v.is_finite();
            *known += if finite { 1.0 } else { 0.0 };
            *sum += if finite { *v } else { 0.0 };
            *low = if finite && *v < *low { *v } else { *low };
            *high = if finite && *v > *high { *v } else { *high };
        }
    }
    let of_level = known.iter().zip(&sum).zip(low.iter().zip(&high));
    for (level, ((known, sum), (low, high))) in levels.iter_mut().zip(of_level) {
        let inner = (sum - low - high) / (known - 2.0);
        let mean = if *known >= 4.0 { inner } else { sum / known };
        *level = if 2.0 * known < length as f64 {
            f64::NAN
        } else {
            mean
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    const WINDOW: Window = Window {
        half_transit: 3,
        level: 5,
    };

    fn steps(values: &[f64]) -> Vec<Step> {
        of_levels(&levels(values, WINDOW.level), 2.0, WINDOW)
    }

    /// A level that jumps at the given samples.
    fn jumping(n: usize, jumps: &[(usize, f64)]) -> Vec<f64> {
        (0..n)
            .map(|k| jumps.iter().filter(|j| k >= j.0).map(|j| j.1).sum())
            .collect()
    }

    #[test]
    fn a_step_has_its_time_and_levels_whatever_the_trim() {
        for trim in [-14.0, 0.0, 8.0] {
            let values: Vec<f64> = jumping(80, &[(40, 5.0)]).iter().map(|v| v + trim).collect();
            let found = steps(&values);
            assert_eq!(found.len(), 1);
            assert_abs_diff_eq!(found[0].time_s, 39.5, epsilon = 0.5);
            assert_abs_diff_eq!(found[0].before, trim, epsilon = 1e-12);
            assert_abs_diff_eq!(found[0].after, trim + 5.0, epsilon = 1e-12);
        }
    }

    #[test]
    fn the_edges_of_a_doublet_come_out_with_their_signs() {
        let found = steps(&jumping(120, &[(30, 4.0), (55, -8.0), (80, 4.0)]));
        let signs: Vec<f64> = found.iter().map(|s| s.change().signum()).collect();
        assert_eq!(signs, [1.0, -1.0, 1.0]);
        for (step, at) in found.iter().zip([29.5, 54.5, 79.5]) {
            assert_abs_diff_eq!(step.time_s, at, epsilon = 1.0);
        }
    }

    #[test]
    fn chatter_slow_motion_and_a_leftover_spike_are_no_steps() {
        let chatter: Vec<f64> = (0..200)
            .map(|k| if k % 2 == 0 { 1.5 } else { -1.5 })
            .collect();
        let slow: Vec<f64> = (0..200)
            .map(|k| 4.0 * (f64::from(k) / 40.0 * 1.5).sin())
            .collect();
        let mut spike = vec![0.0; 200];
        spike[100] = 30.0;
        for values in [chatter, slow, spike] {
            assert_eq!(steps(&values), []);
        }
    }

    #[test]
    fn a_level_is_the_mean_without_the_largest_and_the_smallest_of_what_is_known() {
        let mut values: Vec<f64> = (0..150).map(|k| f64::from(k * k % 17)).collect();
        for k in [3, 70, 71, 72, 100, 101] {
            values[k] = f64::NAN;
        }
        let found = levels(&values, 5);
        assert_eq!(found.len(), 146);
        for (k, level) in found.iter().enumerate() {
            let mut known: Vec<f64> = values[k..k + 5]
                .iter()
                .copied()
                .filter(|v| v.is_finite())
                .collect();
            known.sort_by(f64::total_cmp);
            let inner = if known.len() >= 4 {
                &known[1..known.len() - 1]
            } else {
                &known[..]
            };
            if known.len() < 3 {
                assert!(level.is_nan());
            } else {
                assert_abs_diff_eq!(
                    *level,
                    inner.iter().sum::<f64>() / inner.len() as f64,
                    epsilon = 1e-12
                );
            }
        }
    }

    #[test]
    fn missing_samples_hide_no_step_and_make_none() {
        let mut values = jumping(80, &[(40, 5.0)]);
        for k in [20, 21, 36, 39, 40, 44] {
            values[k] = f64::NAN;
        }
        assert_eq!(steps(&values).len(), 1);
        assert_eq!(steps(&[f64::NAN; 80]), []);
        assert_eq!(steps(&[]), []);
    }
}
