//! Lift and drag against the turned forces themselves, and their covariance against its closed form.

use std::collections::BTreeMap;

use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector};

use crate::aero::{AeroModel, Coefficient, Derivative, Regressor};
use crate::dynamics::tests::aircraft;
use crate::estimate::Covariance;
use crate::maneuver::{Maneuver, Means, Status};
use crate::model::results::lift_and_drag::PublishedManeuver;
use crate::model::{ManeuverResults, Model};
use crate::output_error::error_effect::{ErrorEffect, SharedError};
use crate::tables::{EstimateRow, LiftAndDragRow};

/// Derivatives with their regressors and values; those of the surface are held.
const MODEL: [(&str, &str, f64); 8] = [
    ("CN_0", "constant", 0.3),
    ("CN_alpha", "alpha", 0.05),
    ("CN_de", "de_deg", 0.012),
    ("CN_q", "q", 4.0),
    ("CA_0", "constant", 0.06),
    ("CA_alpha", "alpha", -0.002),
    ("CA_alpha2", "alpha * alpha", 3e-5),
    ("CA_de", "de_deg", 0.001),
];

const ALPHA_DEG: f64 = 20.0;
const DE_DEG: f64 = -5.0;

fn aero_model() -> AeroModel {
    let derivative = |(name, regressor, _): &(&str, &str, f64)| Derivative {
        name: (*name).into(),
        coefficient: if name.starts_with("CN") {
            Coefficient::CN
        } else {
            Coefficient::CA
        },
        regressor: Regressor::parse(regressor).unwrap(),
    };
    AeroModel {
        derivatives: MODEL.iter().map(derivative).collect(),
        ..AeroModel::default()
    }
}

fn is_held(name: &str) -> bool {
    name.ends_with("_de")
}

/// Rows of a maneuver with a covariance of the estimates and effects of what is held.
fn rows(corrected: &DMatrix<f64>, effects: Vec<ErrorEffect>) -> Vec<LiftAndDragRow> {
    let maneuver = Maneuver::example("m", ALPHA_DEG);
    let estimates = MODEL.iter().map(|(name, _, value)| {
        let status = if is_held(name) {
            Status::Held
        } else {
            Status::Estimated
        };
        EstimateRow {
            value: Some(*value),
            ..EstimateRow::without_results(&maneuver, name, "-", status)
        }
    });
    let estimates: Vec<EstimateRow> = estimates.collect();
    let free = MODEL.iter().filter(|(name, ..)| !is_held(name));
    let covariance = Covariance {
        names: free.map(|(name, ..)| (*name).into()).collect(),
        white: vec![],
        corrected: corrected.as_slice().to_vec(),
        shared_errors: effects,
    };
    let evidence = ManeuverResults {
        maneuver: &maneuver,
        estimates: &estimates,
        combined: &[],
        covariance: &covariance,
    };
    let means = Means {
        surfaces_deg: BTreeMap::from([("de_deg".into(), DE_DEG)]),
        ..Means::default()
    };
    let flown = PublishedManeuver {
        evidence: &evidence,
        estimates: &estimates,
        means: &means,
        aircraft: &aircraft(),
        aero_model: &aero_model(),
    };
    Model::default().lift_and_drag(&flown, false)
}

/// C_L and C_D at an angle of attack and a deflection.
fn forces(alpha_deg: f64, de_deg: f64) -> [f64; 2] {
    let normal = 0.3 + 0.05 * alpha_deg + 0.012 * de_deg;
    let axial = 0.06 - 0.002 * alpha_deg + 3e-5 * alpha_deg * alpha_deg + 0.001 * de_deg;
    let (sin, cos) = alpha_deg.to_radians().sin_cos();
    [normal * cos - axial * sin, normal * sin + axial * cos]
}

#[test]
fn values_and_slopes_are_those_of_the_turned_forces() {
    let rows = rows(&DMatrix::identity(6, 6), vec![]);
    let find = |regressor: &str| rows.iter().find(|r| r.regressor == regressor).unwrap();
    let assert_is = |row: &LiftAndDragRow, [lift, drag]: [f64; 2]| {
        assert_relative_eq!(row.lift, lift, max_relative = 1e-7);
        assert_relative_eq!(row.drag, drag, max_relative = 1e-7);
    };
    assert_is(find("total"), forces(ALPHA_DEG, DE_DEG));
    let h = 1e-4;
    let (above, below) = (forces(ALPHA_DEG + h, DE_DEG), forces(ALPHA_DEG - h, DE_DEG));
    let slope = std::array::from_fn(|i| (above[i] - below[i]) / (2.0 * h));
    assert_is(find("alpha"), slope);
    let (sin, cos) = ALPHA_DEG.to_radians().sin_cos();
    assert_is(find("q"), [4.0 * cos, 4.0 * sin]);
    assert_eq!(find("alpha").unit, "per_deg");
    // The surface's derivatives are held: their slope is not the flight's.
    assert_eq!(rows.len(), 3);
}

#[test]
fn bounds_and_correlation_are_those_of_the_turned_covariance() {
    // Only the rate's derivative of the normal force is uncertain, by 0.2.
    let mut covariance = DMatrix::zeros(6, 6);
    covariance[(2, 2)] = 0.04;
    let rows = rows(&covariance, vec![]);
    let row = rows.iter().find(|r| r.regressor == "q").unwrap();
    let (sin, cos) = ALPHA_DEG.to_radians().sin_cos();
    assert_relative_eq!(row.lift_bound, 0.2 * cos, max_relative = 1e-12);
    assert_relative_eq!(row.drag_bound, 0.2 * sin, max_relative = 1e-12);
    assert_relative_eq!(row.correlation.unwrap(), 1.0, max_relative = 1e-12);
}

#[test]
fn what_the_constant_makes_up_for_is_no_error_of_the_total() {
    // CN_de is above its held value by 0.003: CN_0 is estimated above the truth by 0.003 δe.
    let deviation = 0.003;
    let change = DVector::from_fn(6, |i, _| if i == 0 { deviation * DE_DEG } else { 0.0 });
    let corrected = &change * change.transpose();
    let effect = ErrorEffect::new(SharedError::Held("CN_de".into()), deviation, &change);
    let rows = rows(&corrected, vec![effect]);
    let total = rows.iter().find(|r| r.regressor == "total").unwrap();
    assert_relative_eq!(total.lift_bound, 0.0, epsilon = 1e-9);
    assert_relative_eq!(total.drag_bound, 0.0, epsilon = 1e-9);
}
