//! Segment on synthetic records: each kind of maneuver, excitation that is no maneuver, and the
//! analyst's events.

use std::collections::BTreeMap;

use approx::assert_abs_diff_eq;

use super::*;
use crate::aero::Axis;
use crate::aircraft::{Position, Sensors, Vane, VaneModel};
use crate::flight::record::Series;
use crate::flight::{Mark, signal};
use crate::maneuver::Quality;
use crate::maneuver::{Acceptance, Event, Maneuver, Pulses, Recognition, StepCount, Sweep};
use crate::numerics::statistics::random::RandomStream;
use crate::tables::EventVerdict;

const STEP_S: f64 = 0.025;

fn aircraft() -> Aircraft {
    let p = Position {
        x_ft: 31.4,
        y_ft: 0.0,
        z_ft: 7.0,
    };
    let vane = Vane {
        x_ft: 38.0,
        y_ft: 0.0,
        z_ft: 8.0,
        factor: 1.0,
    };
    Aircraft {
        name: "test".into(),
        wing_area_ft2: 400.0,
        span_ft: 37.4,
        chord_ft: 11.5,
        engine_inertia_slug_ft2: 3.0,
        thrust_line: None,
        latitude_deg: 35.0,
        sensors: Sensors {
            an: p,
            ax: p,
            ay: p,
            alpha_vane: Vane {
                factor: 1.25,
                ..vane
            },
            beta_vane: vane,
            vane_model: VaneModel::Exact,
            thrust_in_ax: true,
        },
    }
}

fn settings() -> Settings {
    serde_yaml::from_str(
        "{excitation_flag: obes, pilot_controls: [stick_pitch_in, stick_lat_in, pedal_in], \
         steps: {de_deg: 2, dsa_deg: 2, dpv_deg: 2, stick_pitch_in: 1, stick_lat_in: 1, pedal_in: 1}}",
    )
    .expect("settings")
}

/// A class from its flags and its step counts (signal, at least, at most).
fn class(
    name: &str,
    axis: Axis,
    flags: &[(&str, bool)],
    steps: &[(&str, usize, usize)],
    decay_s: f64,
) -> Class {
    let count = |s: &(&str, usize, usize)| {
        (
            s.0.to_owned(),
            StepCount {
                at_least: s.1,
                at_most: s.2,
            },
        )
    };
    Class {
        name: name.into(),
        title: String::new(),
        axis,
        recognition: Recognition {
            flags: flags.iter().map(|f| (f.0.to_owned(), f.1)).collect(),
            steps: steps.iter().map(count).collect(),
            lead_in_s: 1.0,
            decay_s,
            ..Recognition::default()
        },
        statuses: BTreeMap::new(),
        weights: BTreeMap::new(),
        overrides: Vec::new(),
    }
}

fn classes() -> Vec<Class> {
    let any = usize::MAX;
    let (obes, free) = ([("obes", true)], [("obes", false), ("tvcs", false)]);
    let vectored = [("obes", false), ("tvcs", true)];
    let pitch = [("stick_pitch_in", 6, any)];
    let yaw_roll = [("pedal_in", 3, any), ("stick_lat_in", 3, any)];
    let doublets = [("dsa_deg", 3, 8), ("de_deg", 3, 8)];
    let mut classes = vec![
        class("DOUBLETS", Axis::Longitudinal, &obes, &doublets, 1.5),
        class(
            "SERIES",
            Axis::Longitudinal,
            &obes,
            &[("de_deg", 10, 19), ("dsa_deg", 0, 2), ("dpv_deg", 0, 9)],
            1.5,
        ),
        class("3211", Axis::Longitudinal, &obes, &[("dsa_deg", 0, 2)], 4.5),
        class("PITCH", Axis::Longitudinal, &free, &pitch, 2.5),
        class("PITCH_TV", Axis::Longitudinal, &vectored, &pitch, 2.5),
        class("YAW_ROLL", Axis::Lateral, &free, &yaw_roll, 2.5),
    ];
    let pulses = Pulses {
        widths: vec![3.0, 2.0, 1.0, 1.0],
        unit_s: (0.2, 2.0),
        tolerance: 0.5,
    };
    classes[2]
        .recognition
        .pulses
        .insert("de_deg".into(), pulses);
    classes[3].recognition.moves.insert("dpv_deg".into(), false);
    classes[4].recognition.moves.insert("dpv_deg".into(), true);
    classes
}

/// A record of trimmed flight with smooth motion and chatter on every control.
fn flight(length_s: u32) -> Record {
    let samples = length_s as usize * 40 + 1;
    let mut record = Record {
        flight_id: "f1".into(),
        start_s: 0.0,
        step_s: STEP_S,
        samples,
        signals: BTreeMap::new(),
        remaining_errors: BTreeMap::new(),
    };
    let constants = [
        (signal::ALPHA_VANE, 25.0),
        (signal::BETA_VANE, 0.0),
        (signal::VELOCITY, 300.0),
        (signal::MACH, 0.3),
        (signal::ALTITUDE, 25e3),
        (signal::P, 0.0),
        (signal::Q, 0.0),
        (signal::R, 0.0),
        (signal::QBAR, 45.0),
        (signal::MASS, 1050.0),
        (signal::X_CG, 38.0),
        (signal::Y_CG, 0.0),
        (signal::Z_CG, 8.0),
        ("obes", 0.0),
        ("tvcs", 0.0),
    ];
    for (name, value) in constants {
        put(&mut record, name, |_| value);
    }
    for (name, trim) in [("de_deg", -9.0), ("dsa_deg", 0.1)] {
        put(&mut record, name, |t| {
            trim + 0.4 * (2.0 * t).sin() + 0.3 * (125.0 * t).sin()
        });
    }
    put(&mut record, "dpv_deg", |t| 0.03 * (125.0 * t).sin());
    for (name, trim) in [
        ("stick_pitch_in", 0.4),
        ("stick_lat_in", 0.0),
        ("pedal_in", 0.0),
    ] {
        put(&mut record, name, |t| {
            trim + 0.2 * (2.0 * t).sin() + 0.1 * (125.0 * t).sin()
        });
    }
    record
}

fn put(record: &mut Record, name: &str, value: impl Fn(f64) -> f64) {
    let values: Vec<f64> = (0..record.samples)
        .map(|k| value(record.time_s(k)))
        .collect();
    let marks = vec![Mark::Measured; values.len()];
    record.signals.insert(name.into(), Series { values, marks });
}

fn add(record: &mut Record, name: &str, value: impl Fn(f64) -> f64) {
    let old = record
        .values(name)
        .expect("a signal of the record")
        .to_vec();
    let start_s = record.start_s;
    put(record, name, |t| {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a sample of the record"
        )]
        let k = ((t - start_s) / STEP_S).round() as usize;
        old[k] + value(t)
    });
}

fn up(record: &mut Record, flag: &str, from_s: f64, to_s: f64) {
    add(record, flag, |t| {
        f64::from(u8::from(t >= from_s && t < to_s))
    });
}

/// Edges at given times, each crossed within 0.15 s: the level changes by the given amount.
fn edges(record: &mut Record, name: &str, edges: &[(f64, f64)]) {
    add(record, name, |t| {
        edges
            .iter()
            .map(|(at, change)| change * ((t - at) / 0.15).clamp(0.0, 1.0))
            .sum()
    });
}

