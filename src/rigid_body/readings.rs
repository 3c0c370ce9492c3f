//! Readings of perfect instruments at their positions.
//!
//! An accelerometer at r from the c.g. measures f + ω̇ × r + ω × (ω × r). A vane measures the local
//! flow, which the aircraft's rates relative to the air turn about the c.g.
#![expect(
    clippy::inline_always,
    reason = "compiled into free runs for the processor at hand"
)]

use nalgebra::Vector3;

use super::air_data::AirData;
use super::body::{BodyState, StateRate};
use super::loading::Loading;
use crate::aircraft::{Aircraft, Position, VaneFlow};
use crate::units::{DEG, G0_FT_S2};

/// Motion at one instant, as the sensors measure it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    pub state: BodyState,
    pub rate: StateRate,
    pub air: AirData,
    pub loading: Loading,
    /// Specific force at the c.g. in body axes, ft/s²: force without gravity per mass.
    pub specific_force: Vector3<f64>,
    /// Rates relative to the air, rad/s.
    pub relative_rates: Vector3<f64>,
    pub forward_thrust_lbf: f64,
}

/// Readings in deg, deg/s and g, with the signs of the signals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Readings {
    pub alpha_vane_deg: f64,
    pub beta_vane_deg: f64,
    /// Roll, pitch and yaw rate.
    pub rates_deg_s: [f64; 3],
    /// Bank, pitch attitude and heading.
    pub euler_deg: [f64; 3],
    pub an_g: f64,
    pub ax_g: f64,
    pub ay_g: f64,
}

impl Instant {
    /// Flow at the vanes.
    #[inline(always)]
    pub(super) fn flow(&self) -> VaneFlow {
        VaneFlow {
            alpha: self.air.alpha,
            beta: self.air.beta,
            velocity: self.air.velocity_ft_s,
            rates: self.relative_rates.into(),
        }
    }

    /// Readings of an aircraft's sensors.
    #[inline(always)]
    #[must_use]
    pub fn readings(&self, aircraft: &Aircraft) -> Readings {
        let sensors = &aircraft.sensors;
        let cg = self.loading.cg();
        let flow = self.flow();
        let w = self.state.rates;
        let acceleration_g = |position: Position, axis: usize| {
            let arm = Vector3::from(position.arm(cg));
            let rotation = self.rate.rates.cross(&arm) + w.cross(&w.cross(&arm));
            (self.specific_force + rotation)[axis] / G0_FT_S2
        };
        let unfelt_g = if sensors.thrust_in_ax {
            0.0
        } else {
            self.forward_thrust_lbf / self.loading.mass_slug / G0_FT_S2
        };
        let angles = self.state.euler();
        Readings {
            alpha_vane_deg: DEG * sensors.alpha_reading(&flow, cg).angle,
            beta_vane_deg: DEG * sensors.beta_reading(&flow, cg).angle,
            rates_deg_s: [DEG * w.x, DEG * w.y, DEG * w.z],
            euler_deg: [DEG * angles.phi, DEG * angles.theta, DEG * angles.psi],
            an_g: -acceleration_g(sensors.an, 2),
            ax_g: acceleration_g(sensors.ax, 0) - unfelt_g,
            ay_g: acceleration_g(sensors.ay, 1),
        }
    }
}
