//! Joint estimates and predictions of maneuvers flown in moving air.

use super::*;
use crate::estimate::prediction::Predicted;
use crate::filter_error::tests::{plain_outputs, plain_step};
use crate::output_error::calibration_errors::Calibration;
use crate::tables::EstimationMethod;
use crate::units::RAD;

/// Change of the air's angle in a sample, deg: light turbulence.
const GUST_DEG: f64 = 0.06;

fn bench_in_gusts(method: Method) -> Bench {
    let mut bench = bench();
    bench.settings.method = method;
    let known = Calibration {
        bias: 0.02,
        scale_pct: 0.0,
    };
    let calibration = &mut bench.settings.calibration;
    calibration.insert(signal::AN.to_owned(), known);
    bench
}

/// Record of [`Bench::flown`] in air whose angle is a random walk.
fn flown_in_gusts(bench: &Bench, seed: u64, factor: f64) -> Record {
    let mut record = bench.flown(seed, factor, 0.0);
    let (case, values) = bench.true_case(&record);
    let own = case.starting_values(|n| values[n] * if n == "Cm_de" { factor } else { 1.0 });
    let mut noise = Noise(seed);
    let mut x = case.start;
    for k in 0..SAMPLES {
        let y = plain_outputs(&case, &own, k, &x);
        for (o, output) in bench.class.axis.outputs().into_iter().enumerate() {
            let series = record.signals.get_mut(output.signal()).unwrap();
            series.values[k] = y[o] + NOISE[o] * noise.gaussian();
        }
        x = plain_step(&case, &own, k, &x);
        x[0] += GUST_DEG * RAD * noise.gaussian();
    }
    record
}

/// Joint estimate of two maneuvers in gusts.
fn joined(bench: &Bench) -> joint::Joined {
    let records = [1, 2].map(|seed| flown_in_gusts(bench, seed, 1.0));
    let maneuvers = [maneuver("a", 20.0), maneuver("b", 20.4)];
    let members = [(&records[0], &maneuvers[0]), (&records[1], &maneuvers[1])];
    let context = bench.context();
    joint::estimate("joint/steps/20.20", &members, &[], &bench.class, &context)
}

/// Errors of the shared derivatives in their bounds, and as shares of the derivatives.
fn errors(joined: &joint::Joined) -> Vec<[f64; 2]> {
    let truth = truth(Axis::Longitudinal);
    let of = |(derivative, value): &(Derivative, f64)| {
        let names = &mut joined.estimated.estimates.iter();
        let row = names.find(|row| row.derivative == derivative.name)?;
        let error = row.value? - value;
        Some([error / row.bound_corrected?, error / value])
    };
    truth.iter().filter_map(of).collect()
}

#[test]
fn joint_estimates_in_gusts_are_by_filter_error_and_hold_the_truth() {
    let joined_by = |method| joined(&bench_in_gusts(method));
    let by_filter = joined_by(Method::FilterError);
    let fit = &by_filter.estimated.fit;
    assert_eq!(fit.outcome, Outcome::Converged, "{}", fit.reason);
    assert_eq!(fit.method, Some(EstimationMethod::FilterError));
    assert!(
        fit.gust_ft_s.unwrap() > 0.5 && fit.autocorrelation.unwrap() < 0.3,
        "{fit:?}"
    );
    // Constants are each maneuver's own.
    let found = errors(&by_filter);
    assert_eq!(found.len(), 9);
    assert!(found.iter().all(|[z, _]| z.abs() < 3.0), "{found:?}");
    for member in &by_filter.members {
        let lost = member.cost_joint.unwrap() - member.cost_alone.unwrap();
        // Nine derivatives that each maneuver alone would have better by half a square.
        assert!((-0.5..20.0).contains(&lost), "{lost}");
    }
    // Coloured residuals of output error ask for the filter.
    assert_eq!(joined_by(Method::Auto), by_filter);

    let by_output_error = joined_by(Method::OutputError);
    let fit = &by_output_error.estimated.fit;
    assert_eq!(fit.method, Some(EstimationMethod::OutputError));
    assert!(fit.autocorrelation.unwrap() > 0.5, "{fit:?}");
    let size = |joined: &joint::Joined| -> f64 {
        let errors = errors(joined);
        errors.iter().map(|[_, share]| share.abs()).sum()
    };
    assert!(size(&by_output_error) > 3.0 * size(&by_filter));
}

