//! An aircraft whose slopes of forces and moments a report gives, and the modes that follow.

use approx::assert_relative_eq;
use nalgebra::{DVector, SMatrix, Vector3};

use crate::aero::{Axis, Condition};
use crate::aircraft::{Aircraft, Position};
use crate::numerics::dual::Dual;
use crate::qualities::linear::{
    AlphaRateTerm, Differentiation, LinearModel, Matrix, SolvedEquations, Vector,
};
use crate::qualities::modes::{Modes, Pair};
use crate::qualities::trim::Trim;
use crate::qualities::{lateral, longitudinal};

/// Slopes of the three coefficients of an axis along its states.
pub type ByState = SMatrix<f64, 3, 4>;

/// An aircraft in steady flight, with its axial force coefficient.
pub struct Reported {
    pub aircraft: Aircraft,
    pub trim: Trim,
    pub axial_force: f64,
}

impl Reported {
    /// Slopes of CN, Cm, CA from those of the forces X, Z and the moment M along the velocities u, w and
    /// the rate q, in body axes; in lbf, ft lbf.
    pub fn longitudinal_by_state(&self, [x, z, m]: [[f64; 3]; 3]) -> ByState {
        let Reported { aircraft, trim, .. } = self;
        let force = trim.qbar * aircraft.wing_area_ft2;
        let (sin, cos) = trim.alpha.sin_cos();
        let of = |[u, w, q]: [f64; 3]| {
            let by_velocity = cos * u + sin * w;
            let by_alpha = trim.velocity * (cos * w - sin * u);
            [by_velocity, by_alpha, q, 0.0]
        };
        let (x, z, m) = (of(x), of(z), of(m));
        let mut slopes = ByState::zeros();
        for i in 0..4 {
            slopes[(0, i)] = -z[i] / force;
            slopes[(1, i)] = m[i] / (force * aircraft.chord_ft);
            slopes[(2, i)] = -x[i] / force;
        }
        // The derivatives along velocity contain the growth of dynamic pressure.
        let thrust = trim.thrust(aircraft, self.axial_force);
        slopes[(0, 0)] -= 2.0 * trim.normal_force(aircraft, thrust) / trim.velocity;
        slopes[(2, 0)] -= 2.0 * self.axial_force / trim.velocity;
        slopes
    }

    /// Slopes of CY, Cl, Cn from those of the force Y and the moments L, N along β, p and r, in body axes;
    /// in lbf, ft lbf.
    pub fn lateral_by_state(&self, [y, l, n]: [[f64; 3]; 3]) -> ByState {
        let force = self.trim.qbar * self.aircraft.wing_area_ft2;
        let moment = force * self.aircraft.span_ft;
        let rows = [(y, force), (l, moment), (n, moment)];
        ByState::from_fn(|i, j| rows[i].0.get(j).map_or(0.0, |v| v / rows[i].1))
    }

    /// Longitudinal equations, in which all derivatives are times one value: one. The slopes of CN, Cm,
    /// CA along α̇ are per rad/s.
    pub fn longitudinal(
        &self,
        by_state: ByState,
        by_alpha_rate: Vector3<f64>,
        control: Vector,
    ) -> LinearModel {
        let slopes = longitudinal::slopes(&self.aircraft, &self.trim, self.axial_force);
        LinearModel {
            rigid: slopes.by_state + slopes.by_coefficient * by_state,
            slopes: vec![Matrix::zeros()],
            control_slopes: vec![control],
            alpha_rate: Some(AlphaRateTerm {
                alpha: 1,
                slopes: vec![slopes.by_coefficient * by_alpha_rate],
            }),
            velocity: self.trim.velocity,
            gravity: self.trim.gravity,
        }
    }

    pub fn lateral_modes(&self, by_state: ByState) -> Modes {
        let rates = lateral::rates(&self.aircraft, &self.trim);
        let matrix = rates.by_state + rates.by_coefficient * by_state;
        Modes::of_matrix(Axis::Lateral, &matrix, &[]).unwrap()
    }
}

/// Steady level flight at an angle of attack, of an aircraft of mass and inertias one.
pub fn level(alpha_deg: f64) -> Trim {
    Trim {
        condition: Condition {
            alpha_deg,
            mach: 0.0,
            third: None,
        },
        alpha: alpha_deg.to_radians(),
        theta: alpha_deg.to_radians(),
        velocity: 0.0,
        qbar: 0.0,
        mass: 1.0,
        gravity: 32.174,
        ix: 1.0,
        iy: 1.0,
        iz: 1.0,
        ixz: 0.0,
        cg: Position::default(),
        surfaces_deg: std::collections::BTreeMap::new(),
    }
}

/// Equations solved for the states' rates.
pub fn at_one(equations: &LinearModel) -> SolvedEquations {
    let one = DVector::from_element(1, 1.0);
    equations.solved(&one, Differentiation::ValuesAlone)
}

pub fn longitudinal_modes(equations: &LinearModel) -> Modes {
    Modes::of_matrix(Axis::Longitudinal, &at_one(equations).matrix, &[]).unwrap()
}

/// Asserts the frequency within 0.5 % and the damping within 1.5 %.
pub fn assert_pair(pair: &Pair, frequency: f64, damping: f64) {
    assert_near(&pair.frequency(), frequency, 0.005);
    assert_near(&pair.damping(), damping, 0.015);
}

/// Asserts the roots of roll and spiral within 0.5 %, 1/s.
pub fn assert_roll_and_spiral(modes: &Modes, roll: f64, spiral: f64) {
    let found = modes.slow.map(|i| modes.roots[i].real());
    assert_near(&-found[0].clone(), roll, 0.005);
    assert_near(&-found[1].clone(), spiral, 0.005);
}

fn assert_near(found: &Dual, expected: f64, share: f64) {
    assert_relative_eq!(found.value, expected, max_relative = share);
}
