//! The conductor: brings the stages of a campaign up to date in order, in parallel within each, and publishes their tables.
//!
//! Per flight: ingest, segment. Per maneuver: estimate; then joint estimates and predictions ([`others`]). Their artefacts
//! lie in the store under fingerprints of all that decides them, so what is up to date is not done again, and a killed run
//! goes on where it was. Trend, compare and report are small and are made anew from the artefacts. Results are collected in
//! the order of flights and maneuvers, whatever thread made them.

mod comparison;
mod conditioning;
pub mod export;
mod others;
mod stretches;
pub mod show;

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::config::Config;
use crate::error::{Problem, Result};
use crate::estimate::joint::Joined;
use crate::estimate::prediction::Predicted;
use crate::estimate::{Basis, Estimated};
use crate::flight::{Correction, Record};
use crate::ingest::Signature;
use crate::maneuver::{Maneuver, Unknown};
use crate::output_error::Outcome;
use crate::store::archive::FlightFiles;
use crate::store::{Digest, Fingerprint, Store, archive, atomic, table};
use crate::tables::{
    ChangeRow, ChannelRow, CheckRow, ComparisonRow, CorrelationRow, DisagreementRow, EstimateRow, EventRow, FitRow,
    History, InstrumentRow, OutlierRow, PredictionRow, TrendRow, VerdictRow,
};
use crate::{estimate, report, trend};
use conditioning::{Done, Shares};

/// Versions of the methods: one goes up when its stage's numbers change for the same input.
const INGEST_VERSION: u32 = 3;
const SEGMENT_VERSION: u32 = 3;
const ESTIMATE_VERSION: u32 = 7;
const JOINT_VERSION: u32 = 3;
const PREDICT_VERSION: u32 = 3;

/// The stages in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    Ingest,
    Segment,
    Estimate,
    Trend,
    Compare,
    Report,
}

/// Where the conductor says how far it is.
pub trait Progress: Sync {
    fn begin(&self, stage: &str, items: usize);
    fn advance(&self, item: &str);
    fn end(&self);
}

/// One stretch of a flight after ingest: where its record lies, or why there is none.
#[derive(Clone, Debug)]
pub struct Flight {
    pub flight_id: String,
    fingerprint: String,
    record: PathBuf,
    ingested: Ingested,
}

/// What the store keeps of a stretch besides its record.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Ingested {
    accepted: bool,
    channels: Vec<ChannelRow>,
    checks: Vec<CheckRow>,
    instruments: Vec<InstrumentRow>,
    /// What signals are corrected by when the record is read.
    corrections: Vec<Correction>,
    problems: Vec<Problem>,
    signature: Signature,
}

/// What the store keeps of segment.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Found {
    maneuvers: Vec<Maneuver>,
    unknown: Vec<Unknown>,
    events: Vec<EventRow>,
    problems: Vec<Problem>,
}

/// A maneuver's estimate, and its time history as the report draws it.
type Fitted = (Estimated, Option<History>);

/// The campaign as far as it has been brought.
#[derive(Clone, Debug, Default)]
pub struct Campaign {
    /// The archive's files, as far as they could be read.
    pub sources: Vec<report::SourceFile>,
    pub flights: Vec<Flight>,
    pub channels: Vec<ChannelRow>,
    pub checks: Vec<CheckRow>,
    pub instruments: Vec<InstrumentRow>,
    pub maneuvers: Vec<Maneuver>,
    /// Excitation that fits no class.
    pub unknown: Vec<Unknown>,
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
    /// Time histories, thinned for the report, of the maneuvers that have one.
    pub histories: Vec<History>,
    pub trends: Vec<TrendRow>,
    /// Maneuvers far from their trend.
    pub outliers: Vec<OutlierRow>,
    pub comparison: Vec<ComparisonRow>,
    /// The comparison in words, with the tunnel and with earlier campaigns.
    pub verdicts: Vec<VerdictRow>,
    pub disagreements: Vec<DisagreementRow>,
    /// Against earlier campaigns, where some are named.
    pub changes: Vec<ChangeRow>,
    pub problems: Vec<Problem>,
    /// Rows that an earlier flight has, too: the later flight's id, from when to when, s.
    pub again: Vec<(String, f64, f64)>,
    /// The report, where it was written.
    pub report: Option<PathBuf>,
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

