//! Samples of a record averaged to the step of the windows, and their noise.

use std::ops::Range;

use crate::flight::{Mark, Record};
use crate::numerics::statistics::mean::mean;
use crate::output_error::surface_noise::white_variance;

/// Samples of the record that are averaged into one sample of a window, alike for all channels. At
/// least 25 a second remain, which resolve the motion of an aircraft.
pub fn decimation(step_s: f64) -> usize {
    const SLOWEST_STEP_S: f64 = 0.04;
    // The step is measured: at 50 and at 100 Hz the ratio is a whole number but for the clock's error.
    const CLOCK_ERROR: f64 = 0.01;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small positive number"
    )]
    let decimation = (SLOWEST_STEP_S / step_s + CLOCK_ERROR).floor().max(1.0) as usize;
    decimation
}

/// Means of groups of `decimation` samples.
pub fn decimate(values: &[f64], decimation: usize) -> Vec<f64> {
    values
        .chunks_exact(decimation)
        .map(|v| mean(v.iter().copied()))
        .collect()
}

/// Values and marks of a signal over a range; `None` unless the record contains the range.
fn samples_over<'r>(
    record: &'r Record,
    name: &str,
    range: &Range<usize>,
) -> Option<(&'r [f64], &'r [Mark])> {
    let series = record.signals.get(name)?;
    let values = series.values.get(range.clone())?;
    let marks = series.marks.get(range.clone())?;
    Some((values, marks))
}

/// Measured values of a signal over a range; NaN where a sample was repaired or not recorded. A
/// measured value of a slow channel is averaged with the samples on the line to the next value. The
/// mean is thus the value at the middle.
pub fn decimate_measured(
    record: &Record,
    name: &str,
    range: &Range<usize>,
    decimation: usize,
) -> Vec<f64> {
    let Some((values, marks)) = samples_over(record, name, range) else {
        return vec![f64::NAN; range.len() / decimation];
    };
    let means = decimate(values, decimation).into_iter();
    let counts = |marks: &[Mark]| {
        marks.contains(&Mark::Measured)
            && marks
                .iter()
                .all(|m| matches!(m, Mark::Measured | Mark::Between))
    };
    let counted = marks.chunks_exact(decimation).map(counts);
    means
        .zip(counted)
        .map(|(mean, counts)| if counts { mean } else { f64::NAN })
        .collect()
}

/// Variance of white noise with the power of a signal's noise, for each sample of the record. Zero
/// for a signal that is not recorded. The noise of a slow channel's sample lasts until the next
/// one.
pub fn white_level(record: &Record, name: &str, range: &Range<usize>) -> f64 {
    let Some((values, marks)) = samples_over(record, name, range) else {
        return 0.0;
    };
    let both = values.iter().zip(marks);
    let measured: Vec<f64> = both
        .filter(|(_, mark)| **mark == Mark::Measured)
        .map(|(value, _)| *value)
        .collect();
    let spacing = values.len() as f64 / measured.len().max(1) as f64;
    white_variance(&measured) * spacing
}

#[cfg(test)]
mod tests {
    use super::decimation;

    #[test]
    fn at_least_25_samples_a_second_remain_whatever_the_error_of_the_clock() {
        for (rate_hz, expected) in [
            (10.0, 1),
            (40.0, 1),
            (50.0, 2),
            (100.0, 4),
            (120.0, 4),
            (1000.0, 40),
        ] {
            for error in [-1e-4, 0.0, 1e-4] {
                assert_eq!(decimation((1.0 + error) / rate_hz), expected, "{rate_hz}");
            }
        }
    }
}
