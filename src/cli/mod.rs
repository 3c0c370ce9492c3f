//! The command line: arguments as typed, progress bars, the few lines that a run says, exit codes.

mod cluster;
mod lab;
mod nightly;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use anyhow::Context;
use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};

use crate::config::{Config, Overrides};
use crate::lineage::Stage;
use crate::maneuver::Status;
use crate::night;
use crate::night::publish::{self, Done};
use crate::pipeline::show::{self, Subject};
use crate::pipeline::{self, Progress};
use crate::store::{Log, archive};

/// Flight-test archives in, trusted aerodynamic derivatives out.
///
/// harvest reads Parquet flight records, finds the maneuvers in them, estimates the stability and
/// control derivatives of each by maximum likelihood (output error), fits trends across angle of
/// attack, compares them with a wind-tunnel database, and writes tables (Parquet and CSV) and a
/// report (HTML).
#[derive(Debug, Parser)]
#[command(version, after_long_help = AFTER)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const AFTER: &str = "\
Every stage first brings its predecessors up to date; what is up to date is not done again, and a run that was
killed goes on where it was. What a run made is published at once, as a night; the last nights stay.

Examples:
  harvest run                                    the pipeline pipelines/harv, to the report
  harvest check my_campaign                      is pipelines/my_campaign right, and what would it do
  harvest run --archive flights/ --reports out/  the same analysis on another archive
  harvest estimate --threads 1                   as far as the tables `fits` and `estimates`
  harvest show flight flight_001                 a strip chart of the flight with its maneuvers drawn in
  harvest export                                 the flight-updated derivatives as DAVE-ML, JSBSim section, CSV, Parquet
  harvest run --quiet --wait 3600 --log nightly.jsonl
                                                 from cron or a timer: waits for another run, speaks only of errors
  harvest diff                                   what changed since the night before, and why
  harvest submit --engine slurm                  the scripts of a job array and its merge; --go hands them over
  harvest lab simulate pipelines/harv/cards.yaml --out data/simulation/campaign
                                                 a campaign whose derivatives are known

Archive and store may lie in an object store (s3://bucket/prefix) where harvest was built for it (cargo build --release
--features s3). Credentials and endpoint are read from the environment alone: AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY,
AWS_SESSION_TOKEN, AWS_REGION, AWS_ENDPOINT_URL; AWS_ALLOW_HTTP=true for an endpoint without encryption.

Exit codes:
  0  all well
  1  could not run: the configuration, the archive or the disk is at fault; the message says where
  2  ran, and something was rejected: the table `problems` and the end of the report say what and why; `verify`: what
     is published does not hold
  3  `diff`: something moved by more than its uncertainty, is gone or is another; `status`: something is stale
  75 a shard or a merge that may go well another time: the disk said no, a file could not be read, the store is in use";

/// Something moved, is stale or missing: not wrong, but somebody should look.
const LOOK: u8 = 3;

#[derive(Debug, Subcommand)]
enum Command {
    /// All stages, to the report
    Run(RunOptions),
    /// Read the archive: channels to signals on one clock, repairs, checks of units and signs
    Ingest(StageOptions),
    /// Find the maneuvers and their classes
    Segment(StageOptions),
    /// Estimate the derivatives of every maneuver
    Estimate(StageOptions),
    /// Fit least-squares trends across angle of attack
    Trend(RunOptions),
    /// Compare the trends with the wind-tunnel database
    Compare(RunOptions),
    /// Write the report
    Report(RunOptions),
    /// Write the flight-updated derivatives for simulators: DAVE-ML, a JSBSim section, CSV and
    /// Parquet
    #[command(after_help = EXPORT_HELP)]
    Export(ExportOptions),
    /// Validate a pipeline's configuration and say what it would do
    Check(Options),
    /// Say per stage what is fresh, stale or failed, and why
    Status(nightly::StatusOptions),
    /// Tell a maneuver's story: where from, which samples, what was held, how it was fitted, what
    /// it depends on
    Explain(nightly::ExplainOptions),
    /// Say what changed since the night before, and why
    Diff(nightly::DiffOptions),
    /// Say whether what is published still holds: bytes, input, configuration, code
    Verify(nightly::VerifyOptions),
    /// Show the artefacts and nights that nothing published needs, and remove them with --yes
    Gc(nightly::GcOptions),
    /// Deal a campaign's work to shards of about equal cost
    Plan(cluster::PlanOptions),
    /// Publish what the shards of a plan computed; refuses while something is missing
    Merge(cluster::MergeOptions),
    /// Write the scripts that compute a campaign on a cluster, and hand them over with --go
    Submit(cluster::SubmitOptions),
    /// Draw a strip chart of a flight or a maneuver, SVG
    #[command(subcommand)]
    Show(Show),
    /// Simulate a campaign with known derivatives, validate the bounds on it, time the estimator
    #[command(subcommand)]
    Lab(lab::LabCommand),
    #[command(hide = true)]
    Simulate(lab::Former),
    #[command(hide = true)]
    Validate(lab::Former),
    #[command(hide = true)]
    BenchCase(lab::Former),
}