fn doublet(record: &mut Record, name: &str, at_s: f64, size: f64) {
    edges(
        record,
        name,
        &[(at_s, size), (at_s + 1.0, -2.0 * size), (at_s + 2.0, size)],
    );
}

/// Alternating steps: to one side, from side to side `reversals` times, back to trim.
fn pilot_steps(
    record: &mut Record,
    name: &str,
    at_s: f64,
    size: f64,
    reversals: u32,
    half_period_s: f64,
) -> f64 {
    let mut all = vec![(at_s, size)];
    let mut sign = -1.0;
    for i in 1..=reversals {
        all.push((at_s + f64::from(i) * half_period_s, 2.0 * sign * size));
        sign = -sign;
    }
    let last_s = at_s + f64::from(reversals + 1) * half_period_s;
    all.push((last_s, sign * size));
    edges(record, name, &all);
    last_s
}

/// Ends 7 s later.
fn three_two_one_one(record: &mut Record, at_s: f64) {
    edges(
        record,
        "de_deg",
        &[
            (at_s, 6.0),
            (at_s + 3.0, -12.0),
            (at_s + 5.0, 12.0),
            (at_s + 6.0, -12.0),
            (at_s + 7.0, 6.0),
        ],
    );
}

fn found(record: &Record) -> Segmented {
    maneuvers(record, &classes(), &aircraft(), &settings())
}

fn classes_of(segmented: &Segmented) -> Vec<&str> {
    segmented
        .maneuvers
        .iter()
        .map(|m| m.class.as_str())
        .collect()
}

fn assert_window(m: &Maneuver, class: &str, start_s: f64, end_s: f64) {
    assert_eq!(m.class, class);
    assert_abs_diff_eq!(m.start_s, start_s, epsilon = 0.2);
    assert_abs_diff_eq!(m.end_s, end_s, epsilon = 0.2);
}

fn assert_only(record: &Record, class: &str, start_s: f64, end_s: f64) {
    let segmented = found(record);
    assert_eq!(
        (&segmented.problems[..], &segmented.unknown[..]),
        (&[][..], &[][..])
    );
    assert_eq!(classes_of(&segmented), [class]);
    assert_window(&segmented.maneuvers[0], class, start_s, end_s);
}

/// Surface motion from feedback in turbulence: white noise through two lags of 0.15 s, of the given
/// standard deviation.
fn turbulence(record: &mut Record, name: &str, seed: u64, deviation: f64) {
    let mut state = seed;
    let mut uniform = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let keep = (-STEP_S / 0.15).exp();
    let (mut first, mut second) = (0.0, 0.0);
    let mut noise: Vec<f64> = Vec::new();
    for _ in 0..record.samples {
        first = keep * first + (0..12).map(|_| uniform()).sum::<f64>();
        second = keep * second + first;
        noise.push(second);
    }
    let size = (noise.iter().map(|v| v * v).sum::<f64>() / noise.len() as f64).sqrt();
    let start_s = record.start_s;
    add(record, name, |t| {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a sample of the record"
        )]
        let k = ((t - start_s) / STEP_S).round() as usize;
        noise[k] * deviation / size
    });
}

#[test]
fn doublets_of_surfaces_are_found_with_their_window_and_condition() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 40.0);
    doublet(&mut r, "dsa_deg", 21.0, 5.0);
    doublet(&mut r, "de_deg", 26.0, -4.0);
    assert_only(&r, "DOUBLETS", 20.0, 29.5);
    let m = &found(&r).maneuvers[0];
    assert_eq!(
        (m.maneuver_id.as_str(), m.origin.name()),
        ("f1_t00020", "found")
    );
    assert_abs_diff_eq!(
        m.samples as f64,
        1.0 + (m.end_s - m.start_s) / STEP_S,
        epsilon = 1e-6
    );
    // The vane reads 1.25 times the angle at the c.g.
    assert_abs_diff_eq!(m.alpha_deg, 20.0, epsilon = 1e-9);
    assert_abs_diff_eq!(m.mass_slug, 1050.0, epsilon = 1e-9);
    let by = &m.recognised;
    assert_eq!(
        (by.inputs.as_str(), by.followed.as_str()),
        ("de_deg 3, dsa_deg 3", "")
    );
    assert_abs_diff_eq!(by.first_input_s.unwrap(), 21.0, epsilon = 0.1);
    assert_abs_diff_eq!(by.last_input_s.unwrap(), 28.0, epsilon = 0.1);
    assert_abs_diff_eq!(by.confidence.unwrap(), 1.0, epsilon = 1e-9);
}

#[test]
fn a_3_2_1_1_and_a_series_are_separated_by_lengths_of_pulses() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    assert_only(&r, "3211", 20.0, 32.5);
    let evidence = found(&r).maneuvers[0].recognised.evidence.clone();
    assert!(evidence.contains("pulses of 1.00 s the unit"), "{evidence}");

    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    let last_s = pilot_steps(&mut r, "de_deg", 21.0, 4.0, 10, 0.9);
    assert_only(&r, "SERIES", 20.0, last_s + 1.5);
}

/// A record of two maneuvers of the on-board system with the flag as given, segmented.
fn with_flag(flag: impl Fn(&mut Record)) -> Segmented {
    let mut r = flight(120);
    three_two_one_one(&mut r, 21.0);
    doublet(&mut r, "dsa_deg", 60.0, 5.0);
    doublet(&mut r, "de_deg", 65.0, -4.0);
    flag(&mut r);
    let segmented = found(&r);
    assert_eq!(segmented.maneuvers.len(), 2, "{segmented:?}");
    assert_window(&segmented.maneuvers[0], "3211", 20.0, 32.5);
    assert_window(&segmented.maneuvers[1], "DOUBLETS", 59.0, 68.5);
    assert_eq!(segmented.unknown, []);
    segmented
}

#[test]
fn a_flag_that_is_right_missing_late_or_stuck_changes_nothing_but_the_confidence() {
    let confidence = |s: &Segmented| s.maneuvers[0].recognised.confidence.unwrap();
    let right = with_flag(|r| {
        up(r, "obes", 20.0, 33.0);
        up(r, "obes", 59.0, 70.0);
    });
    assert_eq!(right.problems, []);
    let absent = with_flag(|r| drop(r.signals.remove("obes")));
    let empty = with_flag(|r| put(r, "obes", |_| f64::NAN));
    for missing in [&absent, &empty] {
        assert_eq!(missing.problems.len(), 1);
        assert_eq!(missing.problems[0].place, "obes");
        assert!(
            missing.problems[0]
                .reason
                .contains("recognised by their inputs alone")
        );
        assert!(confidence(missing) < confidence(&right));
    }
    let late = with_flag(|r| {
        up(r, "obes", 24.0, 37.0);
        up(r, "obes", 63.0, 74.0);
    });
    assert_eq!(late.problems, []);
    let down = with_flag(|_| {});
    assert!(
        down.problems[0].reason.contains("stuck"),
        "{:?}",
        down.problems
    );
    assert!(confidence(&down) < confidence(&absent));
    let up = with_flag(|r| put(r, "obes", |_| 1.0));
    assert_eq!(up.problems, [], "two maneuvers want it up and none down");
}

