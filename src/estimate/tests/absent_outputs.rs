//! Maneuvers whose flight does not record an acceleration.

use super::*;
use crate::aero::wind_tunnel::TunnelPoint;
use crate::numerics::statistics::normal::NORMAL_95;
use crate::tables::Weights;

/// A bench with a bias of `ax`, and a tunnel with the true axial force known to a tenth.
fn bench_with_axial_force(method: Method) -> Bench {
    let mut bench = bench();
    bench.settings.method = method;
    // Weights of the noise: with others an output of little use may enlarge a bound.
    bench.settings.weights = Weights::Estimated;
    bench.aero_model.biases.push(Bias {
        name: "ax_bias".into(),
        output: Output::Ax,
    });
    let statuses = &mut bench.class.statuses;
    statuses.insert("ax_bias".into(), Status::Estimated);
    for (derivative, value) in truth(Axis::Longitudinal) {
        if derivative.name.starts_with("CA") {
            let mut point = TunnelPoint::new(20.0, value);
            point.uncertainty = Some(0.1 * value.abs());
            bench.tunnel.insert(&derivative.name, point);
        }
    }
    bench
}

/// The record with stand-ins in place of some signals, as ingest fills them in.
fn without(record: &Record, signals: &[&str]) -> Record {
    let mut record = record.clone();
    for signal in signals {
        let level = if *signal == signal::AN { 1.0 } else { 0.0 };
        let stand_in = Series::assumed(vec![level; record.samples]);
        record.signals.insert((*signal).to_owned(), stand_in);
    }
    record
}

/// Derivatives of normal force and pitching moment without constants: `ax` changes them little.
fn slopes() -> impl Iterator<Item = (Derivative, f64)> {
    let is_slope = |name: &str| !name.starts_with("CA") && !name.ends_with("_0");
    let truth = truth(Axis::Longitudinal).into_iter();
    truth.filter(move |(d, _)| is_slope(&d.name))
}

/// Largest distance of an estimate from the truth, in bounds: for nine derivatives it is beyond chance.
const FARTHEST: f64 = 4.0;

/// Least bound, as a share of that with all outputs: bounds scatter by the noise that each fit finds.
const LEAST_BOUND: f64 = 0.97;

/// Asserts that the slopes are the truth within their bounds, and that no bound is smaller than with
/// all outputs. Bounds are those of white noise with the part of the held values.
fn assert_honest(lacking: &Estimated, whole: &Estimated) {
    let reason = &lacking.fit.reason;
    assert_eq!(lacking.fit.outcome, Outcome::Converged, "{reason}");
    let bound = |row: &EstimateRow| row.bound.unwrap().hypot(row.bound_held.unwrap());
    for (derivative, truth) in slopes() {
        let name = &derivative.name;
        let (own, with_all) = (row(lacking, name), row(whole, name));
        let error = (own.value.unwrap() - truth).abs();
        assert!(error < FARTHEST * own.bound_corrected.unwrap(), "{own:?}");
        assert!(
            bound(own) > LEAST_BOUND * bound(with_all),
            "{own:?} {with_all:?}"
        );
    }
}

#[test]
fn without_axial_acceleration_the_other_forces_and_moments_are_estimated_and_the_axial_held() {
    for method in [Method::OutputError, Method::FilterError] {
        let bench = bench_with_axial_force(method);
        let record = bench.flown(1, 1.0, 0.02);
        let maneuver = maneuver("m", 20.0);
        let lacking = bench.estimate(&without(&record, &[signal::AX]), &maneuver);
        // The tunnel's axial force is information too, so all outputs are compared with it held.
        let mut with_tunnel = bench_with_axial_force(method);
        for (name, status) in &mut with_tunnel.class.statuses {
            if name.starts_with("CA") {
                *status = Status::Held;
            }
        }
        assert_honest(&lacking, &with_tunnel.estimate(&record, &maneuver));

        for name in ["CA_0", "CA_alpha"] {
            let held = row(&lacking, name);
            assert_eq!((held.status, held.value), (Status::Held, held.wind_tunnel));
            assert_eq!(held.held_because.as_deref(), Some("`ax_g` is not recorded"));
        }
        assert_eq!(row(&lacking, "ax_bias").status, Status::Inactive);
        let outputs: Vec<Output> = lacking.fit_outputs.iter().map(|r| r.output).collect();
        assert_eq!(
            outputs,
            [Output::Alpha, Output::Q, Output::Theta, Output::An]
        );
        assert_eq!(lacking.history.as_ref().unwrap().outputs.len(), 4);
        assert_eq!(lacking.fit.left_out, Some(0.0));
    }
}

