//! Shared parts of the tests of the stages: the program on temporary folders, demonstration flights
//! that can be spoiled, and tables read back.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, OnceLock};

use arrow::array::{ArrayRef, AsArray, Float64Array, RecordBatch};
use arrow::compute::{cast, concat_batches};
use arrow::datatypes::{DataType, Field, Float64Type, Schema};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

/// The recorder of the demonstration flights, Hz.
const RATE_HZ: usize = 40;

/// The program, run in the repository, so that a pipeline's relative paths hold.
pub fn harvest() -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("harvest"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

/// Exit code and output of a run.
#[derive(Debug)]
pub struct Outcome {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

pub fn run(command: &mut Command) -> Outcome {
    let output = command.output().unwrap();
    Outcome {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// A campaign of its own: folders for the archive, the store and the reports, and a pipeline where
/// it is not a shipped one.
#[derive(Debug)]
pub struct Campaign {
    folder: tempfile::TempDir,
    archive: Option<String>,
    /// Pipeline of the repository.
    shipped: &'static str,
}

impl Campaign {
    pub fn new() -> Campaign {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("flights")).unwrap();
        Campaign {
            folder,
            archive: None,
            shipped: "harv",
        }
    }

    /// A campaign of one short flight with one maneuver, pilot pitch stick steps.
    pub fn of_pitch_steps() -> Campaign {
        let campaign = Campaign::new();
        campaign.add("flight_001", &pitch_steps());
        campaign
    }

    /// A campaign of two short flights with one maneuver of each axis.
    pub fn of_both_axes() -> Campaign {
        let campaign = Campaign::of_pitch_steps();
        campaign.add("flight_004", &yaw_and_roll_steps());
        campaign
    }

    /// The demonstration campaign.
    pub fn of_demo() -> Campaign {
        Campaign::on("data/demo/flights")
    }

    /// The campaign of the second aircraft.
    pub fn of_navion() -> Campaign {
        Campaign {
            shipped: "navion",
            ..Campaign::on("data/navion/flights")
        }
    }

    /// On an archive that lies elsewhere.
    pub fn on(archive: &str) -> Campaign {
        Campaign {
            archive: Some(archive.to_owned()),
            ..Campaign::new()
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Removes all that runs have left.
    pub fn forget(&self) {
        for folder in ["store", "reports"] {
            let folder = self.path(folder);
            if folder.exists() {
                fs::remove_dir_all(folder).unwrap();
            }
        }
    }

    /// The file of a flight.
    pub fn flight(&self, flight_id: &str) -> PathBuf {
        self.path("flights").join(format!("{flight_id}.parquet"))
    }

    pub fn add(&self, flight_id: &str, record: &RecordBatch) {
        write(record, &self.flight(flight_id));
    }

    /// The program with a subcommand and this campaign's folders.
    pub fn command(&self, stage: &str) -> Command {
        let mut command = harvest();
        let own = self.path("pipeline");
        command.arg(stage).arg(if own.is_dir() {
            own
        } else {
            self.shipped.into()
        });
        match &self.archive {
            Some(archive) => command.arg("--archive").arg(archive),
            None => command.arg("--archive").arg(self.path("flights")),
        };
        command
            .arg("--store")
            .arg(self.path("store"))
            .arg("--reports")
            .arg(self.path("reports"));
        command.stdin(Stdio::null());
        command
    }

    pub fn harvest(&self, stage: &str) -> Outcome {
        run(&mut self.command(stage))
    }

    /// Runs a stage that must end with this exit code.
    pub fn ends(&self, stage: &str, code: i32) -> Outcome {
        let outcome = self.harvest(stage);
        assert_eq!(outcome.code, Some(code), "{outcome:?}");
        outcome
    }

    /// Runs a stage after estimate to its end, without rejections. So few maneuvers have no trend in most
    /// derivatives, which is in `problems` and does not change the exit code.
    pub fn finishes(&self, stage: &str) -> Outcome {
        let outcome = self.harvest(stage);
        assert!(
            outcome.code == Some(0) && outcome.stderr.is_empty(),
            "{outcome:?}"
        );
        assert!(
            self.table("problems").iter().all(|p| p["stage"] == "trend"),
            "{:?}",
            self.table("problems")
        );
        outcome
    }

    /// Makes the campaign's pipeline a copy of the shipped one, to be edited.
    pub fn copy_pipeline(&self) {
        copy_tree(
            &Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("pipelines")
                .join(self.shipped),
            &self.path("pipeline"),
        );
    }

    /// Replaces text of a pipeline's file wherever it stands; it must stand somewhere. Returns its
    /// first line.
    pub fn edit(&self, file: &str, from: &str, to: &str) -> usize {
        let path = self.path("pipeline").join(file);
        let text = fs::read_to_string(&path).unwrap();
        let line = text.split(from).next().unwrap().matches('\n').count() + 1;
        assert!(text.contains(from), "`{from}` is not in {file}");
        fs::write(&path, text.replace(from, to)).unwrap();
        line
    }

    /// The files of the pipeline's classes, relative to its folder.
    pub fn class_files(&self) -> Vec<String> {
        let names = fs::read_dir(self.path("pipeline/maneuvers")).unwrap();
        names
            .map(|e| format!("maneuvers/{}", e.unwrap().file_name().to_string_lossy()))
            .collect()
    }

    pub fn table(&self, name: &str) -> Vec<Row> {
        table(&self.path("reports").join(format!("{name}.csv")))
    }

    /// Rows of a published table from its Parquet file.
    pub fn batch(&self, name: &str) -> RecordBatch {
        let path = self.path("reports").join(format!("{name}.parquet"));
        rows_of(&path, usize::MAX)
    }

    /// Bytes of every file below a folder of the campaign, by relative path. Left out are files that
    /// depend on a clock, a process or a folder of this machine, and the nights beside the current
    /// one.
    pub fn bytes(&self, folder: &str) -> BTreeMap<PathBuf, Vec<u8>> {
        let folder = self.path(folder);
        let relative = |p: PathBuf| p.strip_prefix(&folder).unwrap().to_owned();
        let no_result = ["lock", "contents.json", "serves.json", "nights", "current"];
        let counts = |p: &PathBuf| {
            !no_result
                .iter()
                .any(|name| relative(p.clone()).starts_with(name))
        };
        files(&folder)
            .into_iter()
            .filter(counts)
            .map(|p| (relative(p.clone()), fs::read(&p).unwrap()))
            .collect()
    }

    /// Bytes of the published tables; the report, on screen and on paper, says where the archive
    /// lies.
    pub fn tables(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let is_table = |p: &PathBuf| p.extension().is_some_and(|e| e == "csv" || e == "parquet");
        self.bytes("reports")
            .into_iter()
            .filter(|(p, _)| is_table(p))
            .collect()
    }
}

/// The whole demonstration campaign, run once with one thread for all tests that look at it.
pub fn demo() -> &'static Processed {
    static DEMO: OnceLock<Processed> = OnceLock::new();
    DEMO.get_or_init(|| Processed::of(&Campaign::of_demo()))
}

/// Rows of a table of the demonstration; it must have some.
pub fn rows(table: &str) -> &'static [Row] {
    let rows = &demo().tables[table];
    assert!(!rows.is_empty(), "{table} has no rows");
    rows
}

/// Two short flights with one maneuver of each axis, run once: a store for tests of what comes after.
pub fn both_axes() -> &'static Processed {
    static BOTH_AXES: OnceLock<Processed> = OnceLock::new();
    BOTH_AXES.get_or_init(|| Processed::of(&Campaign::of_both_axes()))
}

/// Results of a run of a campaign, in memory: nothing of it stays on the disk.
#[derive(Debug)]
pub struct Processed {
    pub outcome: Outcome,
    pub tables: BTreeMap<String, Vec<Row>>,
    pub bytes: BTreeMap<PathBuf, Vec<u8>>,
    pub report: String,
    /// The report as a PDF.
    pub printed: Vec<u8>,
    store: BTreeMap<PathBuf, Vec<u8>>,
}

impl Processed {
    /// Runs a campaign with one thread.
    pub fn of(campaign: &Campaign) -> Processed {
        let outcome = run(campaign.command("run").args(["--threads", "1"]));
        let bytes = campaign.tables();
        let csv = bytes
            .keys()
            .filter(|path| path.extension().is_some_and(|e| e == "csv"));
        let names = csv.filter_map(|path| path.file_stem()?.to_str());
        Processed {
            tables: names
                .map(|name| (name.to_owned(), campaign.table(name)))
                .collect(),
            bytes: bytes.clone(),
            report: fs::read_to_string(campaign.path("reports/report.html")).unwrap(),
            printed: fs::read(campaign.path("reports/report.pdf")).unwrap(),
            store: campaign.bytes("store"),
            outcome,
        }
    }

    /// Puts what the run left in its store into a campaign's, so that only what differs is done.
    pub fn fill_store(&self, campaign: &Campaign) {
        for (path, bytes) in &self.store {
            let path = campaign.path("store").join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
    }
}

pub fn copy_tree(from: &Path, to: &Path) {
    for path in files(from) {
        let target = to.join(path.strip_prefix(from).unwrap());
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(&path, target).unwrap();
    }
}

/// All files below a folder, sorted.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// A row of a table, by column.
pub type Row = BTreeMap<String, String>;

/// A CSV table.
pub fn table(path: &Path) -> Vec<Row> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

/// The number in a column of a row.
pub fn number(row: &Row, column: &str) -> f64 {
    row[column].parse().unwrap()
}

/// The first seconds of a demonstration flight.
pub fn flight(number: u32, seconds: usize) -> RecordBatch {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join(format!("data/demo/flights/flight_{number:03}.parquet"));
    rows_of(&path, seconds * RATE_HZ)
}

/// The first rows of a Parquet file.
fn rows_of(path: &Path, rows: usize) -> RecordBatch {
    let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(path).unwrap()).unwrap();
    let schema = reader.schema().clone();
    let batches: Vec<RecordBatch> = reader
        .with_limit(rows)
        .build()
        .unwrap()
        .map(Result::unwrap)
        .collect();
    concat_batches(&schema, &batches).unwrap()
}

/// Two and a half minutes of flight 1: pilot pitch stick steps from 118.8 s to 132.5 s.
pub fn pitch_steps() -> RecordBatch {
    static FLIGHT: OnceLock<RecordBatch> = OnceLock::new();
    FLIGHT.get_or_init(|| flight(1, 150)).clone()
}

/// Two and a half minutes of flight 4: pilot yaw and roll steps from 124.6 s to 143.0 s.
pub fn yaw_and_roll_steps() -> RecordBatch {
    static FLIGHT: OnceLock<RecordBatch> = OnceLock::new();
    FLIGHT.get_or_init(|| flight(4, 155)).clone()
}

pub fn write(record: &RecordBatch, path: &Path) {
    let mut writer =
        ArrowWriter::try_new(File::create(path).unwrap(), record.schema(), None).unwrap();
    writer.write(record).unwrap();
    writer.close().unwrap();
}

/// The values of a channel.
pub fn values(record: &RecordBatch, channel: &str) -> Vec<f64> {
    let numbers = cast(record.column_by_name(channel).unwrap(), &DataType::Float64).unwrap();
    numbers
        .as_primitive::<Float64Type>()
        .iter()
        .map(|v| v.unwrap_or(f64::NAN))
        .collect()
}

/// The record with a channel's field and values replaced.
pub fn replaced(
    record: &RecordBatch,
    channel: &str,
    edit: impl FnOnce(&Field, &ArrayRef) -> (Field, ArrayRef),
) -> RecordBatch {
    let schema = record.schema();
    let at = schema.index_of(channel).unwrap();
    let (field, array) = edit(schema.field(at), record.column(at));
    let mut fields: Vec<Arc<Field>> = schema.fields().iter().cloned().collect();
    let mut columns = record.columns().to_vec();
    fields[at] = Arc::new(field);
    columns[at] = array;
    RecordBatch::try_new(Arc::new(Schema::new(fields)), columns).unwrap()
}

/// The record with other values in a channel, made from row and value.
pub fn with_values(
    record: &RecordBatch,
    channel: &str,
    value: impl Fn(usize, f64) -> f64,
) -> RecordBatch {
    let edited: Vec<f64> = values(record, channel)
        .into_iter()
        .enumerate()
        .map(|(row, v)| value(row, v))
        .collect();
    replaced(record, channel, |field, _| {
        (
            field.clone().with_data_type(DataType::Float64),
            Arc::new(Float64Array::from(edited)),
        )
    })
}

/// The record with another unit stated for a channel.
pub fn with_unit(record: &RecordBatch, channel: &str, unit: &str) -> RecordBatch {
    replaced(record, channel, |field, array| {
        let mut metadata = field.metadata().clone();
        metadata.insert("unit".to_owned(), unit.to_owned());
        (field.clone().with_metadata(metadata), array.clone())
    })
}

/// The record with a channel under another name.
pub fn renamed(record: &RecordBatch, channel: &str, name: &str) -> RecordBatch {
    replaced(record, channel, |field, array| {
        (field.clone().with_name(name), array.clone())
    })
}

/// The record without a channel.
pub fn without(record: &RecordBatch, channel: &str) -> RecordBatch {
    let at = record.schema().index_of(channel).unwrap();
    let others: Vec<usize> = (0..record.num_columns()).filter(|&i| i != at).collect();
    record.project(&others).unwrap()
}

/// Reports a test that cannot run for want of a program or server of this machine's. With `CI=true`
/// it fails instead.
pub fn skip(missing: &str) {
    let is_ci = std::env::var("CI").is_ok_and(|ci| ci == "true");
    assert!(!is_ci, "{missing}, and CI must have it");
    note_skip(missing);
}

/// Reports that a test, or a part of one, is skipped.
pub fn note_skip(missing: &str) {
    use std::io::Write as _;
    // Not by a macro, whose output is kept back where a test passes.
    let mut stderr = std::io::stderr();
    writeln!(stderr, "skipped: {missing}").unwrap();
}

/// A number that the environment may give, for tests that take as long as they are let.
pub fn from_environment(name: &str, default: usize) -> usize {
    std::env::var(name)
        .ok()
        .and_then(|value| value.parse().ok())
        .unwrap_or(default)
}

/// Random numbers that are the same each time (the generator of Steele, Lea and Flood), or others for each `HARVEST_SEED`.
#[derive(Debug)]
pub struct Random(u64);

impl Random {
    #[expect(clippy::print_stdout, reason = "a failure is repeated with this seed")]
    pub fn new(seed: u64) -> Random {
        let other = u64::try_from(from_environment("HARVEST_SEED", 0)).unwrap();
        if other > 0 {
            println!("HARVEST_SEED={other}");
        }
        Random(seed ^ other)
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 up to, and without, `below`.
    pub fn below(&mut self, below: usize) -> usize {
        usize::try_from(self.next() % u64::try_from(below.max(1)).unwrap()).unwrap()
    }

    /// From 0 to 1.
    #[expect(clippy::cast_precision_loss, reason = "a fraction")]
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}