#[derive(Debug, Subcommand)]
enum Show {
    /// A whole flight: motion, surfaces, pilot controls and flags, with maneuvers, repairs and the
    /// analyst's events
    #[command(after_help = FLIGHT_HELP)]
    Flight(ShowOptions),
    /// One maneuver: inputs, outputs measured and computed, residuals, with a few seconds before
    /// and after
    #[command(after_help = MANEUVER_HELP)]
    Maneuver(ShowOptions),
}

const FLIGHT_HELP: &str = "\
What is needed is brought up to date first, as far as `segment`. Maneuvers are shaded through all strips and labelled \
with class and id; where a list of events is given, it and what was found stand under each other above the strips. \
Samples that were bridged, replaced or are missing are marked at their time. However long the flight, the smallest and \
the largest sample of each column of the picture is drawn: no spike is lost.

Examples:
  harvest show flight flight_001                        into reports/harv/show/flight_001.svg
  harvest show flight flight_001 mine --out f1.svg      of the pipeline pipelines/mine, into f1.svg

Exit codes: 0 drawn; 1 not drawn, the message says why; 2 drawn, and something in the flight was rejected.";

const MANEUVER_HELP: &str = "\
What is needed is brought up to date first, as far as `estimate`. A maneuver that was rejected is shown as measured, \
with the reason in the heading. The ids are in the table `maneuvers` and over the windows of `harvest show flight`.

Examples:
  harvest show maneuver flight_001_t00118               into reports/harv/show/flight_001_t00118.svg

Exit codes: 0 drawn; 1 not drawn, the message says why; 2 drawn, and what is shown was rejected.";

#[derive(Args, Debug)]
struct ShowOptions {
    /// Its `flight_id` or `maneuver_id`, as in the tables
    #[arg(value_name = "ID")]
    id: String,
    #[command(flatten)]
    options: Options,
    /// The file to write [default: show/<ID>.svg in the folder of the reports]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

const EXPORT_HELP: &str = "\
What is needed is brought up to date first, as far as `compare`. Each derivative is the trend where flight has data and \
the tunnel elsewhere; every value is marked with its source.

