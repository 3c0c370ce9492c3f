//! Nights: after any disturbance the next run ends with the same bytes. Publication changes at once,
//! with lineage and differences, and `gc` removes nothing that it needs.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::support::{
    Campaign, Outcome, Random, both_axes, files, flight, from_environment, pitch_steps, run,
    yaw_and_roll_steps,
};

/// Every file of store and reports with its bytes, but those that hold a clock or a process.
fn bytes_without_locks(campaign: &Campaign) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = campaign.bytes("store");
    let nights = campaign.path("reports/nights");
    let kept = files(&nights).into_iter().filter(|p| !p.ends_with("lock"));
    all.extend(kept.map(|p| {
        (
            p.strip_prefix(campaign.path("")).unwrap().to_owned(),
            fs::read(&p).unwrap(),
        )
    }));
    all.extend(campaign.bytes("reports"));
    let current = fs::read_link(campaign.path("reports/current")).unwrap();
    all.insert(
        "current".into(),
        current.to_string_lossy().into_owned().into_bytes(),
    );
    all
}

fn differing(a: &BTreeMap<PathBuf, Vec<u8>>, b: &BTreeMap<PathBuf, Vec<u8>>) -> Vec<PathBuf> {
    a.keys()
        .chain(b.keys())
        .filter(|path| a.get(*path) != b.get(*path))
        .cloned()
        .collect()
}

