//! The second aircraft: tall files in SI units, one maneuver each, without flags, sticks and heading,
//! with slow air data and channels by formula. Its truth is known.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, OnceLock};

use arrow::array::{ArrayRef, AsArray, Float64Array, RecordBatch, StringArray};
use arrow::compute::cast;
use arrow::datatypes::DataType;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use crate::support::{Campaign, Processed, Row, files, harvest, number, run, table, values, write};

/// The campaign of the repository, run once for all tests that look at it.
fn navion() -> &'static Processed {
    static NAVION: OnceLock<Processed> = OnceLock::new();
    NAVION.get_or_init(|| Processed::of(&Campaign::of_navion()))
}

/// A subcommand on the pipeline with an archive and folders of its own.
fn command(stage: &str, archive: &Path, folder: &Path) -> Command {
    let mut command = harvest();
    command
        .args([stage, "navion", "--archive"])
        .arg(archive)
        .arg("--store")
        .arg(folder.join("store"))
        .arg("--reports")
        .arg(folder.join("reports"));
    command
}

fn published(folder: &Path, name: &str) -> PathBuf {
    folder.join("reports").join(format!("{name}.csv"))
}

#[test]
fn the_files_of_the_repository_are_those_of_the_cards() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(harvest()
        .args(["lab", "simulate", "pipelines/navion/cards.yaml", "--out"])
        .arg(folder.path()));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let flown = files(folder.path());
    assert_eq!(flown.len(), 18 + 1 + 4, "{flown:?}");
    for file in flown {
        let name = file.strip_prefix(folder.path()).unwrap();
        assert!(
            fs::read(&file).unwrap() == fs::read(Path::new("data/navion").join(name)).unwrap(),
            "{} differs: make simulate PIPELINE=navion OUT=data/navion",
            name.display()
        );
    }
}

/// True value of a derivative in a file, which holds one maneuver.
fn truth(truths: &[Row], estimate: &Row) -> f64 {
    let is_same = |row: &&Row| {
        row["flight_id"] == estimate["flight_id"] && row["derivative"] == estimate["derivative"]
    };
    number(truths.iter().find(is_same).unwrap(), "value")
}

#[test]
fn a_light_aircraft_is_estimated_within_its_bounds() {
    let outcome = &navion().outcome;
    assert_eq!(outcome.code, Some(0), "{outcome:?}");

    let maneuvers = &navion().tables["maneuvers"];
    let events = table(Path::new("data/navion/truth/events.csv"));
    let classes = |rows: &[Row]| -> Vec<(String, String)> {
        let class = |row: &Row| (row["flight_id"].clone(), row["class"].clone());
        rows.iter().map(class).collect()
    };
    assert_eq!(classes(maneuvers), classes(&events));
    let fits = &navion().tables["fits"];
    assert_eq!(fits.len(), maneuvers.len());
    assert!(fits.iter().all(|fit| fit["outcome"] == "converged"));

    let truths = table(Path::new("data/navion/truth/derivatives.csv"));
    let estimates = &navion().tables["estimates"];
    let free: Vec<&Row> = estimates
        .iter()
        .filter(|e| e["status"] == "estimated" && !e["derivative"].starts_with("bias"))
        .collect();
    assert!(free.len() > 180, "{} estimates", free.len());
    let errors = free.iter().map(|estimate| {
        let error = number(estimate, "value") - truth(&truths, estimate);
        error.abs() / number(estimate, "bound_corrected")
    });
    let errors: Vec<f64> = errors.collect();
    let within = errors.iter().filter(|error| **error < 1.96).count();
    // Of 95 % expected; the binomial error of 200 is 1.5 %.
    assert!(
        within * 100 >= 90 * errors.len(),
        "{within} of {} intervals hold the truth",
        errors.len()
    );
    let worst = errors.iter().copied().fold(0.0, f64::max);
    assert!(worst < 5.0, "an estimate is {worst} bounds from the truth");
    instruments_are_within_their_bounds();
}

/// Signals of a flight whose biases its short window and the other flights determine, but for some of attitudes.
const WITH_BIAS: usize = 11;

