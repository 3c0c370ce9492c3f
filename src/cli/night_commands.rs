//! The commands `status`, `explain`, `diff`, `verify` and `gc`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::bars::Bars;
use super::cluster_commands;
use super::options::{ATTENTION, Options, REJECTED, WaitOptions, exit_code, start_threads};
use super::printed_changes::{self, MOST_LISTED};
use crate::night::status::NightStatus;
use crate::night::{diff, explain, gc, status, verify};

#[derive(Args, Debug)]
pub struct StatusOptions {
    #[command(flatten)]
    options: Options,
    /// Instead, print the shards of this plan with missing artefacts, as schedulers write an array:
    /// 1,4-7
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub struct ExplainOptions {
    /// Its `maneuver_id`, as in the table `maneuvers`
    #[arg(value_name = "MANEUVER")]
    id: String,
    #[command(flatten)]
    options: Options,
}

#[derive(Args, Debug)]
pub struct DiffOptions {
    #[command(flatten)]
    options: Options,
    /// The night to compare with, e.g. 0006 [default: the complete night before]
    #[arg(long, value_name = "NIGHT")]
    since: Option<String>,
    /// The night to look at [default: the last complete one]
    #[arg(long, value_name = "NIGHT")]
    to: Option<String>,
    /// Print the changes as JSON, as in `alert.json`
    #[arg(long)]
    json: bool,
    /// Report each night's changes once: the second time nothing is printed, and the exit code is 0
    #[arg(long)]
    once: bool,
}

#[derive(Args, Debug)]
pub struct VerifyOptions {
    #[command(flatten)]
    options: Options,
    /// The night to verify, e.g. 0006 [default: the current one]
    #[arg(long, value_name = "NIGHT")]
    night: Option<String>,
    /// Only this table, e.g. `trends`; may be given several times
    #[arg(long = "table", value_name = "TABLE")]
    tables: Vec<String>,
}

#[derive(Args, Debug)]
pub struct GcOptions {
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    wait_options: WaitOptions,
    /// Remove what is shown; without it nothing is
    #[arg(long)]
    yes: bool,
}

fn bars(options: &Options) -> anyhow::Result<Bars<'static>> {
    start_threads(options.threads)?;
    Ok(Bars::new(options.quiet, None))
}

/// Prints the fresh, stale and failed artefacts of each stage.
pub fn status(options: &StatusOptions) -> anyhow::Result<ExitCode> {
    if let Some(plan) = &options.plan {
        return cluster_commands::missing(&options.options, plan);
    }
    let options = &options.options;
    let config = options.load()?;
    let status = status::status(&config, &bars(options)?)?;
    if !options.quiet {
        print_status(&status, &config.reports);
    }
    Ok(if status.is_fresh() {
        exit_code(status.has_failures(), REJECTED)
    } else {
        ExitCode::from(ATTENTION)
    })
}

/// Prints the published night, the flights in work, and the artefacts of each stage.
fn print_status(status: &NightStatus, reports: &Path) {
    match (&status.night, &status.damaged_night) {
        (Some(night), _) => out!("night {night} is published in {}", reports.display()),
        (None, Some(night)) => out!(
            "night {night} is damaged: its night.json is not as it was published; the next run \
                 publishes another night"
        ),
        (None, None) => out!("no night is published yet"),
    }
    for (flight_id, since) in &status.in_work {
        out!("in work: flight {flight_id} since {since}");
    }
    out!("{:<9} {:>6} {:>6} {:>6}", "", "fresh", "stale", "failed");
    for stage in &status.stages {
        let stale: usize = stage.stale.values().map(Vec::len).sum();
        out!(
            "{:<9} {:>6} {stale:>6} {:>6}",
            stage.stage.name(),
            stage.fresh,
            stage.failed.len()
        );
    }
    for stage in &status.stages {
        for (why, items) in &stage.stale {
            out!(
                "  {}: stale: {}: {why}",
                stage.stage.name(),
                first_items(items)
            );
        }
        for failure in stage.failed.iter().take(MOST_LISTED) {
            let (item, why) = (&failure.item, &failure.reason);
            out!("  {}: failed: {item}: {why}", stage.stage.name());
        }
        if stage.failed.len() > MOST_LISTED {
            out!(
                "  {}: and {} more failed",
                stage.stage.name(),
                stage.failed.len() - MOST_LISTED
            );
        }
    }
}