fn spawned(campaign: &Campaign) -> std::process::Child {
    campaign
        .command("run")
        .arg("--quiet")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Two nights, the second with one flight more. Before each ends, `disturb` may do something to it.
fn two_nights(campaign: &Campaign, mut disturb: impl FnMut(&Campaign)) {
    campaign.add("flight_001", &pitch_steps());
    disturb(campaign);
    campaign.finishes("run");
    campaign.add("flight_004", &yaw_and_roll_steps());
    disturb(campaign);
    campaign.finishes("run");
}

/// Two undisturbed nights, with the artefacts of both flights in the store from the beginning.
fn two_published_nights() -> Campaign {
    let campaign = Campaign::new();
    both_axes().fill_store(&campaign);
    two_nights(&campaign, |_| {});
    campaign
}

/// In the suite a few kills; `make torture` does many.
#[test]
fn after_kills_at_any_moment_a_run_ends_with_the_same_bytes() {
    let campaign = Campaign::new();
    let begun = Instant::now();
    two_nights(&campaign, |_| {});
    // A run of either night takes about half of it; kills may come when it is over, too.
    let longest = begun.elapsed().mul_f64(0.6);
    let (expected, wanted) = (
        bytes_without_locks(&campaign),
        from_environment("HARVEST_KILLS", 12),
    );
    let (mut random, mut kills, mut hit) = (Random::new(0x5eed), 0, 0);
    while kills < wanted {
        campaign.forget();
        fs::remove_file(campaign.flight("flight_004")).unwrap();
        two_nights(&campaign, |campaign| {
            for _ in 0..3 {
                let mut child = spawned(campaign);
                // Squared, so that early moments, and those of later nights that are short, are as
                // often hit as others.
                std::thread::sleep(longest.mul_f64(random.unit().powi(2)));
                hit += usize::from(child.try_wait().unwrap().is_none());
                child.kill().unwrap();
                child.wait().unwrap();
                kills += 1;
            }
        });
        let differing = differing(&bytes_without_locks(&campaign), &expected);
        assert!(differing.is_empty(), "after {kills} kills: {differing:?}");
    }
    assert!(hit > wanted / 4, "{hit} of {kills} kills came while it ran");
}

#[test]
fn a_second_run_at_once_names_the_first_and_ends_or_waits() {
    let campaign = Campaign::new();
    campaign.add("flight_001", &flight(1, 300));
    let mut first = spawned(&campaign);
    let patience = Instant::now() + Duration::from_mins(1);
    while !fs::read_to_string(campaign.path("store/lock")).is_ok_and(|text| text.contains("pid")) {
        assert!(Instant::now() < patience, "the first run has taken no lock");
        std::thread::sleep(Duration::from_millis(1));
    }
    let second = campaign.harvest("run");
    let waited = run(campaign.command("run").args(["--wait", "120"]));
    assert!(first.wait().unwrap().code().is_some_and(|code| code != 1));
    assert_ne!(waited.code, Some(1), "{waited:?}");
    assert_eq!(second.code, Some(1), "{second:?}");
    let named = format!("another run is using this store (pid {} on ", first.id());
    assert!(
        second.stderr.contains(&named) && second.stderr.contains(" since 20"),
        "{second:?}"
    );
}

#[test]
fn the_lock_of_a_dead_process_does_not_block_a_run() {
    let campaign = Campaign::of_pitch_steps();
    let mut child = spawned(&campaign);
    let patience = Instant::now() + Duration::from_mins(1);
    while !campaign.path("store/lock").exists() && Instant::now() < patience {
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(campaign.path("store/lock").exists());
    campaign.finishes("run");
}

#[test]
fn runs_started_together_leave_one_valid_store() {
    let campaign = Campaign::of_pitch_steps();
    campaign.finishes("run");
    let expected = bytes_without_locks(&campaign);
    campaign.forget();
    let mut racing: Vec<_> = (0..4)
        .map(|_| {
            campaign
                .command("run")
                .args(["--quiet", "--wait", "120"])
                .spawn()
                .unwrap()
        })
        .collect();
    for child in &mut racing {
        assert_eq!(child.wait().unwrap().code(), Some(0));
    }
    let differing = differing(&bytes_without_locks(&campaign), &expected);
    assert!(differing.is_empty(), "{differing:?}");
}

/// The program in a shell in which no file may become larger than this: as on a disk that is full.
#[cfg(unix)]
fn with_room_for(campaign: &Campaign, kilobytes: u32) -> Outcome {
    let command = campaign.command("run");
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    let words: Vec<String> = words
        .map(|word| format!("'{}'", word.to_string_lossy()))
        .collect();
    let script = format!("ulimit -f {}; exec {}", 2 * kilobytes, words.join(" "));
    run(Command::new("sh")
        .arg("-c")
        .arg(script)
        .current_dir(env!("CARGO_MANIFEST_DIR")))
}

#[cfg(unix)]
#[test]
fn a_full_disk_ends_with_a_message_and_a_valid_store() {
    let campaign = Campaign::of_pitch_steps();
    campaign.finishes("run");
    let expected = bytes_without_locks(&campaign);
    let largest = |folder: &str| {
        files(&campaign.path(folder))
            .iter()
            .map(|p| fs::metadata(p).unwrap().len())
            .max()
            .unwrap_or_default()
            / 1000
    };
    // Nothing fits; the records do not; the report does not.
    let rooms = [
        1,
        largest("store/records") / 2,
        largest("reports/nights") / 2,
    ];
    for room in rooms {
        campaign.forget();
        let outcome = with_room_for(&campaign, u32::try_from(room).unwrap());
        assert_eq!(outcome.code, Some(1), "{room} kB: {outcome:?}");
        assert!(
            outcome.stderr.contains("cannot write") && outcome.stderr.lines().count() == 1,
            "{outcome:?}"
        );
        assert!(!campaign.path("reports/report.html").exists());
        campaign.finishes("run");
        let differing = differing(&bytes_without_locks(&campaign), &expected);
        assert!(differing.is_empty(), "{room} kB: {differing:?}");
    }
    // What is published stays where there is no room for more.
    campaign.add("flight_004", &yaw_and_roll_steps());
    let published = campaign.bytes("reports");
    assert_eq!(with_room_for(&campaign, 8).code, Some(1));
    assert!(campaign.bytes("reports") == published);
}

#[cfg(unix)]
#[test]
fn a_read_only_folder_ends_with_a_message() {
    use std::os::unix::fs::PermissionsExt;
    let campaign = Campaign::of_pitch_steps();
    for folder in ["store", "reports"] {
        let path = campaign.path(folder);
        fs::create_dir_all(&path).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o555)).unwrap();
        let is_superuser = fs::write(path.join("probe"), "").is_ok();
        if !is_superuser {
            let outcome = campaign.ends("run", 1);
            assert!(
                outcome.stderr.contains(folder) && outcome.stderr.contains("cannot create"),
                "{outcome:?}"
            );
        }
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        let _ = fs::remove_file(path.join("probe"));
    }
    campaign.finishes("run");
}

