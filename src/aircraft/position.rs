//! Points of the aircraft.

use serde::{Deserialize, Serialize};

/// A point of the aircraft, ft aft, right and above of the reference point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Position {
    pub x_ft: f64,
    pub y_ft: f64,
    pub z_ft: f64,
}

impl Position {
    /// Arm from the c.g. to this point in body axes, ft forward, right and down.
    #[must_use]
    pub fn arm(self, cg: Position) -> [f64; 3] {
        [
            cg.x_ft - self.x_ft,
            self.y_ft - cg.y_ft,
            cg.z_ft - self.z_ft,
        ]
    }
}