  flight_updated.csv, .parquet   rows that `wind_tunnel:` reads as a database again
  flight_updated.dml             DAVE-ML (ANSI/AIAA S-119): tables, and the coefficients as their sums
  flight_updated_jsbsim.xml      JSBSim's <aerodynamics>: name it in the aircraft as <aerodynamics file=\"...\"/>

Examples:
  harvest export                                 into reports/harv/export
  harvest export mine --out model                of the pipeline pipelines/mine, into the folder model

Exit codes: 0 written; 1 not written, the message says why; 2 written, and something of the campaign was rejected.";

#[derive(Args, Debug)]
struct ExportOptions {
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    patience: Patience,
    /// The folder to write into [default: export in the folder of the reports]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

#[derive(Args, Debug)]
struct RunOptions {
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    patience: Patience,
    /// Append what happens to a file, one JSON object per line, with the time of day
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
}

#[derive(Args, Debug)]
struct StageOptions {
    #[command(flatten)]
    run: RunOptions,
    #[command(flatten)]
    share: cluster::ShareOptions,
}

#[derive(Args, Debug)]
struct Patience {
    /// Wait so long for another run to leave the store, instead of leaving at once
    #[arg(long = "wait", value_name = "SECONDS", default_value_t = 0)]
    seconds: u64,
}

impl Patience {
    fn wait(&self) -> Duration {
        Duration::from_secs(self.seconds)
    }
}

#[derive(Args, Debug)]
struct Options {
    /// The pipeline: a folder with pipeline.yaml, aircraft.yaml, model.yaml and maneuvers/, or its
    /// name under pipelines/
    #[arg(default_value = "harv")]
    pipeline: PathBuf,
    /// Flight archive instead of the pipeline's: a folder or a glob of Parquet files, also
    /// partitioned as flight=…/; or the same in an object store, s3://bucket/prefix
    #[arg(long)]
    archive: Option<String>,
    /// Wind-tunnel database instead of the pipeline's: DAVE-ML (.dml, .xml), or CSV or Parquet with
    /// derivative, alpha_deg, value, unit[, mach, uncertainty, source]
    #[arg(long, value_name = "FILE")]
    wind_tunnel: Option<PathBuf>,
    /// The analyst's events instead of the pipeline's: CSV with flight_id, class, start_s, end_s
    #[arg(long, value_name = "FILE")]
    events: Option<PathBuf>,
    /// Folder with the tables of an earlier campaign or night to compare with, besides the tunnel;
    /// may be given again
    #[arg(long, value_name = "FOLDER")]
    against: Vec<PathBuf>,
    /// Folder of the intermediate artefacts, or a place in an object store, s3://bucket/prefix
    /// [default: data/store/<pipeline>]
    #[arg(long, value_name = "FOLDER")]
    store: Option<PathBuf>,
    /// Of a store in an object store: the folder that keeps what was fetched or made here [default:
    /// data/store/<pipeline>]
    #[arg(long, value_name = "FOLDER")]
    store_cache: Option<PathBuf>,
    /// Folder of the tables and the report [default: reports/<pipeline>]
    #[arg(long, value_name = "FOLDER")]
    reports: Option<PathBuf>,
    /// Number of threads; results do not depend on it [default: all cores]
    #[arg(long, short = 'j', visible_alias = "jobs", value_name = "N")]
    threads: Option<usize>,
    /// What reading flights may hold in memory at once, over all of them, instead of the
    /// pipeline's; results do not depend on it
    #[arg(long, value_name = "MB")]
    memory_mb: Option<f64>,
    /// No progress bars and no summary
    #[arg(long, short)]
    quiet: bool,
}

/// Runs the program.
#[must_use]
#[expect(clippy::print_stderr, reason = "the one place where an error is said")]
pub fn main() -> ExitCode {
    crate::memory::keep();
    match run(Cli::parse().command) {
        Ok(code) => code,
        Err(error) => {
            if let Some(usage) = error.downcast_ref::<clap::Error>() {
                usage.exit();
            }
            eprintln!("harvest: {error:#}");
            ExitCode::from(1)
        }
    }
}

fn run(command: Command) -> anyhow::Result<ExitCode> {
    let (until, options) = match command {
        Command::Run(options) | Command::Report(options) => (Stage::Report, options),
        Command::Ingest(options) => return stage(Stage::Ingest, &options),
        Command::Segment(options) => return stage(Stage::Segment, &options),
        Command::Estimate(options) => return stage(Stage::Estimate, &options),
        Command::Trend(options) => (Stage::Trend, options),
        Command::Compare(options) => (Stage::Compare, options),
        Command::Status(options) => return nightly::status(&options),
        Command::Explain(options) => return nightly::explain(&options),
        Command::Diff(options) => return nightly::diff(&options),
        Command::Verify(options) => return nightly::verify(&options),
        Command::Gc(options) => return nightly::gc(&options),
        Command::Plan(options) => return cluster::plan(&options),
        Command::Merge(options) => return cluster::merge(&options),
        Command::Submit(options) => return cluster::submit(&options),
        Command::Export(options) => return export(&options),
        Command::Check(options) => return check(&options),
        Command::Lab(command) => return lab::run(&command),
        Command::Simulate(_) => return Err(renamed("simulate", "simulate")),
        Command::Validate(_) => return Err(renamed("validate", "validate")),
        Command::BenchCase(_) => return Err(renamed("bench-case", "bench")),
        Command::Show(Show::Flight(options)) => return picture(Subject::Flight, &options),
        Command::Show(Show::Maneuver(options)) => return picture(Subject::Maneuver, &options),
    };
    logged(until, &options)
}

/// Usage error for a command that moved to the laboratory.
fn renamed(former: &str, name: &str) -> anyhow::Error {
    let message = format!("`harvest {former}` is now `harvest lab {name}`");
    let error = Cli::command().error(ErrorKind::InvalidSubcommand, message);
    error.into()
}

/// A stage of the whole campaign, or of one shard.
fn stage(until: Stage, options: &StageOptions) -> anyhow::Result<ExitCode> {
    let shard = options
        .share
        .work(until, &options.run.options, &options.run.patience);
    shard.unwrap_or_else(|| logged(until, &options.run))
}

fn logged(until: Stage, options: &RunOptions) -> anyhow::Result<ExitCode> {
    let log = options.log.as_deref().map(Log::open).transpose()?;
    let done = brought(until, options, log.as_ref());
    if let (Some(log), Err(error)) = (&log, &done) {
        log.write(
            "end",
            &[("exit", 1.into()), ("error", format!("{error:#}").into())],
        );
    }
    let code = done?;
    match log.and_then(|log| log.failure()) {
        Some(failure) => Err(failure.into()),
        None => Ok(code),
    }
}

/// Brings a pipeline up to date as far as a stage, and says so to the terminal and the log.
fn brought(until: Stage, options: &RunOptions, log: Option<&Log>) -> anyhow::Result<ExitCode> {
    let (begun, quiet) = (Instant::now(), options.options.quiet);
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    if let Some(log) = log {
        let folders = [
            config.shared_store.as_ref().unwrap_or(&config.store),
            &config.reports,
        ]
        .map(|f| f.display().to_string());
        let [store, reports] = folders;
        log.write(
            "begin",
            &[
                ("pipeline", config.name.as_str().into()),
                ("until", until.name().into()),
                ("version", env!("CARGO_PKG_VERSION").into()),
                ("source", env!("HARVEST_SOURCE").into()),
                ("archive", config.archive.as_str().into()),
                ("store", store.into()),
                ("reports", reports.into()),
                ("threads", rayon::current_num_threads().into()),
            ],
        );
    }
    let bars = Bars::new(quiet, log);
    let done = night::run(&config, until, options.patience.wait(), &bars)?;
    if !quiet {
        summary(&config, &done, until);
    }
    let exit = if done.rejected() { 2 } else { 0 };
    if let Some(log) = log {
        said(log, &done, exit, begun);
    }
    Ok(ExitCode::from(exit))
}

/// What a run that came to its end has to say to the log.
fn said(log: &Log, done: &Done, exit: u8, begun: Instant) {
    let summary = &done.summary;
    for problem in &summary.problems {
        let (stage, flight) = (problem.stage.name(), problem.flight_id.as_str());
        let (place, reason) = (problem.place.as_str(), problem.reason.as_str());
        log.write(
            "problem",
            &[
                ("stage", stage.into()),
                ("flight", flight.into()),
                ("place", place.into()),
                ("reason", reason.into()),
            ],
        );
    }
    log.write(
        "night",
        &[
            ("night", done.night.as_str().into()),
            ("new", done.is_new.into()),
            ("alert", summary.alert.into()),
        ],
    );
    log.write(
        "end",
        &[
            ("exit", exit.into()),
            ("seconds", begun.elapsed().as_secs_f64().into()),
            ("artefacts_made", done.made.into()),
            ("flights", summary.flights.into()),
            ("refused", summary.refused.into()),
            ("maneuvers", summary.maneuvers.into()),
            ("converged", summary.converged.into()),
            ("problems", summary.problems.len().into()),
        ],
    );
}

fn start_threads(threads: Option<usize>) -> anyhow::Result<()> {
    if let Some(threads) = threads {
        anyhow::ensure!(threads > 0, "--threads must be at least 1");
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .context("cannot start the threads")?;
    }
    Ok(())
}

/// Writes the derivatives for simulators and says where they are.
#[expect(clippy::print_stdout, reason = "what an export says")]
fn export(options: &ExportOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    let bars = Bars::new(options.options.quiet, None);
    let folder = options
        .out
        .clone()
        .unwrap_or_else(|| config.reports.join("export"));
    let exported = pipeline::export::export(&config, &folder, options.patience.wait(), &bars)?;
    if !options.options.quiet {
        println!(
            "{} values, {} of them from flight",
            exported.values, exported.flight
        );
        if !exported.missing.is_empty() {
            println!("without any value: {}", exported.missing.join(" "));
        }
        for file in &exported.files {
            println!("{}", file.display());
        }
    }
    Ok(if publish::rejected(&exported.problems) {
        ExitCode::from(2)
    } else {
        ExitCode::SUCCESS
    })
}

/// Draws a flight or a maneuver and says where the picture is.
#[expect(clippy::print_stdout, reason = "what a picture says")]
fn picture(subject: fn(String) -> Subject, options: &ShowOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    let bars = Bars::new(options.options.quiet, None);
    let picture = show::show(
        &config,
        &subject(options.id.clone()),
        options.out.as_deref(),
        &bars,
    )?;
    if !options.options.quiet {
        for problem in &picture.problems {
            println!("  {}: {}: {}", problem.stage, problem.place, problem.reason);
        }
        println!("picture: {}", picture.path.display());
    }
    Ok(if picture.problems.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(2)
    })
}

impl Options {
    /// Pipeline and options as they are typed, without those of the terminal: for a script that is
    /// to do the same.
    fn typed(&self) -> Vec<String> {
        let path = |path: &Path| path.display().to_string();
        let options = [
            ("--archive", self.archive.clone()),
            ("--wind-tunnel", self.wind_tunnel.as_deref().map(path)),
            ("--events", self.events.as_deref().map(path)),
            ("--store", self.store.as_deref().map(path)),
            ("--store-cache", self.store_cache.as_deref().map(path)),
            ("--reports", self.reports.as_deref().map(path)),
            ("--memory-mb", self.memory_mb.map(|mb| mb.to_string())),
        ];
        let against = self
            .against
            .iter()
            .map(|folder| ("--against", Some(path(folder))));
        let given = options
            .into_iter()
            .chain(against)
            .filter_map(|(name, value)| Some([name.to_owned(), value?]));
        std::iter::once(path(&self.pipeline))
            .chain(given.flatten())
            .collect()
    }