#[test]
fn a_missing_or_irregular_file_is_a_problem_of_its_flight() {
    let campaign = Campaign::of_pitch_steps();
    #[cfg(unix)]
    std::os::unix::fs::symlink("nowhere", campaign.flight("flight_002")).unwrap();
    campaign.ends("ingest", 2);
    let problems = campaign.table("problems");
    assert_eq!(
        (problems.len(), &*problems[0]["flight_id"]),
        (1, "flight_002")
    );
    assert!(
        problems[0]["reason"].contains("cannot be read"),
        "{problems:?}"
    );
    fs::remove_file(campaign.flight("flight_002")).unwrap();
    campaign.ends("ingest", 0);
}

#[test]
fn a_copy_of_a_flight_is_rejected_until_its_rows_differ() {
    let campaign = Campaign::of_pitch_steps();
    fs::copy(campaign.flight("flight_001"), campaign.flight("flight_002")).unwrap();
    campaign.ends("segment", 2);
    assert!(
        campaign.table("problems")[0]["reason"].contains("the same bytes as flight `flight_001`")
    );
    assert_eq!(campaign.table("maneuvers").len(), 1);
    fs::create_dir(campaign.path("flights/again")).unwrap();
    fs::copy(
        campaign.flight("flight_001"),
        campaign.path("flights/again/flight_001.parquet"),
    )
    .unwrap();
    campaign.add("flight_002", &yaw_and_roll_steps());
    campaign.ends("segment", 2);
    assert!(
        campaign.table("problems")[0]["reason"].contains("a copy of a file of flight `flight_001`")
    );
    assert_eq!(campaign.table("maneuvers").len(), 2);
    campaign.add("again/flight_001", &yaw_and_roll_steps());
    campaign.ends("segment", 2);
    assert!(
        campaign
            .table("problems")
            .iter()
            .any(|p| p["reason"].contains("two records would be flight"))
    );
}

#[test]
fn the_report_lists_changes_with_causes_and_diff_ends_with_its_exit_code() {
    let campaign = two_published_nights();
    let said = campaign.ends("diff", 0).stdout;
    assert!(
        said.contains("night 0002 since night 0001") && said.contains("new flight flight_004"),
        "{said}"
    );
    assert!(said.contains("new flight_004_t00124"), "{said}");
    let report = fs::read_to_string(campaign.path("reports/report.html")).unwrap();
    assert!(
        report.contains("Changes since the previous night")
            && report.contains("new flight flight_004")
    );
    let alert: Value =
        serde_json::from_slice(&fs::read(campaign.path("reports/alert.json")).unwrap()).unwrap();
    assert_eq!(
        (&alert["since"], &alert["alert"]),
        (&"0001".into(), &false.into())
    );

    // Coefficients are by wing area: a tenth more of it is more than any bound.
    campaign.copy_pipeline();
    campaign.edit("aircraft.yaml", "wing_area_ft2: 400", "wing_area_ft2: 440");
    campaign.finishes("run");
    let outcome = campaign.harvest("diff");
    assert_eq!(outcome.code, Some(3), "{outcome:?}");
    let why = "configuration aircraft.wing_area_ft2: 400.0 became 440.0";
    assert!(outcome.stdout.contains(why), "{outcome:?}");
    let json = run(campaign.command("diff").arg("--json")).stdout;
    let changes: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(changes["alert"], true);
    assert!(
        changes["estimates"][0]["because"]
            .as_str()
            .unwrap()
            .contains("wing_area_ft2")
    );

    assert_eq!(run(campaign.command("diff").arg("--once")).code, Some(3));
    assert_eq!(run(campaign.command("diff").arg("--once")).code, Some(0));
    assert_eq!(
        run(campaign.command("diff").args(["--since", "1", "--to", "2"])).code,
        Some(0)
    );
    assert_eq!(
        run(campaign.command("diff").args(["--since", "77"])).code,
        Some(1)
    );
}