#[test]
fn a_flag_that_is_stuck_up_makes_no_maneuver_of_ordinary_flying() {
    let mut r = flight(120);
    put(&mut r, "obes", |_| 1.0);
    put(&mut r, "tvcs", |_| 1.0);
    let last_s = pilot_steps(&mut r, "stick_pitch_in", 20.0, 1.5, 8, 1.8);
    assert_only(&r, "PITCH", 19.0, last_s + 2.5);
    let evidence = &found(&r).maneuvers[0].recognised.evidence;
    assert!(
        evidence.contains("although obes is up; although tvcs is up; dpv_deg rests"),
        "{evidence}"
    );
}

#[test]
fn moving_vanes_decide_the_class_whatever_the_flag() {
    for (tvcs, moves, class) in [
        (0.0, false, "PITCH"),
        (1.0, true, "PITCH_TV"),
        (1.0, false, "PITCH"),
        (0.0, true, "PITCH_TV"),
    ] {
        let mut r = flight(60);
        put(&mut r, "tvcs", |_| tvcs);
        let last_s = pilot_steps(&mut r, "stick_pitch_in", 20.0, 1.0, 8, 1.8);
        pilot_steps(&mut r, "de_deg", 20.05, 3.0, 8, 1.8);
        if moves {
            pilot_steps(&mut r, "dpv_deg", 20.05, 4.0, 8, 1.8);
        }
        assert_only(&r, class, 19.0, last_s + 2.5);
        let followed = if moves { "de_deg, dpv_deg" } else { "de_deg" };
        assert_eq!(found(&r).maneuvers[0].recognised.followed, followed);
    }
}

#[test]
fn without_a_recorded_vane_the_flag_decides_and_without_both_nothing_does() {
    for (tvcs, class) in [(0.0, "PITCH"), (1.0, "PITCH_TV")] {
        let mut r = flight(60);
        r.signals.remove("dpv_deg");
        put(&mut r, "tvcs", |_| tvcs);
        pilot_steps(&mut r, "stick_pitch_in", 20.0, 1.0, 8, 1.8);
        assert_eq!(classes_of(&found(&r)), [class]);
        r.signals.remove("tvcs");
        let neither = found(&r);
        assert_eq!(neither.maneuvers, []);
        assert!(
            neither.unknown[0]
                .reason
                .contains("fits PITCH, PITCH_TV alike"),
            "{:?}",
            neither.unknown
        );
    }
}

#[test]
fn pedal_then_stick_is_one_maneuver_and_the_recovery_is_left_out() {
    let mut r = flight(60);
    let pedal_s = pilot_steps(&mut r, "pedal_in", 20.0, 1.5, 3, 1.5);
    let last_s = pilot_steps(&mut r, "stick_lat_in", pedal_s + 1.5, -1.5, 3, 1.5);
    edges(
        &mut r,
        "stick_lat_in",
        &[(last_s + 2.5, 1.7), (last_s + 4.0, -1.7)],
    );
    assert_only(&r, "YAW_ROLL", 19.0, last_s + 2.4);
}

#[test]
fn a_window_ends_where_the_pilot_takes_over() {
    let mut r = flight(60);
    three_two_one_one(&mut r, 21.0);
    up(&mut r, "obes", 20.0, 30.0);
    edges(&mut r, "stick_pitch_in", &[(30.0, -2.0), (31.0, 2.0)]);
    edges(&mut r, "de_deg", &[(30.1, 6.0), (31.1, -6.0)]);
    assert_only(&r, "3211", 20.0, 29.9);
}

#[test]
fn surfaces_that_follow_the_stick_and_ordinary_flying_are_no_maneuvers() {
    let mut r = flight(200);
    up(&mut r, "obes", 20.0, 24.0);
    up(&mut r, "tvcs", 30.0, 35.0);
    for at in [22.0, 50.0, 58.0, 80.0, 83.0, 86.0, 89.0, 92.0] {
        edges(&mut r, "stick_lat_in", &[(at, 1.6), (at + 2.0, -1.6)]);
        edges(
            &mut r,
            "stick_pitch_in",
            &[(at + 0.5, 2.0), (at + 1.0, -2.0)],
        );
        edges(
            &mut r,
            "de_deg",
            &[(at + 0.6, -6.0), (at + 1.1, 9.0), (at + 1.6, -3.0)],
        );
    }
    assert_eq!(found(&r), Segmented::default());
}

#[test]
fn excitation_that_fits_no_class_is_unknown_with_times_and_reason() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 30.0);
    doublet(&mut r, "de_deg", 21.0, 5.0);
    let Segmented {
        maneuvers,
        unknown,
        problems,
    } = found(&r);
    assert_eq!(maneuvers, []);
    assert_eq!(unknown.len(), 1);
    assert_abs_diff_eq!(unknown[0].start_s, 21.0, epsilon = 0.1);
    assert_abs_diff_eq!(unknown[0].end_s, 23.0, epsilon = 0.1);
    assert_eq!(
        (
            unknown[0].inputs.as_str(),
            unknown[0].nearest_class.as_str()
        ),
        ("de_deg 3", "DOUBLETS")
    );
    assert!(
        unknown[0]
            .reason
            .contains("dsa_deg steps 0 times, at least 3 wanted"),
        "{unknown:?}"
    );
    assert_eq!(problems.len(), 1);
    assert_eq!(problems[0].place, "t = 21.1 s");
    assert!(
        problems[0].reason.contains("de_deg 3"),
        "{}",
        problems[0].reason
    );
}

#[test]
fn a_maneuver_broken_off_is_unknown_and_not_of_a_shorter_class() {
    // The first pulses of each: six steps of a series are not a 3-2-1-1, two pulses of that are no
    // doublet of two surfaces.
    let mut series = flight(60);
    pilot_steps(&mut series, "de_deg", 21.0, 4.0, 4, 0.9);
    let mut pulses = flight(60);
    edges(
        &mut pulses,
        "de_deg",
        &[(21.0, 6.0), (24.0, -12.0), (26.0, 6.0)],
    );
    for (r, nearest) in [(series, "SERIES"), (pulses, "3211")] {
        let segmented = found(&r);
        assert_eq!(segmented.maneuvers, []);
        let unknown = &segmented.unknown[..];
        assert_eq!(unknown.len(), 1);
        assert!(
            unknown[0].reason.contains("broken off?") || unknown[0].nearest_class == nearest,
            "{unknown:?}"
        );
    }
    let mut pilot = flight(60);
    pilot_steps(&mut pilot, "stick_pitch_in", 20.0, 1.5, 3, 1.5);
    let segmented = found(&pilot);
    assert_eq!(segmented.maneuvers, []);
    assert!(
        segmented.unknown[0]
            .reason
            .contains("broken off? stick_pitch_in steps"),
        "{:?}",
        segmented.unknown
    );
}

#[test]
fn a_maneuver_that_fits_two_classes_names_them() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    let mut both = classes();
    both.push(Class {
        name: "TWIN".into(),
        ..both[2].clone()
    });
    let Segmented {
        maneuvers, unknown, ..
    } = maneuvers(&r, &both, &aircraft(), &settings());
    assert_eq!(maneuvers, []);
    assert!(unknown[0].reason.contains("3211, TWIN"), "{unknown:?}");
}

