//! Sensors: every recorded signal of the motion, as perfect instruments at their positions read it.

use super::plant::{PlantInputs, PlantOutputs};
use crate::aircraft::Aircraft;
use crate::earth;
use crate::flight::signal;
use crate::rigid_body::{BodyState, Instant};

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
    let (air, loading) = (&outputs.air, &outputs.loading);
    let read = Instant {
        state: *state,
        rate: outputs.rate,
        air: *air,
        loading: *loading,
        specific_force: outputs.specific_force,
        relative_rates: state.rates - inputs.gust.rates,
        forward_thrust_lbf: aircraft.thrust(inputs.thrust_lbf, loading.cg()).forward_lbf,
    }
    .readings(aircraft);
    let [p, q, r] = read.rates_deg_s;
    let [phi, theta, psi] = read.euler_deg;
    let outside = earth::air(state.position.z);
    vec![
        (signal::ALPHA_VANE, read.alpha_vane_deg),
        (signal::BETA_VANE, read.beta_vane_deg),
        (signal::VELOCITY, air.velocity_ft_s),
        (signal::MACH, air.mach),
        (signal::ALTITUDE, state.position.z),
        (signal::P, p),
        (signal::Q, q),
        (signal::R, r),
        (signal::THETA, theta),
        (signal::PHI, phi),
        (signal::PSI, psi),
        (signal::AN, read.an_g),
        (signal::AX, read.ax_g),
        (signal::AY, read.ay_g),
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