/// Each file is one short window, whose bounds contain the noise of rates and accelerations.
fn instruments_are_within_their_bounds() {
    let truths = table(Path::new("data/navion/truth/instruments.csv"));
    let instruments = &navion().tables["instruments"];
    let distance = |row: &Row| {
        let bound: f64 = row["bias_bound"].parse().ok()?;
        let is_same = |truth: &&Row| {
            truth["flight_id"] == row["flight_id"] && truth["signal"] == row["signal"]
        };
        let truth = number(truths.iter().find(is_same)?, "bias");
        Some((number(row, "bias") - truth).abs() / bound)
    };
    let distances: Vec<f64> = instruments.iter().filter_map(distance).collect();
    let flights = navion().tables["flights"].len();
    assert!(
        distances.len() > (WITH_BIAS - 1) * flights,
        "{} biases of rates, accelerations, vanes, attitudes and the speed of each flight",
        distances.len()
    );
    let within = distances
        .iter()
        .filter(|distance| **distance < 1.96)
        .count();
    assert!(
        within * 100 >= 92 * distances.len(),
        "{within} of {} biases are within their intervals",
        distances.len()
    );
    let trends = &navion().tables["instrument_trends"];
    let changed = |row: &&Row| row["verdict"] == "step" || row["verdict"] == "drift";
    assert_eq!(trends.iter().find(changed), None, "steady instruments");
    assert!(trends.iter().all(|row| row["far_flights"].is_empty()));
}

/// Tables of the estimates of an archive beside it.
fn estimated(archive: &Path) -> [String; 5] {
    let own = archive.with_extension("results");
    let outcome = run(&mut command("estimate", archive, &own));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let left: Vec<PathBuf> = files(&own.join("store"));
    let is_temporary = |path: &&PathBuf| path.to_string_lossy().contains(".harvest-");
    assert_eq!(left.iter().find(is_temporary), None);
    ["maneuvers", "estimates", "fits", "instruments", "channels"]
        .map(|name| fs::read_to_string(published(&own, name)).unwrap())
}

/// Imports the folder `tall` beside it, and compares the estimates of both.
fn estimates_of_both(folder: &Path) -> [String; 5] {
    let (tall, wide) = (folder.join("tall"), folder.join("wide"));
    let outcome = run(harvest().arg("import").arg(&tall).arg("--to").arg(&wide));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let (of_tall, of_wide) = (estimated(&tall), estimated(&wide));
    assert!(of_tall[1].lines().count() > 10);
    assert_eq!(of_tall, of_wide);
    of_tall
}

#[test]
fn tall_files_have_the_estimates_of_their_import() {
    let folder = tempfile::tempdir().unwrap();
    let tall = folder.path().join("tall");
    fs::create_dir(&tall).unwrap();
    for name in ["run_03.parquet", "run_16.parquet"] {
        fs::copy(Path::new("data/navion/flights").join(name), tall.join(name)).unwrap();
    }
    estimates_of_both(folder.path());
    assert!(folder.path().join("wide/run_03.parquet").exists());
}

/// Rows of a flight of the repository: time, name, value.
fn rows(name: &str) -> Vec<(f64, String, f64)> {
    let file = File::open(Path::new("data/navion/flights").join(name)).unwrap();
    let reader = ParquetRecordBatchReaderBuilder::try_new(file).unwrap();
    let mut rows = Vec::new();
    for batch in reader.build().unwrap() {
        let batch = batch.unwrap();
        let names = cast(batch.column_by_name("name").unwrap(), &DataType::Utf8).unwrap();
        let names = names.as_string::<i32>().iter();
        let times = values(&batch, "time").into_iter();
        let of_batch = times.zip(names).zip(values(&batch, "value"));
        rows.extend(of_batch.map(|((t, name), v)| (t, name.unwrap().to_owned(), v)));
    }
    rows
}