#[test]
fn without_normal_acceleration_alpha_determines_the_normal_force_with_larger_bounds() {
    for method in [Method::OutputError, Method::FilterError] {
        let bench = bench_with_axial_force(method);
        let record = bench.flown(1, 1.0, 0.0);
        let maneuver = maneuver("m", 20.0);
        let whole = bench.estimate(&record, &maneuver);
        let lacking = bench.estimate(&without(&record, &[signal::AN]), &maneuver);
        assert_honest(&lacking, &whole);
        let bound = |e: &Estimated| row(e, "CN_alpha").bound_corrected.unwrap();
        assert!(bound(&lacking) > 1.5 * bound(&whole), "{}", bound(&lacking));
        let normal = row(&lacking, "CN_alpha");
        assert_eq!(normal.equation_error, None);
        assert!(row(&lacking, "Cm_alpha").equation_error.is_some());
    }
}

#[test]
fn without_any_acceleration_the_pitching_moment_is_estimated() {
    let bench = bench_with_axial_force(Method::OutputError);
    let record = bench.flown(1, 1.0, 0.0);
    let maneuver = maneuver("m", 20.0);
    let whole = bench.estimate(&record, &maneuver);
    let record = without(&record, &[signal::AN, signal::AX]);
    assert_honest(&bench.estimate(&record, &maneuver), &whole);
}

#[test]
fn without_axial_acceleration_and_tunnel_the_axial_force_is_absent() {
    let mut bench = bench_with_axial_force(Method::OutputError);
    bench.tunnel = WindTunnel::default();
    for hold in [Hold::Table, Hold::Evidence] {
        bench.settings.hold = hold;
        let record = without(&bench.flown(1, 1.0, 0.0), &[signal::AX]);
        let lacking = bench.estimate(&record, &maneuver("m", 20.0));
        assert_eq!(
            lacking.fit.outcome,
            Outcome::Converged,
            "{}",
            lacking.fit.reason
        );
        let axial = row(&lacking, "CA_0");
        assert_eq!((axial.status, axial.value), (Status::Inactive, None));
    }
}

#[test]
fn a_lag_needs_the_accelerations_that_it_follows_from() {
    let mut bench = bench_with_axial_force(Method::OutputError);
    let lag = crate::aero::Regressor::parse("alpha_dot").unwrap();
    bench.aero_model.derivatives.push(Derivative {
        name: "Cm_lag".into(),
        coefficient: crate::aero::Coefficient::Cm,
        regressor: lag,
    });
    bench.tunnel.insert("Cm_lag", TunnelPoint::new(20.0, -1.0));
    let statuses = &mut bench.class.statuses;
    statuses.insert("Cm_lag".into(), Status::Held);
    let record = bench.flown(1, 1.0, 0.0);
    let maneuver = maneuver("m", 20.0);
    let status = |record: &Record| row(&bench.estimate(record, &maneuver), "Cm_lag").clone();
    assert_eq!(status(&record).status, Status::Held);
    let lacking = status(&without(&record, &[signal::AN]));
    assert_eq!(lacking.status, Status::Inactive);
    assert_eq!(
        lacking.held_because.as_deref(),
        Some("`an_g` is not recorded")
    );
}

#[test]
fn maneuvers_without_axial_acceleration_predict_each_other_and_are_joined() {
    let bench = bench_with_axial_force(Method::OutputError);
    let records = [1, 2, 3].map(|seed| without(&bench.flown(seed, 1.0, 0.0), &[signal::AX]));
    let maneuvers = ["a", "b", "c"].map(|id| maneuver(id, 20.0));
    let own: Vec<Estimated> = records
        .iter()
        .zip(&maneuvers)
        .map(|(record, maneuver)| bench.estimate(record, maneuver))
        .collect();
    let predicted = prediction::maneuver(
        &records[0],
        &maneuvers[0],
        &bench.class,
        &bench.context(),
        &own[0],
        &[&own[1], &own[2]],
    );
    assert_eq!(
        predicted.summary.prediction,
        Some(PredictionStatus::Predicted)
    );
    assert_eq!(predicted.outputs.len(), OUTPUTS - 1);
    assert!(!predicted.summary.theil_of.contains_key(&Output::Ax));

    let whole = bench.flown(4, 1.0, 0.0);
    let other = maneuver("d", 20.0);
    let joined = |members: &[(&Record, &Maneuver)]| {
        joint::estimate(
            "joint/steps/20.00",
            members,
            &[],
            &bench.class,
            &bench.context(),
        )
    };
    let alike = [(&records[0], &maneuvers[0]), (&records[1], &maneuvers[1])];
    let lacking = joined(&alike).estimated;
    assert_eq!(
        lacking.fit.outcome,
        Outcome::Converged,
        "{}",
        lacking.fit.reason
    );
    assert_eq!(row(&lacking, "CA_0").status, Status::Held);
    let elevator = row(&lacking, "Cm_de");
    let error = (elevator.value.unwrap() + 0.012).abs();
    assert!(error < 2.0 * NORMAL_95 * elevator.bound_corrected.unwrap());

    let mixed = joined(&[alike[0], alike[1], (&whole, &other)]);
    let left_out = mixed
        .members
        .iter()
        .filter(|m| m.part != Participation::Joined);
    assert_eq!(left_out.count(), 2);
    assert!(
        mixed
            .estimated
            .fit
            .reason
            .contains("a (ax_g is not recorded)"),
        "{}",
        mixed.estimated.fit.reason
    );
}
