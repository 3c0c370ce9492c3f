//! The conductor: brings the stages of a campaign up to date in order, in parallel within each, and publishes their tables.
//!
//! Per flight: ingest, segment. Per maneuver: estimate; then joint estimates and predictions ([`others`]). Their artefacts
//! lie in the store under fingerprints of all that decides them, so what is up to date is not done again, and a killed run
//! goes on where it was. Trend, compare and report are small and are made anew from the artefacts. Results are collected in
//! the order of flights and maneuvers, whatever thread made them, and published together as a night ([`night`]).

pub mod diff;
pub mod explain;
pub mod gc;
mod inputs;
pub mod night;
mod others;
pub mod show;
pub mod status;
pub mod verify;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::changes::Changes;
use crate::config::Config;
use crate::error::{Error, Problem, Result};
use crate::estimate::joint::Joined;
use crate::estimate::prediction::Predicted;
use crate::estimate::{Basis, Estimated};
use crate::flight::Record;
use crate::lineage::Lineage;
use crate::maneuver::{Event, Maneuver};
use crate::output_error::Outcome;
use crate::segment::Segmented;
use crate::store::archive::FlightFiles;
use crate::store::contents::digest;
use crate::store::table::Shelf;
use crate::store::{Contents, Fingerprint, Nights, Store, archive, atomic, record_file, table};
use crate::tables::{
    ChannelRow, CheckRow, ComparisonRow, CorrelationRow, EstimateRow, EventRow, FitRow, History, PredictionRow,
    TrendRow,
};
use crate::{compare, estimate, ingest, report, segment, trend};

/// Versions of the methods: one goes up when its stage's numbers change for the same input.
const INGEST_VERSION: u32 = 1;
const SEGMENT_VERSION: u32 = 1;
const ESTIMATE_VERSION: u32 = 5;
const JOINT_VERSION: u32 = 2;
const PREDICT_VERSION: u32 = 2;
/// The report's name among the published files.
const REPORT: &str = "report.html";

const TREND_VERSION: u32 = 1;
const COMPARE_VERSION: u32 = 1;

pub use crate::lineage::Stage;

/// Where the conductor says how far it is.
pub trait Progress: Sync {
    fn begin(&self, stage: &str, items: usize);
    fn advance(&self, item: &str);
    fn end(&self);
}

/// One flight after ingest: where its record lies, or why there is none.
#[derive(Clone, Debug)]
pub struct Flight {
    pub flight_id: String,
    fingerprint: String,
    record: PathBuf,
    /// None where nothing is kept of it: what was refused for now may be read the next time.
    artefact: Option<PathBuf>,
    ingested: Ingested,
}

/// What the store keeps of ingest besides the record.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Ingested {
    accepted: bool,
    /// Fingerprint of the record's bytes, where there is one.
    record: Option<String>,
    channels: Vec<ChannelRow>,
    checks: Vec<CheckRow>,
    problems: Vec<Problem>,
}

/// What the store keeps of segment.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Found {
    maneuvers: Vec<Maneuver>,
    events: Vec<EventRow>,
    problems: Vec<Problem>,
}

/// The campaign as far as it has been brought.
#[derive(Clone, Debug, Default)]
pub struct Campaign {
    pub flights: Vec<Flight>,
    pub channels: Vec<ChannelRow>,
    pub checks: Vec<CheckRow>,
    pub maneuvers: Vec<Maneuver>,
    pub events: Vec<EventRow>,
    pub fits: Vec<FitRow>,
    pub estimates: Vec<EstimateRow>,
    /// The sums that the tunnel tabulates, with the variance of the sum.
    pub combined: Vec<EstimateRow>,
    /// Maneuvers estimated together: published with the others' rows, but in no trend, which would count the same data
    /// twice.
    pub joined: Vec<Joined>,
    /// How well others predict each maneuver, in the order of the maneuvers; empty where it is not asked for.
    pub predicted: Vec<Predicted>,
    pub correlations: Vec<CorrelationRow>,
    pub trends: Vec<TrendRow>,
    pub comparison: Vec<ComparisonRow>,
    pub problems: Vec<Problem>,
    /// Since the last complete night; nothing before the report.
    pub changes: Changes,
}

impl Campaign {
    /// Flights that ingest refused.
    #[must_use]
    pub fn refused(&self) -> usize {
        self.flights.iter().filter(|f| !f.ingested.accepted).count()
    }

    /// The estimates and the combined sums.
    fn estimated(&self) -> impl Iterator<Item = &EstimateRow> {
        self.estimates.iter().chain(&self.combined)
    }

