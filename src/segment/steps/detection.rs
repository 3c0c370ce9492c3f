//! Detection of steps: a step is a fast, lasting change between two levels of a signal.
//!
//! At each time t the level before is the mean over [t − transit/2 − level, t − transit/2]. The
//! level after is the mean over [t + transit/2, t + transit/2 + level]. A run of times at which
//! their difference keeps its sign and exceeds the smallest step is one step. Its time is the
//! middle of the run's near-maximum.
//!
//! - The trim has no influence, only the change has.
//! - Smooth motion counts where it is as fast as an actuator: it must cross the smallest step within
//!   transit + level.
//! - Chatter from sample to sample averages out, so ordinary stick activity leaves no steps.
//! - A level leaves out its largest and smallest sample, so a spike that ingest missed makes no step.
//! - NaN samples are skipped. A level of fewer than half its samples does not exist, and neither does
//!   a step there.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use super::step::{SignalSteps, Step, Steps};
use crate::flight::Record;
use crate::numerics::series::differences::white_noise;
use crate::numerics::statistics::order_statistics::{
    SIGMA_PER_MAD, finite_magnitudes, lower_quantile_of_magnitudes, upper_median_of_magnitudes,
};
use crate::numerics::vectors::simd::vectorised;
use crate::segment::settings::Settings;

/// Share of a recording that is the maneuver in which its inputs rest.
const QUIET_SHARE: f64 = 0.1;

/// Quantile of the size of normal noise at [`QUIET_SHARE`], in standard deviations.
const QUIET_DEVIATIONS: f64 = 0.125_661;

/// Share of a run's largest change above which its changes form the near-maximum. On the flat top
/// of a step, slope and noise stay within 5 %; a lower share would shift the middle of a skewed
/// step.
const NEAR_MAXIMUM: f64 = 0.95;

/// Detects the steps and the deflections of every signal that has a smallest step.
///
/// The smallest step is the one in the settings, or `steps_over_noise` times the noise of the
/// signal's changes if that is larger. Feedback moves a surface in turbulence. In a recording that
/// is a single maneuver it is limited to the share of the largest change below which steps count as
/// feedback. Deflections are all changes of at least `deflection_share` of the smallest step; every
/// step is one.
pub(in crate::segment) fn detect(record: &Record, settings: &Settings) -> (Steps, Steps) {
    let lengths = DetectorLengths::new(record, settings);
    let (mut steps, mut deflections) = (Steps::default(), Steps::default());
    // Memory of one signal that serves the next.
    let (mut levels, mut sizes) = (Vec::new(), Vec::new());
    for (signal, set) in &settings.steps {
        let Some(values) = record.values(signal) else {
            continue;
        };
        set_levels(&mut levels, values, lengths.level);
        let own_noise = noise(&levels, lengths, is_maneuver_alone(record), &mut sizes);
        let mut over_noise = settings.steps_over_noise * own_noise;
        if is_maneuver_alone(record) {
            over_noise = over_noise.min(settings.outstanding_share * largest(&levels, lengths));
        }
        let smallest = set.max(over_noise);
        let noise = if smallest > *set { own_noise } else { 0.0 };
        let larger_than = |smallest: f64| SignalSteps {
            steps: on_record_clock(steps_of_levels(&levels, smallest, lengths), record),
            smallest,
            noise,
        };
        let smallest_deflection = settings.deflection_share * smallest;
        steps
            .by_signal
            .insert(signal.clone(), larger_than(smallest));
        deflections
            .by_signal
            .insert(signal.clone(), larger_than(smallest_deflection));
    }
    (steps, deflections)
}

/// Converts the times of steps from samples to s on the record's clock.
fn on_record_clock(mut steps: Vec<Step>, record: &Record) -> Vec<Step> {
    for step in &mut steps {
        step.time_s = record.start_s + step.time_s * record.step_s;
    }
    steps
}

/// Largest change between levels of a signal from one time to another; 0 without samples.
pub(in crate::segment) fn largest_change(
    record: &Record,
    signal: &str,
    settings: &Settings,
    (from_s, to_s): (f64, f64),
) -> f64 {
    let lengths = DetectorLengths::new(record, settings);
    let first = record.sample_at(from_s).saturating_sub(lengths.reach());
    let end = (record.sample_at(to_s) + lengths.reach()).min(record.samples);
    let values = record
        .values(signal)
        .and_then(|v| v.get(first..end))
        .unwrap_or_default();
    let mut levels = Vec::new();
    set_levels(&mut levels, values, lengths.level);
    largest(&levels, lengths)
}

