//! Ingest: bad input is named and the rest of the campaign is done; what cannot be run at all says why.

use std::fs;
use std::sync::Arc;

use arrow::array::{RecordBatch, StringArray};
use arrow::datatypes::DataType;

use crate::support::{
    Campaign, pitch_steps, renamed, replaced, values, with_unit, with_values, without, yaw_and_roll_steps,
};

/// A flight whose file was spoiled beside a healthy one: the run ends with 2, the healthy flight's maneuver is estimated,
/// and the only problem names flight and place and says all of `words`.
fn is_refused(spoil: impl FnOnce(&Campaign), place: &str, words: &[&str]) {
    let campaign = Campaign::of_pitch_steps();
    spoil(&campaign);
    let outcome = campaign.ends("estimate", 2);
    assert!(outcome.stdout.contains("2 flights, 1 refused"), "{outcome:?}");

    let problems = campaign.table("problems");
    assert_eq!(problems.len(), 1, "{problems:?}");
    let problem = &problems[0];
    assert_eq!((&*problem["stage"], &*problem["flight_id"]), ("ingest", "spoiled"));
    assert!(problem["place"].contains(place), "{problem:?}");
    for word in words {
        assert!(problem["reason"].contains(word), "`{word}` is not said: {problem:?}");
    }
    assert!(outcome.stdout.contains(&problem["reason"]), "{outcome:?}");

    let fits = campaign.table("fits");
    assert_eq!(fits.len(), 1);
    assert_eq!(fits[0]["outcome"], "converged");
}

fn record_is_refused(record: &RecordBatch, place: &str, words: &[&str]) {
    is_refused(|campaign| campaign.add("spoiled", record), place, words);
}

#[test]
fn a_truncated_file_is_refused() {
    let truncated = |campaign: &Campaign| {
        let whole = fs::read(campaign.flight("flight_001")).unwrap();
        fs::write(campaign.flight("spoiled"), &whole[..whole.len() / 2]).unwrap();
    };
    is_refused(truncated, "spoiled.parquet", &["not a readable Parquet file", "truncated"]);
}

#[test]
fn damaged_bytes_in_the_middle_of_a_file_are_refused_without_a_panic() {
    let damaged = |campaign: &Campaign| {
        let mut bytes = fs::read(campaign.flight("flight_001")).unwrap();
        let middle = bytes.len() / 3;
        bytes[middle..middle + 40_000].fill(0xff);
        fs::write(campaign.flight("spoiled"), bytes).unwrap();
    };
    is_refused(damaged, "spoiled.parquet", &[]);
}

#[test]
fn a_text_file_named_parquet_is_refused() {
    let text = |campaign: &Campaign| fs::write(campaign.flight("spoiled"), "time,alpha\n0.0,5.1\n0.025,5.2\n").unwrap();
    is_refused(text, "spoiled.parquet", &["not a readable Parquet file", "another format"]);
}

#[test]
fn an_empty_file_is_refused() {
    is_refused(
        |campaign| fs::write(campaign.flight("spoiled"), "").unwrap(),
        "spoiled.parquet",
        &["not a readable Parquet file"],
    );
}

#[test]
fn a_record_without_rows_is_refused() {
    record_is_refused(&yaw_and_roll_steps().slice(0, 0), "channel `time`", &["0 rows are no record"]);
}

#[test]
fn a_record_without_a_required_channel_is_refused() {
    record_is_refused(
        &without(&yaw_and_roll_steps(), "beta_vane"),
        "channel `beta_vane`",
        &["channel `beta_vane`", "`beta_vane_deg`", "not in the file"],
    );
}

#[test]
fn a_record_without_time_is_refused() {
    record_is_refused(&without(&yaw_and_roll_steps(), "time"), "channel `time`", &["`time` is not in the file"]);
}

