//! Boeing 747-100 at 40,000 ft and Mach 0.8: condition 9 of NASA CR-2144 (Heffley and Jewell 1972).
//!
//! Dimensional derivatives in stability axes, ft, lb, s: Etkin and Reid, Dynamics of Flight, third
//! edition, Tables 6.2 and 6.7, which are those of the report. Modes: the report's own.

use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector, SMatrix, Vector3};

use super::fixture;
use crate::aero::{Axis, Condition};
use crate::aircraft::{Aircraft, Position};
use crate::numerics::dual::Dual;
use crate::qualities::linear::{
    ByCoefficient, Differentiation, Lag, LinearModel, Matrix, Solved, Vector,
};
use crate::qualities::modes::Modes;
use crate::qualities::trim::Trim;
use crate::qualities::{lateral, longitudinal};
use crate::tables::Quantity;

const VELOCITY: f64 = 774.0;
const GRAVITY: f64 = 32.2;
const MASS: f64 = 636_636.0 / GRAVITY;
const DENSITY: f64 = 0.000_590_9;
const DRAG: f64 = 0.043;

/// Slopes of the coefficients along the states.
type ByState = SMatrix<f64, 3, 4>;

fn aircraft() -> Aircraft {
    Aircraft {
        wing_area_ft2: 5500.0,
        span_ft: 195.7,
        chord_ft: 27.31,
        ..fixture::aircraft()
    }
}

fn trim() -> Trim {
    Trim {
        condition: Condition {
            alpha_deg: 0.0,
            mach: 0.8,
            third: None,
        },
        alpha: 0.0,
        theta: 0.0,
        velocity: VELOCITY,
        qbar: 0.5 * DENSITY * VELOCITY * VELOCITY,
        mass: MASS,
        gravity: GRAVITY,
        ix: 0.183e8,
        iy: 0.331e8,
        iz: 0.497e8,
        ixz: -0.156e7,
        cg: Position::default(),
        surfaces_deg: std::collections::BTreeMap::new(),
    }
}

/// Longitudinal forces and moment per velocity, w, q and ẇ: rows X, Z, M.
const X: [f64; 4] = [-1.358e2, 2.758e2, 0.0, 0.0];
const Z: [f64; 4] = [-1.778e3, -6.188e3, -1.017e5, 1.308e2];
const M: [f64; 4] = [3.581e3, -3.515e4, -1.122e7, -3.826e3];

/// Slopes of CN, Cm, CA along velocity, α, q, θ.
fn by_state() -> ByState {
    let (aircraft, trim) = (aircraft(), trim());
    let force = trim.qbar * aircraft.wing_area_ft2;
    let normal_force = trim.normal_force(&aircraft, trim.thrust(&aircraft, DRAG));
    let of = |row: [f64; 4]| [row[0], row[1] * VELOCITY, row[2], 0.0];
    let (x, z, m) = (of(X), of(Z), of(M));
    let mut slopes = ByState::zeros();
    for i in 0..4 {
        slopes[(0, i)] = -z[i] / force;
        slopes[(1, i)] = m[i] / (force * aircraft.chord_ft);
        slopes[(2, i)] = -x[i] / force;
    }
    // The derivatives along velocity contain the growth of dynamic pressure.
    slopes[(0, 0)] -= 2.0 * normal_force / VELOCITY;
    slopes[(2, 0)] -= 2.0 * DRAG / VELOCITY;
    slopes
}

/// Longitudinal equations, in which all derivatives are times one value: one.
fn longitudinal_equations() -> LinearModel {
    let slopes = longitudinal::slopes(&aircraft(), &trim(), DRAG);
    let force = trim().qbar * aircraft().wing_area_ft2;
    let by_w_dot = Vector3::new(-Z[3], M[3] / aircraft().chord_ft, -X[3]) / force;
    LinearModel {
        rigid: slopes.by_state + slopes.by_coefficient * by_state(),
        slopes: vec![Matrix::zeros()],
        control_slopes: vec![control()],
        lag: Some(Lag {
            alpha: 1,
            slopes: vec![slopes.by_coefficient * by_w_dot * VELOCITY],
        }),
        velocity: VELOCITY,
        gravity: GRAVITY,
    }
}

fn at_one(equations: &LinearModel) -> Solved {
    let one = DVector::from_element(1, 1.0);
    equations.solved(&one, Differentiation::ValuesAlone)
}