#[test]
fn missing_samples_do_not_cut_a_maneuver() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 24.5);
    up(&mut r, "obes", 24.8, 33.0);
    three_two_one_one(&mut r, 21.0);
    for name in ["de_deg", "obes", signal::ALPHA_VANE, signal::MACH] {
        let series = r.signals.get_mut(name).expect("a signal of the record");
        for k in (850..1300).step_by(50) {
            series.values[k] = f64::NAN;
        }
    }
    assert_only(&r, "3211", 20.0, 32.5);
}

#[test]
fn maneuvers_that_follow_each_other_within_two_seconds_are_two_whether_flags_part_them_or_not() {
    for flags in [true, false] {
        let mut r = flight(90);
        three_two_one_one(&mut r, 21.0);
        three_two_one_one(&mut r, 29.6);
        let last_s = pilot_steps(&mut r, "de_deg", 38.4, 4.0, 10, 0.9);
        doublet(&mut r, "dsa_deg", last_s + 1.8, 5.0);
        doublet(&mut r, "de_deg", last_s + 5.0, 5.0);
        if flags {
            up(&mut r, "obes", 20.0, 70.0);
        }
        let segmented = found(&r);
        assert_eq!(
            classes_of(&segmented),
            ["3211", "3211", "SERIES", "DOUBLETS"]
        );
        assert_eq!(segmented.unknown, []);
        for pair in segmented.maneuvers.windows(2) {
            assert!(
                pair[1].start_s < pair[0].end_s,
                "what is between them serves both"
            );
            let (last_s, next_s) = (
                pair[0].recognised.last_input_s.unwrap(),
                pair[1].recognised.first_input_s.unwrap(),
            );
            assert!(
                pair[0].end_s < next_s,
                "no input of the next is in the window"
            );
            assert!(
                pair[0].end_s - last_s > 0.4 * (next_s - last_s),
                "some decay is kept"
            );
            let lead_in = next_s - pair[1].start_s;
            assert!(lead_in > 0.4 * (next_s - last_s), "some lead-in is kept");
        }
    }
}

#[test]
fn pilot_steps_repeated_at_once_are_two_maneuvers() {
    let mut r = flight(90);
    let first_s = pilot_steps(&mut r, "stick_pitch_in", 20.0, 1.5, 7, 1.4);
    let second_s = pilot_steps(&mut r, "stick_pitch_in", first_s + 3.5, 1.5, 7, 1.4);
    let segmented = found(&r);
    assert_eq!(classes_of(&segmented), ["PITCH", "PITCH"]);
    assert_abs_diff_eq!(segmented.maneuvers[0].end_s, first_s + 2.5, epsilon = 0.2);
    assert_window(
        &segmented.maneuvers[1],
        "PITCH",
        first_s + 2.5,
        second_s + 2.5,
    );
}

#[test]
fn doublets_of_one_surface_after_another_are_one_maneuver_in_one_round_or_in_two() {
    for order in [
        ["dsa_deg", "dsa_deg", "de_deg", "de_deg"],
        ["dsa_deg", "de_deg", "dsa_deg", "de_deg"],
    ] {
        let mut r = flight(60);
        for (at, name) in [20.0, 23.2, 26.4, 29.6].into_iter().zip(order) {
            doublet(&mut r, name, at, 5.0);
        }
        assert_only(&r, "DOUBLETS", 19.0, 33.1);
    }
}

#[test]
fn a_flag_gap_between_two_rounds_of_doublets_parts_them_unless_the_flag_is_late() {
    for (late_s, classes) in [(0.0, &["DOUBLETS", "DOUBLETS"][..]), (3.0, &["DOUBLETS"])] {
        let mut r = flight(60);
        for (at, name) in [20.0, 23.2, 28.6, 31.8]
            .into_iter()
            .zip(["dsa_deg", "de_deg", "dsa_deg", "de_deg"])
        {
            doublet(&mut r, name, at, 5.0);
        }
        up(&mut r, "obes", 19.5 + late_s, 26.0 + late_s);
        up(&mut r, "obes", 28.0 + late_s, 34.5 + late_s);
        let segmented = found(&r);
        assert_eq!(classes_of(&segmented), classes);
        assert_eq!(segmented.unknown, []);
    }
}

#[test]
fn a_repeated_series_is_cut_at_its_decay_and_not_where_the_surface_passes_trim() {
    let mut r = flight(90);
    // A series that is held at trim in its midst, and ends away from where it began by what
    // feedback leaves of it.
    let series = |at: f64| {
        let mut all: Vec<(f64, f64)> = vec![(at, 4.0)];
        all.extend((1..=9).map(|k| (at + 0.9 * f64::from(k), if k % 2 == 1 { -8.0 } else { 8.0 })));
        all.push((at + 9.0, 6.0));
        all
    };
    edges(&mut r, "de_deg", &[series(20.0), series(33.0)].concat());
    let segmented = found(&r);
    assert_eq!(classes_of(&segmented), ["SERIES", "SERIES"]);
    assert_abs_diff_eq!(
        segmented.maneuvers[0].recognised.last_input_s.unwrap(),
        29.0,
        epsilon = 0.2
    );
    assert_abs_diff_eq!(
        segmented.maneuvers[1].recognised.first_input_s.unwrap(),
        33.0,
        epsilon = 0.2
    );
}

#[test]
fn pilot_maneuvers_without_a_pause_are_cut_where_the_control_is_at_trim() {
    let mut r = flight(90);
    let first_s = pilot_steps(&mut r, "stick_pitch_in", 20.0, 1.5, 7, 1.4);
    let second_s = pilot_steps(&mut r, "stick_pitch_in", first_s + 1.0, 1.5, 7, 1.4);
    let mut classes = classes();
    for class in &mut classes {
        for count in class.recognition.steps.values_mut() {
            count.at_most = count.at_most.min(12);
        }
    }
    let segmented = maneuvers(&r, &classes, &aircraft(), &settings());
    assert_eq!(classes_of(&segmented), ["PITCH", "PITCH"]);
    assert_abs_diff_eq!(
        segmented.maneuvers[0].recognised.last_input_s.unwrap(),
        first_s,
        epsilon = 0.1
    );
    assert_abs_diff_eq!(
        segmented.maneuvers[1].recognised.first_input_s.unwrap(),
        first_s + 1.0,
        epsilon = 0.1
    );
    assert_abs_diff_eq!(segmented.maneuvers[1].end_s, second_s + 2.5, epsilon = 0.2);
}

#[test]
fn a_pause_too_short_for_decay_and_lead_in_goes_mostly_to_the_lead_in() {
    let mut r = flight(60);
    three_two_one_one(&mut r, 21.0);
    three_two_one_one(&mut r, 29.0);
    let segmented = found(&r);
    assert_eq!(classes_of(&segmented), ["3211", "3211"]);
    // The first one's last input is at 28 s.
    assert_abs_diff_eq!(segmented.maneuvers[1].start_s, 28.25, epsilon = 0.1);
    assert_abs_diff_eq!(segmented.maneuvers[0].end_s, 28.44, epsilon = 0.1);
}

