//! The aircraft as the equations see it: reference dimensions, engines, sensor positions, and where
//! on earth it flies.
//!
//! Positions are in ft, positive aft (x), right (y) and above (z) of a reference point about 5 ft
//! ahead of the nose.

mod vanes;

pub use vanes::{Flow, Reading};

use serde::{Deserialize, Serialize};

/// Reference dimensions, engines and sensors of one aircraft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aircraft {
    pub name: String,
    /// S.
    pub wing_area_ft2: f64,
    /// b, for the rolling and yawing moments and p, r.
    pub span_ft: f64,
    /// c̄, for the pitching moment and q.
    pub chord_ft: f64,
    /// `I_xe` of one engine; the gyroscopic moment takes the sum of both engines' momenta.
    pub engine_inertia_slug_ft2: f64,
    /// Where the campaign is flown; gravity depends on it.
    pub latitude_deg: f64,
    pub sensors: Sensors,
}

/// Where the sensors stand and how the vanes read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    pub an: Position,
    pub ax: Position,
    pub ay: Position,
    pub alpha_vane: Vane,
    pub beta_vane: Vane,
    /// What the vane equations are: `exact` local velocity at the vane, or the paper's small-angle
    /// forms 2.9 and 3.8.
    #[serde(default)]
    pub vane_model: VaneModel,
    /// Whether the axial accelerometer feels thrust (it does; `false` reproduces the print of eq.
    /// 2.8).
    #[serde(default = "yes")]
    pub thrust_in_ax: bool,
}

fn yes() -> bool {
    true
}

/// A point of the aircraft, ft aft, right and above of the reference point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Position {
    pub x_ft: f64,
    pub y_ft: f64,
    pub z_ft: f64,
}

/// A flow vane: where it stands, and the factor by which upwash or sidewash makes it read more than
/// the local angle.
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

/// How the flow vanes are modelled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VaneModel {
    /// The angle of the local velocity at the vane, times its factor.
    #[default]
    Exact,
    /// The paper's eqs. 2.9 and 3.8, linear in the rates.
    SmallAngle,
}

impl Position {
    /// The arm from the c.g. to this point in body axes, ft forward, right and down.
    #[must_use]
    pub fn arm(self, cg: Position) -> [f64; 3] {
        [
            cg.x_ft - self.x_ft,
            self.y_ft - cg.y_ft,
            cg.z_ft - self.z_ft,
        ]
    }
}
