//! Surfaces of the campaign: one artefact a stretch, with the evidence of its maneuvers on the delays
//! and signs of its surfaces. The delays themselves are combined anew each time from all flights.

use rayon::prelude::*;
use serde::Serialize;

use super::estimate_step::LazyRecord;
use super::step::{ComputedArtefact, Step};
use super::step_runner::StepRunner;
use crate::aero::{AeroModel, WindTunnel};
use crate::aircraft::Aircraft;
use crate::config::Config;
use crate::error::Result;
use crate::flight::Record;
use crate::ingest::ErrorEvidence;
use crate::lineage::Stage;
use crate::maneuver::Maneuver;
use crate::pipeline::campaign::{Campaign, MissingArtefact};
use crate::pipeline::records::ingested::Flight;
use crate::recorder::{self, ErrorSeries, ExaminedSeries};
use crate::store::{ArtefactName, Kind, Store};
use crate::surfaces::{self, AircraftModel, FlightEvidence};

/// Everything that decides a stretch's evidence on its surfaces.
#[derive(Serialize)]
pub struct SurfacesKey<'a> {
    /// Fingerprint of the flight's ingest.
    ingest: &'a str,
    maneuvers: &'a [&'a Maneuver],
    aircraft: &'a Aircraft,
    model: &'a AeroModel,
    tunnel: &'a WindTunnel,
}

/// Evidence of one stretch's maneuvers.
pub struct SurfacesStep<'a> {
    config: &'a Config,
    store: &'a Store,
    flight: &'a Flight,
    maneuvers: &'a [&'a Maneuver],
}

impl<'a> Step for SurfacesStep<'a> {
    type Key = SurfacesKey<'a>;
    type Artefact = FlightEvidence;

    const KIND: Kind = Kind::Surfaces;
    const VERSION: u32 = 6;

    fn item(&self) -> &str {
        self.flight.id()
    }

    fn key(&self) -> SurfacesKey<'a> {
        SurfacesKey {
            ingest: &self.flight.fingerprint,
            maneuvers: self.maneuvers,
            aircraft: &self.config.aircraft,
            model: &self.config.aero_model,
            tunnel: &self.config.tunnel,
        }
    }

    fn make(&self, _: &ArtefactName) -> Result<ComputedArtefact<FlightEvidence>> {
        let file = LazyRecord::new(self.flight, self.store, &[]);
        let part = |maneuver: &&'a Maneuver| Ok((file.read_maneuver(maneuver)?, *maneuver));
        let parts: Result<Vec<(Record, &Maneuver)>> = self.maneuvers.iter().map(part).collect();
        let basis = AircraftModel {
            aircraft: &self.config.aircraft,
            aero_model: &self.config.aero_model,
            tunnel: &self.config.tunnel,
        };
        let evidence = surfaces::flight_evidence(self.flight.id(), &parts?, basis);
        Ok(ComputedArtefact::Final(evidence))
    }
}

/// Loads or makes the evidence of all flights, and combines it to the delays of the surfaces.
///
/// # Errors
/// A fault that stops the run.
pub fn surfaces(runner: &StepRunner, campaign: &mut Campaign) -> Result<()> {
    let flights: Vec<&Flight> = campaign
        .flights
        .iter()
        .filter(|f| f.is_accepted())
        .collect();
    let evidence_of = |flight: &&Flight| {
        let of_flight = |m: &&Maneuver| m.flight_id == flight.id();
        let maneuvers: Vec<&Maneuver> = campaign.maneuvers.iter().filter(of_flight).collect();
        let evidence = runner.load_or_make(&SurfacesStep {
            config: runner.config,
            store: &runner.store,
            flight,
            maneuvers: &maneuvers,
        });
        runner.advance(flight.id());
        evidence
    };
    let loaded: Result<Vec<_>> = runner.with_progress("surfaces", flights.len(), || {
        flights.par_iter().map(evidence_of).collect()
    });
    let ids: Vec<String> = flights.iter().map(|f| f.id().to_owned()).collect();
    let mut known = Vec::with_capacity(ids.len());
    for (flight_id, evidence) in ids.into_iter().zip(loaded?) {
        match evidence {
            Some(evidence) => known.push(evidence.artefact),
            None => campaign
                .state(Stage::Estimate)
                .missing
                .push(MissingArtefact {
                    item: flight_id.clone(),
                    flight_id,
                    class: None,
                }),
        }
    }
    combine(runner.config, campaign, &known);
    Ok(())
}

/// Adds the delays of the surfaces from all flights, and the findings on each flight. Then the
/// errors of all instruments are compared over the flights.
fn combine(config: &Config, campaign: &mut Campaign, flights: &[FlightEvidence]) {
    let delays = surfaces::of_campaign(flights);
    campaign.delays = surfaces::corrections(&delays, &config.estimate.surfaces);
    let found = surfaces::findings(flights, &delays, &campaign.delays, &config.channels);
    let of_surfaces = surfaces::delay_series(flights, &campaign.delays, &config.channels);
    let examined = compare_flights(config, campaign, of_surfaces);
    campaign.instruments.extend(found.rows);
    recorder::apply_common_verdicts(&mut campaign.instruments, &examined);
    campaign.problems.extend(found.problems);
}

/// Compares the errors of the instruments over the flights. A flight that hardly determines an
/// error is corrected by the errors of the other flights. Returns the series that were compared.
fn compare_flights(
    config: &Config,
    campaign: &mut Campaign,
    of_surfaces: Vec<ErrorSeries>,
) -> Vec<ExaminedSeries> {
    let evidence = |flight: &Flight| flight.ingested.assessment.error_evidence.clone();
    let flights: Vec<(String, Vec<ErrorEvidence>)> = campaign
        .flights
        .iter()
        .map(|flight| (flight.id().to_owned(), evidence(flight)))
        .collect();
    let mut series = recorder::instrument_series(&flights, &config.channels);
    series.extend(of_surfaces);
    let mut found = recorder::examine(series);
    let settings = &config.ingest.compatibility;
    let corrections = recorder::correct_flights(&mut campaign.instruments, &mut found, settings);
    campaign.correct_flights(&corrections);
    campaign.flight_corrections = corrections;
    campaign.instrument_trends = found.rows;
    campaign.problems.extend(found.problems);
    found.examined
}
