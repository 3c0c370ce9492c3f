//! Reference dimensions, engines, sensors and vanes of an aircraft.

use serde::{Deserialize, Serialize};

use super::position::Position;
use super::thrust_line::{Thrust, ThrustLine};

/// Reference dimensions, engines and sensors of one aircraft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aircraft {
    pub name: String,
    /// Reference area S.
    pub wing_area_ft2: f64,
    /// Reference span b, of the rolling and yawing moments and of p and r.
    pub span_ft: f64,
    /// Reference chord c̄, of the pitching moment and of q.
    pub chord_ft: f64,
    /// `I_xe` of one engine. The gyroscopic moment is that of both engines; zero omits it.
    #[serde(default)]
    pub engine_inertia_slug_ft2: f64,
    /// Line of the thrust; `None` is the body x axis through the c.g.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thrust_line: Option<ThrustLine>,
    /// Latitude of the campaign; gravity depends on it.
    pub latitude_deg: f64,
    pub sensors: Sensors,
}

impl Aircraft {
    /// Force and moment of a thrust.
    #[must_use]
    pub fn thrust(&self, thrust_lbf: f64, cg: Position) -> Thrust {
        match self.thrust_line {
            Some(line) => line.thrust(thrust_lbf, cg),
            None => Thrust::forward(thrust_lbf),
        }
    }
}

/// Positions of the sensors and equations of the vanes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    pub an: Position,
    pub ax: Position,
    pub ay: Position,
    pub alpha_vane: Vane,
    pub beta_vane: Vane,
    /// Equations of the vanes: `exact` local velocity at the vane, or the paper's small-angle forms
    /// 2.9 and 3.8.
    #[serde(default)]
    pub vane_model: VaneModel,
    /// Thrust in the axial accelerometer's equation. An accelerometer measures thrust; `false`
    /// reproduces the print of eq. 2.8.
    #[serde(default = "default_true")]
    pub thrust_in_ax: bool,
}

fn default_true() -> bool {
    true
}

/// A flow vane: its position, and the factor by which upwash or sidewash multiplies the local
/// angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vane {
    pub x_ft: f64,
    pub y_ft: f64,
    pub z_ft: f64,
    /// `k_alpha` or `k_beta`.
    pub factor: f64,
}

impl Vane {
    #[must_use]
    pub fn position(self) -> Position {
        Position {
            x_ft: self.x_ft,
            y_ft: self.y_ft,
            z_ft: self.z_ft,
        }
    }
}

/// Model of the flow vanes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VaneModel {
    /// Angle of the local velocity at the vane, times its factor.
    #[default]
    Exact,
    /// Eqs. 2.9 and 3.8 of the paper, linear in the rates.
    SmallAngle,
}