#[test]
fn a_channel_of_text_is_refused() {
    let text = |channel: &str| {
        let record = yaw_and_roll_steps();
        let words: Vec<String> = values(&record, channel).iter().map(|v| format!("{v:.2}")).collect();
        replaced(&record, channel, |field, _| {
            (field.clone().with_data_type(DataType::Utf8), Arc::new(StringArray::from(words)))
        })
    };
    record_is_refused(
        &text("p"),
        "spoiled.parquet",
        &["column `p`", "`p_deg_s`", "is of type Utf8", "expected a number"],
    );
}

#[test]
fn a_unit_in_the_file_that_is_not_the_channel_map_s_is_refused() {
    record_is_refused(
        &with_unit(&yaw_and_roll_steps(), "p", "rad/s"),
        "channel `p`",
        &["the file states `rad/s`", "the channel map `deg/s`", "correct"],
    );
}

#[test]
fn a_unit_that_neither_file_nor_map_confesses_is_found_by_the_kinematics() {
    let radians = with_values(&yaw_and_roll_steps(), "p", |_, p| p.to_radians());
    record_is_refused(&radians, "channel `p`", &["rad"]);
}

#[test]
fn a_reversed_sign_is_found_by_the_kinematics() {
    let reversed = with_values(&yaw_and_roll_steps(), "r", |_, r| -r);
    // The heading's sign would explain it as well, and is said to.
    record_is_refused(&reversed, "`r`", &["`r`: its sign is reversed"]);
}

#[test]
fn time_that_runs_backwards_is_refused_with_row_and_time() {
    let record = yaw_and_roll_steps();
    let times = values(&record, "time");
    let back = with_values(&record, "time", |row, t| if row >= 1000 { t - 10.0 } else { t });
    let before = format!("from {:.4} s", times[999]);
    record_is_refused(&back, "channel `time`", &["time runs backwards", "row 1001", &before]);
}

#[test]
fn time_that_stands_still_is_refused_with_row_and_time() {
    let record = yaw_and_roll_steps();
    let times = values(&record, "time");
    let still = with_values(&record, "time", |row, t| if row == 1000 { times[999] } else { t });
    let at = format!("at {:.4} s", times[999]);
    record_is_refused(&still, "channel `time`", &["time stands still", "row 1001", &at]);
}

#[test]
fn time_that_is_no_number_is_refused_with_its_row() {
    let hole = with_values(&yaw_and_roll_steps(), "time", |row, t| if row == 1000 { f64::NAN } else { t });
    record_is_refused(&hole, "channel `time`", &["row 1001", "not a number"]);
}

#[test]
fn a_required_channel_without_any_number_is_refused() {
    record_is_refused(
        &with_values(&yaw_and_roll_steps(), "q", |_, _| f64::NAN),
        "channel `q`",
        &["`q_deg_s`", "holds no number"],
    );
}

#[test]
fn a_channel_that_the_equations_can_do_without_is_reported_and_the_flight_goes_on() {
    let campaign = Campaign::new();
    campaign.add("flight_001", &with_values(&pitch_steps(), "psi", |_, _| f64::NAN));
    campaign.ends("estimate", 2);
    let problems = campaign.table("problems");
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert_eq!(problems[0]["place"], "channel `psi`");
    assert_eq!(campaign.table("fits")[0]["outcome"], "converged");
}

#[test]
fn an_archive_of_spoiled_flights_only_still_says_what_is_wrong_with_each() {
    let campaign = Campaign::new();
    fs::write(campaign.flight("one"), "").unwrap();
    fs::write(campaign.flight("two"), "text").unwrap();
    campaign.ends("run", 2);
    let named: Vec<String> = campaign.table("problems").iter().map(|p| p["flight_id"].clone()).collect();
    assert_eq!(named, ["one", "two"]);
    let report = fs::read_to_string(campaign.path("reports/report.html")).unwrap();
    assert!(report.contains("not a readable Parquet file"), "the report names what was refused");
}