#[test]
fn status_lists_stale_artefacts_with_reasons_and_changes_nothing() {
    let campaign = Campaign::of_pitch_steps();
    let before = campaign.ends("status", 3).stdout;
    assert!(
        before.contains("no night is published yet") && before.contains("not made yet"),
        "{before}"
    );
    assert!(!campaign.path("store").exists() && !campaign.path("reports").exists());
    campaign.finishes("run");
    let fresh = campaign.ends("status", 0).stdout;
    assert!(fresh.contains("night 0001 is published"), "{fresh}");
    campaign.add("flight_004", &yaw_and_roll_steps());
    fs::write(campaign.flight("spoiled"), "text").unwrap();
    let stale = campaign.ends("status", 3).stdout;
    assert!(
        stale.contains("ingest: stale: flight_004: new flight flight_004"),
        "{stale}"
    );
    campaign.ends("run", 2);
    let failed = campaign.ends("status", 2).stdout;
    assert!(failed.contains("ingest: failed: spoiled"), "{failed}");
    campaign.copy_pipeline();
    campaign.edit(
        "pipeline.yaml",
        "initial_state: estimated",
        "initial_state: measured",
    );
    let stale = campaign.ends("status", 3).stdout;
    assert!(
        stale.contains("estimate: stale") && stale.contains("estimate.initial_state"),
        "{stale}"
    );
    assert!(!stale.contains("segment: stale"), "{stale}");
}

#[test]
fn a_damaged_manifest_is_named_as_damaged() {
    let campaign = Campaign::of_pitch_steps();
    campaign.ends("ingest", 0);
    fs::write(campaign.path("reports/nights/0001/night.json"), "{").unwrap();
    let outcome = campaign.harvest("status");
    assert!(
        outcome
            .stdout
            .starts_with("night 0001 is damaged: its night.json"),
        "{outcome:?}"
    );
    let since = run(campaign.command("diff").args(["--since", "1"]));
    for outcome in [campaign.ends("verify", 1), campaign.ends("diff", 1)] {
        assert!(
            outcome.stderr.contains("night 0001 is damaged"),
            "{outcome:?}"
        );
    }
    assert_eq!(since.code, Some(1), "{since:?}");
    campaign.ends("ingest", 0);
    assert!(
        campaign
            .harvest("status")
            .stdout
            .starts_with("night 0002 is published")
    );
}

#[test]
fn explain_prints_origin_fit_and_dependencies_of_a_maneuver() {
    let campaign = Campaign::of_pitch_steps();
    campaign.finishes("run");
    let explain = |id: &str| {
        let mut command = crate::support::harvest();
        command
            .args(["explain", id, "harv", "--archive"])
            .arg(campaign.path("flights"));
        run(command
            .arg("--store")
            .arg(campaign.path("store"))
            .arg("--reports")
            .arg(campaign.path("reports")))
    };
    let story = explain("flight_001_t00118");
    assert_eq!(story.code, Some(0), "{story:?}");
    for word in [
        "flight_001.parquet",
        "found in the record",
        "samples",
        "outcome",
        "converged",
        "iterations",
        "held",
        "inactive",
        "Correlations beyond 0.9",
        "condition number",
        "flight_001_t00118-",
        "methods",
    ] {
        assert!(story.stdout.contains(word), "{word}: {}", story.stdout);
    }
    let wrong = explain("flight_001_t00181");
    assert_eq!(wrong.code, Some(1));
    assert!(
        wrong.stderr.contains("did you mean `flight_001_t00118`?"),
        "{wrong:?}"
    );
}

