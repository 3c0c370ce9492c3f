//! Proof of match of the campaign: one artefact a maneuver, flown again by each model.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::estimate_step::LazyRecord;
use super::step::{ComputedArtefact, Step};
use super::step_runner::StepRunner;
use crate::aero::WindTunnel;
use crate::config::Config;
use crate::error::Result;
use crate::flight::Correction;
use crate::maneuver::{Maneuver, Means};
use crate::model::Model;
use crate::pipeline::campaign::Campaign;
use crate::pipeline::records::ingested::Flight;
use crate::proof_of_match::{
    self, DecisiveDifference, Matched, OwnEstimates, ProofInputs, RecordedManeuver, Specification,
};
use crate::store::{ArtefactName, Fingerprint, Kind};
use crate::surfaces::DelayCorrection;
use crate::tables::{EstimateRow, ModelSource, Outcome};

/// Everything that decides a maneuver's proof of match.
#[derive(Serialize)]
pub struct MatchKey<'a> {
    /// Fingerprint of the flight's ingest.
    ingest: &'a str,
    maneuver: &'a Maneuver,
    /// Fingerprint of what all maneuvers share.
    basis: &'a str,
    /// The maneuver's own estimates and means, from which its Dutch roll follows.
    own: Option<(&'a Means, OwnEstimates)>,
    delays: &'a [DelayCorrection],
    #[serde(skip_serializing_if = "Option::is_none")]
    corrections: Option<&'a [Correction]>,
}

/// Proof of match of one maneuver.
pub struct MatchStep<'a> {
    basis: &'a ProofInputs<'a>,
    posterior: &'a Model,
    /// Fingerprint of the aircraft, its equations, the tolerances, all models' derivatives, and the
    /// posterior with its covariance.
    fingerprint: &'a str,
    record: &'a LazyRecord<'a>,
    delays: &'a [DelayCorrection],
    maneuver: &'a Maneuver,
    own: Option<(&'a Means, OwnEstimates)>,
}

impl<'a> Step for MatchStep<'a> {
    type Key = MatchKey<'a>;
    type Artefact = Matched;

    const KIND: Kind = Kind::Match;
    const VERSION: u32 = 10;

    fn item(&self) -> &str {
        &self.maneuver.maneuver_id
    }

    fn key(&self) -> MatchKey<'a> {
        MatchKey {
            ingest: &self.record.flight.fingerprint,
            maneuver: self.maneuver,
            basis: self.fingerprint,
            own: self.own.clone(),
            delays: self.delays,
            corrections: self.record.flight.by_all_flights.as_deref(),
        }
    }

    fn make(&self, _: &ArtefactName) -> Result<ComputedArtefact<Matched>> {
        if self.maneuver.is_rejected() {
            let reason = format!("rejected: {}", self.maneuver.quality.reason);
            let matched = proof_of_match::not_flown(self.basis, self.maneuver, &reason);
            return Ok(ComputedArtefact::Final(matched));
        }
        let record = self.record.read_maneuver(self.maneuver)?;
        let condition = self.maneuver.condition(self.basis.tunnel);
        let local = self
            .posterior
            .posterior_at_condition(self.maneuver.axis, &condition);
        let flown = RecordedManeuver {
            record: &record,
            maneuver: self.maneuver,
            local: Some(&local),
            own: self.own.as_ref().map(|(means, own)| (*means, own)),
        };
        let mut matched = proof_of_match::fly_again(self.basis, &flown);
        matched.history = matched.history.map(|h| crate::report::thinned(&h));
        Ok(ComputedArtefact::Final(matched))
    }
}

/// Flies every maneuver again, if the pipeline has tolerances.
///
/// # Errors
/// A fault that stops the run.
pub fn fly_again(runner: &StepRunner, campaign: &mut Campaign) -> Result<()> {
    let Some(specification) = &runner.config.proof_of_match else {
        return Ok(());
    };
    let databases = Databases::new(runner.config, campaign, &specification.models);
    let fingerprint = Fingerprint::of("proof of match", 1)
        .with(&runner.config.aircraft)
        .with(&runner.config.aero_model)
        .with(specification)
        .with(&databases.models)
        .with(&databases.tunnel)
        .with(&campaign.model.rows.posterior)
        .with(&campaign.model.rows.covariance)
        .finish();
    let basis = databases.basis(runner.config, specification);
    let estimates = EstimateRow::by_maneuver(&campaign.estimates);
    let of_flight = |flight: &Flight| {
        let record = LazyRecord::new(flight, &runner.store, &campaign.delays);
        let own = campaign.maneuvers.iter().enumerate();
        let own = own.filter(|(_, m)| m.flight_id == flight.id());
        let steps: Vec<MatchStep> = own
            .map(|(i, maneuver)| MatchStep {
                basis: &basis,
                posterior: &campaign.model,
                fingerprint: &fingerprint,
                record: &record,
                delays: &campaign.delays,
                maneuver,
                own: own_estimates(campaign, &estimates, i),
            })
            .collect();
        runner.load_or_make_all(&steps)
    };
    let matched: Result<Vec<Vec<_>>> =
        runner.with_progress("match", campaign.maneuvers.len(), || {
            campaign.flights.par_iter().map(of_flight).collect()
        });
    let matched = matched?.into_iter().flatten().flatten();
    campaign.matched = matched.map(|loaded| loaded.artefact).collect();
    Ok(())
}

