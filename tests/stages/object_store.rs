//! Archive and store in an object store: a real S3-compatible server on this machine's loopback,
//! named by `HARVEST_S3_SERVER` (`tests/cluster/s3_server.sh` installs one). Skipped without it, but in
//! CI.

use std::collections::BTreeMap;
use std::fs;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use crate::support::{Campaign, Outcome, files, run, skip, yaw_and_roll_steps};

const KEY: &str = "tester";
const SECRET: &str = "a-secret-of-nobody";

/// The server and its buckets, which are folders.
struct Server {
    process: Child,
    endpoint: String,
    root: tempfile::TempDir,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Server {
    /// With a bucket `flights` of two flights and an empty bucket `store`.
    fn start(local: &Campaign) -> Option<Server> {
        let program = std::env::var_os("HARVEST_S3_SERVER").filter(|program| !program.is_empty());
        let Some(program) = program else {
            skip(
                "no S3-compatible server (HARVEST_S3_SERVER; tests/cluster/s3_server.sh installs one)",
            );
            return None;
        };
        let root = tempfile::tempdir().unwrap();
        let port = TcpListener::bind("127.0.0.1:0")
            .unwrap()
            .local_addr()
            .unwrap()
            .port();
        for bucket in ["flights", "store"] {
            fs::create_dir(root.path().join(bucket)).unwrap();
        }
        for file in files(&local.path("flights")) {
            fs::copy(
                &file,
                root.path().join("flights").join(file.file_name().unwrap()),
            )
            .unwrap();
        }
        let mut server = Command::new(program);
        server.args([
            "--host",
            "127.0.0.1",
            "--port",
            &port.to_string(),
            "--access-key",
            KEY,
            "--secret-key",
            SECRET,
        ]);
        let process = server
            .arg(root.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let begun = Instant::now();
        while TcpStream::connect(("127.0.0.1", port)).is_err() {
            assert!(
                begun.elapsed() < Duration::from_secs(20),
                "the server did not come up"
            );
            std::thread::sleep(Duration::from_millis(20));
        }
        Some(Server {
            process,
            endpoint: format!("http://127.0.0.1:{port}"),
            root,
        })
    }

    fn object(&self, key: &str) -> PathBuf {
        self.root.path().join(key)
    }

    /// The environment of a program that is to find the server.
    fn reach<'c>(&self, command: &'c mut Command) -> &'c mut Command {
        for proxy in [
            "HTTP_PROXY",
            "http_proxy",
            "HTTPS_PROXY",
            "https_proxy",
            "ALL_PROXY",
            "all_proxy",
        ] {
            command.env_remove(proxy);
        }
        command
            .env("AWS_ACCESS_KEY_ID", KEY)
            .env("AWS_SECRET_ACCESS_KEY", SECRET)
            .env("AWS_REGION", "us-east-1");
        command
            .env("AWS_ENDPOINT_URL", &self.endpoint)
            .env("AWS_ALLOW_HTTP", "true")
    }

    /// The program on a machine of its own: with its own cache and reports, on archive and store of
    /// the server.
    fn command(&self, machine: &Campaign, stage: &str, archive: &str) -> Command {
        let mut command = crate::support::harvest();
        let pipeline = machine.path("pipeline");
        command.arg(stage).arg(if pipeline.is_dir() {
            pipeline
        } else {
            "harv".into()
        });
        command.args([
            "--archive",
            archive,
            "--store",
            "s3://store/campaign",
            "--store-cache",
        ]);
        command
            .arg(machine.path("store"))
            .arg("--reports")
            .arg(machine.path("reports"))
            .stdin(Stdio::null());
        self.reach(&mut command);
        command
    }

    /// Runs all stages without a problem; how many artefacts were made.
    fn run(&self, machine: &Campaign, archive: &str) -> u64 {
        self.run_to_code(0, machine, archive)
    }

    /// Runs all stages to an exit code; how many artefacts were made.
    fn run_to_code(&self, code: i32, machine: &Campaign, archive: &str) -> u64 {
        let log = machine.path("log.jsonl");
        let _ = fs::remove_file(&log);
        let outcome = run(self.command(machine, "run", archive).arg("--log").arg(&log));
        assert!(
            outcome.code == Some(code) && outcome.stderr.is_empty(),
            "{outcome:?}"
        );
        let text = fs::read_to_string(log).unwrap();
        let made = text.split_once("\"artefacts_made\":").unwrap().1;
        made.split([',', '}']).next().unwrap().parse().unwrap()
    }

