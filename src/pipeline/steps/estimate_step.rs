//! Estimate of the campaign: one artefact a maneuver, with the history of its fit beside it.

use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;
use serde::Serialize;

use super::step::{Companion, ComputedArtefact, LoadedOrMade, Step};
use super::step_runner::StepRunner;
use crate::aero::Axis;
use crate::config::Config;
use crate::error::{ProblemStage, Result};
use crate::estimate::{self, Context, Estimated};
use crate::flight::{Correction, Record};
use crate::lineage::Stage;
use crate::maneuver::{Class, Maneuver};
use crate::output_error::Outcome;
use crate::pipeline::campaign::{Campaign, Failure, MissingArtefact};
use crate::pipeline::problems::problem;
use crate::pipeline::records::ingested::Flight;
use crate::report;
use crate::store::record_file::RecordFile;
use crate::store::{ArtefactName, Fingerprint, Kind, Store};
use crate::surfaces::DelayCorrection;

/// Everything that decides the derivatives of a maneuver.
#[derive(Serialize)]
pub struct EstimateKey<'a> {
    /// Fingerprint of the flight's ingest.
    ingest: &'a str,
    maneuver: &'a Maneuver,
    class: Option<&'a Class>,
    /// Fingerprint of what all maneuvers share ([`estimate_basis`]).
    basis: &'a str,
    /// Corrections of the surfaces of the maneuver's axis.
    delays: Vec<&'a DelayCorrection>,
    /// Corrections of the flight's instruments from all flights together.
    #[serde(skip_serializing_if = "Option::is_none")]
    corrections: Option<&'a [Correction]>,
}

/// Record of a flight with the surfaces' delays corrected, opened by the first maneuver that reads
/// it.
pub struct LazyRecord<'a> {
    pub flight: &'a Flight,
    store: &'a Store,
    delays: &'a [DelayCorrection],
    record: Mutex<Option<Arc<RecordFile>>>,
}

impl<'a> LazyRecord<'a> {
    pub fn new(
        flight: &'a Flight,
        store: &'a Store,
        delays: &'a [DelayCorrection],
    ) -> LazyRecord<'a> {
        LazyRecord {
            flight,
            store,
            delays,
            record: Mutex::default(),
        }
    }

    /// Reads the part of the record that holds a maneuver.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] or [`crate::error::Error::Store`] naming the record.
    pub fn read_maneuver(&self, maneuver: &Maneuver) -> Result<Record> {
        self.open()?.part(None, maneuver.start_s, maneuver.end_s)
    }

    fn open(&self) -> Result<Arc<RecordFile>> {
        let mut record = self.record.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(record) = &*record {
            return Ok(Arc::clone(record));
        }
        let further = self.delays.iter().filter_map(DelayCorrection::of_record);
        let opened = Arc::new(self.flight.open(self.store)?.corrected_further(further));
        *record = Some(Arc::clone(&opened));
        Ok(opened)
    }
}

/// Estimation of one maneuver.
pub struct EstimateStep<'a> {
    pub config: &'a Config,
    /// Fingerprint of what all maneuvers share ([`estimate_basis`]).
    pub basis: &'a str,
    pub store: &'a Store,
    pub record: &'a LazyRecord<'a>,
    pub maneuver: &'a Maneuver,
}

impl<'a> Step for EstimateStep<'a> {
    type Key = EstimateKey<'a>;
    type Artefact = Estimated;

    const KIND: Kind = Kind::Estimate;
    const VERSION: u32 = 42;

    fn item(&self) -> &str {
        &self.maneuver.maneuver_id
    }

    fn key(&self) -> EstimateKey<'a> {
        let config = self.config;
        EstimateKey {
            ingest: &self.record.flight.fingerprint,
            maneuver: self.maneuver,
            class: config.class(&self.maneuver.class),
            basis: self.basis,
            delays: delays_of_axis(config, self.record.delays, self.maneuver.axis),
            corrections: self.record.flight.by_all_flights.as_deref(),
        }
    }

    fn make(&self, name: &ArtefactName) -> Result<ComputedArtefact<Estimated>> {
        let record = self.record.read_maneuver(self.maneuver)?;
        let mut estimated =
            estimate_maneuver(self.config, &record, self.maneuver, self.record.delays);
        let history = estimated.history.take().map(|h| report::thinned(&h));
        self.store.save(&name.sibling(Kind::History), &history)?;
        estimated.means = estimate::means(&record, self.maneuver, &self.config.aero_model);
        Ok(ComputedArtefact::Final(estimated))
    }

    fn companions(&self, name: &ArtefactName, _: &Estimated) -> Vec<Companion> {
        vec![Companion {
            name: name.sibling(Kind::History),
            digest: None,
        }]
    }
}

/// Fingerprint of the aircraft, its equations, the tunnel and the settings of the estimation.
#[must_use]
pub fn estimate_basis(config: &Config) -> String {
    Fingerprint::of("basis", 1)
        .with(&config.aircraft)
        .with(&config.aero_model)
        .with(&config.tunnel)
        .with(&config.estimate)
        .finish()
}

