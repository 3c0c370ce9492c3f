//! Slopes of recorded signals in time: local straight lines by least squares.

use std::ops::Range;

use crate::numerics::series::sample_count::nearest;
use crate::numerics::vectors::simd::vectorised;

/// Half the length of the local straight line whose slope is the derivative. It is short against the
/// airframe's modes. It is long enough to keep the gyros' noise, times the accelerometers' arms, below
/// the accelerometers' noise.
const SLOPE_REACH_S: f64 = 0.1;

/// Samples on each side of the local straight line whose slope is the derivative, at least one.
#[must_use]
pub fn slope_reach(step_s: f64) -> usize {
    nearest(SLOPE_REACH_S / step_s).max(1)
}

/// Slope per second of a signal over a range of the record, by local least squares.
pub fn slope(values: &[f64], range: &Range<usize>, step_s: f64) -> Vec<f64> {
    let mut slopes = vec![f64::NAN; range.len()];
    let reach = slope_reach(step_s);
    // Samples whose line lies within the record.
    let first = range.start.max(reach);
    let end = range.end.min(values.len().saturating_sub(reach));
    if first < end {
        let whole = first - range.start..end - range.start;
        slope_of_lines(values, first, step_s, &mut slopes[whole]);
    }
    for (slope, k) in slopes.iter_mut().zip(range.clone()) {
        if !slope.is_finite() {
            *slope = slope_at_gap(values, k, step_s);
        }
    }
    slopes
}

/// Slopes at samples from `first` on, whose lines lie within the record, side by side.
fn slope_of_lines(values: &[f64], first: usize, step_s: f64, slopes: &mut [f64]) {
    slopes.fill(0.0);
    let mut norm = 0.0;
    for d in 1..=slope_reach(step_s) {
        let weight = d as f64;
        norm += 2.0 * weight * weight;
        let pairs = values[first + d..].iter().zip(&values[first - d..]);
        vectorised(
            #[inline(always)]
            || {
                for (up, (later, earlier)) in slopes.iter_mut().zip(pairs.clone()) {
                    *up += weight * (later - earlier);
                }
            },
        );
    }
    let span_s = norm * step_s;
    for slope in slopes {
        *slope /= span_s;
    }
}

/// Slope where samples are missing or the record ends: least squares on the pairs that are there.
fn slope_at_gap(values: &[f64], k: usize, step_s: f64) -> f64 {
    let reach = slope_reach(step_s)
        .min(k)
        .min(values.len().saturating_sub(k + 1));
    let (mut up, mut norm) = (0.0, 0.0);
    for d in 1..=reach {
        let (weight, change) = (d as f64, values[k + d] - values[k - d]);
        if change.is_finite() {
            up += weight * change;
            norm += 2.0 * weight * weight;
        }
    }
    if norm > 0.0 {
        up / (norm * step_s)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::record::with_margin;
    use approx::assert_abs_diff_eq;

    #[test]
    fn a_slope_spans_the_same_time_at_any_rate() {
        let reaches = [10.0, 20.0, 40.0, 50.0, 2.0].map(|rate_hz| slope_reach(1.0 / rate_hz));
        assert_eq!(reaches, [1, 2, 4, 5, 1]);
    }

    #[test]
    fn a_part_of_a_record_has_the_samples_of_its_slopes_at_any_rate() {
        for rate_hz in [2.0, 40.0, 100.0, 1000.0] {
            let step_s = 1.0 / rate_hz;
            let part = with_margin(5000, 5000, 9000, step_s);
            let reach = slope_reach(step_s);
            assert!(
                part.start <= 5000 - reach && part.end > 5000 + reach,
                "{rate_hz}"
            );
        }
    }

    #[test]
    fn a_slope_is_that_of_the_line_through_its_samples_and_leaves_out_pairs_at_a_gap() {
        let mut values: Vec<f64> = (0..40).map(|k| (0.3 * f64::from(k)).sin()).collect();
        values[20] = f64::NAN;
        let step_s = 0.05;
        let reach = slope_reach(step_s);
        for (k, slope) in (0..40).zip(slope(&values, &(0..40), step_s)) {
            let pairs = (1..=reach).filter(|d| *d <= k && k + d < 40);
            let changes = pairs.map(|d| (d as f64, values[k + d] - values[k - d]));
            let changes: Vec<(f64, f64)> = changes.filter(|(_, c)| c.is_finite()).collect();
            let up: f64 = changes.iter().map(|(d, change)| d * change).sum();
            let norm: f64 = changes.iter().map(|(d, _)| 2.0 * d * d).sum();
            let expected = if norm > 0.0 { up / norm / step_s } else { 0.0 };
            assert_abs_diff_eq!(slope, expected, epsilon = 1e-12);
        }
        let of_nothing = slope(&[], &(3..5), step_s);
        assert!(of_nothing.len() == 2 && of_nothing.iter().all(|slope| *slope == 0.0));
        assert!(slope(&values, &(39..39), step_s).is_empty());
    }

    #[test]
    fn the_slope_of_a_straight_line_is_exact_up_to_the_ends() {
        let line: Vec<f64> = (0..20).map(|k| 3.0 + 0.5 * f64::from(k)).collect();
        for s in slope(&line, &(1..19), 0.025) {
            assert_abs_diff_eq!(s, 20.0, epsilon = 1e-12);
        }
    }
}
