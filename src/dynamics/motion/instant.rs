//! Motion of the aircraft at one instant.

use crate::aircraft::{Position, Thrust};

/// Motion at one instant, in rad, rad/s, rad/s², ft, ft/s, slug, lbf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// At the c.g., from the vanes.
    pub alpha: f64,
    pub beta: f64,
    pub velocity: f64,
    pub rates: [f64; 3],
    /// Angular accelerations: slopes of the measured rates.
    pub accelerations: [f64; 3],
    pub theta: f64,
    pub phi: f64,
    /// Specific forces at the c.g. forward, right and down, from the accelerometers, ft/s².
    pub force_x: f64,
    pub force_y: f64,
    pub force_z: f64,
    pub gravity: f64,
    pub qbar: f64,
    pub mass: f64,
    pub thrust: Thrust,
    pub ix: f64,
    pub iy: f64,
    pub iz: f64,
    pub ixz: f64,
    /// Angular momentum of both engines along +x, slug ft²/s.
    pub engine_momentum: f64,
    pub cg: Position,
}
