//! Axis of a chart of one quantity over another, linear or logarithmic.

use super::scale::Scale;
use crate::report::notation::Digits;

/// Axis of a chart, linear or logarithmic.
#[derive(Clone, Debug)]
pub struct ChartAxis {
    pub label: String,
    /// Limits and ticks; of the decimal logarithm on a logarithmic axis.
    pub scale: Scale,
    pub is_logarithmic: bool,
}

impl ChartAxis {
    #[must_use]
    pub fn linear(label: &str, scale: Scale) -> ChartAxis {
        ChartAxis {
            label: label.to_owned(),
            scale,
            is_logarithmic: false,
        }
    }

    /// Share of the axis at a value, kept inside the frame; `None` for a value that has no place.
    pub fn share(&self, value: f64) -> Option<f64> {
        let placed = if self.is_logarithmic {
            value.max(f64::MIN_POSITIVE).log10()
        } else {
            value
        };
        let share = (placed - self.scale.min) / (self.scale.max - self.scale.min);
        share.is_finite().then_some(share.clamp(0.0, 1.0))
    }

    /// `true` where zero lies inside the axis.
    pub fn contains_zero(&self) -> bool {
        !self.is_logarithmic && self.scale.min < 0.0 && self.scale.max > 0.0
    }

    /// Ticks with their labels.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        let digits = Digits::of_ticks(self.scale.decimals());
        let count = ((self.scale.max - self.scale.min) / self.scale.step + 1e-6).floor();
        let first = (self.scale.min / self.scale.step - 1e-6).ceil() * self.scale.step;
        let mut ticks = Vec::new();
        let mut i = 0.0;
        while i <= count {
            let place = first + i * self.scale.step;
            i += 1.0;
            if place > self.scale.max + 1e-9 * self.scale.step {
                break;
            }
            ticks.push(if self.is_logarithmic {
                let value = 10_f64.powf(place);
                (value, format!("{value}"))
            } else {
                (place, digits.write(Some(place)))
            });
        }
        ticks
    }
}

/// Logarithmic scale of whole decades that covers values.
#[must_use]
pub fn decades(low: f64, high: f64) -> Scale {
    let least = low.max(1e-12).log10().floor();
    let most = high.max(1e-12).log10().ceil();
    Scale {
        min: least,
        max: most.max(least + 1.0),
        step: 1.0,
    }
}
