//! NT-33A in the approach at sea level and Mach 0.204: condition 1 of NASA CR-2144 (Heffley and Jewell 1972).
//!
//! Coefficients and their derivatives in stability axes, per rad: Table II-1. Geometry and mass: Table
//! II-2. Modes: denominators of Tables II-4 and II-8.

use nalgebra::{Matrix2, Vector2, Vector3};

use super::fixture;
use super::reported::{
    ByState, Reported, assert_pair, assert_roll_and_spiral, level, longitudinal_modes,
};
use crate::aircraft::Aircraft;
use crate::qualities::linear::Vector;
use crate::qualities::trim::Trim;

const LIFT: f64 = 0.813;
const DRAG: f64 = 0.135;
const VELOCITY: f64 = 228.0;
const ALPHA_DEG: f64 = 2.2;

fn reported() -> Reported {
    let (sin, cos) = ALPHA_DEG.to_radians().sin_cos();
    let trim = Trim {
        velocity: VELOCITY,
        qbar: 61.7,
        mass: 11_800.0 / 32.174,
        ix: 12_700.0,
        iy: 20_700.0,
        iz: 32_001.0,
        ixz: 480.0,
        ..level(ALPHA_DEG)
    };
    Reported {
        aircraft: Aircraft {
            wing_area_ft2: 234.8,
            span_ft: 37.54,
            chord_ft: 6.72,
            ..fixture::aircraft()
        },
        trim,
        axial_force: DRAG * cos - LIFT * sin,
    }
}

#[test]
fn the_longitudinal_modes_are_those_of_the_report() {
    let (lift_by_alpha, drag_by_alpha) = (5.22, 0.54);
    let (moment_by_alpha, moment_by_q, moment_by_alpha_rate) = (-0.401, -10.0, -5.0);
    let reported = reported();
    let (sin, cos) = reported.trim.alpha.sin_cos();
    let lag = reported.aircraft.chord_ft / (2.0 * VELOCITY);
    let mut by_state = ByState::zeros();
    by_state[(0, 1)] = (lift_by_alpha + DRAG) * cos + (drag_by_alpha - LIFT) * sin;
    by_state[(1, 1)] = moment_by_alpha;
    by_state[(1, 2)] = moment_by_q * lag;
    by_state[(2, 1)] = (drag_by_alpha - LIFT) * cos - (lift_by_alpha + DRAG) * sin;
    let by_alpha_rate = Vector3::new(0.0, moment_by_alpha_rate * lag, 0.0);
    let modes =
        longitudinal_modes(&reported.longitudinal(by_state, by_alpha_rate, Vector::zeros()));
    assert_pair(&modes.fast_pair(), 1.59, 0.622);
    assert_pair(&modes.slow_pair(), 0.172, 0.0948);
}

#[test]
fn the_lateral_modes_are_those_of_the_report() {
    let reported = reported();
    let (sin, cos) = reported.trim.alpha.sin_cos();
    let to_body = Matrix2::new(cos, -sin, sin, cos);
    let lag = reported.aircraft.span_ft / (2.0 * VELOCITY);
    let by_beta = to_body * Vector2::new(-0.127, 0.049);
    let by_rate = to_body * Matrix2::new(-0.57, 0.20, -0.045, -0.16) * to_body.transpose() * lag;
    let mut by_state = ByState::zeros();
    by_state[(0, 0)] = -0.72;
    by_state.fixed_view_mut::<2, 1>(1, 0).copy_from(&by_beta);
    by_state.fixed_view_mut::<2, 2>(1, 1).copy_from(&by_rate);
    let modes = reported.lateral_modes(by_state);
    assert_pair(&modes.fast_pair(), 1.13, 0.0609);
    assert_roll_and_spiral(&modes, 2.20, 0.0318);
}
