//! The commands past one machine: a plan, a shard of it, what is missing, the merge, the
//! scheduler's scripts.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::Context;
use clap::{Args, ValueEnum};

use super::{Bars, LOOK, Options, Patience, start_threads, summary};
use crate::cluster::plan::{Of, Plan, Shard, array};
use crate::cluster::scripts::{self, Campaign, Engine, LARGEST_ARRAY};
use crate::cluster::shard;
use crate::config::Config;
use crate::error::Error;
use crate::lineage::Stage;
use crate::store::atomic;

/// Another try may go well (`EX_TEMPFAIL`).
const AGAIN: u8 = 75;

#[derive(Args, Debug)]
pub struct PlanOptions {
    #[command(flatten)]
    options: Options,
    /// What to deal: flights, to be ingested and segmented; or the maneuvers found in them, to be
    /// estimated
    #[arg(long, value_enum)]
    of: Dealt,
    /// To how many shards [default: the pipeline's `cluster: shards:`]
    #[arg(long, value_name = "N")]
    shards: Option<usize>,
    /// The file to write [default: flights.plan.json or maneuvers.plan.json in the store]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Dealt {
    Flights,
    Maneuvers,
}

/// One shard's share instead of the whole campaign.
#[derive(Args, Debug)]
pub struct ShareOptions {
    /// Compute a shard of this plan into the store, and publish nothing; exit code 75: another try
    /// may go well
    #[arg(long, value_name = "FILE", requires = "shard")]
    plan: Option<PathBuf>,
    /// Which shard of how many: 3/24
    #[arg(long, value_name = "I/N", requires = "plan")]
    shard: Option<Shard>,
}

#[derive(Args, Debug)]
pub struct MergeOptions {
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    patience: Patience,
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
    /// The folder of the scripts and of what the tasks say [default: cluster in the store]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Scheduler {
    Slurm,
    /// Untested
    Pbs,
}

fn plan_file(config: &Config, of: Of) -> PathBuf {
    // Where all machines see it.
    config
        .shared_store
        .as_ref()
        .unwrap_or(&config.store)
        .join(format!("{}.plan.json", of.name()))
}

/// Deals a campaign's work.
pub fn plan(options: &PlanOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    let of = match options.of {
        Dealt::Flights => Of::Flights,
        Dealt::Maneuvers => Of::Maneuvers,
    };
    let file = options
        .out
        .clone()
        .unwrap_or_else(|| plan_file(&config, of));
    let shards = options.shards.unwrap_or(config.cluster.shards);
    anyhow::ensure!(shards > 0, "--shards must be at least 1");
    let plan = shard::plan(
        &config,
        of,
        shards,
        &file,
        &Bars::new(options.options.quiet, None),
    )?;
    if !options.options.quiet {
        say(&plan, &file);
    }
    Ok(ExitCode::SUCCESS)
}

#[expect(clippy::print_stdout, reason = "what a plan says")]
fn say(plan: &Plan, file: &Path) {
    let costs = plan.costs();
    let dearest = costs.values().copied().fold(0.0, f64::max);
    let mean = costs.values().sum::<f64>() / costs.len() as f64;
    println!(
        "{} {} to {} shards, the dearest {:.2} times the mean",
        plan.items.len(),
        plan.of.name(),
        plan.shards,
        dearest / mean
    );
    println!("plan: {}", file.display());
}

impl ShareOptions {
    /// Computes the shard that is asked for; none where none is.
    pub fn work(
        &self,
        until: Stage,
        options: &Options,
        patience: &Patience,
    ) -> Option<anyhow::Result<ExitCode>> {
        let (plan, shard) = (self.plan.as_deref()?, self.shard?);
        Some(match work(plan, shard, until, options, patience) {
            Err(error)
                if error
                    .downcast_ref::<Error>()
                    .is_some_and(Error::is_transient) =>
            {
                Ok(again(&error))
            }
            done => done,
        })
    }
}

#[expect(clippy::print_stderr, reason = "why another try is asked for")]
fn again(error: &anyhow::Error) -> ExitCode {
    eprintln!("harvest: {error:#}; another try may go well");
    ExitCode::from(AGAIN)
}

