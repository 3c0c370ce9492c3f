//! The angle of attack to which an estimate belongs is uncertain.

use approx::assert_relative_eq;
use nalgebra::DMatrix;

use super::fixture::{Flown, at, diagonal, exact, posterior, tunnel};
use super::parts::{data, scales};
use crate::model::prior::angle_noise::{ANGLE_SHARE, angle_noise};
use crate::output_error::error_effect::SharedError;

/// Sweep of a maneuver whose estimates belong to an angle of attack known to 2 deg.
const SWEEP_DEG: f64 = 2.0 / ANGLE_SHARE;

fn flown(alpha_deg: f64, estimates: &[(&str, f64)], sweep_deg: Option<f64>) -> Flown {
    let covariance = diagonal::<2>([1e-4, 1e-3]);
    let mut flown = Flown::new("m", "f", alpha_deg, estimates, &covariance);
    flown.maneuver.quality.alpha_rms_deg = sweep_deg;
    flown
}

#[test]
fn the_angle_s_noise_is_the_change_of_tunnel_and_difference_over_its_deviation() {
    let flown = flown(20.0, &[("CN_alpha", 0.04), ("CN_q", 5.0)], None);
    let (terms, _) = data(std::slice::from_ref(&flown), &exact());
    let tunnel = tunnel(None);
    let condition = flown.maneuver.condition(&tunnel);
    let noise = angle_noise(&terms, &scales(), &DMatrix::identity(3, 3), &condition, 2.5);
    for (i, (term, scale)) in terms.iter().zip(scales()).enumerate() {
        // Per degree the tunnel changes by 0.03, -0.0005 and 0.05. The sum's slope is 0.04.
        let of_tunnel: f64 = 2.5 * [0.03 - 0.04, -0.0005, 0.05][i];
        // Half a change over ±2.5 deg: ½ C(0) at both ends, less ½ C(5 deg).
        let size = tunnel.root_mean_square(&term.prior.name);
        let value = |alpha_deg: f64| {
            tunnel
                .value(&term.prior.name, alpha_deg, 0.3)
                .unwrap()
                .value
        };
        let covariance = |a: f64, b: f64| {
            let r = 3f64.sqrt() * (a - b).abs() / scale.length_deg;
            let shape = 0.5 * size * size + 0.5 * value(a) * value(b);
            scale.size.powi(2) * shape * 0.8 * ((1.0 + r) * (-r).exp() + 0.25)
        };
        let (low, high) = (17.5, 22.5);
        let of_difference =
            0.25 * (covariance(low, low) + covariance(high, high) - 2.0 * covariance(low, high));
        let expected = of_tunnel.powi(2) + of_difference;
        assert_relative_eq!(noise[(i, i)], expected, max_relative = 1e-9);
    }
    assert_relative_eq!(noise[(0, 1)], 0.0, epsilon = 1e-18);
}

#[test]
fn a_maneuver_that_sweeps_more_tells_less_where_the_derivative_changes() {
    let estimates = [("CN_alpha", 0.04), ("CN_q", 5.0)];
    let deviation = |sweep_deg: Option<f64>| {
        let flown = [flown(20.0, &estimates, sweep_deg)];
        at(&posterior(&flown, &tunnel(None), &exact()), "CN_q", 20.0).1
    };
    // The tunnel's CN_q changes by 0.05 per degree, far more than the estimate's bound of 0.001.
    let (still, sweeping) = (deviation(Some(0.0)), deviation(Some(SWEEP_DEG)));
    assert_relative_eq!(still, 1e-3, max_relative = 0.01);
    assert!((0.1..0.2).contains(&sweeping), "{sweeping}");
    assert_relative_eq!(deviation(None), still, max_relative = 1e-12);
    assert_relative_eq!(deviation(Some(f64::NAN)), still, max_relative = 1e-12);
}

#[test]
fn a_held_derivative_acts_at_an_uncertain_angle_of_its_own() {
    let (deviation, gain) = (0.5, 0.004);
    let estimates = [("CN_alpha", 0.04)];
    let mut flown = Flown::new("m", "f", 20.0, &estimates, &diagonal::<1>([1e-6])).with(
        SharedError::Held("CN_q".into()),
        deviation,
        &[gain * deviation],
    );
    flown.maneuver.quality.alpha_rms_deg = Some(SWEEP_DEG);
    let (terms, _) = data(std::slice::from_ref(&flown), &exact());
    let observation = flown.evidence().about(&terms, &tunnel(None)).unwrap();
    let at = observation.condition;
    let each = angle_noise(&terms, &scales(), &DMatrix::identity(3, 3), &at, 2.0);
    let whole = observation.whole_noise(&terms, &scales()) - &observation.noise;
    // 20 deg is a point of the grids, so nothing varies between points.
    let expected = each[(1, 1)] + gain * gain * each[(2, 2)];
    assert_relative_eq!(whole[(0, 0)], expected, max_relative = 1e-9);
}
