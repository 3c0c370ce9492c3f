//! Segment on synthetic records: each kind of maneuver, what is none, and the analyst's events.

use approx::assert_abs_diff_eq;

use super::*;
use crate::aero::Axis;
use crate::aircraft::{Position, Sensors, Vane, VaneModel};
use crate::flight::record::Series;
use crate::flight::{Mark, signal};
use crate::maneuver::{Event, Recognition, StepCount};

const STEP_S: f64 = 0.025;

fn aircraft() -> Aircraft {
    let p = Position { x_ft: 31.4, y_ft: 0.0, z_ft: 7.0 };
    let vane = Vane { x_ft: 38.0, y_ft: 0.0, z_ft: 8.0, factor: 1.0 };
    Aircraft {
        name: "test".into(),
        wing_area_ft2: 400.0,
        span_ft: 37.4,
        chord_ft: 11.5,
        engine_inertia_slug_ft2: 3.0,
        latitude_deg: 35.0,
        sensors: Sensors {
            an: p,
            ax: p,
            ay: p,
            alpha_vane: Vane { factor: 1.25, ..vane },
            beta_vane: vane,
            vane_model: VaneModel::Exact,
            thrust_in_ax: true,
        },
    }
}

fn settings() -> Settings {
    serde_yaml::from_str(
        "{excitation_flag: obes, steps: {de_deg: 2, dsa_deg: 2, stick_pitch_in: 1, stick_lat_in: 1, pedal_in: 1}}",
    )
    .expect("settings")
}

/// A class from its flags and its step counts (signal, at least, at most).
fn class(name: &str, axis: Axis, flags: &[(&str, bool)], steps: &[(&str, usize, usize)], decay_s: f64) -> Class {
    let count = |s: &(&str, usize, usize)| (s.0.to_owned(), StepCount { at_least: s.1, at_most: s.2 });
    Class {
        name: name.into(),
        title: String::new(),
        axis,
        recognition: Recognition {
            flags: flags.iter().map(|f| (f.0.to_owned(), f.1)).collect(),
            steps: steps.iter().map(count).collect(),
            lead_in_s: 1.0,
            decay_s,
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
    vec![
        class("DOUBLETS", Axis::Longitudinal, &obes, &[("dsa_deg", 3, any), ("de_deg", 3, any)], 1.5),
        class("SERIES", Axis::Longitudinal, &obes, &[("de_deg", 10, any), ("dsa_deg", 0, 2)], 1.5),
        class("3211", Axis::Longitudinal, &obes, &[("de_deg", 4, 9), ("dsa_deg", 0, 2)], 1.5),
        class("PITCH", Axis::Longitudinal, &free, &pitch, 2.5),
        class("PITCH_TV", Axis::Longitudinal, &vectored, &pitch, 2.5),
        class("YAW_ROLL", Axis::Lateral, &free, &yaw_roll, 2.5),
    ]
}

/// A record of trimmed flight with smooth motion and chatter on every control.
fn flight(length_s: u32) -> Record {
    let samples = length_s as usize * 40 + 1;
    let mut record = Record { flight_id: "f1".into(), start_s: 0.0, step_s: STEP_S, samples, signals: BTreeMap::new() };
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
    for (name, trim) in
        [("de_deg", -9.0), ("dsa_deg", 0.1), ("stick_pitch_in", 0.4), ("stick_lat_in", 0.0), ("pedal_in", 0.0)]
    {
        put(&mut record, name, |t| trim + 0.4 * (2.0 * t).sin() + 0.3 * (125.0 * t).sin());
    }
    record
}

fn put(record: &mut Record, name: &str, value: impl Fn(f64) -> f64) {
    let values: Vec<f64> = (0..record.samples).map(|k| value(record.time_s(k))).collect();
    let marks = vec![Mark::Measured; values.len()];
    record.signals.insert(name.into(), Series { values, marks });
}

fn add(record: &mut Record, name: &str, value: impl Fn(f64) -> f64) {
    let old = record.values(name).expect("a signal of the record").to_vec();
    let start_s = record.start_s;
    put(record, name, |t| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a sample of the record")]
        let k = ((t - start_s) / STEP_S).round() as usize;
        old[k] + value(t)
    });
}

fn up(record: &mut Record, flag: &str, from_s: f64, to_s: f64) {
    add(record, flag, |t| f64::from(u8::from(t >= from_s && t < to_s)));
}

/// Edges at given times, each crossed within 0.15 s: the level changes by the given amount.
fn edges(record: &mut Record, name: &str, edges: &[(f64, f64)]) {
    add(record, name, |t| edges.iter().map(|(at, change)| change * ((t - at) / 0.15).clamp(0.0, 1.0)).sum());
}

fn doublet(record: &mut Record, name: &str, at_s: f64, size: f64) {
    edges(record, name, &[(at_s, size), (at_s + 1.0, -2.0 * size), (at_s + 2.0, size)]);
}

/// Alternating steps: to one side, from side to side `reversals` times, back to trim.
fn pilot_steps(record: &mut Record, name: &str, at_s: f64, size: f64, reversals: u32, half_period_s: f64) -> f64 {
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

fn three_two_one_one(record: &mut Record, at_s: f64) {
    edges(
        record,
        "de_deg",
        &[(at_s, 6.0), (at_s + 3.0, -12.0), (at_s + 5.0, 12.0), (at_s + 6.0, -12.0), (at_s + 7.0, 6.0)],
    );
}

fn found(record: &Record) -> Segmented {
    maneuvers(record, &classes(), &aircraft(), &settings())
}

fn assert_one(record: &Record, class: &str, start_s: f64, end_s: f64) {
    let Segmented { maneuvers, problems } = found(record);
    assert_eq!(problems, []);
    assert_eq!(maneuvers.iter().map(|m| m.class.as_str()).collect::<Vec<_>>(), [class]);
    assert_abs_diff_eq!(maneuvers[0].start_s, start_s, epsilon = 0.2);
    assert_abs_diff_eq!(maneuvers[0].end_s, end_s, epsilon = 0.2);
}

#[test]
fn doublets_of_surfaces_are_found_with_their_window_and_condition() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 40.0);
    doublet(&mut r, "dsa_deg", 21.0, 5.0);
    doublet(&mut r, "de_deg", 30.0, -4.0);
    assert_one(&r, "DOUBLETS", 20.0, 41.5);
    let m = &found(&r).maneuvers[0];
    assert_eq!((m.maneuver_id.as_str(), m.origin.as_str()), ("f1_t00020", "found"));
    assert_abs_diff_eq!(m.samples as f64, 1.0 + (m.end_s - m.start_s) / STEP_S, epsilon = 1e-6);
    // The vane reads 1.25 times the angle at the c.g.
    assert_abs_diff_eq!(m.alpha_deg, 20.0, epsilon = 1e-9);
    assert_abs_diff_eq!(m.mass_slug, 1050.0, epsilon = 1e-9);
}

