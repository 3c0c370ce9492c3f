//! Noise of a dynamic pressure that is recorded more slowly than the other signals.
//!
//! Between two recorded values the signal is interpolated linearly, so the error of a value affects
//! the samples on either side. Every coefficient acts in proportion to the dynamic pressure.

use std::ops::Range;

use super::surface_noise::white_variance;
use crate::flight::{Mark, Record, signal};
use crate::numerics::statistics::mean::mean;

/// Variance of white noise with the same effect on slow motion as the noise of a slow dynamic
/// pressure. It is relative to the square of the dynamic pressure. Zero for a dynamic pressure
/// recorded at full rate.
///
/// If every nth sample is recorded, and the others are interpolated linearly, each recorded value
/// counts n times in a sum over the samples. Its variance σ² adds n² σ² to the variance of the sum.
/// n samples of white noise of variance n σ² add the same.
#[must_use]
pub fn relative_variance(record: &Record, range: Range<usize>) -> f64 {
    let Some(series) = record.signals.get(signal::QBAR) else {
        return 0.0;
    };
    let values = series.values.get(range.clone()).unwrap_or_default();
    let marks = series.marks.get(range).unwrap_or_default();
    let recorded = values.iter().zip(marks);
    let recorded = recorded.filter(|(_, mark)| **mark == Mark::Measured);
    let recorded: Vec<f64> = recorded.map(|(value, _)| *value).collect();
    let is_slow = marks.contains(&Mark::Between) && 2 * recorded.len() <= values.len();
    if !is_slow || recorded.is_empty() {
        return 0.0;
    }
    let mean = mean(recorded.iter().copied());
    let samples_per_value = values.len() as f64 / recorded.len() as f64;
    let relative = white_variance(&recorded) / (mean * mean);
    if relative.is_finite() {
        samples_per_value * relative
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::flight::record::Series;
    use crate::output_error::tests::Noise;

    /// Record with a dynamic pressure of 40 with noise of 0.2 at every nth sample.
    fn record(every: usize) -> Record {
        let mut noise = Noise(3);
        let mut value = f64::NAN;
        let values = (0..400 * every).map(|k| {
            if k.is_multiple_of(every) {
                value = 40.0 + 0.2 * noise.gaussian();
            }
            value
        });
        let mark = |k: usize| {
            if k.is_multiple_of(every) {
                Mark::Measured
            } else {
                Mark::Between
            }
        };
        let series = Series {
            values: values.collect(),
            marks: (0..400 * every).map(mark).collect(),
        };
        Record {
            flight_id: String::new(),
            start_s: 0.0,
            step_s: 0.02,
            samples: 400 * every,
            signals: [(signal::QBAR.to_owned(), series)].into(),
            remaining_errors: [].into(),
        }
    }

    #[test]
    fn the_variance_grows_with_the_samples_of_a_value_and_is_none_at_full_rate() {
        let slow = relative_variance(&record(25), 0..400 * 25);
        assert_relative_eq!(slow.sqrt(), 5.0 * 0.005, max_relative = 0.2);
        assert!(relative_variance(&record(1), 0..400) == 0.0);
        assert!(relative_variance(&record(25), 0..0) == 0.0);
    }
}
