//! Doubts about fits that converged.

use super::*;
use crate::aero::wind_tunnel::TunnelPoint;
use crate::estimate::settings::{DoubtLimits, Method};
use crate::tables::EstimationMethod;

/// Bench whose instruments have ordinary biases.
fn bench_with_instruments() -> Bench {
    let mut bench = bench();
    let outputs = Axis::Longitudinal.outputs().into_iter();
    bench.settings.ordinary_bias = outputs.zip([0.3, 0.1, 0.2, 0.01, 0.01]).collect();
    bench
}

/// As [`bench_with_instruments`], by output error: filter error would take what the bench leaves out
/// for gusts.
fn bench_in_still_air() -> Bench {
    let mut bench = bench_with_instruments();
    bench.settings.method = Method::OutputError;
    bench
}

fn estimated(bench: &Bench, record: &Record) -> Estimated {
    bench.estimate(record, &maneuver("m", 20.0))
}

/// The bench with the elevator's moment held at its opposite.
fn bench_with_opposite_elevator() -> Bench {
    let mut bench = bench_with_instruments();
    let truth = truth(bench.class.axis);
    let (_, value) = truth.iter().find(|(d, _)| d.name == "Cm_de").unwrap();
    let point = TunnelPoint::new(20.0, -value);
    bench.tunnel.insert("Cm_de", point);
    bench.class.statuses.insert("Cm_de".into(), Status::Held);
    bench
}

#[test]
fn a_fit_that_filter_error_can_only_follow_is_doubtful_unless_the_analyst_uses_it() {
    let mut bench = bench_with_opposite_elevator();
    let record = bench.flown(1, 1.0, 0.0);
    let sound = estimated(&bench_with_instruments(), &record).fit;
    assert_eq!(sound.outcome, Outcome::Converged, "{}", sound.reason);
    let doubtful = estimated(&bench, &record);
    let (fit, rows) = (&doubtful.fit, &doubtful.fit_outputs);
    assert_eq!(fit.outcome, Outcome::Doubtful, "{fit:?} {rows:?}");
    assert!(fit.reason.contains("less of q_deg_s"), "{}", fit.reason);
    assert_eq!(fit.method, Some(EstimationMethod::FilterError));
    assert!(row(&doubtful, "Cm_alpha").value.is_some());
    bench.settings.doubtful = Doubtful::Use;
    let used = estimated(&bench, &record);
    assert_eq!(used.fit.outcome, Outcome::Converged);
    assert!(used.fit.reason.contains(&fit.reason), "{}", used.fit.reason);
    assert_eq!(used.estimates, doubtful.estimates);
}

#[test]
fn a_sound_fit_explains_its_outputs_and_agrees_with_equation_error() {
    let bench = bench_in_still_air();
    let sound = estimated(&bench, &bench.flown(1, 1.0, 0.01));
    let fit = &sound.fit;
    assert_eq!(fit.outcome, Outcome::Converged, "{}", fit.reason);
    assert_eq!(sound.fit_outputs.len(), OUTPUTS);
    for row in &sound.fit_outputs {
        // The axial force hardly moves.
        assert!(
            row.r_squared.unwrap() > 0.8 || row.output == Output::Ax,
            "{row:?}"
        );
        assert!(row.theil.unwrap() < 0.1, "{row:?}");
    }
    assert!(fit.equation_error_distance.unwrap() < 1.5, "{fit:?}");
}

#[test]
fn the_distance_is_in_joint_standard_errors_of_both() {
    let bench = bench_with_instruments();
    let estimated = estimated(&bench, &bench.flown(1, 1.0, 0.0));
    let distance = estimated.fit.equation_error_distance.unwrap();
    // Correlations apart, each derivative's own difference has a size of about the distance.
    let of = |row: &EstimateRow| {
        let sum = row.bound_corrected?.powi(2) + row.equation_error_bound?.powi(2);
        Some((row.value? - row.equation_error?).powi(2) / sum)
    };
    let squares: Vec<f64> = estimated.estimates.iter().filter_map(of).collect();
    let mean = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!(
        squares.len() > 7 && (0.3..3.0).contains(&(distance / mean)),
        "{distance} {mean}"
    );
}

