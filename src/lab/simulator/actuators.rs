//! Actuators: ẍ = ω²(c − x) − 2ζω ẋ with rate and position limits.

use serde::{Deserialize, Serialize};

/// One surface's actuator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Actuator {
    pub lower_deg: f64,
    pub upper_deg: f64,
    pub rate_deg_s: f64,
    /// ω.
    pub frequency_rad_s: f64,
    /// ζ.
    pub damping: f64,
}

/// Position and rate of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceState {
    pub deg: f64,
    pub deg_s: f64,
}

/// Integration steps per control step: ω times one step stays well below 1.
const STEPS: u32 = 4;

impl Actuator {
    /// Checks the limits.
    ///
    /// # Errors
    /// The message for the first one that is wrong.
    pub fn check(&self) -> Result<(), String> {
        if self.lower_deg > self.upper_deg {
            return Err("`lower_deg` must not be above `upper_deg`".into());
        }
        if self.rate_deg_s < 0.0 {
            return Err("`rate_deg_s` must not be negative".into());
        }
        Ok(())
    }

    /// Moves a surface for a time under a constant command, by the midpoint rule.
    #[must_use]
    pub fn advance(&self, surface: SurfaceState, command_deg: f64, time_s: f64) -> SurfaceState {
        let command = command_deg.clamp(self.lower_deg, self.upper_deg);
        let h = time_s / f64::from(STEPS);
        let acceleration = |s: &SurfaceState| {
            self.frequency_rad_s
                * (self.frequency_rad_s * (command - s.deg) - 2.0 * self.damping * s.deg_s)
        };
        let mut now = surface;
        for _ in 0..STEPS {
            let half = SurfaceState {
                deg: now.deg + 0.5 * h * now.deg_s,
                deg_s: now.deg_s + 0.5 * h * acceleration(&now),
            };
            let rate =
                (now.deg_s + h * acceleration(&half)).clamp(-self.rate_deg_s, self.rate_deg_s);
            let mean_rate = half.deg_s.clamp(-self.rate_deg_s, self.rate_deg_s);
            let deg = now.deg + h * mean_rate;
            now = SurfaceState {
                deg: deg.clamp(self.lower_deg, self.upper_deg),
                deg_s: rate,
            };
            let at_stop = (now.deg <= self.lower_deg && rate < 0.0)
                || (now.deg >= self.upper_deg && rate > 0.0);
            if at_stop {
                now.deg_s = 0.0;
            }
        }
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    const STABILATOR: Actuator = Actuator {
        lower_deg: -24.0,
        upper_deg: 10.5,
        rate_deg_s: 40.0,
        frequency_rad_s: 30.74,
        damping: 0.509,
    };

    fn history(command: f64, steps: usize) -> Vec<SurfaceState> {
        let mut surface = SurfaceState::default();
        (0..steps)
            .map(|_| {
                surface = STABILATOR.advance(surface, command, 0.0125);
                surface
            })
            .collect()
    }

    #[test]
    fn a_small_step_rises_as_a_second_order_system_does() {
        // y(t) = 1 − e^(−ζωt) (cos ω_d t + ζ/√(1−ζ²) sin ω_d t).
        let (w, z): (f64, f64) = (30.74, 0.509);
        let damped = w * (1.0 - z * z).sqrt();
        for (k, surface) in history(0.5, 40).iter().enumerate() {
            let t = 0.0125 * (k + 1) as f64;
            let exact = 1.0
                - (-z * w * t).exp()
                    * ((damped * t).cos() + z / (1.0 - z * z).sqrt() * (damped * t).sin());
            assert_abs_diff_eq!(surface.deg, 0.5 * exact, epsilon = 5e-3);
        }
    }

    #[test]
    fn neither_rate_nor_position_exceeds_its_limit() {
        let moved = history(50.0, 80);
        let mut before = 0.0;
        for surface in &moved {
            assert!(surface.deg <= 10.5 && (surface.deg - before) / 0.0125 <= 40.0 + 1e-9);
            before = surface.deg;
        }
        assert_abs_diff_eq!(before, 10.5, epsilon = 1e-9);
    }
}
