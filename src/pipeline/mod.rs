//! The conductor: brings the stages of a campaign up to date in order, in parallel within each, and
//! publishes their tables.
//!
//! Per flight: ingest, segment. Per maneuver: estimate; then joint estimates and predictions
//! ([`others`]). Their artefacts lie in the store under fingerprints of all that decides them, so
//! what is up to date is not done again, and a killed run goes on where it was. Trend, compare and
//! report are small and are made anew from the artefacts. Results are collected in the order of
//! flights and maneuvers, whatever thread made them, and published together as a night ([`crate::night`]).

mod comparison;
pub(crate) mod conditioning;
pub mod export;
pub(crate) mod inputs;
mod others;
pub mod show;
pub(crate) mod stretches;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::compare::against::Earlier;
use crate::config::Config;
use crate::error::{Error, Problem, ProblemStage, Result};
use crate::estimate::joint::Joined;
use crate::estimate::prediction::Predicted;
use crate::estimate::{Context, Estimated};
use crate::flight::{Correction, Record};
use crate::ingest::Signature;
use crate::lineage::{Changes, Lineage, Stage};
use crate::maneuver::{Event, Maneuver, Unknown};
use crate::output_error::Outcome;
use crate::store::archive::FlightFiles;
use crate::store::table::Shelf;
use crate::store::{Contents, Digest, Fingerprint, Store, archive, atomic, table};
use crate::tables::{
    ChangeRow, ChannelRow, CheckRow, ComparisonRow, CorrelationRow, DisagreementRow, EstimateRow,
    EventRow, FitRow, History, InstrumentRow, OutlierRow, PredictionRow, TrendRow, VerdictRow,
};
use crate::{estimate, report, trend};
use conditioning::Shares;

/// Versions of the methods: one goes up when its stage's numbers change for the same input.
const INGEST_VERSION: u32 = 7;
const SEGMENT_VERSION: u32 = 7;
const ESTIMATE_VERSION: u32 = 10;
const JOINT_VERSION: u32 = 6;
const PREDICT_VERSION: u32 = 4;
const TREND_VERSION: u32 = 2;
const COMPARE_VERSION: u32 = 1;

/// The report's names among the published files: on screen and on paper.
pub(crate) const REPORT: &str = "report.html";
const PRINTED: &str = "report.pdf";

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
    pub(crate) fingerprint: String,
    pub(crate) record: PathBuf,
    pub(crate) ingested: Ingested,
}

/// What the store keeps of a stretch besides its record.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Ingested {
    pub(crate) accepted: bool,
    /// What the record's file holds, where there is one.
    pub(crate) record: Option<Digest>,
    pub(crate) channels: Vec<ChannelRow>,
    pub(crate) checks: Vec<CheckRow>,
    pub(crate) instruments: Vec<InstrumentRow>,
    /// What signals are corrected by when the record is read.
    pub(crate) corrections: Vec<Correction>,
    pub(crate) problems: Vec<Problem>,
    pub(crate) signature: Signature,
}

/// What the store keeps of segment.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Found {
    pub(crate) maneuvers: Vec<Maneuver>,
    pub(crate) unknown: Vec<Unknown>,
    pub(crate) events: Vec<EventRow>,
    pub(crate) problems: Vec<Problem>,
}

/// The campaign as far as it has been brought.
#[derive(Clone, Debug, Default)]
pub struct Campaign {
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
    /// Maneuvers estimated together: published with the others' rows, but in no trend, which would
    /// count the same data twice.
    pub joined: Vec<Joined>,
    /// How well others predict each maneuver, in the order of the maneuvers; empty where it is not
    /// asked for.
    pub predicted: Vec<Predicted>,
    pub correlations: Vec<CorrelationRow>,
    /// Where the time history of each maneuver lies, thinned for the report, in the order of the
    /// maneuvers.
    histories: Vec<PathBuf>,
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
    /// Flights that are to be read again the next time, and why they could not be read now.
    pub unread: BTreeMap<String, String>,
    /// Since the last complete night; nothing before the report.
    pub overnight: Changes,
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
        self.predicted
            .iter()
            .flat_map(|p| &p.outputs)
            .cloned()
            .collect()
    }

    #[must_use]
    pub fn converged(&self) -> usize {
        self.fits
            .iter()
            .filter(|f| f.outcome == Outcome::Converged)
            .count()
    }
}