/// Standard deviation of the changes between levels that white noise of a signal causes. `None`
/// without samples.
pub(in crate::segment) fn level_noise(
    record: &Record,
    signal: &str,
    settings: &Settings,
) -> Option<f64> {
    let noise = white_noise(record.values(signal)?)?;
    let length = DetectorLengths::new(record, settings).level as f64;
    Some(noise * (2.0 / length).sqrt())
}

/// Standard deviation of uncommanded changes. Steps are few, so it follows from the median size of
/// all changes. In a recording that is a single maneuver they are not few; there it follows from
/// the rests between the inputs. `sizes` becomes the bits of the changes' sizes.
fn noise(
    levels: &[f64],
    lengths: DetectorLengths,
    is_maneuver_alone: bool,
    sizes: &mut Vec<u64>,
) -> f64 {
    sizes.clear();
    sizes.extend(all_sizes(levels, lengths).map(f64::to_bits));
    if finite_magnitudes(sizes) < 2 {
        return 0.0;
    }
    let of_all = SIGMA_PER_MAD * upper_median_of_magnitudes(sizes).unwrap_or(0.0);
    if !is_maneuver_alone {
        return of_all;
    }
    let quiet = lower_quantile_of_magnitudes(sizes, QUIET_SHARE).unwrap_or(0.0);
    of_all.min(quiet / QUIET_DEVIATIONS)
}

/// Largest change of a signal.
fn largest(levels: &[f64], lengths: DetectorLengths) -> f64 {
    let finite = all_sizes(levels, lengths).filter(|size| size.is_finite());
    finite.fold(0.0, f64::max)
}

/// Longest recording that may be one maneuver alone, s: the longest maneuvers take 40 s with their
/// decay.
const MANEUVER_ALONE_S: f64 = 45.0;

/// `true` for a recording that may hold one maneuver and little else.
pub(in crate::segment) fn is_maneuver_alone(record: &Record) -> bool {
    record.samples as f64 * record.step_s <= MANEUVER_ALONE_S
}

/// Converts a time to whole samples, at least one.
fn samples(time_s: f64, step_s: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "rounded and at least one"
    )]
    let n = (time_s / step_s).round().max(1.0) as usize;
    n
}

/// Lengths of the detector: half the transit between two levels, and a level, in samples.
#[derive(Clone, Copy, Debug)]
struct DetectorLengths {
    half_transit: usize,
    level: usize,
}

impl DetectorLengths {
    fn new(record: &Record, settings: &Settings) -> DetectorLengths {
        DetectorLengths {
            half_transit: samples(settings.transit_s / 2.0, record.step_s),
            level: samples(settings.level_s, record.step_s),
        }
    }

    /// Samples on one side of a time that the detector looks at.
    fn reach(self) -> usize {
        self.half_transit + self.level
    }
}

/// The levels before and after a time, in samples.
#[derive(Clone, Copy, Debug)]
struct LevelChange {
    at: usize,
    before: f64,
    after: f64,
}

impl LevelChange {
    fn signed(&self) -> f64 {
        self.after - self.before
    }

    fn size(&self) -> f64 {
        self.signed().abs()
    }
}

/// The levels before and after each time at which the detector looks, from [`DetectorLengths::reach`] on.
fn level_pairs(levels: &[f64], lengths: DetectorLengths) -> (&[f64], &[f64]) {
    let apart = lengths.reach() + lengths.half_transit;
    let after = levels.get(apart..).unwrap_or_default();
    (&levels[..after.len()], after)
}

/// Sizes of the changes between levels; not finite where a level does not exist.
fn all_sizes(levels: &[f64], lengths: DetectorLengths) -> impl Iterator<Item = f64> {
    let (before, after) = level_pairs(levels, lengths);
    let changes = before.iter().zip(after);
    changes.map(|(before, after)| (after - before).abs())
}

/// The finite changes between levels of at least the smallest size.
fn large_changes(
    levels: &[f64],
    smallest: f64,
    lengths: DetectorLengths,
) -> impl Iterator<Item = LevelChange> {
    let (before, after) = level_pairs(levels, lengths);
    let is_large = move |before: f64, after: f64| {
        let size = (after - before).abs();
        (size >= smallest) & size.is_finite()
    };
    let parts = before
        .chunks(LOOKED_AT_ONCE)
        .zip(after.chunks(LOOKED_AT_ONCE));
    // Few parts contain one. Without an early exit, for the vectors.
    let with_large = parts.enumerate().filter(move |(_, (before, after))| {
        let changes = before.iter().zip(*after);
        vectorised(
            #[inline(always)]
            || {
                let changes = changes.clone();
                changes.fold(false, |any, (b, a)| any | is_large(*b, *a))
            },
        )
    });
    with_large.flat_map(move |(part, (before, after))| {
        let first = part * LOOKED_AT_ONCE + lengths.reach();
        let changes = before.iter().zip(after).enumerate();
        let large = changes.filter(move |(_, (before, after))| is_large(**before, **after));
        large.map(move |(k, (before, after))| LevelChange {
            at: first + k,
            before: *before,
            after: *after,
        })
    })
}