#[test]
fn joint_estimates_of_white_residuals_need_no_filter() {
    let mut bench = bench();
    bench.settings.method = Method::Auto;
    let records = [bench.flown(1, 1.0, 0.0), bench.flown(2, 1.0, 0.05)];
    let maneuvers = [maneuver("a", 20.0), maneuver("b", 20.4)];
    let members = [(&records[0], &maneuvers[0]), (&records[1], &maneuvers[1])];
    let context = bench.context();
    let joined = joint::estimate("joint/steps/20.20", &members, &[], &bench.class, &context);
    let fit = &joined.estimated.fit;
    assert_eq!(fit.method, Some(EstimationMethod::OutputError));
    assert!(fit.autocorrelation.unwrap() < 0.3, "{fit:?}");
}

#[test]
fn coloured_noise_of_the_sensors_is_not_taken_for_gusts() {
    let bench = bench_in_gusts(Method::FilterError);
    let flown = |seed| bench.flown_with_colour(seed, 1.0, 0.0, 0.95);
    let records = [flown(1), flown(2)];
    let maneuvers = [maneuver("a", 20.0), maneuver("b", 20.4)];
    for (record, maneuver) in records.iter().zip(&maneuvers) {
        let alone = bench.estimate(record, maneuver);
        assert_eq!(alone.fit.outcome, Outcome::Converged);
        assert_eq!(alone.fit.method, Some(EstimationMethod::OutputError));
        assert!(alone.fit.reason.contains("noise of the sensors"));
        assert!(alone.fit.autocorrelation.unwrap() > 0.8);
    }
    let members = [(&records[0], &maneuvers[0]), (&records[1], &maneuvers[1])];
    let context = bench.context();
    let joined = joint::estimate("joint/steps/20.20", &members, &[], &bench.class, &context);
    let fit = &joined.estimated.fit;
    assert_eq!(fit.method, Some(EstimationMethod::OutputError));
    let found = errors(&joined);
    assert_eq!(found.len(), 9);
    assert!(found.iter().all(|[z, _]| z.abs() < 3.0), "{found:?}");
}

/// Prediction, in gusts, of a maneuver whose `Cm_de` is `factor` times that of the others, beside its
/// own estimate.
fn predicted_in_gusts(factor: f64) -> (Estimated, Predicted) {
    let bench = bench_in_gusts(Method::FilterError);
    let estimate = |record: &Record| bench.estimate(record, &maneuver("o", 20.0));
    let others = [1, 2].map(|seed| estimate(&flown_in_gusts(&bench, seed, 1.0)));
    let record = flown_in_gusts(&bench, 3, factor);
    let own = estimate(&record);
    let predicted = prediction::maneuver(
        &record,
        &maneuver("p", 20.0),
        &bench.class,
        &bench.context(),
        &own,
        &[&others[0], &others[1]],
    );
    (own, predicted)
}

#[test]
fn a_prediction_in_gusts_compares_with_the_maneuver_s_own_fit() {
    let (own, predicted) = predicted_in_gusts(1.0);
    assert_eq!(
        predicted.summary.prediction,
        Some(PredictionStatus::Predicted)
    );
    for (own, predicted) in own.fit_outputs.iter().zip(&predicted.outputs) {
        let (own, predicted) = (own.r_squared.unwrap(), predicted.r_squared.unwrap());
        assert!((own - predicted).abs() < 0.05, "{own} {predicted}");
    }
    let (_, wrong) = predicted_in_gusts(1.3);
    let pitch_rate = |p: &Predicted| p.summary.r_squared_of[&Output::Q];
    assert!(
        1.0 - pitch_rate(&wrong) > 3.0 * (1.0 - pitch_rate(&predicted)),
        "{} {}",
        pitch_rate(&wrong),
        pitch_rate(&predicted)
    );
}
