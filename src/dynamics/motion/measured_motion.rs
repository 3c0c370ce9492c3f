//! Measured motion of a maneuver: the signals of each point in the units of the equations.
#![expect(
    clippy::inline_always,
    reason = "laid out by vectors for the processor at hand"
)]

use super::instant::Motion;
use crate::aircraft::{Aircraft, Position};
use crate::dynamics::lever::lever;
use crate::units::{G0_FT_S2, RAD};

/// Measured motion of a maneuver.
pub struct MeasuredMotion<'a, G: Fn(f64) -> f64> {
    pub(super) aircraft: &'a Aircraft,
    pub(super) signals: Signals<'a>,
    pub(super) gravity: G,
    pub(super) points: usize,
}

impl<G: Fn(f64) -> f64> std::fmt::Debug for MeasuredMotion<'_, G> {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} points", self.points)
    }
}

impl<G: Fn(f64) -> f64> MeasuredMotion<'_, G> {
    /// Motion at one point.
    #[inline(always)]
    pub fn at(&self, point: usize) -> Motion {
        let accelerations = self.signals.slopes.map(|s| s[point] * RAD);
        let gravity = &self.gravity;
        self.signals
            .at(self.aircraft, gravity, point, accelerations)
    }

    /// Motion at one point as it would be measured without angular accelerations.
    #[inline(always)]
    pub fn without_angular_accelerations(&self, point: usize) -> Motion {
        let gravity = &self.gravity;
        self.signals.at(self.aircraft, gravity, point, [0.0; 3])
    }

    /// Motion at every point in order.
    pub fn points(&self) -> impl Iterator<Item = Motion> {
        (0..self.points).map(|point| self.at(point))
    }
}

/// Signals of a maneuver, grouped by use.
pub struct Signals<'a> {
    pub flow: &'a [[f64; 2]],
    pub velocity: &'a [f64],
    pub rates: [&'a [f64]; 3],
    pub slopes: [&'a [f64]; 3],
    pub attitude: [&'a [f64]; 2],
    pub forces: [&'a [f64]; 3],
    pub air: [&'a [f64]; 2],
    pub engines: [&'a [f64]; 3],
    pub mass: &'a [f64],
    pub cg: [&'a [f64]; 3],
    pub inertia: [&'a [f64]; 4],
}

impl Signals<'_> {
    /// Motion at point `i` with these angular accelerations.
    #[inline(always)]
    fn at(
        &self,
        aircraft: &Aircraft,
        gravity: impl Fn(f64) -> f64,
        i: usize,
        accelerations: [f64; 3],
    ) -> Motion {
        let rates = self.rates.map(|s| s[i] * RAD);
        let [x_ft, y_ft, z_ft] = self.cg.map(|s| s[i]);
        let cg = Position { x_ft, y_ft, z_ft };
        let [alpha, beta] = self.flow[i];
        let lever_effect =
            |i: usize, sensor: Position| lever(i, sensor.arm(cg), rates, accelerations).value;
        let [thrust, rpm_left, rpm_right] = self.engines.map(|s| s[i]);
        let thrust = aircraft.thrust(thrust, cg);
        let [altitude, qbar] = self.air.map(|s| s[i]);
        let [ix, iy, iz, ixz] = self.inertia.map(|s| s[i]);
        let [ax, ay, an] = self.forces.map(|s| s[i]);
        let mass = self.mass[i];
        // With an accelerometer that does not sense thrust (the print of 2.8), thrust is added
        // here.
        let unmeasured_thrust = if aircraft.sensors.thrust_in_ax {
            0.0
        } else {
            thrust.forward_lbf * (1.0 / mass)
        };
        Motion {
            alpha,
            beta,
            velocity: self.velocity[i],
            rates,
            accelerations,
            theta: self.attitude[0][i] * RAD,
            phi: self.attitude[1][i] * RAD,
            force_x: G0_FT_S2 * ax - lever_effect(0, aircraft.sensors.ax) + unmeasured_thrust,
            force_y: G0_FT_S2 * ay - lever_effect(1, aircraft.sensors.ay),
            force_z: -G0_FT_S2 * an - lever_effect(2, aircraft.sensors.an),
            gravity: gravity(altitude),
            qbar,
            mass,
            thrust,
            ix,
            iy,
            iz,
            ixz,
            engine_momentum: aircraft.engine_inertia_slug_ft2
                * (rpm_left + rpm_right)
                * (2.0 * std::f64::consts::PI / 60.0),
            cg,
        }
    }
}
