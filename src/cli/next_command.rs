//! The command `next`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::bars::Bars;
use super::options::{Options, REJECTED, WaitOptions, exit_code, start_threads};
use crate::flight_plan::{PlannedFlight, Request, plan_next_flight};
use crate::night::has_rejections;
use crate::tables::NextCardRow;

/// Help below the options.
pub const NEXT_HELP: &str = "\
The stages up to `model` are brought up to date first. Each card (class, angle of attack, scale of its inputs) is \
flown by a simulator with the derivatives of tonight's posterior and estimated as a flown maneuver is; the cards that lower \
the standard deviations of the goals most in the minutes are chosen (docs/next.md).

  next_cards.csv, .parquet   every card: the goals it informs, its minutes, its place in the flight, why it is refused
  next_goals.csv, .parquet   standard deviation of each goal before and after the flight, and its chance to be decided
  kneeboard.html, .pdf       one page for the pilot

A file of goals lists derivatives with the standard deviation that is wanted of them, quantities of qualities.yaml whose level is to be \
decided with a probability, and classes of maneuvers whose match by a simulator is:

  goals:
    - { derivative: NAME, alpha_deg: [10, 40], bound: 0.0002 }
    - { derivative: ANOTHER, weight: 2 }
    - { quantity: dutch_roll_damping, alpha_deg: [10, 40], decided: 0.95 }
    - { match: CLASS, alpha_deg: [10, 30], model: tunnel }

Examples:
  harvest next --minutes 45                      by the cards of pipelines/harv, into reports/harv/next
  harvest next --minutes 45 --goal goals.yaml    for these derivatives
  harvest next mine --minutes 30 --cards my_cards.yaml

Exit codes: 0 written; 1 not written, the message says why; 2 written, and something of the campaign was rejected.";

#[derive(Args, Debug)]
pub struct NextOptions {
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    wait_options: WaitOptions,
    /// Minutes of the flight for its cards
    #[arg(long, value_name = "MINUTES", value_parser = minutes)]
    minutes: f64,
    /// Test cards, YAML [default: cards.yaml of the pipeline]
    #[arg(long, value_name = "FILE")]
    cards: Option<PathBuf>,
    /// Goals, YAML [default: every derivative of the posterior]
    #[arg(long, visible_alias = "goals", value_name = "FILE")]
    goal: Option<PathBuf>,
    /// The folder to write into [default: next in the folder of the reports]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

/// Minutes as typed, more than none.
fn minutes(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(minutes) if (f64::MIN_POSITIVE..=1440.0).contains(&minutes) => Ok(minutes),
        _ => Err("it must be a number above 0 and at most 1440".to_owned()),
    }
}

/// Plans the next flight and prints its cards.
pub fn next(options: &NextOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    let own = options.options.folder()?.join("cards.yaml");
    let request = Request {
        cards: options.cards.as_deref().unwrap_or(&own),
        goals: options.goal.as_deref(),
        minutes: options.minutes,
    };
    let default = || config.reports.join("next");
    let folder = options.out.clone().unwrap_or_else(default);
    let bars = Bars::new(options.options.quiet, None);
    let planned = plan_next_flight(
        &config,
        &request,
        &folder,
        options.wait_options.longest_wait(),
        &bars,
    )?;
    if !options.options.quiet {
        print(&planned, options.minutes);
    }
    Ok(exit_code(has_rejections(&planned.problems), REJECTED))
}

fn print(planned: &PlannedFlight, minutes: f64) {
    let plan = &planned.plan;
    let flown = || plan.cards.iter().filter(|row| row.place.is_some());
    let times: usize = flown().map(|row| row.times).sum();
    out!(
        "{times} cards in {:.1} of {minutes} minutes; the standard deviations of the goals fall by {:.0} % (weighted geometric mean)",
        plan.minutes,
        plan.fall_pct()
    );
    for row in flown() {
        out!("{}", line(row));
    }
    let refused = plan.cards.iter().filter(|row| !row.refused.is_empty());
    for row in refused {
        out!(
            "  refused: {} at {}°: {}",
            row.class,
            row.alpha_deg,
            row.refused
        );
    }
    for file in &planned.files {
        out!("{}", file.display());
    }
}

fn line(row: &NextCardRow) -> String {
    let NextCardRow {
        times,
        class,
        alpha_deg,
        scale,
        informs,
        ..
    } = row;
    let minutes = row.minutes * *times as f64;
    let place = row.place.unwrap_or_default();
    let first = informs.split("; ").next().unwrap_or_default();
    format!(
        "{place:>4}  {class:<18} {alpha_deg:>5}°  x{times}  scale {scale:<4} {minutes:>5.1} min  {first}"
    )
}
