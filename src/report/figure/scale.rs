//! The scale of one axis of a figure: round limits and ticks that show what the reader came for,
//! whatever a few wild values do.

use crate::report::notation::power_of_ten;

/// Round limits, at half steps at least, with ticks at every multiple of the step between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    pub min: f64,
    pub max: f64,
    pub step: f64,
}

/// About so many steps fill a scale: enough to read a value off, few enough for legible labels.
const STEPS: f64 = 5.0;

/// Estimates further from the middle 80 % than this many times its width do not stretch the axis.
const FENCE: f64 = 1.0;

impl Scale {
    /// The round scale that covers an interval; one of some width even where the interval has none.
    #[must_use]
    pub fn covering(low: f64, high: f64) -> Scale {
        Scale::in_steps(low, high, STEPS)
    }

    /// The same with about so many steps: fewer where the axis is short.
    #[must_use]
    pub fn in_steps(low: f64, high: f64, steps: f64) -> Scale {
        let (low, high) = widened(low, high);
        let step = round_step((high - low) / steps);
        Scale::with_step(low, high, 0.5 * step, step)
    }

    /// The scale from one multiple of `margin` to another that covers an interval.
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

    /// How many decimals its tick labels need.
    #[must_use]
    pub fn decimals(&self) -> usize {
        // A step of 0.1 may be 0.099999…: its power of ten is that of the rounded number.
        usize::try_from(-power_of_ten(self.step * 1.000_001)).unwrap_or(0)
    }
}

/// What one figure has to show.
#[derive(Clone, Debug, Default)]
pub struct ValueRange {
    /// Values that must be seen: the trend and the tunnel.
    pub lines: Vec<f64>,
    /// Estimates and the half-length of their bars.
    pub estimates: Vec<(f64, f64)>,
    /// Ends of the trend's band.
    pub band: Vec<f64>,
}

impl ValueRange {
    /// The scale for it: all of the lines, the estimates but for the wild ones, and of bars and
    /// band what does not dwarf them.
    #[must_use]
    pub fn scale(&self) -> Scale {
        let values: Vec<f64> = self
            .estimates
            .iter()
            .map(|e| e.0)
            .filter(|v| v.is_finite())
            .collect();
        let fence = fence(&values);
        let near = values
            .into_iter()
            .filter(|v| fence.is_none_or(|(low, high)| (low..=high).contains(v)));
        let core = self
            .lines
            .iter()
            .copied()
            .filter(|v| v.is_finite())
            .chain(near);
        let Some((low, high)) = extent(core) else {
            return Scale::covering(0.0, 1.0);
        };
        let room = 0.35 * (high - low);
        let ends = self
            .estimates
            .iter()
            .flat_map(|(value, bound)| [value - bound, value + bound]);
        let more = ends
            .chain(self.band.iter().copied())
            .filter(|v| (low - room..=high + room).contains(v));
        let (low, high) = extent(more.chain([low, high])).unwrap_or((low, high));
        let margin = 0.03 * (high - low);
        Scale::covering(low - margin, high + margin)
    }
}

/// The interval outside which an estimate is wild, by the middle 80 % of all of them.
fn fence(values: &[f64]) -> Option<(f64, f64)> {
    if values.len() < 5 {
        return None;
    }
    let low = quantile(values, 0.1)?;
    let high = quantile(values, 0.9)?;
    let width = FENCE * (high - low);
    Some((low - width, high + width))
}

/// A quantile of the finite values, linear between them.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a place within the list"
)]
#[must_use]
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let place = share * sorted.len().checked_sub(1)? as f64;
    let below = *sorted.get(place.floor() as usize)?;
    let above = *sorted.get(place.ceil() as usize)?;
    Some(below + (above - below) * place.fract())
}

/// The smallest and the largest of the finite values.
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

/// An interval of some width, however narrow the given one: one value alone gets a tenth of itself
/// to either side.
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

/// The smallest of 1, 2, 5 and 10 times a power of ten that is at least `step`.
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
    fn a_wild_estimate_does_not_flatten_the_figure() {
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
        let wild = range.scale();
        assert!(
            wild.max - wild.min < 2.0 * (calm.max - calm.min),
            "{wild:?} against {calm:?}"
        );
        assert!(wild.contains(0.04) && wild.contains(0.08));
    }

    #[test]
    fn nothing_to_show_and_what_is_not_finite_still_have_a_scale() {
        let scale = ValueRange {
            lines: vec![f64::NAN, f64::INFINITY],
            ..ValueRange::default()
        }
        .scale();
        assert!(scale.min.is_finite() && scale.max > scale.min);
        assert!(Scale::covering(f64::NAN, 1.0).max > 0.0);
    }

    #[test]
    fn quantiles_are_linear_between_values() {
        assert_relative_eq!(quantile(&[3.0, 1.0, 2.0], 0.25).expect("a quantile"), 1.5);
        assert_eq!(quantile(&[f64::NAN], 0.5), None);
    }
}
