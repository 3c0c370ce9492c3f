//! The commands `plan`, `merge` and `submit`, and the options `--plan` and `--shard`.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::Context;
use clap::{Args, ValueEnum};

use super::bars::Bars;
use super::options::{
    ATTENTION, Options, REJECTED, TRY_AGAIN, WaitOptions, exit_code, start_threads,
};
use super::run_summary::print_summary;
use crate::cluster::plan::{DealtKind, Shard, ShardPlan, array};
use crate::cluster::scripts::{self, CampaignCommands, LARGEST_ARRAY};
use crate::cluster::shard;
use crate::config::Config;
use crate::error::Error;
use crate::lineage::Stage;
use crate::store::{atomic, files};

#[derive(Args, Debug)]
pub struct PlanOptions {
    #[command(flatten)]
    options: Options,
    /// Work to divide: `flights` (ingest and segment), or `maneuvers` (estimate)
    #[arg(long, value_enum)]
    of: DealtArgument,
    /// Number of shards [default: the pipeline's `cluster: shards:`]
    #[arg(long, value_name = "N")]
    shards: Option<usize>,
    /// The file to write [default: flights.plan.json or maneuvers.plan.json in the store]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum DealtArgument {
    Flights,
    Maneuvers,
}

/// Options to compute one shard instead of the whole campaign.
#[derive(Args, Debug)]
pub struct ShareOptions {
    /// Compute a shard of this plan into the store, and publish nothing; exit code 75: a
    /// repetition may complete it
    #[arg(long, value_name = "FILE", requires = "shard")]
    plan: Option<PathBuf>,
    /// The shard and the number of shards: 3/24
    #[arg(long, value_name = "I/N", requires = "plan")]
    shard: Option<Shard>,
}

#[derive(Args, Debug)]
pub struct MergeOptions {
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    wait_options: WaitOptions,
    /// The plan of maneuvers
    #[arg(long, value_name = "FILE")]
    plan: PathBuf,
}

#[derive(Args, Debug)]
pub struct SubmitOptions {
    #[command(flatten)]
    options: Options,
    /// The scheduler: slurm; or pbs, whose scripts have never been run on a PBS
    #[arg(long, value_enum)]
    engine: Scheduler,
    /// Hand the jobs over; without it the scripts are written and nothing is run
    #[arg(long)]
    go: bool,
    /// The folder of the scripts and of the tasks' logs [default: cluster in the store]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Scheduler {
    Slurm,
    /// Untested
    Pbs,
}

fn plan_file(config: &Config, of: DealtKind) -> PathBuf {
    // A shared store is seen by all machines.
    config
        .shared_store
        .as_ref()
        .unwrap_or(&config.store)
        .join(format!("{}.plan.json", of.name()))
}

/// Deals a campaign's work to shards and prints the plan's file.
pub fn plan(options: &PlanOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    let of = match options.of {
        DealtArgument::Flights => DealtKind::Flights,
        DealtArgument::Maneuvers => DealtKind::Maneuvers,
    };
    let file = options
        .out
        .clone()
        .unwrap_or_else(|| plan_file(&config, of));
    let shards = options.shards.unwrap_or(config.cluster.shards);
    anyhow::ensure!(shards > 0, "--shards must be at least 1");
    let plan = shard::deal(
        &config,
        of,
        shards,
        &file,
        &Bars::new(options.options.quiet, None),
    )?;
    if !options.options.quiet {
        print_plan(&plan, &file);
    }
    Ok(ExitCode::SUCCESS)
}

fn print_plan(plan: &ShardPlan, file: &Path) {
    let costs = plan.costs();
    let largest_cost = costs.values().copied().fold(0.0, f64::max);
    let mean = costs.values().sum::<f64>() / costs.len() as f64;
    out!(
        "{} {} to {} shards, the most expensive {:.2} times the mean",
        plan.items.len(),
        plan.of.name(),
        plan.shards,
        largest_cost / mean
    );
    out!("plan: {}", file.display());
}

impl ShareOptions {
    /// Computes the shard that the options name; `None` without a shard.
    pub fn compute(
        &self,
        until: Stage,
        options: &Options,
        wait_options: &WaitOptions,
    ) -> Option<anyhow::Result<ExitCode>> {
        let (plan, shard) = (self.plan.as_deref()?, self.shard?);
        Some(match compute(plan, shard, until, options, wait_options) {
            Err(error)
                if error
                    .downcast_ref::<Error>()
                    .is_some_and(Error::is_transient) =>
            {
                Ok(ask_for_another_try(&error))
            }
            done => done,
        })
    }
}

