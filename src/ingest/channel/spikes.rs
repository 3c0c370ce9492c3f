//! Single-sample spikes: a sample that stands off its neighbours by far more than the noise, while
//! the samples before it and those after it agree about what should be there.
//!
//! With `x` the sample, the line through the two samples before it says `2 x₋₁ − x₋₂`, the line
//! through the two after it `2 x₊₁ − x₊₂`, and the neighbours' mean `(x₋₁ + x₊₁)/2`. A spike stands
//! off all three in the same sense. A step, the reversal of a surface at its full rate, or a stick
//! pulse of two samples stands off at most two of them.

use std::ops::Range;

use crate::ingest::sample_count::whole_steps;
use crate::ingest::settings::Spikes;

/// Standard deviations of a normal distribution in its median absolute deviation.
const MAD: f64 = 1.482_602_218_505_602;

/// Variance of a sample minus its neighbours' mean, in variances of the noise: 1 + 1/4 + 1/4.
const MEAN_VARIANCE: f64 = 1.5;

/// Relative differences below this are the arithmetic's.
const EXACT: f64 = 1e-12;

/// Fewer samples off their neighbours' mean than this do not tell the quantisation.
const FEW_STEPS: usize = 20;

/// The share of its height off the mean that a spike must stand off each line: the lines are twice
/// as noisy as the mean.
const LINES: f64 = 0.75;

/// How far the two lines may miss each other by noise alone, in its standard deviations (the
/// difference has √10).
const LINES_NOISE: f64 = 3.0;

/// Every so many samples are enough to tell the noise of thousands.
const EVERY: usize = 4;

/// What a spike is measured against, and the noise's standard deviation alone.
pub fn floors(values: &[f64]) -> (f64, f64) {
    let mut roughness: Vec<f64> = (1..values.len())
        .step_by(EVERY)
        .map(|k| off_mean(values, k).abs())
        .filter(|r| r.is_finite())
        .collect();
    if roughness.is_empty() {
        return (0.0, f64::NAN);
    }
    let noise = MAD / MEAN_VARIANCE.sqrt() * quantile(&mut roughness, 0.5);
    (noise.max(rounding(values, roughness)), noise)
}

/// Replaces single-sample spikes by their neighbours' mean and returns where they were. `floors`
/// says for ranges of samples what a spike is measured against.
pub fn remove(
    values: &mut [f64],
    step_s: f64,
    floors: &[(Range<usize>, f64)],
    settings: &Spikes,
) -> Vec<usize> {
    if !settings.remove {
        return Vec::new();
    }
    let window = whole_steps(settings.window_s, step_s).max(4);
    let mut spikes = Vec::new();
    for (range, floor) in floors {
        let (from, to) = (
            range.start.max(1),
            range.end.min(values.len().saturating_sub(1)),
        );
        let around = values.get(from.saturating_sub(1)..=to).unwrap_or_default();
        for (k, three) in around
            .windows(3)
            .enumerate()
            .map(|(i, three)| (from + i, three))
        {
            let off_mean = (three[1] - 0.5 * (three[0] + three[2])).abs();
            // Also false beside a gap.
            if off_mean > settings.deviations * floor
                && stands_off(values, k, *floor, window, settings)
            {
                spikes.push(k);
            }
        }
    }
    let repaired: Vec<f64> = spikes
        .iter()
        .map(|&k| values[k] - off_mean(values, k))
        .collect();
    for (&k, value) in spikes.iter().zip(repaired) {
        values[k] = value;
    }
    spikes
}

/// Whether a sample that stands off the floor stands off its neighbours as nothing but a spike
/// does.
fn stands_off(values: &[f64], k: usize, floor: f64, window: usize, settings: &Spikes) -> bool {
    let Some(height) = height(values, k) else {
        return false;
    };
    let stands_off = |noise: f64| {
        height.off_mean > settings.deviations * noise
            && height.off_lines > LINES * settings.deviations * noise
    };
    let lines_meet = |noise: f64| {
        height.lines_miss <= settings.agreement * height.off_mean + LINES_NOISE * noise
    };
    // The noise around a sample takes long to find; of most samples the least and the largest that
    // it could be tell enough.
    if !stands_off(floor) || !lines_meet(height.off_mean / settings.deviations) {
        return false;
    }
    let noise = floor.max(local(values, k, window));
    stands_off(noise) && lines_meet(noise)
}

/// A sample minus the mean of its neighbours; NaN at the ends and beside a gap.
fn off_mean(values: &[f64], k: usize) -> f64 {
    match (
        k.checked_sub(1).and_then(|i| values.get(i)),
        values.get(k),
        values.get(k + 1),
    ) {
        (Some(before), Some(x), Some(after)) => x - 0.5 * (before + after),
        _ => f64::NAN,
    }
}

struct Height {
    /// How far the sample stands off the neighbours' mean.
    off_mean: f64,
    /// The lesser of how far it stands off the two lines, in the sense that it stands off the mean.
    off_lines: f64,
    /// How far the two lines miss each other.
    lines_miss: f64,
}

/// How a sample stands off; none beside a gap. Where only one sample is left on a side, its line is
/// level.
fn height(values: &[f64], k: usize) -> Option<Height> {
    let at = |i: Option<usize>| {
        i.and_then(|i| values.get(i))
            .copied()
            .filter(|v| v.is_finite())
    };
    let (x, before, after) = (at(Some(k))?, at(k.checked_sub(1))?, at(Some(k + 1))?);
    let left = 2.0 * before - at(k.checked_sub(2)).unwrap_or(before);
    let right = 2.0 * after - at(Some(k + 2)).unwrap_or(after);
    let off_mean = x - 0.5 * (before + after);
    let off_lines = ((x - left) * off_mean.signum()).min((x - right) * off_mean.signum());
    Some(Height {
        off_mean: off_mean.abs(),
        off_lines,
        lines_miss: (left - right).abs(),
    })
}

