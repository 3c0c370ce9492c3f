//! The report of the campaign: the page and its printed form.

use crate::config::Config;
use crate::error::{Error, Result};
use crate::lineage::Changes;
use crate::maneuver::Class;
use crate::pdf;
use crate::pipeline::campaign::Campaign;
use crate::pipeline::conductor::{Conductor, step_versions};
use crate::report;
use crate::store::{ArtefactName, Kind};
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
    let with_page = campaign
        .maneuvers
        .iter()
        .zip(&campaign.estimate_names)
        .filter(|(maneuver, _)| pages.contains(&maneuver.maneuver_id));
    let history = |name: &ArtefactName| {
        let name = name.sibling(Kind::History);
        conductor.runner.store.load::<Option<History>>(&name)?
    };
    let histories: Vec<History> = with_page.filter_map(|(_, name)| history(name)).collect();
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
        histories: &histories,
        typical_alpha_deg: alpha_deg,
        provenance: &provenance(conductor),
        order: &config.derivative_names(),
        classes: &classes,
        overnight: changes,
    };
    let html = report::html(&contents, config.template.as_deref())
        .map_err(|e| Error::store(&config.reports.join(PAGE), &e))?;
    let pdf = pdf::pdf(&html);
    Ok(Report { html, pdf })
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
