//! Kinematic equations of flight and the instruments' readings, with exact slopes; no aerodynamics.
//!
//! Over the turning earth, with ω the inertial body rates, Ω the earth's, n the navigation frame's
//! and f the specific force:
//!
//! - v̇ = f + g − (ω + Ω) × v, with v relative to the air, whose wind may change at a steady rate
//! - φ̇ = p' + tan θ (q' sin φ + r' cos φ), θ̇ = q' cos φ − r' sin φ, ψ̇ = (q' sin φ + r' cos φ)/cos θ, with ω' = ω − n
//! - ḣ = u sin θ − v sin φ cos θ − w cos φ cos θ
//!
//! An accelerometer on an arm r also measures ω̇ × r. Each velocity component of the state is the
//! velocity at that component's sensor, `s_i` = (v + ω × `r_i`)_i. Its rate contains no ω̇, so that
//! no body rate is differentiated.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::parameters::{INPUTS, OUTPUTS, input, output};
use crate::aircraft::{Aircraft, Position, VaneFlow};
use crate::dynamics::lever;
use crate::earth::{Air, air, air_gradients};
use crate::numerics::trig::sin_cos;
use crate::units::DEG;

/// Places of the states: three velocities at the sensors (ft/s), φ, θ, ψ (rad), altitude (ft).
pub mod state {
    pub const U: usize = 0;
    pub const V: usize = 1;
    pub const W: usize = 2;
    pub const PHI: usize = 3;
    pub const THETA: usize = 4;
    pub const PSI: usize = 5;
    pub const ALTITUDE: usize = 6;
}

pub const STATES: usize = 7;

pub type State = SVector<f64, STATES>;

/// Terms of the equations that are computed from the measured motion at a sample: their effect is
/// so weak that the measurement is accurate enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredTerms {
    /// ft/s².
    pub gravity: f64,
    /// Arms from the c.g. to the axial, lateral and normal accelerometer, ft forward, right, down.
    pub arms: [[f64; 3]; 3],
    pub cg: Position,
    /// The earth's rotation, and that of the local horizon, in body axes, rad/s.
    pub earth: Vector3<f64>,
    pub horizon: Vector3<f64>,
    /// Rotation from north, east, down to body axes.
    pub to_body: Matrix3<f64>,
    /// Recorded temperature of the air over that of the standard atmosphere; one without a record.
    pub temperature_ratio: f64,
}

/// p, q, r (rad/s) and specific force forward, right, down at the sensors (ft/s²).
pub type Inputs = [f64; INPUTS];

/// Slopes of the states' rates along states and inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateSlopes {
    pub by_state: SMatrix<f64, STATES, STATES>,
    pub by_input: SMatrix<f64, STATES, INPUTS>,
}

/// Slopes of the output instruments' readings along states and body rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadingSlopes {
    pub by_state: SMatrix<f64, OUTPUTS, STATES>,
    pub by_rates: SMatrix<f64, OUTPUTS, 3>,
}

/// Velocity in body axes.
const VELOCITY: [usize; 3] = [state::U, state::V, state::W];
/// Velocity and altitude.
const VELOCITY_AND_ALTITUDE: [usize; 4] = [state::U, state::V, state::W, state::ALTITUDE];
/// Body rates.
const RATES: [usize; 3] = [input::P, input::Q, input::R];

/// States along which the rate of each state can have a slope.
pub const RATES_BY_STATE: [&[usize]; STATES] = [
    &[state::V, state::W, state::THETA],
    &[state::U, state::W, state::PHI, state::THETA],
    &[state::U, state::V, state::PHI, state::THETA],
    &[state::PHI, state::THETA],
    &[state::PHI],
    &[state::PHI, state::THETA],
    &[state::U, state::V, state::W, state::PHI, state::THETA],
];
/// Inputs along which the rate of each state can have a slope.
pub const RATES_BY_INPUT: [&[usize]; STATES] = [
    &[input::P, input::Q, input::R, input::FORWARD],
    &[input::P, input::Q, input::R, input::RIGHT],
    &[input::P, input::Q, input::R, input::DOWN],
    &RATES,
    &[input::Q, input::R],
    &[input::Q, input::R],
    &RATES,
];
/// States along which each reading can have a slope.
pub const READINGS_BY_STATE: [&[usize]; OUTPUTS] = [
    &VELOCITY,
    &VELOCITY,
    &VELOCITY,
    &[state::THETA],
    &[state::PHI],
    &[state::PSI],
    &[state::ALTITUDE],
    &VELOCITY_AND_ALTITUDE,
    &VELOCITY_AND_ALTITUDE,
];
/// Body rates along which each reading can have a slope.
pub const READINGS_BY_RATES: [&[usize]; OUTPUTS] =
    [&RATES, &RATES, &RATES, &[], &[], &[], &[], &RATES, &RATES];

