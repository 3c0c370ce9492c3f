//! Longitudinal equations: states α, q, θ (2.1-2.3); outputs α at the vane, q, θ, `a_n`, `a_x`
//! (2.7-2.9).
//!
//! Forces, with f the specific force in body axes:
//!
//! ```text
//! V cos β α̇ = f_z cos α − f_x sin α + gravity + V cos β q − V sin β (p cos α + r sin α)
//! f_z = (T_z − q̄S CN)/m,   f_x = (T_x − q̄S CA)/m
//! ```
//!
//! T_x and T_z are the thrust forward and down; T_z is zero without an inclination. This is 2.1 with
//! C_L = CN cos α − CA sin α. Moments, with that of the thrust's line, follow Euler's equation about y for a
//! symmetric airframe (I_xy = I_yz = 0). The engines' angular momentum H along +x has the moment
//! −r H.
//!
//! The accelerometers read, with the effect l of their arms,
//!
//! ```text
//! a_n = ((q̄S CN − T_z)/m − l_z)/g,   a_x = ((T_x − q̄S CA)/m + l_x)/g
//! ```
//!
//! without T_x if the accelerometer does not sense thrust.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use nalgebra::{SMatrix, SVector};

use super::equations::{COEFFICIENTS, Equations, OUTPUTS, Outputs, Rates};
use super::lever::lever;
use super::motion::Motion;
use crate::aero::{Axis, Regressor};
use crate::aircraft::{Aircraft, Position, Vane, VaneFlow, VaneModel};
use crate::flight::signal;
use crate::numerics::trig::sin_cos;
use crate::units::{DEG, G0_FT_S2};

/// The longitudinal axis.
#[derive(Clone, Copy, Debug)]
pub struct Longitudinal;

/// Inputs of the state equations at one instant.
#[derive(Clone, Debug)]
pub struct RateInputs {
    /// Parts of thrust and sideslip in −α̇: `less_by_cos` cos α + `less_by_sin` sin α, rad/s.
    less_by_cos: f64,
    less_by_sin: f64,
    /// q̄S/m and g over V cos β, 1/s.
    force: f64,
    weight: f64,
    cos_phi: f64,
    /// r sin φ.
    turn: f64,
    /// Pitch acceleration without the aerodynamic moment, rad/s², and q̄Sc̄/I_y.
    pitch: f64,
    moment: f64,
}

/// Further inputs of the sensor equations.
#[derive(Clone, Debug)]
pub struct SensorInputs {
    velocity: f64,
    beta: f64,
    r: f64,
    p: f64,
    /// ṗ and ṙ as measured.
    p_dot: f64,
    r_dot: f64,
    /// Arms of the accelerometers from the c.g., ft forward, right, down.
    an: [f64; 3],
    ax: [f64; 3],
    /// q̄S/m, and the thrust over the mass upwards, and forwards where the accelerometer senses it,
    /// ft/s².
    force: f64,
    thrust_up: f64,
    thrust_forward: f64,
    cg: Position,
    vane: Vane,
    model: VaneModel,
    /// Slopes of a small angle at the vane along the rates, s.
    vane_by_rates: [f64; 3],
}

const ALPHA: usize = 0;
const Q: usize = 1;
const THETA: usize = 2;
const NORMAL_FORCE: usize = 0;
const PITCHING_MOMENT: usize = 1;
const AXIAL_FORCE: usize = 2;

// Indices of the outputs.
const ALPHA_VANE: usize = 0;
const PITCH_RATE: usize = 1;
const PITCH_ATTITUDE: usize = 2;
const AN: usize = 3;
const AX: usize = 4;

impl Longitudinal {
    /// α̇ that a measured motion implies, rad/s: 2.1 with the measured specific forces. The rate of
    /// change of a gust is not part of it.
    #[must_use]
    pub fn alpha_rate(aircraft: &Aircraft, motion: &Motion) -> f64 {
        let inputs = Longitudinal::rate_inputs(aircraft, motion);
        let implied = Longitudinal::implied_coefficients(aircraft, motion, &inputs);
        let state = Longitudinal::measured_state(motion);
        Longitudinal::rates(&inputs, &state, &implied).rates[ALPHA]
    }
}

impl Equations<3> for Longitudinal {
    type RateInputs = RateInputs;
    type SensorInputs = SensorInputs;

    const AXIS: Axis = Axis::Longitudinal;
    const STATES: [&'static str; 3] = ["alpha", "q", "theta"];

    const SIGNALS_NOT_READ: &'static [&'static str] =
        &[signal::AN, signal::AX, signal::AY, signal::THETA];

