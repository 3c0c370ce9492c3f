//! Lateral-directional equations about steady flight: states β, p, r, φ, as they are estimated.

use super::linear::{AxisStates, LinearModel, Matrix, SteadyFlight, Vector};
use super::trim::Trim;
use crate::aircraft::{Aircraft, Thrust};
use crate::dynamics::{Equations, Lateral, Rates};
use crate::model::LocalPosterior;

const FEEDBACK: [(&str, usize); 4] = [
    ("beta_deg", 0),
    ("p_deg_s", 1),
    ("r_deg_s", 2),
    ("phi_deg", 3),
];

/// Rates of the states at trim with their slopes. Thrust acts through the measured forces.
#[must_use]
pub fn rates(aircraft: &Aircraft, trim: &Trim) -> Rates<4> {
    let motion = trim.motion(Thrust::forward(0.0));
    let inputs = Lateral::rate_inputs(aircraft, &motion);
    Lateral::rates(&inputs, &Lateral::measured_state(&motion), &[0.0; 3])
}

impl SteadyFlight<'_> {
    /// Linear lateral-directional equations of a posterior.
    #[must_use]
    pub fn lateral(&self, posterior: &LocalPosterior) -> LinearModel {
        let (aircraft, trim) = (self.aircraft, self.trim);
        let of_regressor =
            |regressor: &_| Lateral::state_regressor(aircraft, trim.velocity, regressor);
        let states = AxisStates {
            of_regressor: &of_regressor,
            velocity: None,
            feedback: &FEEDBACK,
        };
        let rates = rates(aircraft, trim);
        let slope = |effect: super::linear::Effect| -> Matrix {
            let column = rates.by_coefficient.column(effect.coefficient);
            column * Vector::from(effect.by_state).transpose()
        };
        let effects = self.effects(posterior, &states);
        LinearModel {
            rigid: rates.by_state,
            control_slopes: vec![Vector::zeros(); effects.len()],
            alpha_rate: None,
            slopes: effects.into_iter().map(slope).collect(),
            velocity: trim.velocity,
            gravity: trim.gravity,
        }
    }
}
