//! Ingest: bad input is named and the rest of the campaign is done; what cannot be run at all says
//! why.

use std::fs;
use std::sync::Arc;

use arrow::array::{RecordBatch, StringArray};
use arrow::datatypes::DataType;

use crate::support::{
    Campaign, both_axes, pitch_steps, renamed, replaced, values, with_unit, with_values, without,
    yaw_and_roll_steps,
};

/// A flight whose file was spoiled beside a healthy one: the run ends with 2, the healthy flight's
/// maneuver is estimated, and the only problem names flight and place and says all of `words`.
fn is_refused(spoil: impl FnOnce(&Campaign), place: &str, words: &[&str]) {
    let campaign = Campaign::of_pitch_steps();
    spoil(&campaign);
    is_refused_in(&campaign, place, words);
}

fn is_refused_in(campaign: &Campaign, place: &str, words: &[&str]) {
    let outcome = campaign.ends("estimate", 2);
    assert!(
        outcome.stdout.contains("2 flights, 1 refused"),
        "{outcome:?}"
    );

    let problems = campaign.table("problems");
    assert_eq!(problems.len(), 1, "{problems:?}");
    let problem = &problems[0];
    assert_eq!(
        (&*problem["stage"], &*problem["flight_id"]),
        ("ingest", "spoiled")
    );
    assert!(problem["place"].contains(place), "{problem:?}");
    for word in words {
        assert!(
            problem["reason"].contains(word),
            "`{word}` is not said: {problem:?}"
        );
    }
    assert!(outcome.stdout.contains(&problem["reason"]), "{outcome:?}");

    let fits = campaign.table("fits");
    assert_eq!(fits.len(), 1);
    assert_eq!(fits[0]["outcome"], "converged");
}

/// As [`is_refused`], for a readable file whose record is wrong; the healthy flight is in the store.
fn record_is_refused(record: &RecordBatch, place: &str, words: &[&str]) {
    let campaign = Campaign::of_pitch_steps();
    both_axes().fill_store(&campaign);
    campaign.add("spoiled", record);
    is_refused_in(&campaign, place, words);
}

#[test]
fn a_truncated_file_is_refused() {
    let truncated = |campaign: &Campaign| {
        let whole = fs::read(campaign.flight("flight_001")).unwrap();
        fs::write(campaign.flight("spoiled"), &whole[..whole.len() / 2]).unwrap();
    };
    is_refused(
        truncated,
        "spoiled.parquet",
        &["not a readable Parquet file", "truncated"],
    );
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
    let text = |campaign: &Campaign| {
        fs::write(
            campaign.flight("spoiled"),
            "time,alpha\n0.0,5.1\n0.025,5.2\n",
        )
        .unwrap();
    };
    is_refused(
        text,
        "spoiled.parquet",
        &["not a readable Parquet file", "another format"],
    );
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
    record_is_refused(
        &yaw_and_roll_steps().slice(0, 0),
        "channel `time`",
        &["0 rows are no record"],
    );
}

#[test]
fn a_record_without_a_required_channel_is_refused() {
    record_is_refused(
        &without(&yaw_and_roll_steps(), "mass"),
        "channel `mass`",
        &["channel `mass`", "`mass_slug`", "not in the file"],
    );
}

#[test]
fn a_record_without_time_is_refused() {
    record_is_refused(
        &without(&yaw_and_roll_steps(), "time"),
        "channel `time`",
        &["`time` is not in the file"],
    );
}

/// A record whose channel is a column of text.
fn with_text(record: &RecordBatch, channel: &str) -> RecordBatch {
    let words: Vec<String> = values(record, channel)
        .iter()
        .map(|v| format!("{v:.2}"))
        .collect();
    replaced(record, channel, |field, _| {
        (
            field.clone().with_data_type(DataType::Utf8),
            Arc::new(StringArray::from(words)),
        )
    })
}

#[test]
fn a_channel_of_text_that_nothing_requires_costs_no_flight() {
    let campaign = Campaign::new();
    campaign.add("flight_001", &with_text(&pitch_steps(), "psi"));
    campaign.ends("estimate", 2);
    let problems = campaign.table("problems");
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert_eq!(problems[0]["place"], "channel `psi`");
    for words in ["is of type Utf8", "larger bounds"] {
        assert!(problems[0]["reason"].contains(words), "{problems:?}");
    }
    assert_eq!(campaign.table("fits")[0]["outcome"], "converged");
}

#[test]
fn a_channel_of_text_is_refused() {
    record_is_refused(
        &with_text(&yaw_and_roll_steps(), "p"),
        "spoiled.parquet",
        &[
            "column `p`",
            "`p_deg_s`",
            "is of type Utf8",
            "expected a number",
        ],
    );
}