    const REGRESSOR_STATES: &'static [usize] = &[ALPHA, Q];
    const RATES_BY_STATE: &'static [(usize, usize)] = &[
        (ALPHA, ALPHA),
        (ALPHA, Q),
        (ALPHA, THETA),
        (Q, ALPHA),
        (Q, Q),
        (THETA, Q),
    ];
    const RATES_BY_COEFFICIENT: &'static [(usize, usize)] = &[
        (ALPHA, NORMAL_FORCE),
        (ALPHA, AXIAL_FORCE),
        (Q, PITCHING_MOMENT),
    ];
    const OUTPUTS_BY_STATE: &'static [(usize, usize)] = &[
        (ALPHA_VANE, ALPHA),
        (ALPHA_VANE, Q),
        (PITCH_RATE, Q),
        (PITCH_ATTITUDE, THETA),
        (AN, ALPHA),
        (AN, Q),
        (AX, ALPHA),
        (AX, Q),
    ];
    const OUTPUTS_BY_COEFFICIENT: &'static [(usize, usize)] = &[
        (AN, NORMAL_FORCE),
        (AN, PITCHING_MOMENT),
        (AX, PITCHING_MOMENT),
        (AX, AXIAL_FORCE),
    ];

    #[inline(always)]
    fn rate_inputs(aircraft: &Aircraft, m: &Motion) -> RateInputs {
        let [p, _, r] = m.rates;
        let [(sin_beta, cos_beta), (sin_phi, cos_phi)] = sin_cos([m.beta, m.phi]);
        // Divisions dominate the preparation of a maneuver: one for each denominator, here and
        // below.
        let (per_speed, per_mass, per_iy) =
            (1.0 / (m.velocity * cos_beta), 1.0 / m.mass, 1.0 / m.iy);
        let tan_beta = sin_beta * m.velocity * per_speed;
        let gyroscopic = -r * m.engine_momentum;
        let coupling = p * r * (m.iz - m.ix) + (r * r - p * p) * m.ixz;
        RateInputs {
            less_by_cos: tan_beta * p - per_speed * m.thrust.down_lbf * per_mass,
            less_by_sin: tan_beta * r + per_speed * m.thrust.forward_lbf * per_mass,
            force: per_speed * m.qbar * aircraft.wing_area_ft2 * per_mass,
            weight: per_speed * m.gravity,
            cos_phi,
            turn: r * sin_phi,
            pitch: (coupling + gyroscopic + m.thrust.pitch_ft_lbf) * per_iy,
            moment: m.qbar * aircraft.wing_area_ft2 * aircraft.chord_ft * per_iy,
        }
    }

    #[inline(always)]
    fn sensor_inputs(aircraft: &Aircraft, m: &Motion) -> SensorInputs {
        let (sensors, per_mass) = (&aircraft.sensors, 1.0 / m.mass);
        SensorInputs {
            velocity: m.velocity,
            beta: m.beta,
            r: m.rates[2],
            p: m.rates[0],
            p_dot: m.accelerations[0],
            r_dot: m.accelerations[2],
            an: sensors.an.arm(m.cg),
            ax: sensors.ax.arm(m.cg),
            force: m.qbar * aircraft.wing_area_ft2 * per_mass,
            thrust_up: -m.thrust.down_lbf * per_mass,
            thrust_forward: if sensors.thrust_in_ax {
                m.thrust.forward_lbf * per_mass
            } else {
                0.0
            },
            cg: m.cg,
            vane: sensors.alpha_vane,
            model: sensors.vane_model,
            vane_by_rates: sensors.alpha_vane.alpha_by_rates(m.velocity, m.cg),
        }
    }

    #[inline(always)]
    fn measured_state(m: &Motion) -> SVector<f64, 3> {
        SVector::from([m.alpha, m.rates[1], m.theta])
    }

    fn state_of(regressor: &Regressor) -> Option<usize> {
        match regressor {
            Regressor::Alpha => Some(ALPHA),
            Regressor::PitchRate => Some(Q),
            _ => None,
        }
    }

    fn state_regressor(
        aircraft: &Aircraft,
        velocity: f64,
        regressor: &Regressor,
    ) -> Option<(usize, f64)> {
        match regressor {
            Regressor::Alpha => Some((ALPHA, DEG)),
            Regressor::PitchRate => Some((Q, aircraft.chord_ft / (2.0 * velocity))),
            _ => None,
        }
    }

    #[inline(always)]
    fn implied_coefficients(
        aircraft: &Aircraft,
        m: &Motion,
        k: &RateInputs,
    ) -> [f64; COEFFICIENTS] {
        let per_mass = 1.0 / m.mass;
        let per_force = m.mass / (m.qbar * aircraft.wing_area_ft2);
        [
            (m.thrust.down_lbf * per_mass - m.force_z) * per_force,
            (m.accelerations[1] - k.pitch) / k.moment,
            (m.thrust.forward_lbf * per_mass - m.force_x) * per_force,
        ]
    }

    #[inline(always)]
    fn rates(k: &RateInputs, x: &SVector<f64, 3>, c: &[f64; COEFFICIENTS]) -> Rates<3> {
        let [(sa, ca), (st, ct)] = sin_cos([x[ALPHA], x[THETA]]);
        // 2.1 sorted by the factors cos α and sin α.
        let by_cos = ct.mul_add(
            k.weight * k.cos_phi,
            (-k.force).mul_add(c[NORMAL_FORCE], -k.less_by_cos),
        );
        let by_sin = st.mul_add(k.weight, k.force.mul_add(c[AXIAL_FORCE], -k.less_by_sin));
        let alpha_dot = sa.mul_add(by_sin, ca.mul_add(by_cos, x[Q]));
        let by_alpha = ca * by_sin - sa * by_cos;
        let by_theta = k.weight * (ct * sa - st * k.cos_phi * ca);
        let q_dot = k.moment.mul_add(c[PITCHING_MOMENT], k.pitch);
        let theta_dot = k.cos_phi.mul_add(x[Q], -k.turn);
        Rates {
            rates: SVector::from([alpha_dot, q_dot, theta_dot]),
            by_state: SMatrix::from_row_slice(&[
                by_alpha, 1.0, by_theta, 0.0, 0.0, 0.0, 0.0, k.cos_phi, 0.0,
            ]),
            by_coefficient: SMatrix::from_row_slice(&[
                -k.force * ca,
                0.0,
                k.force * sa,
                0.0,
                k.moment,
                0.0,
                0.0,
                0.0,
                0.0,
            ]),
        }
    }

    #[inline(always)]
    fn outputs(
        k: &RateInputs,
        sensors: &SensorInputs,
        x: &SVector<f64, 3>,
        c: &[f64; COEFFICIENTS],
    ) -> Outputs<3> {
        let rates = [sensors.p, x[Q], sensors.r];
        let accelerations = [
            sensors.p_dot,
            k.pitch + k.moment * c[PITCHING_MOMENT],
            sensors.r_dot,
        ];
        let vane = match sensors.model {
            VaneModel::SmallAngle => {
                sensors
                    .vane
                    .alpha_small(x[ALPHA], sensors.vane_by_rates, rates)
            }
            VaneModel::Exact => {
                let flow = VaneFlow {
                    alpha: x[ALPHA],
                    beta: sensors.beta,
                    velocity: sensors.velocity,
                    rates,
                };
                sensors.vane.alpha_reading(sensors.model, &flow, sensors.cg)
            }
        };
        let down = lever(2, sensors.an, rates, accelerations);
        let forward = lever(0, sensors.ax, rates, accelerations);
        let g = 1.0 / G0_FT_S2;
        let mut out = Outputs {
            outputs: SVector::from([
                DEG * vane.angle,
                DEG * x[Q],
                DEG * x[THETA],
                g * (sensors.force * c[NORMAL_FORCE] + sensors.thrust_up - down.value),
                g * (sensors.thrust_forward - sensors.force * c[AXIAL_FORCE] + forward.value),
            ]),
            by_state: SMatrix::zeros(),
            by_coefficient: SMatrix::<f64, OUTPUTS, COEFFICIENTS>::zeros(),
        };
        out.by_state[(ALPHA_VANE, ALPHA)] = DEG * vane.by_alpha;
        out.by_state[(ALPHA_VANE, Q)] = DEG * vane.by_rates[1];
        out.by_state[(PITCH_RATE, Q)] = DEG;
        out.by_state[(PITCH_ATTITUDE, THETA)] = DEG;
        out.by_state[(AN, Q)] = -g * down.by_rates[1];
        out.by_state[(AX, Q)] = g * forward.by_rates[1];
        out.by_coefficient[(AN, NORMAL_FORCE)] = g * sensors.force;
        out.by_coefficient[(AN, PITCHING_MOMENT)] = -g * down.by_accelerations[1] * k.moment;
        out.by_coefficient[(AX, AXIAL_FORCE)] = -g * sensors.force;
        out.by_coefficient[(AX, PITCHING_MOMENT)] = g * forward.by_accelerations[1] * k.moment;
        out
    }
}
