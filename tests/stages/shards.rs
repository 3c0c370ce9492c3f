//! A campaign in shards: the tables of one process, whoever computed them, how often, and in
//! whatever order.

use std::fs;
use std::process::{Command, Stdio};

use crate::support::{Campaign, Outcome, both_axes, demo, pitch_steps, run, yaw_and_roll_steps};

fn plan_of(campaign: &Campaign, of: &str, shards: usize) -> Outcome {
    run(campaign
        .command("plan")
        .args(["--of", of, "--shards", &shards.to_string()]))
}

fn shard(campaign: &Campaign, stage: &str, number: usize, shards: usize) -> Command {
    let of = if stage == "estimate" {
        "maneuvers"
    } else {
        "flights"
    };
    let mut command = campaign.command(stage);
    command
        .arg("--plan")
        .arg(campaign.path(&format!("store/{of}.plan.json")));
    command.args(["--shard", &format!("{number}/{shards}"), "--threads", "1"]);
    command
}

fn with_plan(campaign: &Campaign, command: &str, of: &str) -> Outcome {
    run(campaign
        .command(command)
        .arg("--plan")
        .arg(campaign.path(&format!("store/{of}.plan.json"))))
}

/// Every shard of a stage, the last first.
fn all_shards(campaign: &Campaign, stage: &str, shards: usize) {
    for number in (1..=shards).rev() {
        let outcome = run(&mut shard(campaign, stage, number, shards));
        assert_eq!(outcome.code, Some(0), "{outcome:?}");
    }
}

#[test]
fn the_tables_of_many_shards_are_those_of_one_process() {
    let campaign = Campaign::of_demo();
    assert_eq!(plan_of(&campaign, "flights", 3).code, Some(0));
    all_shards(&campaign, "segment", 3);
    for shards in [1, 4, 24] {
        for made in ["store/estimate", "store/history", "reports"] {
            let made = campaign.path(made);
            if made.exists() {
                fs::remove_dir_all(made).unwrap();
            }
        }
        assert_eq!(plan_of(&campaign, "maneuvers", shards).code, Some(0));
        all_shards(&campaign, "estimate", shards);
        let merged = with_plan(&campaign, "merge", "maneuvers");
        assert_eq!(merged.code, demo().outcome.code, "{merged:?}");
        assert!(
            campaign.tables() == demo().bytes,
            "{shards} shards publish other tables"
        );
    }
}

#[test]
fn a_merge_refuses_what_is_missing_and_status_names_its_shards() {
    let campaign = Campaign::of_both_axes();
    let early = plan_of(&campaign, "maneuvers", 2);
    assert_eq!(early.code, Some(1));
    assert!(
        early
            .stderr
            .contains("2 flights are not ingested and segmented, flight_001 first"),
        "{early:?}"
    );

    plan_of(&campaign, "flights", 2);
    let status = with_plan(&campaign, "status", "flights");
    assert_eq!(
        (status.code, status.stdout.trim()),
        (Some(3), "1-2"),
        "{status:?}"
    );
    all_shards(&campaign, "segment", 2);
    assert_eq!(with_plan(&campaign, "status", "flights").code, Some(0));
    plan_of(&campaign, "maneuvers", 2);
    assert_eq!(run(&mut shard(&campaign, "estimate", 1, 2)).code, Some(0));

    let status = with_plan(&campaign, "status", "maneuvers");
    assert_eq!(
        (status.code, status.stdout.trim()),
        (Some(3), "2"),
        "{status:?}"
    );
    let merged = with_plan(&campaign, "merge", "maneuvers");
    assert_eq!(merged.code, Some(1));
    assert!(
        merged
            .stderr
            .contains("1 of 2 maneuvers are missing, of shards 2: run these shards"),
        "{merged:?}"
    );
    assert!(!campaign.path("reports/fits.csv").exists());
    let wrong = with_plan(&campaign, "merge", "flights");
    assert!(
        wrong.code == Some(1) && wrong.stderr.contains("the plan of maneuvers"),
        "{wrong:?}"
    );
}

