//! Engines: thrust lags the throttle by a first order; maximum thrust falls with density; speed is
//! linear in thrust.

use serde::{Deserialize, Serialize};

use crate::earth::air;

/// All engines together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Engine {
    /// Maximum thrust at `at_altitude_ft`.
    pub max_thrust_lbf: f64,
    pub at_altitude_ft: f64,
    /// Exponent of the density ratio in the maximum thrust.
    #[serde(default = "default_lapse")]
    pub lapse_exponent: f64,
    /// Time constant of the thrust.
    pub lag_s: f64,
    pub idle_rpm: f64,
    pub max_rpm: f64,
    /// Fuel flow per lbf of thrust; 0 keeps the mass constant.
    #[serde(default)]
    pub fuel_slug_per_lbf_s: f64,
}

fn default_lapse() -> f64 {
    0.7
}

impl Engine {
    /// Maximum thrust at an altitude, lbf.
    #[must_use]
    pub fn max_thrust(&self, altitude_ft: f64) -> f64 {
        let ratio = air(altitude_ft).density_slug_ft3 / air(self.at_altitude_ft).density_slug_ft3;
        self.max_thrust_lbf * ratio.powf(self.lapse_exponent)
    }

    /// Moves the thrust, lbf, for a time under a constant command.
    #[must_use]
    pub fn advance(&self, thrust_lbf: f64, command_lbf: f64, altitude_ft: f64, time_s: f64) -> f64 {
        let command = command_lbf.clamp(0.0, self.max_thrust(altitude_ft).max(thrust_lbf));
        command + (thrust_lbf - command) * (-time_s / self.lag_s.max(1e-6)).exp()
    }

    /// Speed of each engine, 1/min.
    #[must_use]
    pub fn rpm(&self, thrust_lbf: f64) -> f64 {
        self.idle_rpm
            + (self.max_rpm - self.idle_rpm) * (thrust_lbf / self.max_thrust_lbf).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn thrust_covers_63_percent_of_a_step_in_its_lag() {
        let engine = Engine {
            max_thrust_lbf: 13_800.0,
            at_altitude_ft: 25_000.0,
            lapse_exponent: 0.7,
            lag_s: 0.6,
            idle_rpm: 9000.0,
            max_rpm: 13_000.0,
            fuel_slug_per_lbf_s: 0.0,
        };
        let after = engine.advance(5000.0, 6000.0, 25_000.0, 0.6);
        assert_relative_eq!(after, 6000.0 - 1000.0 * (-1.0_f64).exp());
        assert!(engine.max_thrust(35_000.0) < 13_800.0 && engine.max_thrust(15_000.0) > 13_800.0);
    }
}