/// Finds the steps among the changes between levels, times in samples: a step between samples 9
/// and 10 is at 9.5.
///
/// Steps of a signal's levels. A missing level neither continues nor ends a run, unless the gap is
/// longer than a step.
fn steps_of_levels(levels: &[f64], smallest: f64, lengths: DetectorLengths) -> Vec<Step> {
    let mut steps = Vec::new();
    let mut run: Vec<LevelChange> = Vec::new();
    let (before, after) = level_pairs(levels, lengths);
    let is_known = |at: usize| {
        let place = at - lengths.reach();
        (after[place] - before[place]).is_finite()
    };
    for change in large_changes(levels, smallest, lengths) {
        let continues = |last: &LevelChange| {
            change.signed() * last.signed() > 0.0
                && change.at - last.at <= lengths.reach()
                && !(last.at + 1..change.at).any(is_known)
        };
        if !run.last().is_none_or(continues) {
            steps.extend(step_of_run(&run));
            run.clear();
        }
        run.push(change);
    }
    steps.extend(step_of_run(&run));
    steps
}

/// The step of a run, at the middle of its near-maximum.
fn step_of_run(run: &[LevelChange]) -> Option<Step> {
    let (top, largest) = run
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.size().total_cmp(&b.1.size()))?;
    let is_near = |c: &&LevelChange| c.size() >= NEAR_MAXIMUM * largest.size();
    let first = run[..top]
        .iter()
        .rev()
        .take_while(is_near)
        .last()
        .unwrap_or(largest);
    let last = run[top..]
        .iter()
        .take_while(is_near)
        .last()
        .unwrap_or(largest);
    let between_samples = (first.at + last.at) as f64 / 2.0 - 0.5;
    Some(Step {
        time_s: between_samples,
        before: largest.before,
        after: largest.after,
    })
}

/// Number of levels averaged side by side: a multiple of every vector width, and few enough for the registers.
const SIDE: usize = 8;

/// Changes that are looked at together for a large one.
const LOOKED_AT_ONCE: usize = 64;

/// Least number of finite samples of a level that leaves out its largest and smallest: two remain.
const FEWEST_TO_TRIM: f64 = 4.0;

/// Sets the level that begins at each sample: the mean of its finite samples without the largest and the
/// smallest. NaN if fewer than half are finite.
fn set_levels(levels: &mut Vec<f64>, values: &[f64], length: usize) {
    let count = (values.len() + 1).saturating_sub(length);
    levels.clear();
    levels.reserve(count + SIDE);
    // Samples of the last levels, and missing ones up to a full side.
    let mut last = values[count / SIDE * SIDE..].to_vec();
    last.resize(SIDE + length - 1, f64::NAN);
    vectorised(
        #[inline(always)]
        || {
            let side_by_side = values.windows(SIDE + length - 1).step_by(SIDE);
            for samples in side_by_side.take(count / SIDE).chain([&last[..]]) {
                levels.extend_from_slice(&average_levels(samples, length));
            }
        },
    );
    levels.truncate(count);
}

