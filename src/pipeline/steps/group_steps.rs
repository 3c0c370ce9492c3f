//! Steps over several maneuvers: joint estimates, and the prediction of each maneuver from others.
//!
//! Their keys name the estimates of the maneuvers, whose names carry the fingerprints of everything
//! that decides them. Records are read only for an artefact that is made.

use rayon::prelude::*;
use serde::Serialize;

use super::estimate_step::{LazyRecord, context};
use super::step::{ComputedArtefact, Step};
use super::step_runner::StepRunner;
use crate::config::Config;
use crate::error::{Error, ProblemStage, Result};
use crate::estimate::joint::{self, Bin, Joined};
use crate::estimate::prediction::{self, Predicted};
use crate::estimate::{Estimated, JointSettings, PredictionSettings};
use crate::flight::Record;
use crate::lineage::Stage;
use crate::maneuver::Maneuver;
use crate::output_error::Outcome;
use crate::pipeline::campaign::{Campaign, MissingArtefact};
use crate::pipeline::problems::problem;
use crate::pipeline::records::ingested::Flight;
use crate::store::{ArtefactName, Kind, Store};
use crate::surfaces::DelayCorrection;
use crate::tables::{FitRow, JOINT_FLIGHT};

/// A maneuver with its flight and the name of its estimate.
#[derive(Clone, Copy)]
struct Member<'a> {
    flight: &'a Flight,
    maneuver: &'a Maneuver,
    estimate: &'a ArtefactName,
    delays: &'a [DelayCorrection],
}

impl<'a> Member<'a> {
    /// The maneuver of this index.
    fn of(campaign: &'a Campaign, index: usize) -> Option<Member<'a>> {
        let maneuver = campaign.maneuvers.get(index)?;
        let mut flights = campaign.flights.iter();
        Some(Member {
            flight: flights.find(|f| f.id() == maneuver.flight_id)?,
            maneuver,
            estimate: campaign.estimate_names.get(index)?,
            delays: &campaign.delays,
        })
    }

    fn record(&self, store: &Store) -> Result<Record> {
        LazyRecord::new(self.flight, store, self.delays).read_maneuver(self.maneuver)
    }
}

/// Everything that decides a joint estimate.
#[derive(Serialize)]
pub struct JointKey<'a> {
    joint_id: &'a str,
    class: &'a str,
    settings: &'a JointSettings,
    estimates: Vec<&'a str>,
}

/// Joint estimation of the maneuvers of one class and angle of attack.
pub struct JointStep<'a> {
    config: &'a Config,
    store: &'a Store,
    settings: &'a JointSettings,
    bin: &'a Bin,
    /// Members with their fits.
    members: Vec<(Member<'a>, &'a FitRow)>,
    delays: &'a [DelayCorrection],
}

impl<'a> Step for JointStep<'a> {
    type Key = JointKey<'a>;
    type Artefact = Joined;

    const KIND: Kind = Kind::Joint;
    const VERSION: u32 = 18;

    fn item(&self) -> &str {
        &self.bin.joint_id
    }

    fn key(&self) -> JointKey<'a> {
        JointKey {
            joint_id: &self.bin.joint_id,
            class: &self.bin.class,
            settings: self.settings,
            estimates: self
                .members
                .iter()
                .map(|(m, _)| m.estimate.as_str())
                .collect(),
        }
    }

    fn make(&self, name: &ArtefactName) -> Result<ComputedArtefact<Joined>> {
        let class = self
            .config
            .class(&self.bin.class)
            .ok_or_else(|| Error::store(&self.store.path(name), &"its class is not configured"))?;
        let (doubtful, sound): (Vec<_>, Vec<_>) = self
            .members
            .iter()
            .partition(|(_, fit)| fit.outcome == Outcome::Doubtful);
        let records = sound.iter().map(|(member, _)| member.record(self.store));
        let records = records.collect::<Result<Vec<Record>>>()?;
        let maneuvers = sound.iter().map(|(member, _)| member.maneuver);
        let members: Vec<(&Record, &Maneuver)> = records.iter().zip(maneuvers).collect();
        let doubtful: Vec<(&Maneuver, String)> = doubtful
            .into_iter()
            .map(|(member, fit)| (member.maneuver, format!("doubtful: {}", fit.reason)))
            .collect();
        let joint_id = &self.bin.joint_id;
        Ok(ComputedArtefact::Final(joint::estimate(
            joint_id,
            &members,
            &doubtful,
            class,
            &context(self.config, self.delays),
        )))
    }
}

/// Estimates maneuvers of one class and angle of attack together, if the analyst asks for it.
///
/// # Errors
/// A fault that stops the run.
pub fn estimate_jointly(
    runner: &StepRunner,
    campaign: &mut Campaign,
    estimates: &[Estimated],
) -> Result<()> {
    let Some(settings) = &runner.config.estimate.joint else {
        return Ok(());
    };
    let bins = joint::bins(&campaign.maneuvers, settings);
    let members = |bin: &Bin| {
        let indices = bin.members.iter();
        indices
            .filter_map(|&i| Some((Member::of(campaign, i)?, &estimates.get(i)?.fit)))
            .collect::<Vec<_>>()
    };
    let steps: Vec<JointStep> = bins
        .iter()
        .map(|bin| JointStep {
            config: runner.config,
            store: &runner.store,
            settings,
            bin,
            members: members(bin),
            delays: &campaign.delays,
        })
        .collect();
    let brought: Result<Vec<_>> = steps
        .par_iter()
        .map(|step| runner.load_or_make(step))
        .collect();
    for (bin, joined) in bins.iter().zip(brought?) {
        if let Some(joined) = joined {
            add_joined(campaign, joined.artefact);
            continue;
        }
        let missing = MissingArtefact {
            item: bin.joint_id.clone(),
            flight_id: String::new(),
            class: Some(bin.class.clone()),
        };
        campaign.state(Stage::Estimate).missing.push(missing);
    }
    Ok(())
}