#[test]
fn the_pilot_may_rest_when_he_goes_over_from_one_control_to_another_but_not_to_the_same() {
    let mut r = flight(60);
    let pedal_s = pilot_steps(&mut r, "pedal_in", 20.0, 1.5, 3, 1.2);
    let last_s = pilot_steps(&mut r, "stick_lat_in", pedal_s + 2.6, -1.5, 3, 1.2);
    assert_only(&r, "YAW_ROLL", 19.0, last_s + 2.5);
    // Steps that are broken off, and steps of the recovery: together as many as a maneuver has.
    let mut r = flight(60);
    let broken_off_s = pilot_steps(&mut r, "stick_pitch_in", 20.0, 1.5, 3, 1.2);
    pilot_steps(&mut r, "stick_pitch_in", broken_off_s + 2.6, 1.5, 1, 1.2);
    assert_eq!(found(&r).maneuvers, []);
}

#[test]
fn the_flag_separates_the_system_s_first_input_from_feedback_to_the_pilot_s_last() {
    let mut r = flight(60);
    let last_s = pilot_steps(&mut r, "stick_pitch_in", 10.0, 1.5, 7, 1.2);
    three_two_one_one(&mut r, last_s + 0.8);
    up(&mut r, "obes", last_s + 0.6, last_s + 8.5);
    let segmented = found(&r);
    assert_eq!(classes_of(&segmented), ["PITCH", "3211"]);
    assert_abs_diff_eq!(
        segmented.maneuvers[1].recognised.first_input_s.unwrap(),
        last_s + 0.8,
        epsilon = 0.1
    );
    assert_eq!(segmented.unknown, []);
}

#[test]
fn a_maneuver_against_a_turn_has_the_same_window() {
    let mut r = flight(60);
    for (name, size) in [
        ("de_deg", 3.0),
        ("dsa_deg", 2.0),
        ("stick_pitch_in", 1.0),
        ("stick_lat_in", 1.5),
    ] {
        add(&mut r, name, |t| {
            size * (std::f64::consts::TAU * t / 30.0).sin()
        });
    }
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    assert_only(&r, "3211", 20.0, 32.5);
    let last_s = pilot_steps(&mut r, "stick_pitch_in", 42.0, 1.5, 7, 1.2);
    let segmented = found(&r);
    assert_eq!(classes_of(&segmented), ["3211", "PITCH"]);
    assert_abs_diff_eq!(segmented.maneuvers[1].end_s, last_s + 2.5, epsilon = 0.2);
}

#[test]
fn steps_back_to_a_trim_that_drifted_in_a_turn_belong_to_the_maneuver() {
    let mut r = flight(60);
    // Half an inch in the time between two reversals.
    add(&mut r, "stick_pitch_in", |t| {
        0.15 * (t - 20.0).clamp(0.0, 15.0)
    });
    let last_s = pilot_steps(&mut r, "stick_pitch_in", 20.0, 1.5, 7, 1.5);
    let segmented = found(&r);
    assert_eq!(classes_of(&segmented), ["PITCH"]);
    assert_window(&segmented.maneuvers[0], "PITCH", 19.0, last_s + 2.5);
}

#[test]
fn a_doublet_that_may_go_with_a_series_belongs_to_it() {
    let mut r = flight(60);
    let last_s = pilot_steps(&mut r, "de_deg", 20.0, 5.0, 10, 0.8);
    assert_only(&r, "SERIES", 19.0, last_s + 1.5);
    doublet(&mut r, "dpv_deg", last_s + 1.2, 5.0);
    assert_only(&r, "SERIES", 19.0, last_s + 3.2 + 1.5);
}

#[test]
fn turbulence_makes_no_maneuver_and_hides_none() {
    for seed in 1..=6 {
        let mut r = flight(300);
        for (k, name) in ["de_deg", "dsa_deg", "dpv_deg"].into_iter().enumerate() {
            turbulence(&mut r, name, 10 * seed + k as u64, 0.9);
        }
        assert_eq!(found(&r), Segmented::default(), "seed {seed}");
        three_two_one_one(&mut r, 21.0);
        doublet(&mut r, "dsa_deg", 60.0, 6.0);
        doublet(&mut r, "de_deg", 65.0, -6.0);
        up(&mut r, "obes", 20.0, 33.0);
        up(&mut r, "obes", 59.0, 70.0);
        let segmented = found(&r);
        assert_eq!(
            classes_of(&segmented),
            ["3211", "DOUBLETS"],
            "seed {seed}: {:?}",
            segmented.unknown
        );
        assert_window(&segmented.maneuvers[0], "3211", 20.0, 32.5);
        assert_window(&segmented.maneuvers[1], "DOUBLETS", 59.0, 68.5);
    }
}

#[test]
fn a_maneuver_that_the_record_cuts_is_unknown() {
    let mut r = flight(27);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    let Segmented {
        maneuvers, unknown, ..
    } = found(&r);
    assert_eq!(maneuvers, []);
    assert!(
        unknown[0].reason.contains("cut by the end of the record"),
        "{unknown:?}"
    );
}

#[test]
fn a_missing_signal_is_a_problem_and_the_rest_is_segmented() {
    let mut r = flight(60);
    pilot_steps(&mut r, "stick_pitch_in", 20.0, 1.5, 8, 1.5);
    r.signals.remove("dsa_deg");
    let Segmented {
        maneuvers,
        problems,
        ..
    } = found(&r);
    assert_eq!(maneuvers.len(), 1);
    assert_eq!(
        problems
            .iter()
            .map(|p| p.place.as_str())
            .collect::<Vec<_>>(),
        ["dsa_deg"]
    );
    assert!(!problems[0].stage.is_rejection());
}

#[test]
fn the_row_of_a_missing_control_names_the_surfaces_that_stand_for_it() {
    let mut r = flight(60);
    three_two_one_one(&mut r, 21.0);
    r.signals.remove("stick_pitch_in");
    let mut classes = classes();
    for class in &mut classes {
        class.recognition.surfaces = vec!["de_deg".to_owned()];
    }
    let segmented = maneuvers(&r, &classes, &aircraft(), &settings());
    let [row] = &segmented.problems[..] else {
        panic!("{:?}", segmented.problems)
    };
    assert!(
        row.reason.starts_with(
            "the record has no such signal; steps of the surfaces stand for its steps"
        ),
        "{row:?}"
    );
    assert!(!row.reason.contains("cannot be recognised"), "{row:?}");
}

#[test]
fn without_pilot_controls_steps_of_surfaces_stand_for_them_with_less_confidence() {
    let mut r = flight(60);
    three_two_one_one(&mut r, 21.0);
    let confidence = |r: &Record| {
        let segmented = found(r);
        assert_eq!(classes_of(&segmented), ["3211"]);
        segmented.maneuvers[0].recognised.confidence.unwrap()
    };
    let with_controls = confidence(&r);
    for name in ["stick_pitch_in", "stick_lat_in", "pedal_in"] {
        r.signals.remove(name);
    }
    let without = confidence(&r);
    assert_abs_diff_eq!(without, 0.9 * with_controls, epsilon = 1e-12);
    let evidence = &found(&r).maneuvers[0].recognised.evidence;
    assert!(evidence.contains("stand for the pilot's"), "{evidence}");
}

