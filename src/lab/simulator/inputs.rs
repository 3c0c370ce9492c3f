//! Test inputs as data: pulses of alternating sign on a surface, a pilot's control or the thrust,
//! one after another.
//!
//! Two widths are a doublet; 3, 2, 1 and 1 units of time are the 3-2-1-1; a step is one wide pulse.

use serde::{Deserialize, Serialize};

/// Pulses on one signal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// The surface, pilot's control or `thrust_lbf` that moves.
    pub signal: String,
    /// Of the first pulse, in the signal's unit; the next has the opposite sign.
    pub size: f64,
    /// Of the first pulse, s on the card's clock.
    pub start_s: f64,
    pub widths_s: Vec<f64>,
    /// Time in which a pulse is reached and left: a pilot's hand.
    #[serde(default)]
    pub rise_s: f64,
}

impl Input {
    /// The deflection from trim at a time.
    #[must_use]
    pub fn at(&self, time_s: f64) -> f64 {
        let mut edge_s = self.start_s;
        let mut level = 0.0;
        let mut value = 0.0;
        let targets = (0..).map(|k| if k % 2 == 0 { self.size } else { -self.size });
        let levels = targets.take(self.widths_s.len()).chain([0.0]);
        for (target, width) in levels.zip(self.widths_s.iter().chain([&0.0])) {
            let moved = if self.rise_s > 0.0 {
                ((time_s - edge_s) / self.rise_s).clamp(0.0, 1.0)
            } else {
                f64::from(u8::from(time_s >= edge_s))
            };
            value += (target - level) * moved;
            level = target;
            edge_s += width;
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn pulses_alternate_and_end_at_trim() {
        let mut input = Input {
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
            assert_abs_diff_eq!(input.at(time_s), value);
        }
        input.rise_s = 0.2;
        for (time_s, value) in [(2.1, 2.0), (2.3, 4.0), (3.6, 0.0), (3.8, -4.0), (9.0, 0.0)] {
            assert_abs_diff_eq!(input.at(time_s), value, epsilon = 1e-9);
        }
    }
}