    /// The outputs of every predicted maneuver.
    fn predictions(&self) -> Vec<PredictionRow> {
        self.predicted.iter().flat_map(|p| &p.outputs).cloned().collect()
    }

    #[must_use]
    pub fn converged(&self) -> usize {
        self.fits.iter().filter(|f| f.outcome == Outcome::Converged.name()).count()
    }
}

/// Brings the campaign up to date as far as `until` and publishes it as a night; waits up to `wait` for another run to
/// leave store and reports.
///
/// # Errors
/// What stops the whole run: no archive, a store in use, a disk that says no. What spoils a flight or a maneuver is among
/// the problems of the night's summary.
pub fn run(config: &Config, until: Stage, wait: Duration, progress: &dyn Progress) -> Result<night::Done> {
    let (mut run, files) = begin(config, wait, progress)?;
    let nights = Nights::open(&config.reports, wait)?;
    if let Some(done) = run.is_published(&nights, until) {
        return Ok(done);
    }
    run.publish_into(nights.tonight()?);
    let made = run.make(&files, until, &nights).and_then(|campaign| run.publish(&nights, &campaign, until));
    if made.is_err() {
        // What is left of tonight takes up room on a disk that may be full.
        nights.forget_tonight();
    }
    made
}

/// Opens the store; while the run lives no other can. What files hold is looked at before anything is done with them.
fn begin<'a>(config: &'a Config, wait: Duration, progress: &'a dyn Progress) -> Result<(Run<'a>, Vec<FlightFiles>)> {
    let files = archive::find(&config.archive)?;
    let store = Store::open(&config.store, wait)?;
    let contents = Contents::load(&config.store.join("contents.json"));
    let run = Run::new(config, store, contents, &files, progress);
    run.contents.save()?;
    Ok((run, files))
}

struct Run<'a> {
    config: &'a Config,
    store: Store,
    progress: &'a dyn Progress,
    contents: Contents,
    inputs: inputs::Inputs,
    lineage: Lineage,
    /// Where each stage's tables go; nowhere unless a night is to be published.
    shelves: BTreeMap<Stage, Shelf>,
    /// Tonight's folder, where there is one.
    tonight: Option<PathBuf>,
}