#[inline(always)]
fn body_rates(input: &Inputs) -> Vector3<f64> {
    Vector3::new(input[input::P], input[input::Q], input[input::R])
}

/// Velocity at the c.g. and its slopes along ω.
#[inline(always)]
fn velocity_at_cg(
    x: &State,
    omega: Vector3<f64>,
    terms: &MeasuredTerms,
) -> (Vector3<f64>, Matrix3<f64>) {
    let mut velocity = Vector3::new(x[state::U], x[state::V], x[state::W]);
    let mut by_rates = Matrix3::zeros();
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let arm = terms.arms[i];
        velocity[i] -= omega[j] * arm[k] - omega[k] * arm[j];
        by_rates[(i, j)] = -arm[k];
        by_rates[(i, k)] = arm[j];
    }
    (velocity, by_rates)
}

/// Computes the rates of the states.
#[inline(always)]
pub fn rates(x: &State, input: &Inputs, terms: &MeasuredTerms) -> State {
    let omega = body_rates(input);
    let (v, _) = velocity_at_cg(x, omega, terms);
    let [(sp, cp), (st, ct)] = sin_cos([x[state::PHI], x[state::THETA]]);
    let g = terms.gravity;
    let gravity = [-g * st, g * ct * sp, g * ct * cp];
    let turned = (omega + terms.earth).cross(&v);
    let mut rates = State::zeros();
    for i in 0..3 {
        let swing = lever(i, terms.arms[i], [omega.x, omega.y, omega.z], [0.0; 3]);
        rates[i] = input[input::FORWARD + i] - swing.value + gravity[i] - turned[i];
    }
    let w = omega - terms.horizon;
    let (along, across) = (w.y * sp + w.z * cp, w.y * cp - w.z * sp);
    rates[state::PHI] = w.x + st / ct * along;
    rates[state::THETA] = across;
    rates[state::PSI] = along / ct;
    rates[state::ALTITUDE] = v.x * st - v.y * sp * ct - v.z * cp * ct;
    rates
}

/// Computes the slopes of the states' rates.
#[inline(always)]
pub fn rate_slopes(x: &State, input: &Inputs, terms: &MeasuredTerms) -> RateSlopes {
    let omega = body_rates(input);
    let (velocity, velocity_by_rates) = velocity_at_cg(x, omega, terms);
    let [(sp, cp), (st, ct)] = sin_cos([x[state::PHI], x[state::THETA]]);
    let g = terms.gravity;
    let turning = omega + terms.earth;
    let mut out = RateSlopes {
        by_state: SMatrix::zeros(),
        by_input: SMatrix::zeros(),
    };
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        // Slopes of −(ω + Ω) × v along v, and along ω, which also changes v; zeros are left out.
        out.by_state[(i, j)] = turning[k];
        out.by_state[(i, k)] = -turning[j];
        let velocity_by_rate = |rate: usize, component: usize| velocity_by_rates[(component, rate)];
        let swing = lever(i, terms.arms[i], [omega.x, omega.y, omega.z], [0.0; 3]);
        out.by_input[(i, i)] = turning[k] * velocity_by_rate(i, j)
            - turning[j] * velocity_by_rate(i, k)
            - swing.by_rates[i];
        out.by_input[(i, j)] =
            -velocity[k] - turning[j] * velocity_by_rate(j, k) - swing.by_rates[j];
        out.by_input[(i, k)] =
            velocity[j] + turning[k] * velocity_by_rate(k, j) - swing.by_rates[k];
        out.by_input[(i, input::FORWARD + i)] = 1.0;
    }
    let by_phi = Vector3::new(0.0, g * ct * cp, -g * ct * sp);
    let by_theta = Vector3::new(-g * ct, -g * st * sp, -g * st * cp);
    out.by_state
        .fixed_view_mut::<3, 1>(state::U, state::PHI)
        .copy_from(&by_phi);
    out.by_state
        .fixed_view_mut::<3, 1>(state::U, state::THETA)
        .copy_from(&by_theta);
    add_attitude_slopes(&mut out, omega - terms.horizon, (sp, cp), (st, ct));
    add_climb_slopes(&mut out, velocity, velocity_by_rates, (sp, cp), (st, ct));
    out
}

