//! Motion of the aircraft in one block, as its channels describe it: the terms of the kinematic
//! relations.
//!
//! Angles are rad, everything else ft, s and g. Velocities u, v, w are V's components from the
//! angles at the c.g.

use super::block_means::{BlockMeans, SignalMeans};
use crate::aircraft::{Aircraft, Position, VaneFlow};
use crate::earth::{Air, air, gravity_ft_s2};
use crate::flight::signal;
use crate::ingest::settings::Checks;
use crate::numerics::vectors::simd::vectorised;
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
    /// Air at the altitude, with the recorded temperature where there is one.
    pub air: Air,
    /// Arms from the c.g. to the accelerometers (normal, axial, lateral), ft forward, right and
    /// down.
    pub arms: [[f64; 3]; 3],
}

/// Signals of a motion, in the order in which [`Motions::in_block`] reads them.
const SIGNALS: [&str; 20] = [
    signal::VELOCITY,
    signal::P,
    signal::Q,
    signal::R,
    signal::ALPHA_VANE,
    signal::BETA_VANE,
    signal::THETA,
    signal::PHI,
    signal::PSI,
    signal::ALTITUDE,
    signal::AIR_TEMPERATURE,
    signal::AN,
    signal::AX,
    signal::AY,
    signal::MACH,
    signal::QBAR,
    signal::MASS,
    signal::X_CG,
    signal::Y_CG,
    signal::Z_CG,
];

/// Motions in all blocks of a flight. Its signals are found once: the checks of a faulty flight
/// compute all motions some hundred times.
#[derive(Debug)]
pub struct Motions<'a> {
    signals: [SignalMeans<'a>; SIGNALS.len()],
    aircraft: &'a Aircraft,
    least_velocity_ft_s: f64,
}

impl<'a> Motions<'a> {
    pub fn new(blocks: &'a BlockMeans, aircraft: &'a Aircraft, settings: &Checks) -> Motions<'a> {
        Motions {
            signals: SIGNALS.map(|signal| blocks.means_of(signal)),
            aircraft,
            least_velocity_ft_s: settings.least_velocity_ft_s,
        }
    }

    /// Motion in a block; `None` if the aircraft is not flying.
    pub fn in_block(&self, block: usize) -> Option<BlockMotion> {
        let [
            velocity,
            p,
            q,
            r,
            alpha_vane,
            beta_vane,
            theta,
            phi,
            psi,
            altitude,
            air_temperature,
            an,
            ax,
            ay,
            mach,
            qbar,
            mass,
            x_ft,
            y_ft,
            z_ft,
        ] = self.signals.map(|signal| signal.mean(block));
        if velocity.abs() < self.least_velocity_ft_s {
            return None;
        }
        let rates = [p / DEG, q / DEG, r / DEG];
        let cg = Position { x_ft, y_ft, z_ft };
        let at_vanes = VaneFlow {
            alpha: alpha_vane / DEG,
            beta: beta_vane / DEG,
            velocity,
            rates,
        };
        let aircraft = self.aircraft;
        let sensors = &aircraft.sensors;
        // Compiled for the processor at hand: elsewhere each fused multiplication is a call.
        let flow = vectorised(
            #[inline(always)]
            || sensors.flow_at_cg(&at_vanes, cg),
        );
        let (sin_alpha, cos_alpha) = flow.alpha.sin_cos();
        let (sin_beta, cos_beta) = flow.beta.sin_cos();
        let (theta, phi) = (theta / DEG, phi / DEG);
        Some(BlockMotion {
            rates,
            theta,
            phi,
            psi: psi / DEG,
            velocity,
            uvw: [
                velocity * cos_alpha * cos_beta,
                velocity * sin_beta,
                velocity * sin_alpha * cos_beta,
            ],
            altitude,
            gravity: body_gravity(gravity_ft_s2(aircraft.latitude_deg, altitude), theta, phi),
            an,
            ax,
            ay,
            mach,
            qbar,
            side_force: mass * ay * G0_FT_S2 / (qbar * aircraft.wing_area_ft2),
            air: air(altitude).at_temperature(air_temperature),
            arms: [sensors.an.arm(cg), sensors.ax.arm(cg), sensors.ay.arm(cg)],
        })
    }
}

impl BlockMotion {
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