#[test]
fn four_steps_with_a_long_tail_are_not_a_series() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    assert_one(&r, "3211", 20.0, 34.5);

    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    pilot_steps(&mut r, "de_deg", 21.0, 4.0, 10, 0.9);
    assert_one(&r, "SERIES", 20.0, 34.5);
}

#[test]
fn pilot_steps_begin_and_end_with_the_deflection_and_the_vectoring_flag_tells_the_class() {
    for (tvcs, class) in [(0.0, "PITCH"), (1.0, "PITCH_TV")] {
        let mut r = flight(60);
        put(&mut r, "tvcs", |_| tvcs);
        let last_s = pilot_steps(&mut r, "stick_pitch_in", 20.0, 1.0, 8, 1.8);
        assert_one(&r, class, 19.0, last_s + 2.5);
    }
}

#[test]
fn a_vectoring_flag_that_flickers_does_not_change_the_class() {
    let mut r = flight(60);
    up(&mut r, "tvcs", 25.0, 29.0);
    let last_s = pilot_steps(&mut r, "stick_pitch_in", 20.0, 1.5, 8, 1.5);
    assert_one(&r, "PITCH", 19.0, last_s + 2.5);
}

#[test]
fn pedal_then_stick_is_one_maneuver_and_the_recovery_is_left_out() {
    let mut r = flight(60);
    let pedal_s = pilot_steps(&mut r, "pedal_in", 20.0, 1.5, 3, 1.5);
    let last_s = pilot_steps(&mut r, "stick_lat_in", pedal_s + 1.5, -1.5, 3, 1.5);
    edges(&mut r, "stick_lat_in", &[(last_s + 2.5, 1.7), (last_s + 4.0, -1.7)]);
    assert_one(&r, "YAW_ROLL", 19.0, last_s + 2.5);
}

#[test]
fn flicker_without_excitation_turns_and_recoveries_are_no_maneuvers() {
    let mut r = flight(120);
    up(&mut r, "obes", 20.0, 24.0);
    up(&mut r, "tvcs", 30.0, 35.0);
    for at in [22.0, 50.0, 58.0, 80.0] {
        edges(&mut r, "stick_lat_in", &[(at, 1.6), (at + 2.0, -1.6)]);
        edges(&mut r, "stick_pitch_in", &[(at + 0.5, 2.0), (at + 1.0, -2.0)]);
    }
    assert_eq!(found(&r), Segmented::default());
}

#[test]
fn excitation_that_fits_no_class_is_said_with_what_was_seen() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 30.0);
    doublet(&mut r, "de_deg", 21.0, 5.0);
    let Segmented { maneuvers, problems } = found(&r);
    assert_eq!(maneuvers, []);
    assert_eq!(problems.len(), 1);
    assert_eq!(problems[0].place, "t = 20.0 s");
    assert!(problems[0].reason.contains("de_deg 3"), "{}", problems[0].reason);
}

