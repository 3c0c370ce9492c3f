//! Whatever the input is, the program does not panic, hang, or take memory without bound: Parquet
//! byte by byte, YAML and CSV by their structure. A few in the suite; `make fuzz` does many.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use harvest::config::{Config, Overrides};
use harvest::error::Error;
use serde_yaml::Value;

use crate::support::{
    Campaign, Outcome, Random, copy_tree, files, flight, from_environment, pitch_steps, values,
};

/// Memory that a run on small flights gets, kB of address space; what it takes is far less.
const MEMORY_KB: usize = 4_000_000;

/// A run on a few small flights that takes longer than this hangs.
const PATIENCE: Duration = Duration::from_mins(5);

/// Runs ingest with bounded memory and time.
fn bounded(campaign: &Campaign) -> Outcome {
    let command = campaign.command("ingest");
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    let words: Vec<String> = words
        .map(|word| format!("'{}'", word.to_string_lossy()))
        .collect();
    let script = format!(
        "ulimit -v {MEMORY_KB}; exec {} --threads 2",
        words.join(" ")
    );
    let (out, err) = (campaign.path("stdout"), campaign.path("stderr"));
    let mut child = Command::new("sh")
        .args(["-c", &script])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdin(Stdio::null())
        .stdout(fs::File::create(&out).unwrap())
        .stderr(fs::File::create(&err).unwrap())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    let code = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        if begun.elapsed() > PATIENCE {
            child.kill().unwrap();
            child.wait().unwrap();
            break None;
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    let text = |path: &Path| String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned();
    Outcome {
        code,
        stdout: text(&out),
        stderr: text(&err),
    }
}

/// One way to spoil a file.
fn spoiled(whole: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    let length = bytes.len();
    // The footer decides most, and a uniform place would seldom hit it.
    let footer = length - length.min(6000);
    match random.below(8) {
        0 => bytes.truncate(random.below(length)),
        1 => {
            let (from, count) = (random.below(length), random.below(2000));
            bytes.iter_mut().skip(from).take(count).for_each(|b| *b = 0);
        }
        2 => {
            let from = random.below(length);
            let run: Vec<u8> = (0..random.below(64))
                .map(|_| random.next().to_le_bytes()[0])
                .collect();
            bytes.splice(from..from, run);
        }
        3 => {
            let (from, to) = (random.below(length), random.below(length));
            let piece = bytes[from..length.min(from + 500)].to_vec();
            bytes
                .iter_mut()
                .skip(to)
                .zip(piece)
                .for_each(|(b, p)| *b = p);
        }
        4 | 5 => {
            for _ in 0..=random.below(4) {
                let at = footer + random.below(length - footer);
                bytes[at] ^= 1 << random.below(8);
            }
        }
        6 => {
            let at = footer + random.below(length - footer);
            bytes
                .iter_mut()
                .skip(at)
                .take(1 + random.below(8))
                .for_each(|b| *b = 0xff);
        }
        _ => {
            for _ in 0..=random.below(20) {
                let at = random.below(length);
                bytes[at] ^= 1 << random.below(8);
            }
        }
    }
    bytes
}

/// The record with one row a value.
fn tall(record: &RecordBatch) -> RecordBatch {
    let schema = record.schema();
    let names = schema.fields().iter().map(|field| field.name().as_str());
    let columns: Vec<(&str, Vec<f64>)> = names
        .filter(|name| *name != "time")
        .map(|name| (name, values(record, name)))
        .collect();
    let rows = |k: usize| columns.iter().map(move |(name, v)| (k, *name, v[k]));
    let rows: Vec<(usize, &str, f64)> = (0..record.num_rows()).flat_map(rows).collect();
    let time = values(record, "time");
    let times = rows.iter().map(|r| Some(time[r.0]));
    let times: ArrayRef = Arc::new(times.collect::<Float64Array>());
    let names: ArrayRef = Arc::new(rows.iter().map(|r| Some(r.1)).collect::<StringArray>());
    let numbers = rows.iter().map(|r| Some(r.2));
    let numbers: ArrayRef = Arc::new(numbers.collect::<Float64Array>());
    RecordBatch::try_from_iter([("time", times), ("name", names), ("value", numbers)]).unwrap()
}

#[cfg(unix)]
#[test]
fn whatever_bytes_a_flight_has_the_others_are_read() {
    others_are_read_beside_spoiled(&flight(1, 12));
}

#[cfg(unix)]
#[test]
fn whatever_bytes_a_tall_flight_has_the_others_are_read() {
    others_are_read_beside_spoiled(&tall(&flight(1, 12)));
}

#[cfg(unix)]
fn others_are_read_beside_spoiled(record: &RecordBatch) {
    let (wanted, per_run) = (from_environment("HARVEST_FUZZ", 60), 60);
    let small = Campaign::new();
    small.add("small", record);
    let whole = fs::read(small.flight("small")).unwrap();
    let mut random = Random::new(1);
    for _ in 0..wanted.div_ceil(per_run) {
        let campaign = Campaign::of_pitch_steps();
        for i in 0..per_run {
            fs::write(
                campaign.flight(&format!("spoiled_{i:03}")),
                spoiled(&whole, &mut random),
            )
            .unwrap();
        }
        let outcome = bounded(&campaign);
        let kept = std::env::temp_dir().join("harvest-fuzz");
        if outcome.code != Some(2) {
            copy_tree(&campaign.path("flights"), &kept);
        }
        let place = kept.display();
        assert_eq!(
            outcome.code,
            Some(2),
            "{outcome:?}; the files are in {place}"
        );
        assert_eq!(outcome.stderr, "");
        let told = |table: &str, id: &str| {
            campaign
                .table(table)
                .iter()
                .any(|row| row["flight_id"] == id)
        };
        assert!(told("channels", "flight_001") && !told("problems", "flight_001"));
        for i in 0..per_run {
            let id = format!("spoiled_{i:03}");
            assert!(told("channels", &id) || told("problems", &id), "{id}");
        }
    }
}

/// A small file that claims a million million rows.
#[cfg(unix)]
#[test]
fn a_parquet_bomb_is_refused_and_the_other_flights_are_read() {
    use parquet::file::metadata::{ParquetMetaData, ParquetMetaDataWriter};
    use parquet::file::reader::{FileReader, SerializedFileReader};
    let campaign = Campaign::of_pitch_steps();
    campaign.add("bomb", &flight(1, 1));
    let path = campaign.flight("bomb");
    let reader = SerializedFileReader::new(fs::File::open(&path).unwrap()).unwrap();
    let groups = reader.metadata().row_groups().iter();
    let claims = groups
        .map(|g| {
            g.clone()
                .into_builder()
                .set_num_rows(1_000_000_000_000)
                .build()
                .unwrap()
        })
        .collect();
    let metadata = ParquetMetaData::new(reader.metadata().file_metadata().clone(), claims);
    let mut bytes = fs::read(&path).unwrap();
    let end = bytes.len();
    let footer: [u8; 4] = bytes[end - 8..end - 4].try_into().unwrap();
    bytes.truncate(end - 8 - usize::try_from(u32::from_le_bytes(footer)).unwrap());
    ParquetMetaDataWriter::new(&mut bytes, &metadata)
        .finish()
        .unwrap();
    fs::write(&path, bytes).unwrap();
    let outcome = bounded(&campaign);
    assert_eq!(outcome.code, Some(2), "{outcome:?}");
    let problems = campaign.table("problems");
    assert!(
        problems.len() == 1 && problems[0]["reason"].contains("claims 1000000000000 rows"),
        "{problems:?}"
    );
    assert!(
        campaign
            .table("channels")
            .iter()
            .any(|row| row["flight_id"] == "flight_001")
    );
}

/// Values that a tired analyst, or a program, might write.
fn odd(random: &mut Random) -> Value {
    let values = [
        Value::Null,
        Value::Bool(true),
        Value::from(-1),
        Value::from(0),
        Value::from(f64::NAN),
        Value::from(f64::INFINITY),
        Value::from(1e308),
        Value::from(u64::MAX),
        Value::from(""),
        Value::from("nonsense"),
        Value::from("ä\u{0}\u{202e}"),
        Value::Sequence(vec![]),
        Value::Mapping(serde_yaml::Mapping::new()),
    ];
    values[random.below(values.len())].clone()
}

/// Changes one place of a document: replaces, removes, doubles or renames.
fn mutate(value: &mut Value, random: &mut Random) {
    let go_on = random.below(4) > 0;
    match value {
        Value::Mapping(map) if !map.is_empty() && go_on => {
            let at = random.below(map.len());
            let (key, _) = map
                .iter()
                .nth(at)
                .map(|(k, v)| (k.clone(), v.clone()))
                .unwrap();
            match random.below(12) {
                0 => drop(map.remove(&key)),
                1 => {
                    let removed = map.remove(&key).unwrap();
                    map.insert(Value::from("anothr_name"), removed);
                }
                _ => mutate(map.get_mut(&key).unwrap(), random),
            }
        }
        Value::Sequence(items) if !items.is_empty() && go_on => {
            let at = random.below(items.len());
            match random.below(8) {
                0 => drop(items.remove(at)),
                1 => items.push(items[at].clone()),
                _ => mutate(&mut items[at], random),
            }
        }
        other => *other = odd(random),
    }
}

#[test]
fn whatever_stands_in_the_yaml_it_is_read_or_refused_with_the_file_s_name() {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/harv");
    let names: Vec<PathBuf> = files(&shipped)
        .into_iter()
        .filter(|p| !p.ends_with("cards.yaml"))
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let mut random = Random::new(2);
    let (mut refused, rounds) = (0, from_environment("HARVEST_FUZZ", 300));
    for _ in 0..rounds {
        let pipeline = folder.path().join("pipeline");
        copy_tree(&shipped, &pipeline);
        let name = names[random.below(names.len())]
            .strip_prefix(&shipped)
            .unwrap()
            .to_owned();
        let mut document: Value =
            serde_yaml::from_str(&fs::read_to_string(shipped.join(&name)).unwrap()).unwrap();
        for _ in 0..=random.below(3) {
            mutate(&mut document, &mut random);
        }
        let text = serde_yaml::to_string(&document).unwrap();
        fs::write(pipeline.join(&name), &text).unwrap();
        match Config::load(&pipeline, Overrides::default()) {
            Ok(_) => {}
            Err(error @ (Error::Config { .. } | Error::Io { .. })) => {
                refused += 1;
                // A path that cannot be read is itself what was written: `wind_tunnel: null`.
                let names_the_file =
                    error.to_string().contains(".yaml") || matches!(error, Error::Io { .. });
                assert!(
                    names_the_file || error.to_string().contains(".csv"),
                    "{error}"
                );
            }
            Err(error) => panic!("{error} for\n{text}"),
        }
    }
    assert!(
        refused > rounds / 4,
        "{refused} of {rounds}: it changes too little"
    );
}

#[test]
fn yaml_that_is_none_or_unfolds_without_end_is_refused() {
    let bomb = (1..30).fold("a0: &a0 [x, x]\n".to_owned(), |text, i| {
        format!("{text}a{i}: &a{i} [*a{}, *a{}]\n", i - 1, i - 1)
    });
    let deep = "[".repeat(100_000);
    let binary = String::from_utf8_lossy(&[0, 159, 146, 150]).into_owned();
    for text in [
        bomb,
        deep,
        binary,
        "title: [".to_owned(),
        String::new(),
        "- 1".to_owned(),
    ] {
        let campaign = Campaign::new();
        campaign.copy_pipeline();
        fs::write(campaign.path("pipeline/pipeline.yaml"), &text).unwrap();
        let outcome = campaign.harvest("check");
        assert_eq!(outcome.code, Some(1), "{outcome:?}");
        assert!(outcome.stderr.contains("pipeline.yaml"), "{outcome:?}");
    }
}

#[test]
fn whatever_stands_in_a_csv_it_is_read_or_refused_with_file_and_line() {
    let tunnel =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("data/demo/wt_tables.csv"))
            .unwrap();
    let pipeline = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/harv");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.csv");
    let mut random = Random::new(3);
    let cells = [
        "", "nan", "inf", "1e999", "-0", "\"", "ten", "CN_q", "per_deg", "ä", "5,5", "\r", "9e307",
    ];
    for _ in 0..from_environment("HARVEST_FUZZ", 300) {
        let mut lines: Vec<String> = tunnel.lines().map(str::to_owned).collect();
        for _ in 0..=random.below(4) {
            let at = random.below(lines.len());
            let mut fields: Vec<&str> = lines[at].split(',').collect();
            let field = random.below(fields.len());
            match random.below(6) {
                0 => drop(fields.remove(field)),
                1 => fields.push(cells[random.below(cells.len())]),
                _ => fields[field] = cells[random.below(cells.len())],
            }
            lines[at] = fields.join(",");
        }
        fs::write(&path, lines.join("\n")).unwrap();
        let overrides = Overrides {
            wind_tunnel: Some(path.clone()),
            archive: Some(String::new()),
            ..Overrides::default()
        };
        if let Err(error) = Config::load(&pipeline, overrides) {
            assert!(
                error.to_string().contains(".csv") || error.to_string().contains(".yaml"),
                "{error}"
            );
        }
        fs::write(
            &path,
            format!(
                "flight_id,class,start_s,end_s\nf,PPSS,{},{}",
                cells[random.below(cells.len())],
                cells[random.below(cells.len())]
            ),
        )
        .unwrap();
        let overrides = Overrides {
            events: Some(path.clone()),
            ..Overrides::default()
        };
        if let Err(error) = Config::load(&pipeline, overrides) {
            assert!(error.to_string().contains("table.csv"), "{error}");
        }
    }
}

#[test]
fn a_pipe_in_the_archive_does_not_stop_the_run() {
    let campaign = Campaign::new();
    campaign.add("flight_001", &pitch_steps());
    let made = Command::new("mkfifo").arg(campaign.flight("pipe")).status();
    if made.is_ok_and(|status| status.success()) {
        let outcome = bounded(&campaign);
        assert_eq!(outcome.code, Some(2), "{outcome:?}");
        assert!(campaign.table("problems")[0]["reason"].contains("is no regular file"));
    }
}