    /// Whether something of what was recorded was rejected. A derivative with too few maneuvers for a trend is among the
    /// problems, but nothing of it was rejected.
    #[must_use]
    pub fn rejected(&self) -> bool {
        self.problems.iter().any(|p| p.stage != "trend")
    }

    #[must_use]
    pub fn converged(&self) -> usize {
        self.fits.iter().filter(|f| f.outcome == Outcome::Converged.name()).count()
    }
}

/// Brings the campaign up to date as far as `until`.
///
/// # Errors
/// What stops the whole run: no archive, a store in use, a disk that says no. What spoils a flight or a maneuver is among
/// the campaign's problems.
pub fn run(config: &Config, until: Stage, progress: &dyn Progress) -> Result<Campaign> {
    let (run, files) = begin(config, progress)?;
    // Read before anything is published: it may lie in the same folder.
    let earlier = comparison::earlier(config)?;
    let mut campaign = Campaign::default();
    run.ingest(&files, &mut campaign)?;
    if until >= Stage::Segment {
        run.segment(&mut campaign)?;
    }
    if until >= Stage::Estimate {
        run.estimate(&mut campaign)?;
    }
    if until >= Stage::Trend {
        run.trend(&mut campaign)?;
    }
    if until >= Stage::Compare {
        run.compare(&mut campaign, &earlier)?;
    }
    if until >= Stage::Report {
        run.report(&mut campaign)?;
    }
    table::publish(&config.reports, &campaign.problems)?;
    Ok(campaign)
}

/// Opens the store; while the run lives no other can.
fn begin<'a>(config: &'a Config, progress: &'a dyn Progress) -> Result<(Run<'a>, Vec<FlightFiles>)> {
    let files = archive::find(&config.archive)?;
    let store = Store::open(&config.store)?;
    atomic::sweep(&config.reports)?;
    let shares = Shares::of(config.ingest.memory_mb, config.channels.len(), rayon::current_num_threads());
    Ok((Run { config, store, progress, shares }, files))
}

struct Run<'a> {
    config: &'a Config,
    store: Store,
    progress: &'a dyn Progress,
    shares: Shares,
}

/// The fingerprint of a flight, and those of its files, or why there are none.
struct Prints {
    fingerprint: String,
    content: std::result::Result<Vec<Digest>, String>,
}