    fn artefacts(&self, kind: &str) -> Vec<PathBuf> {
        files(&self.object("store/campaign").join(kind))
    }
}

/// Two short flights in a folder.
fn local() -> Campaign {
    let campaign = Campaign::of_pitch_steps();
    campaign.add("flight_004", &yaw_and_roll_steps());
    campaign
}

/// Their tables, from folders.
fn expected() -> &'static BTreeMap<PathBuf, Vec<u8>> {
    static TABLES: OnceLock<BTreeMap<PathBuf, Vec<u8>>> = OnceLock::new();
    TABLES.get_or_init(|| {
        let campaign = local();
        campaign.finishes("run");
        campaign.tables()
    })
}

#[test]
fn the_tables_are_those_of_folders_and_another_machine_finds_all_made() {
    let local = local();
    let Some(server) = Server::start(&local) else {
        return;
    };
    let expected = expected();
    let [first, second] = [Campaign::new(), Campaign::new()];
    assert!(server.run(&first, "s3://flights") > 5);
    assert!(
        first.tables() == *expected,
        "other tables than from folders"
    );
    assert_eq!(
        server.run(&second, "s3://flights/*.parquet"),
        0,
        "the second machine computed what the first had"
    );
    assert!(second.tables() == *expected);
    assert!(
        !second.path("store/records").exists(),
        "records were fetched that nobody needs"
    );
    assert_eq!(server.run(&second, "s3://flights"), 0);
    let verified = run(&mut server.command(&second, "verify", "s3://flights"));
    assert!(
        verified.code == Some(0) && verified.stdout.contains("The night is valid"),
        "{verified:?}"
    );
    let status = run(&mut server.command(&second, "status", "s3://flights"));
    assert!(!status.stdout.contains("stale:"), "{status:?}");
    let gc = run(&mut server.command(&second, "gc", "s3://flights"));
    assert!(
        gc.code == Some(0) && gc.stdout.contains("s3://store/campaign is not cleaned"),
        "{gc:?}"
    );
    let maneuver = first.table("maneuvers")[0]["maneuver_id"].clone();
    let mut explain = crate::support::harvest();
    explain.args([
        "explain",
        &maneuver,
        "harv",
        "--archive",
        "s3://flights",
        "--store",
        "s3://store/campaign",
    ]);
    explain
        .arg("--store-cache")
        .arg(Campaign::new().path("store"));
    let explained = run(server.reach(&mut explain));
    assert!(
        explained.code == Some(0) && explained.stdout.contains("s3://flights/flight_001.parquet"),
        "{explained:?}"
    );
}

#[test]
fn what_was_made_and_not_sent_is_sent_and_what_is_damaged_is_made_again() {
    let local = local();
    let Some(server) = Server::start(&local) else {
        return;
    };
    let machine = Campaign::new();
    server.run(&machine, "s3://flights");
    let expected = expected();
    // As a kill leaves it between the disk and the network.
    let unsent: Vec<PathBuf> = ["estimate", "records", "ingest"]
        .map(|kind| server.artefacts(kind).remove(0))
        .into();
    let bytes: Vec<Vec<u8>> = unsent.iter().map(|path| fs::read(path).unwrap()).collect();
    for path in &unsent {
        fs::remove_file(path).unwrap();
    }
    assert_eq!(
        server.run(&machine, "s3://flights"),
        0,
        "what was here was made again"
    );
    for (path, bytes) in unsent.iter().zip(bytes) {
        assert!(fs::read(path).unwrap() == bytes, "{}", path.display());
    }
    // As no store should leave it: an artefact of other bytes, and a record that is cut short.
    let estimate = server.artefacts("estimate").remove(0);
    let whole = fs::read(&estimate).unwrap();
    fs::write(&estimate, &whole[1..]).unwrap();
    let record = server.artefacts("records").remove(0);
    fs::write(&record, &fs::read(&record).unwrap()[1000..]).unwrap();
    let other = Campaign::new();
    assert!(server.run(&other, "s3://flights") >= 3);
    assert!(other.tables() == *expected && fs::read(&estimate).unwrap() == whole);
}