/// Finds the differences that decide the proof of match of a class, predicted by a model. Each
/// maneuver that can be flown again has one, in the order of the flights.
///
/// # Errors
/// A record that cannot be read.
pub fn decisive_differences(
    runner: &StepRunner,
    campaign: &Campaign,
    (class, model): (&str, ModelSource),
) -> Result<Vec<DecisiveDifference>> {
    let Some(specification) = &runner.config.proof_of_match else {
        return Ok(vec![]);
    };
    let databases = Databases::new(runner.config, campaign, &[model]);
    let basis = databases.basis(runner.config, specification);
    let estimates = EstimateRow::by_maneuver(&campaign.estimates);
    let of_flight = |flight: &Flight| {
        let record = LazyRecord::new(flight, &runner.store, &campaign.delays);
        let all = campaign.maneuvers.iter().enumerate();
        let own =
            all.filter(|(_, m)| m.flight_id == flight.id() && m.class == class && !m.is_rejected());
        let mut found = Vec::new();
        for (place, maneuver) in own {
            let record = record.read_maneuver(maneuver)?;
            let own = own_estimates(campaign, &estimates, place);
            let local = campaign
                .model
                .posterior_at_condition(maneuver.axis, &maneuver.condition(basis.tunnel));
            let flown = RecordedManeuver {
                record: &record,
                maneuver,
                local: Some(&local),
                own: own.as_ref().map(|(means, own)| (*means, own)),
            };
            found.extend(proof_of_match::decisive_difference(&basis, &flown));
        }
        Ok(found)
    };
    let found: Result<Vec<Vec<_>>> = campaign.flights.par_iter().map(of_flight).collect();
    Ok(found?.into_iter().flatten().collect())
}

/// Derivatives of the models, of the posterior, and of the tunnel.
struct Databases {
    models: Vec<(ModelSource, WindTunnel)>,
    posterior: WindTunnel,
    tunnel: WindTunnel,
}

impl Databases {
    fn new(config: &Config, campaign: &Campaign, models: &[ModelSource]) -> Databases {
        let tunnel = config.tunnel.clamped();
        let posterior = proof_of_match::of_posterior(&campaign.model.rows.posterior, &tunnel);
        let database = |model: &ModelSource| match model {
            ModelSource::Posterior => posterior.clone(),
            ModelSource::Trend => of_trends(config, campaign, &tunnel),
            ModelSource::Tunnel => tunnel.clone(),
            ModelSource::Database => config.match_database.clamped(),
        };
        Databases {
            models: models.iter().map(|m| (*m, database(m))).collect(),
            posterior,
            tunnel,
        }
    }

    fn basis<'a>(
        &'a self,
        config: &'a Config,
        specification: &'a Specification,
    ) -> ProofInputs<'a> {
        ProofInputs {
            aircraft: &config.aircraft,
            aero_model: &config.aero_model,
            models: &self.models,
            posterior: &self.posterior,
            tunnel: &self.tunnel,
            specification,
        }
    }
}

/// Means and estimates of a maneuver that converged.
fn own_estimates<'a>(
    campaign: &'a Campaign,
    estimates: &BTreeMap<&str, &[EstimateRow]>,
    index: usize,
) -> Option<(&'a Means, OwnEstimates)> {
    let maneuver = campaign.maneuvers.get(index)?;
    let fit = campaign.fits.get(index)?;
    let covariance = campaign.covariances.get(index)?.as_ref()?;
    let means = campaign.means.get(index)?.as_ref()?;
    let rows = estimates.get(maneuver.maneuver_id.as_str())?;
    let value = |row: &EstimateRow| Some((row.derivative.clone(), row.value?));
    let own = OwnEstimates {
        values: rows.iter().filter_map(value).collect(),
        estimated: covariance.names.clone(),
        covariance: covariance.corrected.clone(),
    };
    (fit.outcome == Outcome::Converged).then_some((means, own))
}

/// Trends of the configured groups as a database.
fn of_trends(config: &Config, campaign: &Campaign, tunnel: &WindTunnel) -> WindTunnel {
    let groups = config.trend.groups.iter();
    let groups: Vec<&str> = groups.map(|group| group.name.as_str()).collect();
    proof_of_match::of_trends(&campaign.trends, &groups, tunnel)
}