#[test]
fn repairs_are_counted_per_channel() {
    let campaign = Campaign::new();
    // Three spikes and a dropout of five samples, in steady flight.
    let spoiled = with_values(&pitch_steps(), "theta", |row, theta| match row {
        2000 | 2400 | 2800 => theta + 20.0,
        3200..3205 => f64::NAN,
        _ => theta,
    });
    campaign.add("flight_001", &pitch_steps());
    campaign.add("spoiled", &spoiled);
    campaign.ends("ingest", 0);
    let channels = campaign.table("channels");
    let count = |flight: &str, column: &str| -> i64 {
        let theta = channels.iter().find(|r| r["flight_id"] == flight && r["channel"] == "theta").unwrap();
        theta[column].parse().unwrap()
    };
    assert_eq!(count("spoiled", "despiked") - count("flight_001", "despiked"), 3);
    assert_eq!(count("spoiled", "bridged") - count("flight_001", "bridged"), 5);
    assert_eq!(count("spoiled", "missing"), 0);
}

#[test]
fn a_hive_partitioned_flight_of_several_files_is_the_same_flight() {
    let whole = Campaign::of_pitch_steps();
    whole.ends("segment", 0);
    let parted = Campaign::new();
    let record = pitch_steps();
    let folder = parted.path("flights/flight=flight_001");
    fs::create_dir(&folder).unwrap();
    crate::support::write(&record.slice(0, 2000), &folder.join("part-0.parquet"));
    crate::support::write(&record.slice(2000, record.num_rows() - 2000), &folder.join("part-1.parquet"));
    parted.ends("segment", 0);
    // The Parquet files say which files they were made from.
    let texts = |campaign: &Campaign| {
        campaign.tables().into_iter().filter(|(p, _)| p.extension().is_some_and(|e| e == "csv")).collect::<Vec<_>>()
    };
    assert_eq!(texts(&parted), texts(&whole));
}

#[test]
fn a_recorder_with_other_names_units_and_signs_is_a_matter_of_its_channel_map() {
    let shipped = Campaign::of_pitch_steps();
    shipped.ends("estimate", 0);

    let other = Campaign::new();
    let record = with_values(&pitch_steps(), "q", |_, q| -q.to_radians());
    let record = renamed(&with_unit(&record, "q", "rad/s"), "q", "pitch_rate");
    let record = with_values(&record, "V", |_, v| v * 0.3048);
    other.add("flight_001", &with_unit(&record, "V", "m/s"));
    other.copy_pipeline();
    other.edit(
        "aircraft.yaml",
        "q: { signal: q_deg_s, unit: deg/s }",
        "pitch_rate: { signal: q_deg_s, unit: rad/s, sign: -1 }",
    );
    other.edit("aircraft.yaml", "velocity_ft_s, unit: ft/s }", "velocity_ft_s, unit: m/s }");
    other.ends("estimate", 0);

    crate::estimate::assert_same_estimates(&shipped.table("estimates"), &other.table("estimates"));
}

#[test]
fn an_archive_without_records_cannot_be_run() {
    let campaign = Campaign::new();
    let outcome = campaign.ends("run", 1);
    assert!(outcome.stderr.contains("no flight records here"), "{outcome:?}");
    assert!(outcome.stderr.contains("flights"), "{outcome:?}");
    assert!(!campaign.path("reports").exists(), "nothing is published");
}

#[test]
fn an_archive_that_does_not_exist_cannot_be_run() {
    let campaign = Campaign::on("data/demo/fligths");
    let outcome = campaign.ends("ingest", 1);
    assert!(outcome.stderr.contains("data/demo/fligths: no flight records here"), "{outcome:?}");
}

#[test]
fn one_flight_in_two_places_counts_once_and_is_said() {
    let campaign = Campaign::of_pitch_steps();
    fs::create_dir(campaign.path("flights/copy")).unwrap();
    fs::copy(campaign.flight("flight_001"), campaign.path("flights/copy/flight_001.parquet")).unwrap();
    let outcome = campaign.ends("ingest", 2);
    assert!(outcome.stdout.contains("a copy of a file of flight `flight_001`"), "{outcome:?}");
}