#[expect(clippy::print_stdout, reason = "what a shard says")]
fn work(
    file: &Path,
    shard: Shard,
    until: Stage,
    options: &Options,
    patience: &Patience,
) -> anyhow::Result<ExitCode> {
    start_threads(options.threads)?;
    let config = options.load()?;
    let plan = shard::read(file)?;
    anyhow::ensure!(
        until <= plan.of.stage() && (until == Stage::Estimate) == (plan.of == Of::Maneuvers),
        "{} is a plan of {}: its shards are for `harvest {}`",
        file.display(),
        plan.of.name(),
        plan.of.stage().name()
    );
    let made = shard::work(
        &config,
        &plan,
        shard,
        until,
        patience.wait(),
        &Bars::new(options.quiet, None),
    )?;
    if !options.quiet {
        let share = plan.share(shard.number).count();
        println!(
            "shard {}/{}: {share} {}, {made} artefacts made",
            shard.number,
            shard.of,
            plan.of.name()
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// Prints the shards of which something is missing, as a scheduler writes an array.
#[expect(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "the array is for a script, the rest for a reader"
)]
pub fn missing(options: &Options, file: &Path) -> anyhow::Result<ExitCode> {
    start_threads(options.threads)?;
    let (config, plan) = (options.load()?, shard::read(file)?);
    let missing = shard::missing(&config, &plan, &Bars::new(options.quiet, None))?;
    if !options.quiet {
        eprintln!(
            "{} of {} {} are missing",
            missing.len(),
            plan.items.len(),
            plan.of.name()
        );
    }
    if missing.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    println!("{}", array(&plan.shards_of(&missing)));
    Ok(ExitCode::from(LOOK))
}

/// Publishes what the shards computed.
pub fn merge(options: &MergeOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    let bars = Bars::new(options.options.quiet, None);
    let plan = shard::read(&options.plan)?;
    match shard::merge(&config, &plan, options.patience.wait(), &bars) {
        Err(error) if error.is_transient() => Ok(again(&error.into())),
        Err(error) => Err(error.into()),
        Ok(done) => {
            if !options.options.quiet {
                summary(&config, &done, Stage::Report);
            }
            Ok(ExitCode::from(if done.rejected() { 2 } else { 0 }))
        }
    }
}

/// Writes the scripts, and hands them to the scheduler where that is asked for.
#[expect(clippy::print_stdout, reason = "what a submission says")]
pub fn submit(options: &SubmitOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    let folder = std::env::current_dir().context("there is no current folder")?;
    let out = options
        .out
        .clone()
        .unwrap_or_else(|| config.store.join("cluster"));
    let shown = |path: &Path| path.display().to_string();
    let campaign = Campaign {
        program: shown(
            &std::env::current_exe().context("the program does not know where it lies")?,
        ),
        arguments: options.options.typed(),
        folder: shown(&folder),
        flights: shown(&plan_file(&config, Of::Flights)),
        maneuvers: shown(&plan_file(&config, Of::Maneuvers)),
        out: shown(&folder.join(&out)),
    };
    let engine = match options.engine {
        Scheduler::Slurm => Engine::Slurm,
        Scheduler::Pbs => Engine::Pbs,
    };
    for script in scripts::scripts(engine, &config.cluster, &campaign) {
        atomic::place(&out.join(script.name), script.text.as_bytes())?;
    }
    let bars = Bars::new(options.options.quiet, None);
    let plan = shard::plan(
        &config,
        Of::Flights,
        config.cluster.shards,
        &plan_file(&config, Of::Flights),
        &bars,
    )?;
    let submit = out.join("submit.sh");
    if !options.options.quiet {
        say(&plan, &plan_file(&config, Of::Flights));
        if config.cluster.shards > LARGEST_ARRAY {
            println!(
                "arrays of more than {LARGEST_ARRAY} need a larger MaxArraySize of the scheduler"
            );
        }
        println!(
            "scripts in {}; bash {} hands them over",
            out.display(),
            submit.display()
        );
    }
    if options.go {
        let status = Command::new("bash")
            .arg(&submit)
            .status()
            .with_context(|| format!("cannot run {}", submit.display()))?;
        anyhow::ensure!(
            status.success(),
            "the scheduler did not take the jobs: {status}"
        );
    }
    Ok(ExitCode::SUCCESS)
}
