//! Signals at samples and halfway between them.

use crate::numerics::vectors::simd::vectorised;

/// Interleaves samples with the values half-way between them, of the cubic through the two samples
/// on either side. Linear interpolation would attenuate a sine of angular frequency ω by (ω
/// step)²/12, and with it the effect of a surface. At 10 samples per second and 1 Hz that is 3 %.
/// At the ends, and beside a gap, the value is the mean of its neighbours.
pub fn with_half_samples(values: &[f64]) -> Vec<f64> {
    let mut points = with_means_between(values);
    let (pairs, _) = points.as_chunks_mut::<2>();
    vectorised(
        #[inline(always)]
        || {
            let inner = pairs.get_mut(1..).unwrap_or_default();
            for ([_, point], four) in inner.iter_mut().zip(values.windows(4)) {
                let middle = *point + ((four[1] - four[0]) - (four[3] - four[2])) / 16.0;
                *point = if middle.is_finite() { middle } else { *point };
            }
        },
    );
    points
}

/// Interleaves samples with the means of neighbours.
pub fn with_means_between(values: &[f64]) -> Vec<f64> {
    let Some(last) = values.last() else {
        return vec![];
    };
    // Room for the last sample, which has no pair.
    let mut pairs = Vec::with_capacity(values.len());
    vectorised(
        #[inline(always)]
        || {
            let pair = |pair: &[f64]| [pair[0], 0.5 * (pair[0] + pair[1])];
            pairs.extend(values.windows(2).map(pair));
        },
    );
    let mut points = pairs.into_flattened();
    points.push(*last);
    points
}

/// Mean of the samples at every sample and half-sample.
pub fn constant_mean(values: &[f64]) -> Vec<f64> {
    // Several independent sums hide the latency of one.
    let (whole, rest) = values.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for eight in whole {
        for (sum, value) in sums.iter_mut().zip(eight) {
            *sum += value;
        }
    }
    let mean = sums.iter().chain(rest).sum::<f64>() / values.len().max(1) as f64;
    vec![mean; (2 * values.len()).saturating_sub(1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn points_between_samples_lie_on_cubics_and_at_the_ends_on_lines() {
        let cubic = |t: f64| 1.0 - 2.0 * t + 0.5 * t * t + 0.25 * t * t * t;
        let samples: Vec<f64> = (0..8).map(|k| cubic(f64::from(k))).collect();
        let points = with_half_samples(&samples);
        assert_eq!(points.len(), 15);
        for (i, point) in points.iter().enumerate() {
            let expected = match i {
                1 | 13 => 0.5 * (samples[i / 2] + samples[i / 2 + 1]),
                _ => cubic(0.5 * i as f64),
            };
            assert_abs_diff_eq!(*point, expected, epsilon = 1e-12);
        }
        assert_eq!(with_half_samples(&[1.0, 3.0]), [1.0, 2.0, 3.0]);
        assert!(with_half_samples(&[]).is_empty());
    }

    #[test]
    fn points_beside_a_gap_are_the_means_of_their_neighbours() {
        let points = with_half_samples(&[0.0, 1.0, 4.0, 9.0, f64::NAN, 25.0]);
        assert_abs_diff_eq!(points[3], 2.25);
        assert_abs_diff_eq!(points[5], 6.5);
        assert!(points[7].is_nan() && points[9].is_nan());
    }
}