    fn load(&self) -> anyhow::Result<Config> {
        let folder = if self.pipeline.is_dir() {
            self.pipeline.clone()
        } else {
            Path::new("pipelines").join(&self.pipeline)
        };
        anyhow::ensure!(
            folder.is_dir(),
            "there is no pipeline {}: give a folder, or the name of one under pipelines/",
            self.pipeline.display()
        );
        let overrides = Overrides {
            archive: self.archive.clone(),
            wind_tunnel: self.wind_tunnel.clone(),
            store: self.store.clone(),
            store_cache: self.store_cache.clone(),
            reports: self.reports.clone(),
            events: self.events.clone(),
            against: self.against.clone(),
            memory_mb: self.memory_mb,
        };
        Ok(Config::load(&folder, overrides)?)
    }
}

#[expect(clippy::print_stdout, reason = "what a run says")]
fn summary(config: &Config, done: &Done, until: Stage) {
    let campaign = &done.summary;
    println!("{} flights, {} refused", campaign.flights, campaign.refused);
    if until >= Stage::Segment {
        println!("{} maneuvers", campaign.maneuvers);
    }
    if until >= Stage::Estimate {
        println!("{} of them converged", campaign.converged);
    }
    for problem in campaign.problems.iter().take(10) {
        let place = [problem.flight_id.as_str(), problem.place.as_str()].map(str::trim);
        let place: Vec<&str> = place.into_iter().filter(|s| !s.is_empty()).collect();
        println!(
            "  {}: {}: {}",
            problem.stage,
            place.join(", "),
            problem.reason
        );
    }
    if campaign.problems.len() > 10 {
        println!(
            "  and {} more in {}",
            campaign.problems.len() - 10,
            config.reports.join("problems.csv").display()
        );
    }
    if !done.is_new {
        println!("nothing new: night {} holds", done.night);
    }
    println!("tables in {}", config.reports.display());
    if let Some(report) = &done.report {
        println!("report: {}", report.display());
    }
}

/// Says what a pipeline would do.
#[expect(clippy::print_stdout, reason = "what a check says")]
fn check(options: &Options) -> anyhow::Result<ExitCode> {
    let config = options.load()?;
    let flights = archive::find(&config.archive)?;
    println!("pipeline   {}: {}", config.name, config.title);
    println!("archive    {}: {} flights", config.archive, flights.len());
    println!(
        "aircraft   {}, {} channels",
        config.aircraft.name,
        config.channels.len()
    );
    println!(
        "model      {} derivatives, {} biases",
        config.buildup.derivatives.len(),
        config.buildup.biases.len()
    );
    println!("tunnel     {}", config.wind_tunnel.display());
    println!(
        "events     {}",
        if config.events.is_empty() {
            "found in the records".into()
        } else {
            format!("{} given", config.events.len())
        }
    );
    println!("classes    estimated  held  inactive");
    for class in &config.classes {
        let count = |status| class.statuses.values().filter(|s| **s == status).count();
        let [free, held, inactive] = [Status::Estimated, Status::Held, Status::Inactive].map(count);
        println!(
            "  {:<10} {free:>7} {held:>5} {inactive:>9}  {}",
            class.name, class.title
        );
    }
    match &config.shared_store {
        Some(shared) => println!(
            "store      {}, kept in {}",
            shared.display(),
            config.store.display()
        ),
        None => println!("store      {}", config.store.display()),
    }
    println!("reports    {}", config.reports.display());
    if let Some(warning) = config.estimate.hold.warning() {
        println!("note       {warning}");
    }
    println!("The configuration is right.");
    Ok(ExitCode::SUCCESS)
}

/// A progress bar per stage on the terminal, nothing where there is none; and a line per stage in
/// the log.
struct Bars<'a> {
    quiet: bool,
    log: Option<&'a Log>,
    bar: Mutex<ProgressBar>,
    stage: Mutex<Option<(String, usize, Instant)>>,
}

