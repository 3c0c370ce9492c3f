//! Outlook on planned maneuvers: its covariance is compared with the one after they were flown.

use approx::assert_relative_eq;
use nalgebra::{Cholesky, DMatrix, DVector};

use super::fixture::{Flown, aero_model, at, diagonal, exact, posterior, tunnel};
use crate::aero::{Axis, Condition};
use crate::model::{ManeuverResults, Model, Outlook, OutlookPoint, PointQuantity, Settings};
use crate::output_error::error_effect::SharedError;

/// A maneuver that estimates slope and damping and holds nothing, with a bias of its flight, whose
/// estimates are the tunnel's: the mean then does not depend on the scales, and nothing of them is
/// left open.
fn maneuver(id: &str, flight: &str, alpha_deg: f64) -> Flown {
    let known = |name: &str| tunnel(None).value(name, alpha_deg, 0.3).unwrap().value;
    let estimates = [("CN_alpha", known("CN_alpha")), ("CN_q", known("CN_q"))];
    let flown = Flown::new(id, flight, alpha_deg, &estimates, &diagonal([0.004, 0.3]));
    let bias = SharedError::Bias("x".into());
    flown.with(bias, 1.0, &[0.003, 0.1])
}

fn settings() -> Settings {
    Settings {
        class_error: 0.5,
        ..exact()
    }
}

fn points() -> Vec<OutlookPoint> {
    let point = |derivative: &str, alpha_deg| OutlookPoint {
        quantity: PointQuantity::Published(derivative.into()),
        condition: Condition {
            alpha_deg,
            mach: 0.3,
            third: None,
        },
    };
    vec![
        point("CN_alpha", 12.0),
        point("CN_q", 20.0),
        point("CN_ba", 30.0),
        point("CN_0", 20.0),
    ]
}

fn outlook(model: &Model, flown: &[Flown], planned: &[Flown]) -> Outlook {
    outlook_on(&points(), model, flown, planned)
}

fn outlook_on(
    points: &[OutlookPoint],
    model: &Model,
    flown: &[Flown],
    planned: &[Flown],
) -> Outlook {
    let flown: Vec<ManeuverResults> = flown.iter().map(Flown::evidence).collect();
    let planned: Vec<ManeuverResults> = planned.iter().map(Flown::evidence).collect();
    let (aero_model, tunnel) = (aero_model(), tunnel(None));
    let basis = (&aero_model, &tunnel);
    model
        .outlook((&flown, &planned), points, basis, &settings())
        .remove(0)
}

/// Covariance of the points.
fn of_points(outlook: &Outlook, covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let rows: Vec<usize> = outlook.points.iter().map(|(_, row)| *row).collect();
    covariance.select_rows(&rows).select_columns(&rows)
}

#[test]
fn without_new_maneuvers_it_is_the_posterior() {
    let flown = [maneuver("m1", "f1", 10.0), maneuver("m2", "f2", 25.0)];
    let model = posterior(&flown, &tunnel(None), &settings());
    let outlook = outlook(&model, &flown, &[]);
    let own = of_points(&outlook, &outlook.covariance);
    let published = [("CN_q", 20.0, 1), ("CN_ba", 30.0, 2), ("CN_0", 20.0, 3)];
    for (name, alpha_deg, i) in published {
        let (_, deviation) = at(&model, name, alpha_deg);
        assert_relative_eq!(own[(i, i)].sqrt(), deviation, max_relative = 1e-9);
    }
}

#[test]
fn a_combination_has_the_variance_of_the_local_posterior() {
    let flown = [maneuver("m1", "f1", 10.0), maneuver("m2", "f2", 25.0)];
    let model = posterior(&flown, &tunnel(None), &settings());
    let condition = Condition {
        alpha_deg: 17.0,
        mach: 0.3,
        third: None,
    };
    let local = model.posterior_at_condition(Axis::Longitudinal, &condition);
    let weights = DVector::from_fn(local.values.len(), |i, _| 0.5 - i as f64);
    let values = local.values.iter().cloned();
    let point = OutlookPoint {
        quantity: PointQuantity::Combination(values.zip(weights.iter().copied()).collect()),
        condition,
    };
    let outlook = outlook_on(&[point], &model, &flown, &[]);
    let own = of_points(&outlook, &outlook.covariance);
    let expected = (&local.covariance * &weights).dot(&weights);
    assert!(local.values.len() > 1);
    assert_relative_eq!(own[(0, 0)], expected, max_relative = 1e-9);
}

#[test]
fn what_the_data_leave_open_of_the_scales_is_in_it_whatever_the_values() {
    let off = |id: &str, alpha_deg: f64, factor: f64| {
        let mut own = maneuver(id, id, alpha_deg);
        for row in &mut own.estimates {
            row.value = row.value.map(|v| factor * v);
        }
        own
    };
    let flown = [off("m1", 10.0, 1.3), off("m2", 25.0, 0.8)];
    let model = posterior(&flown, &tunnel(None), &settings());
    for factor in [1.0, 3.0] {
        let flown = [off("m1", 10.0, 1.3 * factor), off("m2", 25.0, 0.8)];
        let outlook = outlook(&model, &flown, &[]);
        let own = of_points(&outlook, &outlook.covariance);
        for (name, alpha_deg, i) in [("CN_q", 20.0, 1), ("CN_0", 20.0, 3)] {
            let (_, deviation) = at(&model, name, alpha_deg);
            assert_relative_eq!(own[(i, i)].sqrt(), deviation, max_relative = 2e-3);
        }
    }
}

#[test]
fn planned_maneuvers_lead_to_the_covariance_after_they_were_flown() {
    let flown = [maneuver("m1", "f1", 10.0), maneuver("m2", "f2", 25.0)];
    // Of one flight, of a class that was flown, between the points of the grid.
    let planned = [maneuver("n1", "f3", 12.3), maneuver("n2", "f3", 33.0)];
    let model = posterior(&flown, &tunnel(None), &settings());
    let before = outlook(&model, &flown, &planned);
    let mut covariance = before.covariance.clone();
    for rows in before.planned.iter().flatten() {
        let first = rows.rows.start;
        let own = covariance.view((first, first), rows.noise.shape());
        let sum = Cholesky::new(own + &rows.noise).unwrap();
        let columns = covariance.columns_range(rows.rows.clone()).into_owned();
        covariance -= &columns * sum.solve(&columns.transpose());
    }
    let all = [&flown[..], &planned[..]].concat();
    // Without a published covariance there is no spread over scales to add.
    let mut bare = model.clone();
    for (_, coefficient) in &mut bare.coefficients {
        coefficient.gaussian.covariance.fill(0.0);
    }
    let after = outlook(&bare, &all, &[]);
    let (expected, before_all) = (
        of_points(&after, &after.covariance),
        of_points(&before, &before.covariance),
    );
    let found = of_points(&before, &covariance);
    for (i, found) in found.iter().enumerate() {
        assert_relative_eq!(*found, expected[i], max_relative = 1e-7, epsilon = 1e-12);
    }
    assert!(
        found[(0, 0)] < 0.8 * before_all[(0, 0)],
        "{found} {before_all}"
    );
}
