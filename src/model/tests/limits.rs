//! Limits in which the posterior is known exactly.

use approx::assert_relative_eq;

use super::fixture::{Flown, at, diagonal, exact, posterior, tunnel};
use crate::aero::WindTunnel;
use crate::model::{Failure, MOST_POINTS, Settings};
use crate::output_error::error_effect::SharedError;

/// Uncertainty of a tunnel beside which flight alone counts.
const UNKNOWN: Option<f64> = Some(1e3);

fn slope(id: &str, flight: &str, value: f64) -> Flown {
    Flown::new(id, flight, 20.0, &[("CN_alpha", value)], &diagonal([0.002]))
}

#[test]
fn without_flight_the_posterior_is_the_tunnel_and_its_uncertainty() {
    let stated = posterior(&[], &tunnel(Some(0.03)), &exact());
    for alpha_deg in [0.0, 10.0, 20.0, 40.0] {
        let known = tunnel(None).value("CN_q", alpha_deg, 0.3).unwrap().value;
        let (value, deviation) = at(&stated, "CN_q", alpha_deg);
        assert_relative_eq!(value, known, max_relative = 1e-12);
        assert_relative_eq!(deviation, 0.03, max_relative = 1e-12);
        // Without a statement: a fifth, half of it of the value and half of the root mean square.
        let size = tunnel(None).root_mean_square("CN_q");
        let assumed = posterior(&[], &tunnel(None), &exact());
        let expected = 0.2 * (0.5 * size * size + 0.5 * known * known).sqrt();
        assert_relative_eq!(
            at(&assumed, "CN_q", alpha_deg).1,
            expected,
            max_relative = 1e-12
        );
    }
    assert!(
        stated
            .rows
            .posterior
            .iter()
            .all(|r| r.flight_share_pct.is_some_and(|share| share < 1e-9))
    );
}

#[test]
fn a_grid_of_too_many_points_is_refused_before_it_takes_memory() {
    let fine = Settings {
        alpha_step_deg: 0.001,
        ..exact()
    };
    let found = posterior(&[], &tunnel(None), &fine);
    assert!(found.coefficients.is_empty());
    let is_too_large =
        |failure: &Failure| matches!(failure, Failure::TooManyPoints(n) if *n > MOST_POINTS);
    assert!(!found.failed.is_empty() && found.failed.iter().all(|(_, f)| is_too_large(f)));
}

#[test]
fn of_an_unknown_tunnel_the_maneuver_s_own_estimate_is_left() {
    let found = posterior(&[slope("m", "f", 0.07)], &tunnel(UNKNOWN), &exact());
    let (value, deviation) = at(&found, "CN_alpha", 20.0);
    assert_relative_eq!(value, 0.07, max_relative = 1e-6);
    assert_relative_eq!(deviation, 0.002, max_relative = 1e-6);
}

#[test]
fn a_copy_as_another_flight_shortens_the_band_by_the_root_of_two() {
    let one = posterior(&[slope("m", "f", 0.07)], &tunnel(UNKNOWN), &exact());
    let both = [slope("m", "f", 0.07), slope("n", "g", 0.07)];
    let two = posterior(&both, &tunnel(UNKNOWN), &exact());
    assert_relative_eq!(
        at(&two, "CN_alpha", 20.0).1,
        at(&one, "CN_alpha", 20.0).1 / 2f64.sqrt(),
        max_relative = 1e-6
    );
}

#[test]
fn calibration_errors_average_over_flights_not_within_one_and_delays_never() {
    let deviation = |flights: [&str; 2], error: &SharedError| {
        let flown = ["m", "n"]
            .into_iter()
            .zip(flights)
            .map(|(id, flight)| slope(id, flight, 0.07).with(error.clone(), 0.01, &[0.004]));
        let found = posterior(&flown.collect::<Vec<_>>(), &tunnel(UNKNOWN), &exact());
        at(&found, "CN_alpha", 20.0).1
    };
    let own = 0.002 / 2f64.sqrt();
    let bias = SharedError::Bias("an".into());
    let delay = SharedError::Delay("de_deg".into());
    assert_relative_eq!(
        deviation(["f", "g"], &bias),
        own.hypot(0.004 / 2f64.sqrt()),
        max_relative = 1e-6
    );
    assert_relative_eq!(
        deviation(["f", "f"], &bias),
        own.hypot(0.004),
        max_relative = 1e-6
    );
    assert_relative_eq!(
        deviation(["f", "g"], &delay),
        own.hypot(0.004),
        max_relative = 1e-6
    );
}

