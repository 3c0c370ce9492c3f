//! Check and help: what the program says before it does anything.

use std::fs;

use crate::support::{Campaign, harvest, run};

#[test]
fn help_teaches_subcommands_examples_and_exit_codes() {
    let outcome = run(harvest().arg("--help"));
    assert_eq!(outcome.code, Some(0));
    for word in [
        "run",
        "ingest",
        "segment",
        "estimate",
        "trend",
        "compare",
        "report",
        "check",
        "Examples:",
        "harvest run",
        "Exit codes:",
        "could not run",
        "something was rejected",
    ] {
        assert!(
            outcome.stdout.contains(word),
            "`{word}` is not in\n{}",
            outcome.stdout
        );
    }
}

#[test]
fn every_subcommand_explains_its_options() {
    for stage in [
        "run", "ingest", "segment", "estimate", "trend", "compare", "report", "check",
    ] {
        let outcome = run(harvest().args([stage, "--help"]));
        assert_eq!(outcome.code, Some(0), "{stage}");
        for option in [
            "--archive",
            "--wind-tunnel",
            "--events",
            "--store",
            "--reports",
            "--threads",
            "--memory-mb",
            "[PIPELINE]",
        ] {
            assert!(outcome.stdout.contains(option), "{stage}: {option}");
        }
    }
}

#[test]
fn the_shipped_pipeline_is_right_and_says_what_it_would_do() {
    let outcome = run(harvest().arg("check"));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    for word in [
        "data/demo/flights: 4 flights",
        "48 derivatives",
        "data/demo/wt_tables.csv",
        "The configuration is right",
    ] {
        assert!(
            outcome.stdout.contains(word),
            "`{word}` is not in\n{}",
            outcome.stdout
        );
    }
    for class in [
        "SSIMD_LON",
        "OLON",
        "3211",
        "PPSS",
        "PPSSTV",
        "SSIMD_LAT",
        "OLAT",
        "PYRS",
        "PYRSTV",
    ] {
        assert!(
            outcome.stdout.contains(&format!("  {class:<10} ")),
            "{class}"
        );
    }
}

#[test]
fn a_check_writes_nothing() {
    let campaign = Campaign::of_pitch_steps();
    campaign.ends("check", 0);
    assert!(!campaign.path("store").exists());
    assert!(!campaign.path("reports").exists());
}

#[test]
fn a_typo_in_yaml_stops_with_file_line_and_what_was_meant() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    let line = campaign.edit("pipeline.yaml", "longest_bridge_s:", "longest_brige_s:");
    for stage in ["check", "run"] {
        let outcome = campaign.ends(stage, 1);
        assert!(
            outcome.stderr.contains(&format!("pipeline.yaml:{line}: ")),
            "{outcome:?}"
        );
        assert!(
            outcome.stderr.contains("did you mean `longest_bridge_s`?"),
            "{outcome:?}"
        );
    }
    assert!(
        !campaign.path("reports").exists(),
        "nothing is done before all is checked"
    );
}

#[test]
fn a_pipeline_that_does_not_exist_is_told_from_one_that_is_wrong() {
    let outcome = run(harvest().args(["check", "havr"]));
    assert_eq!(outcome.code, Some(1));
    assert!(
        outcome.stderr.contains("there is no pipeline havr"),
        "{outcome:?}"
    );
    assert!(outcome.stderr.contains("pipelines/"), "{outcome:?}");
}

#[test]
fn a_tunnel_table_that_does_not_exist_is_named() {
    let outcome = run(harvest().args(["check", "--wind-tunnel", "data/no.csv"]));
    assert_eq!(outcome.code, Some(1));
    assert!(
        outcome.stderr.contains("data/no.csv: cannot read it"),
        "{outcome:?}"
    );
}

#[test]
fn a_check_sees_an_archive_without_flights() {
    let campaign = Campaign::new();
    let outcome = campaign.ends("check", 1);
    assert!(
        outcome.stderr.contains("no flight records here"),
        "{outcome:?}"
    );
}

#[test]
fn no_threads_are_too_few() {
    let campaign = Campaign::of_pitch_steps();
    let outcome = run(campaign.command("ingest").args(["--threads", "0"]));
    assert_eq!(outcome.code, Some(1));
    assert!(outcome.stderr.contains("at least 1"), "{outcome:?}");
    assert!(fs::read_dir(campaign.path("flights")).unwrap().count() == 1);
}
