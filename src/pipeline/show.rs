//! Strip charts of one flight or one maneuver.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::campaign::Campaign;
use super::conductor::Conductor;
use super::progress::Progress;
use super::records::ingested::Flight;
use super::steps::estimate_step::estimate_maneuver;
use crate::config::Config;
use crate::error::{Error, Problem, Result, did_you_mean};
use crate::flight::is_stretch;
use crate::lineage::Stage;
use crate::maneuver::Maneuver;
use crate::output_error::Outcome;
use crate::report::strip_chart::{self, FlightView, ManeuverView, SignalGroups};
use crate::store::atomic;
use crate::surfaces::DelayCorrection;

/// Largest number of samples of a flight that are drawn. Of a longer flight only the smallest and
/// the largest of several samples are drawn, since a chart has far fewer columns.
const DRAWN_SAMPLES: usize = 1 << 18;

/// Time of the record drawn before and after a maneuver, s.
const MARGIN_S: f64 = 30.0;

/// Flight or maneuver to draw.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ChartSubject {
    /// By its `flight_id`.
    Flight(String),
    /// By its `maneuver_id`.
    Maneuver(String),
}

/// A chart that was written.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenChart {
    pub path: PathBuf,
    /// Problems of the flight or maneuver.
    pub problems: Vec<Problem>,
}

/// Brings the flight or maneuver up to date and writes its strip chart to `out`, by default into
/// the folder `show` of the reports. No table is published.
///
/// # Errors
/// A fault that stops the run; a flight or maneuver that does not exist or was rejected, with the likely
/// name.
pub fn show(
    config: &Config,
    subject: &ChartSubject,
    out: Option<&Path>,
    progress: &dyn Progress,
) -> Result<WrittenChart> {
    let conductor = Conductor::open(config, Duration::ZERO, progress)?;
    let (id, svg, problems) = match subject {
        ChartSubject::Flight(id) => {
            check_flight(&conductor, id)?;
            let campaign = conductor.campaign(Stage::Segment)?;
            let chart = draw_flight(&conductor, &campaign, id)?;
            (id, chart, problems_of(&campaign, |p| p.flight_id == *id))
        }
        ChartSubject::Maneuver(id) => {
            let mut campaign = conductor.campaign(Stage::Segment)?;
            check_maneuver(config, id, &campaign)?;
            conductor.estimate(&mut campaign)?;
            let chart = draw_maneuver(&conductor, &campaign, id)?;
            (id, chart, problems_of(&campaign, |p| p.place == *id))
        }
    };
    let default = || config.reports.join("show").join(file_name(id));
    let path = out.map_or_else(default, Path::to_path_buf);
    atomic::place(&path, svg.as_bytes())?;
    Ok(WrittenChart { path, problems })
}

fn problems_of(campaign: &Campaign, is_wanted: impl Fn(&Problem) -> bool) -> Vec<Problem> {
    let problems = campaign.problems.iter().filter(|p| is_wanted(p));
    problems.cloned().collect()
}

/// Name of a chart's file, without characters that file systems reserve.
fn file_name(id: &str) -> String {
    let is_safe = |c: char| c.is_alphanumeric() || "-_=.".contains(c);
    let safe: String = id
        .chars()
        .map(|c| if is_safe(c) { c } else { '_' })
        .collect();
    format!("{safe}.svg")
}

fn unknown(config: &Config, what: String) -> Error {
    Error::not_found(Path::new(&config.archive), what)
}

fn check_flight(conductor: &Conductor, id: &str) -> Result<()> {
    let ids = || conductor.archive.iter().map(|f| f.flight_id.as_str());
    if ids().any(|flight_id| is_stretch(id, flight_id)) {
        return Ok(());
    }
    let likely = did_you_mean(id, ids());
    let what = format!("there is no flight `{id}`{likely}");
    Err(unknown(conductor.runner.config, what))
}

fn check_maneuver(config: &Config, id: &str, campaign: &Campaign) -> Result<()> {
    let ids = || campaign.maneuvers.iter().map(|m| m.maneuver_id.as_str());
    if ids().any(|maneuver_id| maneuver_id == id) {
        return Ok(());
    }
    if campaign.flights.iter().any(|f| f.id() == id) {
        let what = format!("`{id}` is a flight; `harvest show flight {id}` shows it");
        return Err(unknown(config, what));
    }
    let likely = did_you_mean(id, ids());
    let list = config.reports.join("maneuvers.csv");
    let what = format!(
        "there is no maneuver `{id}`{likely} (all of them: {})",
        list.display()
    );
    Err(unknown(config, what))
}