#[test]
fn an_error_of_the_class_is_not_averaged_away() {
    let settings = crate::model::Settings {
        class_error: 0.5,
        ..exact()
    };
    let flown: Vec<Flown> = (0..100)
        .map(|i| slope(&format!("m{i}"), &format!("f{i}"), 0.07))
        .collect();
    let (_, deviation) = at(
        &posterior(&flown, &tunnel(UNKNOWN), &settings),
        "CN_alpha",
        20.0,
    );
    assert_relative_eq!(deviation, 0.5f64.hypot(0.1) * 0.002, max_relative = 1e-4);
}

#[test]
fn a_wrong_held_value_is_corrected_by_a_maneuver_that_estimates_it() {
    // CN_q is 4 above the tunnel; a maneuver that held it took it for CN_alpha, by 0.01 for each unit.
    let held = slope("m", "f", 0.04 + 0.01 * 4.0).with(
        SharedError::Held("CN_q".into()),
        0.8,
        &[0.01 * 0.8],
    );
    let sure = Flown::new("n", "g", 20.0, &[("CN_q", 9.0)], &diagonal([1e-3]));
    let found = posterior(&[held.clone(), sure], &tunnel(UNKNOWN), &exact());
    let (value, deviation) = at(&found, "CN_alpha", 20.0);
    assert_relative_eq!(value, 0.04, max_relative = 1e-4);
    assert_relative_eq!(deviation, 0.002, max_relative = 1e-4);
    // Alone it cannot separate them.
    let alone = posterior(&[held], &tunnel(Some(0.8)), &exact());
    assert!(at(&alone, "CN_alpha", 20.0).1 > 0.005);
}

#[test]
fn the_sum_is_estimated_and_the_constant_follows_from_it() {
    // Constant and slope are badly known, their sum at 20 deg well: 0.9.
    let mut covariance = diagonal([0.2, 0.01]);
    covariance[(0, 1)] = -0.2 * 0.01 * 0.999;
    covariance[(1, 0)] = covariance[(0, 1)];
    let estimates = [("CN_0", -0.5), ("CN_alpha", 0.07)];
    let flown = Flown::new("m", "f", 20.0, &estimates, &covariance);
    let found = posterior(&[flown], &tunnel(UNKNOWN), &exact());
    let (sum, of_sum) = at(&found, "CN_ba", 20.0);
    assert_relative_eq!(sum, -0.5 + 20.0 * 0.07, max_relative = 1e-6);
    let variance: f64 = 0.04 + 400.0 * 1e-4 - 2.0 * 20.0 * 0.2 * 0.01 * 0.999;
    assert_relative_eq!(of_sum, variance.sqrt(), max_relative = 1e-5);
    let (constant, of_constant) = at(&found, "CN_0", 20.0);
    assert_relative_eq!(constant, -0.5, max_relative = 1e-6);
    assert_relative_eq!(of_constant, 0.2, max_relative = 1e-5);
}

#[test]
fn without_a_tunnel_flight_alone_speaks() {
    let flown = [slope("m", "f", 0.07), slope("n", "g", 0.07)];
    let found = posterior(&flown, &WindTunnel::default(), &exact());
    let (value, deviation) = at(&found, "CN_alpha", 20.0);
    assert_relative_eq!(value, 0.07, max_relative = 0.01);
    assert!(deviation < 0.0015);
    assert!(
        found
            .rows
            .posterior
            .iter()
            .all(|row| row.wind_tunnel.is_none())
    );
    assert!(
        posterior(&[], &WindTunnel::default(), &exact())
            .rows
            .posterior
            .is_empty()
    );
}

#[test]
fn an_outlier_loses_its_weight() {
    let settings = crate::model::Settings {
        degrees_of_freedom: 4.0,
        ..exact()
    };
    let mut flown: Vec<Flown> = (0..6)
        .map(|i| slope(&format!("m{i}"), &format!("f{i}"), 0.04))
        .collect();
    flown.push(slope("wild", "g", 0.4));
    let found = posterior(&flown, &tunnel(Some(0.01)), &settings);
    let weight = |id: &str| {
        let rows = &found.rows.contributions;
        rows.iter().find(|r| r.maneuver_id == id).unwrap().weight
    };
    assert!(weight("wild") < 0.01 && weight("m0") > 0.5);
    assert!((at(&found, "CN_alpha", 20.0).0 - 0.04).abs() < 0.002);
}

#[test]
fn the_order_of_the_evidence_does_not_matter() {
    let mut flown: Vec<Flown> = (0..6)
        .map(|i| {
            slope(
                &format!("m{i}"),
                &format!("f{}", i / 2),
                0.04 + 0.001 * f64::from(i),
            )
        })
        .collect();
    let first = posterior(&flown, &tunnel(None), &exact());
    flown.reverse();
    assert_eq!(first.rows, posterior(&flown, &tunnel(None), &exact()).rows);
}