/// The noise around a sample: the sample itself and its neighbours, which a spike spoils, are left
/// out.
fn local(values: &[f64], k: usize, window: usize) -> f64 {
    let around = k.saturating_sub(window)..(k + window + 1).min(values.len());
    let mut roughness: Vec<f64> = around
        .filter(|i| i.abs_diff(k) > 1)
        .map(|i| off_mean(values, i).abs())
        .filter(|r| r.is_finite())
        .collect();
    MAD / MEAN_VARIANCE.sqrt() * quantile(&mut roughness, 0.5)
}

/// What rounding alone puts a sample off its neighbours' mean: half the recorder's quantisation
/// step, the least that is not nothing. A low quantile, as a repaired or converted sample may lie
/// off the grid; a channel that hardly ever changes has too few of them to say.
fn rounding(values: &[f64], mut roughness: Vec<f64>) -> f64 {
    let largest = values
        .iter()
        .step_by(EVERY)
        .map(|v| v.abs())
        .fold(0.0, f64::max);
    roughness.retain(|r| *r > EXACT * largest);
    if roughness.len() < FEW_STEPS {
        0.0
    } else {
        quantile(&mut roughness, 0.05)
    }
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of the length"
    )]
    let rank = ((values.len() - 1) as f64 * share) as usize;
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn despike(values: &mut [f64]) -> Vec<usize> {
        let floor = floors(values).0;
        let all = 0..values.len();
        remove(values, 0.025, &[(all, floor)], &Spikes::default())
    }

    fn spikes(values: &[f64]) -> Vec<usize> {
        despike(&mut values.to_vec())
    }

    /// Noise of a standard deviation near one, the same on every run.
    fn noise(k: usize) -> f64 {
        let mut state = (k as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x1234_5678;
        let mut sum = 0.0;
        for _ in 0..12 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (state >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum - 6.0
    }

    fn noisy(samples: usize, sd: f64, signal: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..samples)
            .map(|k| signal(k as f64 * 0.025) + sd * noise(k))
            .collect()
    }

    #[test]
    fn a_spike_is_replaced_by_its_neighbours_mean() {
        let mut values = noisy(400, 0.02, f64::sin);
        let clean = values.clone();
        values[200] += 0.6;
        assert_eq!(despike(&mut values), [200]);
        assert!((values[200] - 0.5 * (clean[199] + clean[201])).abs() < 1e-12);
        assert_eq!(values[201..], clean[201..]);
    }

    #[test]
    fn noise_alone_makes_no_spike() {
        assert!(spikes(&noisy(100_000, 0.08, |t| 10.0 + 3.0 * (0.7 * t).sin())).is_empty());
    }

    #[test]
    fn a_spike_on_a_fast_roll_is_found() {
        let mut values = noisy(400, 0.04, |t| 30.0 * t);
        values[150] -= 1.6;
        assert_eq!(spikes(&values), [150]);
    }

    #[test]
    fn a_surface_doublet_at_its_full_rate_is_left_alone() {
        let doublet = |t: f64| match t {
            t if t < 2.0 => 0.0,
            t if t < 2.1 => 100.0 * (t - 2.0),
            t if t < 2.3 => 10.0 - 100.0 * (t - 2.1),
            t if t < 2.4 => -10.0 + 100.0 * (t - 2.3),
            _ => 0.0,
        };
        assert!(spikes(&noisy(400, 0.02, doublet)).is_empty());
        // The shortest triangle that a rate limit allows: up for two samples, down for two.
        let triangle = |t: f64| (5.0 - 100.0 * (t - 2.0).abs()).max(0.0);
        assert!(spikes(&noisy(400, 0.02, triangle)).is_empty());
    }

    #[test]
    fn steps_and_two_sample_pulses_of_the_stick_are_left_alone() {
        let step = |t: f64| if t < 3.0 { 0.0 } else { 2.0 };
        let pulse = |t: f64| if (3.0..3.04).contains(&t) { 2.0 } else { 0.0 };
        let overshoot = |t: f64| match t {
            t if t < 2.99 => 0.0,
            t if t < 3.01 => 1.0,
            _ => 0.5,
        };
        for signal in [step, pulse, overshoot] {
            assert!(spikes(&noisy(400, 0.0, signal)).is_empty());
            assert!(spikes(&noisy(400, 0.005, signal)).is_empty());
        }
    }

    #[test]
    fn a_vibration_is_its_own_noise() {
        let vibration = |t: f64| {
            if (4.0..6.0).contains(&t) {
                (97.0 * t).sin()
            } else {
                0.0
            }
        };
        assert!(spikes(&noisy(400, 0.01, vibration)).is_empty());
    }

    #[test]
    fn the_last_bit_of_a_coarse_converter_is_no_spike() {
        let mut values = vec![1.0; 400];
        values[100] = 1.1;
        values[300] = 1.2;
        values.extend((0..400).map(|k| if k % 7 == 0 { 1.1 } else { 1.0 }));
        assert!(spikes(&values).is_empty());
    }

    #[test]
    fn samples_beside_a_gap_are_left_alone_and_nothing_breaks_at_the_ends() {
        let mut values = noisy(100, 0.01, |_| 0.0);
        (values[0], values[50], values[51], values[99]) = (5.0, f64::NAN, 5.0, 5.0);
        assert!(spikes(&values).is_empty());
        for short in 0..4 {
            assert!(spikes(&vec![1.0; short]).is_empty());
        }
    }
}