#[test]
fn a_control_of_noise_is_left_out_by_name_and_costs_no_maneuver() {
    let mut quiet = flight(60);
    three_two_one_one(&mut quiet, 21.0);
    for (deviation, is_left_out) in [(0.15, false), (1.0, true)] {
        let mut r = quiet.clone();
        let mut random = RandomStream::new(3, "stick");
        let noise: Vec<f64> = (0..r.samples)
            .map(|_| deviation * random.normal())
            .collect();
        let stick = &mut r.signals.get_mut("stick_lat_in").unwrap().values;
        stick.iter_mut().zip(noise).for_each(|(v, e)| *v += e);
        let segmented = found(&r);
        assert_eq!(classes_of(&segmented), ["3211"], "{deviation}");
        let places: Vec<&str> = segmented
            .problems
            .iter()
            .map(|p| p.place.as_str())
            .collect();
        let expected = if is_left_out {
            &["stick_lat_in"][..]
        } else {
            &[]
        };
        assert_eq!(places, expected, "{:?}", segmented.problems);
        if is_left_out {
            let reason = &segmented.problems[0].reason;
            assert!(reason.contains("left out"), "{reason}");
        }
    }
}

#[test]
fn a_class_that_the_pilot_flies_is_found_by_its_surfaces_where_no_stick_is_recorded() {
    let mut r = flight(60);
    pilot_steps(&mut r, "de_deg", 20.0, 4.0, 7, 1.4);
    let mut own = classes();
    own.retain(|class| class.name == "PITCH");
    own[0].recognition.surfaces = vec!["de_deg".to_owned()];
    let find = |r: &Record| maneuvers(r, &own, &aircraft(), &settings());
    assert_eq!(find(&r).maneuvers, []);
    for name in ["stick_pitch_in", "stick_lat_in", "pedal_in"] {
        r.signals.remove(name);
    }
    assert_eq!(classes_of(&find(&r)), ["PITCH"]);
}

#[test]
fn a_recording_that_is_the_maneuver_is_found_without_quiet_flight() {
    // The record begins as the inputs do, and the pulses go on to its end.
    let mut r = flight(12);
    three_two_one_one(&mut r, 0.5);
    let segmented = found(&r);
    assert_eq!(classes_of(&segmented), ["3211"]);
    let found = &segmented.maneuvers[0];
    assert_abs_diff_eq!(found.start_s, 0.0, epsilon = 0.1);
    assert_abs_diff_eq!(found.end_s, 12.0, epsilon = 0.1);
}

#[test]
fn a_recording_in_which_nothing_is_recognised_says_so() {
    let mut single = flight(20);
    edges(&mut single, "de_deg", &[(8.0, 3.0), (9.0, -3.0)]);
    let segmented = found(&single);
    assert_eq!(segmented.unknown.len(), 1, "{:?}", segmented.unknown);
    assert_eq!(segmented.unknown[0].inputs, "de_deg 2");
    let segmented = found(&flight(20));
    let reason = &segmented.unknown[0].reason;
    assert!(
        reason.contains("de_deg 0.") && reason.contains(" of 2"),
        "{reason}"
    );
    // In a longer flight ordinary flying is not reported.
    assert_eq!(found(&flight(60)).unknown, []);
}

#[test]
fn a_signal_that_no_class_moves_is_unknown() {
    let mut r = flight(60);
    doublet(&mut r, "dsa_deg", 20.0, 5.0);
    let mut pilots = classes();
    pilots.retain(|class| class.name == "PITCH");
    let segmented = maneuvers(&r, &pilots, &aircraft(), &settings());
    assert_eq!(segmented.unknown.len(), 1);
    assert_eq!(segmented.unknown[0].inputs, "dsa_deg 3");
}

#[test]
fn an_event_that_touches_the_ends_is_taken_and_explains_what_was_unknown() {
    let mut r = flight(20);
    edges(&mut r, "de_deg", &[(8.0, 3.0), (9.0, -3.0)]);
    let event = |start_s, end_s| Event {
        flight_id: "f1".into(),
        class: "3211".into(),
        start_s,
        end_s,
    };
    let taken = |event: Event| {
        let limits = settings().quality;
        with_events(found(&r), &r, &[event], &classes(), &aircraft(), &limits).0
    };
    let whole = taken(event(-0.05, 20.1));
    assert_eq!(
        (whole.unknown.len(), whole.problems.len()),
        (0, 0),
        "{whole:?}"
    );
    assert_abs_diff_eq!(whole.maneuvers[0].start_s, 0.0);
    assert_abs_diff_eq!(whole.maneuvers[0].end_s, 20.0);
    let rounded = taken(event(-0.5, 20.5));
    assert_eq!(rounded.maneuvers, whole.maneuvers);
    assert_eq!(taken(event(-3.0, 20.0)).maneuvers, []);
    assert_eq!(taken(event(20.5, 20.9)).maneuvers, []);
}

#[test]
fn a_maneuver_of_an_axis_whose_state_is_not_recorded_is_rejected_and_named() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    let verdict = |r: &Record| found(r).maneuvers[0].quality.clone();
    assert_eq!(verdict(&r).verdict, Acceptance::Accepted);
    let assume = |r: &mut Record, name: &str| {
        let samples = r.samples;
        r.signals
            .insert(name.into(), Series::assumed(vec![0.0; samples]));
    };
    // Of the other axis.
    assume(&mut r, signal::PHI);
    assert_eq!(verdict(&r).verdict, Acceptance::Accepted);
    // Accelerations only leave the likelihood.
    assume(&mut r, signal::AX);
    assume(&mut r, signal::AN);
    assert_eq!(verdict(&r).verdict, Acceptance::Accepted);
    assume(&mut r, signal::THETA);
    let rejected = verdict(&r);
    assert_eq!(rejected.verdict, Acceptance::Rejected);
    assert!(rejected.reason.contains("theta_deg is not recorded"));
}

/// A flight in which the pilot steps pedals and lateral stick for longer than the pitch stick, at the
/// same time.
fn flown_in_both_axes() -> Record {
    let mut r = flight(90);
    let last_s = pilot_steps(&mut r, "pedal_in", 20.0, 2.0, 3, 1.5);
    pilot_steps(&mut r, "stick_lat_in", last_s + 0.5, 2.0, 6, 1.5);
    pilot_steps(&mut r, "stick_pitch_in", 26.0, 2.0, 5, 1.0);
    r
}

#[test]
fn a_candidate_that_is_rejected_displaces_none_and_is_unknown_with_its_reason() {
    let mut r = flown_in_both_axes();
    let samples = r.samples;
    let stand_in = Series::assumed(vec![0.0; samples]);
    r.signals.insert(signal::PHI.into(), stand_in);
    let segmented = found(&r);
    assert_eq!(classes_of(&segmented), ["PITCH"], "{segmented:?}");
    let quality = &segmented.maneuvers[0].quality;
    assert_eq!(quality.verdict, Acceptance::Accepted);
    assert_eq!(segmented.unknown.len(), 1, "{segmented:?}");
    let row = &segmented.unknown[0];
    assert_eq!(row.nearest_class, "YAW_ROLL");
    assert!(row.reason.contains("overlap those of the PITCH"), "{row:?}");
    assert!(row.reason.contains("phi_deg is not recorded"), "{row:?}");
    assert!(row.inputs.contains("pedal_in 5"), "{row:?}");
    assert_eq!(segmented.problems.len(), 1, "{segmented:?}");
}

