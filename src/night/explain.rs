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
use crate::pipeline::{
    Campaign, Conductor, EstimateStep, Flight, LazyRecord, Progress, estimate_basis,
};
use crate::pipeline::{SegmentStep, Step};
use crate::tables::{ChannelRow, EstimateRow, StartingValues};

/// Explains the maneuver of this id, as text.
///
/// # Errors
/// No archive, or no such maneuver in the store; then with the likely name.
pub fn explain(config: &Config, id: &str, progress: &dyn Progress) -> Result<String> {
    let conductor = Conductor::read_only(config, progress)?;
    // All flights: their surfaces' delays decide every estimate.
    let mut campaign = conductor.campaign(Stage::Segment)?;
    conductor.surfaces(&mut campaign)?;
    if let Some(maneuver) = campaign.maneuvers.iter().find(|m| m.maneuver_id == id) {
        return explain_maneuver(&conductor, &campaign, maneuver);
    }
    let known = campaign.maneuvers.iter().map(|m| m.maneuver_id.as_str());
    let likely = did_you_mean(id, known);
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
        basis: &estimate_basis(config),
        store: &runner.store,
        record: &LazyRecord::new(flight, &runner.store, &campaign.delays),
        maneuver,
    };
    let mut text = String::new();
    write_origin(&mut text, config, maneuver);
    write_record(&mut text, flight, maneuver);
    match runner.load(&step) {
        Some(estimate) => {
            let limit = config.estimate.identifiability.correlation;
            write_fit(&mut text, &estimate.artefact);
            write_derivatives(&mut text, &estimate.artefact);
            write_correlations(&mut text, &estimate.artefact, limit);
        }
        None => write_line(
            &mut text,
            "Estimate",
            "not made yet, or stale: `harvest status` gives the reason",
        ),
    }
    write_input(&mut text, conductor, maneuver);
    let record = flight.ingested.record.as_ref();
    let segment = SegmentStep::new(config, &runner.store, flight)?.name();
    write_line(
        &mut text,
        "record",
        record.map_or("-", |record| record.name.file_name()),
    );
    write_line(&mut text, "segment", segment.file_name());
    write_line(&mut text, "estimate", step.name().file_name());
    write_method(&mut text, conductor);
    Ok(text)
}

/// Writes the files of the maneuver's flight and the fingerprint of their content.
fn write_input(text: &mut String, conductor: &Conductor, maneuver: &Maneuver) {
    write_heading(text, "Depends on");
    let mut archive = conductor.archive.iter();
    let Some(files) = archive.find(|f| is_stretch(&maneuver.flight_id, &f.flight_id)) else {
        return;
    };
    for file in &files.files {
        write_line(text, "file", &file.display().to_string());
    }
    let content = conductor.flight_contents.fingerprint(&files.flight_id);
    write_line(text, "content", content.unwrap_or("-"));
}

/// Writes program, methods and configuration behind the estimate.
fn write_method(text: &mut String, conductor: &Conductor) {
    let lineage = campaign_lineage(conductor).until(Stage::Estimate);
    let code = &lineage.code;
    let program = format!("harvest {} ({})", code.version, code.source);
    write_line(text, "code", &program);
    let methods = ["ingest", "segment", "surfaces", "estimate"].map(|name| {
        let version = code.methods.get(name).copied().unwrap_or_default();
        format!("{name} {version}")
    });
    write_line(text, "methods", &methods.join(", "));
    let parts = lineage.configuration.values().flat_map(|p| p.keys());
    let parts: Vec<&str> = parts.map(String::as_str).collect();
    write_line(text, "configuration", &parts.join(", "));
}

fn write_heading(text: &mut String, title: &str) {
    let _ = writeln!(text, "\n{title}");
}

fn write_line(text: &mut String, name: &str, value: &str) {
    let _ = writeln!(text, "  {name:<16} {value}");
}

fn write_origin(text: &mut String, config: &Config, m: &Maneuver) {
    let title = config
        .class(&m.class)
        .map_or("a class that is no longer configured", |c| c.title.as_str());
    let _ = writeln!(text, "{}: {}, {title}", m.maneuver_id, m.class);
    write_line(text, "flight", &m.flight_id);
    let origin = if m.origin == ManeuverOrigin::Given {
        "given in the analyst's list of events"
    } else {
        "found in the record"
    };
    write_line(text, "where from", origin);
    write_line(
        text,
        "samples",
        &format!(
            "{} from {:.3} s to {:.3} s on the record's clock",
            m.samples, m.start_s, m.end_s
        ),
    );
    let (alpha, mach, qbar, altitude) = (m.alpha_deg, m.mach, m.qbar_psf, m.altitude_ft);
    write_line(
        text,
        "flown at",
        &format!("alpha {alpha:.2} deg, Mach {mach:.3}, qbar {qbar:.1} psf, {altitude:.0} ft"),
    );
}