impl Run<'_> {
    /// All stages as far as `until`, their tables in tonight's folder.
    fn make(&self, files: &[FlightFiles], until: Stage, nights: &Nights) -> Result<Campaign> {
        let config = self.config;
        let mut campaign = Campaign::default();
        self.ingest(files, &mut campaign)?;
        if until >= Stage::Segment {
            self.segment(&mut campaign)?;
        }
        if until >= Stage::Estimate {
            self.estimate(&mut campaign)?;
        }
        if until >= Stage::Trend {
            self.trend(&mut campaign)?;
        }
        if until >= Stage::Compare {
            let (trends, maneuvers) = (&campaign.trends, &campaign.maneuvers);
            campaign.comparison =
                compare::comparison(trends, maneuvers, &config.tunnel, &config.trend, &config.compare);
            table::publish(&self.shelf(Stage::Compare), &campaign.comparison)?;
        }
        if until >= Stage::Report {
            campaign.changes = self.changes(nights, &campaign)?;
            self.report(&campaign)?;
        }
        table::publish(&self.shelf(until), &campaign.problems)?;
        Ok(campaign)
    }

    /// Does `work` on every item in parallel with a progress bar; results in the order of the items.
    fn each<T: Sync, R: Send>(
        &self,
        stage: &str,
        items: &[T],
        name: impl Fn(&T) -> &str + Sync,
        work: impl Fn(&T) -> Result<R> + Sync,
    ) -> Result<Vec<R>> {
        self.progress.begin(stage, items.len());
        let results = items
            .par_iter()
            .map(|item| {
                let result = work(item);
                self.progress.advance(name(item));
                result
            })
            .collect();
        self.progress.end();
        results
    }

    fn ingest(&self, files: &[FlightFiles], campaign: &mut Campaign) -> Result<()> {
        campaign.flights = self.each("ingest", files, |f| &f.flight_id, |f| self.ingest_flight(f))?;
        campaign.problems.extend_from_slice(&self.inputs.problems);
        for flight in &campaign.flights {
            campaign.channels.extend_from_slice(&flight.ingested.channels);
            campaign.checks.extend_from_slice(&flight.ingested.checks);
            campaign.problems.extend_from_slice(&flight.ingested.problems);
        }
        let accepted = campaign.flights.iter().filter(|f| f.ingested.accepted);
        self.store.need(accepted.map(|f| &f.record));
        self.store.need(campaign.flights.iter().filter_map(|f| f.artefact.as_ref()));
        table::publish(&self.shelf(Stage::Ingest), &campaign.channels)?;
        table::publish(&self.shelf(Stage::Ingest), &campaign.checks)
    }

    /// Where the result of a flight's ingest and its record lie, and the fingerprint that they share.
    fn ingest_paths(&self, id: &str, content: &str) -> (String, PathBuf, PathBuf) {
        let config = self.config;
        let fingerprint = Fingerprint::of("ingest", INGEST_VERSION)
            .with(&id)
            .with(&content)
            .with(&config.channels)
            .with(&config.constants)
            .with(&config.aircraft)
            .with(&config.ingest)
            .finish();
        let path = self.store.path("ingest", id, &fingerprint, "json");
        let record = self.store.path("records", id, &fingerprint, "parquet");
        (fingerprint, path, record)
    }

    /// The flight as the store has it: none unless it is up to date and whole.
    fn ingested(&self, id: &str, content: &str) -> Option<Flight> {
        let (fingerprint, path, record) = self.ingest_paths(id, content);
        let ingested: Ingested = self.store.load(&path)?;
        // A record with other bytes than were written is made again.
        let is_whole = match &ingested.record {
            Some(digest) => self.contents.of(&record).is_ok_and(|found| found == *digest),
            None => !ingested.accepted,
        };
        is_whole.then(|| Flight { flight_id: id.to_owned(), fingerprint, record, artefact: Some(path), ingested })
    }

    fn ingest_flight(&self, files: &FlightFiles) -> Result<Flight> {
        let config = self.config;
        let id = &files.flight_id;
        let content = match self.inputs.content(id) {
            Ok(content) => content,
            Err(reason) => return Ok(self.refused(id, problem("ingest", id, &inputs::place(files), reason))),
        };
        if let Some(flight) = self.ingested(id, content) {
            return Ok(flight);
        }
        let (fingerprint, path, record) = self.ingest_paths(id, content);
        let done = archive::read(files, &config.channels).and_then(|raw| {
            ingest::record(&raw, &config.channels, &config.constants, &config.aircraft, &config.ingest)
        });
        // What was read must be what the fingerprint is of.
        if let Some(changed) = files.files.iter().find(|file| !self.contents.is_unchanged(file)) {
            let reason = "changed or vanished while it was read: is it still being copied? The next run will read it";
            return Ok(self.refused(id, problem("ingest", id, &changed.display().to_string(), reason)));
        }
        let flight = match done {
            Ok(done) => {
                let mut bytes = Vec::new();
                record_file::write(&done.record, &mut bytes).map_err(|e| Error::store(&record, &e))?;
                atomic::place(&record, &bytes)?;
                self.store.note(&record);
                let digest = digest(&mut bytes.as_slice()).map_err(Error::io(&record, "cannot read it"))?;
                let (channels, checks, problems) = (done.channels, done.checks, done.problems);
                let ingested = Ingested { accepted: true, record: Some(digest), channels, checks, problems };
                Flight { flight_id: id.clone(), fingerprint, record, artefact: Some(path.clone()), ingested }
            }
            Err(problem) => Flight { artefact: Some(path.clone()), fingerprint, ..self.refused(id, problem) },
        };
        self.store.save(&path, &flight.ingested)?;
        Ok(flight)
    }

    /// A flight without a record, for a reason that is not kept.
    fn refused(&self, id: &str, problem: Problem) -> Flight {
        Flight {
            flight_id: id.to_owned(),
            fingerprint: String::new(),
            record: self.store.folder().join("records").join("none"),
            artefact: None,
            ingested: Ingested {
                accepted: false,
                record: None,
                channels: vec![],
                checks: vec![],
                problems: vec![problem],
            },
        }
    }

    fn segment(&self, campaign: &mut Campaign) -> Result<()> {
        let accepted: Vec<&Flight> = campaign.flights.iter().filter(|f| f.ingested.accepted).collect();
        let found = self.each("segment", &accepted, |f| &f.flight_id, |f| self.segment_flight(f))?;
        let (paths, found): (Vec<PathBuf>, Vec<Found>) = found.into_iter().unzip();
        self.store.need(&paths);
        for flight in found {
            campaign.maneuvers.extend(flight.maneuvers);
            campaign.events.extend(flight.events);
            campaign.problems.extend(flight.problems);
        }
        let unflown = |flight_id: &str| !campaign.flights.iter().any(|f| f.flight_id == flight_id);
        for event in self.config.events.iter().filter(|e| unflown(&e.flight_id)) {
            let place = format!("event {} at {:.1} s", event.class, event.start_s);
            let reason = "the archive has no such flight; the analyst's list names it";
            campaign.problems.push(problem("segment", &event.flight_id, &place, reason));
        }
        table::publish(&self.shelf(Stage::Segment), &campaign.maneuvers)?;
        table::publish(&self.shelf(Stage::Segment), &campaign.events)
    }

    fn events_of(&self, flight_id: &str) -> Vec<Event> {
        self.config.events.iter().filter(|e| e.flight_id == flight_id).cloned().collect()
    }

    fn segment_path(&self, flight: &Flight) -> PathBuf {
        let config = self.config;
        let rules: Vec<_> = config.classes.iter().map(|c| (&c.name, c.axis, &c.recognition)).collect();
        let fingerprint = Fingerprint::of("segment", SEGMENT_VERSION)
            .with(&flight.fingerprint)
            .with(&rules)
            .with(&config.segment)
            .with(&self.events_of(&flight.flight_id))
            .finish();
        self.store.path("segment", &flight.flight_id, &fingerprint, "json")
    }

    fn segment_flight(&self, flight: &Flight) -> Result<(PathBuf, Found)> {
        let (config, path, events) = (self.config, self.segment_path(flight), self.events_of(&flight.flight_id));
        if let Some(found) = self.store.load(&path) {
            return Ok((path, found));
        }
        let record = record_file::read(&flight.record)?;
        let found = segment::maneuvers(&record, &config.classes, &config.aircraft, &config.segment);
        let (Segmented { maneuvers, problems }, events) = if events.is_empty() {
            (found, Vec::new())
        } else {
            segment::with_events(found, &record, &events, &config.classes, &config.aircraft)
        };
        let found = Found { maneuvers, events, problems };
        self.store.save(&path, &found)?;
        Ok((path, found))
    }

    fn estimate(&self, campaign: &mut Campaign) -> Result<()> {
        let of_flight = |f: &Flight| campaign.maneuvers.iter().filter(|m| m.flight_id == f.flight_id).collect();
        let flights: Vec<(&Flight, Vec<&Maneuver>)> = campaign.flights.iter().map(|f| (f, of_flight(f))).collect();
        self.progress.begin("estimate", campaign.maneuvers.len());
        let done: Result<Vec<Vec<_>>> = flights.par_iter().map(|(f, m)| self.estimate_flight(f, m)).collect();
        self.progress.end();
        let (paths, estimated): (Vec<PathBuf>, Vec<Estimated>) = done?.into_iter().flatten().unzip();
        self.store.need(&paths);
        self.join(campaign, &paths)?;
        self.predict(campaign, &paths, &estimated)?;
        for (maneuver, estimated) in campaign.maneuvers.iter().zip(estimated) {
            let fit = estimated.fit;
            if fit.outcome != Outcome::Converged.name() {
                let reason = format!("{}: {}", fit.outcome, fit.reason);
                campaign.problems.push(problem("estimate", &maneuver.flight_id, &maneuver.maneuver_id, &reason));
            }
            campaign.fits.push(fit);
            campaign.estimates.extend(estimated.estimates);
            campaign.combined.extend(estimated.combined);
            campaign.correlations.extend(estimated.correlations);
        }
        table::publish(&self.shelf(Stage::Estimate), &campaign.correlations)?;
        self.publish_estimates(campaign)
    }

    /// Estimates a flight's maneuvers; its record is read only if one of them is not up to date.
    fn estimate_flight(&self, flight: &Flight, maneuvers: &[&Maneuver]) -> Result<Vec<(PathBuf, Estimated)>> {
        let paths: Vec<PathBuf> = maneuvers.iter().map(|m| self.estimate_path(flight, m)).collect();
        let present: Vec<Option<Estimated>> = paths.iter().map(|path| self.store.load(path)).collect();
        let record = if present.iter().all(Option::is_some) { None } else { Some(record_file::read(&flight.record)?) };
        let items: Vec<_> = maneuvers.iter().zip(paths).zip(present).collect();
        items
            .into_par_iter()
            .map(|((maneuver, path), present)| {
                let estimated = match (present, &record) {
                    (Some(estimated), _) => estimated,
                    (None, Some(record)) => {
                        let estimated = Estimated { history: None, ..self.estimate_maneuver(record, maneuver) };
                        self.store.save(&path, &estimated)?;
                        estimated
                    }
                    (None, None) => return Err(Error::store(&path, &"its flight's record was not read")),
                };
                self.progress.advance(&maneuver.maneuver_id);
                Ok((path, estimated))
            })
            .collect()
    }

    fn estimate_path(&self, flight: &Flight, maneuver: &Maneuver) -> PathBuf {
        let config = self.config;
        let fingerprint = Fingerprint::of("estimate", ESTIMATE_VERSION)
            .with(&flight.fingerprint)
            .with(maneuver)
            .with(&config.class(&maneuver.class))
            .with(&config.aircraft)
            .with(&config.buildup)
            .with(&config.tunnel)
            .with(&config.estimate)
            .finish();
        self.store.path("estimate", &maneuver.maneuver_id, &fingerprint, "json")
    }

    fn estimate_maneuver(&self, record: &Record, maneuver: &Maneuver) -> Estimated {
        match self.config.class(&maneuver.class) {
            Some(class) => estimate::maneuver(record, maneuver, class, &self.basis()),
            None => Estimated::unknown_class(maneuver),
        }
    }

    fn basis(&self) -> Basis<'_> {
        let config = self.config;
        Basis::new(&config.aircraft, &config.buildup, &config.tunnel, &config.estimate)
    }

    fn trend(&self, campaign: &mut Campaign) -> Result<()> {
        let converged: std::collections::BTreeSet<&str> = campaign
            .fits
            .iter()
            .filter(|f| f.outcome == Outcome::Converged.name())
            .map(|f| f.maneuver_id.as_str())
            .collect();
        let names = self.config.derivative_names();
        let counts = |row: &&EstimateRow| converged.contains(&*row.maneuver_id) && names.contains(&row.derivative);
        let estimates: Vec<EstimateRow> = campaign.estimated().filter(counts).cloned().collect();
        let (trends, problems) = trend::trends(&estimates, &self.config.trend);
        campaign.trends = trends;
        campaign.problems.extend(problems);
        table::publish(&self.shelf(Stage::Trend), &campaign.trends)
    }

    fn report(&self, campaign: &Campaign) -> Result<()> {
        let config = self.config;
        let histories = self.histories(campaign)?;
        let classes: Vec<_> = config.classes.iter().map(|c| (c.name.clone(), c.title.clone(), c.axis)).collect();
        let estimates: Vec<EstimateRow> = campaign.estimated().cloned().collect();
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
            trends: &campaign.trends,
            comparison: &campaign.comparison,
            channels: &campaign.channels,
            checks: &campaign.checks,
            events: &campaign.events,
            problems: &campaign.problems,
            histories: &histories,
            order: &config.derivative_names(),
            classes: &classes,
            changes: &campaign.changes,
            lineage: &self.lineage,
        };
        let named = |e| Error::store(&config.reports.join(REPORT), &e);
        let html = report::html(&contents, config.template.as_deref()).map_err(named)?;
        self.place_tonight(REPORT, html.as_bytes())
    }

    /// Time histories of one maneuver per class: the converged one nearest to the configured angle of attack. They are
    /// computed again rather than stored: an estimation takes milliseconds, its histories a quarter of a megabyte.
    fn histories(&self, campaign: &Campaign) -> Result<Vec<History>> {
        let at = self.config.report.histories_at_alpha_deg;
        let shown: Vec<&Maneuver> = self
            .config
            .classes
            .iter()
            .filter_map(|class| {
                let fits = campaign.maneuvers.iter().zip(&campaign.fits);
                fits.filter(|(m, f)| m.class == class.name && f.outcome == Outcome::Converged.name())
                    .map(|(m, _)| m)
                    .min_by(|a, b| (a.alpha_deg - at).abs().total_cmp(&(b.alpha_deg - at).abs()))
            })
            .collect();
        let histories = self.each(
            "report",
            &shown,
            |m| &m.maneuver_id,
            |maneuver| {
                let flight = campaign.flights.iter().find(|f| f.flight_id == maneuver.flight_id);
                let record = flight.map(|f| record_file::read(&f.record)).transpose()?;
                Ok(record.and_then(|record| self.estimate_maneuver(&record, maneuver).history))
            },
        )?;
        Ok(histories.into_iter().flatten().collect())
    }
}

/// The tunnel table's name, with the sources of its values where it states them: a review must see what was judged.
fn tunnel_and_sources(config: &Config) -> String {
    let (name, sources) = (config.wind_tunnel.display(), config.tunnel.sources());
    if sources.is_empty() {
        format!("{name} (no sources stated)")
    } else {
        format!("{name} (sources: {})", sources.join("; "))
    }
}

fn problem(stage: &str, flight_id: &str, place: &str, reason: &str) -> Problem {
    Problem {
        stage: stage.to_owned(),
        flight_id: flight_id.to_owned(),
        place: place.to_owned(),
        reason: reason.to_owned(),
    }
}
