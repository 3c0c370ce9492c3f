//! What is made from several maneuvers together: joint estimates, and the prediction of each from
//! the others.
//!
//! An artefact's fingerprint is over the names of its maneuvers' own estimates, which carry theirs:
//! what decides one of them decides this. Records are read only for what is not up to date, and
//! only the parts that hold the maneuvers.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::{Campaign, Fingerprint, JOINT_VERSION, PREDICT_VERSION, Run, problem};
use crate::error::{Error, ProblemStage, Result};
use crate::estimate::Estimated;
use crate::estimate::joint::{self, Bin, Joined};
use crate::estimate::prediction::{self, Predicted};
use crate::flight::Record;
use crate::lineage::Stage;
use crate::maneuver::Maneuver;
use crate::output_error::Outcome;
use crate::store::{Store, table};
use crate::tables::{EstimateRow, FitRow, JOINT_FLIGHT, JointRow, PredictedRow};

/// The name of an artefact, which carries its fingerprint; not where it lies.
fn name(path: &Path) -> String {
    path.file_name()
        .map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

impl Run<'_> {
    /// Estimates maneuvers of one class and angle of attack together, where that is asked for.
    pub(crate) fn join(&self, campaign: &mut Campaign, estimates: &[PathBuf]) -> Result<()> {
        let settings = self.config.estimate.joint.as_ref();
        let bins = settings.map_or_else(Vec::new, |s| joint::bins(&campaign.maneuvers, s));
        let path = |bin: &Bin| {
            let members: Vec<String> = bin
                .members
                .iter()
                .filter_map(|&i| estimates.get(i))
                .map(|p| name(p))
                .collect();
            let fingerprint = Fingerprint::of("joint", JOINT_VERSION)
                .with(&settings)
                .with(bin)
                .with(&members)
                .finish();
            self.store
                .path("joint", &bin.joint_id, &fingerprint, "json")
        };
        let paths: Vec<PathBuf> = bins.iter().map(path).collect();
        let present: Vec<Option<Joined>> = paths.iter().map(|p| self.store.load(p)).collect();
        let wanted = bins
            .iter()
            .zip(&present)
            .filter(|(_, p)| p.is_none())
            .flat_map(|(b, _)| b.members.clone());
        let records = parts(&self.store, campaign, &wanted.collect())?;
        let items: Vec<_> = bins.iter().zip(&paths).zip(present).collect();
        let work = |((bin, path), present): ((&Bin, &PathBuf), Option<Joined>)| {
            if let Some(joined) = present {
                return Ok(joined);
            }
            let class = self
                .config
                .class(&bin.class)
                .ok_or_else(|| Error::store(path, &"its class is unknown"))?;
            let member = |i: &usize| Some((records.get(i)?, campaign.maneuvers.get(*i)?));
            let members: Vec<(&Record, &Maneuver)> =
                bin.members.iter().filter_map(member).collect();
            let joined = joint::estimate(&bin.joint_id, &members, class, &self.context());
            self.store.save(path, &joined)?;
            Ok(joined)
        };
        let joined: Result<Vec<Joined>> = items.into_par_iter().map(work).collect();
        campaign.joined = joined?;
        self.store.need(&paths);
        for fit in campaign
            .joined
            .iter()
            .map(|j| &j.estimated.fit)
            .filter(|f| f.outcome != Outcome::Converged)
        {
            let reason = format!("{}: {}", fit.outcome, fit.reason);
            campaign.problems.push(problem(
                ProblemStage::Estimate,
                JOINT_FLIGHT,
                &fit.maneuver_id,
                &reason,
            ));
        }
        Ok(())
    }

    /// Predicts each maneuver from the others of its class and angle of attack, unless that is
    /// switched off.
    pub(crate) fn predict(
        &self,
        campaign: &mut Campaign,
        paths: &[PathBuf],
        estimated: &[Estimated],
    ) -> Result<()> {
        let Some(settings) = &self.config.estimate.prediction else {
            return Ok(());
        };
        let fits: Vec<FitRow> = estimated.iter().map(|e| e.fit.clone()).collect();
        let others = prediction::others(&campaign.maneuvers, &fits, settings);
        let path = |(i, others): (usize, &Option<Vec<usize>>)| {
            let others = others.as_ref().filter(|o| !o.is_empty())?;
            let names: Vec<String> = others
                .iter()
                .filter_map(|&j| paths.get(j))
                .map(|p| name(p))
                .collect();
            let own = name(paths.get(i)?);
            let fingerprint = Fingerprint::of("predict", PREDICT_VERSION)
                .with(settings)
                .with(&own)
                .with(&names)
                .finish();
            Some(self.store.path(
                "predict",
                &campaign.maneuvers.get(i)?.maneuver_id,
                &fingerprint,
                "json",
            ))
        };
        let artefacts: Vec<Option<PathBuf>> = others.iter().enumerate().map(path).collect();
        let present: Vec<Option<Predicted>> = artefacts
            .iter()
            .map(|p| p.as_ref().and_then(|p| self.store.load(p)))
            .collect();
        let wanted = (0..others.len()).filter(|&i| artefacts[i].is_some() && present[i].is_none());
        let records = parts(&self.store, campaign, &wanted.collect())?;
        let maneuvers = &campaign.maneuvers;
        let work =
            |(i, present): (usize, Option<Predicted>)| match (present, &artefacts[i], &others[i]) {
                (Some(predicted), ..) => Ok(predicted),
                (None, Some(path), Some(others)) => {
                    let from: Vec<&Estimated> =
                        others.iter().filter_map(|&j| estimated.get(j)).collect();
                    let predicted = self.predicted(&records, maneuvers, i, &from);
                    self.store.save(path, &predicted)?;
                    Ok(predicted)
                }
                (None, _, Some(_)) => Ok(Predicted::none(
                    "no other maneuver of its class and angle of attack",
                    0,
                )),
                (None, _, None) => Ok(Predicted::none("its own fit did not converge", 0)),
            };
        let items: Vec<(usize, Option<Predicted>)> = present.into_iter().enumerate().collect();
        let predicted: Result<Vec<Predicted>> = items.into_par_iter().map(work).collect();
        campaign.predicted = predicted?;
        self.store.need(artefacts.iter().flatten());
        Ok(())
    }

    fn predicted(
        &self,
        records: &BTreeMap<usize, Record>,
        maneuvers: &[Maneuver],
        i: usize,
        from: &[&Estimated],
    ) -> Predicted {
        let class = self.config.class(&maneuvers[i].class);
        match (records.get(&i), class) {
            (Some(record), Some(class)) => {
                prediction::maneuver(record, &maneuvers[i], class, &self.context(), from)
            }
            _ => Predicted::none("the configuration has no such class", from.len()),
        }
    }

    /// Publishes what was estimated: the maneuvers' rows, then those of maneuvers estimated
    /// together.
    pub(crate) fn publish_estimates(&self, campaign: &Campaign) -> Result<()> {
        let joined = || campaign.joined.iter().map(|j| &j.estimated);
        let fits: Vec<FitRow> = campaign
            .fits
            .iter()
            .chain(joined().map(|e| &e.fit))
            .cloned()
            .collect();
        let estimates: Vec<EstimateRow> = campaign
            .estimates
            .iter()
            .chain(joined().flat_map(|e| &e.estimates))
            .cloned()
            .collect();
        let combined: Vec<EstimateRow> = campaign
            .combined
            .iter()
            .chain(joined().flat_map(|e| &e.combined))
            .cloned()
            .collect();
        let predicted: Vec<PredictedRow> = campaign
            .predicted
            .iter()
            .map(|p| p.summary.clone())
            .collect();
        let members: Vec<JointRow> = campaign
            .joined
            .iter()
            .flat_map(|j| &j.members)
            .cloned()
            .collect();
        let shelf = self.shelf(Stage::Estimate);
        table::publish_fits(&shelf, &fits, &predicted)?;
        table::publish(&shelf, &estimates)?;
        table::publish_as(&shelf, "combined", &combined)?;
        table::publish(&shelf, &members)?;
        table::publish(&shelf, &campaign.predictions())
    }
}

/// The parts of the records that hold these maneuvers.
fn parts(
    store: &Store,
    campaign: &Campaign,
    wanted: &BTreeSet<usize>,
) -> Result<BTreeMap<usize, Record>> {
    let of_flight = |id: &str| -> Vec<usize> {
        wanted
            .iter()
            .copied()
            .filter(|&i| campaign.maneuvers[i].flight_id == id)
            .collect()
    };
    let flights: Vec<_> = campaign
        .flights
        .iter()
        .map(|f| (f, of_flight(&f.flight_id)))
        .collect();
    let read = |(flight, wanted): &(&super::Flight, Vec<usize>)| -> Result<Vec<(usize, Record)>> {
        if wanted.is_empty() {
            return Ok(vec![]);
        }
        let record = flight.open(store)?;
        let part = |&i: &usize| {
            let maneuver = &campaign.maneuvers[i];
            Ok((i, record.part(None, maneuver.start_s, maneuver.end_s)?))
        };
        wanted.iter().map(part).collect()
    };
    let parts: Result<Vec<Vec<(usize, Record)>>> = flights.par_iter().map(read).collect();
    Ok(parts?.into_iter().flatten().collect())
}
