//! Strip charts of flights and maneuvers: content, places, size of the file.

use std::collections::BTreeMap;

use super::flight::flight_signals;
use super::signal_strips::scale_with_two_ticks;
use super::*;
use crate::aero::Axis;
use crate::flight::record::Series;
use crate::flight::{Mark, Record};
use crate::maneuver::Maneuver;
use crate::tables::{EventRow, EventVerdict, FitRow, History, HistoryOutput, Outcome};

fn groups() -> SignalGroups {
    SignalGroups {
        surfaces: vec!["de_deg".into(), "dr_deg".into()],
        controls: vec!["stick_in".into()],
        flags: vec!["on".into()],
        steps: [("stick_in".to_owned(), 1.0)].into(),
    }
}

/// A record of so many samples at 40 Hz in which everything moves but the rudder.
fn record(samples: usize) -> Record {
    let names = flight_signals(&groups())
        .into_iter()
        .map(|s| s.0.to_owned())
        .collect::<Vec<_>>();
    let series = |name: &str| {
        let moves = name != "dr_deg";
        let values = (0..samples).map(|k| {
            if moves {
                (k as f64 * 0.7).sin()
            } else {
                0.001 * (k % 2) as f64
            }
        });
        Series {
            values: values.collect(),
            marks: vec![Mark::Measured; samples],
        }
    };
    let signals: BTreeMap<String, Series> = names.iter().map(|n| (n.clone(), series(n))).collect();
    Record {
        flight_id: "f".into(),
        start_s: 0.0,
        step_s: 0.025,
        samples,
        signals,
        remaining_errors: BTreeMap::new(),
    }
}

fn maneuver_at(start_s: f64) -> Maneuver {
    Maneuver {
        class: "STEPS".into(),
        start_s,
        end_s: start_s + 10.0,
        ..Maneuver::example(&format!("f_t{start_s:05}"), 10.0)
    }
}

fn fit(outcome: Outcome, reason: &str) -> FitRow {
    FitRow {
        reason: reason.into(),
        iterations: 5,
        initial_cost: Some(1.0),
        final_cost: Some(0.5),
        left_out: Some(0.01),
        ..FitRow::without_numbers("f_t00020", "STEPS", outcome)
    }
}

fn drawn(record: &Record, maneuvers: &[Maneuver], events: &[EventRow]) -> String {
    let groups = groups();
    let recorded = (record.samples, record.step_s);
    draw_flight(&FlightView {
        aircraft: "an aircraft",
        record,
        recorded,
        groups: &groups,
        maneuvers,
        unknown: &[],
        events,
        problems: &[],
    })
}

fn drawn_maneuver(record: &Record, fit: &FitRow, history: Option<&History>) -> String {
    let maneuver_shown = maneuver_at(20.0);
    let (groups, flight) = (groups(), [maneuver_shown.clone(), maneuver_at(200.0)]);
    draw_maneuver(&ManeuverView {
        aircraft: "an aircraft",
        record,
        groups: &groups,
        maneuver: &maneuver_shown,
        class: None,
        flight: &flight,
        fit,
        history,
    })
}

/// The estimate's history of the maneuver at 20 s: what was computed is a tenth off.
fn history(record: &Record) -> History {
    let output = |o: crate::aero::Output| {
        let measured = record.values(o.signal()).expect("recorded")[800..=1200].to_vec();
        let measured: Vec<f64> = measured
            .into_iter()
            .enumerate()
            .map(|(k, v)| if k == 200 { -9e3 } else { v })
            .collect();
        let computed = measured
            .iter()
            .map(|v| if *v < -1e3 { 0.0 } else { v - 0.1 })
            .collect();
        let marked = (0..401).map(|k| k == 200).collect();
        HistoryOutput {
            label: o.signal().into(),
            unit: "deg".into(),
            measured,
            computed,
            marked,
        }
    };
    History {
        maneuver_id: "f_t00020".into(),
        class: "STEPS".into(),
        alpha_deg: 10.0,
        time_s: (0..401).map(|k| 0.025 * f64::from(k)).collect(),
        outputs: Axis::Longitudinal
            .outputs()
            .into_iter()
            .map(output)
            .collect(),
        controls: vec![],
    }
}

#[test]
fn ten_hours_with_two_hundred_maneuvers_are_less_than_a_megabyte() {
    let record = record(1_440_000);
    let maneuvers: Vec<Maneuver> = (0..200)
        .map(|i| maneuver_at(100.0 + 170.0 * f64::from(i)))
        .collect();
    let svg = drawn(&record, &maneuvers, &[]);
    assert!(svg.len() < 1_000_000, "{}", svg.len());
    assert_eq!(svg.matches("class=\"window\"").count(), 200);
}