#[test]
fn a_maneuver_that_fits_two_classes_names_them() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    let mut both = classes();
    both.push(Class { name: "TWIN".into(), ..both[2].clone() });
    let Segmented { maneuvers, problems } = maneuvers(&r, &both, &aircraft(), &settings());
    assert_eq!(maneuvers, []);
    assert!(problems[0].reason.contains("3211, TWIN"), "{}", problems[0].reason);
}

#[test]
fn a_short_drop_out_of_the_flag_and_missing_samples_do_not_cut_a_maneuver() {
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
    assert_one(&r, "3211", 20.0, 34.5);
}

#[test]
fn two_maneuvers_close_together_do_not_overlap() {
    let mut r = flight(60);
    up(&mut r, "obes", 10.0, 19.0);
    three_two_one_one(&mut r, 11.0);
    up(&mut r, "obes", 20.0, 29.0);
    three_two_one_one(&mut r, 21.0);
    let Segmented { maneuvers, problems } = found(&r);
    assert_eq!(problems, []);
    assert_eq!(maneuvers.len(), 2);
    assert_abs_diff_eq!(maneuvers[0].end_s, 20.5, epsilon = 0.05);
    assert!(maneuvers[1].start_s >= maneuvers[0].end_s);
    assert!(maneuvers[1].start_s < 21.05);
}

#[test]
fn a_maneuver_that_the_record_cuts_is_a_problem() {
    let mut r = flight(30);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    let Segmented { maneuvers, problems } = found(&r);
    assert_eq!(maneuvers, []);
    assert!(problems[0].reason.contains("cut"), "{}", problems[0].reason);
}

#[test]
fn a_record_without_a_signal_says_which_classes_suffer_and_segments_the_rest() {
    let mut r = flight(60);
    pilot_steps(&mut r, "stick_pitch_in", 20.0, 1.5, 8, 1.5);
    r.signals.remove("dsa_deg");
    let Segmented { maneuvers, problems } = found(&r);
    assert_eq!(maneuvers.len(), 1);
    assert_eq!(problems.iter().map(|p| p.place.as_str()).collect::<Vec<_>>(), ["dsa_deg"]);
}

#[test]
fn a_class_whose_signal_has_no_smallest_step_is_named() {
    let mut short = settings();
    short.steps.remove("pedal_in");
    assert_eq!(short.without_smallest_step(&classes()), ["pedal_in".to_owned()].into());
    assert!(settings().without_smallest_step(&classes()).is_empty());
}

fn event(class: &str, start_s: f64, end_s: f64) -> Event {
    Event { flight_id: "f1".into(), class: class.into(), start_s, end_s }
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
    let other_flight = Event { flight_id: "f2".into(), ..event("3211", 1.0, 2.0) };
    let events = [event("3211", 20.2, 34.0), event("SERIES", 48.0, 64.0), event("PITCH", 70.0, 80.0), other_flight];
    let (segmented, rows) = with_events(found(&r), &r, &events, &classes(), &aircraft());
    assert_eq!(segmented.problems, []);
    let said: Vec<(&str, &str)> = segmented.maneuvers.iter().map(|m| (m.class.as_str(), m.origin.as_str())).collect();
    assert_eq!(said, [("3211", "given"), ("SERIES", "given"), ("PITCH", "given"), ("3211", "found")]);
    assert_abs_diff_eq!(segmented.maneuvers[0].start_s, 20.2, epsilon = 1e-9);
    let verdicts: Vec<&str> = rows.iter().map(|r| r.verdict.as_str()).collect();
    assert_eq!(verdicts, ["agrees", "other class", "not found", "not given"]);
}

#[test]
fn events_of_unknown_class_or_outside_the_record_become_problems() {
    let mut r = flight(60);
    up(&mut r, "obes", 20.0, 33.0);
    three_two_one_one(&mut r, 21.0);
    let events = [event("PICH", 20.0, 34.0), event("3211", 50.0, 70.0), event("3211", 30.0, 25.0)];
    let (segmented, rows) = with_events(found(&r), &r, &events, &classes(), &aircraft());
    assert_eq!(segmented.problems.len(), 3);
    assert!(segmented.problems[0].reason.contains("did you mean `PITCH`?"), "{}", segmented.problems[0].reason);
    assert_eq!(segmented.maneuvers.len(), 1);
    assert_eq!(rows.iter().map(|r| r.verdict.as_str()).collect::<Vec<_>>(), ["not given"]);
}

#[test]
fn without_events_nothing_is_compared() {
    let r = flight(10);
    assert_eq!(with_events(found(&r), &r, &[], &classes(), &aircraft()), (Segmented::default(), Vec::new()));
}
