//! Longitudinal equations about steady flight: states velocity, α, q, θ.
//!
//! The rows of α, q and θ are the equations that are estimated ([`crate::dynamics::Longitudinal`])
//! with their own slopes. Estimation takes the velocity V as measured. Here V is a state, at
//! constant thrust T and density, with γ the flight-path angle:
//!
//! m V̇ = T_x cos α + T_z sin α − q̄S (CA cos α + CN sin α) − m g sin γ,  q̄ ~ V².
//!
//! The pitch control balances the moment M of the thrust. Unlike the moment of the control, that of
//! the thrust does not grow with V.

use super::linear::{
    AlphaRateTerm, AxisStates, ByCoefficient, LinearModel, Matrix, SteadyFlight, Vector,
};
use super::trim::Trim;
use crate::aircraft::Aircraft;
use crate::dynamics::{Equations, Longitudinal};
use crate::model::LocalPosterior;

const VELOCITY: usize = 0;
const ALPHA: usize = 1;
const Q: usize = 2;
const THETA: usize = 3;

/// States that feedback may use, with their indices.
pub const FEEDBACK: [(&str, usize); 3] =
    [("alpha_deg", ALPHA), ("q_deg_s", Q), ("theta_deg", THETA)];

/// Indices of the coefficients.
const NORMAL: usize = 0;
const AXIAL: usize = 2;

/// Slopes of the states' rates at trim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateSlopes {
    /// Along the states at constant coefficients.
    pub by_state: Matrix,
    pub by_coefficient: ByCoefficient,
}

/// Slopes at trim, where the axial force coefficient is `axial_force`.
#[must_use]
pub fn slopes(aircraft: &Aircraft, trim: &Trim, axial_force: f64) -> RateSlopes {
    let force = trim.qbar * aircraft.wing_area_ft2;
    let thrust = trim.thrust(aircraft, axial_force);
    let normal_force = trim.normal_force(aircraft, thrust);
    let motion = trim.motion(thrust);
    let inputs = Longitudinal::rate_inputs(aircraft, &motion);
    let state = Longitudinal::measured_state(&motion);
    let rates = Longitudinal::rates(&inputs, &state, &[normal_force, 0.0, axial_force]);
    let mut by_state = Matrix::zeros();
    let mut by_coefficient = ByCoefficient::zeros();
    let mut own = by_state.fixed_view_mut::<3, 3>(ALPHA, ALPHA);
    own.copy_from(&rates.by_state);
    let mut own = by_coefficient.fixed_view_mut::<3, 3>(ALPHA, 0);
    own.copy_from(&rates.by_coefficient);
    let (sin, cos) = trim.alpha.sin_cos();
    let (sin_path, cos_path) = (trim.theta - trim.alpha).sin_cos();
    let (per_mass, velocity) = (force / trim.mass, trim.velocity);
    let axial = axial_force * cos + normal_force * sin;
    by_state[(VELOCITY, VELOCITY)] = -2.0 * per_mass * axial / velocity;
    // At trim a turn of the force is a turn of the weight: both vanish.
    by_state[(VELOCITY, ALPHA)] = 0.0;
    by_state[(VELOCITY, THETA)] = -trim.gravity * cos_path;
    let lift = normal_force * cos - axial_force * sin;
    by_state[(ALPHA, VELOCITY)] = -2.0 * per_mass * lift / (velocity * velocity);
    by_state[(Q, VELOCITY)] -= 2.0 * thrust.pitch_ft_lbf / (trim.iy * velocity);
    by_state[(ALPHA, THETA)] = -trim.gravity * sin_path / velocity;
    by_coefficient[(VELOCITY, NORMAL)] = -per_mass * sin;
    by_coefficient[(VELOCITY, AXIAL)] = -per_mass * cos;
    RateSlopes {
        by_state,
        by_coefficient,
    }
}

impl SteadyFlight<'_> {
    /// Linear longitudinal equations of a posterior.
    #[must_use]
    pub fn longitudinal(&self, posterior: &LocalPosterior) -> LinearModel {
        let (aircraft, trim) = (self.aircraft, self.trim);
        let of_regressor = |regressor: &_| {
            let state = Longitudinal::state_regressor(aircraft, trim.velocity, regressor);
            state.map(|(state, factor)| (ALPHA + state, factor))
        };
        let states = AxisStates {
            of_regressor: &of_regressor,
            velocity: Some(VELOCITY),
            feedback: &FEEDBACK,
        };
        let effects = self.effects(posterior, &states);
        let without = slopes(aircraft, trim, 0.0);
        // The equations are linear in the axial force at trim, which thrust balances.
        let drag = slopes(aircraft, trim, 1.0).by_state - without.by_state;
        let mut linear = LinearModel {
            rigid: without.by_state,
            slopes: vec![],
            control_slopes: vec![],
            alpha_rate: self
                .aero_model
                .along_alpha_rate()
                .next()
                .map(|_| AlphaRateTerm {
                    alpha: ALPHA,
                    slopes: vec![],
                }),
            velocity: trim.velocity,
            gravity: trim.gravity,
        };
        for effect in effects {
            let column = without.by_coefficient.column(effect.coefficient);
            let row = Vector::from(effect.by_state).transpose();
            let mut slope: Matrix = column * row;
            if effect.coefficient == AXIAL {
                slope += drag * effect.at_trim;
            }
            linear.slopes.push(slope);
            linear.control_slopes.push(column * effect.by_control);
            if let Some(term) = &mut linear.alpha_rate {
                term.slopes.push(column * effect.by_alpha_rate);
            }
        }
        linear
    }
}
