//! Status: fresh, stale and failed artefacts of each stage, with the reasons. Nothing is changed.

use std::collections::{BTreeMap, BTreeSet};

use super::campaign_lineage::campaign_lineage;
use crate::config::Config;
use crate::error::Result;
use crate::flight::is_stretch;
use crate::lineage::{Cause, Lineage, Origin, Stage};
use crate::pipeline::{Campaign, Conductor, Failure, MissingArtefact, Progress, StageState};
use crate::store::{self, ArtefactName, InWork, Night, Nights};

/// Status of one stage. Its items are flights as far as segment, maneuvers and groups in estimate,
/// then the whole campaign.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StageStatus {
    pub stage: Stage,
    /// Number of items that are up to date.
    pub fresh: usize,
    /// Items that were rejected.
    pub failed: Vec<Failure>,
    /// Items that a run would make, by the reason.
    pub stale: BTreeMap<String, Vec<String>>,
}

impl StageStatus {
    fn new(stage: Stage, state: StageState) -> StageStatus {
        StageStatus {
            stage,
            fresh: state.fresh,
            failed: state.failed,
            stale: BTreeMap::new(),
        }
    }

    fn add_stale(&mut self, reason: &str, item: &str) {
        let items = self.stale.entry(reason.to_owned()).or_default();
        items.push(item.to_owned());
    }
}

/// Status of a pipeline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NightStatus {
    /// Name of the current night.
    pub night: Option<String>,
    /// Name of the current night, if its manifest is missing or damaged.
    pub damaged_night: Option<String>,
    pub stages: Vec<StageStatus>,
    /// Flights that a run has in work at this moment, and since when.
    pub in_work: InWork,
}

impl NightStatus {
    #[must_use]
    pub fn is_fresh(&self) -> bool {
        self.stages.iter().all(|s| s.stale.is_empty())
    }

    #[must_use]
    pub fn has_failures(&self) -> bool {
        self.stages.iter().any(|s| !s.failed.is_empty())
    }
}

/// Compares the store and the current night with what a run would make.
///
/// # Errors
/// There is no archive.
pub fn status(config: &Config, progress: &dyn Progress) -> Result<NightStatus> {
    let conductor = Conductor::read_only(config, progress)?;
    let mut campaign = conductor.campaign(Stage::Estimate)?;
    let comparison = LineageComparison {
        lineage: campaign_lineage(&conductor),
        current: Nights::read_only(&config.reports).current(),
    };
    let mut stages: Vec<StageStatus> = [Stage::Ingest, Stage::Segment, Stage::Estimate]
        .into_iter()
        .map(|stage| comparison.step_stage(stage, &mut campaign))
        .collect();
    if let [ingest, segment, estimate] = stages.as_mut_slice() {
        for flight in ingest.stale.values().flatten() {
            segment.add_stale("its flight is stale", flight);
        }
        for name in comparison.lost_artefacts(&conductor) {
            estimate.add_stale("it is gone from the store", name.as_str());
        }
    }
    let made_anew = [
        Stage::Model,
        Stage::Trend,
        Stage::Qualities,
        Stage::Match,
        Stage::Compare,
        Stage::Report,
    ];
    for stage in made_anew {
        let is_upstream_stale = stages.iter().any(|s| !s.stale.is_empty());
        stages.push(comparison.whole_stage(stage, &config.name, is_upstream_stale));
    }
    Ok(NightStatus {
        night: comparison.current.map(|night| night.name),
        damaged_night: Nights::read_only(&config.reports).damaged_current(),
        stages,
        in_work: store::in_work(&config.store),
    })
}

/// Comparison of today's lineage with the current night.
struct LineageComparison {
    lineage: Lineage,
    current: Option<Night>,
}

impl LineageComparison {
    /// Status of a stage whose artefacts the store keeps.
    fn step_stage(&self, stage: Stage, campaign: &mut Campaign) -> StageStatus {
        let state = std::mem::take(campaign.state(stage));
        let missing = state.missing.clone();
        let mut status = StageStatus::new(stage, state);
        for artefact in &missing {
            status.add_stale(&self.reason(stage, artefact), &artefact.item);
        }
        status
    }

    /// Status of a stage that is made anew each time, for the whole campaign.
    fn whole_stage(&self, stage: Stage, item: &str, is_upstream_stale: bool) -> StageStatus {
        let mut status = StageStatus::new(stage, StageState::default());
        let current = self.current.as_ref().filter(|night| night.until >= stage);
        let Some(night) = current else {
            status.add_stale("no night with it has been published", item);
            return status;
        };
        let now = self.lineage.until(stage);
        let causes = now.differences(&night.lineage.until(stage));
        for cause in &causes {
            status.add_stale(&cause.words, item);
        }
        if causes.is_empty() && is_upstream_stale {
            status.add_stale("an earlier stage is stale", item);
        }
        status.fresh = usize::from(status.stale.is_empty());
        status
    }

    /// Artefacts of the current night that the store has lost, besides those that the stages report
    /// missing.
    fn lost_artefacts(&self, conductor: &Conductor) -> BTreeSet<ArtefactName> {
        let stored = conductor.runner.store.artefacts();
        let missing = conductor.runner.missing();
        let of_night = self.current.iter().flat_map(|night| night.artefacts.keys());
        of_night
            .filter(|name| !stored.contains_key(*name) && !missing.contains(*name))
            .cloned()
            .collect()
    }

    /// Reason that the store lacks an artefact.
    fn reason(&self, stage: Stage, artefact: &MissingArtefact) -> String {
        let Some(current) = &self.current else {
            return "not made yet".to_owned();
        };
        let causes = self.lineage.differences(&current.lineage);
        let reaching = causes.iter().filter(|c| reaches(c, stage, artefact));
        let words: Vec<&str> = reaching.map(|c| c.words.as_str()).collect();
        if words.is_empty() {
            "its artefact is missing or damaged".to_owned()
        } else {
            words.join("; ")
        }
    }
}

/// `true` if a cause may have changed an artefact of a stage.
fn reaches(cause: &Cause, stage: Stage, artefact: &MissingArtefact) -> bool {
    if cause.origin == Origin::Flight {
        return artefact.flight_id.is_empty() || is_stretch(&artefact.flight_id, &cause.subject);
    }
    let mut path = cause.subject.split('.');
    let is_of_other_class = path.next() == Some("classes")
        && artefact
            .class
            .as_deref()
            .is_some_and(|class| path.next() != Some(class));
    cause.stage <= stage && !is_of_other_class
}