#[test]
fn a_unit_in_the_file_that_is_not_the_channel_map_s_is_refused() {
    record_is_refused(
        &with_unit(&yaw_and_roll_steps(), "p", "rad/s"),
        "channel `p`",
        &[
            "the file states `rad/s`",
            "the channel map `deg/s`",
            "correct",
        ],
    );
}

#[test]
fn a_unit_stated_nowhere_is_found_by_the_kinematics() {
    let radians = with_values(&yaw_and_roll_steps(), "p", |_, p| p.to_radians());
    record_is_refused(&radians, "channel `p`", &["rad"]);
}

#[test]
fn a_reversed_sign_is_found_by_the_kinematics() {
    let reversed = with_values(&yaw_and_roll_steps(), "r", |_, r| -r);
    // The heading's sign would explain it as well, and is said to.
    record_is_refused(&reversed, "`r`", &["`r`: its sign is reversed"]);
}

/// A healthy flight whose file was spoiled in a way that costs it little: it is a flight still, the
/// run ends with `code`, and the only problem says all of `words`.
fn is_repaired_and_named(record: &RecordBatch, code: i32, words: &[&str]) -> Campaign {
    let campaign = Campaign::new();
    campaign.add("spoiled", record);
    campaign.ends("ingest", code);
    let problems = campaign.table("problems");
    assert_eq!(problems.len(), 1, "{problems:?}");
    for word in words {
        assert!(
            problems[0]["reason"].contains(word),
            "`{word}` is not said: {problems:?}"
        );
    }
    campaign
}

/// The flights of the table of channels with the samples of each.
fn lengths(campaign: &Campaign) -> Vec<(String, usize)> {
    let channels = campaign.table("channels");
    let clocks = channels.iter().filter(|r| r["channel"] == "time");
    clocks
        .map(|r| (r["flight_id"].clone(), r["samples"].parse().unwrap()))
        .collect()
}

#[test]
fn time_that_starts_anew_begins_a_stretch_and_is_reported_with_its_place() {
    let record = yaw_and_roll_steps();
    let back = with_values(
        &record,
        "time",
        |row, t| if row >= 1000 { t - 10.0 } else { t },
    );
    // Nothing is rejected.
    let campaign = is_repaired_and_named(
        &back,
        0,
        &["time jumps back from", "in row 1001 of ", "`spoiled.2`"],
    );
    let ids: Vec<String> = lengths(&campaign).into_iter().map(|l| l.0).collect();
    assert_eq!(ids, ["spoiled", "spoiled.2"]);
}

#[test]
fn time_out_of_order_or_started_anew_every_second_is_refused() {
    // Each row a third of the record after the one before, round and round: every row is there once.
    let out_of_order = with_values(&pitch_steps(), "time", |row, _| {
        (row * 1999 % 6007) as f64 * 0.025
    });
    let anew = with_values(&pitch_steps(), "time", |row, _| (row % 40) as f64 * 0.025);
    for record in [out_of_order, anew] {
        let words = [
            "time returns to times before it more than 512 times",
            "rows are out of order",
        ];
        record_is_refused(&record, "time", &words);
    }
}

#[test]
fn rows_with_a_time_that_cannot_be_are_left_out_and_named() {
    let record = yaw_and_roll_steps();
    let times = values(&record, "time");
    let still = with_values(
        &record,
        "time",
        |row, t| if row == 1000 { times[999] } else { t },
    );
    is_repaired_and_named(&still, 2, &["time stands still in 1 rows", "row 1001"]);
    let hole = with_values(
        &record,
        "time",
        |row, t| if row == 1000 { f64::NAN } else { t },
    );
    is_repaired_and_named(
        &hole,
        2,
        &["1 rows have a time that is not a number", "row 1001"],
    );
}

#[test]
fn a_copy_under_another_name_is_left_out_and_named() {
    let campaign = Campaign::of_pitch_steps();
    fs::copy(campaign.flight("flight_001"), campaign.flight("flight_002")).unwrap();
    // The same rows in a file of other bytes, and some of the rows alone.
    campaign.add("flight_003", &without(&pitch_steps(), "psi"));
    campaign.add("flight_004", &pitch_steps().slice(4000, 2000));
    campaign.ends("segment", 2);
    let problems = campaign.table("problems");
    let named: Vec<&str> = problems.iter().map(|p| &*p["flight_id"]).collect();
    assert_eq!(
        named,
        ["flight_003", "flight_002", "flight_003", "flight_004"],
        "{problems:?}"
    );
    assert!(
        problems[1]["reason"].contains("the same bytes as flight `flight_001`"),
        "{problems:?}"
    );
    assert!(
        problems[2]["reason"].contains("holds the rows of flight `flight_001` again"),
        "{problems:?}"
    );
    assert!(
        problems[3]["reason"].contains("holds the rows of flight `flight_001` again"),
        "{problems:?}"
    );
    assert_eq!(campaign.table("maneuvers").len(), 1);
}

