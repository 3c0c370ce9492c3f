//! Differences of a signal from sample to sample, and the white noise that their size implies.
//!
//! Motion at the aircraft's frequencies hardly contributes to second and third differences, and their
//! median leaves out steps.

use crate::numerics::statistics::order_statistics::{
    SIGMA_PER_MAD, finite_magnitudes, upper_median_of_magnitudes,
};

/// Second difference of three samples.
#[must_use]
pub fn second(u: &[f64; 3]) -> f64 {
    u[0] - 2.0 * u[1] + u[2]
}

/// Third difference of four samples.
#[inline]
#[must_use]
pub fn third(u: &[f64; 4]) -> f64 {
    u[3] - 3.0 * u[2] + 3.0 * u[1] - u[0]
}

/// Standard deviation of the white noise of samples, from their finite second differences; `None` with
/// fewer than two of them.
#[must_use]
pub fn white_noise(samples: &[f64]) -> Option<f64> {
    let sizes = samples.array_windows().map(|w| second(w).abs().to_bits());
    let mut sizes: Vec<u64> = sizes.collect();
    if finite_magnitudes(&sizes) < 2 {
        return None;
    }
    Some(noise_of_second(upper_median_of_magnitudes(&mut sizes)?))
}

/// Standard deviation of white noise from the median size of its second differences.
#[must_use]
pub fn noise_of_second(median_size: f64) -> f64 {
    noise_of(&[1.0, 2.0, 1.0], median_size)
}

/// Standard deviation of white noise from the median size of its third differences.
#[must_use]
pub fn noise_of_third(median_size: f64) -> f64 {
    noise_of(&[1.0, 3.0, 3.0, 1.0], median_size)
}

/// A sum of independent samples has the sum of its squared weights times the variance of one.
fn noise_of(weights: &[f64], median_size: f64) -> f64 {
    let variance: f64 = weights.iter().map(|w| w * w).sum();
    SIGMA_PER_MAD * median_size / variance.sqrt()
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::numerics::statistics::order_statistics::median;
    use crate::numerics::statistics::random::RandomStream;

    #[test]
    fn differences_of_a_cubic_are_its_derivatives() {
        let cubic = |t: f64| 4.0 - t + 3.0 * t * t + 0.5 * t.powi(3);
        assert_abs_diff_eq!(second(&[0.0, 1.0, 4.0]), 2.0);
        assert_abs_diff_eq!(third(&[1.0, 2.0, 3.0, 4.0].map(cubic)), 3.0);
    }

    #[test]
    fn white_noise_on_a_slow_motion_is_found_from_either_difference() {
        let mut stream = RandomStream::new(11, "a vane");
        let sample = |k: usize| (k as f64 / 80.0).sin() + 0.02 * stream.normal();
        let samples: Vec<f64> = (0..20_000).map(sample).collect();
        let seconds = samples.array_windows().map(|w| second(w).abs());
        let thirds = samples.array_windows().map(|w| third(w).abs());
        // The median of 20,000 differences is known to one percent.
        assert_abs_diff_eq!(
            noise_of_second(median(seconds).unwrap()),
            0.02,
            epsilon = 6e-4
        );
        assert_abs_diff_eq!(
            noise_of_third(median(thirds).unwrap()),
            0.02,
            epsilon = 6e-4
        );
        assert_abs_diff_eq!(white_noise(&samples).unwrap(), 0.02, epsilon = 6e-4);
        assert_eq!(white_noise(&[0.0, 1.0, f64::NAN, 2.0]), None);
    }
}