/// Adds the slopes of the rates of φ, θ, ψ for body rates relative to the horizon.
#[inline(always)]
fn add_attitude_slopes(
    out: &mut RateSlopes,
    w: Vector3<f64>,
    (sp, cp): (f64, f64),
    (st, ct): (f64, f64),
) {
    let tan = st / ct;
    let (along, across) = (w.y * sp + w.z * cp, w.y * cp - w.z * sp);
    out.by_state[(state::PHI, state::PHI)] = tan * across;
    out.by_state[(state::PHI, state::THETA)] = along / (ct * ct);
    out.by_state[(state::THETA, state::PHI)] = -along;
    out.by_state[(state::PSI, state::PHI)] = across / ct;
    out.by_state[(state::PSI, state::THETA)] = along * tan / ct;
    out.by_input
        .fixed_view_mut::<3, 3>(state::PHI, input::P)
        .copy_from(&Matrix3::new(
            1.0,
            tan * sp,
            tan * cp, //
            0.0,
            cp,
            -sp, //
            0.0,
            sp / ct,
            cp / ct,
        ));
}

/// Adds the slopes of the rate of climb.
#[inline(always)]
fn add_climb_slopes(
    out: &mut RateSlopes,
    v: Vector3<f64>,
    v_by_rates: Matrix3<f64>,
    (sp, cp): (f64, f64),
    (st, ct): (f64, f64),
) {
    let up = Vector3::new(st, -sp * ct, -cp * ct);
    for i in 0..3 {
        out.by_state[(state::ALTITUDE, i)] = up[i];
        out.by_input[(state::ALTITUDE, i)] = up.dot(&v_by_rates.column(i));
    }
    out.by_state[(state::ALTITUDE, state::PHI)] = -v.y * cp * ct + v.z * sp * ct;
    out.by_state[(state::ALTITUDE, state::THETA)] = v.x * ct + v.y * sp * st + v.z * cp * st;
}

/// Computes the readings of the output instruments: α and β vanes, V, θ, φ, ψ, altitude, q̄ and
/// Mach, in deg, ft/s, ft, lbf/ft².
#[inline(always)]
pub fn readings(
    aircraft: &Aircraft,
    x: &State,
    input: &Inputs,
    terms: &MeasuredTerms,
) -> [f64; OUTPUTS] {
    let omega = body_rates(input);
    let (v, _) = velocity_at_cg(x, omega, terms);
    let speed = v.norm();
    let flow = flow(v, speed, omega);
    let air = air_at(x[state::ALTITUDE], terms.temperature_ratio);
    [
        DEG * aircraft.sensors.alpha_reading(&flow, terms.cg).angle,
        DEG * aircraft.sensors.beta_reading(&flow, terms.cg).angle,
        speed,
        DEG * x[state::THETA],
        DEG * x[state::PHI],
        DEG * x[state::PSI],
        x[state::ALTITUDE],
        0.5 * air.density_slug_ft3 * speed * speed,
        speed / air.sound_ft_s,
    ]
}

/// Air at an altitude, of so many times the temperature of the standard atmosphere.
#[inline(always)]
fn air_at(altitude_ft: f64, temperature_ratio: f64) -> Air {
    let standard = air(altitude_ft);
    standard.at_temperature(temperature_ratio * standard.kelvin)
}

/// Flow of a velocity in body axes.
#[inline(always)]
fn flow(v: Vector3<f64>, speed: f64, omega: Vector3<f64>) -> VaneFlow {
    VaneFlow {
        alpha: v.z.atan2(v.x),
        beta: (v.y / speed).clamp(-1.0, 1.0).asin(),
        velocity: speed,
        rates: [omega.x, omega.y, omega.z],
    }
}

