//! The commands of the morning after: what is fresh, a maneuver's story, what changed, whether it
//! still holds, what can go.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::{Bars, LOOK, Options, Patience, cluster, start_threads};
use crate::lineage::{Changes, Moved};
use crate::night::{diff, explain, gc, status, verify};

#[derive(Args, Debug)]
pub struct StatusOptions {
    #[command(flatten)]
    options: Options,
    /// Instead, print the shards of this plan of which something is missing, as schedulers write an
    /// array: 1,4-7
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
    /// The night to hold against, e.g. 0006 [default: the complete night before]
    #[arg(long, value_name = "NIGHT")]
    since: Option<String>,
    /// The night to look at [default: the last complete one]
    #[arg(long, value_name = "NIGHT")]
    to: Option<String>,
    /// Print the changes as JSON, as in `alert.json`
    #[arg(long)]
    json: bool,
    /// Tell each night's changes once: the second time there is nothing, and the exit code is 0
    #[arg(long)]
    once: bool,
}

#[derive(Args, Debug)]
pub struct VerifyOptions {
    #[command(flatten)]
    options: Options,
    /// The night to verify, e.g. 0006 [default: the one that holds]
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
    patience: Patience,
    /// Remove what is shown; without it nothing is
    #[arg(long)]
    yes: bool,
}

fn bars(options: &Options) -> anyhow::Result<Bars<'static>> {
    start_threads(options.threads)?;
    Ok(Bars::new(options.quiet, None))
}

/// Says per stage what is fresh, stale and failed, and why.
#[expect(clippy::print_stdout, reason = "what a status says")]
pub fn status(options: &StatusOptions) -> anyhow::Result<ExitCode> {
    if let Some(plan) = &options.plan {
        return cluster::missing(&options.options, plan);
    }
    let options = &options.options;
    let status = status::status(&options.load()?, &bars(options)?)?;
    if !options.quiet {
        match &status.night {
            Some(night) => println!(
                "night {night} is published in {}",
                options.load()?.reports.display()
            ),
            None => println!("no night is published yet"),
        }
        println!("{:<9} {:>6} {:>6} {:>6}", "", "fresh", "stale", "failed");
        for stage in &status.stages {
            let stale: usize = stage.stale.values().map(Vec::len).sum();
            println!(
                "{:<9} {:>6} {stale:>6} {:>6}",
                stage.stage.name(),
                stage.fresh,
                stage.failed.len()
            );
        }
        for stage in &status.stages {
            for (why, items) in &stage.stale {
                println!("  {}: stale: {}: {why}", stage.stage.name(), some(items));
            }
            for (item, why) in stage.failed.iter().take(MOST) {
                println!("  {}: failed: {item}: {why}", stage.stage.name());
            }
            if stage.failed.len() > MOST {
                println!(
                    "  {}: and {} more failed",
                    stage.stage.name(),
                    stage.failed.len() - MOST
                );
            }
        }
    }
    Ok(match (status.is_fresh(), status.failed()) {
        (false, _) => ExitCode::from(LOOK),
        (true, true) => ExitCode::from(2),
        (true, false) => ExitCode::SUCCESS,
    })
}

/// No more lines of one kind than this.
const MOST: usize = 10;

