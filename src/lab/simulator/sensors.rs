//! Sensors: readings of perfect instruments at their positions.
//!
//! An accelerometer at r from the c.g. measures f + ω̇ × r + ω × (ω × r); a vane measures the local
//! flow, which turns about the c.g. with the aircraft's rates relative to the air.

use nalgebra::Vector3;

use super::body::BodyState;
use super::plant::{PlantInputs, PlantOutputs};
use crate::aircraft::{Aircraft, Flow, Position};
use crate::earth;
use crate::flight::signal;
use crate::units::{DEG, G0_FT_S2};

/// Static pressure and temperature of the air: signals that air-data computers record.
pub const STATIC_PRESSURE: &str = "static_psf";
pub const AIR_TEMPERATURE: &str = "air_kelvin";

/// Signals of the motion, air data, engines and mass properties; surfaces and pilot controls are not
/// among them.
#[must_use]
pub fn readings(
    aircraft: &Aircraft,
    state: &BodyState,
    inputs: &PlantInputs,
    outputs: &PlantOutputs,
) -> Vec<(&'static str, f64)> {
    let (air, loading, sensors) = (&outputs.air, &outputs.loading, &aircraft.sensors);
    let w = state.rates;
    let relative = w - inputs.gust.rates;
    let flow = Flow {
        alpha: air.alpha,
        beta: air.beta,
        velocity: air.velocity_ft_s,
        rates: relative.into(),
    };
    let cg = loading.cg();
    let acceleration_g = |position: Position, axis: usize| {
        let arm = Vector3::from(position.arm(cg));
        let rotation = outputs.rate.rates.cross(&arm) + w.cross(&w.cross(&arm));
        (outputs.specific_force + rotation)[axis] / G0_FT_S2
    };
    let thrust = if sensors.thrust_in_ax {
        0.0
    } else {
        inputs.thrust_lbf / loading.mass_slug / G0_FT_S2
    };
    let angles = state.euler();
    let outside = earth::air(state.position.z);
    vec![
        (
            signal::ALPHA_VANE,
            DEG * sensors.alpha_reading(&flow, cg).angle,
        ),
        (
            signal::BETA_VANE,
            DEG * sensors.beta_reading(&flow, cg).angle,
        ),
        (signal::VELOCITY, air.velocity_ft_s),
        (signal::MACH, air.mach),
        (signal::ALTITUDE, state.position.z),
        (signal::P, DEG * w.x),
        (signal::Q, DEG * w.y),
        (signal::R, DEG * w.z),
        (signal::THETA, DEG * angles.theta),
        (signal::PHI, DEG * angles.phi),
        (signal::PSI, DEG * angles.psi),
        (signal::AN, -acceleration_g(sensors.an, 2)),
        (signal::AX, acceleration_g(sensors.ax, 0) - thrust),
        (signal::AY, acceleration_g(sensors.ay, 1)),
        (signal::QBAR, air.qbar_psf),
        (signal::THRUST, inputs.thrust_lbf),
        (signal::RPM_LEFT, 0.5 * inputs.rpm),
        (signal::RPM_RIGHT, 0.5 * inputs.rpm),
        (signal::MASS, loading.mass_slug),
        (signal::X_CG, loading.x_cg_ft),
        (signal::Y_CG, loading.y_cg_ft),
        (signal::Z_CG, loading.z_cg_ft),
        (signal::IX, loading.ix_slug_ft2),
        (signal::IY, loading.iy_slug_ft2),
        (signal::IZ, loading.iz_slug_ft2),
        (signal::IXZ, loading.ixz_slug_ft2),
        (STATIC_PRESSURE, outside.pressure_psf),
        (AIR_TEMPERATURE, outside.kelvin),
    ]
}
