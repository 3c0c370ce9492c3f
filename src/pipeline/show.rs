//! Pictures of one flight or one maneuver: what it takes is brought up to date, then drawn.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::{Campaign, Flight, Progress, Run, begin};
use crate::aero::Regressor;
use crate::config::Config;
use crate::error::{Error, Problem, Result, did_you_mean};
use crate::flight::is_stretch;
use crate::maneuver::Maneuver;
use crate::output_error::Outcome;
use crate::report::strip_chart::{self, FlightView, ManeuverView, SignalGroups};
use crate::store::archive::FlightFiles;
use crate::store::atomic;

/// A flight of more samples than this is drawn by the smallest and the largest of several: far more
/// than a picture has columns.
const DRAWN: usize = 1 << 18;

/// What of the record around a maneuver is at hand for its picture, s.
const AROUND_S: f64 = 30.0;

/// What is to be seen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Subject {
    /// By its `flight_id`.
    Flight(String),
    /// By its `maneuver_id`.
    Maneuver(String),
}

/// A picture that was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub path: PathBuf,
    /// What of that which is shown was rejected.
    pub problems: Vec<Problem>,
}

/// Brings the flight or maneuver up to date as the stages do, and writes its strip chart to `out`,
/// or else into the folder `show` of the reports. The table `problems`, which is the whole
/// campaign's, is left to the stages.
///
/// # Errors
/// What stops a run, and a flight or maneuver that does not exist or was refused, with what was
/// probably meant.
pub fn show(
    config: &Config,
    subject: &Subject,
    out: Option<&Path>,
    progress: &dyn Progress,
) -> Result<Picture> {
    let (run, files) = begin(config, Duration::ZERO, progress)?;
    let mut campaign = Campaign::default();
    if let Subject::Flight(id) = subject {
        known_flight(config, id, &files)?;
    }
    run.ingest(&files, &mut campaign)?;
    run.segment(&mut campaign)?;
    let (id, svg, problems) = match subject {
        Subject::Flight(id) => (
            id,
            run.draw_flight(&campaign, id)?,
            about(&campaign, |p| p.flight_id == *id),
        ),
        Subject::Maneuver(id) => {
            known_maneuver(config, id, &campaign)?;
            run.estimate(&mut campaign)?;
            let of_it = |p: &Problem| p.place == *id;
            (
                id,
                run.draw_maneuver(&campaign, id)?,
                about(&campaign, of_it),
            )
        }
    };
    let path = out.map_or_else(
        || config.reports.join("show").join(file_name(id)),
        Path::to_path_buf,
    );
    atomic::place(&path, svg.as_bytes())?;
    Ok(Picture { path, problems })
}

fn about(campaign: &Campaign, is_it: impl Fn(&Problem) -> bool) -> Vec<Problem> {
    campaign
        .problems
        .iter()
        .filter(|p| is_it(p))
        .cloned()
        .collect()
}

fn file_name(id: &str) -> String {
    let safe = |c: char| {
        if c.is_alphanumeric() || "-_=.".contains(c) {
            c
        } else {
            '_'
        }
    };
    format!("{}.svg", id.chars().map(safe).collect::<String>())
}

fn unknown(config: &Config, what: String) -> Error {
    Error::not_found(Path::new(&config.archive), what)
}

fn known_flight(config: &Config, id: &str, files: &[FlightFiles]) -> Result<()> {
    if files.iter().any(|f| is_stretch(id, &f.flight_id)) {
        return Ok(());
    }
    let near = did_you_mean(id, files.iter().map(|f| f.flight_id.as_str()));
    Err(unknown(config, format!("there is no flight `{id}`{near}")))
}