#[test]
fn a_candidate_of_the_other_axis_that_a_maneuver_displaces_is_unknown() {
    let segmented = found(&flown_in_both_axes());
    assert_eq!(classes_of(&segmented), ["YAW_ROLL"], "{segmented:?}");
    assert_eq!(segmented.unknown.len(), 1, "{segmented:?}");
    let row = &segmented.unknown[0];
    assert_eq!(row.nearest_class, "PITCH");
    assert!(
        row.reason.contains("overlap those of the YAW_ROLL"),
        "{row:?}"
    );
}

/// A sine whose frequency rises evenly, its size as given, from one time to another.
fn sweep(
    record: &mut Record,
    name: &str,
    (from_s, to_s): (f64, f64),
    (from_hz, to_hz): (f64, f64),
    size: f64,
) {
    add(record, name, |t| {
        let (s, length_s) = (t - from_s, to_s - from_s);
        let turns = from_hz * s + 0.5 * (to_hz - from_hz) * s * s / length_s;
        if (0.0..=length_s).contains(&s) {
            size * (std::f64::consts::TAU * turns).sin()
        } else {
            0.0
        }
    });
}

#[test]
fn a_sweep_is_recognised_by_its_rising_frequency() {
    let mut swept = class(
        "SWEEP",
        Axis::Longitudinal,
        &[("obes", true)],
        &[("dsa_deg", 0, 2)],
        2.0,
    );
    swept.recognition.sweep.insert(
        "de_deg".into(),
        Sweep {
            at_least: 10,
            ratio: 2.0,
        },
    );
    let with_sweep: Vec<Class> = classes().into_iter().chain([swept]).collect();
    let find = |r: &Record| maneuvers(r, &with_sweep, &aircraft(), &settings());
    let mut rising = flight(90);
    sweep(&mut rising, "de_deg", (20.0, 50.0), (0.15, 1.65), 4.0);
    let segmented = find(&rising);
    assert_eq!(
        (classes_of(&segmented), &segmented.unknown[..]),
        (vec!["SWEEP"], &[][..])
    );
    assert_abs_diff_eq!(segmented.maneuvers[0].start_s, 19.0, epsilon = 0.5);
    assert_abs_diff_eq!(segmented.maneuvers[0].end_s, 52.0, epsilon = 0.5);
    let evidence = &segmented.maneuvers[0].recognised.evidence;
    assert!(evidence.contains("times as fast"), "{evidence}");

    let mut even = flight(90);
    sweep(&mut even, "de_deg", (20.0, 50.0), (0.9, 0.9), 4.0);
    assert_ne!(classes_of(&find(&even)), ["SWEEP"]);
    let mut others = flight(90);
    three_two_one_one(&mut others, 21.0);
    pilot_steps(&mut others, "de_deg", 51.0, 4.0, 10, 0.9);
    assert_eq!(classes_of(&find(&others)), ["3211", "SERIES"]);
}

/// A maneuver whose pitch rate answers the stabilator, in a record that can be spoiled; its
/// quality.
fn quality(spoil: impl Fn(&mut Record)) -> Quality {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    let answer = |t: f64| {
        if (21.0..32.0).contains(&t) {
            5.0 * (1.2 * (t - 21.0)).sin()
        } else {
            0.0
        }
    };
    put(&mut r, signal::Q, |t| answer(t) + 0.05 * (125.0 * t).sin());
    spoil(&mut r);
    let segmented = found(&r);
    assert_eq!(classes_of(&segmented), ["3211"]);
    segmented.maneuvers[0].quality.clone()
}

#[test]
fn a_sound_maneuver_is_accepted() {
    let sound = quality(|_| {});
    assert_eq!(
        (sound.verdict.name(), sound.reason.as_str()),
        ("accepted", "")
    );
    assert!(sound.signal_to_noise.is_some_and(|v| v > 20.0), "{sound:?}");
    assert!(sound.lead_in_motion.is_some_and(|v| v < 0.1), "{sound:?}");
    assert_eq!(
        (sound.other_axis, sound.marked_share),
        (Some(0.0), Some(0.0))
    );
}

fn is_rejected(spoil: impl Fn(&mut Record), because: &str) {
    let spoiled = quality(spoil);
    assert_eq!(spoiled.verdict, Acceptance::Rejected, "{spoiled:?}");
    assert!(
        spoiled.reason.contains(because) && !spoiled.reason.contains(';'),
        "{spoiled:?}"
    );
}

#[test]
fn each_limit_rejects_with_its_own_reason() {
    is_rejected(
        |r| {
            add(r, signal::Q, |t| {
                if (19.5..20.9).contains(&t) {
                    8.0 * (5.0 * t).sin()
                } else {
                    0.0
                }
            });
        },
        "not trimmed at the start",
    );
    is_rejected(
        |r| add(r, signal::ALPHA_VANE, |t| 8.0 * (0.8 * t).sin()),
        "α strays by",
    );
    is_rejected(
        |r| {
            add(r, signal::P, |t| 20.0 * (1.1 * t).sin());
            add(r, signal::R, |t| 15.0 * (1.1 * t).sin());
        },
        "the motion of the other axis makes",
    );
    is_rejected(
        |r| add(r, signal::Q, |t| 1.0 * (125.0 * t).sin()),
        "times its noise",
    );
    is_rejected(
        |r| {
            for name in ["de_deg", signal::Q, signal::AN, signal::ALPHA_VANE] {
                if let Some(series) = r.signals.get_mut(name) {
                    series.marks[900..1200].fill(Mark::Bridged);
                }
            }
        },
        "of its samples are marked",
    );
}

#[test]
fn samples_between_those_of_a_slow_channel_are_no_fault() {
    let slow = quality(|r| {
        for name in ["de_deg", signal::Q, signal::AN, signal::ALPHA_VANE] {
            if let Some(series) = r.signals.get_mut(name) {
                series
                    .marks
                    .iter_mut()
                    .step_by(2)
                    .for_each(|mark| *mark = Mark::Between);
            }
        }
    });
    assert_eq!(
        (slow.verdict.name(), slow.marked_share),
        ("accepted", Some(0.0)),
        "{slow:?}"
    );
}

#[test]
fn a_turn_and_a_roll_in_gusts_do_not_reject() {
    let turning = quality(|r| add(r, signal::R, |t| 3.0 + 0.1 * t));
    assert_eq!(turning.verdict, Acceptance::Accepted, "{turning:?}");
    let rolling = quality(|r| {
        add(r, signal::P, |t| 9.0 * (1.1 * t).sin());
        add(r, signal::R, |t| 0.9 * (1.1 * t).sin());
    });
    assert_eq!(rolling.verdict, Acceptance::Accepted, "{rolling:?}");
}

#[test]
fn the_other_axis_is_measured_by_the_accelerations_it_makes() {
    let (p, r, q, rate) = (12.0, 8.0, 5.0, 1.2);
    let measured = quality(|record| {
        put(record, signal::Q, |t| q * (rate * t).sin());
        put(record, signal::P, |t| p * (rate * t).sin());
        put(record, signal::R, |t| r * (rate * t).cos());
    });
    // The products p r = 48 sin 2ωt and the accelerations 6 cos ωt, in deg/s², have their root mean squares
    // over two and a half periods, but for some percent.
    let expected = 0.5 * p * r / crate::units::DEG / (q * rate);
    let share = measured.other_axis.expect("rates are recorded");
    assert!((share / expected - 1.0).abs() < 0.1, "{share} {expected}");
}