/// Computes the slopes of the readings.
#[inline(always)]
pub fn reading_slopes(
    aircraft: &Aircraft,
    x: &State,
    input: &Inputs,
    terms: &MeasuredTerms,
) -> ReadingSlopes {
    let omega = body_rates(input);
    let (v, v_by_rates) = velocity_at_cg(x, omega, terms);
    let speed = v.norm();
    let air = AirWithSlopes::at(x[state::ALTITUDE], terms.temperature_ratio);
    let mut by_velocity = SMatrix::<f64, OUTPUTS, 3>::zeros();
    let mut by_rates = SMatrix::<f64, OUTPUTS, 3>::zeros();
    let vanes = vane_slopes(aircraft, v, omega, terms);
    for (o, (by_v, by_omega)) in vanes.into_iter().enumerate() {
        by_velocity.set_row(o, &(by_v * DEG).transpose());
        by_rates.set_row(o, &(by_omega * DEG).transpose());
    }
    // V, q̄ = ½ ρ V² and M = V/a depend on the size of the velocity alone.
    let unit = v / speed;
    let by_speed = [1.0, air.density * speed, 1.0 / air.sound];
    let pressure_outputs = [output::AIRSPEED, output::QBAR, output::MACH];
    for (o, slope) in pressure_outputs.into_iter().zip(by_speed) {
        by_velocity.set_row(o, &(unit * slope).transpose());
    }
    let mut by_state = SMatrix::<f64, OUTPUTS, STATES>::zeros();
    by_state
        .fixed_columns_mut::<3>(state::U)
        .copy_from(&by_velocity);
    by_rates += by_velocity * v_by_rates;
    by_state[(output::THETA, state::THETA)] = DEG;
    by_state[(output::PHI, state::PHI)] = DEG;
    by_state[(output::PSI, state::PSI)] = DEG;
    by_state[(output::ALTITUDE, state::ALTITUDE)] = 1.0;
    by_state[(output::QBAR, state::ALTITUDE)] = 0.5 * air.density_slope * speed * speed;
    by_state[(output::MACH, state::ALTITUDE)] = -speed * air.sound_slope / (air.sound * air.sound);
    ReadingSlopes { by_state, by_rates }
}

/// Slopes of the readings of the α and β vanes, rad: along the velocity, and along the body rates at
/// constant velocity.
///
/// A reading depends on the ratio of rates and velocity, so that its slope along the speed follows
/// from those along the rates: −(ω · ∂/∂ω)/V.
#[inline(always)]
fn vane_slopes(
    aircraft: &Aircraft,
    v: Vector3<f64>,
    omega: Vector3<f64>,
    terms: &MeasuredTerms,
) -> [(Vector3<f64>, Vector3<f64>); 2] {
    let speed = v.norm();
    let unit = v / speed;
    let flow = flow(v, speed, omega);
    let alpha_by_velocity = Vector3::new(-v.z, 0.0, v.x) / (v.x * v.x + v.z * v.z);
    let beta_by_velocity = (Vector3::y() - unit * unit.y) / (speed * flow.beta.cos());
    let vanes = [
        aircraft.sensors.alpha_reading(&flow, terms.cg),
        aircraft.sensors.beta_reading(&flow, terms.cg),
    ];
    vanes.map(|vane| {
        let by_rates: Vector3<f64> = vane.by_rates.into();
        let by_velocity = alpha_by_velocity * vane.by_alpha + beta_by_velocity * vane.by_beta
            - unit * (by_rates.dot(&omega) / speed);
        (by_velocity, by_rates)
    })
}

/// Air at an altitude with its slopes per ft.
struct AirWithSlopes {
    density: f64,
    density_slope: f64,
    sound: f64,
    sound_slope: f64,
}

impl AirWithSlopes {
    /// A temperature ratio changes no relative slope.
    fn at(altitude_ft: f64, temperature_ratio: f64) -> AirWithSlopes {
        let here = air_at(altitude_ft, temperature_ratio);
        let gradients = air_gradients(altitude_ft);
        AirWithSlopes {
            density: here.density_slug_ft3,
            density_slope: here.density_slug_ft3 * gradients.density,
            sound: here.sound_ft_s,
            sound_slope: here.sound_ft_s * gradients.sound,
        }
    }
}
