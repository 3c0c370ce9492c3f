//! Boeing 747-100 at 40,000 ft and Mach 0.8: condition 9 of NASA CR-2144 (Heffley and Jewell 1972).
//!
//! Dimensional derivatives in stability axes, ft, lb, s: Etkin and Reid, Dynamics of Flight, third
//! edition, Tables 6.2 and 6.7, which are those of the report. Modes: the report's own.

use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector, Vector3};

use super::fixture;
use super::reported::{
    Reported, assert_pair, assert_roll_and_spiral, at_one, level, longitudinal_modes,
};
use crate::aero::Axis;
use crate::aircraft::Aircraft;
use crate::qualities::linear::{Differentiation, LinearModel, SolvedEquations, Vector};
use crate::qualities::trim::Trim;
use crate::tables::FlyingQuality;

const VELOCITY: f64 = 774.0;
const GRAVITY: f64 = 32.2;
const MASS: f64 = 636_636.0 / GRAVITY;
const DENSITY: f64 = 0.000_590_9;

fn reported() -> Reported {
    let mut trim = Trim {
        velocity: VELOCITY,
        qbar: 0.5 * DENSITY * VELOCITY * VELOCITY,
        mass: MASS,
        gravity: GRAVITY,
        ix: 0.183e8,
        iy: 0.331e8,
        iz: 0.497e8,
        ixz: -0.156e7,
        ..level(0.0)
    };
    trim.condition.mach = 0.8;
    Reported {
        aircraft: Aircraft {
            wing_area_ft2: 5500.0,
            span_ft: 195.7,
            chord_ft: 27.31,
            ..fixture::aircraft()
        },
        trim,
        axial_force: 0.043,
    }
}

/// Longitudinal forces and moment per u, w, q and ẇ: rows X, Z, M.
const BY_STATE: [[f64; 3]; 3] = [
    [-1.358e2, 2.758e2, 0.0],
    [-1.778e3, -6.188e3, -1.017e5],
    [3.581e3, -3.515e4, -1.122e7],
];
const BY_W_RATE: [f64; 3] = [0.0, 1.308e2, -3.826e3];

/// Control derivatives of the elevator, per rad.
const ELEVATOR: [f64; 3] = [-3.717, -3.551e5, -3.839e7];

fn equations() -> LinearModel {
    let reported = reported();
    let Reported { aircraft, trim, .. } = &reported;
    let force = trim.qbar * aircraft.wing_area_ft2;
    let [x, z, m] = BY_W_RATE;
    let by_alpha_rate = Vector3::new(-z, m / aircraft.chord_ft, -x) * VELOCITY / force;
    let [x, z, m] = ELEVATOR;
    let control = Vector::from([x / MASS, z / (MASS * VELOCITY), m / trim.iy, 0.0]);
    reported.longitudinal(
        reported.longitudinal_by_state(BY_STATE),
        by_alpha_rate,
        control,
    )
}

#[test]
fn the_longitudinal_modes_are_those_of_the_report() {
    let modes = longitudinal_modes(&equations());
    assert_pair(&modes.fast_pair(), 0.964, 0.387);
    assert_pair(&modes.slow_pair(), 0.0673, 0.0489);
}

#[test]
fn the_lateral_modes_are_those_of_the_report() {
    let reported = reported();
    let y = [-1.103e3 * VELOCITY, 0.0, 0.0];
    let l = [-6.885e4 * VELOCITY, -7.934e6, 7.321e6];
    let n = [4.790e4 * VELOCITY, -9.809e5, -6.590e6];
    let modes = reported.lateral_modes(reported.lateral_by_state([y, l, n]));
    assert_pair(&modes.fast_pair(), 0.947, 0.0349);
    assert_roll_and_spiral(&modes, 0.562, 0.00730);
}

#[test]
fn the_zeros_and_the_load_factor_are_those_of_the_transfer_functions() {
    let equations = equations();
    let one = DVector::from_element(1, 1.0);
    let found = equations
        .quantities(Axis::Longitudinal, &one, Differentiation::ValuesAlone)
        .unwrap();
    let value = |quantity| {
        let mut all = found.quantities.iter();
        all.find(|(q, _)| *q == quantity).unwrap().1.value
    };
    // Where the transfer function is zero, the system matrix is singular.
    let zero = -value(FlyingQuality::AttitudeZero);
    let mut system = DMatrix::<f64>::zeros(5, 5);
    let SolvedEquations {
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
    let usual = VELOCITY / GRAVITY * value(FlyingQuality::AttitudeZero);
    assert_relative_eq!(
        value(FlyingQuality::LoadFactorPerAlpha),
        usual,
        max_relative = 0.02
    );
    let frequency = value(FlyingQuality::ShortPeriodFrequency);
    assert_relative_eq!(
        value(FlyingQuality::ControlAnticipation),
        frequency * frequency / value(FlyingQuality::LoadFactorPerAlpha),
        max_relative = 1e-12
    );
}
