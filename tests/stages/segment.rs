//! Segment: what is found, and the analyst's events against it.

use std::fs;

use crate::support::{
    Campaign, Outcome, Row, demo, number, pitch_steps, run, values, with_values, without,
};

/// The classes flown in the demonstration campaign, by flight in the order of time: read off the
/// campaign's own list of what was flown, which is not part of this repository.
const FLOWN: [(&str, [&str; 9]); 4] = [
    (
        "flight_001",
        [
            "PPSS",
            "3211",
            "SSIMD_LAT",
            "OLON",
            "OLAT",
            "PPSS",
            "SSIMD_LAT",
            "SSIMD_LON",
            "PPSS",
        ],
    ),
    (
        "flight_002",
        [
            "PYRS", "OLON", "PYRS", "PYRSTV", "PPSSTV", "3211", "PYRSTV", "3211", "OLAT",
        ],
    ),
    (
        "flight_003",
        [
            "SSIMD_LON",
            "SSIMD_LAT",
            "SSIMD_LON",
            "PYRSTV",
            "3211",
            "PYRSTV",
            "SSIMD_LAT",
            "PPSSTV",
            "PPSSTV",
        ],
    ),
    (
        "flight_004",
        [
            "PYRS",
            "OLAT",
            "OLON",
            "PPSS",
            "OLON",
            "OLAT",
            "PYRS",
            "SSIMD_LON",
            "PPSSTV",
        ],
    ),
];

#[test]
fn every_maneuver_of_the_demonstration_is_found_with_its_class_and_no_other() {
    let maneuvers = &demo().tables["maneuvers"];
    for (flight, classes) in FLOWN {
        let found: Vec<&str> = maneuvers
            .iter()
            .filter(|m| m["flight_id"] == flight)
            .map(|m| m["class"].as_str())
            .collect();
        assert_eq!(found, classes, "{flight}");
    }
    assert_eq!(maneuvers.len(), 36);
}

#[test]
fn starts_and_ends_are_those_flown_within_half_a_second() {
    // From the campaign's list of what was flown: first, middle and last of each flight's kind.
    for (id, start_s, end_s) in [
        ("flight_001_t00118", 118.775, 132.5125),
        ("flight_001_t01156", 1156.7125, 1187.7875),
        ("flight_002_t00411", 411.025, 431.25),
        ("flight_003_t00204", 204.5375, 228.4625),
        ("flight_004_t00809", 809.9, 820.5125),
    ] {
        let maneuver = demo().tables["maneuvers"]
            .iter()
            .find(|m| m["maneuver_id"] == id)
            .unwrap();
        assert!(
            (number(maneuver, "start_s") - start_s).abs() < 0.5,
            "{maneuver:?}"
        );
        assert!(
            (number(maneuver, "end_s") - end_s).abs() < 0.5,
            "{maneuver:?}"
        );
    }
}

fn with_events(campaign: &Campaign, events: &str) -> Outcome {
    let path = campaign.path("events.csv");
    fs::write(&path, format!("flight_id,class,start_s,end_s\n{events}")).unwrap();
    run(campaign.command("segment").arg("--events").arg(path))
}

fn verdicts(campaign: &Campaign) -> Vec<String> {
    campaign
        .table("events")
        .iter()
        .map(|e| e["verdict"].clone())
        .collect()
}

fn only_maneuver(campaign: &Campaign) -> Row {
    let maneuvers = campaign.table("maneuvers");
    assert_eq!(maneuvers.len(), 1, "{maneuvers:?}");
    maneuvers.into_iter().next().unwrap()
}

#[test]
fn the_analyst_s_event_takes_precedence_and_agrees_with_what_was_found() {
    let campaign = Campaign::of_pitch_steps();
    let outcome = with_events(&campaign, "flight_001,PPSS,119.3,132.0\n");
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let maneuver = only_maneuver(&campaign);
    assert_eq!(maneuver["origin"], "given");
    assert!(
        (number(&maneuver, "start_s") - 119.3).abs() < 0.03,
        "{maneuver:?}"
    );
    assert!(
        (number(&maneuver, "end_s") - 132.0).abs() < 0.03,
        "{maneuver:?}"
    );
    assert_eq!(verdicts(&campaign), ["agrees"]);
    let event = &campaign.table("events")[0];
    assert_eq!(event["found_class"], "PPSS");
    assert!(
        (number(event, "found_start_s") - 118.8).abs() < 0.5,
        "{event:?}"
    );
}

#[test]
fn an_event_of_another_class_or_at_other_times_takes_precedence_and_has_its_own_verdict() {
    let campaign = Campaign::of_pitch_steps();
    with_events(&campaign, "flight_001,PPSSTV,118.8,132.5\n");
    assert_eq!(only_maneuver(&campaign)["class"], "PPSSTV");
    assert_eq!(verdicts(&campaign), ["other class"]);
    with_events(&campaign, "flight_001,PPSS,122,132.5\n");
    assert_eq!(only_maneuver(&campaign)["class"], "PPSS");
    assert_eq!(verdicts(&campaign), ["other times"]);
}

