//! Line along which the engines push.

use serde::{Deserialize, Serialize};

use super::position::Position;
use crate::units::RAD;

/// Line of the resultant thrust, in the plane of symmetry.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThrustLine {
    /// A point of the line, ft aft and above of the reference point.
    pub x_ft: f64,
    pub z_ft: f64,
    /// Angle of the force above the body x axis.
    #[serde(default)]
    pub inclination_deg: f64,
}

/// Force and moment of the thrust in body axes, about the c.g.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thrust {
    pub forward_lbf: f64,
    pub down_lbf: f64,
    /// Nose up.
    pub pitch_ft_lbf: f64,
}

impl Thrust {
    /// Thrust along the body x axis through the c.g.
    #[must_use]
    pub fn forward(thrust_lbf: f64) -> Thrust {
        Thrust {
            forward_lbf: thrust_lbf,
            down_lbf: 0.0,
            pitch_ft_lbf: 0.0,
        }
    }
}

impl ThrustLine {
    /// Thrust along this line. The moment is that of the force at the line's point: z F_x − x F_z.
    #[must_use]
    pub fn thrust(self, thrust_lbf: f64, cg: Position) -> Thrust {
        let (sin, cos) = (self.inclination_deg * RAD).sin_cos();
        let [forward, _, down] = self.point().arm(cg);
        let (forward_lbf, down_lbf) = (thrust_lbf * cos, -thrust_lbf * sin);
        Thrust {
            forward_lbf,
            down_lbf,
            pitch_ft_lbf: down * forward_lbf - forward * down_lbf,
        }
    }

    fn point(self) -> Position {
        Position {
            x_ft: self.x_ft,
            y_ft: 0.0,
            z_ft: self.z_ft,
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    const CG: Position = Position {
        x_ft: 40.0,
        y_ft: 0.0,
        z_ft: 2.0,
    };

    #[test]
    fn thrust_below_the_cg_pitches_up_and_an_inclined_one_lifts() {
        let below = ThrustLine {
            x_ft: 44.0,
            z_ft: -1.0,
            inclination_deg: 0.0,
        };
        let thrust = below.thrust(1000.0, CG);
        assert_relative_eq!(thrust.forward_lbf, 1000.0);
        assert_relative_eq!(thrust.pitch_ft_lbf, 3000.0);
        let behind = ThrustLine {
            x_ft: 44.0,
            z_ft: 2.0,
            inclination_deg: 30.0,
        };
        let thrust = behind.thrust(1000.0, CG);
        assert_relative_eq!(thrust.down_lbf, -500.0, max_relative = 1e-12);
        assert_relative_eq!(thrust.pitch_ft_lbf, -4.0 * 500.0, max_relative = 1e-12);
    }

    #[test]
    fn every_point_of_a_line_has_the_same_moment() {
        let line = ThrustLine {
            x_ft: 44.0,
            z_ft: -1.0,
            inclination_deg: 7.0,
        };
        let further = ThrustLine {
            x_ft: line.x_ft - 3.0,
            z_ft: line.z_ft + 3.0 * (7.0 * RAD).tan(),
            ..line
        };
        let (one, other) = (line.thrust(1000.0, CG), further.thrust(1000.0, CG));
        assert_relative_eq!(one.pitch_ft_lbf, other.pitch_ft_lbf, max_relative = 1e-12);
    }
}
