//! Steps of a signal: a change between two levels, averaged shortly before and shortly after it, that is beyond the
//! smallest step.
//!
//! At each time t the level before is averaged over [t − transit/2 − level, t − transit/2], the level after over
//! [t + transit/2, t + transit/2 + level]. A run of times at which their difference has one sign and exceeds the smallest
//! step is one step, at the middle of the run's near-maximum. What this sees and what it does not:
//! - the trim does not matter, only the change;
//! - smooth motion counts only where it is as fast as an actuator: it must cross the smallest step within
//!   transit + level;
//! - chatter from sample to sample averages out, so ordinary stick activity leaves no steps;
//! - a level leaves out its largest and smallest sample, so one spike that ingest did not find makes no step;
//! - NaN samples are skipped; a level of fewer than half its samples does not exist, and neither does a step there.

use std::collections::BTreeMap;

use crate::flight::Record;

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

/// The steps of a record by signal, each in order of time, and the smallest change that counts as one.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Steps {
    pub of: BTreeMap<String, Vec<Step>>,
    pub smallest: BTreeMap<String, f64>,
    /// The standard deviation of the signal's own changes, where turbulence has raised its smallest step; else 0.
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

/// The steps of every signal that has a smallest step and is in the record, and the deflections: those and all changes of
/// at least the deflection's share of the smallest step. The smallest step is the one set, or the noise of the signal's own
/// changes times `steps_over_noise` where that is larger: a surface that works in turbulence.
pub(super) fn of_record(record: &Record, settings: &Settings) -> (Steps, Steps) {
    let window = Window::of(record, settings);
    let (mut steps, mut deflections) = (Steps::default(), Steps::default());
    for (signal, set) in &settings.steps {
        let Some(values) = record.values(signal) else { continue };
        let changes = changes(values, window);
        let noise = noise(&changes);
        let smallest = set.max(settings.steps_over_noise * noise);
        let raised = if smallest > *set { noise } else { 0.0 };
        for (kept, size) in [(&mut steps, smallest), (&mut deflections, settings.deflection_share * smallest)] {
            let mut found = of_changes(&changes, size, window);
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

/// The largest change of a signal, between levels as those of a step, from one time to another; 0 where nothing is known.
pub(super) fn largest_change(record: &Record, signal: &str, settings: &Settings, (from_s, to_s): (f64, f64)) -> f64 {
    let window = Window::of(record, settings);
    let reach = window.half_transit + window.level;
    let first = record.sample_at(from_s).saturating_sub(reach);
    let end = (record.sample_at(to_s) + reach).min(record.samples);
    let values = record.values(signal).and_then(|v| v.get(first..end)).unwrap_or_default();
    let sizes = changes(values, window).into_iter().flatten().map(|(before, after)| (after - before).abs());
    sizes.fold(0.0, f64::max)
}

/// The standard deviation of changes that nobody commanded: from the median of all, of which steps are few.
fn noise(changes: &[Option<(f64, f64)>]) -> f64 {
    let mut sizes: Vec<f64> = changes.iter().flatten().map(|(before, after)| (after - before).abs()).collect();
    let middle = sizes.len() / 2;
    if middle == 0 {
        return 0.0;
    }
    // Of the normal distribution: standard deviation over median of the magnitude.
    1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// A time in whole samples, at least one.
fn samples(time_s: f64, step_s: f64) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded and at least one")]
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

/// The levels before and after each time, in samples; none where one of them does not exist.
fn changes(values: &[f64], window: Window) -> Vec<Option<(f64, f64)>> {
    let levels: Vec<Option<f64>> = values.windows(window.level).map(level).collect();
    let reach = window.half_transit + window.level;
    let at = |k: usize| -> Option<(f64, f64)> {
        let before = levels.get(k.checked_sub(reach)?)?;
        let after = levels.get(k + window.half_transit)?;
        (*before).zip(*after)
    };
    (0..=values.len()).map(at).collect()
}

/// The steps among a signal's changes, their times in samples (a step between samples 9 and 10 is at 9.5).
fn of_changes(changes: &[Option<(f64, f64)>], smallest: f64, window: Window) -> Vec<Step> {
    let reach = window.half_transit + window.level;
    let mut steps = Vec::new();
    let mut run: Vec<(usize, f64, f64)> = Vec::new();
    for (k, change) in changes.iter().enumerate() {
        // Where a level is missing the run neither goes on nor ends, unless the gap is longer than a step.
        let Some((before, after)) = *change else { continue };
        let big = (after - before).abs() >= smallest;
        let goes_on =
            |last: &(usize, f64, f64)| big && (after - before) * (last.2 - last.1) > 0.0 && k - last.0 <= reach;
        if !run.last().is_some_and(goes_on) {
            steps.extend(peak(&run));
            run.clear();
        }
        if big {
            run.push((k, before, after));
        }
    }
    steps.extend(peak(&run));
    steps
}

/// The one step of a run: where the change is within 5% of its maximum, in the middle.
fn peak(run: &[(usize, f64, f64)]) -> Option<Step> {
    let size = |(_, before, after): &(usize, f64, f64)| (after - before).abs();
    let (top, largest) = run.iter().enumerate().max_by(|a, b| size(a.1).total_cmp(&size(b.1)))?;
    let near = |c: &&(usize, f64, f64)| size(c) >= 0.95 * size(largest);
    let first = run[..top].iter().rev().take_while(near).last().unwrap_or(largest);
    let last = run[top..].iter().take_while(near).last().unwrap_or(largest);
    let between_samples = (first.0 + last.0) as f64 / 2.0 - 0.5;
    Some(Step { time_s: between_samples, before: largest.1, after: largest.2 })
}

/// The mean of a level's finite samples without the largest and the smallest of them.
fn level(values: &[f64]) -> Option<f64> {
    let finite = values.iter().copied().filter(|v| v.is_finite());
    let (mut n, mut sum, mut low, mut high) = (0_usize, 0.0, f64::INFINITY, f64::NEG_INFINITY);
    for v in finite {
        n += 1;
        sum += v;
        low = low.min(v);
        high = high.max(v);
    }
    if n == 0 || 2 * n < values.len() {
        None
    } else if n >= 4 {
        Some((sum - low - high) / (n - 2) as f64)
    } else {
        Some(sum / n as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    const WINDOW: Window = Window { half_transit: 3, level: 5 };

    fn steps(values: &[f64]) -> Vec<Step> {
        of_changes(&changes(values, WINDOW), 2.0, WINDOW)
    }

    /// A level that jumps at the given samples.
    fn levels(n: usize, jumps: &[(usize, f64)]) -> Vec<f64> {
        (0..n).map(|k| jumps.iter().filter(|j| k >= j.0).map(|j| j.1).sum()).collect()
    }

    #[test]
    fn a_step_has_its_time_and_levels_whatever_the_trim() {
        for trim in [-14.0, 0.0, 8.0] {
            let values: Vec<f64> = levels(80, &[(40, 5.0)]).iter().map(|v| v + trim).collect();
            let found = steps(&values);
            assert_eq!(found.len(), 1);
            assert_abs_diff_eq!(found[0].time_s, 39.5, epsilon = 0.5);
            assert_abs_diff_eq!(found[0].before, trim, epsilon = 1e-12);
            assert_abs_diff_eq!(found[0].after, trim + 5.0, epsilon = 1e-12);
        }
    }

    #[test]
    fn the_edges_of_a_doublet_come_out_with_their_signs() {
        let found = steps(&levels(120, &[(30, 4.0), (55, -8.0), (80, 4.0)]));
        let signs: Vec<f64> = found.iter().map(|s| s.change().signum()).collect();
        assert_eq!(signs, [1.0, -1.0, 1.0]);
        for (step, at) in found.iter().zip([29.5, 54.5, 79.5]) {
            assert_abs_diff_eq!(step.time_s, at, epsilon = 1.0);
        }
    }

    #[test]
    fn chatter_slow_motion_and_a_leftover_spike_are_no_steps() {
        let chatter: Vec<f64> = (0..200).map(|k| if k % 2 == 0 { 1.5 } else { -1.5 }).collect();
        let slow: Vec<f64> = (0..200).map(|k| 4.0 * (f64::from(k) / 40.0 * 1.5).sin()).collect();
        let mut spike = vec![0.0; 200];
        spike[100] = 30.0;
        for values in [chatter, slow, spike] {
            assert_eq!(steps(&values), []);
        }
    }

    #[test]
    fn missing_samples_hide_no_step_and_make_none() {
        let mut values = levels(80, &[(40, 5.0)]);
        for k in [20, 21, 36, 39, 40, 44] {
            values[k] = f64::NAN;
        }
        assert_eq!(steps(&values).len(), 1);
        assert_eq!(steps(&[f64::NAN; 80]), []);
        assert_eq!(steps(&[]), []);
    }
}
