//! Sections of the report: from `Contents` to the values that the template prints.
//!
//! The head of `report.html` documents the values.

mod classes;
mod derivatives;
mod maneuvers;
mod proof_of_match;
mod changes_section;
mod failures;
mod instrument_charts;
mod uncertainty_section;
mod qualities_section;
mod quality_charts;
mod summary;

use std::collections::BTreeSet;

use serde::Serialize;

use super::contents::Contents;
use super::notation::count;
use super::provenance::Provenance;
use super::table_view::TableView;
use classes::class_figures::ClassFigure;
use classes::class_markers::ClassMarkers;
use classes::class_outcomes::ClassOutcomes;
use derivatives::correlation_triangle::CorrelationTriangle;
use derivatives::derivative_page::DerivativeGroup;
use derivatives::derivative_results::DerivativeResults;
use derivatives::verdict_table::VerdictGroup;
pub use maneuvers::history_strips::draw_history;
use maneuvers::maneuver_page::ManeuverPage;
use proof_of_match::match_section::MatchSection;
use qualities_section::QualitiesSection;
use quality_charts::QualityChart;
use summary::Summary;
use uncertainty_section::UncertaintySection;

/// Values that the template prints.
#[derive(Debug, Serialize)]
pub struct Page<'a> {
    title: &'a str,
    aircraft: &'a str,
    archive: &'a str,
    wind_tunnel: &'a str,
    counts: String,
    changed: String,
    changes: Vec<TableView>,
    summary: Summary,
    outcome_heads: Vec<&'static str>,
    classes: Vec<ClassOutcomes>,
    verdicts: Vec<VerdictGroup>,
    qualities: Option<QualitiesSection>,
    proof_of_match: Option<MatchSection>,
    knowledge: Option<UncertaintySection>,
    derivative_groups: Vec<DerivativeGroup>,
    never_estimated: Vec<&'a str>,
    inputs: Vec<ClassFigure>,
    correlated_signals: Vec<ClassFigure>,
    rates: Vec<ClassFigure>,
    maneuvers: TableView,
    predictions: Option<TableView>,
    correlation_triangles: Vec<CorrelationTriangle>,
    identifiability: Vec<TableView>,
    is_held_by_evidence: bool,
    failures: Vec<TableView>,
    instrument_charts: Vec<QualityChart>,
    maneuver_pages: Vec<ManeuverPage>,
    provenance: &'a Provenance,
    data: TableView,
}

impl<'a> Page<'a> {
    /// Assembles all sections.
    #[must_use]
    pub fn new(contents: &Contents<'a>) -> Page<'a> {
        let derivatives = derivatives::derivative_results::collect(contents);
        let anchors = derivatives::derivative_page::anchors(&derivatives);
        let markers = ClassMarkers::new(contents);
        let classes = classes::class_outcomes::by_class(contents, &markers);
        Page {
            title: contents.title,
            aircraft: contents.aircraft,
            archive: contents.archive,
            wind_tunnel: contents.wind_tunnel,
            counts: counts(contents, &derivatives),
            changed: changes_section::headline(contents.overnight),
            changes: changes_section::tables(contents.overnight),
            summary: summary::summary(contents, &derivatives, &classes),
            outcome_heads: classes::class_outcomes::heads(),
            classes,
            verdicts: derivatives::verdict_table::by_axis(&derivatives, &anchors),
            qualities: qualities_section::section(contents),
            proof_of_match: proof_of_match::match_section::section(contents, &markers),
            knowledge: uncertainty_section::section(contents),
            derivative_groups: derivatives::derivative_page::groups(
                &derivatives,
                &anchors,
                &markers,
            ),
            never_estimated: never_estimated(contents, &derivatives),
            inputs: classes::class_figures::inputs(contents, &markers),
            correlated_signals: classes::class_figures::correlated_signals(contents, &markers),
            rates: classes::class_figures::rates(contents, &markers),
            maneuvers: maneuvers::maneuver_table::table(contents, &markers),
            predictions: maneuvers::prediction_table::table(contents),
            correlation_triangles: derivatives::correlation_triangle::triangles(contents),
            identifiability: derivatives::identifiability_tables::tables(contents),
            is_held_by_evidence: contents
                .estimates
                .iter()
                .any(|e| e.evidence_to_hold().is_some()),
            failures: failures::tables(contents),
            instrument_charts: instrument_charts::charts(contents),
            maneuver_pages: maneuvers::maneuver_page::pages(contents, &markers),
            provenance: contents.provenance,
            data: contents.provenance.table(),
        }
    }
}

/// Size of the campaign: `18 flights, 504 maneuvers, 9000 estimates`.
fn counts(contents: &Contents, derivatives: &[DerivativeResults]) -> String {
    let of_maneuvers = contents.maneuvers.iter().map(|m| m.flight_id.as_str());
    let of_channels = contents.channels.iter().map(|c| c.flight_id.as_str());
    let flights: BTreeSet<&str> = of_maneuvers.chain(of_channels).collect();
    let estimated: usize = derivatives.iter().map(|d| d.points.len()).sum();
    [
        count(flights.len(), "flight"),
        count(contents.maneuvers.len(), "maneuver"),
        count(estimated, "estimate"),
    ]
    .join(", ")
}

/// Derivatives of the model that no maneuver estimates; the page names them nowhere else.
fn never_estimated<'a>(contents: &Contents<'a>, derivatives: &[DerivativeResults]) -> Vec<&'a str> {
    let shown: BTreeSet<&str> = derivatives.iter().map(|d| d.name).collect();
    contents
        .order
        .iter()
        .map(String::as_str)
        .filter(|name| !shown.contains(name))
        .collect()
}