fn known_maneuver(config: &Config, id: &str, campaign: &Campaign) -> Result<()> {
    if campaign.maneuvers.iter().any(|m| m.maneuver_id == id) {
        return Ok(());
    }
    if campaign.flights.iter().any(|f| f.flight_id == id) {
        return Err(unknown(
            config,
            format!("`{id}` is a flight; `harvest show flight {id}` shows it"),
        ));
    }
    let near = did_you_mean(
        id,
        campaign.maneuvers.iter().map(|m| m.maneuver_id.as_str()),
    );
    let list = config.reports.join("maneuvers.csv");
    Err(unknown(
        config,
        format!(
            "there is no maneuver `{id}`{near} (all of them: {})",
            list.display()
        ),
    ))
}

impl Run<'_> {
    fn draw_flight(&self, campaign: &Campaign, id: &str) -> Result<String> {
        let file = self.flight(campaign, id)?.open(&self.store)?;
        let (record, recorded) = (
            file.outline(DRAWN)?,
            (file.about.samples, file.about.step_s),
        );
        let events: Vec<_> = campaign
            .events
            .iter()
            .filter(|e| e.flight_id == id)
            .cloned()
            .collect();
        Ok(strip_chart::draw_flight(&FlightView {
            aircraft: &self.config.aircraft.name,
            record: &record,
            recorded,
            groups: &groups(self.config),
            maneuvers: &of_flight(campaign, id),
            unknown: &campaign
                .unknown
                .iter()
                .filter(|u| u.flight_id == id)
                .cloned()
                .collect::<Vec<_>>(),
            events: &events,
            problems: &about(campaign, |p| p.flight_id == id),
        }))
    }

    fn draw_maneuver(&self, campaign: &Campaign, id: &str) -> Result<String> {
        let of_both = campaign
            .maneuvers
            .iter()
            .zip(&campaign.fits)
            .find(|(m, _)| m.maneuver_id == id);
        let (maneuver, fit) =
            of_both.ok_or_else(|| unknown(self.config, format!("there is no maneuver `{id}`")))?;
        let file = self
            .flight(campaign, &maneuver.flight_id)?
            .open(&self.store)?;
        let record = file.part(None, maneuver.start_s - AROUND_S, maneuver.end_s + AROUND_S)?;
        // Computed again rather than stored, as for the report.
        let history = if fit.outcome == Outcome::Rejected {
            None
        } else {
            self.estimate_maneuver(&record, maneuver).history
        };
        Ok(strip_chart::draw_maneuver(&ManeuverView {
            aircraft: &self.config.aircraft.name,
            record: &record,
            groups: &groups(self.config),
            maneuver,
            class: self.config.class(&maneuver.class),
            flight: &of_flight(campaign, &maneuver.flight_id),
            fit,
            history: history.as_ref(),
        }))
    }

    /// A flight that has a record.
    fn flight<'c>(&self, campaign: &'c Campaign, id: &str) -> Result<&'c Flight> {
        let flight = campaign.flights.iter().find(|f| f.flight_id == id);
        let flight =
            flight.ok_or_else(|| unknown(self.config, format!("there is no flight `{id}`")))?;
        if flight.ingested.accepted {
            return Ok(flight);
        }
        let reasons: Vec<String> = flight
            .ingested
            .problems
            .iter()
            .map(|p| format!("{}: {}", p.place, p.reason))
            .collect();
        Err(unknown(
            self.config,
            format!(
                "flight `{id}` was refused, so there is no record to show: {}",
                reasons.join("; ")
            ),
        ))
    }
}

fn of_flight(campaign: &Campaign, id: &str) -> Vec<Maneuver> {
    campaign
        .maneuvers
        .iter()
        .filter(|m| m.flight_id == id)
        .cloned()
        .collect()
}

/// What the configuration says of the signals that it names: surfaces have derivatives, pilot
/// controls have steps that are counted, flags are up or down in a class.
fn groups(config: &Config) -> SignalGroups {
    let surface = |d: &crate::aero::Derivative| match &d.regressor {
        Regressor::Surface(name) | Regressor::Vane(name) => Some(name.clone()),
        _ => None,
    };
    let surfaces = unique(config.buildup.derivatives.iter().filter_map(surface));
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
    let flags = unique(std::iter::once(config.segment.excitation_flag.clone()).chain(in_classes));
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
