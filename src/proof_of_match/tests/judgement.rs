//! Shares, excesses and margins of hand-made differences.

use approx::assert_relative_eq;

use super::fixture::{flown, proof, shipped, specification, truth};
use crate::flight::record::Series;
use crate::flight::{Mark, signal};
use crate::tables::{MatchVerdict, MatchedQuantity};

#[test]
fn a_reading_that_is_off_by_more_than_the_tolerance_is_outside_by_the_difference() {
    let flown = flown("PPSS", 10.0);
    let mut record = flown.record.clone();
    let sample = record.sample_at(flown.maneuver.start_s + 5.0);
    record.signals.get_mut(signal::AN).unwrap().values[sample] += 0.15;
    let matched = proof(&flown, &record, truth(&flown, "", 1.0), &specification());
    let row = matched
        .rows
        .iter()
        .find(|r| r.quantity == MatchedQuantity::NormalAcceleration);
    let row = row.unwrap();
    assert_eq!(row.verdict, MatchVerdict::Outside);
    assert!((row.largest_excess.unwrap() - 0.05).abs() < 0.01, "{row:?}");
    assert!((row.margin.unwrap() + 0.5).abs() < 0.1, "{row:?}");
    assert_relative_eq!(
        row.largest_excess_s.unwrap(),
        record.time_s(sample),
        epsilon = 1e-9
    );
    assert_relative_eq!(
        row.inside_pct,
        100.0 * (1.0 - 1.0 / row.samples as f64),
        epsilon = 1e-9
    );
    assert_eq!(matched.verdicts[0].verdict, MatchVerdict::Outside);
    assert_eq!(matched.verdicts[0].decided_by, "2.c.10 an_g");

    // With 99 % of the samples inside it passes, and a repaired sample does not count.
    let mut lenient = specification();
    lenient.inside_pct = 99.0;
    let passed = proof(&flown, &record, truth(&flown, "", 1.0), &lenient);
    assert_eq!(passed.verdicts[0].verdict, MatchVerdict::Inside);
    record.signals.get_mut(signal::AN).unwrap().marks[sample] = Mark::Despiked;
    let repaired = proof(&flown, &record, truth(&flown, "", 1.0), &specification());
    assert_eq!(repaired.verdicts[0].verdict, MatchVerdict::Inside);
}

#[test]
fn one_of_two_alternatives_suffices() {
    let flown = flown("PPSS", 10.0);
    let mut record = flown.record.clone();
    for value in &mut record.signals.get_mut(signal::THETA).unwrap().values[200..260] {
        *value += 3.0;
    }
    let matched = proof(&flown, &record, truth(&flown, "", 1.0), &specification());
    let verdict = |quantity: MatchedQuantity| {
        let row = matched.rows.iter().find(|r| r.quantity == quantity);
        row.unwrap().verdict
    };
    assert_eq!(
        verdict(MatchedQuantity::PitchAttitude),
        MatchVerdict::Outside
    );
    assert_eq!(verdict(MatchedQuantity::PitchRate), MatchVerdict::Inside);
    assert_eq!(matched.verdicts[0].verdict, MatchVerdict::Inside);
}

#[test]
fn requirements_of_two_tests_with_one_number_are_no_alternatives() {
    let flown = flown("OLAT", 20.0);
    let mut record = flown.record.clone();
    let sample = record.sample_at(flown.maneuver.start_s + 5.0);
    record.signals.get_mut(signal::R).unwrap().values[sample] += 50.0;
    let mut specification = specification();
    let [_, roll, yaw, _] = specification.tests.as_mut_slice() else {
        panic!("four tests");
    };
    yaw.test = roll.test.clone();
    let matched = proof(&flown, &record, truth(&flown, "", 1.0), &specification);
    assert_eq!(matched.verdicts[0].verdict, MatchVerdict::Outside);
    assert_eq!(matched.verdicts[0].decided_by, "2.d.2 r_deg_s");
}

#[test]
fn a_percentage_is_of_the_measured_value_and_the_larger_width_holds() {
    let tolerance = specification().tests[1].all_of[0].one_of[0];
    assert_eq!(tolerance.quantity, MatchedQuantity::RollRate);
    assert_relative_eq!(tolerance.width(-5.0), 2.0);
    assert_relative_eq!(tolerance.width(-50.0), 5.0);
}

#[test]
fn surfaces_that_rest_after_the_last_input_are_open_loop() {
    let mut flown = flown("PPSS", 20.0);
    flown.maneuver.recognised.last_input_s = Some(15.5);
    let matched = proof(
        &flown,
        &flown.record,
        truth(&flown, "", 1.0),
        &specification(),
    );
    assert_eq!(
        matched.verdicts[0].closed_loop,
        Some(1),
        "the plain law feeds back"
    );
    let mut record = flown.record.clone();
    for (name, series) in &mut record.signals {
        if shipped()
            .config
            .aero_model
            .derivatives
            .iter()
            .any(|d| d.regressor.surface() == Some(name))
        {
            let held = series.values[flown.record.sample_at(16.0)];
            let from = flown.record.sample_at(15.9);
            series.values[from..].fill(held);
        }
    }
    let matched = proof(&flown, &record, truth(&flown, "", 1.0), &specification());
    assert_eq!(matched.verdicts[0].closed_loop, Some(0));
}

#[test]
fn a_maneuver_without_a_signal_or_a_test_has_a_reason() {
    let flown = flown("PPSS", 10.0);
    let mut record = flown.record.clone();
    record.signals.remove(signal::THRUST);
    let matched = proof(&flown, &record, truth(&flown, "", 1.0), &specification());
    assert_eq!(matched.verdicts[0].verdict, MatchVerdict::NotFlown);
    assert!(
        matched.verdicts[0].reason.contains("thrust_lbf"),
        "{matched:?}"
    );
    assert!(matched.rows.is_empty() && matched.history.is_none());
    let mut record = flown.record.clone();
    for absent in [signal::AX, signal::AY] {
        let stand_in = Series::assumed(vec![0.0; record.samples]);
        record.signals.insert(absent.to_owned(), stand_in);
    }
    let matched = proof(&flown, &record, truth(&flown, "", 1.0), &specification());
    let reason = &matched.verdicts[0].reason;
    assert_eq!(reason, "its trim needs `ax_g`, which is not recorded");
    let mut other = specification();
    other.tests[0].classes = Some(vec!["OLON".to_owned()]);
    let matched = proof(&flown, &flown.record, truth(&flown, "", 1.0), &other);
    assert_eq!(matched.verdicts[0].reason, "no test judges its class");
}
