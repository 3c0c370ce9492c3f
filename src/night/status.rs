//! What a run would do: per stage what is fresh, what is stale and why, what failed and why.
//! Nothing is changed.

use std::collections::BTreeMap;

use crate::config::Config;
use crate::error::Result;
use crate::estimate::Estimated;
use crate::flight::is_stretch;
use crate::lineage::{Lineage, Origin, Stage};
use crate::output_error::Outcome;
use crate::pipeline::{Campaign, Progress, Run, inputs, stretches};
use crate::store::archive::{self, FlightFiles};
use crate::store::{Nights, Store};

/// One stage: items are flights as far as segment, then maneuvers, then the whole campaign.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StageStatus {
    pub stage: Stage,
    pub fresh: usize,
    /// Of the fresh ones, those that failed; with the item and the reason.
    pub failed: Vec<(String, String)>,
    /// What a run would make, by the reason.
    pub stale: BTreeMap<String, Vec<String>>,
}

impl StageStatus {
    fn new(stage: Stage) -> StageStatus {
        StageStatus {
            stage,
            fresh: 0,
            failed: Vec::new(),
            stale: BTreeMap::new(),
        }
    }

    fn stale(&mut self, why: &str, item: &str) {
        self.stale
            .entry(why.to_owned())
            .or_default()
            .push(item.to_owned());
    }
}

/// The state of a pipeline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Status {
    /// The night that holds.
    pub night: Option<String>,
    pub stages: Vec<StageStatus>,
}

impl Status {
    #[must_use]
    pub fn is_fresh(&self) -> bool {
        self.stages.iter().all(|s| s.stale.is_empty())
    }

    #[must_use]
    pub fn failed(&self) -> bool {
        self.stages.iter().any(|s| !s.failed.is_empty())
    }
}

/// Looks at every stage.
///
/// # Errors
/// There is no archive.
pub fn status(config: &Config, progress: &dyn Progress) -> Result<Status> {
    let files = archive::find(&config.archive)?;
    let store = Store::look(&config.store).sharing(config.shared_store.as_deref())?;
    let run = Run::of_store(config, store, &files, progress)?;
    let nights = Nights::look(&config.reports);
    let current = nights.current();
    let before = current.as_ref().map(|night| &night.lineage);
    let mut campaign = Campaign::default();
    let ingest = run.ingest_status(&files, &mut campaign, before);
    let segment = run.segment_status(&ingest, &mut campaign, before);
    let mut estimate = run.estimate_status(&campaign, before);
    let there = run.store.artefacts();
    let needed = current.iter().flat_map(|night| night.artefacts.keys());
    for gone in needed.filter(|name| !there.contains_key(*name)) {
        estimate.stale("it is gone from the store", gone);
    }
    let mut stages = vec![ingest, segment, estimate];
    for stage in [Stage::Trend, Stage::Compare, Stage::Report] {
        let mut status = StageStatus::new(stage);
        let upstream = stages.iter().any(|s: &StageStatus| !s.stale.is_empty());
        let held = current.as_ref().filter(|night| night.until >= stage);
        let changed = held.map(|night| {
            run.lineage
                .until(stage)
                .differences(&night.lineage.until(stage))
        });
        match changed {
            None => status.stale("no night with it has been published", &config.name),
            Some(causes) if !causes.is_empty() => {
                for cause in &causes {
                    status.stale(&cause.words, &config.name);
                }
            }
            Some(_) if upstream => status.stale("an earlier stage is stale", &config.name),
            Some(_) => status.fresh = 1,
        }
        stages.push(status);
    }
    Ok(Status {
        night: current.map(|night| night.name),
        stages,
    })
}

