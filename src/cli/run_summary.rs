//! Summary of a run on the terminal.

use crate::config::Config;
use crate::lineage::Stage;
use crate::night::RunOutcome;

/// Problems in the summary; the table `problems` has all.
const MOST_PROBLEMS: usize = 10;

/// Prints counts, problems and paths of a run that reached `until`.
#[expect(clippy::print_stdout, reason = "the output of a run")]
pub fn print_summary(config: &Config, outcome: &RunOutcome, until: Stage) {
    let summary = &outcome.summary;
    println!("{} flights, {} refused", summary.flights, summary.refused);
    if until >= Stage::Segment {
        println!("{} maneuvers", summary.maneuvers);
    }
    if until >= Stage::Estimate {
        println!("{} of them converged", summary.converged);
    }
    for problem in summary.problems.iter().take(MOST_PROBLEMS) {
        let place = [problem.flight_id.as_str(), problem.place.as_str()].map(str::trim);
        let place: Vec<&str> = place.into_iter().filter(|s| !s.is_empty()).collect();
        let (stage, reason) = (&problem.stage, &problem.reason);
        println!("  {stage}: {}: {reason}", place.join(", "));
    }
    if summary.problems.len() > MOST_PROBLEMS {
        println!(
            "  and {} more in {}",
            summary.problems.len() - MOST_PROBLEMS,
            config.reports.join("problems.csv").display()
        );
    }
    if !outcome.is_new {
        println!("nothing new: night {} holds", outcome.night);
    }
    println!("tables in {}", config.reports.display());
    if let Some(report) = &outcome.report {
        println!("report: {}", report.display());
    }
}