#[test]
fn shards_on_machines_of_their_own_share_their_work_through_the_store() {
    let local = local();
    let Some(server) = Server::start(&local) else {
        return;
    };
    let expected = expected();
    let machines = [Campaign::new(), Campaign::new(), Campaign::new()];
    let plan_file = |of: &str| format!("s3://store/campaign/{of}.plan.json");
    let plan = |machine: &Campaign, of: &str| {
        let outcome = run(server
            .command(machine, "plan", "s3://flights")
            .args(["--of", of, "--shards", "2"]));
        assert!(
            outcome.code == Some(0) && outcome.stdout.contains(&plan_file(of)),
            "{outcome:?}"
        );
    };
    let shard = |machine: &Campaign, stage: &str, of: &str, number: usize| -> Command {
        let mut command = server.command(machine, stage, "s3://flights");
        command.args([
            "--plan",
            &plan_file(of),
            "--shard",
            &format!("{number}/2"),
            "--threads",
            "1",
        ]);
        command
    };
    let missing = |of: &str| {
        run(server
            .command(&machines[2], "status", "s3://flights")
            .args(["--plan", &plan_file(of)]))
    };
    plan(&machines[0], "flights");
    assert_eq!(missing("flights").stdout.trim(), "1-2");
    for number in [1, 2] {
        // The same shard twice at the same time, on two machines.
        let spawn = |machine| {
            shard(machine, "segment", "flights", number)
                .stdout(Stdio::null())
                .spawn()
                .unwrap()
        };
        let ends = [spawn(&machines[0]), spawn(&machines[1])]
            .map(|mut child| child.wait().unwrap().code());
        assert_eq!(ends, [Some(0); 2]);
    }
    assert_eq!(missing("flights").code, Some(0));
    plan(&machines[2], "maneuvers");
    let done = |outcome: Outcome| assert_eq!(outcome.code, Some(0), "{outcome:?}");
    done(run(&mut shard(&machines[1], "estimate", "maneuvers", 1)));
    let early = run(server
        .command(&machines[2], "merge", "s3://flights")
        .args(["--plan", &plan_file("maneuvers")]));
    assert!(
        early.code == Some(1) && early.stderr.contains("of shards 2"),
        "{early:?}"
    );
    done(run(&mut shard(&machines[0], "estimate", "maneuvers", 2)));
    let merged = run(server
        .command(&machines[2], "merge", "s3://flights")
        .args(["--plan", &plan_file("maneuvers")]));
    assert_eq!(merged.code, Some(0), "{merged:?}");
    assert!(
        machines[2].tables() == *expected,
        "other tables than of one process"
    );
}

#[test]
fn a_truncated_object_is_refused_by_name_and_the_rest_is_done() {
    let local = local();
    let Some(server) = Server::start(&local) else {
        return;
    };
    // Partitioned, and one of the flights cut short.
    let folder = |flight: &str| server.object("flights").join(format!("flight={flight}"));
    for (file, flight) in [("flight_001", "007"), ("flight_004", "008")] {
        fs::create_dir(folder(flight)).unwrap();
        let file = server.object("flights").join(format!("{file}.parquet"));
        fs::rename(file, folder(flight).join("part-0.parquet")).unwrap();
    }
    let spoilt = folder("008").join("part-0.parquet");
    let bytes = fs::read(&spoilt).unwrap();
    fs::write(&spoilt, &bytes[..bytes.len() / 2]).unwrap();
    let machine = Campaign::new();
    server.run_to_code(2, &machine, "s3://flights/flight=00*");
    let problems = machine.table("problems");
    let of_flight: Vec<_> = problems.iter().filter(|p| p["stage"] == "ingest").collect();
    assert!(
        of_flight.len() == 1
            && of_flight[0]["flight_id"] == "008"
            && of_flight[0]["place"] == "s3://flights/flight=008/part-0.parquet"
            && of_flight[0]["reason"].contains("truncated"),
        "{problems:?}"
    );
    let maneuvers = machine.table("maneuvers");
    assert!(!maneuvers.is_empty() && maneuvers.iter().all(|m| m["flight_id"] == "007"));
    // Mended, it is read.
    fs::write(&spoilt, bytes).unwrap();
    server.run(&machine, "s3://flights/flight=00*");
    assert!(
        machine
            .table("maneuvers")
            .iter()
            .any(|m| m["flight_id"] == "008")
    );
}

/// Runs a command that must end at once with every one of the words and without the secret.
fn refused(command: &mut Command, words: &[&str]) {
    let begun = Instant::now();
    let outcome = run(command);
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    for words in words {
        assert!(outcome.stderr.contains(words), "{words}: {outcome:?}");
    }
    assert!(!outcome.stderr.contains(SECRET), "{outcome:?}");
    assert!(
        begun.elapsed() < Duration::from_mins(1),
        "it took {:?}",
        begun.elapsed()
    );
}

