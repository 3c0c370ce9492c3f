//! Test inputs: a train of pulses of alternating sign on a surface, a pilot control or the thrust.
//!
//! Two pulses make a doublet; widths in the ratio 3, 2, 1, 1 make a 3-2-1-1; one wide pulse makes a
//! step.

use serde::{Deserialize, Serialize};

/// A pulse train on one signal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestInput {
    /// Signal that the input moves: a surface, a pilot control, or `thrust_lbf`.
    pub signal: String,
    /// Amplitude of the first pulse, in the signal's unit; the sign alternates from pulse to pulse.
    pub size: f64,
    /// Start of the first pulse on the card's clock.
    pub start_s: f64,
    pub widths_s: Vec<f64>,
    /// Duration of each change of level; models a pilot's hand.
    #[serde(default)]
    pub rise_s: f64,
}

impl TestInput {
    /// Deflection from trim at a time on the card's clock.
    #[must_use]
    pub fn deflection_at(&self, time_s: f64) -> f64 {
        let mut edge_s = self.start_s;
        let mut level = 0.0;
        let mut deflection = 0.0;
        let targets = (0..).map(|k| if k % 2 == 0 { self.size } else { -self.size });
        let levels = targets.take(self.widths_s.len()).chain([0.0]);
        for (target, width) in levels.zip(self.widths_s.iter().chain([&0.0])) {
            let reached = if self.rise_s > 0.0 {
                ((time_s - edge_s) / self.rise_s).clamp(0.0, 1.0)
            } else {
                f64::from(u8::from(time_s >= edge_s))
            };
            deflection += (target - level) * reached;
            level = target;
            edge_s += width;
        }
        deflection
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn pulses_alternate_and_end_at_trim() {
        let mut input = TestInput {
            signal: String::new(),
            size: 4.0,
            start_s: 2.0,
            widths_s: vec![1.5, 1.0, 0.5, 0.5],
            rise_s: 0.0,
        };
        for (time_s, value) in [
            (1.9, 0.0),
            (2.1, 4.0),
            (3.6, -4.0),
            (4.6, 4.0),
            (5.1, -4.0),
            (5.6, 0.0),
        ] {
            assert_abs_diff_eq!(input.deflection_at(time_s), value);
        }
        input.rise_s = 0.2;
        for (time_s, value) in [(2.1, 2.0), (2.3, 4.0), (3.6, 0.0), (3.8, -4.0), (9.0, 0.0)] {
            assert_abs_diff_eq!(input.deflection_at(time_s), value, epsilon = 1e-9);
        }
    }
}
