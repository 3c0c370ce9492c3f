//! The report of the campaign: the page and its printed form.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::config::Config;
use crate::drawing_cache::DrawingCache;
use crate::error::{Error, Result};
use crate::lineage::Changes;
use crate::maneuver::Class;
use crate::pdf;
use crate::pipeline::campaign::Campaign;
use crate::pipeline::conductor::{Conductor, step_versions};
use crate::report::{self, HistoryFigure};
use crate::store::{ArtefactName, Kind, Store};
use crate::tables::{EstimateRow, History};

/// Published file of the page.
pub const PAGE: &str = "report.html";

/// Published file of the printed page.
pub const PRINTED_PAGE: &str = "report.pdf";

/// The report, in both forms.
#[derive(Clone, Debug)]
pub struct Report {
    pub html: String,
    /// The reason instead, if the page of the analyst's template cannot be printed.
    pub pdf: Result<Vec<u8>, String>,
}

/// Makes the report of a compared campaign.
///
/// # Errors
/// [`Error::Store`] naming the report: the analyst's template is faulty.
pub fn make_report(
    conductor: &Conductor,
    campaign: &Campaign,
    changes: &Changes,
) -> Result<Report> {
    let config = conductor.runner.config;
    let alpha_deg = config.report.histories_at_alpha_deg;
    let pages = report::maneuvers_with_page(
        &campaign.maneuvers,
        &campaign.fits,
        changes,
        alpha_deg,
        config.report.maneuver_pages,
    );
    let store = &conductor.runner.store;
    let drawings = store.drawings();
    let history_figures = history_figures(store, &drawings, campaign, &pages);
    let representatives = report::representatives(&campaign.maneuvers, &campaign.fits, alpha_deg);
    let represent = estimates_of(campaign, |id| representatives.contains(id));
    let histories: Vec<History> = represent
        .filter_map(|(_, name)| history(store, name))
        .collect();
    let classes = config.classes.iter().map(configured_class);
    let classes: Vec<report::ConfiguredClass> = classes.collect();
    let estimates: Vec<EstimateRow> = campaign.estimates_and_sums().cloned().collect();
    let contents = report::Contents {
        title: &config.title,
        aircraft: &config.aircraft.name,
        archive: &config.archive,
        wind_tunnel: &tunnel_and_sources(config),
        maneuvers: &campaign.maneuvers,
        fits: &campaign.fits,
        estimates: &estimates,
        predictions: &campaign.predictions(),
        correlations: &campaign.correlations,
        limits: &config.estimate.identifiability,
        posterior: &campaign.model.rows.posterior,
        contributions: &campaign.model.rows.contributions,
        trends: &campaign.trends,
        specification: config.qualities.as_ref(),
        qualities: &campaign.qualities,
        tolerances: config.proof_of_match.as_ref(),
        matched: &campaign.matched,
        comparison: &campaign.comparison,
        flights: &campaign.flight_rows,
        channels: &campaign.channels,
        checks: &campaign.checks,
        instruments: &campaign.instruments,
        instrument_trends: &campaign.instrument_trends,
        events: &campaign.events,
        problems: &campaign.problems,
        pages: &pages,
        history_figures: &history_figures,
        histories: &histories,
        typical_alpha_deg: alpha_deg,
        provenance: &provenance(conductor),
        order: &config.derivative_names(),
        classes: &classes,
        overnight: changes,
    };
    let html = report::html(&contents, config.template.as_deref())
        .map_err(|e| Error::store(&config.reports.join(PAGE), &e))?;
    let pdf = pdf::pdf(&html, &drawings);
    store.keep_drawings(&drawings)?;
    Ok(Report { html, pdf })
}

/// Chosen maneuvers with the names of their estimates.
fn estimates_of(
    campaign: &Campaign,
    is_chosen: impl Fn(&str) -> bool,
) -> impl Iterator<Item = (&str, &ArtefactName)> {
    let names = campaign.estimate_names.iter();
    let ids = campaign.maneuvers.iter().map(|m| m.maneuver_id.as_str());
    ids.zip(names).filter(move |(id, _)| is_chosen(id))
}

/// Time history beside an estimate; `None` if no response was computed.
fn history(store: &Store, estimate: &ArtefactName) -> Option<History> {
    let name = estimate.sibling(Kind::History);
    store.load::<Option<History>>(&name)?
}

/// Time histories of the maneuvers with a page, drawn. The name of an estimate decides its history.
fn history_figures(
    store: &Store,
    drawings: &DrawingCache,
    campaign: &Campaign,
    pages: &BTreeSet<String>,
) -> BTreeMap<String, HistoryFigure> {
    let figure = |(id, name): (&str, &ArtefactName)| {
        let drawn = drawings.get_or_draw(name.as_str(), || {
            let svg_id = format!("h{}", name.fingerprint());
            let figure = report::draw_history(&history(store, name)?, svg_id);
            serde_json::to_vec(&figure).ok()
        });
        Some((id.to_owned(), serde_json::from_slice(&drawn?).ok()?))
    };
    let with_page: Vec<_> = estimates_of(campaign, |id| pages.contains(id)).collect();
    with_page.into_par_iter().filter_map(figure).collect()
}

fn configured_class(class: &Class) -> report::ConfiguredClass {
    report::ConfiguredClass {
        name: class.name.clone(),
        title: class.title.clone(),
        axis: class.axis,
    }
}

/// Everything that decided the results, so that anyone can make them again.
fn provenance(conductor: &Conductor) -> report::Provenance {
    let config = conductor.runner.config;
    let methods = step_versions().map(|(name, version)| format!("{name} {version}"));
    report::Provenance {
        program: format!(
            "harvest {} (sources {}), methods: {}",
            env!("CARGO_PKG_VERSION"),
            env!("HARVEST_SOURCE"),
            methods.join(", ")
        ),
        command: format!(
            "harvest run {} --archive '{}'{}",
            config.name,
            config.archive,
            tunnel_option(config)
        ),
        data: conductor.flight_contents.sources.clone(),
        configuration: config.files.clone(),
    }
}

/// Option of the command line that names the tunnel's file; empty without a tunnel.
fn tunnel_option(config: &Config) -> String {
    let file = config.wind_tunnel.as_ref();
    file.map_or_else(String::new, |file| {
        format!(" --wind-tunnel '{}'", file.display())
    })
}

/// Name of the tunnel database, with the stated sources of its values.
fn tunnel_and_sources(config: &Config) -> String {
    let (name, sources) = (config.tunnel_name(), config.tunnel.sources());
    if config.wind_tunnel.is_none() {
        name
    } else if sources.is_empty() {
        format!("{name} (no sources stated)")
    } else {
        format!("{name} (sources: {})", sources.join("; "))
    }
}