#[test]
fn a_shard_that_runs_again_or_twice_at_once_makes_the_same() {
    let campaign = Campaign::of_both_axes();
    plan_of(&campaign, "flights", 1);
    let spawned = || {
        shard(&campaign, "segment", 1, 1)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    let ends = [spawned(), spawned()].map(|mut child| child.wait().unwrap().code());
    assert_eq!(ends, [Some(0); 2]);
    let before = campaign.bytes("store");
    let again = run(&mut shard(&campaign, "segment", 1, 1));
    assert!(
        again.code == Some(0) && again.stdout.contains("2 flights, 0 artefacts made"),
        "{again:?}"
    );
    assert!(campaign.bytes("store") == before);
}

#[test]
fn a_plan_of_something_else_is_refused_with_what_changed() {
    let campaign = Campaign::of_both_axes();
    plan_of(&campaign, "flights", 1);
    let refused = |words: &str| {
        let outcome = run(&mut shard(&campaign, "segment", 1, 1));
        assert!(
            outcome.code == Some(1) && outcome.stderr.contains(words),
            "{words}: {outcome:?}"
        );
    };
    let wrong = run(&mut shard(&campaign, "segment", 1, 3));
    assert!(
        wrong.code == Some(1) && wrong.stderr.contains("the plan deals to 1 shards, not 3"),
        "{wrong:?}"
    );
    campaign.add("flight_004", &pitch_steps());
    refused("flight_004");
    campaign.add("flight_004", &yaw_and_roll_steps());
    campaign.copy_pipeline();
    campaign.edit("pipeline.yaml", "de_deg: 2.5", "de_deg: 2.75");
    refused("plan again");
}

#[test]
fn a_store_in_use_and_a_file_that_cannot_be_read_ask_for_another_try() {
    let campaign = Campaign::of_both_axes();
    plan_of(&campaign, "flights", 1);
    let lock = fs::File::open(campaign.path("store/lock")).unwrap();
    lock.lock().unwrap();
    let busy = run(&mut shard(&campaign, "segment", 1, 1));
    assert!(
        busy.code == Some(75) && busy.stderr.contains("a repetition may succeed"),
        "{busy:?}"
    );
    drop(lock);
    fs::remove_file(campaign.flight("flight_004")).unwrap();
    let gone = run(&mut shard(&campaign, "segment", 1, 1));
    assert!(
        gone.code == Some(1) && gone.stderr.contains("flight_004"),
        "{gone:?}"
    );
}

#[test]
fn scripts_are_written_for_a_scheduler_and_nothing_is_run() {
    let campaign = Campaign::of_both_axes();
    let outcome = run(campaign.command("submit").args(["--engine", "slurm"]));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    for name in ["flights", "plan", "maneuvers", "merge", "submit"] {
        let script = campaign.path(&format!("store/cluster/{name}.sh"));
        let checked = Command::new("bash")
            .arg("-n")
            .arg(&script)
            .status()
            .unwrap();
        assert!(checked.success(), "{}", script.display());
    }
    let maneuvers = fs::read_to_string(campaign.path("store/cluster/maneuvers.sh")).unwrap();
    assert!(
        maneuvers.contains("#SBATCH --array=1-24")
            && maneuvers.contains("estimate harv --archive "),
        "{maneuvers}"
    );
}

/// Stand-in for PBS's `qsub`: runs a job at once, the tasks of an array one after the other.
const QSUB: &str = r#"#!/bin/bash
script="${@: -1}"
tasks=$(sed -n 's/^#PBS -J 1-//p' "$script")
for task in $(seq 1 "${tasks:-1}"); do
    PBS_ARRAY_INDEX=$task bash "$script" > /dev/null || exit 1
done
echo 1.server
"#;

#[cfg(unix)]
#[test]
fn the_scripts_for_pbs_publish_the_tables_of_one_process() {
    use std::os::unix::fs::PermissionsExt as _;
    let campaign = Campaign::of_both_axes();
    campaign.copy_pipeline();
    campaign.edit("pipeline.yaml", "# cluster:\n", "cluster: { shards: 2 }\n");
    let outcome = run(campaign.command("submit").args(["--engine", "pbs"]));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let programs = campaign.path("programs");
    fs::create_dir(&programs).unwrap();
    fs::write(programs.join("qsub"), QSUB).unwrap();
    fs::set_permissions(programs.join("qsub"), fs::Permissions::from_mode(0o755)).unwrap();
    let path = std::env::var("PATH").unwrap();
    let submitted = run(Command::new("bash")
        .arg(campaign.path("store/cluster/submit.sh"))
        .env("PATH", format!("{}:{path}", programs.display())));
    assert_eq!(submitted.code, Some(0), "{submitted:?}");
    assert!(campaign.tables() == both_axes().bytes);
}
