//! The command `show`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};

use super::bars::Bars;
use super::options::{Options, REJECTED, exit_code, start_threads};
use crate::pipeline::show::{self, ChartSubject};

#[derive(Debug, Subcommand)]
pub enum Show {
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
The stages up to `segment` are brought up to date first. Maneuvers are shaded through all strips and labelled \
with class and id; where a list of events is given, the list and the maneuvers found are drawn in two rows above the strips. \
Samples that were bridged, replaced or are missing are marked at their time. However long the flight, the smallest and \
the largest sample of each column of the picture is drawn: no spike is lost.

Examples:
  harvest show flight flight_001                        into reports/harv/show/flight_001.svg
  harvest show flight flight_001 mine --out f1.svg      of the pipeline pipelines/mine, into f1.svg

Exit codes: 0 drawn; 1 not drawn, the message says why; 2 drawn, and something in the flight was rejected.";

const MANEUVER_HELP: &str = "\
The stages up to `estimate` are brought up to date first. A maneuver that was rejected is shown as measured, \
with the reason in the heading. The ids are in the table `maneuvers` and over the windows of `harvest show flight`.

Examples:
  harvest show maneuver flight_001_t00118               into reports/harv/show/flight_001_t00118.svg

Exit codes: 0 drawn; 1 not drawn, the message says why; 2 drawn, and what is shown was rejected.";

#[derive(Args, Debug)]
pub struct ShowOptions {
    /// Its `flight_id` or `maneuver_id`, as in the tables
    #[arg(value_name = "ID")]
    id: String,
    #[command(flatten)]
    options: Options,
    /// The file to write [default: show/<ID>.svg in the folder of the reports]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Draws a flight or a maneuver and prints the file.
pub fn show(command: &Show) -> anyhow::Result<ExitCode> {
    let (subject, options) = match command {
        Show::Flight(options) => (ChartSubject::Flight(options.id.clone()), options),
        Show::Maneuver(options) => (ChartSubject::Maneuver(options.id.clone()), options),
    };
    start_threads(options.options.threads)?;
    let config = options.options.load()?;
    let bars = Bars::new(options.options.quiet, None);
    let picture = show::show(&config, &subject, options.out.as_deref(), &bars)?;
    if !options.options.quiet {
        for problem in &picture.problems {
            out!("  {}: {}: {}", problem.stage, problem.place, problem.reason);
        }
        out!("picture: {}", picture.path.display());
    }
    Ok(exit_code(!picture.problems.is_empty(), REJECTED))
}
