//! Lateral-directional equations: states β, p, r, φ (3.1-3.4); outputs β at the vane, p, r, φ,
//! `a_y` (3.7, 3.8).
//!
//! Forces, with f the specific force in body axes:
//!
//! ```text
//! V β̇ = f_y cos β − sin β (f_x cos α + f_z sin α) + gravity + V (p sin α − r cos α)
//! f_y = q̄S CY/m
//! ```
//!
//! f_x and f_z are the measured forces, transferred to the c.g. Eq. 3.1 writes them as C_D sin β
//! and T cos α sin β, with a minus sign: thrust turns the path towards the nose. Moments follow
//! Euler's equations about x and z for a symmetric airframe. The engines' angular momentum H along
//! +x has the yawing moment +q H.
//!
//! The accelerometer reads a_y = (f_y + l_y)/g, with the effect l of its arm.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use nalgebra::{SMatrix, SVector};

use super::equations::{COEFFICIENTS, Equations, Outputs, Rates};
use super::lever::lever;
use super::motion::Motion;
use crate::aero::{Axis, Regressor};
use crate::aircraft::{Aircraft, Position, Vane, VaneFlow, VaneModel};
use crate::flight::signal;
use crate::numerics::trig::sin_cos;
use crate::units::{DEG, G0_FT_S2};

/// The lateral-directional axis.
#[derive(Clone, Copy, Debug)]
pub struct Lateral;

/// Inputs of the state equations at one instant.
#[derive(Clone, Debug)]
pub struct RateInputs {
    /// 1/V.
    per_speed: f64,
    sin_alpha: f64,
    cos_alpha: f64,
    q: f64,
    sin_theta: f64,
    cos_theta: f64,
    tan_theta: f64,
    /// f_x cos α + f_z sin α, ft/s²: the measured specific force along the wind's projection on the
    /// plane of symmetry.
    along_wind: f64,
    /// q̄S/m, ft/s².
    force: f64,
    gravity: f64,
    /// q̄Sb times the inverse of the inertia matrix [I_x −I_xz; −I_xz I_z]: rows ṗ, ṙ; columns Cl,
    /// Cn.
    moment: [[f64; 2]; 2],
    /// ṗ, ṙ = `coupling` (p, r) + `gyroscopic`, rad/s².
    coupling: [[f64; 2]; 2],
    gyroscopic: [f64; 2],
}

/// Further inputs of the sensor equations.
#[derive(Clone, Debug)]
pub struct SensorInputs {
    velocity: f64,
    alpha: f64,
    q_dot: f64,
    /// Arm of the accelerometer from the c.g., ft forward, right, down.
    ay: [f64; 3],
    cg: Position,
    vane: Vane,
    model: VaneModel,
    /// Slopes of a small angle at the vane along the rates, s.
    vane_by_rates: [f64; 3],
}

const BETA: usize = 0;
const P: usize = 1;
const R: usize = 2;
const PHI: usize = 3;
const SIDE_FORCE: usize = 0;
const ROLLING_MOMENT: usize = 1;
const YAWING_MOMENT: usize = 2;

// Indices of the outputs.
const BETA_VANE: usize = 0;
const ROLL_RATE: usize = 1;
const YAW_RATE: usize = 2;
const BANK_ANGLE: usize = 3;
const AY: usize = 4;

impl RateInputs {
    /// ṗ and ṙ, rad/s².
    #[inline(always)]
    fn angular(&self, p: f64, r: f64, c: &[f64; COEFFICIENTS]) -> [f64; 2] {
        let ([p_dot, r_dot], [cl, cn]) = (self.coupling, [c[ROLLING_MOMENT], c[YAWING_MOMENT]]);
        [
            p_dot[0] * p
                + p_dot[1] * r
                + self.gyroscopic[0]
                + self.moment[0][0] * cl
                + self.moment[0][1] * cn,
            r_dot[0] * p
                + r_dot[1] * r
                + self.gyroscopic[1]
                + self.moment[1][0] * cl
                + self.moment[1][1] * cn,
        ]
    }
}

impl Equations<4> for Lateral {
    type RateInputs = RateInputs;
    type SensorInputs = SensorInputs;

    const AXIS: Axis = Axis::Lateral;
    const STATES: [&'static str; 4] = ["beta", "p", "r", "phi"];

    const SIGNALS_NOT_READ: &'static [&'static str] = &[signal::AY, signal::PHI];

