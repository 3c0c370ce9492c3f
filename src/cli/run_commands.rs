//! The commands that bring a campaign up to date and publish it.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Context;
use clap::Args;

use super::bars::Bars;
use super::cluster_commands::ShareOptions;
use super::options::{Options, REJECTED, WaitOptions, start_threads};
use super::run_summary::print_summary;
use super::signals::log_signals;
use crate::config::Config;
use crate::lineage::Stage;
use crate::night::{self, RunOutcome};
use crate::store::Log;

#[derive(Args, Debug)]
pub struct RunOptions {
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    wait_options: WaitOptions,
    /// Append stages, problems and the result to a file, one JSON object per line with the time of
    /// day (UTC)
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub struct StageOptions {
    #[command(flatten)]
    run: RunOptions,
    #[command(flatten)]
    share: ShareOptions,
}

/// Brings the whole campaign or one shard as far as a stage.
pub fn run_stage(until: Stage, options: &StageOptions) -> anyhow::Result<ExitCode> {
    let shard = options
        .share
        .compute(until, &options.run.options, &options.run.wait_options);
    shard.unwrap_or_else(|| run_campaign(until, &options.run))
}

/// Brings the whole campaign as far as a stage and publishes it, with a log if the options name
/// one.
pub fn run_campaign(until: Stage, options: &RunOptions) -> anyhow::Result<ExitCode> {
    let log = options.log.as_deref().map(Log::open).transpose()?;
    let log = log.map(Arc::new);
    let result = publish(until, options, log.as_ref());
    if let (Some(log), Err(error)) = (&log, &result) {
        let error = format!("{error:#}");
        log.write("end", &[("exit", 1.into()), ("error", error.into())]);
    }
    let code = result?;
    match log.and_then(|log| log.failure()) {
        Some(failure) => Err(failure.into()),
        None => Ok(code),
    }
}

fn publish(until: Stage, options: &RunOptions, log: Option<&Arc<Log>>) -> anyhow::Result<ExitCode> {
    let start = Instant::now();
    let quiet = options.options.quiet;
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    if let Some(log) = log {
        log_begin(log, &config, until);
    }
    let bars = Bars::new(quiet, log.map(|log| &**log));
    if let Some(log) = log {
        log_signals(log, bars.work()).context("cannot log signals")?;
    }
    let outcome = night::run(&config, until, options.wait_options.longest_wait(), &bars)?;
    if !quiet {
        print_summary(&config, &outcome, until);
    }
    let exit = if outcome.has_rejections() {
        REJECTED
    } else {
        0
    };
    if let Some(log) = log {
        log_end(log, &outcome, exit, start);
    }
    Ok(ExitCode::from(exit))
}

fn log_begin(log: &Log, config: &Config, until: Stage) {
    let store = config.shared_store.as_ref().unwrap_or(&config.store);
    log.write(
        "begin",
        &[
            ("pipeline", config.name.as_str().into()),
            ("until", until.name().into()),
            ("version", env!("CARGO_PKG_VERSION").into()),
            ("source", env!("HARVEST_SOURCE").into()),
            ("archive", config.archive.as_str().into()),
            ("store", store.display().to_string().into()),
            ("reports", config.reports.display().to_string().into()),
            ("threads", rayon::current_num_threads().into()),
        ],
    );
}

fn log_end(log: &Log, outcome: &RunOutcome, exit: u8, start: Instant) {
    let summary = &outcome.summary;
    for problem in &summary.problems {
        log.write(
            "problem",
            &[
                ("stage", problem.stage.name().into()),
                ("flight", problem.flight_id.as_str().into()),
                ("place", problem.place.as_str().into()),
                ("reason", problem.reason.as_str().into()),
            ],
        );
    }
    log.write(
        "night",
        &[
            ("night", outcome.night.as_str().into()),
            ("new", outcome.is_new.into()),
            ("alert", summary.alert.into()),
        ],
    );
    log.write(
        "end",
        &[
            ("exit", exit.into()),
            ("seconds", start.elapsed().as_secs_f64().into()),
            ("artefacts_made", outcome.made.into()),
            ("flights", summary.flights.into()),
            ("refused", summary.refused.into()),
            ("maneuvers", summary.maneuvers.into()),
            ("converged", summary.converged.into()),
            ("problems", summary.problems.len().into()),
        ],
    );
}