impl Bars<'_> {
    fn new(quiet: bool, log: Option<&Log>) -> Bars<'_> {
        Bars {
            quiet,
            log,
            bar: Mutex::new(ProgressBar::hidden()),
            stage: Mutex::new(None),
        }
    }

    fn with(&self, act: impl FnOnce(&mut ProgressBar)) {
        if let Ok(mut bar) = self.bar.lock() {
            act(&mut bar);
        }
    }
}

impl Progress for Bars<'_> {
    fn begin(&self, stage: &str, items: usize) {
        if let Ok(mut begun) = self.stage.lock() {
            *begun = Some((stage.to_owned(), items, Instant::now()));
        }
        let new = if self.quiet {
            ProgressBar::hidden()
        } else {
            ProgressBar::new(items as u64)
        };
        if let Ok(style) = ProgressStyle::with_template(
            "{prefix:>9} {bar:32} {pos:>4}/{len:<4} {elapsed:>4}  {wide_msg}",
        ) {
            new.set_style(style);
        }
        new.set_prefix(stage.to_owned());
        self.with(|bar| *bar = new);
    }

    fn advance(&self, item: &str) {
        self.with(|bar| {
            bar.set_message(item.to_owned());
            bar.inc(1);
        });
    }

    fn end(&self) {
        let begun = self.stage.lock().ok().and_then(|mut begun| begun.take());
        if let (Some(log), Some((stage, items, begun))) = (self.log, begun) {
            let seconds = begun.elapsed().as_secs_f64();
            log.write(
                "stage",
                &[
                    ("stage", stage.into()),
                    ("items", items.into()),
                    ("seconds", seconds.into()),
                ],
            );
        }
        self.with(|bar| bar.finish_with_message(""));
    }
}