#[test]
fn events_not_found_and_maneuvers_not_given_are_both_kept_and_reported() {
    let campaign = Campaign::of_pitch_steps();
    with_events(&campaign, "flight_001,PYRS,40,55\n");
    assert_eq!(verdicts(&campaign), ["not found", "not given"]);
    let origins: Vec<String> = campaign
        .table("maneuvers")
        .iter()
        .map(|m| m["origin"].clone())
        .collect();
    assert_eq!(origins, ["given", "found"]);
}

#[test]
fn an_event_that_no_record_holds_is_a_problem() {
    let campaign = Campaign::of_pitch_steps();
    let outcome = with_events(
        &campaign,
        "flight_009,PPSS,10,20\nflight_001,PPSS,5000,5020\n",
    );
    assert_eq!(outcome.code, Some(2), "{outcome:?}");
    let problems = campaign.table("problems");
    assert_eq!(problems.len(), 2, "{problems:?}");
    let of = |flight: &str| problems.iter().find(|p| p["flight_id"] == flight).unwrap();
    assert!(
        of("flight_009")["reason"].contains("the archive has no such flight"),
        "{problems:?}"
    );
    assert!(
        of("flight_001")["reason"].contains("is not inside the record"),
        "{problems:?}"
    );
    assert_eq!(only_maneuver(&campaign)["origin"], "found");
}

#[test]
fn an_event_of_an_unknown_class_stops_the_run_with_its_line() {
    let campaign = Campaign::of_pitch_steps();
    let outcome = with_events(&campaign, "flight_001,PPS,118.8,132.5\n");
    assert_eq!(outcome.code, Some(1));
    assert!(
        outcome
            .stderr
            .contains("events.csv:2: unknown class `PPS`; did you mean `PPSS`?"),
        "{outcome:?}"
    );
}

#[test]
fn a_class_under_another_name_is_a_matter_of_its_file() {
    let shipped = Campaign::of_pitch_steps();
    shipped.ends("estimate", 0);
    let other = Campaign::of_pitch_steps();
    other.copy_pipeline();
    fs::rename(
        other.path("pipeline/maneuvers/ppss.yaml"),
        other.path("pipeline/maneuvers/stick.yaml"),
    )
    .unwrap();
    other.edit("maneuvers/stick.yaml", "class: PPSS", "class: STICK");
    other.edit(
        "pipeline.yaml",
        "classes: [PPSS, PPSSTV]",
        "classes: [STICK, PPSSTV]",
    );
    other.ends("estimate", 0);
    assert_eq!(only_maneuver(&other)["class"], "STICK");
    let plain = |campaign: &Campaign| -> Vec<Row> {
        let mut rows = campaign.table("estimates");
        for row in &mut rows {
            row.remove("class");
        }
        rows
    };
    assert_eq!(plain(&other), plain(&shipped));
}

/// The demonstration's flight with a sweep of the stabilator instead of the pilot's steps, between
/// them and the next maneuver.
fn with_a_sweep() -> arrow::array::RecordBatch {
    let record = pitch_steps();
    let start = values(&record, "time")[0];
    let sine = |row: usize| {
        let t = row as f64 / 40.0 - 20.0;
        let swept = (0.0..=30.0).contains(&t);
        if swept {
            5.0 * (std::f64::consts::TAU * (0.2 * t + 0.025 * t * t)).sin()
        } else {
            0.0
        }
    };
    let quiet = |row: usize| (19.0..52.0).contains(&(row as f64 / 40.0));
    assert!(start < 1.0, "the flight's clock begins with it");
    let held = |channel: &str| {
        let all = values(&record, channel);
        all[20 * 40]
    };
    let (de, stick, pedal, lateral) = (
        held("de"),
        held("stick_pitch"),
        held("pedal"),
        held("stick_lat"),
    );
    let swept = with_values(
        &record,
        "de",
        |row, v| if quiet(row) { de + sine(row) } else { v },
    );
    let swept = with_values(
        &swept,
        "stick_pitch",
        |row, v| if quiet(row) { stick } else { v },
    );
    let swept = with_values(&swept, "pedal", |row, v| if quiet(row) { pedal } else { v });
    with_values(
        &swept,
        "stick_lat",
        |row, v| if quiet(row) { lateral } else { v },
    )
}

#[test]
fn a_new_class_a_frequency_sweep_is_a_matter_of_yaml() {
    let campaign = Campaign::new();
    campaign.add("flight_001", &with_a_sweep());
    campaign.copy_pipeline();
    let olon = fs::read_to_string(campaign.path("pipeline/maneuvers/olon.yaml")).unwrap();
    let (head, rest) = olon.split_once("recognise:").unwrap();
    let (_, rest) = rest.split_once("# Table 1").unwrap();
    let head = head.replace("class: OLON", "class: SWEEP");
    let rule = "recognise:\n  flags: {obes: true}\n  sweep: {de_deg: {at_least: 12, ratio: 2}}\n  steps: {dtef_deg: {at_most: 2}}\n  \
                lead_in_s: 1\n  decay_s: 2.4\n\n# Table 1";
    fs::write(
        campaign.path("pipeline/maneuvers/sweep.yaml"),
        format!("{head}{rule}{rest}"),
    )
    .unwrap();
    campaign.harvest("segment");
    let maneuvers = campaign.table("maneuvers");
    let classes: Vec<&str> = maneuvers.iter().map(|m| m["class"].as_str()).collect();
    assert_eq!(classes, ["SWEEP", "PPSS"], "{maneuvers:?}");
    assert!(
        (number(&maneuvers[0], "start_s") - 19.0).abs() < 0.7,
        "{maneuvers:?}"
    );
    assert!(
        (number(&maneuvers[0], "end_s") - 52.4).abs() < 0.7,
        "{maneuvers:?}"
    );
    assert!(
        maneuvers[0]["evidence"].contains("times as fast"),
        "{maneuvers:?}"
    );
}

