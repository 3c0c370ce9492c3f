//! Delays and signs of the surfaces, through the program.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use arrow::array::RecordBatch;

use crate::support::{Campaign, Row, demo, flight, number, values, with_values};

/// Longer than any demonstration flight, s.
const WHOLE_S: usize = 100_000;

/// Planted delay, s: about that of the middle of a step of the corrections, which are rounded.
const LATE_S: f64 = 0.0102;

const STEP_S: f64 = 0.025;

const SURFACES: [&str; 9] = [
    "de", "dlef", "dtef", "dsa", "dpv", "da", "ddht", "dr", "dyv",
];

/// A demonstration flight whose recorder stores all surfaces late. The cubic through four samples
/// stands for the signal between them.
fn late(number: u32) -> RecordBatch {
    let mut record = flight(number, WHOLE_S);
    for channel in SURFACES {
        let exact = values(&record, channel);
        let f = 1.0 - LATE_S / STEP_S;
        record = with_values(&record, channel, |row, value| {
            let four = row
                .checked_sub(2)
                .and_then(|first| exact.get(first..row + 2));
            let Some([a, b, c, d]) = four else {
                return value;
            };
            let slope_b = 0.5 * (c - a);
            let slope_c = 0.5 * (d - b);
            b + f
                * (slope_b
                    + f * (3.0 * (c - b) - 2.0 * slope_b - slope_c
                        + f * (2.0 * (b - c) + slope_b + slope_c)))
        });
    }
    record
}

fn of_all_flights(campaign: &Campaign) -> BTreeMap<String, Row> {
    campaign
        .table("instruments")
        .into_iter()
        .filter(|row| row["flight_id"] == "all")
        .map(|row| (row["channel"].clone(), row))
        .collect()
}

/// Names of the estimates in the store.
fn estimates(campaign: &Campaign) -> BTreeSet<PathBuf> {
    let stored = campaign.bytes("store").into_keys();
    stored.filter(|path| path.starts_with("estimate")).collect()
}

/// Estimates that the demonstration has with a bound, by maneuver and derivative.
fn exact_estimates() -> BTreeMap<(&'static str, &'static str), &'static Row> {
    let rows = demo().tables["estimates"].iter();
    rows.filter(|row| row["status"] == "estimated" && !row["bound_corrected"].is_empty())
        .map(|row| ((&*row["maneuver_id"], &*row["derivative"]), row))
        .collect()
}

/// Distances of estimates from those of the surfaces on time, over their bounds, sorted.
fn changes_in_bounds(rows: &[Row]) -> Vec<f64> {
    let exact = exact_estimates();
    let mut changes: Vec<f64> = rows
        .iter()
        .filter_map(|row| {
            let exact = exact.get(&(&*row["maneuver_id"], &*row["derivative"]))?;
            let change = number(row, "value") - number(exact, "value");
            Some((change / number(exact, "bound_corrected")).abs())
        })
        .collect();
    changes.sort_by(f64::total_cmp);
    changes
}

#[test]
fn late_surfaces_are_found_and_corrected_and_a_further_flight_estimates_itself_alone() {
    let campaign = Campaign::new();
    for number in 1..=3 {
        campaign.add(&format!("flight_{number:03}"), &late(number));
    }
    campaign.finishes("model");
    let delays = of_all_flights(&campaign);
    for channel in ["de", "da", "dr", "ddht", "dyv"] {
        let row = &delays[channel];
        let (delay_s, bound_s) = (number(row, "delay_s"), number(row, "delay_bound_s"));
        assert!((delay_s - LATE_S).abs() < 1.5e-3, "{row:?}");
        assert!((0.4e-3..2e-3).contains(&bound_s), "{row:?}");
        assert_eq!(row["applied"], "delay", "{row:?}");
    }
    // Uncorrected, the median change of the estimates is 0.8 bounds.
    let changes = changes_in_bounds(&campaign.table("estimates"));
    assert!(changes.len() > 400 && changes[changes.len() / 2] < 0.15);

    let before = estimates(&campaign);
    campaign.add("flight_004", &late(4));
    campaign.finishes("model");
    let after = estimates(&campaign);
    let own = |path: &&PathBuf| path.to_string_lossy().contains("flight_004");
    assert!(before.is_subset(&after));
    assert!(after.difference(&before).all(|path| own(&path)));

    let stored = campaign.bytes("store");
    let again = campaign.finishes("model");
    assert!(campaign.bytes("store") == stored, "{again:?}");
}

#[test]
fn surfaces_on_time_are_left_as_recorded() {
    let demo = demo();
    let rows = demo.tables["instruments"].iter();
    let of_surfaces = rows.filter(|row| SURFACES.contains(&row["channel"].as_str()));
    let mut told = 0;
    for row in of_surfaces {
        assert_eq!(row["applied"], "", "{row:?}");
        assert!(
            ["ok", "not excited"].contains(&row["verdict"].as_str()),
            "{row:?}"
        );
        if row["flight_id"] == "all" && row["verdict"] == "ok" {
            assert!(number(row, "delay_s").abs() < 2e-3, "{row:?}");
            told += 1;
        }
    }
    assert!(told >= 5);
}

#[test]
fn delays_that_are_only_reported_stay_in_the_record_and_in_the_bounds() {
    let campaign = Campaign::new();
    campaign.add("flight_001", &late(1));
    campaign.copy_pipeline();
    campaign.edit(
        "pipeline.yaml",
        "surfaces: { delay: apply,",
        "surfaces: { delay: report,",
    );
    campaign.finishes("model");
    let delays = of_all_flights(&campaign);
    assert!(delays.values().all(|row| row["applied"].is_empty()));
    let exact = exact_estimates();
    let rows = campaign.table("estimates");
    let damping = rows.iter().filter(|row| row["derivative"] == "Cm_q");
    let mut compared = 0;
    for row in damping.filter(|row| row["status"] == "estimated") {
        let Some(exact) = exact.get(&(&*row["maneuver_id"], "Cm_q")) else {
            continue;
        };
        let bounds = [row, *exact].map(|row| number(row, "bound_corrected"));
        assert!(bounds[0] > bounds[1], "{row:?}");
        compared += 1;
    }
    assert!(compared >= 3);
}

#[test]
fn a_surface_of_reversed_sign_is_named_with_the_remedy() {
    let campaign = Campaign::new();
    for number in 1..=4 {
        let reversed = with_values(&flight(number, WHOLE_S), "da", |_, value| -value);
        campaign.add(&format!("flight_{number:03}"), &reversed);
    }
    campaign.ends("estimate", 2);
    let problems = campaign.table("problems");
    let of_records = problems.iter().filter(|p| p["stage"] == "segment");
    assert!(of_records.clone().count() >= 3, "{problems:?}");
    for problem in of_records {
        assert_eq!(problem["place"], "channel `da`", "{problem:?}");
        assert!(problem["reason"].contains("sign: -1"), "{problem:?}");
    }
    let rows = of_all_flights(&campaign);
    assert_eq!(rows["da"]["verdict"], "sign reversed");
    assert_eq!(rows["de"]["verdict"], "ok");
}