#[test]
fn files_that_overlap_and_a_channel_at_another_rate_in_a_file_of_its_own_are_one_flight() {
    let (whole, parted) = (Campaign::of_pitch_steps(), Campaign::new());
    // Instruments are measured by fewer samples of the slow channel: what is wrong with them comes
    // out a little different.
    for campaign in [&whole, &parted] {
        campaign.copy_pipeline();
        campaign.edit(
            "pipeline.yaml",
            "bias: apply, scale: apply",
            "bias: report, scale: report",
        );
    }
    whole.ends("estimate", 0);
    let record = pitch_steps();
    let folder = parted.path("flights/flight=flight_001");
    fs::create_dir(&folder).unwrap();
    let main = without(&record, "psi");
    crate::support::write(&main.slice(0, 3000), &folder.join("a.parquet"));
    crate::support::write(
        &main.slice(2500, main.num_rows() - 2500),
        &folder.join("b.parquet"),
    );
    let every_fourth = arrow::array::UInt32Array::from_iter_values(
        (0..u32::try_from(record.num_rows()).unwrap()).step_by(4),
    );
    let slow = record.project(&[
        record.schema().index_of("time").unwrap(),
        record.schema().index_of("psi").unwrap(),
    ]);
    let slow = arrow::compute::take_record_batch(&slow.unwrap(), &every_fourth).unwrap();
    crate::support::write(&slow, &folder.join("heading.parquet"));
    parted.ends("estimate", 2);
    let problems = parted.table("problems");
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert!(
        problems[0]["place"].ends_with("b.parquet")
            && problems[0]["reason"].contains("are there already")
    );
    let channels = parted.table("channels");
    let rate = |name: &str| {
        crate::support::number(
            channels.iter().find(|c| c["channel"] == name).unwrap(),
            "rate_hz",
        )
    };
    assert!((rate("psi") - 10.0).abs() < 0.1 && (rate("theta") - 40.0).abs() < 0.1);
    crate::estimate::assert_same_estimates(&whole.table("estimates"), &parted.table("estimates"));
}

#[test]
fn memory_does_not_change_results() {
    let campaign = |memory: &str| {
        let campaign = Campaign::of_pitch_steps();
        campaign.copy_pipeline();
        campaign.edit("pipeline.yaml", "memory_mb: 200", memory);
        campaign.ends("segment", 0);
        (campaign.tables(), campaign.bytes("store"))
    };
    let (small, large) = (campaign("memory_mb: 1"), campaign("memory_mb: 4000"));
    assert_eq!(small.0, large.0);
    assert_eq!(small.1, large.1);
}

#[test]
fn a_stuck_surface_rejects_its_maneuver_with_the_reason() {
    let campaign = Campaign::new();
    let record = pitch_steps();
    let held = values(&record, "de")[4900];
    let stuck = with_values(&record, "de", |row, v| {
        if (4900..5100).contains(&row) { held } else { v }
    });
    campaign.add("flight_001", &stuck);
    campaign.ends("estimate", 2);
    let problems = campaign.table("problems");
    assert!(
        problems[0]["place"] == "channel `de`"
            && problems[0]["reason"].contains("its value is stuck"),
        "{problems:?}"
    );
    let fits = campaign.table("fits");
    let rejected = |f: &crate::support::Row| {
        f["outcome"] == "rejected" && f["reason"].contains("`de_deg` are marked")
    };
    assert!(fits.is_empty() || fits.iter().all(rejected), "{fits:?}");
}

#[test]
fn a_required_channel_without_any_number_is_refused() {
    record_is_refused(
        &with_values(&yaw_and_roll_steps(), "Iy", |_, _| f64::NAN),
        "channel `Iy`",
        &["`iy_slug_ft2`", "holds no number"],
    );
}

#[test]
fn a_channel_that_the_equations_can_do_without_is_reported_and_the_flight_goes_on() {
    let campaign = Campaign::new();
    campaign.add(
        "flight_001",
        &with_values(&pitch_steps(), "psi", |_, _| f64::NAN),
    );
    campaign.ends("estimate", 0);
    let problems = campaign.table("problems");
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert_eq!(problems[0]["place"], "channel `psi`");
    assert_eq!(campaign.table("fits")[0]["outcome"], "converged");
}