/// Corrections of the surfaces that act in an axis; other surfaces have no effect on its estimates.
fn delays_of_axis<'a>(
    config: &'a Config,
    delays: &'a [DelayCorrection],
    axis: Axis,
) -> Vec<&'a DelayCorrection> {
    let surfaces = config.aero_model.derivatives_of(axis);
    let surfaces: Vec<&str> = surfaces.flat_map(|d| d.regressor.signals()).collect();
    let is_of_axis = |delay: &&DelayCorrection| surfaces.contains(&delay.surface.as_str());
    delays.iter().filter(is_of_axis).collect()
}

/// Estimates a maneuver from the part of its record, whose delays are corrected.
pub fn estimate_maneuver(
    config: &Config,
    record: &Record,
    maneuver: &Maneuver,
    delays: &[DelayCorrection],
) -> Estimated {
    match config.class(&maneuver.class) {
        Some(class) => estimate::maneuver(record, maneuver, class, &context(config, delays)),
        None => Estimated::unknown_class(maneuver),
    }
}

/// Model, aircraft, settings and surfaces' delays of every estimate.
pub fn context<'a>(config: &'a Config, delays: &'a [DelayCorrection]) -> Context<'a> {
    Context::new(
        &config.aircraft,
        &config.aero_model,
        &config.tunnel,
        &config.estimate,
    )
    .with_delays(delays)
}

/// Loads or makes the estimates of all maneuvers, in their order. `None` if some are missing and
/// nothing is made.
///
/// # Errors
/// A fault that stops the run.
pub fn estimate(runner: &StepRunner, campaign: &mut Campaign) -> Result<Option<Vec<Estimated>>> {
    let all: Vec<&Maneuver> = campaign.maneuvers.iter().collect();
    let brought = load_or_make_maneuvers(runner, &campaign.flights, &all, &campaign.delays)?;
    let mut missing = Vec::new();
    let mut estimates = Vec::new();
    for (maneuver, estimate) in campaign.maneuvers.iter().zip(brought) {
        match estimate {
            Some(estimate) => estimates.push(estimate),
            None => missing.push(missing_estimate(maneuver)),
        }
    }
    let is_whole = missing.is_empty();
    let state = campaign.state(Stage::Estimate);
    state.fresh = estimates.len();
    state.missing.extend(missing);
    let failed = estimates.iter().filter_map(|e| failure(&e.artefact));
    state.failed.extend(failed);
    let (names, estimated): (Vec<_>, Vec<_>) =
        estimates.into_iter().map(|e| (e.name, e.artefact)).unzip();
    campaign.estimate_names = names;
    Ok(is_whole.then_some(estimated))
}

fn missing_estimate(maneuver: &Maneuver) -> MissingArtefact {
    MissingArtefact {
        item: maneuver.maneuver_id.clone(),
        flight_id: maneuver.flight_id.clone(),
        class: Some(maneuver.class.clone()),
    }
}

/// Failure of a fit that did not converge.
fn failure(estimated: &Estimated) -> Option<Failure> {
    let fit = &estimated.fit;
    (fit.outcome != Outcome::Converged).then(|| Failure {
        item: fit.maneuver_id.clone(),
        reason: format!("{}: {}", fit.outcome, fit.reason),
    })
}

/// Loads or makes the estimates of some maneuvers, flight by flight in the order of the flights.
///
/// # Errors
/// A fault that stops the run.
pub fn load_or_make_maneuvers(
    runner: &StepRunner,
    flights: &[Flight],
    maneuvers: &[&Maneuver],
    delays: &[DelayCorrection],
) -> Result<Vec<Option<LoadedOrMade<Estimated>>>> {
    let basis = estimate_basis(runner.config);
    let of_flight = |flight: &Flight| {
        let record = LazyRecord::new(flight, &runner.store, delays);
        let of_flight = maneuvers.iter().filter(|m| m.flight_id == flight.id());
        let steps: Vec<EstimateStep> = of_flight
            .map(|maneuver| EstimateStep {
                config: runner.config,
                basis: &basis,
                store: &runner.store,
                record: &record,
                maneuver,
            })
            .collect();
        runner.load_or_make_all(&steps)
    };
    let brought: Result<Vec<Vec<_>>> = runner.with_progress("estimate", maneuvers.len(), || {
        flights.par_iter().map(of_flight).collect()
    });
    Ok(brought?.into_iter().flatten().collect())
}

/// Collects the rows of all estimates.
pub fn collect_rows(campaign: &mut Campaign, estimates: Vec<Estimated>) {
    for (maneuver, estimated) in campaign.maneuvers.iter().zip(estimates) {
        if let Some(failure) = failure(&estimated) {
            campaign.problems.push(problem(
                ProblemStage::Estimate,
                &maneuver.flight_id,
                &maneuver.maneuver_id,
                &failure.reason,
            ));
        }
        campaign.fits.push(estimated.fit);
        campaign.covariances.push(estimated.covariance);
        campaign.means.push(estimated.means);
        campaign.estimates.extend(estimated.estimates);
        campaign.combined.extend(estimated.combined);
        campaign.fit_outputs.extend(estimated.fit_outputs);
        campaign.correlations.extend(estimated.correlations);
    }
}