impl Run<'_> {
    /// Why something of a flight is not in the store.
    fn why(
        &self,
        stage: Stage,
        flight_id: &str,
        class: Option<&str>,
        before: Option<&Lineage>,
    ) -> String {
        let Some(before) = before else {
            return "not made yet".to_owned();
        };
        let counts = |c: &&crate::lineage::Cause| {
            if c.origin == Origin::Flight {
                return is_stretch(flight_id, &c.subject);
            }
            let mut path = c.subject.split('.');
            let of_class = path.next() == Some("classes");
            c.stage <= stage && (!of_class || class.is_none_or(|class| path.next() == Some(class)))
        };
        let causes = self.lineage.differences(before);
        let words: Vec<&str> = causes
            .iter()
            .filter(counts)
            .map(|c| c.words.as_str())
            .collect();
        if words.is_empty() {
            "its artefact is missing or damaged".to_owned()
        } else {
            words.join("; ")
        }
    }

    pub(crate) fn ingest_status(
        &self,
        files: &[FlightFiles],
        campaign: &mut Campaign,
        before: Option<&Lineage>,
    ) -> StageStatus {
        let mut status = StageStatus::new(Stage::Ingest);
        for file in files {
            let id = &file.flight_id;
            match self
                .inputs
                .content(id)
                .map(|content| self.ingested(id, content))
            {
                Err(reason) => status
                    .failed
                    .push((id.clone(), format!("{}: {reason}", inputs::place(file)))),
                Ok(Some(conditioned)) => {
                    status.fresh += 1;
                    campaign.flights.extend(conditioned.stretches);
                }
                Ok(None) => status.stale(&self.why(Stage::Ingest, id, None, before), id),
            }
        }
        stretches::same_rows(campaign);
        for flight in campaign.flights.iter().filter(|f| !f.ingested.accepted) {
            let reasons = flight
                .ingested
                .problems
                .iter()
                .map(|p| format!("{}: {}", p.place, p.reason));
            status.failed.push((
                flight.flight_id.clone(),
                reasons.collect::<Vec<_>>().join("; "),
            ));
        }
        status
    }

    pub(crate) fn segment_status(
        &self,
        ingest: &StageStatus,
        campaign: &mut Campaign,
        before: Option<&Lineage>,
    ) -> StageStatus {
        let mut status = StageStatus::new(Stage::Segment);
        for id in ingest.stale.values().flatten() {
            status.stale("its flight is stale", id);
        }
        let mut maneuvers = Vec::new();
        for flight in campaign.flights.iter().filter(|f| f.ingested.accepted) {
            let id = &flight.flight_id;
            let Some((_, found)) = self.segmented(flight) else {
                status.stale(&self.why(Stage::Segment, id, None, before), id);
                continue;
            };
            status.fresh += 1;
            let failed = found
                .problems
                .into_iter()
                .map(|p| (p.flight_id, format!("{}: {}", p.place, p.reason)));
            status.failed.extend(failed);
            maneuvers.extend(found.maneuvers);
        }
        campaign.maneuvers = maneuvers;
        stretches::leave_out_same(campaign);
        status
    }

    pub(crate) fn estimate_status(
        &self,
        campaign: &Campaign,
        before: Option<&Lineage>,
    ) -> StageStatus {
        let mut status = StageStatus::new(Stage::Estimate);
        for maneuver in &campaign.maneuvers {
            let id = &maneuver.maneuver_id;
            let flight = campaign
                .flights
                .iter()
                .find(|f| f.flight_id == maneuver.flight_id);
            let estimated = flight.and_then(|f| {
                self.store
                    .load::<Estimated>(&self.estimate_path(f, maneuver))
            });
            if let Some(Estimated { fit, .. }) = estimated {
                status.fresh += 1;
                if fit.outcome != Outcome::Converged {
                    status
                        .failed
                        .push((id.clone(), format!("{}: {}", fit.outcome, fit.reason)));
                }
            } else {
                let why = self.why(
                    Stage::Estimate,
                    &maneuver.flight_id,
                    Some(&maneuver.class),
                    before,
                );
                status.stale(&why, id);
            }
        }
        status
    }
}
