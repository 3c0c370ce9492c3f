//! Single-sample spikes: a sample far off its neighbours, relative to the noise, although the
//! samples before and after it agree about the value between them.
//!
//! Three predictions of a sample `x` are compared: `2 x₋₁ − x₋₂` by the line through the two
//! samples before it, `2 x₊₁ − x₊₂` by the line through the two after it, and the neighbours' mean
//! `(x₋₁ + x₊₁)/2`. A spike is off all three in the same sense. A step, the reversal of a surface
//! at its full rate, or a stick pulse of two samples is off at most two of them.

use std::ops::Range;

use crate::ingest::settings::Spikes;
use crate::numerics::series::sample_count::whole_steps;
use crate::numerics::statistics::order_statistics::{
    SIGMA_PER_MAD, finite_magnitudes, lower_quantile_of_magnitudes,
};
use crate::numerics::vectors::simd::vectorised;

/// Variance of a sample minus its neighbours' mean, in variances of white noise: 1 + 1/4 + 1/4.
const MEAN_VARIANCE: f64 = 1.5;

/// Relative difference below which a sample is its neighbours' mean: rounding of the arithmetic.
const MEAN_ROUNDING: f64 = 1e-12;

/// Least number of samples off their neighbours' mean from which the rounding is inferred.
const LEAST_ROUNDED: usize = 20;

/// Quantile of the deviations that equals the rounding: low, but above the few samples that a
/// repair or a conversion moved off the grid.
const ROUNDING_QUANTILE: f64 = 0.05;

/// Smallest distance of a spike from each line, as a fraction of its distance from the mean. The
/// lines are twice as noisy as the mean.
const LINES: f64 = 0.75;

/// Largest distance between the two lines' predictions that noise alone may cause, in standard
/// deviations of the noise. The standard deviation of the distance is √10 times that of the noise.
const LINES_NOISE: f64 = 3.0;

/// Stride of the samples from which the noise of a spell is estimated: a quarter of thousands is
/// enough.
const STRIDE: usize = 4;

/// Samples that are tested together, since few of them contain a candidate.
const LOOKED_AT_ONCE: usize = 64;

/// Least reach of a sample's surroundings, in samples: below it the local noise has no median.
const LEAST_REACH: usize = 4;

/// Estimates the level with which a spike is compared, and the standard deviation of the noise.
pub fn noise_levels(values: &[f64]) -> (f64, f64) {
    let mut deviations = sampled_deviations(values);
    if finite_magnitudes(&deviations) == 0 {
        return (0.0, f64::NAN);
    }
    let noise = noise_of(&mut deviations);
    (noise.max(rounding(values, deviations)), noise)
}

/// Bits of the deviations of every `STRIDE`-th sample off its neighbours' mean; not finite beside a gap.
fn sampled_deviations(values: &[f64]) -> Vec<u64> {
    let parts = values.chunks_exact(STRIDE);
    let last = parts.remainder().get(..3);
    let mut deviations = vec![0; parts.len()];
    vectorised(
        #[inline(always)]
        || {
            for (deviation, part) in deviations.iter_mut().zip(values.chunks_exact(STRIDE)) {
                *deviation = off_neighbours(part).to_bits();
            }
        },
    );
    deviations.extend(last.map(|part| off_neighbours(part).to_bits()));
    deviations
}

/// Standard deviation of white noise from the bits of deviations of samples off their neighbours' mean.
fn noise_of(deviations: &mut [u64]) -> f64 {
    let median = lower_quantile_of_magnitudes(deviations, 0.5).unwrap_or(0.0);
    SIGMA_PER_MAD / MEAN_VARIANCE.sqrt() * median
}