/// Opens the store; while the run lives no other can. What files hold is looked at before anything
/// is done with them.
pub(crate) fn begin<'a>(
    config: &'a Config,
    wait: Duration,
    progress: &'a dyn Progress,
) -> Result<(Run<'a>, Vec<FlightFiles>)> {
    let files = archive::find(&config.archive)?;
    let store = Store::open(&config.store, wait)?.sharing(config.shared_store.as_deref())?;
    let run = Run::of_store(config, store, &files, progress)?;
    run.store.remember(&run.contents)?;
    Ok((run, files))
}

pub(crate) struct Run<'a> {
    pub(crate) config: &'a Config,
    pub(crate) store: Store,
    pub(crate) progress: &'a dyn Progress,
    pub(crate) shares: Shares,
    pub(crate) contents: Contents,
    pub(crate) inputs: inputs::Inputs,
    /// The tables of earlier campaigns to compare with.
    pub(crate) earlier: Vec<Earlier>,
    pub(crate) lineage: Lineage,
    /// Where each stage's tables go; nowhere unless a night is to be published.
    pub(crate) shelves: BTreeMap<Stage, Shelf>,
    /// Tonight's folder, where there is one.
    pub(crate) tonight: Option<PathBuf>,
}

impl Run<'_> {
    /// Where the tables of a stage go.
    pub(crate) fn shelf(&self, stage: Stage) -> Shelf {
        self.shelves.get(&stage).cloned().unwrap_or_default()
    }

    pub(crate) fn place_tonight(&self, name: &str, bytes: &[u8]) -> Result<()> {
        self.tonight
            .as_ref()
            .map_or(Ok(()), |folder| atomic::place(&folder.join(name), bytes))
    }

    /// The stages before the report, as far as `until`.
    pub(crate) fn results(&self, files: &[FlightFiles], until: Stage) -> Result<Campaign> {
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
            self.compare(&mut campaign)?;
        }
        Ok(campaign)
    }

    /// Does `work` on every item in parallel with a progress bar; results in the order of the
    /// items.
    pub(crate) fn each<T: Sync, R: Send>(
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

    pub(crate) fn ingest(&self, files: &[FlightFiles], campaign: &mut Campaign) -> Result<()> {
        campaign.problems.extend_from_slice(&self.inputs.problems);
        let done = self.each_flight(files, |f| &f.flight_id, |f| self.ingest_flight(f))?;
        for (files, done) in files.iter().zip(done) {
            match done.artefact {
                Some(artefact) => self.store.need([&artefact]),
                None => {
                    _ = campaign
                        .unread
                        .insert(files.flight_id.clone(), done.reasons())
                }
            }
            campaign.problems.extend(done.problems);
            campaign.flights.extend(done.stretches);
        }
        let recorded = campaign.flights.iter().filter(|f| f.ingested.accepted);
        self.store.need(recorded.map(|f| &f.record));
        stretches::same_rows(campaign);
        for flight in &campaign.flights {
            campaign
                .channels
                .extend_from_slice(&flight.ingested.channels);
            campaign.checks.extend_from_slice(&flight.ingested.checks);
            campaign
                .instruments
                .extend_from_slice(&flight.ingested.instruments);
            campaign
                .problems
                .extend_from_slice(&flight.ingested.problems);
        }
        let shelf = self.shelf(Stage::Ingest);
        table::publish(&shelf, &campaign.channels)?;
        table::publish(&shelf, &campaign.checks)?;
        table::publish(&shelf, &campaign.instruments)
    }

    pub(crate) fn segment(&self, campaign: &mut Campaign) -> Result<()> {
        let accepted: Vec<&Flight> = campaign
            .flights
            .iter()
            .filter(|f| f.ingested.accepted)
            .collect();
        let found = self.each(
            "segment",
            &accepted,
            |f| &f.flight_id,
            |f| self.segment_flight(f),
        )?;
        let (paths, found): (Vec<PathBuf>, Vec<Found>) = found.into_iter().unzip();
        self.store.need(&paths);
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
            campaign.problems.push(problem(
                ProblemStage::Segment,
                &event.flight_id,
                &place,
                reason,
            ));
        }
        let shelf = self.shelf(Stage::Segment);
        table::publish(&shelf, &campaign.maneuvers)?;
        table::publish(&shelf, &campaign.unknown)?;
        table::publish(&shelf, &campaign.events)
    }

    pub(crate) fn segment_path(&self, flight: &Flight, events: &[Event]) -> PathBuf {
        let config = self.config;
        let rules: Vec<_> = config
            .classes
            .iter()
            .map(|c| (&c.name, c.axis, &c.recognition))
            .collect();
        let fingerprint = Fingerprint::of("segment", SEGMENT_VERSION)
            .with(&flight.fingerprint)
            .with(&rules)
            .with(&config.segment)
            .with(&events)
            .finish();
        self.store
            .path("segment", &flight.flight_id, &fingerprint, "json")
    }

    /// The analyst's events in a flight, and where what is found in it lies. Only for events its
    /// record is looked at.
    pub(crate) fn to_segment(&self, flight: &Flight) -> Result<(Vec<Event>, PathBuf)> {
        let events = match self.config.events.as_slice() {
            [] => Vec::new(),
            events => flight.events(events, &flight.open(&self.store)?.about),
        };
        let path = self.segment_path(flight, &events);
        Ok((events, path))
    }

    /// What was found in a flight and where that lies, if it is up to date.
    pub(crate) fn segmented(&self, flight: &Flight) -> Option<(PathBuf, Found)> {
        let (_, path) = self.to_segment(flight).ok()?;
        Some((path.clone(), self.store.load(&path)?))
    }

    pub(crate) fn segment_flight(&self, flight: &Flight) -> Result<(PathBuf, Found)> {
        let (events, path) = self.to_segment(flight)?;
        if let Some(found) = self.store.load(&path) {
            return Ok((path, found));
        }
        let found = stretches::segmented(self.config, &flight.open(&self.store)?, &events)?;
        self.store.save(&path, &found)?;
        Ok((path, found))
    }

    pub(crate) fn estimate(&self, campaign: &mut Campaign) -> Result<()> {
        let of_flight = |f: &Flight| {
            campaign
                .maneuvers
                .iter()
                .filter(|m| m.flight_id == f.flight_id)
                .collect()
        };
        let flights: Vec<(&Flight, Vec<&Maneuver>)> =
            campaign.flights.iter().map(|f| (f, of_flight(f))).collect();
        self.progress.begin("estimate", campaign.maneuvers.len());
        let done: Result<Vec<Vec<_>>> = flights
            .par_iter()
            .map(|(f, m)| self.estimate_flight(f, m))
            .collect();
        self.progress.end();
        let (paths, estimated): (Vec<PathBuf>, Vec<Estimated>) =
            done?.into_iter().flatten().unzip();
        campaign.histories = paths
            .iter()
            .map(|p| self.store.beside(p, "history"))
            .collect();
        self.store.need(&paths);
        self.store.need(&campaign.histories);
        self.join(campaign, &paths)?;
        self.predict(campaign, &paths, &estimated)?;
        for (maneuver, estimated) in campaign.maneuvers.iter().zip(estimated) {
            let fit = estimated.fit;
            if fit.outcome != Outcome::Converged {
                let reason = format!("{}: {}", fit.outcome, fit.reason);
                campaign.problems.push(problem(
                    ProblemStage::Estimate,
                    &maneuver.flight_id,
                    &maneuver.maneuver_id,
                    &reason,
                ));
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
    pub(crate) fn estimate_flight(
        &self,
        flight: &Flight,
        maneuvers: &[&Maneuver],
    ) -> Result<Vec<(PathBuf, Estimated)>> {
        let paths: Vec<PathBuf> = maneuvers
            .iter()
            .map(|m| self.estimate_path(flight, m))
            .collect();
        let load = |path: &PathBuf| {
            self.store
                .load(path)
                .filter(|_| self.store.holds(&self.store.beside(path, "history")))
        };
        let present: Vec<Option<Estimated>> = paths.iter().map(load).collect();
        let record = if present.iter().all(Option::is_some) {
            None
        } else {
            Some(flight.open(&self.store)?)
        };
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
                        self.store
                            .save(&self.store.beside(&path, "history"), &history)?;
                        self.store.save(&path, &estimated)?;
                        estimated
                    }
                    (None, None) => {
                        return Err(Error::store(&path, &"its flight's record was not read"));
                    }
                };
                self.progress.advance(&maneuver.maneuver_id);
                Ok((path, done))
            })
            .collect()
    }

    pub(crate) fn estimate_path(&self, flight: &Flight, maneuver: &Maneuver) -> PathBuf {
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
        self.store
            .path("estimate", &maneuver.maneuver_id, &fingerprint, "json")
    }

    pub(crate) fn estimate_maneuver(&self, record: &Record, maneuver: &Maneuver) -> Estimated {
        match self.config.class(&maneuver.class) {
            Some(class) => estimate::maneuver(record, maneuver, class, &self.context()),
            None => Estimated::unknown_class(maneuver),
        }
    }

    pub(crate) fn context(&self) -> Context<'_> {
        let config = self.config;
        Context::new(
            &config.aircraft,
            &config.buildup,
            &config.tunnel,
            &config.estimate,
        )
    }

    pub(crate) fn trend(&self, campaign: &mut Campaign) -> Result<()> {
        let estimates = comparison::converged(self.config, campaign);
        let found = trend::trends(&estimates, &self.config.trend, |name| {
            self.config.tunnel.alphas_deg(name)
        });
        campaign.trends = found.rows;
        campaign.problems.extend(found.problems);
        campaign.outliers = found.outliers;
        table::publish(&self.shelf(Stage::Trend), &campaign.outliers)?;
        table::publish(&self.shelf(Stage::Trend), &campaign.trends)
    }

    pub(crate) fn report(&self, campaign: &mut Campaign) -> Result<()> {
        let config = self.config;
        let at = config.report.histories_at_alpha_deg;
        let (maneuvers, fits, most) = (
            &campaign.maneuvers,
            &campaign.fits,
            config.report.maneuver_pages,
        );
        let pages = report::maneuvers_with_page(maneuvers, fits, &campaign.overnight, at, most);
        let with_page = maneuvers
            .iter()
            .zip(&campaign.histories)
            .filter(|(m, _)| pages.contains(&m.maneuver_id));
        let histories: Vec<History> = with_page
            .filter_map(|(_, path)| self.store.load::<Option<History>>(path)?)
            .collect();
        let classes: Vec<_> = config
            .classes
            .iter()
            .map(|c| (c.name.clone(), c.title.clone(), c.axis))
            .collect();
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
            pages: &pages,
            histories: &histories,
            typical_alpha_deg: at,
            provenance: &self.provenance(),
            order: &config.derivative_names(),
            classes: &classes,
            overnight: &campaign.overnight,
        };
        let named = |e| Error::store(&config.reports.join(REPORT), &e);
        let html = report::html(&contents, config.template.as_deref()).map_err(named)?;
        self.place_tonight(REPORT, html.as_bytes())?;
        match crate::pdf::pdf(&html) {
            Ok(bytes) => self.place_tonight(PRINTED, &bytes)?,
            Err(why) => {
                let reason = format!("not made: the template's page is no well-formed XML: {why}");
                campaign
                    .problems
                    .push(problem(ProblemStage::Report, "", PRINTED, &reason));
            }
        }
        Ok(())
    }

    /// Everything that decided the results, enough to do it again.
    pub(crate) fn provenance(&self) -> report::Provenance {
        let config = self.config;
        let versions = format!(
            "ingest {INGEST_VERSION}, segment {SEGMENT_VERSION}, estimate {ESTIMATE_VERSION}, joint {JOINT_VERSION}, predict \
             {PREDICT_VERSION}"
        );
        report::Provenance {
            program: format!(
                "harvest {} (sources {}), methods: {versions}",
                env!("CARGO_PKG_VERSION"),
                env!("HARVEST_SOURCE")
            ),
            command: format!(
                "harvest run {} --archive '{}' --wind-tunnel '{}'",
                config.name,
                config.archive,
                config.wind_tunnel.display()
            ),
            data: self.inputs.sources.clone(),
            configuration: config.files.clone(),
        }
    }
}

/// The tunnel table's name, with the sources of its values where it states them: a review must see
/// what was judged.
fn tunnel_and_sources(config: &Config) -> String {
    let (name, sources) = (config.wind_tunnel.display(), config.tunnel.sources());
    if sources.is_empty() {
        format!("{name} (no sources stated)")
    } else {
        format!("{name} (sources: {})", sources.join("; "))
    }
}

fn problem(stage: ProblemStage, flight_id: &str, place: &str, reason: &str) -> Problem {
    Problem {
        stage,
        flight_id: flight_id.to_owned(),
        place: place.to_owned(),
        reason: reason.to_owned(),
    }
}