#[inline(always)]
fn average_levels(samples: &[f64], length: usize) -> [f64; SIDE] {
    let (mut known, mut sum) = ([0.0; SIDE], [0.0; SIDE]);
    let (mut low, mut high) = ([f64::INFINITY; SIDE], [f64::NEG_INFINITY; SIDE]);
    let later = samples.windows(SIDE).take(length);
    for later in later.filter_map(|part| part.first_chunk::<SIDE>()) {
        let of_level = known
            .iter_mut()
            .zip(&mut sum)
            .zip(low.iter_mut().zip(&mut high));
        for (v, ((known, sum), (low, high))) in later.iter().zip(of_level) {
            let finite = v.is_finite();
            let or = |missing: f64| if finite { *v } else { missing };
            *known += if finite { 1.0 } else { 0.0 };
            *sum += or(0.0);
            let (smaller, larger) = (or(f64::INFINITY), or(f64::NEG_INFINITY));
            *low = if smaller < *low { smaller } else { *low };
            *high = if larger > *high { larger } else { *high };
        }
    }
    let of_level = known.iter().zip(&sum).zip(low.iter().zip(&high));
    let mut levels = [f64::NAN; SIDE];
    for (level, ((known, sum), (low, high))) in levels.iter_mut().zip(of_level) {
        let inner = (sum - low - high) / (known - 2.0);
        let mean = if *known >= FEWEST_TO_TRIM {
            inner
        } else {
            sum / known
        };
        *level = if 2.0 * known < length as f64 {
            f64::NAN
        } else {
            mean
        };
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    const LENGTHS: DetectorLengths = DetectorLengths {
        half_transit: 3,
        level: 5,
    };

    fn levels(values: &[f64], length: usize) -> Vec<f64> {
        let mut levels = Vec::new();
        set_levels(&mut levels, values, length);
        levels
    }

    fn steps(values: &[f64]) -> Vec<Step> {
        steps_of_levels(&levels(values, LENGTHS.level), 2.0, LENGTHS)
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
    fn steps_to_one_side_are_distinct_where_the_signal_rests_between_them() {
        // The large changes of the two are five samples apart, less than the detector's reach.
        for first in [30, 60, 64, 90] {
            let found = steps(&jumping(160, &[(first, 4.0), (first + 15, 4.0)]));
            assert_eq!(found.len(), 2, "{first}");
            for (step, at) in found.iter().zip([first, first + 15]) {
                assert_abs_diff_eq!(step.time_s, at as f64 - 0.5, epsilon = 1.0);
            }
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

    /// Record of a surface at 40 Hz with the settings for steps of 2.
    fn record_of(values: Vec<f64>) -> (Record, Settings) {
        let series = crate::flight::record::Series {
            marks: vec![crate::flight::Mark::Measured; values.len()],
            values,
        };
        let record = Record {
            flight_id: "f".to_owned(),
            start_s: 0.0,
            step_s: 0.025,
            samples: series.values.len(),
            signals: [("de_deg".to_owned(), series)].into(),
            remaining_errors: [].into(),
        };
        let settings = Settings {
            steps: [("de_deg".to_owned(), 2.0)].into(),
            ..Settings::default()
        };
        (record, settings)
    }

    #[test]
    fn the_noise_of_a_maneuver_alone_is_not_taken_from_its_inputs() {
        // Pulses of 9 all the way, an edge every 0.6 s.
        let mut value = 0.0;
        let pulses: Vec<f64> = (0..800)
            .map(|k| {
                let target = if k / 24 % 2 == 0 { 9.0 } else { -9.0 };
                value += 0.3 * (target - value);
                value
            })
            .collect();
        let (record, settings) = record_of(pulses.clone());
        let (steps, _) = detect(&record, &settings);
        assert!(steps.smallest("de_deg") < 7.0);
        assert!((30..=33).contains(&steps.of("de_deg").len()));
        // The same in a flight of three minutes of it: the median is the inputs', and hides them.
        let long: Vec<f64> = pulses.iter().cycle().take(7200).copied().collect();
        let (record, settings) = record_of(long);
        let (steps, _) = detect(&record, &settings);
        assert!(steps.smallest("de_deg") > 8.0);
    }

    #[test]
    fn noise_alone_is_the_same_by_its_quiet_tenth_as_by_its_median() {
        let mut random = crate::numerics::statistics::random::RandomStream::new(5, "levels");
        let levels: Vec<f64> = (0..20_000).map(|_| random.normal()).collect();
        let [median, quiet] =
            [false, true].map(|alone| noise(&levels, LENGTHS, alone, &mut vec![]));
        // Differences of white levels: √2 of their deviation.
        assert_abs_diff_eq!(median, 2.0_f64.sqrt(), epsilon = 0.05);
        assert_abs_diff_eq!(quiet, median, epsilon = 0.08);
    }

    #[test]
    fn the_noise_of_levels_is_that_of_white_samples_whatever_the_motion() {
        let mut random = crate::numerics::statistics::random::RandomStream::new(9, "samples");
        let values: Vec<f64> = (0..20_000)
            .map(|k| 0.3 * random.normal() + 5.0 * (f64::from(k) / 60.0).sin())
            .collect();
        let (record, settings) = record_of(values);
        let noise = level_noise(&record, "de_deg", &settings).unwrap();
        // Means of five samples, and their difference.
        assert_abs_diff_eq!(noise, 0.3 * (2.0_f64 / 5.0).sqrt(), epsilon = 0.005);
        let (still, settings) = record_of(vec![1.0; 100]);
        assert_eq!(level_noise(&still, "de_deg", &settings), Some(0.0));
        assert_eq!(level_noise(&still, "dr_deg", &settings), None);
    }

    #[test]
    fn a_level_is_the_mean_of_finite_samples_without_the_largest_and_the_smallest() {
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
