//! Check and help: what the program says before it does anything.

use std::fs;
use std::process::Stdio;

use crate::support::{Campaign, harvest, run};

#[test]
fn help_lists_subcommands_examples_and_exit_codes() {
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
        "run", "ingest", "segment", "estimate", "model", "trend", "compare", "report", "check",
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
fn the_shipped_pipeline_is_valid_and_check_lists_what_it_uses() {
    let outcome = run(harvest().arg("check"));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    for word in [
        "data/demo/flights: 4 flights",
        "48 derivatives",
        "data/demo/wt_tables.csv",
        "The configuration is valid",
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
fn a_missing_pipeline_is_distinguished_from_a_wrong_one() {
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
fn a_command_that_harvest_does_not_have_ends_with_64() {
    let campaign = Campaign::of_pitch_steps();
    let mistakes = [
        (["--quite", "--quiet"], "unexpected argument '--quite'"),
        (["--threads", "0"], "it must be a whole number from 1"),
        (["--memory-mb", "NaN"], "it must lie between 1 and 1e9"),
    ];
    for (arguments, words) in mistakes {
        let outcome = run(campaign.command("run").args(arguments));
        assert_eq!(outcome.code, Some(64), "{outcome:?}");
        assert!(outcome.stderr.contains(words), "{outcome:?}");
    }
    assert!(!campaign.path("store").exists());
    let former = run(harvest().arg("simulate"));
    assert_eq!(former.code, Some(64), "{former:?}");
    let help = run(harvest().arg("--help"));
    assert_eq!((help.code, &*help.stderr), (Some(0), ""));
    assert!(help.stdout.contains("64 the command as typed is wrong"));
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_nobody_takes_ends_no_command_and_output_that_is_lost_is_named() {
    let campaign = Campaign::of_pitch_steps();
    let mut command = campaign.command("check");
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), &*output.stderr), (Some(0), &[][..]));

    let full = fs::OpenOptions::new().write(true).open("/dev/full");
    let mut command = campaign.command("check");
    let output = command.stdout(full.unwrap()).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(
        stderr.starts_with("harvest: cannot write the output: "),
        "{stderr}"
    );
}

#[test]
fn the_version_states_the_sources_that_the_lineage_states() {
    let outcome = run(harvest().arg("--version"));
    let version = outcome.stdout.trim();
    let (_, sources) = version.split_once("(sources ").unwrap();
    let sources = sources.trim_end_matches(')');
    assert_eq!(sources.len(), 16, "{version}");
    let lineage = &crate::support::demo().bytes;
    let parquet = lineage.iter().find(|(p, _)| p.ends_with("trends.parquet"));
    let (_, bytes) = parquet.unwrap();
    let has = bytes.windows(16).any(|window| window == sources.as_bytes());
    assert!(has, "{version}");
}

#[test]
fn manual_writes_a_page_for_every_command_and_completions() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(harvest().arg("manual").arg("--to").arg(folder.path()));
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    for page in [
        "harvest",
        "harvest-run",
        "harvest-show-flight",
        "harvest-lab-simulate",
    ] {
        let page = text(&format!("share/man/man1/{page}.1"));
        assert!(page.contains(".SH NAME"), "{page}");
    }
    assert!(text("share/man/man1/harvest-run.1").contains("wind\\-tunnel"));
    for shell in [
        "share/bash-completion/completions/harvest",
        "share/zsh/site-functions/_harvest",
        "share/fish/vendor_completions.d/harvest.fish",
    ] {
        let script = text(shell);
        assert!(script.contains("wind-tunnel"), "{shell}");
    }
    let bench = folder.path().join("share/man/man1/harvest-bench-case.1");
    assert!(!bench.exists(), "a hidden command has no page");
}
