//! The motion that the channels of a record describe, block by block: what the kinematic relations
//! tie together.
//!
//! Angles are rad, everything else ft, s and g. Velocities u, v, w are V's components from the
//! angles at the c.g.

use super::block_means::BlockMeans;
use crate::aircraft::{Aircraft, Flow, Position};
use crate::earth::gravity_ft_s2;
use crate::flight::signal;
use crate::ingest::atmosphere::atmosphere;
use crate::ingest::settings::Checks;
use crate::units::{DEG, G0_FT_S2};

/// The motion in one block.
#[derive(Clone, Copy, Debug)]
pub struct BlockMotion {
    /// p, q, r, rad/s.
    pub rates: [f64; 3],
    /// Rad.
    pub theta: f64,
    pub phi: f64,
    pub psi: f64,
    /// True airspeed and its components u, v, w at the c.g., ft/s.
    pub velocity: f64,
    pub along: [f64; 3],
    pub altitude: f64,
    /// Gravity in body axes, ft/s².
    pub gravity: [f64; 3],
    /// Sensor readings, g.
    pub an: f64,
    pub ax: f64,
    pub ay: f64,
    pub mach: f64,
    pub qbar: f64,
    /// Standard atmosphere at the altitude: slug/ft³ and ft/s.
    pub density: f64,
    pub sound: f64,
    /// From the c.g. to the accelerometers (normal, axial, lateral), ft forward, right and down.
    pub arms: [[f64; 3]; 3],
}

impl BlockMotion {
    /// The motion in a block; none where the aircraft is not flying.
    pub fn of(
        blocks: &BlockMeans,
        k: usize,
        aircraft: &Aircraft,
        settings: &Checks,
    ) -> Option<BlockMotion> {
        let at = |signal| blocks.at(signal, k);
        let angle = |signal| at(signal) / DEG;
        let velocity = at(signal::VELOCITY);
        if velocity.abs() < settings.least_velocity_ft_s {
            return None;
        }
        let rates = [angle(signal::P), angle(signal::Q), angle(signal::R)];
        let cg = Position {
            x_ft: at(signal::X_CG),
            y_ft: at(signal::Y_CG),
            z_ft: at(signal::Z_CG),
        };
        let read = Flow {
            alpha: angle(signal::ALPHA_VANE),
            beta: angle(signal::BETA_VANE),
            velocity,
            rates,
        };
        let flow = aircraft.sensors.flow_at_cg(&read, cg);
        let ((sa, ca), (sb, cb)) = (flow.alpha.sin_cos(), flow.beta.sin_cos());
        let (theta, phi, altitude) = (
            angle(signal::THETA),
            angle(signal::PHI),
            at(signal::ALTITUDE),
        );
        let ((st, ct), (sp, cp)) = (theta.sin_cos(), phi.sin_cos());
        let g = gravity_ft_s2(aircraft.latitude_deg, altitude);
        let (density, sound) = atmosphere(altitude);
        let s = &aircraft.sensors;
        Some(BlockMotion {
            rates,
            theta,
            phi,
            psi: angle(signal::PSI),
            velocity,
            along: [velocity * ca * cb, velocity * sb, velocity * sa * cb],
            altitude,
            gravity: [-g * st, g * ct * sp, g * ct * cp],
            an: at(signal::AN),
            ax: at(signal::AX),
            ay: at(signal::AY),
            mach: at(signal::MACH),
            qbar: at(signal::QBAR),
            density,
            sound,
            arms: [s.an.arm(cg), s.ax.arm(cg), s.ay.arm(cg)],
        })
    }

    /// The specific force at the c.g. that the accelerometers stand for, ft/s², without their arms.
    pub fn force(&self) -> [f64; 3] {
        [self.ax * G0_FT_S2, self.ay * G0_FT_S2, -self.an * G0_FT_S2]
    }

    /// ω × (u, v, w) − gravity, ft/s²: what the specific force has to balance beside the change of
    /// the velocity.
    pub fn turning(&self) -> [f64; 3] {
        let turned = cross(self.rates, self.along);
        [
            turned[0] - self.gravity[0],
            turned[1] - self.gravity[1],
            turned[2] - self.gravity[2],
        ]
    }

    /// ω × (ω × arm), ft/s².
    pub fn centripetal(&self, arm: [f64; 3]) -> [f64; 3] {
        cross(self.rates, cross(self.rates, arm))
    }

    /// ω × arm, ft/s: the velocity of a sensor relative to the c.g.; its change is the sensor's own
    /// acceleration.
    pub fn swing(&self, arm: [f64; 3]) -> [f64; 3] {
        cross(self.rates, arm)
    }

    /// The rate of climb, ft/s.
    pub fn climb(&self) -> f64 {
        let [u, v, w] = self.along;
        let ((st, ct), (sp, cp)) = (self.theta.sin_cos(), self.phi.sin_cos());
        u * st - v * sp * ct - w * cp * ct
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
