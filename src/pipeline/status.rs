//! What a run would do: per stage what is fresh, what is stale and why, what failed and why. Nothing is changed.

use std::collections::BTreeMap;

use super::{Flight, Found, Progress, Run, Stage, inputs};
use crate::config::Config;
use crate::error::Result;
use crate::estimate::Estimated;
use crate::lineage::{Lineage, Origin};
use crate::maneuver::Maneuver;
use crate::output_error::Outcome;
use crate::store::archive::{self, FlightFiles};
use crate::store::{Contents, Nights, Store};

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
        StageStatus { stage, fresh: 0, failed: Vec::new(), stale: BTreeMap::new() }
    }

    fn stale(&mut self, why: &str, item: &str) {
        self.stale.entry(why.to_owned()).or_default().push(item.to_owned());
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
    let contents = Contents::load(&config.store.join("contents.json"));
    let run = Run::new(config, Store::look(&config.store), contents, &files, progress);
    let nights = Nights::look(&config.reports);
    let current = nights.current();
    let before = current.as_ref().map(|night| &night.lineage);
    let (ingest, flights) = run.ingest_status(&files, before);
    let (segment, maneuvers) = run.segment_status(&flights, before);
    let estimate = run.estimate_status(&maneuvers, before);
    let mut stages = vec![ingest, segment, estimate];
    for stage in [Stage::Trend, Stage::Compare, Stage::Report] {
        let mut status = StageStatus::new(stage);
        let upstream = stages.iter().any(|s: &StageStatus| !s.stale.is_empty());
        let held = current.as_ref().filter(|night| night.until >= stage);
        let changed = held.map(|night| run.lineage.until(stage).differences(&night.lineage.until(stage)));
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
    Ok(Status { night: current.map(|night| night.name), stages })
}

impl Run<'_> {
    /// Why something of a flight is not in the store.
    fn why(&self, stage: Stage, flight_id: &str, class: Option<&str>, before: Option<&Lineage>) -> String {
        let Some(before) = before else { return "not made yet".to_owned() };
        let counts = |c: &&crate::lineage::Cause| {
            if c.origin == Origin::Flight {
                return c.subject == flight_id;
            }
            let mut path = c.subject.split('.');
            let of_class = path.next() == Some("classes");
            c.stage <= stage && (!of_class || class.is_none_or(|class| path.next() == Some(class)))
        };
        let causes = self.lineage.differences(before);
        let words: Vec<&str> = causes.iter().filter(counts).map(|c| c.words.as_str()).collect();
        if words.is_empty() { "its artefact is missing or damaged".to_owned() } else { words.join("; ") }
    }

    fn ingest_status(&self, files: &[FlightFiles], before: Option<&Lineage>) -> (StageStatus, Vec<Option<Flight>>) {
        let mut status = StageStatus::new(Stage::Ingest);
        let mut flights = Vec::new();
        for file in files {
            let id = &file.flight_id;
            match self.inputs.content(id).map(|content| self.ingested(id, content)) {
                Err(reason) => status.failed.push((id.clone(), format!("{}: {reason}", inputs::place(file)))),
                Ok(Some(flight)) => {
                    status.fresh += 1;
                    if !flight.ingested.accepted {
                        let reasons = flight.ingested.problems.iter().map(|p| format!("{}: {}", p.place, p.reason));
                        status.failed.push((id.clone(), reasons.collect::<Vec<_>>().join("; ")));
                    }
                    flights.push(Some(flight));
                }
                Ok(None) => {
                    status.stale(&self.why(Stage::Ingest, id, None, before), id);
                    flights.push(None);
                }
            }
        }
        (status, flights)
    }

    fn segment_status(
        &self,
        flights: &[Option<Flight>],
        before: Option<&Lineage>,
    ) -> (StageStatus, Vec<(Flight, Maneuver)>) {
        let mut status = StageStatus::new(Stage::Segment);
        let mut maneuvers = Vec::new();
        for flight in flights {
            let Some(flight) = flight else {
                status.stale("its flight is stale", "a flight");
                continue;
            };
            if !flight.ingested.accepted {
                continue;
            }
            match self.store.load::<Found>(&self.segment_path(flight)) {
                Some(found) => {
                    status.fresh += 1;
                    status.failed.extend(
                        found.problems.into_iter().map(|p| (p.flight_id, format!("{}: {}", p.place, p.reason))),
                    );
                    maneuvers.extend(found.maneuvers.into_iter().map(|m| (flight.clone(), m)));
                }
                None => {
                    status.stale(&self.why(Stage::Segment, &flight.flight_id, None, before), &flight.flight_id);
                }
            }
        }
        (status, maneuvers)
    }

    fn estimate_status(&self, maneuvers: &[(Flight, Maneuver)], before: Option<&Lineage>) -> StageStatus {
        let mut status = StageStatus::new(Stage::Estimate);
        for (flight, maneuver) in maneuvers {
            let id = &maneuver.maneuver_id;
            if let Some(estimated) = self.store.load::<Estimated>(&self.estimate_path(flight, maneuver)) {
                status.fresh += 1;
                if estimated.fit.outcome != Outcome::Converged.name() {
                    let fit = estimated.fit;
                    status.failed.push((id.clone(), format!("{}: {}", fit.outcome, fit.reason)));
                }
            } else {
                let why = self.why(Stage::Estimate, &maneuver.flight_id, Some(&maneuver.class), before);
                status.stale(&why, id);
            }
        }
        status
    }
}
