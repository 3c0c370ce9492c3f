//! A class that estimates the derivative of a surface that rests.

use super::*;
use crate::aero::{Coefficient, Regressor};

/// The bench with a flap in its model and its class.
fn bench_with_flap() -> Bench {
    let mut bench = bench();
    bench.aero_model.derivatives.push(Derivative {
        name: "Cm_dtef".into(),
        coefficient: Coefficient::Cm,
        regressor: Regressor::Surface("dtef_deg".into()),
    });
    let statuses = &mut bench.class.statuses;
    statuses.insert("Cm_dtef".into(), Status::Estimated);
    bench
}

/// A flight of the bench with a flap that is at 20 deg but for the noise of its transducer.
fn flown_with_flap(bench: &Bench) -> Record {
    let mut record = bench.flown(1, 1.0, 0.0);
    let mut noise = Noise(9);
    let flap = Series {
        values: (0..SAMPLES)
            .map(|_| 20.0 + 0.02 * noise.gaussian())
            .collect(),
        marks: vec![Mark::Measured; SAMPLES],
    };
    record.signals.insert("dtef_deg".into(), flap);
    record
}

#[test]
fn the_derivative_of_a_surface_that_rests_is_inactive_and_the_others_are_as_without_it() {
    let (with, without) = (bench_with_flap(), bench());
    let record = flown_with_flap(&without);
    let maneuver = maneuver("m", 20.0);
    let (found, expected) = (
        with.estimate(&record, &maneuver),
        without.estimate(&record, &maneuver),
    );
    assert_eq!(
        found.fit.outcome,
        Outcome::Converged,
        "{}",
        found.fit.reason
    );
    let flap = row(&found, "Cm_dtef");
    assert_eq!((flap.status, flap.value), (Status::Inactive, None));
    assert_eq!(flap.held_because.as_deref(), Some("its surface rests"));
    for expected in &expected.estimates {
        let found = row(&found, &expected.derivative);
        assert_eq!(
            (found.value, found.bound_corrected, &found.held_because),
            (expected.value, expected.bound_corrected, &None),
            "{}",
            expected.derivative
        );
    }
}

#[test]
fn a_prediction_needs_no_derivative_of_a_surface_that_rests() {
    let bench = bench_with_flap();
    let record = flown_with_flap(&bench);
    let maneuver = maneuver("m", 20.0);
    let own = bench.estimate(&record, &maneuver);
    let predicted = prediction::maneuver(
        &record,
        &maneuver,
        &bench.class,
        &bench.context(),
        &own,
        &[&own],
    );
    assert_eq!(
        predicted.summary.prediction,
        Some(PredictionStatus::Predicted)
    );
}