#[test]
fn a_flight_has_a_strip_per_signal_and_lists_signals_not_recorded() {
    let mut record = record(4000);
    record.signals.remove("psi_deg");
    let svg = drawn(&record, &[maneuver_at(20.0)], &[]).replace("&#x2f;", "/");
    assert_eq!(svg.matches("class=\"strip\"").count(), record.signals.len());
    assert!(svg.contains("Not recorded: psi.") && svg.contains("STEPS f_t00020"));
    assert!(
        svg.contains(">deg/s</text>") && svg.contains(">ft/s</text>") && svg.contains("time, s")
    );
}

#[test]
fn flags_are_drawn_and_explained_if_there_are_any() {
    let mut record = record(4000);
    assert!(!drawn(&record, &[], &[]).contains("class=\"mark"));
    let series = record.signals.get_mut("q_deg_s").expect("recorded");
    series.marks[1000..1005].fill(Mark::Bridged);
    series.marks[2000] = Mark::Despiked;
    series.marks[3000..3500].fill(Mark::Missing);
    series.values[3000..3500].fill(f64::NAN);
    let svg = drawn(&record, &[], &[]);
    for (kind, word) in [
        ("bridged", "bridged"),
        ("despiked", "spike replaced"),
        ("missing", "missing"),
    ] {
        assert_eq!(
            svg.matches(&format!("class=\"mark {kind}\"")).count(),
            1,
            "{kind}"
        );
        assert!(svg.contains(&format!(">{word}</text>")), "{word}");
    }
}

#[test]
fn events_of_the_analyst_are_above_the_maneuvers_found() {
    let row = |given: Option<&str>, found: Option<&str>, verdict: EventVerdict| EventRow {
        flight_id: "f".into(),
        given_class: given.map(str::to_owned),
        given_start_s: given.map(|_| 20.0),
        given_end_s: given.map(|_| 30.0),
        found_class: found.map(str::to_owned),
        found_start_s: found.map(|_| 20.5),
        found_end_s: found.map(|_| 31.0),
        verdict,
    };
    let events = [row(Some("STEPS"), Some("OTHER"), EventVerdict::OtherClass)];
    let svg = drawn(&record(4000), &[maneuver_at(20.0)], &events);
    assert!(svg.contains("STEPS f_t00020, other class"));
    assert_eq!(
        (
            svg.matches("data-lane=\"given\"").count(),
            svg.matches("data-lane=\"found\"").count()
        ),
        (1, 1)
    );
    assert!(svg.contains("found: OTHER, 20.5 to 31.0 s"));
}

#[test]
fn an_estimated_maneuver_shows_residuals_and_one_that_was_rejected_its_reason() {
    let record = record(12_000);
    let svg = drawn_maneuver(
        &record,
        &fit(Outcome::Converged, "done"),
        Some(&history(&record)),
    );
    assert_eq!(svg.matches(">residual</text>").count(), 5);
    assert!(svg.contains("left out of the cost") && svg.contains("5 iterations"));
    assert_eq!(
        svg.matches("class=\"window\"").count(),
        1,
        "the other maneuver is minutes away"
    );
    assert!(svg.contains("hardly moved: dr."));
    assert!(
        !svg.contains("000</text>"),
        "a sample that was left out has no residual and stretches no scale"
    );

    let svg = drawn_maneuver(
        &record,
        &fit(Outcome::Rejected, "too many marked samples"),
        None,
    );
    assert!(!svg.contains("residual") && svg.contains("too many marked samples"));
    assert_eq!(svg.matches("class=\"strip\"").count(), 2 + 5 + 1);
}

#[test]
fn every_scale_has_two_to_six_ticks() {
    for (low, high) in [
        (-0.009, 0.009),
        (0.0, 0.0),
        (12.99, 13.01),
        (-33.0, 4.0),
        (0.0, 1e5),
    ] {
        for steps in [1.6, 2.0, 3.0] {
            let scale = scale_with_two_ticks(low, high, steps);
            let ticks = (scale.max / scale.step + 1e-9).floor()
                - (scale.min / scale.step - 1e-9).ceil()
                + 1.0;
            assert!((2.0..=6.0).contains(&ticks), "{low} {high}: {scale:?}");
        }
    }
}
