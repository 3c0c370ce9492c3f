//! Show: strip charts of flights and maneuvers, and what is said where there is none.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use crate::support::{Campaign, Outcome, harvest, pitch_steps, run, values, with_values};

const MANEUVER: &str = "flight_001_t00118";

fn command(campaign: &Campaign, kind: &str, id: &str) -> Command {
    let mut command = harvest();
    command
        .args(["show", kind, id, "harv", "--archive"])
        .arg(campaign.path("flights"));
    command
        .arg("--store")
        .arg(campaign.path("store"))
        .arg("--reports")
        .arg(campaign.path("reports"));
    command
}

fn show(campaign: &Campaign, kind: &str, id: &str, code: i32) -> Outcome {
    let outcome = run(&mut command(campaign, kind, id));
    assert_eq!(outcome.code, Some(code), "{outcome:?}");
    outcome
}

fn picture(campaign: &Campaign, id: &str) -> PathBuf {
    campaign.path("reports/show").join(format!("{id}.svg"))
}

#[test]
fn a_flight_and_a_maneuver_are_drawn_and_a_second_run_changes_no_byte() {
    let campaign = Campaign::of_pitch_steps();
    let said = show(&campaign, "flight", "flight_001", 0).stdout;
    assert!(said.contains("show/flight_001.svg"), "{said}");
    let flight = fs::read_to_string(picture(&campaign, "flight_001")).unwrap();
    assert!(flight.contains(&format!("data-maneuver=\"{MANEUVER}\"")) && flight.len() < 1_000_000);
    assert!(
        !campaign.path("reports/fits.csv").exists(),
        "a flight needs no estimate"
    );

    show(&campaign, "maneuver", MANEUVER, 0);
    let maneuver = fs::read_to_string(picture(&campaign, MANEUVER)).unwrap();
    assert_eq!(maneuver.matches(">residual</text>").count(), 5);
    campaign.ends("segment", 0);
    let class = &campaign.table("maneuvers")[0]["class"];
    assert!(maneuver.contains(&format!("{class} {MANEUVER}")) && maneuver.contains("converged"));

    let changed = |id| {
        fs::metadata(picture(&campaign, id))
            .unwrap()
            .modified()
            .unwrap()
    };
    let before = (changed("flight_001"), changed(MANEUVER));
    show(&campaign, "flight", "flight_001", 0);
    show(&campaign, "maneuver", MANEUVER, 0);
    assert_eq!(
        (changed("flight_001"), changed(MANEUVER)),
        before,
        "a picture was written again"
    );
    assert_eq!(
        fs::read_to_string(picture(&campaign, MANEUVER)).unwrap(),
        maneuver
    );
}

#[test]
fn a_picture_is_written_where_it_is_asked_for_and_leaves_the_problems_alone() {
    let campaign = Campaign::of_pitch_steps();
    fs::write(campaign.flight("spoiled"), "text").unwrap();
    campaign.ends("run", 2);
    let before = campaign.tables();
    let out = campaign.path("elsewhere/f.svg");
    // The other flight is refused, but it is not what is shown.
    let outcome = run(command(&campaign, "flight", "flight_001")
        .arg("--out")
        .arg(&out));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    assert!(fs::read_to_string(out).unwrap().starts_with("<svg xmlns"));
    assert!(campaign.tables() == before);

    let refused = show(&campaign, "flight", "spoiled", 1).stderr;
    assert!(
        refused.contains("was refused") && refused.contains("not a readable Parquet file"),
        "{refused}"
    );
}

#[test]
fn what_does_not_exist_is_answered_with_what_was_probably_meant() {
    let campaign = Campaign::of_pitch_steps();
    let flight = show(&campaign, "flight", "flight_01", 1).stderr;
    assert!(
        flight.contains("no flight `flight_01`; did you mean `flight_001`?"),
        "{flight}"
    );
    assert!(
        !campaign.path("reports").exists(),
        "nothing is ingested for a flight that is not there"
    );
    let maneuver = show(&campaign, "maneuver", "flight_001_t00181", 1).stderr;
    assert!(
        maneuver.contains(&format!("did you mean `{MANEUVER}`?")),
        "{maneuver}"
    );
    let mistaken = show(&campaign, "maneuver", "flight_001", 1).stderr;
    assert!(
        mistaken.contains("harvest show flight flight_001"),
        "{mistaken}"
    );
    assert!(!campaign.path("reports/show").exists());
}

#[test]
fn a_rejected_maneuver_is_drawn_with_its_reason_and_its_missing_samples() {
    let record = pitch_steps();
    let time = values(&record, "time");
    let start = time[0];
    let is_lost = |row: usize| (124.0..129.0).contains(&(time[row] - start));
    let lost = with_values(
        &record,
        "ay",
        |row, v| if is_lost(row) { f64::NAN } else { v },
    );
    let lost = with_values(&lost, "q", |row, v| if is_lost(row) { f64::NAN } else { v });
    let lost = with_values(
        &lost,
        "theta",
        |row, v| if is_lost(row) { f64::NAN } else { v },
    );
    let lost = with_values(
        &lost,
        "an",
        |row, v| if is_lost(row) { f64::NAN } else { v },
    );
    let campaign = Campaign::new();
    campaign.add("flight_001", &lost);
    let outcome = show(&campaign, "maneuver", MANEUVER, 2);
    assert!(outcome.stdout.contains("rejected"), "{outcome:?}");
    let svg = fs::read_to_string(picture(&campaign, MANEUVER)).unwrap();
    assert!(svg.contains("class=\"mark missing\"") && !svg.contains(">residual</text>"));
}