    const REGRESSOR_STATES: &'static [usize] = &[BETA, P, R];
    const RATES_BY_STATE: &'static [(usize, usize)] = &[
        (BETA, BETA),
        (BETA, P),
        (BETA, R),
        (BETA, PHI),
        (P, BETA),
        (P, P),
        (P, R),
        (R, BETA),
        (R, P),
        (R, R),
        (PHI, P),
        (PHI, R),
        (PHI, PHI),
    ];
    const RATES_BY_COEFFICIENT: &'static [(usize, usize)] = &[
        (BETA, SIDE_FORCE),
        (P, ROLLING_MOMENT),
        (P, YAWING_MOMENT),
        (R, ROLLING_MOMENT),
        (R, YAWING_MOMENT),
    ];
    const OUTPUTS_BY_STATE: &'static [(usize, usize)] = &[
        (BETA_VANE, BETA),
        (BETA_VANE, P),
        (BETA_VANE, R),
        (ROLL_RATE, P),
        (YAW_RATE, R),
        (BANK_ANGLE, PHI),
        (AY, BETA),
        (AY, P),
        (AY, R),
    ];
    const OUTPUTS_BY_COEFFICIENT: &'static [(usize, usize)] =
        &[(AY, SIDE_FORCE), (AY, ROLLING_MOMENT), (AY, YAWING_MOMENT)];

    #[inline(always)]
    fn rate_inputs(aircraft: &Aircraft, m: &Motion) -> RateInputs {
        let determinant = m.ix * m.iz - m.ixz * m.ixz;
        // Rows of the inverse inertia matrix: ṗ and ṙ per rolling and yawing moment.
        let inverse = [
            [m.iz / determinant, m.ixz / determinant],
            [m.ixz / determinant, m.ix / determinant],
        ];
        let q = m.rates[1];
        // Moments of the rotation itself: L = q r (I_y − I_z) + p q I_xz, N = p q (I_x − I_y) − q r
        // I_xz.
        let turning = [
            [q * m.ixz, q * (m.iy - m.iz)],
            [q * (m.ix - m.iy), -q * m.ixz],
        ];
        let pressure = m.qbar * aircraft.wing_area_ft2 * aircraft.span_ft;
        let times =
            |i: usize, j: usize| inverse[i][0] * turning[0][j] + inverse[i][1] * turning[1][j];
        let [(sin_alpha, cos_alpha), (sin_theta, cos_theta)] = sin_cos([m.alpha, m.theta]);
        RateInputs {
            per_speed: 1.0 / m.velocity,
            sin_alpha,
            cos_alpha,
            q,
            sin_theta,
            cos_theta,
            tan_theta: sin_theta / cos_theta,
            along_wind: m.force_x * cos_alpha + m.force_z * sin_alpha,
            force: m.qbar * aircraft.wing_area_ft2 / m.mass,
            gravity: m.gravity,
            moment: inverse.map(|row| row.map(|v| pressure * v)),
            coupling: [[times(0, 0), times(0, 1)], [times(1, 0), times(1, 1)]],
            gyroscopic: inverse.map(|row| row[1] * q * m.engine_momentum),
        }
    }

    #[inline(always)]
    fn sensor_inputs(aircraft: &Aircraft, m: &Motion) -> SensorInputs {
        let sensors = &aircraft.sensors;
        SensorInputs {
            velocity: m.velocity,
            alpha: m.alpha,
            q_dot: m.accelerations[1],
            ay: sensors.ay.arm(m.cg),
            cg: m.cg,
            vane: sensors.beta_vane,
            model: sensors.vane_model,
            vane_by_rates: sensors.beta_vane.beta_by_rates(m.velocity, m.cg),
        }
    }

    #[inline(always)]
    fn measured_state(m: &Motion) -> SVector<f64, 4> {
        SVector::from([m.beta, m.rates[0], m.rates[2], m.phi])
    }

    fn state_of(regressor: &Regressor) -> Option<usize> {
        match regressor {
            Regressor::Beta => Some(BETA),
            Regressor::RollRate => Some(P),
            Regressor::YawRate => Some(R),
            _ => None,
        }
    }

    fn state_regressor(
        aircraft: &Aircraft,
        velocity: f64,
        regressor: &Regressor,
    ) -> Option<(usize, f64)> {
        let rate = aircraft.span_ft / (2.0 * velocity);
        match regressor {
            Regressor::Beta => Some((BETA, DEG)),
            Regressor::RollRate => Some((P, rate)),
            Regressor::YawRate => Some((R, rate)),
            _ => None,
        }
    }

    #[inline(always)]
    fn implied_coefficients(
        aircraft: &Aircraft,
        m: &Motion,
        k: &RateInputs,
    ) -> [f64; COEFFICIENTS] {
        let [p, q, r] = m.rates;
        let [p_dot, _, r_dot] = m.accelerations;
        let pressure = m.qbar * aircraft.wing_area_ft2 * aircraft.span_ft;
        let roll = m.ix * p_dot - m.ixz * r_dot - (q * r * (m.iy - m.iz) + p * q * m.ixz);
        let yaw = m.iz * r_dot
            - m.ixz * p_dot
            - (p * q * (m.ix - m.iy) - q * r * m.ixz)
            - q * m.engine_momentum;
        [m.force_y / k.force, roll / pressure, yaw / pressure]
    }

    #[inline(always)]
    fn rates(k: &RateInputs, x: &SVector<f64, 4>, c: &[f64; COEFFICIENTS]) -> Rates<4> {
        let [(sb, cb), (sp, cp)] = sin_cos([x[BETA], x[PHI]]);
        let per_speed = k.per_speed;
        let weight = k.cos_theta * cp * k.sin_alpha - k.sin_theta * k.cos_alpha;
        // 3.1 sorted by the factors cos β and sin β.
        let by_cos = per_speed * (k.force * c[SIDE_FORCE] + k.gravity * k.cos_theta * sp);
        let by_sin = -per_speed * (k.along_wind + k.gravity * weight);
        let beta_dot = sb.mul_add(
            by_sin,
            cb.mul_add(by_cos, x[P] * k.sin_alpha - x[R] * k.cos_alpha),
        );
        let [p_dot, r_dot] = k.angular(x[P], x[R], c);
        let tan_theta = k.tan_theta;
        let mut out = Rates {
            rates: SVector::from([
                beta_dot,
                p_dot,
                r_dot,
                x[P] + tan_theta * (x[R] * cp + k.q * sp),
            ]),
            by_state: SMatrix::zeros(),
            by_coefficient: SMatrix::zeros(),
        };
        out.by_state[(BETA, BETA)] = cb * by_sin - sb * by_cos;
        out.by_state[(BETA, P)] = k.sin_alpha;
        out.by_state[(BETA, R)] = -k.cos_alpha;
        out.by_state[(BETA, PHI)] =
            per_speed * k.gravity * k.cos_theta * (cb * cp + sb * sp * k.sin_alpha);
        for (row, i) in [(P, 0), (R, 1)] {
            out.by_state[(row, P)] = k.coupling[i][0];
            out.by_state[(row, R)] = k.coupling[i][1];
            out.by_coefficient[(row, ROLLING_MOMENT)] = k.moment[i][0];
            out.by_coefficient[(row, YAWING_MOMENT)] = k.moment[i][1];
        }
        out.by_state[(PHI, P)] = 1.0;
        out.by_state[(PHI, R)] = tan_theta * cp;
        out.by_state[(PHI, PHI)] = tan_theta * (-x[R] * sp + k.q * cp);
        out.by_coefficient[(BETA, SIDE_FORCE)] = per_speed * k.force * cb;
        out
    }

    #[inline(always)]
    fn outputs(
        k: &RateInputs,
        sensors: &SensorInputs,
        x: &SVector<f64, 4>,
        c: &[f64; COEFFICIENTS],
    ) -> Outputs<4> {
        let rates = [x[P], k.q, x[R]];
        let [p_dot, r_dot] = k.angular(x[P], x[R], c);
        let vane = match sensors.model {
            VaneModel::SmallAngle => sensors
                .vane
                .beta_small(x[BETA], sensors.vane_by_rates, rates),
            VaneModel::Exact => {
                let flow = VaneFlow {
                    alpha: sensors.alpha,
                    beta: x[BETA],
                    velocity: sensors.velocity,
                    rates,
                };
                sensors.vane.beta_reading(sensors.model, &flow, sensors.cg)
            }
        };
        let right = lever(1, sensors.ay, rates, [p_dot, sensors.q_dot, r_dot]);
        let g = 1.0 / G0_FT_S2;
        let mut out = Outputs {
            outputs: SVector::from([
                DEG * vane.angle,
                DEG * x[P],
                DEG * x[R],
                DEG * x[PHI],
                g * (k.force * c[SIDE_FORCE] + right.value),
            ]),
            by_state: SMatrix::zeros(),
            by_coefficient: SMatrix::zeros(),
        };
        out.by_state[(BETA_VANE, BETA)] = DEG * vane.by_beta;
        out.by_state[(BETA_VANE, P)] = DEG * vane.by_rates[0];
        out.by_state[(BETA_VANE, R)] = DEG * vane.by_rates[2];
        out.by_state[(ROLL_RATE, P)] = DEG;
        out.by_state[(YAW_RATE, R)] = DEG;
        out.by_state[(BANK_ANGLE, PHI)] = DEG;
        let [by_p_dot, _, by_r_dot] = right.by_accelerations;
        for (state, j, by_rate) in [(P, 0, right.by_rates[0]), (R, 1, right.by_rates[2])] {
            out.by_state[(AY, state)] =
                g * (by_rate + by_p_dot * k.coupling[0][j] + by_r_dot * k.coupling[1][j]);
        }
        out.by_coefficient[(AY, SIDE_FORCE)] = g * k.force;
        for (column, j) in [(ROLLING_MOMENT, 0), (YAWING_MOMENT, 1)] {
            out.by_coefficient[(AY, column)] =
                g * (by_p_dot * k.moment[0][j] + by_r_dot * k.moment[1][j]);
        }
        out
    }
}
