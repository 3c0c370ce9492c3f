//! The commands of the laboratory: a simulated campaign, the study of the bounds, the timing of the
//! standard case.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Subcommand};

use super::bars::Bars;
use super::options::{REJECTED, start_threads};
use crate::error::Problem;
use crate::lab::campaign::{self, SimulatedCampaign};
use crate::lab::{bounds_study, standard_case};
use crate::store::{atomic, files};
use crate::tables;

#[derive(Debug, Subcommand)]
pub enum LabCommand {
    /// Fly a campaign of test cards: archive, wind-tunnel database, true derivatives
    Simulate(SimulateOptions),
    /// Measure the coverage of the intervals: simulated maneuvers, flown and recorded many times under
    /// the cards' conditions and estimated
    Validate(ValidateOptions),
    /// Time the estimate of a maneuver given as JSON with its record as CSV beside it
    Bench(BenchOptions),
    /// Write the page that explains the tables, Markdown
    Tables(TablesOptions),
}

#[derive(Args, Debug)]
pub struct SimulateOptions {
    /// Test cards, YAML
    cards: PathBuf,
    /// Folder for flights/, wind_tunnel.csv and truth/
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    #[command(flatten)]
    execution: Execution,
}

#[derive(Args, Debug)]
pub struct ValidateOptions {
    /// Test cards, YAML; their key `study` lists the conditions and sets the number of records and of
    /// test points
    cards: PathBuf,
    /// Folder for the tables `conditions`, `coverage` and `starts`
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Page to write, Markdown
    #[arg(long, value_name = "FILE")]
    page: PathBuf,
    /// Records of each maneuver, instead of the cards' number
    #[arg(long, value_name = "N")]
    realisations: Option<usize>,
    #[command(flatten)]
    execution: Execution,
}

#[derive(Args, Debug)]
pub struct BenchOptions {
    /// The case, JSON, with a CSV of the same name beside it; or a folder of cases, estimated in
    /// parallel
    case: PathBuf,
    /// Number of timed estimates of each case
    #[arg(long, value_name = "N", default_value_t = 20)]
    repetitions: usize,
    /// File to write [default: the terminal]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Number of threads; results do not depend on it [default: all cores]
    #[arg(long, short = 'j', visible_alias = "jobs", value_name = "N")]
    threads: Option<usize>,
}

#[derive(Args, Debug)]
pub struct TablesOptions {
    /// File to write [default: the terminal]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Args, Debug)]
struct Execution {
    /// Number of threads; results do not depend on it [default: all cores]
    #[arg(long, short = 'j', visible_alias = "jobs", value_name = "N")]
    threads: Option<usize>,
    /// No progress bars and no summary
    #[arg(long, short)]
    quiet: bool,
}

/// Arguments of a command under its former name, ignored.
#[derive(Args, Debug)]
pub struct IgnoredArguments {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

/// Runs a command of the laboratory.
pub fn run(command: &LabCommand) -> anyhow::Result<ExitCode> {
    match command {
        LabCommand::Simulate(options) => simulate(options),
        LabCommand::Validate(options) => validate(options),
        LabCommand::Bench(options) => bench(options),
        LabCommand::Tables(options) => write_or_print(options.out.as_deref(), &tables::page()),
    }
}

fn simulate(options: &SimulateOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.execution.threads)?;
    let simulated = SimulatedCampaign::load(&options.cards)?;
    let bars = Bars::new(options.execution.quiet, None);
    let flights = campaign::run(&simulated, &options.out, &bars)?;
    let problems: Vec<&Problem> = flights.iter().flat_map(|f| &f.problems).collect();
    if !options.execution.quiet {
        let flown: usize = flights.iter().map(|f| f.flown.len()).sum();
        out!("{} flights, {flown} maneuvers", flights.len());
        for problem in &problems {
            out!(
                "  {}: {}: {}",
                problem.flight_id,
                problem.place,
                problem.reason
            );
        }
        out!("campaign in {}", options.out.display());
    }
    Ok(exit_code(problems.is_empty()))
}

fn validate(options: &ValidateOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.execution.threads)?;
    let mut simulated = SimulatedCampaign::load(&options.cards)?;
    if let Some(realisations) = options.realisations {
        simulated.cards.study.realisations = realisations;
    }
    let realisations = simulated.cards.study.realisations;
    anyhow::ensure!(realisations > 1, "a scatter needs two realisations or more");
    let conditions = &simulated.cards.study.conditions;
    anyhow::ensure!(
        !conditions.is_empty(),
        "`study: conditions:` of the cards lists no condition"
    );
    let bars = Bars::new(options.execution.quiet, None);
    let command = format!(
        "harvest lab validate {} --realisations {realisations}",
        options.cards.display(),
    );
    let study = bounds_study::run(&simulated, &options.out, &options.page, &command, &bars)?;
    if !options.execution.quiet {
        for problem in &study.problems {
            out!("  {}: {}", problem.place, problem.reason);
        }
        out!(
            "tables in {}\npage: {}",
            options.out.display(),
            options.page.display()
        );
    }
    Ok(exit_code(study.problems.is_empty()))
}

fn bench(options: &BenchOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.threads)?;
    let (case, repetitions) = (&options.case, options.repetitions);
    let text = if files::is_folder(case) {
        serde_json::to_string_pretty(&standard_case::batch(case, repetitions)?)?
    } else {
        let case = standard_case::load(case)?;
        let timed = standard_case::timed(&case, repetitions).map_err(anyhow::Error::msg)?;
        serde_json::to_string_pretty(&timed)?
    };
    write_or_print(options.out.as_deref(), &text)
}

fn write_or_print(file: Option<&Path>, text: &str) -> anyhow::Result<ExitCode> {
    match file {
        Some(file) => {
            atomic::place(file, text.as_bytes())?;
        }
        None => out!("{}", text.trim_end()),
    }
    Ok(ExitCode::SUCCESS)
}

fn exit_code(all_flown: bool) -> ExitCode {
    if all_flown {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(REJECTED)
    }
}