fn ask_for_another_try(error: &anyhow::Error) -> ExitCode {
    err!("harvest: {error:#}; a repetition may succeed");
    ExitCode::from(TRY_AGAIN)
}

fn compute(
    file: &Path,
    shard: Shard,
    until: Stage,
    options: &Options,
    wait_options: &WaitOptions,
) -> anyhow::Result<ExitCode> {
    start_threads(options.threads)?;
    let config = options.load()?;
    let plan = shard::read_plan(file)?;
    anyhow::ensure!(
        until <= plan.of.last_stage()
            && (until == Stage::Estimate) == (plan.of == DealtKind::Maneuvers),
        "{} is a plan of {}: its shards are for `harvest {}`",
        file.display(),
        plan.of.name(),
        plan.of.last_stage().name()
    );
    let made = shard::compute(
        &config,
        &plan,
        shard,
        until,
        wait_options.longest_wait(),
        &Bars::new(options.quiet, None),
    )?;
    if !options.quiet {
        let share = plan.share(shard.number).count();
        out!(
            "shard {}/{}: {share} {}, {made} artefacts made",
            shard.number,
            shard.of,
            plan.of.name()
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// Prints the shards with missing artefacts, as schedulers write an array.
pub fn missing(options: &Options, file: &Path) -> anyhow::Result<ExitCode> {
    start_threads(options.threads)?;
    let (config, plan) = (options.load()?, shard::read_plan(file)?);
    let missing = shard::missing_items(&config, &plan, &Bars::new(options.quiet, None))?;
    if !options.quiet {
        err!(
            "{} of {} {} are missing",
            missing.len(),
            plan.items.len(),
            plan.of.name()
        );
    }
    if missing.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    out!("{}", array(&plan.shards_of(&missing)));
    Ok(ExitCode::from(ATTENTION))
}

/// Publishes the work of the shards.
pub fn merge(options: &MergeOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    let bars = Bars::new(options.options.quiet, None);
    let plan = shard::read_plan(&options.plan)?;
    match shard::merge(&config, &plan, options.wait_options.longest_wait(), &bars) {
        Err(error) if error.is_transient() => Ok(ask_for_another_try(&error.into())),
        Err(error) => Err(error.into()),
        Ok(outcome) => {
            if !options.options.quiet {
                print_summary(&config, &outcome, Stage::Report);
            }
            Ok(exit_code(outcome.has_rejections(), REJECTED))
        }
    }
}

/// Writes the scripts of a job array, and submits them if asked for.
pub fn submit(options: &SubmitOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    let folder = files::working_folder()?;
    let out = options
        .out
        .clone()
        .unwrap_or_else(|| config.store.join("cluster"));
    let shown = |path: &Path| path.display().to_string();
    let campaign = CampaignCommands {
        program: shown(&files::program()?),
        arguments: options.options.typed(),
        folder: shown(&folder),
        flights: shown(&plan_file(&config, DealtKind::Flights)),
        maneuvers: shown(&plan_file(&config, DealtKind::Maneuvers)),
        out: shown(&folder.join(&out)),
    };
    let engine = match options.engine {
        Scheduler::Slurm => scripts::Scheduler::Slurm,
        Scheduler::Pbs => scripts::Scheduler::Pbs,
    };
    for script in scripts::scripts(engine, &config.cluster, &campaign) {
        atomic::place(&out.join(script.name), script.text.as_bytes())?;
    }
    let bars = Bars::new(options.options.quiet, None);
    let file = plan_file(&config, DealtKind::Flights);
    let plan = shard::deal(
        &config,
        DealtKind::Flights,
        config.cluster.shards,
        &file,
        &bars,
    )?;
    let submit = out.join("submit.sh");
    if !options.options.quiet {
        print_plan(&plan, &file);
        if config.cluster.shards > LARGEST_ARRAY {
            out!("arrays of more than {LARGEST_ARRAY} need a larger MaxArraySize of the scheduler");
        }
        out!(
            "scripts in {}; bash {} submits them",
            out.display(),
            submit.display()
        );
    }
    if options.go {
        run_script(&submit)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Runs the script that submits the jobs.
fn run_script(script: &Path) -> anyhow::Result<()> {
    let status = Command::new("bash")
        .arg(script)
        .status()
        .with_context(|| format!("cannot run {}", script.display()))?;
    anyhow::ensure!(
        status.success(),
        "the scheduler did not accept the jobs: {status}"
    );
    Ok(())
}
