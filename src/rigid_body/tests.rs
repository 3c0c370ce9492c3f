//! Changes to first order against differences.

use approx::assert_relative_eq;
use nalgebra::{Quaternion, Vector3};
use pulp::Scalar;

use super::first_order_changes::attitude;
use super::{
    AirData, AirSlopes, BodySlopes, BodyState, CHANGING, Euler, Instant, Loading, Loads,
    ReadingSlopes, StateChange, body,
};
use crate::aircraft::{Aircraft, Position, Sensors, Vane, VaneModel};
use crate::earth;
use crate::numerics::vectors::lanes::Lanes;

const LOADING: Loading = Loading {
    mass_slug: 1025.0,
    x_cg_ft: 38.2,
    y_cg_ft: 0.1,
    z_cg_ft: 8.7,
    ix_slug_ft2: 22_300.0,
    iy_slug_ft2: 172_900.0,
    iz_slug_ft2: 187_600.0,
    ixz_slug_ft2: -2073.0,
};

/// Force and moment that grow with every state, so that the rate has all its slopes.
const FORCE: [f64; 3] = [-3e3, 500.0, -3e4];
const MOMENT: [f64; 3] = [2e3, -4e3, 1e3];
const STEP: f64 = 1e-5;

fn aircraft(vane_model: VaneModel) -> Aircraft {
    let position = |x_ft: f64, y_ft: f64, z_ft: f64| Position { x_ft, y_ft, z_ft };
    let vane = |y_ft: f64, factor: f64| Vane {
        x_ft: 35.4,
        y_ft,
        z_ft: 7.9,
        factor,
    };
    Aircraft {
        name: String::new(),
        wing_area_ft2: 400.0,
        span_ft: 37.4,
        chord_ft: 11.5,
        engine_inertia_slug_ft2: 0.0,
        thrust_line: None,
        latitude_deg: 34.9,
        sensors: Sensors {
            an: position(31.4, 0.3, 6.9),
            ax: position(30.4, -0.2, 7.2),
            ay: position(29.0, 0.1, 9.0),
            alpha_vane: vane(19.2, 1.02),
            beta_vane: vane(-19.2, 0.98),
            vane_model,
            thrust_in_ax: true,
        },
    }
}

fn state() -> BodyState {
    BodyState {
        velocity: AirData::velocity(450.0, 0.5, 0.08),
        rates: Vector3::new(0.4, -0.15, 0.2),
        attitude: Euler {
            phi: 0.6,
            theta: 0.3,
            psi: 0.9,
        }
        .attitude(),
        position: Vector3::new(0.0, 0.0, 25_000.0),
    }
}

/// The state with one of its changing states changed.
fn moved(state: &BodyState, place: usize, by: f64) -> BodyState {
    let mut moved = *state;
    match place {
        0..3 => moved.velocity[place] += by,
        3..6 => moved.rates[place - 3] += by,
        6..10 => moved.attitude.coords[place - 6] += by,
        _ => moved.position.z += by,
    }
    moved
}

fn changing(rate: &BodyState) -> [f64; CHANGING] {
    let mut all = [0.0; CHANGING];
    all[..3].copy_from_slice(rate.velocity.as_slice());
    all[3..6].copy_from_slice(rate.rates.as_slice());
    all[6..10].copy_from_slice(rate.attitude.coords.as_slice());
    all[10] = rate.position.z;
    all
}

fn lanes<const N: usize>(values: [f64; N]) -> [Lanes<Scalar>; N] {
    values.map(|value| Lanes::load(Scalar::new(), &[value], 0))
}

fn value(lanes: Lanes<Scalar>) -> f64 {
    let mut value = [0.0];
    lanes.store(&mut value, 0);
    value[0]
}

/// Change of one state alone.
fn unit(place: usize) -> StateChange<Scalar> {
    let mut change = [0.0; CHANGING];
    change[place] = 1.0;
    StateChange(lanes(change))
}

fn air(state: &BodyState) -> AirData {
    AirData::new(&state.velocity, state.position.z)
}

/// Loads in proportion to dynamic pressure.
fn instant(state: &BodyState) -> Instant {
    let air = air(state);
    let force = Vector3::from(FORCE) * (air.qbar_psf / 100.0);
    let loads = Loads {
        force,
        moment: Vector3::from(MOMENT) * (air.qbar_psf / 100.0),
        engine_momentum: 7500.0,
        gravity_ft_s2: 32.1,
    };
    Instant {
        state: *state,
        rate: body::state_rate(state, &LOADING.mass(), &loads),
        air,
        loading: LOADING,
        specific_force: force / LOADING.mass_slug,
        relative_rates: state.rates,
        forward_thrust_lbf: 0.0,
    }
}

/// Step of a state for its difference.
fn step(place: usize) -> f64 {
    if place == 10 { 1e3 * STEP } else { STEP }
}

/// Quaternions of any length, and one of unit length.
fn states() -> [BodyState; 2] {
    let mut long = state();
    long.attitude = Quaternion::from(long.attitude.coords * 1.1);
    [state(), long]
}

