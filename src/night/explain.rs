//! The whole story of one maneuver: where it comes from, which samples, what was held, how it was
//! fitted, what it depends on. Told from the store; nothing is made and nothing changed.

use std::fmt::Write;
use std::path::Path;

use crate::config::Config;
use crate::error::{Error, Result, did_you_mean};
use crate::estimate::Estimated;
use crate::lineage::Stage;
use crate::maneuver::{Maneuver, ManeuverOrigin, Status};
use crate::pipeline::{Flight, Progress, Run};
use crate::store::Store;
use crate::store::archive::{self, FlightFiles};
use crate::tables::{EstimateRow, StartingValues};

/// The story as text.
///
/// # Errors
/// No archive, or no such maneuver among what the store knows, with what was probably meant.
pub fn explain(config: &Config, id: &str, progress: &dyn Progress) -> Result<String> {
    let files = archive::find(&config.archive)?;
    let store = Store::look(&config.store).sharing(config.shared_store.as_deref())?;
    let run = Run::of_store(config, store, &files, progress)?;
    let mut known = Vec::new();
    // Ids begin with the flight's: of most flights nothing needs to be read.
    let (likely, others): (Vec<&FlightFiles>, Vec<&FlightFiles>) = files
        .iter()
        .partition(|f| id.starts_with(f.flight_id.as_str()));
    for files in likely.into_iter().chain(others) {
        let Ok(content) = run.inputs.content(&files.flight_id) else {
            continue;
        };
        let Some(conditioned) = run.ingested(&files.flight_id, content) else {
            continue;
        };
        for flight in conditioned.stretches.iter().filter(|f| f.ingested.accepted) {
            let Some((segment, found)) = run.segmented(flight) else {
                continue;
            };
            if let Some(maneuver) = found.maneuvers.iter().find(|m| m.maneuver_id == id) {
                return Ok(run.story(files, content, flight, &segment, maneuver));
            }
            known.extend(found.maneuvers.into_iter().map(|m| m.maneuver_id));
        }
    }
    let near = did_you_mean(id, known.iter().map(String::as_str));
    let what = format!(
        "the store knows no maneuver `{id}`{near}; `harvest status` says whether it is up to date"
    );
    Err(Error::not_found(Path::new(&config.archive), what))
}

impl Run<'_> {
    fn story(
        &self,
        files: &FlightFiles,
        content: &str,
        flight: &Flight,
        segment: &Path,
        maneuver: &Maneuver,
    ) -> String {
        let path = self.estimate_path(flight, maneuver);
        let mut text = String::new();
        origin(&mut text, self.config, maneuver);
        samples(&mut text, flight, maneuver);
        match self.store.load::<Estimated>(&path) {
            Some(estimated) => {
                fitted(&mut text, &estimated);
                derivatives(&mut text, &estimated);
                correlations(
                    &mut text,
                    &estimated,
                    self.config.estimate.identifiability.correlation,
                );
            }
            None => line(
                &mut text,
                "Estimate",
                "not made yet, or stale: `harvest status` says why",
            ),
        }
        heading(&mut text, "Depends on");
        for file in &files.files {
            line(&mut text, "file", &file.display().to_string());
        }
        line(&mut text, "content", content);
        line(&mut text, "record", &name(&flight.record));
        line(&mut text, "segment", &name(segment));
        line(&mut text, "estimate", &name(&path));
        let code = &self.lineage.code;
        line(
            &mut text,
            "code",
            &format!("harvest {} ({})", code.version, code.source),
        );
        let method = |m: &str| format!("{m} {}", code.methods.get(m).copied().unwrap_or_default());
        line(
            &mut text,
            "methods",
            &["ingest", "segment", "estimate"].map(method).join(", "),
        );
        let parts = self.lineage.until(Stage::Estimate).configuration;
        let parts: Vec<String> = parts.values().flat_map(|p| p.keys().cloned()).collect();
        line(&mut text, "configuration", &parts.join(", "));
        text
    }
}

fn heading(text: &mut String, title: &str) {
    let _ = writeln!(text, "\n{title}");
}

fn line(text: &mut String, name: &str, value: &str) {
    let _ = writeln!(text, "  {name:<16} {value}");
}