fn write_rows(rows: &[(f64, String, f64)], path: &Path) {
    let column = |f: &dyn Fn(&(f64, String, f64)) -> f64| -> ArrayRef {
        Arc::new(rows.iter().map(f).map(Some).collect::<Float64Array>())
    };
    let names: ArrayRef = Arc::new(rows.iter().map(|r| Some(&r.1)).collect::<StringArray>());
    let batch = RecordBatch::try_from_iter([
        ("time", column(&|r| r.0)),
        ("name", names),
        ("value", column(&|r| r.2)),
    ]);
    write(&batch.unwrap(), path);
}

#[test]
fn slow_names_between_the_samples_of_the_others_have_a_clock_of_their_own() {
    const SLOW: [&str; 6] = ["TAS", "ALT", "P_STATIC", "OAT", "PROP_THRUST", "FUEL"];
    let estimates = |shift_s: f64| {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("tall")).unwrap();
        let mut rows = rows("run_03.parquet");
        for (time, _, _) in rows.iter_mut().filter(|r| SLOW.contains(&r.1.as_str())) {
            *time += shift_s;
        }
        // By name, as many archives write it.
        rows.sort_by(|a, b| a.1.cmp(&b.1));
        write_rows(&rows, &folder.path().join("tall/run_03.parquet"));
        let tables = estimates_of_both(folder.path());
        let parts = folder.path().join("wide/flight=run_03");
        assert_eq!(parts.join("part_002.parquet").exists(), shift_s != 0.0);
        let parse = |text: &str| -> Vec<Row> {
            let mut reader = csv::Reader::from_reader(text.as_bytes());
            reader.deserialize().map(Result::unwrap).collect()
        };
        for channel in parse(&tables[4]) {
            // No row of the fast names is lost to one of the slow ones.
            let lost = number(&channel, "bridged") + number(&channel, "missing");
            assert!(lost == 0.0, "{channel:?}");
        }
        parse(&tables[1])
    };
    let (on, between) = (estimates(0.0), estimates(0.0073));
    assert_eq!(on.len(), between.len());
    for (a, b) in on
        .iter()
        .zip(&between)
        .filter(|(a, _)| a["status"] == "estimated")
    {
        let change = (number(a, "value") - number(b, "value")).abs();
        let bound = number(a, "bound_corrected");
        assert!(
            change < 0.2 * bound,
            "{}: {change} of {bound}",
            a["derivative"]
        );
    }
}

#[test]
fn nothing_is_taken_over_from_the_first_aircraft() {
    let lines = |pipeline: &str| -> BTreeSet<String> {
        let yaml = files(Path::new(pipeline));
        let texts = yaml.iter().map(|file| fs::read_to_string(file).unwrap());
        let texts: Vec<String> = texts.collect();
        let lines = texts.iter().flat_map(|text| text.lines());
        let code = lines.map(|line| line.split('#').next().unwrap().trim().to_owned());
        code.filter(|line| line.len() > 3).collect()
    };
    let (first, second) = (lines("pipelines/harv"), lines("pipelines/navion"));
    // Sections, the axis of a class, and a clock in seconds are the form of the files.
    let is_form = |line: &&String| {
        line.ends_with(':')
            || line.starts_with("axis:")
            || line.starts_with("time:")
            || line.starts_with("law")
    };
    let shared: Vec<&String> = first
        .intersection(&second)
        .filter(|line| !is_form(line))
        .collect();
    assert!(shared.is_empty(), "{shared:?}");
}

#[test]
fn the_next_flight_is_planned_from_its_cards() {
    let campaign = Campaign::of_navion();
    navion().fill_store(&campaign);
    let outcome = run(campaign.command("next").args(["--minutes", "5"]));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let planned = table(&campaign.path("reports/next/next_cards.csv"));
    assert_eq!(planned.len(), 18);
    let flown = planned.iter().filter(|row| !row["place"].is_empty());
    let times: f64 = flown.map(|row| number(row, "times")).sum();
    // Cards of 36 to 40 s in five minutes less the way.
    assert!((6.0..=8.0).contains(&times), "{planned:?}");
    assert!(
        planned.iter().all(|row| row["refused"].is_empty()),
        "{planned:?}"
    );
}
