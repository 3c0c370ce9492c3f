//! Tables are interpolated, clamped or refused as their settings say.

use crate::aero::interpolation::Interpolation;

use super::*;
use approx::assert_relative_eq;

fn tunnel(points: &[(f64, Option<f64>, f64)]) -> WindTunnel {
    let mut tunnel = WindTunnel::default();
    for &(alpha_deg, mach, value) in points {
        tunnel.insert(
            "CN_alpha",
            TunnelPoint {
                mach,
                ..TunnelPoint::new(alpha_deg, value)
            },
        );
    }
    tunnel
}

fn value(tunnel: &WindTunnel, alpha_deg: f64, mach: f64) -> f64 {
    tunnel
        .value("CNalpha", alpha_deg, mach)
        .expect("tabulated")
        .value
}

#[test]
fn a_table_is_linear_between_its_points_and_constant_beyond() {
    let t = tunnel(&[(20.0, None, 3.0), (10.0, None, 1.0), (30.0, None, 2.0)]);
    for (alpha, expected) in [
        (10.0, 1.0),
        (12.5, 1.5),
        (20.0, 3.0),
        (25.0, 2.5),
        (30.0, 2.0),
        (5.0, 1.0),
        (60.0, 2.0),
    ] {
        assert_relative_eq!(value(&t, alpha, 0.3), expected);
    }
}

#[test]
fn mach_is_interpolated_where_the_tables_have_it() {
    let t = tunnel(&[
        (10.0, Some(0.2), 1.0),
        (20.0, Some(0.2), 2.0),
        (10.0, Some(0.6), 3.0),
        (20.0, Some(0.6), 6.0),
    ]);
    assert_relative_eq!(value(&t, 15.0, 0.2), 1.5);
    assert_relative_eq!(value(&t, 15.0, 0.4), 3.0);
    assert_relative_eq!(value(&t, 20.0, 0.5), 5.0);
    assert_relative_eq!(value(&t, 20.0, 0.9), 6.0);
    assert_relative_eq!(value(&t, 20.0, 0.1), 2.0);
}

#[test]
fn an_unknown_derivative_has_no_value() {
    assert_eq!(tunnel(&[(10.0, None, 1.0)]).value("CN_q", 10.0, 0.3), None);
}

fn points() -> Vec<(f64, Option<f64>, f64)> {
    let mach = [0.2, 0.6];
    mach.iter()
        .flat_map(|&m| (0..4).map(move |k| (10.0 * f64::from(k), Some(m), f64::from(k * k) + m)))
        .collect()
}

#[test]
fn a_third_variable_is_interpolated_and_read_at_its_setting_where_it_is_not_known() {
    let third = Some(Third {
        name: "altitude_ft".into(),
        at: 20e3,
    });
    let mut t = WindTunnel::new(Settings {
        third,
        ..Settings::default()
    });
    for (altitude, factor) in [(10e3, 1.0), (30e3, 3.0)] {
        for (alpha_deg, mach, value) in points() {
            let point = TunnelPoint {
                mach,
                ..TunnelPoint::new(alpha_deg, factor * value)
            };
            t.insert_at("CN_alpha", Some(altitude), point);
        }
    }
    let at = |third: Option<f64>| {
        t.at(
            "CN_alpha",
            &Condition {
                alpha_deg: 15.0,
                mach: 0.4,
                third,
            },
        )
        .expect("tabulated")
        .value
    };
    // (1 + 4)/2 + 0.4 at the first altitude.
    assert_relative_eq!(at(Some(10e3)), 2.9, max_relative = 1e-14);
    assert_relative_eq!(at(Some(25e3)), 2.5 * 2.9, max_relative = 1e-14);
    assert_relative_eq!(at(None), 2.0 * 2.9, max_relative = 1e-14);
    assert_eq!(t.thirds("CN_alpha"), [10e3, 30e3]);
    assert_eq!(t.machs("CN_alpha"), [0.2, 0.6]);
}

#[test]
fn a_monotone_cubic_runs_through_the_points_and_differs_between_them() {
    let mut cubic = WindTunnel::new(Settings {
        interpolation: Interpolation::MonotoneCubic,
        ..Settings::default()
    });
    let straight = tunnel(&points());
    for (alpha_deg, mach, value) in points() {
        cubic.insert(
            "CN_alpha",
            TunnelPoint {
                mach,
                ..TunnelPoint::new(alpha_deg, value)
            },
        );
    }
    for (alpha, mach, v) in points() {
        assert_relative_eq!(
            value(&cubic, alpha, mach.expect("mach")),
            v,
            max_relative = 1e-14
        );
    }
    // Closed form for k² at unit spacing between 1 and 2: chords 1, 3, 5 have the slopes 1.5
    // and 3.75.
    let expected = 0.5 * (1.0 + 4.0) + (1.5 - 3.75) / 8.0 + 0.2;
    assert_relative_eq!(value(&cubic, 15.0, 0.2), expected, max_relative = 1e-14);
    assert!((value(&straight, 15.0, 0.2) - expected).abs() > 0.1);
}

#[test]
fn beyond_the_ends_it_is_clamped_or_refused_and_says_so() {
    let clamped = tunnel(&points());
    let mut refusing = WindTunnel::new(Settings {
        extrapolation: Extrapolation::Refuse,
        ..Settings::default()
    });
    for (alpha_deg, mach, value) in points() {
        refusing.insert(
            "CN_alpha",
            TunnelPoint {
                mach,
                ..TunnelPoint::new(alpha_deg, value)
            },
        );
    }
    let beyond = Condition {
        alpha_deg: 31.0,
        mach: 0.7,
        third: None,
    };
    assert_relative_eq!(clamped.at("CN_alpha", &beyond).expect("clamped").value, 9.6);
    assert_eq!(refusing.at("CN_alpha", &beyond), None);
    let named = |variable: &str, read_at, from, to| ExtrapolatedReading {
        variable: variable.into(),
        read_at,
        from,
        to,
    };
    let both = [
        named("mach", 0.7, 0.2, 0.6),
        named("alpha_deg", 31.0, 0.0, 30.0),
    ];
    assert_eq!(refusing.extrapolations("CN_alpha", &beyond), both);
    let inside = Condition {
        alpha_deg: 30.0,
        mach: 0.2,
        third: None,
    };
    assert_eq!(refusing.extrapolations("CN_alpha", &inside), []);
    assert_eq!(
        refusing.at("CN_alpha", &inside),
        clamped.at("CN_alpha", &inside)
    );
}

#[test]
fn a_shorter_row_at_one_mach_ends_where_it_ends() {
    let t = tunnel(&[
        (0.0, Some(0.2), 0.0),
        (30.0, Some(0.2), 3.0),
        (0.0, Some(0.6), 0.0),
        (10.0, Some(0.6), 1.0),
    ]);
    let at = |alpha_deg, mach| {
        t.extrapolations(
            "CN_alpha",
            &Condition {
                alpha_deg,
                mach,
                third: None,
            },
        )
    };
    assert_eq!(at(20.0, 0.2), []);
    assert_eq!(
        at(20.0, 0.3),
        [ExtrapolatedReading {
            variable: "alpha_deg".into(),
            read_at: 20.0,
            from: 0.0,
            to: 10.0
        }]
    );
}
