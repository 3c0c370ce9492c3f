//! The report stage: one self-contained HTML page (inline SVG, style and a light script that it
//! does without, nothing loaded) that a flight-test review board reads, and the same page on paper
//! ([`crate::pdf`]). Words and numbers are put together here, the looks are the template's.

mod as_flown;
mod by_class;
pub mod chart;
mod failures;
mod figure;
mod gallery;
mod histories;
mod marks;
mod notation;
mod overnight;
pub mod pages;
mod predictions;
mod provenance;
mod reduce;
#[cfg(test)]
mod samples;
mod scale;
mod sheets;
mod subject;
mod summary;
#[cfg(test)]
mod tests;
mod told_apart;
mod verdict;

use std::collections::BTreeSet;

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment};
use serde::Serialize;

use crate::aero::Axis;
use crate::error::Problem;
use crate::lineage::Changes;
use crate::maneuver::Maneuver;
use crate::output_error::identifiability::Limits;
use crate::tables::{
    ChannelRow, CheckRow, ComparisonRow, CorrelationRow, EstimateRow, EventRow, FitRow, History,
    InstrumentRow, PredictionRow, TrendRow,
};
use by_class::ClassFigure;
use failures::TableView;
pub use histories::thinned;
use notation::{Digits, NOTHING, angle, fixed, number};
pub use provenance::{Provenance, SourceFile};
use subject::Subject;
use summary::{ClassView, VerdictGroup};

/// Everything the report is made of.
#[derive(Clone, Copy, Debug)]
pub struct Contents<'a> {
    pub title: &'a str,
    pub aircraft: &'a str,
    /// Where the flights came from.
    pub archive: &'a str,
    /// The tunnel database, with its origin.
    pub wind_tunnel: &'a str,
    pub maneuvers: &'a [Maneuver],
    pub fits: &'a [FitRow],
    pub estimates: &'a [EstimateRow],
    /// Each maneuver's outputs predicted with the derivatives of others.
    pub predictions: &'a [PredictionRow],
    pub correlations: &'a [CorrelationRow],
    /// When a correlation, an inflation or a group is flagged.
    pub limits: &'a Limits,
    pub trends: &'a [TrendRow],
    pub comparison: &'a [ComparisonRow],
    pub channels: &'a [ChannelRow],
    pub checks: &'a [CheckRow],
    pub instruments: &'a [InstrumentRow],
    pub events: &'a [EventRow],
    pub problems: &'a [Problem],
    /// The maneuvers that have a page ([`pages::chosen`]), and their time histories, thinned to
    /// what a drawing can show.
    pub pages: &'a BTreeSet<String>,
    pub histories: &'a [History],
    /// A class is shown by its maneuver nearest to this angle of attack.
    pub typical_alpha_deg: f64,
    pub provenance: &'a Provenance,
    /// Derivatives in the order of the model.
    pub order: &'a [String],
    /// Name, title and axis of each configured class.
    pub classes: &'a [(String, String, Axis)],
    /// Since the night that was published before.
    pub overnight: &'a Changes,
}

/// What the template is given: see the first lines of `report.html` for what each part means.
#[derive(Debug, Serialize)]
struct Page<'a> {
    title: &'a str,
    aircraft: &'a str,
    archive: &'a str,
    wind_tunnel: &'a str,
    counts: String,
    changed: String,
    changes: Vec<TableView>,
    summary: summary::Summary,
    outcome_heads: Vec<&'static str>,
    classes: Vec<ClassView>,
    verdicts: Vec<VerdictGroup>,
    groups: Vec<gallery::FigureGroup>,
    never_estimated: Vec<&'a str>,
    inputs: Vec<ClassFigure>,
    together: Vec<ClassFigure>,
    rates: Vec<ClassFigure>,
    maneuvers: TableView,
    predictions: Option<TableView>,
    as_flown: Vec<as_flown::TriangleView>,
    told_apart: Vec<TableView>,
    failures: Vec<TableView>,
    sheets: Vec<sheets::Sheet>,
    provenance: &'a Provenance,
    data: TableView,
}

/// The page. `template` replaces the built-in one; it is given the same values.
///
/// # Errors
/// What is wrong with the template, with its line.
pub fn html(contents: &Contents, template: Option<&str>) -> Result<String, String> {
    let page = page(contents);
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment
        .render_named_str(
            "report.html",
            template.unwrap_or(include_str!("report.html")),
            Serde(&page),
        )
        .map_err(|error| format!("the report's template: {error:#}"))
}

fn page<'a>(contents: &Contents<'a>) -> Page<'a> {
    let subjects = subject::gather(contents);
    let anchors = gallery::anchors(&subjects);
    let classes = summary::classes(contents);
    Page {
        title: contents.title,
        aircraft: contents.aircraft,
        archive: contents.archive,
        wind_tunnel: contents.wind_tunnel,
        counts: counts(contents, &subjects),
        changed: overnight::headline(contents),
        changes: overnight::tables(contents),
        summary: summary::summary(contents, &subjects, &classes),
        outcome_heads: summary::outcome_heads(),
        classes,
        verdicts: summary::verdicts(&subjects, &anchors),
        groups: gallery::groups(contents, &subjects, &anchors),
        never_estimated: never_estimated(contents, &subjects),
        inputs: by_class::inputs(contents),
        together: by_class::together(contents),
        rates: by_class::rates(contents),
        maneuvers: maneuvers(contents),
        predictions: predictions::table(contents),
        as_flown: as_flown::triangles(contents),
        told_apart: told_apart::tables(contents),
        failures: failures::tables(contents),
        sheets: sheets::sheets(contents),
        provenance: contents.provenance,
        data: contents.provenance.table(),
    }
}