fn name(path: &Path) -> String {
    path.file_name()
        .map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

fn origin(text: &mut String, config: &Config, m: &Maneuver) {
    let title = config
        .class(&m.class)
        .map_or("a class that is no longer configured", |c| c.title.as_str());
    let _ = writeln!(text, "{}: {}, {title}", m.maneuver_id, m.class);
    line(text, "flight", &m.flight_id);
    let origin = if m.origin == ManeuverOrigin::Given {
        "given in the analyst's list of events"
    } else {
        "found in the record"
    };
    line(text, "where from", origin);
    line(
        text,
        "samples",
        &format!(
            "{} from {:.3} s to {:.3} s on the record's clock",
            m.samples, m.start_s, m.end_s
        ),
    );
    let (alpha, mach, qbar, altitude) = (m.alpha_deg, m.mach, m.qbar_psf, m.altitude_ft);
    line(
        text,
        "flown at",
        &format!("alpha {alpha:.2} deg, Mach {mach:.3}, qbar {qbar:.1} psf, {altitude:.0} ft"),
    );
}

/// What ingest did to the channels of its flight.
fn samples(text: &mut String, flight: &Flight, maneuver: &Maneuver) {
    heading(text, &format!("The record of {}", maneuver.flight_id));
    let repaired = flight
        .ingested
        .channels
        .iter()
        .filter(|c| c.bridged + c.despiked + c.missing > 0);
    let words = |c: &crate::tables::ChannelRow| {
        format!(
            "{} ({} bridged, {} despiked, {} missing)",
            c.channel, c.bridged, c.despiked, c.missing
        )
    };
    let repaired: Vec<String> = repaired.map(words).collect();
    line(
        text,
        "repaired",
        &if repaired.is_empty() {
            "nothing".to_owned()
        } else {
            repaired.join(", ")
        },
    );
    let failed = flight
        .ingested
        .checks
        .iter()
        .filter(|c| !c.verdict.passed());
    let failed: Vec<String> = failed
        .map(|c| format!("{}: {}", c.relation, c.verdict))
        .collect();
    line(
        text,
        "checks",
        &if failed.is_empty() {
            "none failed".to_owned()
        } else {
            failed.join("; ")
        },
    );
}

fn fitted(text: &mut String, estimated: &Estimated) {
    let fit = &estimated.fit;
    heading(text, "Fit");
    line(text, "outcome", &format!("{}: {}", fit.outcome, fit.reason));
    line(text, "start", fit.start.map_or("-", StartingValues::name));
    line(text, "iterations", &fit.iterations.to_string());
    line(
        text,
        "cost",
        &format!(
            "{} at the start, {} at the end",
            number(fit.initial_cost),
            number(fit.final_cost)
        ),
    );
    line(text, "condition number", &number(fit.condition_number));
    let share = fit.left_out.map_or_else(
        || "-".to_owned(),
        |share| format!("{:.2} % of the output samples", 100.0 * share),
    );
    line(text, "left out", &share);
    line(
        text,
        "confounded",
        fit.confounded.as_deref().unwrap_or("nothing"),
    );
}

fn derivatives(text: &mut String, estimated: &Estimated) {
    heading(text, "Derivatives");
    let _ = writeln!(
        text,
        "  {:<10} {:<9} {:>12} {:>12} {:>12} {:>12} {:>9}  unit",
        "", "", "value", "bound", "corrected", "tunnel", "inflation"
    );
    let row = |text: &mut String, e: &EstimateRow| {
        let because = e
            .held_because
            .as_deref()
            .map_or_else(String::new, |why| format!("  {why}"));
        let cells = [e.value, e.bound, e.bound_corrected, e.wind_tunnel].map(number);
        let _ = writeln!(
            text,
            "  {:<10} {:<9} {:>12} {:>12} {:>12} {:>12} {:>9}  {}{because}",
            e.derivative,
            e.status,
            cells[0],
            cells[1],
            cells[2],
            cells[3],
            number(e.variance_inflation),
            e.unit
        );
    };
    estimated
        .estimates
        .iter()
        .filter(|e| e.status != Status::Inactive)
        .for_each(|e| row(text, e));
    estimated.combined.iter().for_each(|e| row(text, e));
    let inactive = estimated
        .estimates
        .iter()
        .filter(|e| e.status == Status::Inactive);
    let inactive: Vec<&str> = inactive.map(|e| e.derivative.as_str()).collect();
    line(
        text,
        "inactive",
        &if inactive.is_empty() {
            "none".to_owned()
        } else {
            inactive.join(" ")
        },
    );
}

fn correlations(text: &mut String, estimated: &Estimated, limit: f64) {
    heading(text, &format!("Correlations beyond {limit}"));
    let strong: Vec<_> = estimated
        .correlations
        .iter()
        .filter(|c| c.correlation.abs() > limit)
        .collect();
    for c in &strong {
        line(
            text,
            c.kind.name(),
            &format!("{} {} {:.3}", c.first, c.second, c.correlation),
        );
    }
    if strong.is_empty() {
        line(text, "none", "");
    }
}

/// Four digits, enough to be told apart.
fn number(value: Option<f64>) -> String {
    match value {
        None => "-".to_owned(),
        Some(v) if v == 0.0 || (1e-3..1e5).contains(&v.abs()) => format!("{v:.5}"),
        Some(v) => format!("{v:.3e}"),
    }
}