#[test]
fn a_command_that_needs_a_night_reports_that_none_is_published() {
    let campaign = Campaign::of_pitch_steps();
    for command in ["verify", "diff"] {
        let outcome = campaign.ends(command, 1);
        let words = "no night has been published here yet; `harvest run` publishes one";
        assert!(outcome.stderr.contains(words), "{outcome:?}");
    }
}

#[test]
fn published_tables_carry_their_lineage_and_verify_checks_it() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    campaign.finishes("run");
    assert!(
        campaign
            .ends("verify", 0)
            .stdout
            .contains("The night is valid.")
    );

    // A setting that only trends read: what comes before them still holds.
    campaign.edit("pipeline.yaml", "criterion: aicc", "criterion: bic");
    let said = campaign.ends("verify", 2).stdout;
    let of = |table: &str| {
        said.lines()
            .find(|l| l.trim_start().starts_with(&format!("{table}.parquet")))
            .unwrap()
    };
    assert!(
        of("estimates").ends_with(" holds") && of("trends").contains("does not hold"),
        "{said}"
    );
    assert!(
        said.contains("configuration trend.criterion: \"aicc\" became \"bic\""),
        "{said}"
    );
    assert_eq!(
        run(campaign.command("verify").args(["--table", "estimates"])).code,
        Some(0)
    );
    assert_eq!(
        run(campaign.command("verify").args(["--table", "nonsense"])).code,
        Some(1)
    );
    campaign.edit("pipeline.yaml", "criterion: bic", "criterion: aicc");

    // One bit of a published table, and of an artefact.
    let table = fs::canonicalize(campaign.path("reports/fits.csv")).unwrap();
    flip(&table);
    let said = campaign.ends("verify", 2).stdout;
    assert!(
        said.contains("its bytes are not those that were published"),
        "{said}"
    );
    campaign.finishes("run");
    campaign.ends("verify", 0);
    // A file of another's hand where the reader looks for a published one.
    let shortcut = campaign.path("reports/trends.csv");
    fs::remove_file(&shortcut).unwrap();
    fs::write(&shortcut, "derivative,value\n").unwrap();
    let said = campaign.ends("verify", 2).stdout;
    assert!(said.contains("stands in its place"), "{said}");
    campaign.finishes("run");
    campaign.ends("verify", 0);
    flip(&files(&campaign.path("store/estimate"))[0]);
    assert!(
        campaign
            .ends("verify", 2)
            .stdout
            .contains("damaged or gone")
    );
    // The next run makes it again and publishes nothing.
    let outcome = campaign.finishes("run");
    assert!(
        outcome
            .stdout
            .contains("nothing new: night 0001 is still current")
    );
    campaign.ends("verify", 0);
    campaign.add("flight_001", &flight(1, 151));
    assert!(
        campaign
            .ends("verify", 2)
            .stdout
            .contains("the file of flight flight_001 changed")
    );
}

#[test]
fn an_artefact_under_another_s_name_is_made_again_and_no_published_night_changes() {
    let campaign = Campaign::of_both_axes();
    both_axes().fill_store(&campaign);
    campaign.finishes("run");
    let night = campaign.path("reports/nights/0001");
    let published = || -> BTreeMap<PathBuf, Vec<u8>> {
        let all = files(&night).into_iter();
        all.map(|path| (path.clone(), fs::read(path).unwrap()))
            .collect()
    };
    let before = published();
    for kind in ["segment", "estimate", "history", "ingest", "records"] {
        let artefacts = files(&campaign.path("store").join(kind));
        let own = fs::read(&artefacts[1]).unwrap();
        fs::copy(&artefacts[0], &artefacts[1]).unwrap();
        campaign.ends("verify", 2);
        campaign.finishes("run");
        assert!(fs::read(&artefacts[1]).unwrap() == own, "{kind}");
        campaign.ends("verify", 0);
        assert_eq!(
            campaign.path("reports/current").read_link().unwrap(),
            Path::new("nights/0001")
        );
    }
    assert!(published() == before);
}

