//! The command `export`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::bars::Bars;
use super::options::{Options, REJECTED, WaitOptions, exit_code, start_threads};
use crate::night::{has_rejections, model_export, model_export::Draws};

/// Help below the options.
pub const EXPORT_HELP: &str = "\
The stages up to `model` are brought up to date first. Each derivative is the posterior of tunnel and flight, with its \
uncertainty; `source` names the larger source of information of each value.

  flight_updated.csv, .parquet   rows that `wind_tunnel:` reads as a database again
  flight_updated.dml             DAVE-ML (ANSI/AIAA S-119): tables, and the coefficients as their sums
  draws.csv, .parquet, draw_NNNN_jsbsim.xml   models drawn from the posterior, with --draws
  flight_updated_jsbsim.xml      JSBSim's <aerodynamics>: name it in the aircraft as <aerodynamics file=\"...\"/>

Examples:
  harvest export                                 into reports/harv/export
  harvest export --draws 100                     and 100 models for Monte Carlo in a simulator
  harvest export mine --out model                of the pipeline pipelines/mine, into the folder model

Exit codes: 0 written; 1 not written, the message says why; 2 written, and something of the campaign was rejected.";

/// Largest number of models drawn at once: their files have four digits.
const MOST_DRAWS: usize = 9999;

#[derive(Args, Debug)]
pub struct ExportOptions {
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    wait_options: WaitOptions,
    /// The folder to write into [default: export in the folder of the reports]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Also write this many models drawn from the posterior
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = draws)]
    draws: usize,
    /// Seed of the draws
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
}

/// Number of drawn models as typed.
fn draws(typed: &str) -> Result<usize, String> {
    match typed.parse() {
        Ok(draws @ 0..=MOST_DRAWS) => Ok(draws),
        _ => Err(format!("it must be a whole number from 0 to {MOST_DRAWS}")),
    }
}

/// Writes the derivatives for simulators and prints the files.
pub fn export(options: &ExportOptions) -> anyhow::Result<ExitCode> {
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    let bars = Bars::new(options.options.quiet, None);
    let default = || config.reports.join("export");
    let folder = options.out.clone().unwrap_or_else(default);
    let draws = Draws {
        number: options.draws,
        seed: options.seed,
    };
    let exported = model_export::export(
        &config,
        &folder,
        draws,
        options.wait_options.longest_wait(),
        &bars,
    )?;
    if !options.options.quiet {
        let (values, from_flight) = (exported.values, exported.from_flight);
        out!("{values} values, {from_flight} of them from flight");
        if !exported.missing.is_empty() {
            out!("without any value: {}", exported.missing.join(" "));
        }
        for file in &exported.files {
            out!("{}", file.display());
        }
    }
    Ok(exit_code(has_rejections(&exported.problems), REJECTED))
}
