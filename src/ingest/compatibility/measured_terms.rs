//! Measured terms of the kinematic equations, and the measured state at the start of a window.

use nalgebra::{Matrix3, Vector3};

use super::equations::{MeasuredTerms, State};
use crate::aircraft::{Aircraft, Position, VaneFlow};
use crate::earth::{air, gravity_ft_s2};
use crate::flight::{Record, signal as s};
use crate::units::DEG;

/// The earth's rotation, rad/s (WGS 84).
pub const EARTH_RATE: f64 = 7.292_115e-5;

/// The earth's mean radius, ft (6,371 km).
const EARTH_RADIUS_FT: f64 = 2.090_2e7;

/// Terms of the equations at some samples.
pub fn measured_terms(
    record: &Record,
    samples: &[usize],
    aircraft: &Aircraft,
) -> Vec<MeasuredTerms> {
    let columns = [
        s::X_CG,
        s::Y_CG,
        s::Z_CG,
        s::ALPHA_VANE,
        s::BETA_VANE,
        s::VELOCITY,
        s::ALTITUDE,
        s::PHI,
        s::THETA,
        s::PSI,
    ]
    .map(|name| record.values(name).unwrap_or_default());
    let (sensors, has_heading) = (&aircraft.sensors, record.values(s::PSI).is_some());
    let temperatures = record.values(s::AIR_TEMPERATURE);
    let terms = |k: &usize| {
        let now = columns.map(|values| values.get(*k).copied().unwrap_or(0.0));
        let [
            x_ft,
            y_ft,
            z_ft,
            alpha,
            beta,
            speed,
            altitude,
            phi,
            theta,
            psi,
        ] = now;
        let (cg, alpha, beta) = (Position { x_ft, y_ft, z_ft }, alpha / DEG, beta / DEG);
        let velocity = flow_direction(alpha, beta) * speed;
        let kelvin = temperatures.and_then(|values| values.get(*k).copied());
        let attitude = [phi, theta, psi].map(|angle| angle / DEG);
        MeasuredTerms {
            gravity: gravity_ft_s2(aircraft.latitude_deg, altitude),
            arms: [sensors.ax.arm(cg), sensors.ay.arm(cg), sensors.an.arm(cg)],
            cg,
            temperature_ratio: temperature_ratio(kelvin, altitude),
            ..rotation_terms(aircraft, attitude, velocity, has_heading)
        }
    };
    samples.iter().map(terms).collect()
}

/// Temperature of the air (K) over that of the standard atmosphere; one without a record.
fn temperature_ratio(kelvin: Option<f64>, altitude_ft: f64) -> f64 {
    let ratio = kelvin.map(|kelvin| kelvin / air(altitude_ft).kelvin);
    ratio.filter(|ratio| ratio.is_finite()).unwrap_or(1.0)
}

/// Direction of the velocity relative to the air in body axes; angles in rad.
pub fn flow_direction(alpha: f64, beta: f64) -> Vector3<f64> {
    let ((sa, ca), (sb, cb)) = (alpha.sin_cos(), beta.sin_cos());
    Vector3::new(ca * cb, sb, sa * cb)
}

/// Rotation of earth and horizon at an attitude (rad) and a velocity in body axes (ft/s). Without a
/// heading only the part that is independent of it.
pub fn rotation_terms(
    aircraft: &Aircraft,
    [phi, theta, psi]: [f64; 3],
    velocity: Vector3<f64>,
    has_heading: bool,
) -> MeasuredTerms {
    let to_body = to_body(phi, theta, psi);
    let latitude = aircraft.latitude_deg / DEG;
    let north = if has_heading { latitude.cos() } else { 0.0 };
    let pole = Vector3::new(north, 0.0, -latitude.sin()) * EARTH_RATE;
    let ground = to_body.transpose() * velocity;
    let round = Vector3::new(ground.y, -ground.x, -ground.y * latitude.tan()) / EARTH_RADIUS_FT;
    let earth = to_body * pole;
    MeasuredTerms {
        gravity: 0.0,
        arms: [[0.0; 3]; 3],
        cg: Position {
            x_ft: 0.0,
            y_ft: 0.0,
            z_ft: 0.0,
        },
        earth,
        horizon: earth + to_body * round,
        to_body,
        temperature_ratio: 1.0,
    }
}

/// Rotation from north, east, down to body axes; angles in rad.
fn to_body(phi: f64, theta: f64, psi: f64) -> Matrix3<f64> {
    let ((sp, cp), (st, ct), (sy, cy)) = (phi.sin_cos(), theta.sin_cos(), psi.sin_cos());
    Matrix3::new(
        ct * cy,
        ct * sy,
        -st,
        sp * st * cy - cp * sy,
        sp * st * sy + cp * cy,
        sp * ct,
        cp * st * cy + sp * sy,
        cp * st * sy - sp * cy,
        cp * ct,
    )
}

/// State measured at a sample.
pub fn measured_state(
    record: &Record,
    k: usize,
    aircraft: &Aircraft,
    terms: Option<&MeasuredTerms>,
) -> State {
    let at = |name: &str| {
        record
            .values(name)
            .and_then(|v| v.get(k))
            .copied()
            .unwrap_or(0.0)
    };
    let Some(terms) = terms else {
        return State::zeros();
    };
    let rates = [at(s::P) / DEG, at(s::Q) / DEG, at(s::R) / DEG];
    let read = VaneFlow {
        alpha: at(s::ALPHA_VANE) / DEG,
        beta: at(s::BETA_VANE) / DEG,
        velocity: at(s::VELOCITY),
        rates,
    };
    let flow = aircraft.sensors.flow_at_cg(&read, terms.cg);
    let ((sa, ca), (sb, cb)) = (flow.alpha.sin_cos(), flow.beta.sin_cos());
    let velocity = [
        flow.velocity * ca * cb,
        flow.velocity * sb,
        flow.velocity * sa * cb,
    ];
    let omega = Vector3::from(rates);
    let swung = |i: usize| velocity[i] + omega.cross(&Vector3::from(terms.arms[i]))[i];
    State::from([
        swung(0),
        swung(1),
        swung(2),
        at(s::PHI) / DEG,
        at(s::THETA) / DEG,
        at(s::PSI) / DEG,
        at(s::ALTITUDE),
    ])
}
