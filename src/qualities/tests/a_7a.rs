//! A-7A at sea level, Mach 0.25 and 11.2 deg of α: condition 1 of NASA CR-96008 (Teper 1969), the report before NASA
//! CR-2144.
//!
//! Derivatives in body axes per mass and inertia, ft, s: Tables II-B and II-C. Modes: denominators of
//! Tables II-D and II-E.

use nalgebra::Vector3;

use super::fixture;
use super::reported::{Reported, assert_pair, assert_roll_and_spiral, level, longitudinal_modes};
use crate::aircraft::Aircraft;
use crate::qualities::linear::Vector;
use crate::qualities::trim::Trim;

const ALPHA_DEG: f64 = 11.2;
const VELOCITY: f64 = 279.0;

/// Derivatives are per mass and inertia, so that sizes do not count.
fn reported() -> Reported {
    let trim = Trim {
        velocity: VELOCITY,
        qbar: 91.5,
        ..level(ALPHA_DEG)
    };
    Reported {
        aircraft: Aircraft {
            wing_area_ft2: 1.0,
            span_ft: 1.0,
            chord_ft: 1.0,
            ..fixture::aircraft()
        },
        trim,
        axial_force: 0.0,
    }
}

#[test]
fn the_short_period_is_that_of_the_report() {
    let (x, z) = ([0.0162, -0.0145, 0.0], [-0.0814, -0.779, 0.0]);
    let m = [0.002_01, -0.009_82, -0.466];
    let moment_by_w_rate = -0.000_286;
    let reported = reported();
    let by_state = reported.longitudinal_by_state([x, z, m]);
    let Trim { alpha, qbar, .. } = reported.trim;
    let by_alpha_rate = Vector3::new(0.0, moment_by_w_rate * VELOCITY * alpha.cos() / qbar, 0.0);
    let modes =
        longitudinal_modes(&reported.longitudinal(by_state, by_alpha_rate, Vector::zeros()));
    assert_pair(&modes.fast_pair(), 1.76, 0.367);
}

#[test]
fn the_lateral_modes_are_those_of_the_report() {
    let reported = reported();
    let y = [-0.162 * VELOCITY, 0.0, 0.0];
    let (l, n) = ([-11.9, -2.00, 1.18], [1.28, -0.0870, -0.369]);
    let modes = reported.lateral_modes(reported.lateral_by_state([y, l, n]));
    assert_pair(&modes.fast_pair(), 1.81, 0.237);
    assert_roll_and_spiral(&modes, 1.62, 0.0462);
}
