//! Summary of a run on the terminal.

use crate::config::Config;
use crate::lineage::Stage;
use crate::night::RunOutcome;

/// Problems in the summary; the table `problems` has all.
const MOST_PROBLEMS: usize = 10;

/// Prints counts, problems and paths of a run that reached `until`.
pub fn print_summary(config: &Config, outcome: &RunOutcome, until: Stage) {
    let summary = &outcome.summary;
    out!("{} flights, {} refused", summary.flights, summary.refused);
    if until >= Stage::Segment {
        out!("{} maneuvers", summary.maneuvers);
    }
    if until >= Stage::Estimate {
        out!("{} of them converged", summary.converged);
    }
    for problem in summary.problems.iter().take(MOST_PROBLEMS) {
        let place = [problem.flight_id.as_str(), problem.place.as_str()].map(str::trim);
        let place: Vec<&str> = place.into_iter().filter(|s| !s.is_empty()).collect();
        let (stage, reason) = (&problem.stage, &problem.reason);
        out!("  {stage}: {}: {reason}", place.join(", "));
    }
    if summary.problems.len() > MOST_PROBLEMS {
        out!(
            "  and {} more in {}",
            summary.problems.len() - MOST_PROBLEMS,
            config.reports.join("problems.csv").display()
        );
    }
    if !outcome.is_new {
        out!("nothing new: night {} is still current", outcome.night);
    }
    out!("tables in {}", config.reports.display());
    if let Some(report) = &outcome.report {
        out!("report: {}", report.display());
    }
}