fn counts(contents: &Contents, subjects: &[Subject]) -> String {
    let of_maneuvers = contents.maneuvers.iter().map(|m| m.flight_id.as_str());
    let of_channels = contents.channels.iter().map(|c| c.flight_id.as_str());
    let flights: BTreeSet<&str> = of_maneuvers.chain(of_channels).collect();
    let estimated: usize = subjects.iter().map(|s| s.points.len()).sum();
    [
        notation::count(flights.len(), "flight"),
        notation::count(contents.maneuvers.len(), "maneuver"),
        notation::count(estimated, "estimate"),
    ]
    .join(", ")
}

/// Derivatives of the model that no maneuver estimates: they stand nowhere else in the page.
fn never_estimated<'a>(contents: &Contents<'a>, subjects: &[Subject]) -> Vec<&'a str> {
    let shown: BTreeSet<&str> = subjects.iter().map(|s| s.name).collect();
    contents
        .order
        .iter()
        .map(String::as_str)
        .filter(|name| !shown.contains(name))
        .collect()
}

/// Flight against tunnel for one derivative, a row per angle of attack.
fn comparison(subject: &Subject) -> TableView {
    let rows = &subject.comparison;
    let values = rows
        .iter()
        .flat_map(|c| [Some(c.flight), c.wind_tunnel])
        .flatten();
    let digits = Digits::of(values, 4);
    let row = |c: &&crate::tables::ComparisonRow| {
        vec![
            angle(c.alpha_deg),
            digits.write(Some(c.flight)),
            digits.write(Some(c.standard_error)),
            digits.write(c.wind_tunnel),
            digits.write(c.difference),
            c.difference_pct
                .map_or_else(|| NOTHING.to_owned(), |p| fixed(p, 1)),
            c.z.map_or_else(|| NOTHING.to_owned(), |z| fixed(z, 1)),
            c.verdict.clone(),
        ]
    };
    let heads = [
        "α",
        "flight",
        "standard error",
        "wind tunnel",
        "difference",
        "%",
        "z",
        "verdict",
    ];
    let note = subject
        .trend
        .first()
        .map_or_else(String::new, |t| trend_in_words(t));
    let title = "Flight against wind tunnel".to_owned();
    TableView {
        title,
        ..TableView::new("", &note, &heads, rows.iter().map(row).collect())
    }
}

/// What the trend that speaks for flight was fitted through, and how.
fn trend_in_words(trend: &TrendRow) -> String {
    let maneuvers = notation::count(trend.maneuvers, "maneuver");
    let scatter = number(Some(trend.scatter), 2);
    format!(
        "trend of {}: {maneuvers}, order {}, scatter {scatter}",
        trend.group, trend.order
    )
}

/// That not every maneuver has a page, where that is so.
fn without_page(contents: &Contents) -> String {
    let (all, with) = (contents.maneuvers.len(), contents.pages.len());
    if with >= all {
        return String::new();
    }
    format!(
        "{with} of {all} maneuvers have a page below: those that stand for their class, changed since the night before or \
         failed, and some of the others; `harvest show maneuver` draws any of them"
    )
}

/// Every maneuver with its flight condition and how its fit ended.
fn maneuvers(contents: &Contents) -> TableView {
    let fits = summary::fits_by_maneuver(contents);
    let row = |m: &Maneuver| {
        let fit = fits.get(m.maneuver_id.as_str());
        let of_fit = |value: fn(&FitRow) -> Option<f64>| number(fit.and_then(|f| value(f)), 3);
        vec![
            m.maneuver_id.clone(),
            m.flight_id.clone(),
            m.class.clone(),
            format!("{}\u{2013}{}", fixed(m.start_s, 1), fixed(m.end_s, 1)),
            fixed(m.alpha_deg, 1),
            fixed(m.mach, 3),
            fixed(m.qbar_psf, 1),
            fit.map_or("no fit", |f| summary::outcome_in_words(&f.outcome))
                .to_owned(),
            fit.map_or_else(|| NOTHING.to_owned(), |f| f.iterations.to_string()),
            of_fit(|f| f.initial_cost),
            of_fit(|f| f.final_cost),
            of_fit(|f| f.condition_number),
            fit.and_then(|f| f.left_out)
                .map_or_else(|| NOTHING.to_owned(), |share| fixed(100.0 * share, 2)),
            // That a fit converged needs no reason; for the others the reader wants it beside the
            // flight condition.
            fit.filter(|f| f.outcome != "converged")
                .map_or_else(String::new, |f| f.reason.clone()),
        ]
    };
    let heads = [
        "maneuver",
        "flight",
        "class",
        "time, s",
        "α, deg",
        "Mach",
        "q̄, psf",
        "outcome",
        "iterations",
        "first J",
        "last J",
        "condition",
        "left out, %",
        "reason",
    ];
    let mut table = TableView::new(
        "Maneuvers",
        &without_page(contents),
        &heads,
        contents.maneuvers.iter().map(row).collect(),
    );
    let (marks, anchors) = (gallery::marks(contents), sheets::anchors(contents));
    let anchor = |m: &Maneuver| {
        anchors
            .get(m.maneuver_id.as_str())
            .cloned()
            .unwrap_or_default()
    };
    table.links = contents.maneuvers.iter().map(anchor).collect();
    table.classes = contents
        .maneuvers
        .iter()
        .map(|m| gallery::token(&marks, &m.class))
        .collect();
    table
}