fn add_joined(campaign: &mut Campaign, joined: Joined) {
    let fit = &joined.estimated.fit;
    if fit.outcome != Outcome::Converged {
        let reason = format!("{}: {}", fit.outcome, fit.reason);
        campaign.problems.push(problem(
            ProblemStage::Estimate,
            JOINT_FLIGHT,
            &fit.maneuver_id,
            &reason,
        ));
    }
    campaign.joined.push(joined);
}

/// Everything that decides a prediction.
#[derive(Serialize)]
pub struct PredictKey<'a> {
    settings: &'a PredictionSettings,
    /// Estimate of the predicted maneuver itself; its name covers everything else that decides the
    /// prediction.
    estimate: &'a str,
    from: Vec<&'a str>,
}

/// Prediction of one maneuver from the estimates of others.
pub struct PredictStep<'a> {
    config: &'a Config,
    store: &'a Store,
    settings: &'a PredictionSettings,
    member: Member<'a>,
    /// The maneuver's own estimate.
    own: &'a Estimated,
    from: Vec<(&'a ArtefactName, &'a Estimated)>,
}

impl<'a> Step for PredictStep<'a> {
    type Key = PredictKey<'a>;
    type Artefact = Predicted;

    const KIND: Kind = Kind::Predict;
    const VERSION: u32 = 13;

    fn item(&self) -> &str {
        &self.member.maneuver.maneuver_id
    }

    fn key(&self) -> PredictKey<'a> {
        PredictKey {
            settings: self.settings,
            estimate: self.member.estimate.as_str(),
            from: self.from.iter().map(|(name, _)| name.as_str()).collect(),
        }
    }

    fn make(&self, _: &ArtefactName) -> Result<ComputedArtefact<Predicted>> {
        let maneuver = self.member.maneuver;
        let from: Vec<&Estimated> = self.from.iter().map(|(_, estimated)| *estimated).collect();
        let predicted = match self.config.class(&maneuver.class) {
            Some(class) => {
                let record = self.member.record(self.store)?;
                let context = context(self.config, self.member.delays);
                prediction::maneuver(&record, maneuver, class, &context, self.own, &from)
            }
            None => Predicted::not_predicted("the configuration has no such class", from.len()),
        };
        Ok(ComputedArtefact::Final(predicted))
    }
}

/// Predicts each maneuver from others of its class and angle of attack, unless that is switched
/// off.
///
/// # Errors
/// A fault that stops the run.
pub fn predict(
    runner: &StepRunner,
    campaign: &mut Campaign,
    estimates: &[Estimated],
) -> Result<()> {
    let Some(settings) = &runner.config.estimate.prediction else {
        return Ok(());
    };
    let fits: Vec<FitRow> = estimates.iter().map(|e| e.fit.clone()).collect();
    let sources = prediction::predicting_maneuvers(&campaign.maneuvers, &fits, settings);
    let bring = |(i, sources): (usize, &Option<Vec<usize>>)| {
        let Some(sources) = sources else {
            let reason = "its own fit did not converge or is doubtful";
            return Ok(Some(Predicted::not_predicted(reason, 0)));
        };
        let from = sources.iter().filter_map(|&j| {
            let name = campaign.estimate_names.get(j)?;
            Some((name, estimates.get(j)?))
        });
        let from: Vec<_> = from.collect();
        let member = Member::of(campaign, i).filter(|_| !from.is_empty());
        let Some((member, own)) = member.zip(estimates.get(i)) else {
            let reason = "no other maneuver of its class and angle of attack";
            return Ok(Some(Predicted::not_predicted(reason, 0)));
        };
        let step = PredictStep {
            config: runner.config,
            store: &runner.store,
            settings,
            member,
            own,
            from,
        };
        Ok(runner.load_or_make(&step)?.map(|brought| brought.artefact))
    };
    let brought: Result<Vec<Option<Predicted>>> =
        sources.par_iter().enumerate().map(bring).collect();
    let brought = brought?;
    let lacking = campaign.maneuvers.iter().zip(&brought);
    let missing: Vec<MissingArtefact> = lacking
        .filter(|(_, predicted)| predicted.is_none())
        .map(|(maneuver, _)| MissingArtefact {
            item: maneuver.maneuver_id.clone(),
            flight_id: maneuver.flight_id.clone(),
            class: Some(maneuver.class.clone()),
        })
        .collect();
    campaign.state(Stage::Estimate).missing.extend(missing);
    campaign.predicted = brought.into_iter().flatten().collect();
    Ok(())
}