fn draw_flight(conductor: &Conductor, campaign: &Campaign, id: &str) -> Result<String> {
    let config = conductor.runner.config;
    let record = accepted_flight(config, campaign, id)?.open(&conductor.runner.store)?;
    let of_flight = |flight_id: &str| flight_id == id;
    let events = campaign.events.iter().filter(|e| of_flight(&e.flight_id));
    let unknown = campaign.unknown.iter().filter(|u| of_flight(&u.flight_id));
    Ok(strip_chart::draw_flight(&FlightView {
        aircraft: &config.aircraft.name,
        record: &record.outline(DRAWN_SAMPLES)?,
        recorded: (record.header.samples, record.header.step_s),
        groups: &groups(config),
        maneuvers: &maneuvers_of(campaign, id),
        unknown: &unknown.cloned().collect::<Vec<_>>(),
        events: &events.cloned().collect::<Vec<_>>(),
        problems: &problems_of(campaign, |p| p.flight_id == id),
    }))
}

fn draw_maneuver(conductor: &Conductor, campaign: &Campaign, id: &str) -> Result<String> {
    let config = conductor.runner.config;
    let (maneuver, fit) = campaign
        .maneuvers
        .iter()
        .zip(&campaign.fits)
        .find(|(m, _)| m.maneuver_id == id)
        .ok_or_else(|| unknown(config, format!("there is no maneuver `{id}`")))?;
    let flight = accepted_flight(config, campaign, &maneuver.flight_id)?;
    let further = campaign.delays.iter();
    let further = further.filter_map(DelayCorrection::of_record);
    let file = flight.open(&conductor.runner.store)?;
    let record = file.corrected_further(further).part(
        None,
        maneuver.start_s - MARGIN_S,
        maneuver.end_s + MARGIN_S,
    )?;
    let delays = &campaign.delays;
    // The stored history is thinned for the report; the chart shows every sample.
    let history = if fit.outcome == Outcome::Rejected {
        None
    } else {
        estimate_maneuver(config, &record, maneuver, delays).history
    };
    Ok(strip_chart::draw_maneuver(&ManeuverView {
        aircraft: &config.aircraft.name,
        record: &record,
        groups: &groups(config),
        maneuver,
        class: config.class(&maneuver.class),
        flight: &maneuvers_of(campaign, &maneuver.flight_id),
        fit,
        history: history.as_ref(),
    }))
}

/// Finds a flight that has a record.
fn accepted_flight<'c>(config: &Config, campaign: &'c Campaign, id: &str) -> Result<&'c Flight> {
    let mut flights = campaign.flights.iter();
    let flight = flights
        .find(|f| f.id() == id)
        .ok_or_else(|| unknown(config, format!("there is no flight `{id}`")))?;
    if flight.is_accepted() {
        return Ok(flight);
    }
    let what = format!(
        "flight `{id}` was refused, so there is no record to show: {}",
        flight.reasons()
    );
    Err(unknown(config, what))
}

fn maneuvers_of(campaign: &Campaign, id: &str) -> Vec<Maneuver> {
    campaign
        .maneuvers
        .iter()
        .filter(|m| m.flight_id == id)
        .cloned()
        .collect()
}

/// Sorts the configured signals into groups: surfaces have derivatives, pilot controls have counted
/// steps, flags are up or down in a class.
fn groups(config: &Config) -> SignalGroups {
    let derivatives = config.aero_model.derivatives.iter();
    let signals = derivatives.flat_map(|d| d.regressor.signals());
    let surfaces = unique(signals.map(str::to_owned));
    let stepping = config
        .segment
        .steps
        .keys()
        .filter(|name| !surfaces.contains(name))
        .cloned();
    let in_classes = config
        .classes
        .iter()
        .flat_map(|c| c.recognition.flags.keys().cloned());
    let own = std::iter::once(config.segment.excitation_flag.clone());
    let own = own.filter(|flag| !flag.is_empty());
    let flags = unique(own.chain(in_classes));
    SignalGroups {
        controls: stepping.collect(),
        flags,
        surfaces,
        steps: config.segment.steps.clone(),
    }
}

fn unique(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut unique: Vec<String> = Vec::new();
    for name in names {
        if !unique.contains(&name) {
            unique.push(name);
        }
    }
    unique
}
