//! The command line: commands and options, progress bars, printed output, exit codes.

#[macro_use]
mod terminal;

mod bars;
mod printed_changes;
mod check_command;
mod cluster_commands;
mod export_command;
mod import_command;
mod init_command;
mod lab;
mod manual_command;
mod next_command;
mod night_commands;
mod options;
mod run_commands;
mod run_summary;
mod show_command;
mod signals;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};

use self::export_command::{EXPORT_HELP, ExportOptions};
use self::options::{Options, USAGE};
use self::run_commands::{RunOptions, StageOptions, run_campaign, run_stage};
use self::show_command::Show;
use crate::lineage::Stage;

/// Flight-test archives in, trusted aerodynamic derivatives out.
///
/// harvest reads Parquet flight records and finds the maneuvers in them. It estimates the stability
/// and control derivatives of each maneuver by maximum likelihood: output error, and filter error
/// in gusts. It fits trends across angle of attack and fuses flights and wind tunnel. It writes
/// tables (Parquet and CSV) and a report (HTML and PDF).
#[derive(Debug, Parser)]
#[command(version = VERSION, after_long_help = AFTER)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// Version with the fingerprint of the sources that the lineage of a night states.
const VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    " (sources ",
    env!("HARVEST_SOURCE"),
    ")"
);

const AFTER: &str = "\
Every stage first brings its predecessors up to date. Work that is up to date is not repeated, and a run that was killed \
continues where it stopped. The results of a run are published at once, as a night; the last nights stay.

