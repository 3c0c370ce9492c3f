//! Origin, samples, fit and dependencies of one maneuver, from the store. Nothing is made or changed.

use std::fmt::Write;
use std::path::Path;

use super::campaign_lineage::campaign_lineage;
use crate::config::Config;
use crate::error::{Error, Result, did_you_mean};
use crate::estimate::Estimated;
use crate::flight::is_stretch;
use crate::lineage::Stage;
use crate::maneuver::{Maneuver, ManeuverOrigin, Status};
use crate::pipeline::{Campaign, Conductor, EstimateStep, Flight, LazyRecord, Progress};
use crate::pipeline::{SegmentStep, Step};
use crate::store::archive::FlightFiles;
use crate::tables::{EstimateRow, StartingValues};

/// Explains the maneuver of this id, as text.
///
/// # Errors
/// No archive, or no such maneuver in the store; then with the likely name.
pub fn explain(config: &Config, id: &str, progress: &dyn Progress) -> Result<String> {
    let conductor = Conductor::look(config, progress)?;
    // Ids begin with the flight's: the artefacts of most flights need not be read.
    let (likely, rest): (Vec<FlightFiles>, Vec<FlightFiles>) = conductor
        .archive
        .iter()
        .cloned()
        .partition(|f| id.starts_with(f.flight_id.as_str()));
    let mut known = Vec::new();
    for files in [likely, rest] {
        let campaign = conductor.campaign_of(&files, Stage::Segment)?;
        if let Some(maneuver) = campaign.maneuvers.iter().find(|m| m.maneuver_id == id) {
            return explain_maneuver(&conductor, &campaign, maneuver);
        }
        known.extend(campaign.maneuvers.into_iter().map(|m| m.maneuver_id));
    }
    let likely = did_you_mean(id, known.iter().map(String::as_str));
    let what = format!(
        "the store has no maneuver `{id}`{likely}; `harvest status` reports whether it is up to date"
    );
    Err(Error::not_found(Path::new(&config.archive), what))
}

fn explain_maneuver(
    conductor: &Conductor,
    campaign: &Campaign,
    maneuver: &Maneuver,
) -> Result<String> {
    let runner = &conductor.runner;
    let config = runner.config;
    let mut flights = campaign.flights.iter();
    let flight = flights
        .find(|f| f.id() == maneuver.flight_id)
        .ok_or_else(|| Error::store(runner.store.folder(), &"the maneuver's flight is missing"))?;
    let step = EstimateStep {
        config,
        store: &runner.store,
        record: &LazyRecord::new(flight, &runner.store),
        maneuver,
    };
    let mut text = String::new();
    origin(&mut text, config, maneuver);
    record(&mut text, flight, maneuver);
    match runner.load(&step) {
        Some(estimate) => {
            let limit = config.estimate.identifiability.correlation;
            fitted(&mut text, &estimate.artefact);
            derivatives(&mut text, &estimate.artefact);
            correlations(&mut text, &estimate.artefact, limit);
        }
        None => line(
            &mut text,
            "Estimate",
            "not made yet, or stale: `harvest status` gives the reason",
        ),
    }
    input(&mut text, conductor, maneuver);
    let record = flight.ingested.record.as_ref();
    let segment = SegmentStep::new(config, &runner.store, flight)?.name();
    line(
        &mut text,
        "record",
        record.map_or("-", |record| record.name.file_name()),
    );
    line(&mut text, "segment", segment.file_name());
    line(&mut text, "estimate", step.name().file_name());
    method(&mut text, conductor);
    Ok(text)
}

/// Writes the files of the maneuver's flight and the fingerprint of their content.
fn input(text: &mut String, conductor: &Conductor, maneuver: &Maneuver) {
    heading(text, "Depends on");
    let mut archive = conductor.archive.iter();
    let Some(files) = archive.find(|f| is_stretch(&maneuver.flight_id, &f.flight_id)) else {
        return;
    };
    for file in &files.files {
        line(text, "file", &file.display().to_string());
    }
    let content = conductor.flight_contents.fingerprint(&files.flight_id);
    line(text, "content", content.unwrap_or("-"));
}

/// Writes program, methods and configuration behind the estimate.
fn method(text: &mut String, conductor: &Conductor) {
    let lineage = campaign_lineage(conductor).until(Stage::Estimate);
    let code = &lineage.code;
    let program = format!("harvest {} ({})", code.version, code.source);
    line(text, "code", &program);
    let methods = ["ingest", "segment", "estimate"].map(|name| {
        let version = code.methods.get(name).copied().unwrap_or_default();
        format!("{name} {version}")
    });
    line(text, "methods", &methods.join(", "));
    let parts = lineage.configuration.values().flat_map(|p| p.keys());
    let parts: Vec<&str> = parts.map(String::as_str).collect();
    line(text, "configuration", &parts.join(", "));
}

fn heading(text: &mut String, title: &str) {
    let _ = writeln!(text, "\n{title}");
}

fn line(text: &mut String, name: &str, value: &str) {
    let _ = writeln!(text, "  {name:<16} {value}");
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

/// Writes the repairs and failed checks of the flight's channels.
fn record(text: &mut String, flight: &Flight, maneuver: &Maneuver) {
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

/// A number with five digits.
fn number(value: Option<f64>) -> String {
    match value {
        None => "-".to_owned(),
        Some(v) if v == 0.0 || (1e-3..1e5).contains(&v.abs()) => format!("{v:.5}"),
        Some(v) => format!("{v:.3e}"),
    }
}
