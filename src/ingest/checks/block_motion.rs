//! Motion of the aircraft in one block, as its channels describe it: the terms of the kinematic
//! relations.
//!
//! Angles are rad, everything else ft, s and g. Velocities u, v, w are V's components from the
//! angles at the c.g.

use super::block_means::BlockMeans;
use crate::aircraft::{Aircraft, Flow, Position};
use crate::earth::{Air, air, gravity_ft_s2};
use crate::flight::signal;
use crate::ingest::settings::Checks;
use crate::units::{DEG, G0_FT_S2};

/// Motion in one block.
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
    pub uvw: [f64; 3],
    pub altitude: f64,
    /// Gravity in body axes, ft/s².
    pub gravity: [f64; 3],
    /// Readings of the accelerometers, g.
    pub an: f64,
    pub ax: f64,
    pub ay: f64,
    pub mach: f64,
    pub qbar: f64,
    /// Side force that the lateral accelerometer reads, over dynamic pressure and wing area.
    pub side_force: f64,
    /// Standard atmosphere at the altitude.
    pub air: Air,
    /// Arms from the c.g. to the accelerometers (normal, axial, lateral), ft forward, right and
    /// down.
    pub arms: [[f64; 3]; 3],
}

impl BlockMotion {
    /// Motion in a block; `None` if the aircraft is not flying.
    pub fn of(
        blocks: &BlockMeans,
        block: usize,
        aircraft: &Aircraft,
        settings: &Checks,
    ) -> Option<BlockMotion> {
        let mean = |signal| blocks.mean(signal, block);
        let angle = |signal| mean(signal) / DEG;
        let velocity = mean(signal::VELOCITY);
        if velocity.abs() < settings.least_velocity_ft_s {
            return None;
        }
        let rates = [angle(signal::P), angle(signal::Q), angle(signal::R)];
        let cg = Position {
            x_ft: mean(signal::X_CG),
            y_ft: mean(signal::Y_CG),
            z_ft: mean(signal::Z_CG),
        };
        let at_vanes = Flow {
            alpha: angle(signal::ALPHA_VANE),
            beta: angle(signal::BETA_VANE),
            velocity,
            rates,
        };
        let sensors = &aircraft.sensors;
        let flow = sensors.flow_at_cg(&at_vanes, cg);
        let (sin_alpha, cos_alpha) = flow.alpha.sin_cos();
        let (sin_beta, cos_beta) = flow.beta.sin_cos();
        let (theta, phi) = (angle(signal::THETA), angle(signal::PHI));
        let altitude = mean(signal::ALTITUDE);
        let qbar = mean(signal::QBAR);
        Some(BlockMotion {
            rates,
            theta,
            phi,
            psi: angle(signal::PSI),
            velocity,
            uvw: [
                velocity * cos_alpha * cos_beta,
                velocity * sin_beta,
                velocity * sin_alpha * cos_beta,
            ],
            altitude,
            gravity: body_gravity(gravity_ft_s2(aircraft.latitude_deg, altitude), theta, phi),
            an: mean(signal::AN),
            ax: mean(signal::AX),
            ay: mean(signal::AY),
            mach: mean(signal::MACH),
            qbar,
            side_force: mean(signal::MASS) * mean(signal::AY) * G0_FT_S2
                / (qbar * aircraft.wing_area_ft2),
            air: air(altitude),
            arms: [sensors.an.arm(cg), sensors.ax.arm(cg), sensors.ay.arm(cg)],
        })
    }

    /// Specific force forward, right and down as the accelerometers read it, ft/s², without the
    /// effect of their arms.
    pub fn specific_force(&self) -> [f64; 3] {
        [self.ax * G0_FT_S2, self.ay * G0_FT_S2, -self.an * G0_FT_S2]
    }

    /// ω × (u, v, w) − gravity, ft/s²: the part of the specific force that does not change the
    /// velocity.
    pub fn turning_acceleration(&self) -> [f64; 3] {
        let turning = cross(self.rates, self.uvw);
        std::array::from_fn(|i| turning[i] - self.gravity[i])
    }

    /// ω × (ω × arm), ft/s².
    pub fn centripetal(&self, arm: [f64; 3]) -> [f64; 3] {
        cross(self.rates, self.arm_velocity(arm))
    }

    /// ω × arm, ft/s: the velocity of a sensor relative to the c.g. Its change is the sensor's own
    /// acceleration.
    pub fn arm_velocity(&self, arm: [f64; 3]) -> [f64; 3] {
        cross(self.rates, arm)
    }

    /// q sin φ + r cos φ, rad/s: the body rate about the axis of the heading.
    pub fn turn_rate(&self) -> f64 {
        self.rates[1] * self.phi.sin() + self.rates[2] * self.phi.cos()
    }

    /// Rate of climb, ft/s.
    pub fn climb_rate(&self) -> f64 {
        let [u, v, w] = self.uvw;
        let (sin_theta, cos_theta) = self.theta.sin_cos();
        let (sin_phi, cos_phi) = self.phi.sin_cos();
        u * sin_theta - v * sin_phi * cos_theta - w * cos_phi * cos_theta
    }
}

/// Gravity in body axes.
fn body_gravity(gravity: f64, theta: f64, phi: f64) -> [f64; 3] {
    let (sin_theta, cos_theta) = theta.sin_cos();
    let (sin_phi, cos_phi) = phi.sin_cos();
    [
        -gravity * sin_theta,
        gravity * cos_theta * sin_phi,
        gravity * cos_theta * cos_phi,
    ]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