fn modes(axis: Axis, rigid: Matrix, by_coefficient: ByCoefficient, by_state: ByState) -> Modes {
    let matrix = rigid + by_coefficient * by_state;
    Modes::of(axis, &matrix, &[]).unwrap()
}

fn assert_near(found: &Dual, expected: f64, share: f64) {
    assert_relative_eq!(found.value, expected, max_relative = share);
}

#[test]
fn the_longitudinal_modes_are_those_of_the_report() {
    let matrix = at_one(&longitudinal_equations()).matrix;
    let modes = Modes::of(Axis::Longitudinal, &matrix, &[]).unwrap();
    let (short_period, phugoid) = (modes.fast_pair(), modes.slow_pair());
    assert_near(&short_period.frequency(), 0.964, 0.005);
    assert_near(&short_period.damping(), 0.387, 0.015);
    assert_near(&phugoid.frequency(), 0.0673, 0.005);
    assert_near(&phugoid.damping(), 0.0489, 0.015);
}

#[test]
fn the_lateral_modes_are_those_of_the_report() {
    let (aircraft, trim) = (aircraft(), trim());
    let rates = lateral::rates(&aircraft, &trim);
    let force = trim.qbar * aircraft.wing_area_ft2;
    let moment = force * aircraft.span_ft;
    let y = [-1.103e3 * VELOCITY, 0.0, 0.0, 0.0];
    let l = [-6.885e4 * VELOCITY, -7.934e6, 7.321e6, 0.0];
    let n = [4.790e4 * VELOCITY, -9.809e5, -6.590e6, 0.0];
    let rows = [
        y.map(|v| v / force),
        l.map(|v| v / moment),
        n.map(|v| v / moment),
    ];
    let by_state = ByState::from_fn(|i, j| rows[i][j]);
    let modes = modes(
        Axis::Lateral,
        rates.by_state,
        rates.by_coefficient,
        by_state,
    );
    let dutch_roll = modes.fast_pair();
    assert_near(&dutch_roll.frequency(), 0.947, 0.005);
    assert_near(&dutch_roll.damping(), 0.0349, 0.015);
    let [roll, spiral] = modes.slow.map(|i| modes.roots[i].real());
    assert_near(&-roll, 0.562, 0.005);
    assert_near(&-spiral, 0.00730, 0.005);
}

/// Control derivatives of the elevator, per rad.
const ELEVATOR: [f64; 3] = [-3.717, -3.551e5, -3.839e7];

fn control() -> Vector {
    let [x, z, m] = ELEVATOR;
    Vector::from([x / MASS, z / (MASS * VELOCITY), m / trim().iy, 0.0])
}

#[test]
fn the_zeros_and_the_load_factor_are_those_of_the_transfer_functions() {
    let equations = longitudinal_equations();
    let one = DVector::from_element(1, 1.0);
    let found = equations
        .quantities(Axis::Longitudinal, &one, Differentiation::ValuesAlone)
        .unwrap();
    let value = |quantity| {
        let mut all = found.quantities.iter();
        all.find(|(q, _)| *q == quantity).unwrap().1.value
    };
    // Where the transfer function is zero, the system matrix is singular.
    let zero = -value(Quantity::AttitudeZero);
    let mut system = DMatrix::<f64>::zeros(5, 5);
    let Solved {
        matrix: a, control, ..
    } = at_one(&equations);
    for i in 0..4 {
        for j in 0..4 {
            system[(i, j)] = if i == j { zero } else { 0.0 } - a[(i, j)];
        }
        system[(i, 4)] = -control[i];
    }
    system[(4, 3)] = 1.0;
    let size = system.clone().singular_values();
    assert!(size.min() < 1e-9 * size.max(), "{size}");
    // The usual approximation of n/α: V/g times the larger zero.
    let usual = VELOCITY / GRAVITY * value(Quantity::AttitudeZero);
    assert_relative_eq!(
        value(Quantity::LoadFactorPerAlpha),
        usual,
        max_relative = 0.02
    );
    let frequency = value(Quantity::ShortPeriodFrequency);
    assert_relative_eq!(
        value(Quantity::ControlAnticipation),
        frequency * frequency / value(Quantity::LoadFactorPerAlpha),
        max_relative = 1e-12
    );
}
