//! Inversion of the vanes over a maneuver: α and β at the c.g. from the local flow at the vanes.
#![expect(
    clippy::inline_always,
    reason = "laid out by vectors for the processor at hand"
)]

use pulp::{Simd, WithSimd};

use crate::aircraft::{Position, Sensors, VaneFlow};
use crate::flight::signal;
use crate::units::RAD;

/// Signals that the angles of the flow at the c.g. follow from.
pub const FLOW_SIGNALS: [&str; 9] = [
    signal::ALPHA_VANE,
    signal::BETA_VANE,
    signal::VELOCITY,
    signal::P,
    signal::Q,
    signal::R,
    signal::X_CG,
    signal::Y_CG,
    signal::Z_CG,
];

/// Inversion of the vanes at every point, compiled for the processor at hand.
pub struct VaneInversion<'a> {
    pub sensors: &'a Sensors,
    pub signals: [&'a [f64]; FLOW_SIGNALS.len()],
    pub points: usize,
}

impl WithSimd for VaneInversion<'_> {
    type Output = Vec<[f64; 2]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<[f64; 2]> {
        let mut angles = Vec::with_capacity(self.points);
        let [alpha, beta, velocity, p, q, r, x_ft, y_ft, z_ft] = self.signals;
        for i in 0..self.points {
            let read = VaneFlow {
                alpha: alpha[i] * RAD,
                beta: beta[i] * RAD,
                velocity: velocity[i],
                rates: [p[i] * RAD, q[i] * RAD, r[i] * RAD],
            };
            let cg = Position {
                x_ft: x_ft[i],
                y_ft: y_ft[i],
                z_ft: z_ft[i],
            };
            let flow = self.sensors.flow_at_cg(&read, cg);
            angles.push([flow.alpha, flow.beta]);
        }
        angles
    }
}