/// Replaces single-sample spikes by their neighbours' mean and returns their places. `floors` gives
/// the noise level for ranges of samples.
pub fn remove(
    values: &mut [f64],
    step_s: f64,
    floors: &[(Range<usize>, f64)],
    settings: &Spikes,
) -> Vec<usize> {
    if !settings.remove {
        return Vec::new();
    }
    let reach = whole_steps(settings.window_s, step_s).max(LEAST_REACH);
    let mut spikes = Vec::new();
    for (range, floor) in floors {
        let level = settings.deviations * floor;
        let to = range.end.min(values.len().saturating_sub(1));
        for from in (range.start.max(1)..to).step_by(LOOKED_AT_ONCE) {
            let part = &values[from - 1..=(from + LOOKED_AT_ONCE).min(to)];
            if !has_candidate(part, level) {
                continue;
            }
            for (i, three) in part.windows(3).enumerate() {
                if is_candidate(three, level) && is_spike(values, from + i, *floor, reach, settings)
                {
                    spikes.push(from + i);
                }
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

/// `true` if the second of three samples is off the mean of the others by more than a level. False
/// beside a gap.
fn is_candidate(three: &[f64], level: f64) -> bool {
    off_neighbours(three) > level
}

/// Distance of the second of three samples from the mean of the others; NaN beside a gap.
fn off_neighbours(three: &[f64]) -> f64 {
    (three[1] - 0.5 * (three[0] + three[2])).abs()
}

/// `true` if some sample between the first and the last is a candidate.
fn has_candidate(values: &[f64], level: f64) -> bool {
    vectorised(
        #[inline(always)]
        || {
            let threes = values.windows(3);
            threes.fold(false, |any, three| any | is_candidate(three, level))
        },
    )
}

/// `true` if a sample that exceeds the spell's noise differs from its surroundings as only a spike
/// does.
fn is_spike(values: &[f64], k: usize, floor: f64, reach: usize, settings: &Spikes) -> bool {
    let Some(height) = Height::of(values, k) else {
        return false;
    };
    // The local noise is expensive. Its least and its largest possible value decide most samples.
    let most = height.off_mean / settings.deviations;
    if !height.exceeds(floor, settings) || !height.lines_meet(most, settings) {
        return false;
    }
    let noise = floor.max(local_noise(values, k, reach));
    height.exceeds(noise, settings) && height.lines_meet(noise, settings)
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

/// Height of a sample over its neighbours.
struct Height {
    /// Distance from the neighbours' mean.
    off_mean: f64,
    /// The lesser of the distances from the two lines, positive in the sense of the distance from
    /// the mean.
    off_lines: f64,
    /// Distance between the two lines' predictions.
    lines_apart: f64,
}

impl Height {
    /// Height of a sample; `None` beside a gap. With one sample on a side the line is level.
    fn of(values: &[f64], k: usize) -> Option<Height> {
        let at = |i: Option<usize>| {
            let value = i.and_then(|i| values.get(i)).copied();
            value.filter(|v| v.is_finite())
        };
        let (x, before, after) = (at(Some(k))?, at(k.checked_sub(1))?, at(Some(k + 1))?);
        let left = 2.0 * before - at(k.checked_sub(2)).unwrap_or(before);
        let right = 2.0 * after - at(Some(k + 2)).unwrap_or(after);
        let off_mean = x - 0.5 * (before + after);
        let sense = off_mean.signum();
        Some(Height {
            off_mean: off_mean.abs(),
            off_lines: ((x - left) * sense).min((x - right) * sense),
            lines_apart: (left - right).abs(),
        })
    }

    fn exceeds(&self, noise: f64, settings: &Spikes) -> bool {
        self.off_mean > settings.deviations * noise
            && self.off_lines > LINES * settings.deviations * noise
    }

    fn lines_meet(&self, noise: f64, settings: &Spikes) -> bool {
        self.lines_apart <= settings.agreement * self.off_mean + LINES_NOISE * noise
    }
}

/// Noise around a sample, without the sample and its neighbours, which a spike spoils.
fn local_noise(values: &[f64], k: usize, reach: usize) -> f64 {
    let around = k.saturating_sub(reach)..(k + reach + 1).min(values.len());
    let mut deviations: Vec<u64> = around
        .filter(|i| i.abs_diff(k) > 1)
        .map(|i| off_mean(values, i).abs().to_bits())
        .collect();
    noise_of(&mut deviations)
}

/// Deviation off the neighbours' mean that rounding alone causes: half the quantisation step, the
/// least that is not zero. Of a channel that hardly ever changes, half of the least difference between
/// its values.
fn rounding(values: &[f64], mut deviations: Vec<u64>) -> f64 {
    let largest = values
        .iter()
        .step_by(STRIDE)
        .map(|v| v.abs())
        .fold(0.0, f64::max);
    let least = (MEAN_ROUNDING * largest).to_bits();
    deviations.retain(|deviation| *deviation > least);
    if finite_magnitudes(&deviations) < LEAST_ROUNDED {
        0.5 * least_difference(values, MEAN_ROUNDING * largest)
    } else {
        lower_quantile_of_magnitudes(&mut deviations, ROUNDING_QUANTILE).unwrap_or(0.0)
    }
}

/// Smallest difference between the values of a channel, beyond rounding. Zero for a channel that is
/// constant except for one sample, which may be a spike.
fn least_difference(values: &[f64], same: f64) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let levels: Vec<&[f64]> = sorted.chunk_by(|a, b| b - a <= same).collect();
    if let [low, high] = levels[..]
        && low.len().min(high.len()) == 1
    {
        return 0.0;
    }
    let differences = levels.windows(2).map(|pair| pair[1][0] - pair[0][0]);
    differences.min_by(f64::total_cmp).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn despike(values: &mut [f64]) -> Vec<usize> {
        let floor = noise_levels(values).0;
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
        // So few changes that no rounding can be read from them.
        let mut values: Vec<f64> = (0..400).map(|k| 3.0 + 0.1 * f64::from(k / 100)).collect();
        values[50] -= 0.1;
        values[250] += 0.2;
        assert!(spikes(&values).is_empty());
        values[150] += 5.0;
        assert_eq!(spikes(&values), [150]);
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