#[test]
fn without_its_flags_a_flight_has_the_same_maneuvers_and_a_problem() {
    let campaign = Campaign::new();
    campaign.add(
        "flight_001",
        &without(&without(&pitch_steps(), "obes"), "tvcs"),
    );
    campaign.harvest("segment");
    let maneuver = only_maneuver(&campaign);
    assert_eq!(
        (maneuver["class"].as_str(), maneuver["verdict"].as_str()),
        ("PPSS", "accepted")
    );
    assert!(
        (number(&maneuver, "start_s") - 118.8).abs() < 0.3,
        "{maneuver:?}"
    );
    assert!(number(&maneuver, "confidence") < 1.0, "{maneuver:?}");
    assert!(
        campaign
            .table("problems")
            .iter()
            .any(|p| p["place"] == "obes")
    );
}

#[test]
fn a_rejected_maneuver_stays_in_the_table_with_its_reason_and_is_not_estimated() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    campaign.edit(
        "pipeline.yaml",
        "signal_to_noise: 5",
        "signal_to_noise: 5000",
    );
    campaign.ends("estimate", 2);
    let maneuver = only_maneuver(&campaign);
    assert_eq!(maneuver["verdict"], "rejected");
    assert!(
        maneuver["reason"].contains("times its noise (limit 5000)"),
        "{maneuver:?}"
    );
    let fit = &campaign.table("fits")[0];
    assert_eq!(
        (fit["outcome"].as_str(), &fit["reason"]),
        ("rejected", &maneuver["reason"])
    );
    assert!(
        campaign
            .table("estimates")
            .iter()
            .all(|e| e["bound"].is_empty())
    );
}

#[test]
fn a_maneuver_that_fits_no_class_is_a_problem_with_its_time() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    fs::remove_file(campaign.path("pipeline/maneuvers/ppss.yaml")).unwrap();
    campaign.edit(
        "pipeline.yaml",
        "classes: [PPSS, PPSSTV]",
        "classes: [PPSSTV]",
    );
    campaign.ends("segment", 2);
    assert!(campaign.table("maneuvers").is_empty());
    let problems = campaign.table("problems");
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert!(
        problems[0]["place"].contains("11") || problems[0]["place"].contains("12"),
        "{problems:?}"
    );
    let unknown = campaign.table("unknown");
    assert_eq!(unknown.len(), 1);
    assert!(
        (number(&unknown[0], "start_s") - 119.8).abs() < 0.3,
        "{unknown:?}"
    );
    assert!(
        (number(&unknown[0], "end_s") - 130.0).abs() < 1.0,
        "{unknown:?}"
    );
    assert_eq!(unknown[0]["nearest_class"], "PPSSTV");
    assert!(
        unknown[0]["reason"].contains("dpv_deg does not move"),
        "{unknown:?}"
    );
}

#[test]
fn an_event_given_again_or_beside_itself_counts_once() {
    let campaign = Campaign::of_pitch_steps();
    let estimated = |events: &str| {
        let path = campaign.path("events.csv");
        fs::write(&path, format!("flight_id,class,start_s,end_s\n{events}")).unwrap();
        let outcome = run(campaign.command("estimate").arg("--events").arg(path));
        let tables = ["maneuvers", "fits", "estimates", "events"].map(|name| campaign.table(name));
        (outcome.code, tables)
    };
    let event = "flight_001,PPSS,118.8,132.5\n";
    let once = estimated(event);
    assert_eq!((once.0, once.1[1].len()), (Some(0), 1));
    let (code, tables) = estimated(&format!("{event}{event}flight_001,PPSS,119.4,133\n"));
    assert_eq!((code, tables), (Some(2), once.1));
    let problems = campaign.table("problems");
    assert_eq!(problems.len(), 2, "{problems:?}");
    for problem in problems {
        assert!(
            problem["reason"].contains("samples count once; it is left out"),
            "{problem:?}"
        );
    }
    // Events of both axes may share samples; their ids differ.
    estimated(&format!("{event}flight_001,PYRS,118.8,132.5\n"));
    let ids = campaign.table("maneuvers").into_iter();
    let ids: Vec<String> = ids.map(|row| row["maneuver_id"].clone()).collect();
    assert_eq!(ids, ["flight_001_t00118", "flight_001_t00118.2"]);
}
