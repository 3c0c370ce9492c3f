//! Scale of one axis: round limits and ticks, not stretched by a few outliers.

use crate::numerics::statistics::order_statistics::quantile;
use crate::report::notation::power_of_ten;

/// Limits at multiples of half a step, with ticks at the multiples of the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    pub min: f64,
    pub max: f64,
    pub step: f64,
}

/// Approximate number of steps: enough to read a value, few enough for legible labels.
const STEPS: f64 = 5.0;

/// Distance of outliers from the middle 80 % of the estimates, in widths of that interval.
const FENCE: f64 = 1.0;
/// Least number of estimates for which quantiles are computed.
const LEAST_FOR_FENCE: usize = 5;
/// Share of the range by which ends of bars and band may extend it.
const LARGEST_EXTENSION: f64 = 0.35;
/// Share of the range left free at either end.
const MARGIN: f64 = 0.03;

impl Scale {
    /// Round scale that covers an interval. An interval without width is widened.
    #[must_use]
    pub fn covering(low: f64, high: f64) -> Scale {
        Scale::in_steps(low, high, STEPS)
    }

    /// Round scale that covers an interval in about `steps` steps.
    #[must_use]
    pub fn in_steps(low: f64, high: f64, steps: f64) -> Scale {
        let (low, high) = widened(low, high);
        let step = round_step((high - low) / steps);
        Scale::with_step(low, high, 0.5 * step, step)
    }

    /// Scale between multiples of `margin` that covers an interval.
    #[must_use]
    pub fn with_step(low: f64, high: f64, margin: f64, step: f64) -> Scale {
        let (low, high) = widened(low, high);
        Scale {
            min: (low / margin).floor() * margin,
            max: (high / margin).ceil() * margin,
            step,
        }
    }

    #[must_use]
    pub fn contains(&self, value: f64) -> bool {
        (self.min..=self.max).contains(&value)
    }

    /// Number of decimals of the tick labels.
    #[must_use]
    pub fn decimals(&self) -> usize {
        // A step of 0.1 may be 0.099999…: its power of ten is that of the rounded number.
        usize::try_from(-power_of_ten(self.step * 1.000_001)).unwrap_or(0)
    }
}

/// Values that a figure shows.
#[derive(Clone, Debug, Default)]
pub struct ValueRange {
    /// Trend and tunnel: always within the axis.
    pub lines: Vec<f64>,
    /// Estimates and the half lengths of their bars.
    pub estimates: Vec<(f64, f64)>,
    /// Ends of the trend's band.
    pub band: Vec<f64>,
}

impl ValueRange {
    /// Scale that covers all lines, the estimates without outliers, and ends of bars and band
    /// unless they would extend it too far.
    #[must_use]
    pub fn scale(&self) -> Scale {
        let values: Vec<f64> = self
            .estimates
            .iter()
            .map(|e| e.0)
            .filter(|v| v.is_finite())
            .collect();
        let fence = outlier_fence(&values);
        let inliers = values
            .into_iter()
            .filter(|v| fence.is_none_or(|(low, high)| (low..=high).contains(v)));
        let Some((low, high)) = extent(self.lines.iter().copied().chain(inliers)) else {
            return Scale::covering(0.0, 1.0);
        };
        let room = LARGEST_EXTENSION * (high - low);
        let ends = self
            .estimates
            .iter()
            .flat_map(|(value, bound)| [value - bound, value + bound])
            .chain(self.band.iter().copied())
            .filter(|v| (low - room..=high + room).contains(v));
        let (low, high) = extent(ends.chain([low, high])).unwrap_or((low, high));
        let margin = MARGIN * (high - low);
        Scale::covering(low - margin, high + margin)
    }
}

/// Interval outside which an estimate is an outlier, from the middle 80 % of all estimates; `None`
/// for fewer than five.
fn outlier_fence(values: &[f64]) -> Option<(f64, f64)> {
    if values.len() < LEAST_FOR_FENCE {
        return None;
    }
    let low = quantile(values.iter().copied(), 0.1)?;
    let high = quantile(values.iter().copied(), 0.9)?;
    let width = FENCE * (high - low);
    Some((low - width, high + width))
}

/// Smallest and largest finite value.
#[must_use]
pub fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .into_iter()
        .filter(|v| v.is_finite())
        .fold(None, |extent, v| match extent {
            None => Some((v, v)),
            Some((low, high)) => Some((low.min(v), high.max(v))),
        })
}

/// Widens an interval without width by a tenth of its value to either side.
fn widened(low: f64, high: f64) -> (f64, f64) {
    let size = low.abs().max(high.abs());
    if !(low.is_finite() && high.is_finite()) || size > 1e300 {
        (0.0, 1.0)
    } else if high - low > size * 1e-9 {
        (low, high)
    } else if size < 1e-300 {
        (-1.0, 1.0)
    } else {
        (low - 0.1 * size, high + 0.1 * size)
    }
}

/// Smallest of 1, 2, 5 and 10 times a power of ten not below `step`.
fn round_step(step: f64) -> f64 {
    let decade = 10_f64.powi(power_of_ten(step));
    let multiple = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|m| m * decade >= step * (1.0 - 1e-9))
        .unwrap_or(10.0);
    multiple * decade
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn limits_are_round_and_cover_the_interval() {
        for (low, high) in [
            (0.013, 0.087),
            (-3.0, 250.0),
            (1e-7, 3e-7),
            (-0.02, -0.018),
            (2.0, 2.0),
            (0.0, 0.0),
        ] {
            let scale = Scale::covering(low, high);
            let slack = 1e-9 * scale.step;
            assert!(
                scale.min <= low + slack && scale.max >= high - slack && scale.max > scale.min,
                "{scale:?}"
            );
            let halves = 2.0 * (scale.max - scale.min) / scale.step;
            assert_relative_eq!(halves, halves.round(), epsilon = 1e-6);
            assert!(
                (4.0..=14.0).contains(&halves),
                "{low} {high}: {halves} half steps"
            );
        }
    }

    #[test]
    fn tick_labels_have_the_decimals_of_the_step() {
        assert_eq!(Scale::covering(0.0, 0.0021).decimals(), 4);
        assert_eq!(Scale::covering(0.0, 0.5).decimals(), 1);
        assert_eq!(Scale::covering(0.0, 500.0).decimals(), 0);
    }

    #[test]
    fn outliers_do_not_flatten_the_figure() {
        let mut range = ValueRange {
            lines: vec![0.04, 0.08],
            ..ValueRange::default()
        };
        range.estimates = (0..40)
            .map(|i| (0.04 + 0.001 * f64::from(i), 0.001))
            .collect();
        let calm = range.scale();
        range
            .estimates
            .extend([(9.0, 30.0), (-4.0, 2.0), (f64::NAN, f64::INFINITY)]);
        range.band = vec![-2.0, 5.0, f64::INFINITY];
        let with_outliers = range.scale();
        assert!(
            with_outliers.max - with_outliers.min < 2.0 * (calm.max - calm.min),
            "{with_outliers:?} against {calm:?}"
        );
        assert!(with_outliers.contains(0.04) && with_outliers.contains(0.08));
    }

    #[test]
    fn no_values_and_values_that_are_not_finite_still_have_a_scale() {
        let scale = ValueRange {
            lines: vec![f64::NAN, f64::INFINITY],
            ..ValueRange::default()
        }
        .scale();
        assert!(scale.min.is_finite() && scale.max > scale.min);
        assert!(Scale::covering(f64::NAN, 1.0).max > 0.0);
    }
}