Examples:
  harvest run                                    the pipeline pipelines/harv, to the report
  harvest import runs/*.csv --to flights/        Parquet of the archive from CSV, MATLAB, HDF5 or tall Parquet
  harvest init my_campaign --from flights/       a draft of pipelines/my_campaign, from the recordings alone
  harvest check my_campaign                      validate pipelines/my_campaign and list what it uses
  harvest run --archive flights/ --reports out/  the same analysis on another archive
  harvest estimate --threads 1                   as far as the tables `fits` and `estimates`
  harvest show flight flight_001                 a strip chart of the flight with its maneuvers drawn in
  harvest export                                 the flight-updated derivatives as DAVE-ML, JSBSim section, CSV, Parquet
  harvest next --minutes 45                      the cards of the next flight, with a page for the kneeboard
  harvest run --quiet --wait 3600 --log nightly.jsonl
                                                 from cron or a timer: waits for another run, prints only errors
  harvest diff                                   the changes since the night before, with their causes
  harvest submit --engine slurm                  the scripts of a job array and its merge; --go submits them
  harvest lab simulate pipelines/harv/cards.yaml --out data/simulation/campaign
                                                 a campaign whose derivatives are known

Archive and store may lie in an object store (s3://bucket/prefix) where harvest was built for it (cargo build --release \
--features s3). Credentials and endpoint are read from the environment alone: AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, \
AWS_SESSION_TOKEN, AWS_REGION, AWS_ENDPOINT_URL; AWS_ALLOW_HTTP=true for an endpoint without encryption.

Exit codes:
  0  all well
  1  could not run: a fault of the configuration, the archive or the disk, named in the message
  2  ran, and something was rejected: the table `problems` and the end of the report list it; `verify`: what
     is published is no longer valid
     `check`: a run would refuse every flight
     A signal that a recording lacks, and a derivative with too few maneuvers for a trend, are in `problems` as
     well, and end with 0
  3  `diff`: a value moved by more than its uncertainty, vanished or changed; `status`: something is stale
  64 the command as typed is wrong; nothing was done
  75 a shard or a merge that a repetition may complete: the disk failed, a file could not be read, the store is in use";

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
    /// Fuse tunnel and flights to the posterior of every derivative
    Model(RunOptions),
    /// Fit least-squares trends across angle of attack
    Trend(RunOptions),
    /// Judge the flying qualities of the posterior, with the probability of each level
    Qualities(RunOptions),
    /// Fly every maneuver again by a simulator, and judge the match by tolerances
    Match(RunOptions),
    /// Compare the posterior and each maneuver with the wind tunnel, and trends with earlier campaigns
    Compare(RunOptions),
    /// Write the report
    Report(RunOptions),
    /// Write the flight-updated derivatives for simulators: DAVE-ML, a JSBSim section, CSV and
    /// Parquet
    #[command(after_help = EXPORT_HELP)]
    Export(ExportOptions),
    /// Plan the next flight: the test cards that add most information in its minutes
    #[command(after_help = next_command::NEXT_HELP)]
    Next(next_command::NextOptions),
    /// Write recordings of other formats (CSV, MATLAB, HDF5, tall Parquet) as Parquet of the archive
    #[command(after_help = import_command::IMPORT_HELP)]
    Import(import_command::ImportOptions),
    /// Draft a pipeline for a recorder that harvest has not seen
    #[command(after_help = init_command::INIT_HELP)]
    Init(init_command::InitOptions),
    /// Validate a pipeline's configuration and list what it uses
    Check(Options),
    /// Count the fresh, stale and failed artefacts of each stage, with the reasons
    Status(night_commands::StatusOptions),
    /// Explain a maneuver: origin, samples, fit, derivatives, dependencies
    Explain(night_commands::ExplainOptions),
    /// List the changes since the night before, with their causes
    Diff(night_commands::DiffOptions),
    /// Check that a published night is still valid: bytes, input, configuration, code
    Verify(night_commands::VerifyOptions),
    /// List the artefacts and nights that nothing published needs, and remove them with --yes
    Gc(night_commands::GcOptions),
    /// Divide a campaign's work into shards of about equal cost
    Plan(cluster_commands::PlanOptions),
    /// Publish what the shards of a plan computed; refuses while something is missing
    Merge(cluster_commands::MergeOptions),
    /// Write the scripts that compute a campaign on a cluster, and hand them over with --go
    Submit(cluster_commands::SubmitOptions),
    /// Draw a strip chart of a flight or a maneuver, SVG
    #[command(subcommand)]
    Show(Show),
    /// Write man pages and shell completions; `make install` calls it
    Manual(manual_command::ManualOptions),
    /// Simulate a campaign with known derivatives, validate the bounds on it, time the estimator
    #[command(subcommand)]
    Lab(lab::LabCommand),
    #[command(hide = true)]
    Simulate(lab::IgnoredArguments),
    #[command(hide = true)]
    Validate(lab::IgnoredArguments),
    #[command(hide = true)]
    BenchCase(lab::IgnoredArguments),
}

/// Runs the program.
#[must_use]
pub fn main() -> ExitCode {
    crate::memory::keep_freed_memory();
    // Without it the limit ends the program, and nothing else changes.
    let _ = signals::outlive_file_limits();
    let code = match Cli::try_parse() {
        Ok(cli) => run(cli.command).unwrap_or_else(|error| report(&error)),
        Err(error) => explain_usage(&error),
    };
    terminal::finished(code)
}

/// Prints an error that stopped a command.
fn report(error: &anyhow::Error) -> ExitCode {
    if let Some(usage) = error.downcast_ref::<clap::Error>() {
        return explain_usage(usage);
    }
    err!("harvest: {error:#}");
    ExitCode::from(1)
}

/// Prints help that was asked for, or the mistake in the command as typed.
fn explain_usage(usage: &clap::Error) -> ExitCode {
    if usage.use_stderr() {
        // Without a terminal to print on, the exit code remains.
        let _ = usage.print();
        ExitCode::from(USAGE)
    } else {
        terminal::note(usage.print());
        ExitCode::SUCCESS
    }
}

fn run(command: Command) -> anyhow::Result<ExitCode> {
    let (until, options) = match command {
        Command::Run(options) | Command::Report(options) => (Stage::Report, options),
        Command::Ingest(options) => return run_stage(Stage::Ingest, &options),
        Command::Segment(options) => return run_stage(Stage::Segment, &options),
        Command::Estimate(options) => return run_stage(Stage::Estimate, &options),
        Command::Model(options) => (Stage::Model, options),
        Command::Trend(options) => (Stage::Trend, options),
        Command::Qualities(options) => (Stage::Qualities, options),
        Command::Match(options) => (Stage::Match, options),
        Command::Compare(options) => (Stage::Compare, options),
        Command::Status(options) => return night_commands::status(&options),
        Command::Explain(options) => return night_commands::explain(&options),
        Command::Diff(options) => return night_commands::diff(&options),
        Command::Verify(options) => return night_commands::verify(&options),
        Command::Gc(options) => return night_commands::gc(&options),
        Command::Plan(options) => return cluster_commands::plan(&options),
        Command::Merge(options) => return cluster_commands::merge(&options),
        Command::Submit(options) => return cluster_commands::submit(&options),
        Command::Export(options) => return export_command::export(&options),
        Command::Next(options) => return next_command::next(&options),
        Command::Import(options) => return import_command::import(&options),
        Command::Manual(options) => return manual_command::manual(Cli::command(), &options),
        Command::Init(options) => return init_command::init(&options),
        Command::Check(options) => return check_command::check(&options),
        Command::Lab(command) => return lab::run(&command),
        Command::Simulate(_) => return Err(renamed("simulate", "simulate")),
        Command::Validate(_) => return Err(renamed("validate", "validate")),
        Command::BenchCase(_) => return Err(renamed("bench-case", "bench")),
        Command::Show(command) => return show_command::show(&command),
    };
    run_campaign(until, &options)
}

/// Usage error for a command that moved to the laboratory.
fn renamed(former: &str, name: &str) -> anyhow::Error {
    let message = format!("`harvest {former}` is now `harvest lab {name}`");
    let error = Cli::command().error(ErrorKind::InvalidSubcommand, message);
    error.into()
}