#[test]
fn changes_of_air_and_rate_are_those_of_differences() {
    for state in states() {
        let at = instant(&state);
        let slopes = AirSlopes::new(&state, &at.air);
        let body = BodySlopes::new(&state, &LOADING.mass(), 7500.0, 32.1);
        for place in 0..CHANGING {
            let h = step(place);
            let (up, down) = (
                instant(&moved(&state, place, h)),
                instant(&moved(&state, place, -h)),
            );
            let difference =
                |of: &dyn Fn(&AirData) -> f64| (of(&up.air) - of(&down.air)) / (2.0 * h);
            let change = slopes.change(&unit(place));
            for (own, expected) in [
                (change.alpha, difference(&|a| a.alpha)),
                (change.beta, difference(&|a| a.beta)),
                (change.velocity, difference(&|a| a.velocity_ft_s)),
                (change.mach, difference(&|a| a.mach)),
                (change.relative_qbar, difference(&|a| a.qbar_psf.ln())),
            ] {
                assert_relative_eq!(value(own), expected, epsilon = 1e-9, max_relative = 1e-6);
            }
            let loads = [FORCE, MOMENT].map(|own| {
                let per_qbar = at.air.qbar_psf / 100.0;
                own.map(|own| change.relative_qbar * (own * per_qbar))
            });
            let own = body.change(&unit(place), &loads[0], &loads[1]);
            let (up, down) = (changing(&up.rate), changing(&down.rate));
            for i in 0..CHANGING {
                let expected = (up[i] - down[i]) / (2.0 * h);
                assert_relative_eq!(
                    value(own.0[i]),
                    expected,
                    epsilon = 1e-6,
                    max_relative = 1e-6
                );
            }
        }
    }
}

#[test]
fn changes_of_the_readings_are_those_of_differences() {
    for aircraft in [VaneModel::Exact, VaneModel::SmallAngle].map(aircraft) {
        let state = state();
        let at = instant(&state);
        let slopes = ReadingSlopes::new(&at, &aircraft);
        let air = AirSlopes::new(&state, &at.air);
        let body = BodySlopes::new(&state, &LOADING.mass(), 7500.0, 32.1);
        for place in 0..CHANGING {
            let h = step(place);
            let [up, down] =
                [h, -h].map(|by| instant(&moved(&state, place, by)).readings(&aircraft));
            let change = air.change(&unit(place));
            let [force, moment] = [FORCE, MOMENT].map(|own| {
                let per_qbar = at.air.qbar_psf / 100.0;
                own.map(|own| change.relative_qbar * (own * per_qbar))
            });
            let rate = body.change(&unit(place), &force, &moment);
            let own = slopes.change(&unit(place), &rate, &change, &force);
            for (own, up, down) in [
                (own.alpha_vane_deg, up.alpha_vane_deg, down.alpha_vane_deg),
                (own.beta_vane_deg, up.beta_vane_deg, down.beta_vane_deg),
                (own.rates_deg_s[0], up.rates_deg_s[0], down.rates_deg_s[0]),
                (own.rates_deg_s[1], up.rates_deg_s[1], down.rates_deg_s[1]),
                (own.rates_deg_s[2], up.rates_deg_s[2], down.rates_deg_s[2]),
                (own.euler_deg[0], up.euler_deg[0], down.euler_deg[0]),
                (own.euler_deg[1], up.euler_deg[1], down.euler_deg[1]),
                (own.an_g, up.an_g, down.an_g),
                (own.ax_g, up.ax_g, down.ax_g),
                (own.ay_g, up.ay_g, down.ay_g),
            ] {
                let expected = (up - down) / (2.0 * h);
                assert_relative_eq!(value(own), expected, epsilon = 1e-6, max_relative = 1e-6);
            }
        }
    }
}

#[test]
fn a_change_of_the_attitude_is_normalised_as_the_attitude_is() {
    let long = states()[1];
    for place in 0..CHANGING {
        let [up, down] = [STEP, -STEP].map(|by| changing(&moved(&long, place, by).normalised()));
        let own = unit(place).normalised(&attitude(&long));
        for i in 0..CHANGING {
            let expected = (up[i] - down[i]) / (2.0 * STEP);
            assert_relative_eq!(value(own.0[i]), expected, epsilon = 1e-5);
        }
    }
}

#[test]
fn calibrated_airspeed_is_that_of_the_same_impact_pressure_at_sea_level() {
    let at = |mach: f64, altitude_ft: f64| {
        let qbar_psf = 0.7 * earth::air(altitude_ft).pressure_psf * mach * mach;
        AirData::calibrated_kt(mach, qbar_psf)
    };
    // At sea level the true airspeed: the speed of sound is 661.48 kt.
    assert_relative_eq!(at(0.3, 0.0), 0.3 * 661.48, max_relative = 1e-4);
    // Pressure of 0.2975 atmospheres: impact pressure of 0.5243 times that.
    assert_relative_eq!(at(0.8, 30_000.0), 304.1, max_relative = 1e-3);
}