impl Run<'_> {
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
        let prints: Vec<Prints> = files.par_iter().map(|f| self.prints(f)).collect();
        let items: Vec<(&FlightFiles, &Prints)> = files.iter().zip(&prints).collect();
        for (files, prints) in &items {
            let digests = prints.content.iter().flatten().cloned();
            campaign.sources.extend(files.files.iter().zip(digests).map(|(path, digest)| source_file(path, digest)));
        }
        let copy = |prints: &Prints| items.iter().find(|(_, p)| p.content.is_ok() && p.content == prints.content);
        let work = |(files, prints): &(&FlightFiles, &Prints)| {
            let id = &files.flight_id;
            let first = copy(prints).map(|(f, _)| &f.flight_id).filter(|first| *first != id);
            match (&prints.content, first) {
                (Err(reason), _) => Ok(self.refused(id, &prints.fingerprint, problem("ingest", id, id, reason))),
                (Ok(_), Some(first)) => {
                    let reason = format!("its files are those of flight `{first}` under another name; it is left out");
                    Ok(self.refused(id, &prints.fingerprint, problem("ingest", id, id, &reason)))
                }
                (Ok(_), None) => self.ingest_flight(files, &prints.fingerprint),
            }
        };
        let done = self.each_flight(&items, |(f, _)| &f.flight_id, work)?;
        let artefacts: Vec<PathBuf> = done.iter().map(|d| d.artefact.clone()).collect();
        for flight in done {
            campaign.problems.extend(flight.problems);
            campaign.flights.extend(flight.stretches);
        }
        stretches::same_rows(campaign);
        for flight in &campaign.flights {
            campaign.channels.extend_from_slice(&flight.ingested.channels);
            campaign.checks.extend_from_slice(&flight.ingested.checks);
            campaign.instruments.extend_from_slice(&flight.ingested.instruments);
            campaign.problems.extend_from_slice(&flight.ingested.problems);
        }
        let records: Vec<PathBuf> = campaign.flights.iter().map(|f| f.record.clone()).collect();
        self.store.keep_only("records", &records)?;
        self.store.keep_only("ingest", &artefacts)?;
        table::publish(&self.config.reports, &campaign.channels)?;
        table::publish(&self.config.reports, &campaign.checks)?;
        table::publish(&self.config.reports, &campaign.instruments)
    }

    /// What decides a flight's record, and what its files hold alone.
    fn prints(&self, files: &FlightFiles) -> Prints {
        let config = self.config;
        let content = files.files.iter().map(|path| Digest::of_file(path)).collect::<Result<Vec<Digest>>>();
        let content = content.map_err(|error| error.to_string());
        let fingerprint = Fingerprint::of("ingest", INGEST_VERSION)
            .with(&files.flight_id)
            .with(&config.channels)
            .with(&config.constants)
            .with(&config.aircraft)
            .with(&config.ingest)
            .with(&content);
        Prints { fingerprint: fingerprint.finish(), content }
    }

    /// A flight that has no record.
    fn refused(&self, id: &str, fingerprint: &str, problem: Problem) -> Done {
        let flight = Flight {
            flight_id: id.to_owned(),
            fingerprint: fingerprint.to_owned(),
            record: self.record_path(id, fingerprint),
            ingested: Ingested::refused(problem),
        };
        let artefact = self.store.path("ingest", id, fingerprint, "json");
        Done { stretches: vec![flight], problems: vec![], artefact }
    }

    fn segment(&self, campaign: &mut Campaign) -> Result<()> {
        let accepted: Vec<&Flight> = campaign.flights.iter().filter(|f| f.ingested.accepted).collect();
        let found = self.each("segment", &accepted, |f| &f.flight_id, |f| self.segment_flight(f))?;
        let (paths, found): (Vec<PathBuf>, Vec<Found>) = found.into_iter().unzip();
        self.store.keep_only("segment", &paths)?;
        for flight in found {
            campaign.maneuvers.extend(flight.maneuvers);
            campaign.unknown.extend(flight.unknown);
            campaign.events.extend(flight.events);
            campaign.problems.extend(flight.problems);
        }
        stretches::leave_out_same(campaign);
        let unflown = |flight_id: &str| !campaign.flights.iter().any(|f| f.is_of(flight_id));
        for event in self.config.events.iter().filter(|e| unflown(&e.flight_id)) {
            let place = format!("event {} at {:.1} s", event.class, event.start_s);
            let reason = "the archive has no such flight; the analyst's list names it";
            campaign.problems.push(problem("segment", &event.flight_id, &place, reason));
        }
        table::publish(&self.config.reports, &campaign.maneuvers)?;
        table::publish(&self.config.reports, &campaign.unknown)?;
        table::publish(&self.config.reports, &campaign.events)
    }

    fn segment_flight(&self, flight: &Flight) -> Result<(PathBuf, Found)> {
        let config = self.config;
        let record = flight.open()?;
        let events = flight.events(&config.events, &record.about);
        let rules: Vec<_> = config.classes.iter().map(|c| (&c.name, c.axis, &c.recognition)).collect();
        let fingerprint = Fingerprint::of("segment", SEGMENT_VERSION)
            .with(&flight.fingerprint)
            .with(&rules)
            .with(&config.segment)
            .with(&events)
            .finish();
        let path = self.store.path("segment", &flight.flight_id, &fingerprint, "json");
        if let Some(found) = self.store.load(&path) {
            return Ok((path, found));
        }
        let found = stretches::segmented(config, &record, &events)?;
        self.store.save(&path, &found)?;
        Ok((path, found))
    }

    fn estimate(&self, campaign: &mut Campaign) -> Result<()> {
        let of_flight = |f: &Flight| campaign.maneuvers.iter().filter(|m| m.flight_id == f.flight_id).collect();
        let flights: Vec<(&Flight, Vec<&Maneuver>)> = campaign.flights.iter().map(|f| (f, of_flight(f))).collect();
        self.progress.begin("estimate", campaign.maneuvers.len());
        let done: Result<Vec<Vec<_>>> = flights.par_iter().map(|(f, m)| self.estimate_flight(f, m)).collect();
        self.progress.end();
        let (paths, done): (Vec<PathBuf>, Vec<_>) = done?.into_iter().flatten().unzip();
        let (estimated, histories): (Vec<Estimated>, Vec<Option<History>>) = done.into_iter().unzip();
        campaign.histories = histories.into_iter().flatten().collect();
        self.store.keep_only("estimate", &paths)?;
        self.store.keep_only("history", &paths.iter().map(|p| self.store.beside(p, "history")).collect::<Vec<_>>())?;
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
        table::publish(&self.config.reports, &campaign.correlations)?;
        self.publish_estimates(campaign)
    }

    /// Estimates a flight's maneuvers; its record is read only if one of them is not up to date.
    fn estimate_flight(&self, flight: &Flight, maneuvers: &[&Maneuver]) -> Result<Vec<(PathBuf, Fitted)>> {
        let paths: Vec<PathBuf> = maneuvers.iter().map(|m| self.estimate_path(flight, m)).collect();
        let load =
            |path: &PathBuf| Some((self.store.load(path)?, self.store.load(&self.store.beside(path, "history"))?));
        let present: Vec<Option<Fitted>> = paths.iter().map(load).collect();
        let record = if present.iter().all(Option::is_some) { None } else { Some(flight.open()?) };
        let items: Vec<_> = maneuvers.iter().zip(paths).zip(present).collect();
        items
            .into_par_iter()
            .map(|((maneuver, path), present)| {
                let done = match (present, &record) {
                    (Some(done), _) => done,
                    (None, Some(record)) => {
                        let record = record.part(None, maneuver.start_s, maneuver.end_s)?;
                        let mut estimated = self.estimate_maneuver(&record, maneuver);
                        let history = estimated.history.take().map(|h| report::thinned(&h));
                        self.store.save(&self.store.beside(&path, "history"), &history)?;
                        self.store.save(&path, &estimated)?;
                        (estimated, history)
                    }
                    (None, None) => return Err(crate::error::Error::store(&path, &"its flight's record was not read")),
                };
                self.progress.advance(&maneuver.maneuver_id);
                Ok((path, done))
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
        let estimates = comparison::converged(self.config, campaign);
        let found = trend::trends(&estimates, &self.config.trend, |name| self.config.tunnel.alphas_deg(name));
        campaign.trends = found.rows;
        campaign.problems.extend(found.problems);
        campaign.outliers = found.outliers;
        table::publish(&self.config.reports, &campaign.outliers)?;
        table::publish(&self.config.reports, &campaign.trends)
    }

    fn report(&self, campaign: &mut Campaign) -> Result<()> {
        let config = self.config;
        let path = config.reports.join("report.html");
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
            instruments: &campaign.instruments,
            events: &campaign.events,
            problems: &campaign.problems,
            histories: &campaign.histories,
            typical_alpha_deg: config.report.histories_at_alpha_deg,
            provenance: &self.provenance(campaign)?,
            order: &config.derivative_names(),
            classes: &classes,
        };
        let html =
            report::html(&contents, config.template.as_deref()).map_err(|e| crate::error::Error::store(&path, &e))?;
        atomic::place(&path, html.as_bytes())?;
        let printed = config.reports.join("report.pdf");
        match report::pdf::pdf(&html) {
            Ok(bytes) => atomic::place(&printed, &bytes)?,
            Err(why) => {
                // One of another night beside this page would be taken for the same.
                atomic::remove(&printed)?;
                let reason = format!("not made: the template's page is no well-formed XML: {why}");
                campaign.problems.push(problem("report", "", "report.pdf", &reason));
            }
        }
        campaign.report = Some(path);
        Ok(())
    }

    /// Everything that decided the results, enough to do it again.
    fn provenance(&self, campaign: &Campaign) -> Result<report::Provenance> {
        let config = self.config;
        let tunnel = source_file(&config.wind_tunnel, Digest::of_file(&config.wind_tunnel)?);
        let versions = format!(
            "ingest {INGEST_VERSION}, segment {SEGMENT_VERSION}, estimate {ESTIMATE_VERSION}, joint {JOINT_VERSION}, predict \
             {PREDICT_VERSION}"
        );
        Ok(report::Provenance {
            program: format!("harvest {}, methods: {versions}", env!("CARGO_PKG_VERSION")),
            command: format!(
                "harvest run {} --archive '{}' --wind-tunnel '{}'",
                config.name,
                config.archive,
                config.wind_tunnel.display()
            ),
            data: campaign.sources.iter().cloned().chain([tunnel]).collect(),
            configuration: config.files.clone(),
        })
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

fn source_file(path: &Path, digest: Digest) -> report::SourceFile {
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    report::SourceFile { name, bytes: digest.bytes, blake3: digest.blake3 }
}

fn problem(stage: &str, flight_id: &str, place: &str, reason: &str) -> Problem {
    Problem {
        stage: stage.to_owned(),
        flight_id: flight_id.to_owned(),
        place: place.to_owned(),
        reason: reason.to_owned(),
    }
}
