//! Sensors: what perfect instruments at their positions read of an instant, as the signals of a
//! record.
//!
//! An accelerometer away from the c.g. feels f + ω̇ × r + ω × (ω × r); a vane the flow at its
//! place.

use nalgebra::Vector3;

use super::body::State;
use super::plant::{Given, Instant};
use crate::aircraft::{Aircraft, Flow, Position};
use crate::flight::signal;
use crate::units::{DEG, G0_FT_S2};

/// The signals of an instant but for surfaces and the pilot's controls.
#[must_use]
pub fn read(
    aircraft: &Aircraft,
    state: &State,
    given: &Given,
    instant: &Instant,
) -> Vec<(&'static str, f64)> {
    let (air, loading, sensors) = (&instant.air, &instant.loading, &aircraft.sensors);
    let w = state.rates;
    let flow = Flow {
        alpha: air.alpha,
        beta: air.beta,
        velocity: air.velocity_ft_s,
        rates: [w.x, w.y, w.z],
    };
    let cg = loading.cg();
    let felt = |at: Position, axis: usize| {
        let arm = Vector3::from(at.arm(cg));
        let turning = instant.slope.rates.cross(&arm) + w.cross(&w.cross(&arm));
        (instant.specific_force + turning)[axis] / G0_FT_S2
    };
    let thrust = if sensors.thrust_in_ax {
        0.0
    } else {
        given.thrust_lbf / loading.mass_slug / G0_FT_S2
    };
    let angles = state.euler();
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
        (signal::AN, -felt(sensors.an, 2)),
        (signal::AX, felt(sensors.ax, 0) - thrust),
        (signal::AY, felt(sensors.ay, 1)),
        (signal::QBAR, air.qbar_psf),
        (signal::THRUST, given.thrust_lbf),
        (signal::RPM_LEFT, 0.5 * given.rpm),
        (signal::RPM_RIGHT, 0.5 * given.rpm),
        (signal::MASS, loading.mass_slug),
        (signal::X_CG, loading.x_cg_ft),
        (signal::Y_CG, loading.y_cg_ft),
        (signal::Z_CG, loading.z_cg_ft),
        (signal::IX, loading.ix_slug_ft2),
        (signal::IY, loading.iy_slug_ft2),
        (signal::IZ, loading.iz_slug_ft2),
        (signal::IXZ, loading.ixz_slug_ft2),
    ]
}
