//! Errors of calibration in the rows of a maneuver.

use super::*;
use crate::flight::{Record, RemainingError, RemainingErrors};
use crate::maneuver::Maneuver;
use crate::output_error::calibration_errors::Calibration;

fn calibrated(calibration: &[(&str, Calibration)]) -> Bench {
    let mut bench = bench();
    bench.settings.calibration = calibration
        .iter()
        .map(|(name, c)| ((*name).to_owned(), *c))
        .collect();
    bench
}

#[test]
fn the_scale_of_a_surface_is_the_least_that_its_derivatives_are_known_to() {
    let bench = calibrated(&[(
        "de_deg",
        Calibration {
            bias: 0.0,
            scale_pct: 2.0,
        },
    )]);
    let record = bench.flown(5, 1.0, 0.0);
    let (with, without) = (
        bench.estimate(&record, &maneuver("m", 20.0)),
        super::bench().estimate(&record, &maneuver("m", 20.0)),
    );
    let (with_row, without_row) = (row(&with, "Cm_de"), row(&without, "Cm_de"));
    let part = with_row.bound_calibration.unwrap();
    assert_relative_eq!(
        part,
        0.02 * with_row.value.unwrap().abs(),
        max_relative = 1e-2
    );
    assert_eq!(
        (
            with_row.value,
            with_row.bound,
            without_row.bound_calibration
        ),
        (without_row.value, without_row.bound, None)
    );
    assert_relative_eq!(
        with_row.bound_corrected.unwrap(),
        without_row.bound_corrected.unwrap().hypot(part),
        max_relative = 1e-9
    );
}

#[test]
fn an_error_that_the_flight_determines_replaces_the_stated_one() {
    let stated = Calibration {
        bias: 0.0,
        scale_pct: 0.5,
    };
    let bench = calibrated(&[(signal::QBAR, stated)]);
    let part = |scale: Option<RemainingError>| {
        let mut record = bench.flown(5, 1.0, 0.0);
        let errors = RemainingErrors { bias: None, scale };
        record.remaining_errors = [(signal::QBAR.to_owned(), errors)].into();
        let estimated = bench.estimate(&record, &maneuver("m", 20.0));
        row(&estimated, "Cm_de").bound_calibration.unwrap()
    };
    let by_calibration = part(None);
    let by_flight = part(Some(RemainingError::corrected(0.001)));
    // Of the 0.5 % and the flight's 0.1 %.
    let joined = by_calibration / 26.0_f64.sqrt();
    assert_relative_eq!(by_flight, joined, max_relative = 1e-2);
    let left = RemainingError {
        is_corrected: false,
        ..RemainingError::corrected(0.005)
    };
    let by_both = part(Some(left));
    assert_relative_eq!(
        by_both,
        by_calibration * 0.5_f64.sqrt(),
        max_relative = 1e-2
    );
}

#[test]
fn the_calibration_of_an_instrument_does_not_apply_to_an_assumed_value() {
    let part = |scale_pct: f64| {
        let stated = Calibration {
            bias: 0.0,
            scale_pct,
        };
        let bench = calibrated(&[(signal::QBAR, stated)]);
        let mut record = bench.flown(5, 1.0, 0.0);
        let series = record.signals.get_mut(signal::QBAR).unwrap();
        *series = Series::assumed(series.values.clone());
        let errors = RemainingErrors {
            bias: None,
            scale: Some(RemainingError::corrected(0.002)),
        };
        record.remaining_errors = [(signal::QBAR.to_owned(), errors)].into();
        let estimated = bench.estimate(&record, &maneuver("m", 20.0));
        row(&estimated, "Cm_de").bound_calibration.unwrap()
    };
    assert_relative_eq!(part(0.01), part(1.0), max_relative = 1e-9);
}

#[test]
fn a_bias_without_calibration_has_a_prior_where_the_flight_determines_it() {
    let mut bench = calibrated(&[]);
    bench.settings.ordinary_bias = [(Output::An, 1e-4)].into();
    let bound = |bias: Option<RemainingError>| {
        let mut record = bench.flown(5, 1.0, 0.0);
        let errors = RemainingErrors { bias, scale: None };
        record.remaining_errors = [(signal::AN.to_owned(), errors)].into();
        let estimated = bench.estimate(&record, &maneuver("m", 20.0));
        row(&estimated, "an_bias").bound.unwrap()
    };
    let corrected = |bound| Some(RemainingError::corrected(bound));
    let without = bound(None);
    assert!(without > 2e-4, "{without}");
    // The ordinary size is the prior, and the flight's own bound where it is wider.
    assert!(bound(corrected(1e-6)) < 1e-4);
    let wide = bound(corrected(without));
    assert_relative_eq!(wide, without / 2.0_f64.sqrt(), max_relative = 0.05);
}

#[test]
fn a_signal_that_the_maneuver_does_not_use_adds_nothing() {
    let bench = calibrated(&[(
        "dr_deg",
        Calibration {
            bias: 1.0,
            scale_pct: 5.0,
        },
    )]);
    let record = bench.flown(5, 1.0, 0.0);
    let estimated = bench.estimate(&record, &maneuver("m", 20.0));
    assert_eq!(row(&estimated, "Cm_de").bound_calibration, Some(0.0));
}

#[test]
fn a_thrust_that_is_not_recorded_is_in_the_bounds_where_its_size_is_stated() {
    let thrust_lbf = 5_000.0;
    let stated = Calibration {
        bias: thrust_lbf,
        scale_pct: 0.0,
    };
    let maneuver = maneuver("m", 20.0);
    let estimate = |bench: &Bench| {
        let mut record = bench.flown(5, 1.0, 0.0);
        // The other thrust is recorded: half of the true one is not.
        let half = vec![thrust_lbf; record.samples];
        let stand_in = crate::flight::record::Series::assumed(half);
        record.signals.insert(signal::THRUST.to_owned(), stand_in);
        bench.estimate(&record, &maneuver)
    };
    let with = estimate(&calibrated(&[(signal::THRUST, stated)]));
    let without = estimate(&bench());
    let truth = truth(Axis::Longitudinal);
    let off = |estimated: &Estimated, name: &str| {
        let row = row(estimated, name);
        let (_, truth) = truth.iter().find(|(d, _)| d.name == name).unwrap();
        (row.value.unwrap() - truth).abs() / row.bound_corrected.unwrap()
    };
    assert!(off(&without, "CA_0") > 4.0, "{}", off(&without, "CA_0"));
    for name in ["CN_0", "CN_alpha", "CA_0"] {
        assert!(off(&with, name) < 2.0, "{name}: {}", off(&with, name));
        let bound = |estimated| row(estimated, name).bound_corrected.unwrap();
        assert!(bound(&with) > bound(&without), "{name}");
    }
}

#[test]
fn an_error_common_to_maneuvers_does_not_average_out() {
    let mut bench = calibrated(&[(
        "de_deg",
        Calibration {
            bias: 0.0,
            scale_pct: 2.0,
        },
    )]);
    bench.settings.joint = Some(JointSettings::default());
    let records = [bench.flown(5, 1.0, 0.0), bench.flown(6, 1.0, 0.0)];
    let maneuvers = [maneuver("a", 20.0), maneuver("b", 20.0)];
    let members: Vec<(&Record, &Maneuver)> = records.iter().zip(&maneuvers).collect();
    let joined = joint::estimate("joint", &members, &[], &bench.class, &bench.context());
    let row = row(&joined.estimated, "Cm_de");
    assert_relative_eq!(
        row.bound_calibration.unwrap(),
        0.02 * row.value.unwrap().abs(),
        max_relative = 1e-2
    );
}