#[test]
fn an_archive_of_spoiled_flights_only_reports_the_fault_of_each() {
    let campaign = Campaign::new();
    fs::write(campaign.flight("one"), "").unwrap();
    fs::write(campaign.flight("two"), "text").unwrap();
    campaign.ends("run", 2);
    let named: Vec<String> = campaign
        .table("problems")
        .iter()
        .map(|p| p["flight_id"].clone())
        .collect();
    assert_eq!(named, ["one", "two"]);
    let report = fs::read_to_string(campaign.path("reports/report.html")).unwrap();
    assert!(
        report.contains("not a readable Parquet file"),
        "the report names what was refused"
    );
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
    campaign.add("spoiled", &spoiled);
    campaign.ends("ingest", 0);
    // A campaign of its own: the same rows twice in one would be left out.
    let healthy = Campaign::of_pitch_steps();
    healthy.ends("ingest", 0);
    let channels = [campaign.table("channels"), healthy.table("channels")].concat();
    let count = |flight: &str, column: &str| -> i64 {
        let theta = channels
            .iter()
            .find(|r| r["flight_id"] == flight && r["channel"] == "theta")
            .unwrap();
        theta[column].parse().unwrap()
    };
    assert_eq!(
        count("spoiled", "despiked") - count("flight_001", "despiked"),
        3
    );
    assert_eq!(
        count("spoiled", "bridged") - count("flight_001", "bridged"),
        5
    );
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
    crate::support::write(
        &record.slice(2000, record.num_rows() - 2000),
        &folder.join("part-1.parquet"),
    );
    parted.ends("segment", 0);
    // The jitter of the clock is about the step of the first file: a digit of it may differ.
    assert_eq!(parted.table("maneuvers"), whole.table("maneuvers"));
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
    other.edit(
        "aircraft.yaml",
        "velocity_ft_s, unit: ft/s }",
        "velocity_ft_s, unit: m/s }",
    );
    other.ends("estimate", 0);

    crate::estimate::assert_same_estimates(&shipped.table("estimates"), &other.table("estimates"));
}

#[cfg(unix)]
#[test]
fn no_name_of_a_file_stops_a_campaign_or_deceives_a_reader() {
    let campaign = Campaign::new();
    let record = pitch_steps();
    let long = "l".repeat(247);
    let names = [
        (long.as_str(), long.as_str()),
        ("a\u{1b}[31mb\u{202e}c", "a_[31mb_c"),
        ("=cmd|' calc'!A0", "_=cmd|' calc'!A0"),
        ("<&>\"'", "<&>\"'"),
    ];
    for (shift, (name, _)) in names.iter().enumerate() {
        // Other rows each: the same bytes would count once.
        let shifted = with_values(&record, "altitude", |_, v| v + 1.0 + shift as f64);
        campaign.add(name, &shifted.slice(100 * shift, 5400));
    }
    // The accelerometer is off in every flight, which is a problem of the campaign.
    let outcome = campaign.ends("run", 2);
    assert!(!outcome.stdout.contains('\u{1b}'), "{outcome:?}");
    let flights = campaign.table("flights");
    let ids: Vec<&str> = flights.iter().map(|row| &*row["flight_id"]).collect();
    let mut expected = names.map(|(_, id)| id);
    expected.sort_unstable();
    assert_eq!(ids, expected);
    assert_eq!(campaign.table("fits").len(), names.len());
    assert!(campaign.path("reports/report.pdf").is_file());
}

#[test]
fn an_archive_without_records_cannot_be_run() {
    let campaign = Campaign::new();
    let outcome = campaign.ends("run", 1);
    assert!(
        outcome.stderr.contains("no flight records here"),
        "{outcome:?}"
    );
    assert!(outcome.stderr.contains("flights"), "{outcome:?}");
    assert!(!campaign.path("reports").exists(), "nothing is published");
}

#[test]
fn an_archive_that_does_not_exist_cannot_be_run() {
    let campaign = Campaign::on("data/demo/fligths");
    let outcome = campaign.ends("ingest", 1);
    assert!(
        outcome
            .stderr
            .contains("data/demo/fligths: no flight records here"),
        "{outcome:?}"
    );
}

#[test]
fn one_flight_in_two_places_counts_once_and_is_reported() {
    let campaign = Campaign::of_pitch_steps();
    fs::create_dir(campaign.path("flights/copy")).unwrap();
    fs::copy(
        campaign.flight("flight_001"),
        campaign.path("flights/copy/flight_001.parquet"),
    )
    .unwrap();
    let outcome = campaign.ends("ingest", 2);
    assert!(
        outcome
            .stdout
            .contains("a copy of a file of flight `flight_001`"),
        "{outcome:?}"
    );
}