/// The first items, and the number of the others.
fn first_items(items: &[String]) -> String {
    let (first, more) = items.split_at(items.len().min(3));
    let mut unique = first.to_vec();
    unique.dedup();
    let more = if more.is_empty() {
        String::new()
    } else {
        format!(" and {} more", more.len())
    };
    format!("{}{more}", unique.join(", "))
}

/// Prints everything about a maneuver.
pub fn explain(options: &ExplainOptions) -> anyhow::Result<ExitCode> {
    let bars = bars(&options.options)?;
    out_text!(
        "{}",
        explain::explain(&options.options.load()?, &options.id, &bars)?
    );
    Ok(ExitCode::SUCCESS)
}

/// Prints the changes since the night before.
pub fn diff(options: &DiffOptions) -> anyhow::Result<ExitCode> {
    let config = options.options.load()?;
    let found = diff::diff(&config, options.since.as_deref(), options.to.as_deref())?;
    if options.once && diff::mark_reported(&config, &found.night)? {
        if !options.options.quiet {
            out!("night {}: reported already", found.night);
        }
        return Ok(ExitCode::SUCCESS);
    }
    if options.json {
        out!("{}", serde_json::to_string_pretty(&found.changes)?);
    } else if !options.options.quiet || found.changes.alert {
        printed_changes::print(&found.night, &found.changes);
    }
    Ok(exit_code(found.changes.alert, ATTENTION))
}

/// Prints the findings about a published night.
pub fn verify(options: &VerifyOptions) -> anyhow::Result<ExitCode> {
    let (config, bars) = (options.options.load()?, bars(&options.options)?);
    let found = verify::verify(&config, options.night.as_deref(), &options.tables, &bars)?;
    if !options.options.quiet {
        out!("night {}", found.night);
        for file in &found.files {
            out!(
                "  {:<22} {}",
                file.file,
                if file.reasons.is_empty() {
                    "holds"
                } else {
                    "does not hold"
                }
            );
            for reason in &file.reasons {
                out!("    {reason}");
            }
        }
        for artefact in found.artefacts.iter().take(MOST_LISTED) {
            out!("  {artefact}: damaged or gone; the next run makes it again");
        }
        if found.artefacts.len() > MOST_LISTED {
            out!(
                "  and {} more artefacts",
                found.artefacts.len() - MOST_LISTED
            );
        }
        out!(
            "{}",
            if found.is_valid() {
                "The night is valid."
            } else {
                "The night is not valid."
            }
        );
    }
    Ok(exit_code(!found.is_valid(), REJECTED))
}

/// Prints what no published night needs, and removes it if asked for.
pub fn gc(options: &GcOptions) -> anyhow::Result<ExitCode> {
    let config = options.options.load()?;
    let unneeded = gc::gc(&config, options.yes, options.wait_options.longest_wait())?;
    if !options.options.quiet {
        for name in unneeded
            .nights
            .iter()
            .map(|n| format!("night {n}"))
            .chain(unneeded.artefacts.keys().map(ToString::to_string))
        {
            out!("  {name}");
        }
        let bytes: u64 = unneeded.artefacts.values().sum();
        let (count, kept) = (unneeded.artefacts.len(), unneeded.kept);
        let verb = if options.yes {
            "removed"
        } else {
            "would be removed"
        };
        out!(
            "{count} artefacts ({} MB) and {} nights {verb}, {kept} artefacts stay",
            bytes / 1_000_000,
            unneeded.nights.len()
        );
        if let Some(shared) = &config.shared_store {
            out!(
                "that is the cache in {}; {} is not cleaned, because nights of other machines may need it: use the bucket's \
                 lifecycle rules",
                config.store.display(),
                shared.display()
            );
        }
        if !options.yes && (count > 0 || !unneeded.nights.is_empty()) {
            out!("harvest gc --yes removes them");
        }
    }
    Ok(ExitCode::SUCCESS)
}