/// Writes the repairs and failed checks of the flight's channels.
fn write_record(text: &mut String, flight: &Flight, maneuver: &Maneuver) {
    write_heading(text, &format!("The record of {}", maneuver.flight_id));
    let channels = flight.ingested.assessment.channels.iter();
    let repaired = channels.filter(|c| c.bridged + c.despiked + c.missing > 0);
    let repaired: Vec<String> = repaired.map(repairs).collect();
    write_line(text, "repaired", &joined_or(&repaired, ", ", "nothing"));
    let checks = flight.ingested.assessment.checks.iter();
    let failed: Vec<String> = checks
        .filter(|c| !c.verdict.passed())
        .map(|c| format!("{}: {}", c.relation, c.verdict))
        .collect();
    write_line(text, "checks", &joined_or(&failed, "; ", "none failed"));
}

/// Repairs of a channel: `alpha (3 bridged, 1 despiked, 0 missing)`.
fn repairs(c: &ChannelRow) -> String {
    format!(
        "{} ({} bridged, {} despiked, {} missing)",
        c.channel, c.bridged, c.despiked, c.missing
    )
}

/// Joins texts; `none` for an empty list.
fn joined_or(texts: &[String], separator: &str, none: &str) -> String {
    if texts.is_empty() {
        none.to_owned()
    } else {
        texts.join(separator)
    }
}

fn write_fit(text: &mut String, estimated: &Estimated) {
    let fit = &estimated.fit;
    write_heading(text, "Fit");
    write_line(text, "outcome", &format!("{}: {}", fit.outcome, fit.reason));
    write_line(text, "start", fit.start.map_or("-", StartingValues::name));
    write_line(text, "iterations", &fit.iterations.to_string());
    write_line(
        text,
        "cost",
        &format!(
            "{} at the start, {} at the end",
            format_number(fit.initial_cost),
            format_number(fit.final_cost)
        ),
    );
    write_line(
        text,
        "condition number",
        &format_number(fit.condition_number),
    );
    let share = fit.left_out.map_or_else(
        || "-".to_owned(),
        |share| format!("{:.2} % of the output samples", 100.0 * share),
    );
    write_line(text, "left out", &share);
    write_line(
        text,
        "confounded",
        fit.confounded.as_deref().unwrap_or("nothing"),
    );
}

/// Least width of the names of derivatives.
const SHORT_DERIVATIVE: usize = 10;

fn write_derivatives(text: &mut String, estimated: &Estimated) {
    write_heading(text, "Derivatives");
    let named = estimated.estimates.iter().chain(&estimated.combined);
    let longest = named.map(|e| e.derivative.chars().count()).max();
    let width = longest.unwrap_or_default().max(SHORT_DERIVATIVE);
    let _ = writeln!(
        text,
        "  {:<width$} {:<9} {:>12} {:>12} {:>12} {:>12} {:>9}  unit",
        "", "", "value", "bound", "corrected", "tunnel", "inflation"
    );
    let is_inactive = |e: &&EstimateRow| e.status == Status::Inactive;
    let estimates = estimated.estimates.iter();
    let active = estimates.clone().filter(|e| !is_inactive(e));
    for row in active.chain(&estimated.combined) {
        write_derivative(text, row, width);
    }
    let inactive: Vec<String> = estimates
        .filter(is_inactive)
        .map(|e| e.derivative.clone())
        .collect();
    write_line(text, "inactive", &joined_or(&inactive, " ", "none"));
}

fn write_derivative(text: &mut String, e: &EstimateRow, width: usize) {
    let because = e
        .held_because
        .as_deref()
        .map_or_else(String::new, |why| format!("  {why}"));
    let [value, bound, corrected, tunnel] =
        [e.value, e.bound, e.bound_corrected, e.wind_tunnel].map(format_number);
    let inflation = format_number(e.variance_inflation);
    let _ = writeln!(
        text,
        "  {:<width$} {:<9} {value:>12} {bound:>12} {corrected:>12} {tunnel:>12} {inflation:>9}  {}{because}",
        e.derivative,
        e.status.name(),
        e.unit
    );
}

fn write_correlations(text: &mut String, estimated: &Estimated, limit: f64) {
    write_heading(text, &format!("Correlations beyond {limit}"));
    let strong: Vec<_> = estimated
        .correlations
        .iter()
        .filter(|c| c.correlation.abs() > limit)
        .collect();
    for c in &strong {
        write_line(
            text,
            c.kind.name(),
            &format!("{} {} {:.3}", c.first, c.second, c.correlation),
        );
    }
    if strong.is_empty() {
        write_line(text, "none", "");
    }
}

/// Formats a number with about five digits.
fn format_number(value: Option<f64>) -> String {
    match value {
        None => "-".to_owned(),
        Some(v) if v == 0.0 || (1e-3..1e5).contains(&v.abs()) => format!("{v:.5}"),
        Some(v) => format!("{v:.3e}"),
    }
}