#[test]
fn a_bias_that_no_instrument_has_is_a_doubt_and_its_limit_is_in_ordinary_ones() {
    let mut bench = bench_in_still_air();
    let record = bench.flown(1, 1.0, 0.3);
    let fit = estimated(&bench, &record).fit;
    assert_eq!(fit.outcome, Outcome::Doubtful, "{}", fit.reason);
    assert!(fit.reason.starts_with("an_bias is 0.3"), "{}", fit.reason);
    let generous = DoubtLimits {
        ordinary_biases: 40.0,
        ..DoubtLimits::default()
    };
    bench.settings.doubt = generous;
    let fit = estimated(&bench, &record).fit;
    assert_eq!(fit.outcome, Outcome::Converged, "{}", fit.reason);
}

#[test]
fn an_initial_state_far_from_the_measured_one_is_a_doubt() {
    let bench = bench_in_still_air();
    let mut record = bench.flown(1, 1.0, 0.0);
    // The first second of the attitude is of another maneuver; it does not count in the cost.
    let theta = record.signals.get_mut(signal::THETA).unwrap();
    for k in 0..40 {
        theta.values[k] += 20.0;
        theta.marks[k] = Mark::Bridged;
    }
    let fit = estimated(&bench, &record).fit;
    assert_eq!(fit.outcome, Outcome::Doubtful, "{}", fit.reason);
    assert!(
        fit.reason.contains("initial theta differs"),
        "{}",
        fit.reason
    );
}

#[test]
fn an_output_that_a_constant_fits_better_is_a_doubt_if_it_moves() {
    let mut bench = bench_in_still_air();
    // Nothing is free that moves the axial force.
    for name in ["CA_0", "CA_alpha"] {
        bench.class.statuses.insert(name.into(), Status::Inactive);
    }
    bench.settings.doubt.contradiction = 0.0;
    bench.settings.ordinary_bias.insert(Output::Ax, 1e-4);
    let record = bench.flown(1, 1.0, 0.0);
    let unexplained = estimated(&bench, &record);
    let ax = unexplained
        .fit_outputs
        .iter()
        .find(|row| row.output == Output::Ax);
    assert!(ax.unwrap().r_squared.unwrap() < 0.0);
    let fit = unexplained.fit;
    let moves =
        fit.outcome == Outcome::Doubtful && fit.reason.contains("less of ax_g than a constant");
    assert!(moves, "{}", fit.reason);
    // An accelerometer so bad that the motion is less than its bias.
    bench.settings.ordinary_bias.insert(Output::Ax, 1.0);
    let fit = estimated(&bench, &record).fit;
    assert_eq!(fit.outcome, Outcome::Converged, "{}", fit.reason);
}

#[test]
fn a_doubtful_maneuver_enters_no_prediction_and_no_joint_estimate() {
    let bench = bench_with_instruments();
    let maneuvers = [
        maneuver("a", 20.0),
        maneuver("b", 20.4),
        maneuver("c", 20.2),
    ];
    let records = [bench.flown(1, 1.0, 0.0), bench.flown(2, 1.0, 0.0)];
    let fit = |m: &Maneuver, outcome: Outcome| FitRow {
        outcome,
        ..rejected_fit(m, String::new())
    };
    let fits = [
        fit(&maneuvers[0], Outcome::Converged),
        fit(&maneuvers[1], Outcome::Converged),
        fit(&maneuvers[2], Outcome::Doubtful),
    ];
    let sources = predicting_maneuvers(&maneuvers, &fits, &PredictionSettings::default());
    assert_eq!(sources, [Some(vec![1]), Some(vec![0]), None]);
    let joined = joint::estimate(
        "joint/steps/20.20",
        &[(&records[0], &maneuvers[0]), (&records[1], &maneuvers[1])],
        &[(&maneuvers[2], "doubtful: an_bias".to_owned())],
        &bench.class,
        &bench.context(),
    );
    assert_eq!(joined.estimated.fit.outcome, Outcome::Converged);
    assert!(
        joined
            .estimated
            .fit
            .reason
            .contains("left out: c (doubtful: an_bias)")
    );
    let parts: Vec<&Participation> = joined.members.iter().map(|m| &m.part).collect();
    let left_out = Participation::LeftOut("doubtful: an_bias".into());
    assert_eq!(
        parts,
        [&Participation::Joined, &Participation::Joined, &left_out]
    );
}
