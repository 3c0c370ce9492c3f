//! State of a campaign after some of its stages: the rows of its tables, and the state of each
//! stage.

use std::collections::BTreeMap;

use super::records::ingested::Flight;
use crate::error::Problem;
use crate::estimate::Covariance;
use crate::estimate::joint::Joined;
use crate::estimate::prediction::Predicted;
use crate::lineage::Stage;
use crate::maneuver::{Maneuver, Means, UnclassifiedExcitation};
use crate::model::Model;
use crate::output_error::Outcome;
use crate::proof_of_match::Matched;
use crate::qualities::Qualities;
use crate::recorder::FlightCorrections;
use crate::store::ArtefactName;
use crate::surfaces::DelayCorrection;
use crate::tables::{
    AgreementRow, ChangeRow, ChannelRow, CheckRow, ComparisonRow, CorrelationRow, DisagreementRow,
    EstimateRow, EventRow, ExtrapolationRow, FitRow, FlightRow, InstrumentRow, InstrumentTrendRow,
    LiftAndDragRow, ManeuverComparisonRow, OutlierRow, TrendRow, VerdictRow,
};

/// A flight, maneuver or group whose artefact the store lacks.
#[derive(Clone, Debug)]
pub struct MissingArtefact {
    /// Flight, maneuver or group.
    pub item: String,
    /// Flight of the item; empty for a group.
    pub flight_id: String,
    /// Class of a maneuver or group.
    pub class: Option<String>,
}

/// A flight or maneuver that was rejected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    pub item: String,
    pub reason: String,
}

/// State of one stage's artefacts.
#[derive(Clone, Debug, Default)]
pub struct StageState {
    /// Number of flights or maneuvers whose artefact the store has.
    pub fresh: usize,
    pub missing: Vec<MissingArtefact>,
    pub failed: Vec<Failure>,
}

/// Rows that an earlier flight also has.
#[derive(Clone, Debug, PartialEq)]
pub struct RepeatedRows {
    /// Id of the later flight.
    pub flight_id: String,
    pub start_s: f64,
    pub end_s: f64,
}

/// State of a campaign after some of its stages.
#[derive(Clone, Debug, Default)]
pub struct Campaign {
    /// State of the stages whose artefacts the store keeps.
    pub states: BTreeMap<Stage, StageState>,
    pub flights: Vec<Flight>,
    /// Flights that could not be read this time, with the reason.
    pub unread: BTreeMap<String, String>,
    pub repeated_rows: Vec<RepeatedRows>,
    /// Times and gusts of the accepted flights.
    pub flight_rows: Vec<FlightRow>,
    pub channels: Vec<ChannelRow>,
    pub checks: Vec<CheckRow>,
    pub instruments: Vec<InstrumentRow>,
    /// Errors of the instruments over the flights.
    pub instrument_trends: Vec<InstrumentTrendRow>,
    /// Corrections of flights, determined from the instruments of all flights together.
    pub flight_corrections: Vec<FlightCorrections>,
    pub maneuvers: Vec<Maneuver>,
    /// Excitation that fits no class.
    pub unknown: Vec<UnclassifiedExcitation>,
    pub events: Vec<EventRow>,
    /// Corrections of the surfaces' delays, from all flights.
    pub delays: Vec<DelayCorrection>,
    /// Names of the maneuvers' estimates, in the order of the maneuvers.
    pub estimate_names: Vec<ArtefactName>,
    pub fits: Vec<FitRow>,
    pub estimates: Vec<EstimateRow>,
    /// Sums of derivatives that the tunnel tabulates, with the variance of the sum.
    pub combined: Vec<EstimateRow>,
    /// Agreement of each output with its maneuver's own fit.
    pub fit_outputs: Vec<AgreementRow>,
    pub correlations: Vec<CorrelationRow>,
    /// Joint estimates. Their rows are published, but enter no trend, which would count the same
    /// data twice.
    pub joined: Vec<Joined>,
    /// Prediction of each maneuver from other maneuvers, in the order of the maneuvers; empty if
    /// switched off.
    pub predicted: Vec<Predicted>,
    /// Covariance of each maneuver's parameters, in the order of the maneuvers.
    pub covariances: Vec<Option<Covariance>>,
    /// Means of each maneuver's record, in the order of the maneuvers.
    pub means: Vec<Option<Means>>,
    pub trends: Vec<TrendRow>,
    /// Maneuvers far from their trend.
    pub outliers: Vec<OutlierRow>,
    /// Posterior of every derivative.
    pub model: Model,
    /// Lift and drag of each maneuver.
    pub lift_and_drag: Vec<LiftAndDragRow>,
    /// Modes of the aircraft and their levels; empty without `qualities.yaml`.
    pub qualities: Qualities,
    /// Each maneuver flown again, in the order of the maneuvers; empty without `match.yaml`.
    pub matched: Vec<Matched>,
    pub comparison: Vec<ComparisonRow>,
    pub maneuver_comparison: Vec<ManeuverComparisonRow>,
    /// Readings of the tunnel beyond its tables.
    pub extrapolations: Vec<ExtrapolationRow>,
    /// Comparison in words, with the tunnel and with earlier campaigns.
    pub verdicts: Vec<VerdictRow>,
    pub disagreements: Vec<DisagreementRow>,
    /// Differences from earlier campaigns.
    pub changes: Vec<ChangeRow>,
    pub problems: Vec<Problem>,
}

impl Campaign {
    /// State of a stage, empty until the stage has run.
    pub fn state(&mut self, stage: Stage) -> &mut StageState {
        self.states.entry(stage).or_default()
    }

    /// Corrects flights by the corrections from all flights together.
    pub fn correct_flights(&mut self, corrections: &[FlightCorrections]) {
        for flight in &mut self.flights {
            let own = corrections.iter().find(|c| c.flight_id == flight.id());
            flight.by_all_flights = own.map(|c| c.corrections.clone());
        }
    }

    /// Number of flights that ingest rejected.
    #[must_use]
    pub fn rejected_flights(&self) -> usize {
        self.flights.iter().filter(|f| !f.is_accepted()).count()
    }

    /// Number of maneuvers whose fit converged.
    #[must_use]
    pub fn converged(&self) -> usize {
        self.fits
            .iter()
            .filter(|f| f.outcome == Outcome::Converged)
            .count()
    }

    /// Estimates and combined sums of all maneuvers.
    pub fn estimates_and_sums(&self) -> impl Iterator<Item = &EstimateRow> {
        self.estimates.iter().chain(&self.combined)
    }

    /// Predicted outputs of all maneuvers.
    #[must_use]
    pub fn predictions(&self) -> Vec<AgreementRow> {
        let outputs = self.predicted.iter().flat_map(|p| &p.outputs);
        outputs.cloned().collect()
    }
}