#[test]
fn a_surface_at_its_stop_or_its_full_rate_is_measured_and_rejected_beyond_the_limit() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    let mut limited = settings();
    let of = |lower_deg, rate_deg_s| Actuator {
        lower_deg,
        upper_deg: 40.0,
        rate_deg_s,
    };
    limited
        .quality
        .actuators
        .insert("de_deg".into(), of(-14.4, 1000.0));
    let measured = |limited: &Settings| {
        let segmented = maneuvers(&r, &classes(), &aircraft(), limited);
        segmented.maneuvers[0].quality.clone()
    };
    // Three of seven seconds to the lower side.
    let at_stop = measured(&limited);
    assert!(
        at_stop
            .saturated_share
            .is_some_and(|v| (0.2..0.5).contains(&v)),
        "{at_stop:?}"
    );
    assert_eq!(
        (at_stop.rate_limited_share, at_stop.verdict.name()),
        (Some(0.0), "accepted")
    );
    limited.quality.saturated_share = 0.1;
    assert!(measured(&limited).reason.contains("rests at its stop"));
    limited.quality = QualityLimits::default();
    limited
        .quality
        .actuators
        .insert("de_deg".into(), of(-40.0, 40.0));
    let fast = measured(&limited);
    assert!(
        fast.rate_limited_share.is_some_and(|v| v > 0.02),
        "{fast:?}"
    );
    limited.quality.rate_limited_share = 0.01;
    assert!(measured(&limited).reason.contains("full rate"));
}

#[test]
fn a_given_maneuver_is_measured_and_never_rejected() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    put(&mut r, signal::Q, |t| (t - 20.0).sin());
    put(&mut r, signal::P, |t| 20.0 * (1.1 * t).sin());
    put(&mut r, signal::R, |t| 15.0 * (1.1 * t).sin());
    assert!(found(&r).maneuvers[0].is_rejected());
    let events = [event("3211", 20.0, 32.0)];
    let (given, rows) = with_events(
        found(&r),
        &r,
        &events,
        &classes(),
        &aircraft(),
        &settings().quality,
    );
    assert_eq!(rows[0].verdict, EventVerdict::Agrees);
    let quality = &given.maneuvers[0].quality;
    assert_eq!(quality.verdict, Acceptance::Accepted);
    assert!(
        quality.reason.contains("the motion of the other axis"),
        "{quality:?}"
    );
}

fn event(class: &str, start_s: f64, end_s: f64) -> Event {
    Event {
        flight_id: "f1".into(),
        class: class.into(),
        start_s,
        end_s,
    }
}

#[test]
fn events_replace_what_overlaps_and_are_compared_with_it() {
    let mut r = flight(120);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    up(&mut r, "obes", 50.0, 63.0);
    three_two_one_one(&mut r, 51.0);
    up(&mut r, "obes", 90.0, 103.0);
    three_two_one_one(&mut r, 91.0);
    let other_flight = Event {
        flight_id: "f2".into(),
        ..event("3211", 1.0, 2.0)
    };
    let events = [
        event("3211", 20.2, 33.0),
        event("SERIES", 48.0, 64.0),
        event("PITCH", 70.0, 80.0),
        other_flight,
    ];
    let (segmented, rows) = with_events(
        found(&r),
        &r,
        &events,
        &classes(),
        &aircraft(),
        &settings().quality,
    );
    assert_eq!(segmented.problems, []);
    let origins: Vec<(&str, &str)> = segmented
        .maneuvers
        .iter()
        .map(|m| (m.class.as_str(), m.origin.name()))
        .collect();
    assert_eq!(
        origins,
        [
            ("3211", "given"),
            ("SERIES", "given"),
            ("PITCH", "given"),
            ("3211", "found")
        ]
    );
    assert_abs_diff_eq!(segmented.maneuvers[0].start_s, 20.2, epsilon = 1e-9);
    let verdicts: Vec<&str> = rows.iter().map(|r| r.verdict.name()).collect();
    assert_eq!(
        verdicts,
        ["agrees", "other class", "not found", "not given"]
    );
}

#[test]
fn events_of_unknown_class_or_outside_the_record_become_problems() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    let events = [
        event("PICH", 20.0, 34.0),
        event("3211", 50.0, 70.0),
        event("3211", 30.0, 25.0),
    ];
    let (segmented, rows) = with_events(
        found(&r),
        &r,
        &events,
        &classes(),
        &aircraft(),
        &settings().quality,
    );
    assert_eq!(segmented.problems.len(), 3);
    assert!(
        segmented.problems[0]
            .reason
            .contains("did you mean `PITCH`?"),
        "{}",
        segmented.problems[0].reason
    );
    assert_eq!(segmented.maneuvers.len(), 1);
    assert_eq!(
        rows.iter().map(|r| r.verdict.name()).collect::<Vec<_>>(),
        ["not given"]
    );
}

#[test]
fn samples_of_one_axis_count_once() {
    let r = flight(120);
    let events = [
        event("PITCH", 40.0, 50.0),
        event("PITCH", 20.0, 30.0),
        event("PITCH", 20.0, 30.0),
        event("PITCH", 29.5, 39.5),
        event("3211", 45.0, 60.0),
        event("PITCH", 50.0, 60.0),
    ];
    let (segmented, rows) = with_events(
        Segmented::default(),
        &r,
        &events,
        &classes(),
        &aircraft(),
        &settings().quality,
    );
    let starts: Vec<f64> = segmented.maneuvers.iter().map(|m| m.start_s).collect();
    assert_eq!(starts, [20.0, 40.0, 50.0]);
    assert_eq!(rows.len(), 3);
    let samples: usize = segmented.maneuvers.iter().map(|m| m.samples).sum();
    // Neighbours share the sample at which one ends and the other begins.
    assert_eq!(samples, 3 * 400 + 3);
    let reasons: Vec<&str> = segmented.problems.iter().map(|p| &p.reason[..]).collect();
    assert_eq!(reasons.len(), 3);
    assert_eq!(
        reasons[0],
        "the event PITCH from 20.0 to 30.0 s has samples of the event PITCH from 20.0 to 30.0 s, and samples count \
         once; it is left out"
    );
}

#[test]
fn an_event_replaces_a_maneuver_of_which_it_has_an_input_and_may_share_its_decay() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    let origins = |start_s: f64| {
        let (segmented, _) = with_events(
            found(&r),
            &r,
            &[event("PITCH", start_s, 45.0)],
            &classes(),
            &aircraft(),
            &settings().quality,
        );
        let maneuvers = segmented.maneuvers.iter();
        maneuvers.map(|m| m.origin.name()).collect::<Vec<_>>()
    };
    // The last input is at 28 s.
    assert_eq!(origins(27.5), ["given"]);
    assert_eq!(origins(28.5), ["found", "given"]);
}

#[test]
fn without_events_nothing_is_compared() {
    let r = flight(60);
    assert_eq!(
        with_events(
            found(&r),
            &r,
            &[],
            &classes(),
            &aircraft(),
            &settings().quality
        ),
        (Segmented::default(), Vec::new())
    );
}