#[test]
fn what_stands_in_the_way_is_named_with_what_to_do() {
    let local = local();
    let Some(mut server) = Server::start(&local) else {
        return;
    };
    let machine = Campaign::new();
    refused(
        &mut server.command(&machine, "run", "s3://nowhere/1995"),
        &["s3://nowhere/1995: there is no bucket `nowhere`"],
    );
    refused(
        &mut server.command(&machine, "run", "s3://flights/1996"),
        &["s3://flights/1996: no flight records here"],
    );
    let missing = |command: &mut Command| -> Command {
        let mut other = Command::new(command.get_program());
        let changed = |a: &std::ffi::OsStr| {
            if a == "s3://store/campaign" {
                "s3://nostore/x".into()
            } else {
                a.to_owned()
            }
        };
        other
            .args(command.get_args().map(changed))
            .current_dir(env!("CARGO_MANIFEST_DIR"));
        server.reach(&mut other);
        other
    };
    refused(
        &mut missing(&mut server.command(&machine, "run", "s3://flights")),
        &["there is no bucket `nostore`"],
    );
    let mut stranger = server.command(&machine, "run", "s3://flights");
    refused(
        stranger.env("AWS_ACCESS_KEY_ID", "stranger"),
        &["denies it", "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"],
    );
    let mut wrong = server.command(&machine, "run", "s3://flights");
    refused(
        wrong.env("AWS_SECRET_ACCESS_KEY", "wrong"),
        &["denies it (SignatureDoesNotMatch)"],
    );
    let mut nobody = server.command(&machine, "run", "s3://flights");
    refused(
        nobody.env_remove("AWS_ACCESS_KEY_ID"),
        &["no credentials in the environment: set AWS_ACCESS_KEY_ID"],
    );
    let mut plain = server.command(&machine, "run", "s3://flights");
    refused(
        plain.env_remove("AWS_ALLOW_HTTP"),
        &["is not encrypted", "AWS_ALLOW_HTTP=true"],
    );
    let mut into = crate::support::harvest();
    into.args(["check", "harv", "--reports", "s3://store/reports"]);
    refused(
        server.reach(&mut into),
        &["reports are published in a folder"],
    );
    machine.copy_pipeline();
    machine.edit(
        "pipeline.yaml",
        "archive: data/demo/flights",
        "archive: s3://flights",
    );
    let mut check = crate::support::harvest();
    let checked = run(server.reach(check.arg("check").arg(machine.path("pipeline"))));
    assert!(
        checked.code == Some(0) && checked.stdout.contains("s3://flights: 2 flights"),
        "{checked:?}"
    );
    server.process.kill().unwrap();
    server.process.wait().unwrap();
    refused(
        &mut server.command(&machine, "run", "s3://flights"),
        &["does not answer", "AWS_ENDPOINT_URL"],
    );
    fs::create_dir_all(machine.path("store")).unwrap();
    fs::write(machine.path("store/flights.plan.json"), "{}").unwrap();
    let mut shard = crate::support::harvest();
    shard
        .args(["segment", "harv", "--archive"])
        .arg(local.path("flights"))
        .args(["--store", "s3://store/campaign"]);
    shard.args([
        "--plan",
        "s3://store/campaign/flights.plan.json",
        "--shard",
        "1/1",
    ]);
    let outcome = run(server.reach(&mut shard));
    assert!(
        outcome.code == Some(75) && outcome.stderr.contains("a repetition may succeed"),
        "{outcome:?}"
    );
}

/// A network that fails in the middle of a night: what could not be read is read the next night.
#[test]
fn a_server_that_dies_costs_nothing_but_the_night() {
    let local = local();
    let Some(mut server) = Server::start(&local) else {
        return;
    };
    let machine = Campaign::new();
    let archive = local.path("flights");
    let mut command = server.command(&machine, "run", Path::to_str(&archive).unwrap());
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while !server.object("store/campaign/records").exists()
        && begun.elapsed() < Duration::from_mins(1)
    {
        std::thread::sleep(Duration::from_millis(5));
    }
    server.process.kill().unwrap();
    server.process.wait().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1));
    assert!(!machine.path("reports/fits.csv").exists());
    let expected = expected();
    let Some(again) = Server::start(&local) else {
        return;
    };
    again.run(&machine, Path::to_str(&archive).unwrap());
    assert!(machine.tables() == *expected);
    let here = files(&machine.path("store/estimate")).len();
    assert_eq!(again.artefacts("estimate").len(), here, "not all was sent");
}
