//! Flown conditions.

use approx::assert_relative_eq;

use super::fixture::aircraft;
use crate::aero::WindTunnel;
use crate::maneuver::{Maneuver, Means};
use crate::qualities::trim::FlownConditions;

fn flown(alpha_deg: f64, qbar_psf: f64, theta_deg: f64, surface: Option<f64>) -> (Maneuver, Means) {
    let maneuver = Maneuver {
        qbar_psf,
        ..Maneuver::example("m", alpha_deg)
    };
    let means = Means {
        theta_deg,
        z_cg_ft: 1.5,
        ix_slug_ft2: 22e3,
        iy_slug_ft2: 172e3,
        iz_slug_ft2: 188e3,
        ixz_slug_ft2: -2e3,
        surfaces_deg: surface
            .map(|v| ("de_deg".to_owned(), v))
            .into_iter()
            .collect(),
    };
    (maneuver, means)
}

fn conditions() -> FlownConditions {
    let all = [
        flown(10.0, 90.0, 9.0, Some(-2.0)),
        flown(11.0, 86.0, 10.0, None),
        flown(20.5, 60.0, 12.5, Some(-4.0)),
    ];
    let pairs: Vec<(&Maneuver, &Means)> = all.iter().map(|(m, means)| (m, means)).collect();
    FlownConditions::new(&pairs, &WindTunnel::default())
}

#[test]
fn conditions_are_means_of_neighbours_and_linear_between() {
    let aircraft = aircraft();
    // Maneuvers at 10 and 11 deg are one condition at 10.5 deg and 88 lb/ft².
    let near = conditions().trim(10.5, &aircraft).unwrap();
    assert_relative_eq!(near.qbar, 88.0);
    assert_relative_eq!(
        (near.theta - near.alpha).to_degrees(),
        -1.0,
        epsilon = 1e-12
    );
    assert_relative_eq!(near.surfaces_deg["de_deg"], -2.0);
    let middle = conditions().trim(15.5, &aircraft).unwrap();
    assert_relative_eq!(middle.qbar, 74.0);
    assert_relative_eq!(middle.surfaces_deg["de_deg"], -3.0);
    // The path is linear, from −1 to −8 deg.
    assert_relative_eq!(
        (middle.theta - middle.alpha).to_degrees(),
        -4.5,
        epsilon = 1e-12
    );
}

#[test]
fn there_is_no_condition_beyond_what_was_flown() {
    let aircraft = aircraft();
    let edge = conditions().trim(21.5, &aircraft).unwrap();
    assert_relative_eq!(edge.qbar, 60.0);
    assert_relative_eq!(edge.alpha.to_degrees(), 21.5);
    assert_relative_eq!(
        (edge.theta - edge.alpha).to_degrees(),
        -8.0,
        epsilon = 1e-12
    );
    assert!(conditions().trim(30.0, &aircraft).is_none());
    assert!(conditions().trim(5.0, &aircraft).is_none());
}