fn flip(path: &Path) {
    let mut bytes = fs::read(path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(path, bytes).unwrap();
}

#[test]
fn after_damage_to_any_file_the_next_run_ends_with_the_same_bytes() {
    let campaign = two_published_nights();
    let expected = campaign.bytes("reports");
    let all = || -> Vec<PathBuf> {
        let night = fs::canonicalize(campaign.path("reports/current")).unwrap();
        files(&campaign.path("store"))
            .into_iter()
            .chain(files(&night))
            .filter(|p| !p.ends_with("lock"))
            .collect()
    };
    let ends_the_same = |what: &str| {
        campaign.finishes("run");
        let differing = differing(&campaign.bytes("reports"), &expected);
        assert!(differing.is_empty(), "{what}: {differing:?}");
    };
    // Every file at once, each at a place of its own.
    let mut random = Random::new(0xf11b);
    let mut flip_one = |file: &Path| {
        let mut bytes = fs::read(file).unwrap();
        let at = random.below(bytes.len());
        bytes[at] ^= 1 << random.below(8);
        fs::write(file, bytes).unwrap();
        format!("{} at {at}", file.display())
    };
    for file in all() {
        flip_one(&file);
    }
    ends_the_same("all");
    // And one by one: `make torture` takes many more.
    let mut which = Random::new(0x0bad);
    for _ in 0..from_environment("HARVEST_FLIPS", 4) {
        let all = all();
        let what = flip_one(&all[which.below(all.len())]);
        ends_the_same(&what);
        assert!(
            !matches!(campaign.harvest("verify").code, Some(1)),
            "{what}"
        );
    }
}

#[test]
fn a_report_has_the_same_bytes_with_the_drawings_of_the_last_one_and_without() {
    // The second night's report knows the drawings of the first.
    let campaign = two_published_nights();
    let expected = campaign.bytes("reports");
    let drawings = campaign.path("store/drawings.bin");
    let kept = fs::read(&drawings).unwrap();
    for are_known in [false, true] {
        if !are_known {
            fs::remove_file(&drawings).unwrap();
        }
        for page in ["report.html", "report.pdf"] {
            fs::remove_file(campaign.path("reports/current").join(page)).unwrap();
        }
        campaign.finishes("run");
        let differing = differing(&campaign.bytes("reports"), &expected);
        assert!(differing.is_empty(), "{are_known}: {differing:?}");
        assert!(fs::read(&drawings).unwrap() == kept, "{are_known}");
    }
}

#[test]
fn gc_lists_then_removes_only_what_no_night_needs() {
    let campaign = two_published_nights();
    assert!(
        run(campaign.command("gc").arg("--yes"))
            .stdout
            .contains("0 artefacts (0 MB) and 0 nights removed")
    );
    campaign.copy_pipeline();
    fs::remove_file(campaign.flight("flight_004")).unwrap();
    campaign.finishes("run");
    let all = campaign.bytes("store");
    campaign.ends("gc", 0);
    assert!(
        campaign.bytes("store") == all,
        "the nights before need them"
    );

    campaign.edit(
        "pipeline.yaml",
        "histories_at_alpha_deg: 30",
        "histories_at_alpha_deg: 30\n  keep_nights: 1",
    );
    let shown = campaign.ends("gc", 0).stdout;
    assert!(
        shown.contains("would be removed") && shown.contains("night 0001"),
        "{shown}"
    );
    assert!(campaign.bytes("store") == all, "it only shows");
    assert_eq!(run(campaign.command("gc").arg("--yes")).code, Some(0));
    let alone = Campaign::of_pitch_steps();
    alone.finishes("run");
    assert!(differing(&campaign.bytes("store"), &alone.bytes("store")).is_empty());
    campaign.ends("verify", 0);
    let tables = campaign.tables();
    campaign.finishes("run");
    assert!(campaign.tables() == tables);
}

#[test]
fn gc_removes_nothing_where_a_night_s_needs_are_unreadable() {
    let campaign = two_published_nights();
    flip(&campaign.path("reports/nights/0001/night.json"));
    fs::write(
        campaign.path("store/estimate/superseded.json"),
        "of a night before",
    )
    .unwrap();
    let before = campaign.bytes("store");
    let outcome = run(campaign.command("gc").arg("--yes"));
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    assert!(
        outcome
            .stderr
            .contains("0001: its manifest night.json cannot be read"),
        "{outcome:?}"
    );
    assert!(campaign.bytes("store") == before && campaign.path("reports/nights/0001").exists());
}

#[test]
fn a_stage_without_changes_keeps_the_published_night() {
    let campaign = Campaign::of_pitch_steps();
    campaign.finishes("run");
    let published = bytes_without_locks(&campaign);
    let outcome = campaign.harvest("estimate");
    assert!(
        outcome
            .stdout
            .contains("nothing new: night 0001 is still current"),
        "{outcome:?}"
    );
    assert!(bytes_without_locks(&campaign) == published);
    for estimate in files(&campaign.path("store/estimate")) {
        fs::remove_file(estimate).unwrap();
    }
    campaign.harvest("segment");
    assert!(
        campaign.path("reports/report.html").is_file(),
        "the same night, to the report"
    );
    campaign.finishes("run");
    assert!(bytes_without_locks(&campaign) == published);
}

#[test]
fn the_log_has_one_json_object_per_line_and_the_terminal_is_quiet() {
    let campaign = Campaign::of_pitch_steps();
    fs::write(campaign.flight("spoiled"), "text").unwrap();
    let log = campaign.path("nightly.jsonl");
    for _ in 0..2 {
        let outcome = run(campaign
            .command("run")
            .arg("--quiet")
            .arg("--jobs")
            .arg("1")
            .arg("--log")
            .arg(&log));
        assert_eq!(
            (outcome.code, &*outcome.stdout, &*outcome.stderr),
            (Some(2), "", "")
        );
    }
    let text = fs::read_to_string(&log).unwrap();
    let lines: Vec<Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let of = |event: &str| {
        lines
            .iter()
            .filter(|l| l["event"] == event)
            .collect::<Vec<_>>()
    };
    assert!(
        lines
            .iter()
            .all(|l| l["time"].as_str().unwrap().ends_with('Z') && l["pid"].is_u64())
    );
    assert_eq!((of("begin").len(), of("end").len()), (2, 2));
    assert_eq!(
        (&of("night")[0]["new"], &of("night")[1]["new"]),
        (&true.into(), &false.into())
    );
    assert_eq!(
        (&of("end")[1]["artefacts_made"], &of("end")[1]["exit"]),
        (&0.into(), &2.into())
    );
    assert!(of("problem").iter().any(|p| p["flight"] == "spoiled"));
    assert!(of("stage").iter().any(|s| s["stage"] == "estimate"));
}

#[cfg(unix)]
#[test]
fn a_signal_leaves_a_line_in_the_log() {
    use std::os::unix::process::ExitStatusExt as _;
    let campaign = Campaign::of_demo();
    let log = campaign.path("nightly.jsonl");
    let mut command = campaign.command("run");
    command.args(["--quiet", "--jobs", "1", "--log"]).arg(&log);
    let mut child = command.spawn().unwrap();
    let has_begun = || fs::read_to_string(&log).is_ok_and(|text| text.contains("\"flight\":"));
    while !has_begun() {
        assert_eq!(child.try_wait().unwrap(), None);
        std::thread::sleep(Duration::from_millis(5));
    }
    let kill = Command::new("kill").arg(child.id().to_string()).status();
    assert!(kill.unwrap().success());
    assert_eq!(child.wait().unwrap().signal(), Some(15));
    let text = fs::read_to_string(&log).unwrap();
    let last: Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    assert_eq!(
        (&last["event"], &last["signal"], &last["stage"]),
        (&"signal".into(), &"SIGTERM".into(), &"ingest".into())
    );
    let in_work = last["in_work"][0].as_str().unwrap();
    assert!(
        in_work.starts_with("flight_00") && in_work.contains(" since 2"),
        "{last}"
    );
}