/// The first of some names, and how many more there are.
fn some(items: &[String]) -> String {
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

/// Tells a maneuver's story.
#[expect(clippy::print_stdout, reason = "what is asked for")]
pub fn explain(options: &ExplainOptions) -> anyhow::Result<ExitCode> {
    let bars = bars(&options.options)?;
    print!(
        "{}",
        explain::explain(&options.options.load()?, &options.id, &bars)?
    );
    Ok(ExitCode::SUCCESS)
}

/// Says what changed since the night before.
#[expect(clippy::print_stdout, reason = "what a comparison says")]
pub fn diff(options: &DiffOptions) -> anyhow::Result<ExitCode> {
    let config = options.options.load()?;
    let found = diff::diff(&config, options.since.as_deref(), options.to.as_deref())?;
    let told = options.once && diff::tell_once(&config, &found.night)?;
    if told {
        if !options.options.quiet {
            println!("night {}: told already", found.night);
        }
        return Ok(ExitCode::SUCCESS);
    }
    if options.json {
        println!("{}", serde_json::to_string_pretty(&found.changes)?);
    } else if !options.options.quiet || found.changes.alert {
        say(&found.night, &found.changes);
    }
    Ok(if found.changes.alert {
        ExitCode::from(LOOK)
    } else {
        ExitCode::SUCCESS
    })
}

#[expect(clippy::print_stdout, reason = "what a comparison says")]
fn say(night: &str, changes: &Changes) {
    let Some(since) = &changes.since else {
        println!("night {night} is the first complete one: there is nothing to hold it against");
        return;
    };
    println!("night {night} since night {since}");
    list("because", &changes.causes, |c| c.words.clone());
    list("maneuvers", &changes.maneuvers, |m| {
        let words = if m.words.is_empty() {
            String::new()
        } else {
            format!(": {}", m.words)
        };
        format!(
            "{} {} ({}){words} [{}]",
            m.what, m.maneuver_id, m.class, m.because
        )
    });
    let moved = |m: &Moved| {
        let (of, alpha, because) = (&m.of, m.alpha_deg, &m.because);
        format!(
            "{} of {of} at {alpha:.1} deg: {} became {}, ±{} [{because}]",
            m.derivative, m.before, m.now, m.uncertainty
        )
    };
    list(
        "estimates that moved by more than their uncertainty",
        &changes.estimates,
        moved,
    );
    list(
        "trends that moved by more than their uncertainty",
        &changes.trends,
        moved,
    );
    list("new trends", &changes.new_trends, Clone::clone);
    list("trends gone", &changes.gone_trends, Clone::clone);
    list("verdicts", &changes.verdicts, |v| {
        format!(
            "{} at {} deg: {} became {} [{}]",
            v.derivative, v.alpha_deg, v.before, v.now, v.because
        )
    });
    if changes.is_empty() {
        println!("nothing that was published moved by more than its uncertainty");
    }
}

#[expect(clippy::print_stdout, reason = "what a comparison says")]
fn list<T>(title: &str, items: &[T], words: impl Fn(&T) -> String) {
    if items.is_empty() {
        return;
    }
    println!("{title}: {}", items.len());
    for item in items.iter().take(MOST) {
        println!("  {}", words(item));
    }
    if items.len() > MOST {
        println!("  and {} more (all of them: --json)", items.len() - MOST);
    }
}

/// Says whether what is published still holds.
#[expect(clippy::print_stdout, reason = "what a verification says")]
pub fn verify(options: &VerifyOptions) -> anyhow::Result<ExitCode> {
    let (config, bars) = (options.options.load()?, bars(&options.options)?);
    let found = verify::verify(&config, options.night.as_deref(), &options.tables, &bars)?;
    if !options.options.quiet {
        println!("night {}", found.night);
        for file in &found.files {
            println!(
                "  {:<22} {}",
                file.file,
                if file.reasons.is_empty() {
                    "holds"
                } else {
                    "does not hold"
                }
            );
            for reason in &file.reasons {
                println!("    {reason}");
            }
        }
        for artefact in found.artefacts.iter().take(MOST) {
            println!("  {artefact}: damaged or gone; the next run makes it again");
        }
        if found.artefacts.len() > MOST {
            println!("  and {} more artefacts", found.artefacts.len() - MOST);
        }
        println!(
            "{}",
            if found.holds() {
                "All of it holds."
            } else {
                "It does not hold."
            }
        );
    }
    Ok(if found.holds() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(2)
    })
}

/// Shows what no published night needs, and removes it where that is asked for.
#[expect(clippy::print_stdout, reason = "what housekeeping says")]
pub fn gc(options: &GcOptions) -> anyhow::Result<ExitCode> {
    let config = options.options.load()?;
    let litter = gc::gc(&config, options.yes, options.patience.wait())?;
    if !options.options.quiet {
        for name in litter
            .nights
            .iter()
            .map(|n| format!("night {n}"))
            .chain(litter.artefacts.keys().cloned())
        {
            println!("  {name}");
        }
        let bytes: u64 = litter.artefacts.values().sum();
        let (count, kept) = (litter.artefacts.len(), litter.kept);
        let verb = if options.yes {
            "removed"
        } else {
            "would be removed"
        };
        println!(
            "{count} artefacts ({} MB) and {} nights {verb}, {kept} artefacts stay",
            bytes / 1_000_000,
            litter.nights.len()
        );
        if let Some(shared) = &config.shared_store {
            println!(
                "that is the cache in {}; {} is left as it is, for other machines' nights may be made of it: rules of the \
                 bucket's lifecycle remove what is old",
                config.store.display(),
                shared.display()
            );
        }
        if !options.yes && (count > 0 || !litter.nights.is_empty()) {
            println!("harvest gc --yes removes them");
        }
    }
    Ok(ExitCode::SUCCESS)
}
