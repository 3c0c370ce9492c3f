//! A campaign in shards: what a plan deals, what of it is missing, a shard's work, the merge of
//! all.
//!
//! Shards share nothing but the store. An artefact is named by what decides it, so a shard that
//! runs twice, even at the same time, finds or makes the same bytes; a shard that died leaves what
//! it had done. A merge is a run that finds everything made.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use rayon::prelude::*;

use crate::cluster::plan::{self, Item, Of, Plan, Shard};
use crate::config::Config;
use crate::error::{Error, Result};
use crate::flight::is_stretch;
use crate::lineage::Stage;
use crate::maneuver::{Maneuver, Status};
use crate::night::publish::Done;
use crate::night::{self, status};
use crate::pipeline::{Campaign, Flight, Progress, Run};
use crate::store::archive::{self, FlightFiles};
use crate::store::{Store, files};

/// Reads a plan's file.
///
/// # Errors
/// [`Error::Config`] naming the file: it cannot be read, or is no plan to work by.
pub fn read(file: &Path) -> Result<Plan> {
    Plan::read(&files::text(file)?).map_err(|why| Error::config(file, None, why))
}

/// Deals the campaign's flights, or the maneuvers found in them, to shards, and writes the plan.
///
/// # Errors
/// No archive, a store in use; for maneuvers, flights that are not yet ingested and segmented.
pub fn plan(
    config: &Config,
    of: Of,
    shards: usize,
    file: &Path,
    progress: &dyn Progress,
) -> Result<Plan> {
    let files = archive::find(&config.archive)?;
    let run = join(config, &files, Duration::ZERO, progress)?;
    run.store.remember(&run.contents)?;
    let items = match of {
        Of::Flights => run.flights(&files),
        Of::Maneuvers => run.maneuvers(&files)?,
    };
    let plan = Plan::deal(of, shards, items, &run.lineage);
    run.store.check()?;
    files::place_text(file, &plan.text())?;
    Ok(plan)
}

/// Computes a shard's share into the store, as far as `until`; how many artefacts were made for it.
///
/// # Errors
/// The plan is of something else; a flight of it cannot be read; the disk says no
/// ([`Error::is_transient`]).
pub fn work(
    config: &Config,
    plan: &Plan,
    shard: Shard,
    until: Stage,
    wait: Duration,
    progress: &dyn Progress,
) -> Result<usize> {
    if shard.of != plan.shards {
        return Err(Error::config(
            &config.store,
            None,
            format!(
                "the plan deals to {} shards, not {}: give --shard i/{0}",
                plan.shards, shard.of
            ),
        ));
    }
    let items: Vec<&Item> = plan.share(shard.number).collect();
    let wanted: BTreeSet<&str> = items.iter().map(|item| item.flight_id.as_str()).collect();
    let mut files = archive::find(&config.archive)?;
    files.retain(|f| wanted.contains(f.flight_id.as_str()));
    let run = join(config, &files, wait, progress)?;
    run.is_of(plan, Some(&wanted))?;
    let mut campaign = Campaign::default();
    run.ingest(&files, &mut campaign)?;
    if let Some((flight, why)) = campaign.unread.first_key_value() {
        return Err(Error::store(
            Path::new(flight),
            &format!("the flight could not be read: {why}"),
        ));
    }
    if until >= Stage::Segment {
        run.segment(&mut campaign)?;
    }
    if plan.of == Of::Maneuvers {
        run.share(&campaign, &items)?;
    }
    run.store.send_rest()?;
    Ok(run.store.made())
}

/// The items of a plan that are not in the store.
///
/// # Errors
/// No archive, or the plan is of something else.
pub fn missing(config: &Config, plan: &Plan, progress: &dyn Progress) -> Result<BTreeSet<String>> {
    let files = archive::find(&config.archive)?;
    let store = Store::look(&config.store).sharing(config.shared_store.as_deref())?;
    let run = Run::of_store(config, store, &files, progress)?;
    run.is_of(plan, None)?;
    let missing = run.missing(plan, &files);
    run.store.check()?;
    Ok(missing)
}

/// Publishes what the shards of a plan of maneuvers computed: a run that finds everything made.
///
/// # Errors
/// Something is missing, named by shard; or as [`crate::night::run`].
pub fn merge(
    config: &Config,
    plan: &Plan,
    wait: Duration,
    progress: &dyn Progress,
) -> Result<Done> {
    if plan.of != Of::Maneuvers {
        return Err(Error::config(
            &config.store,
            None,
            "a merge takes the plan of maneuvers (harvest plan --of maneuvers)",
        ));
    }
    let missing = missing(config, plan, progress)?;
    if !missing.is_empty() {
        let shards = plan::array(&plan.shards_of(&missing));
        let count = missing.len();
        let what = format!(
            "{count} of {} maneuvers are missing, of shards {shards}: run these shards",
            plan.items.len()
        );
        return Err(Error::config(&config.store, None, what));
    }
    night::run(config, Stage::Report, wait, progress)
}

/// A run that adds to the store beside others and publishes nothing.
fn join<'a>(
    config: &'a Config,
    files: &[FlightFiles],
    wait: Duration,
    progress: &'a dyn Progress,
) -> Result<Run<'a>> {
    let store = Store::join(&config.store, wait)?.sharing(config.shared_store.as_deref())?;
    Run::of_store(config, store, files, progress)
}

impl Run<'_> {
    /// Whether a plan is of this archive, configuration and code; of the archive, only these
    /// flights where some are named.
    fn is_of(&self, plan: &Plan, flights: Option<&BTreeSet<&str>>) -> Result<()> {
        let mut planned = plan.lineage.clone();
        if let Some(flights) = flights {
            planned
                .flights
                .retain(|id, _| flights.contains(id.as_str()));
        }
        let mut now = self.lineage.until(plan.of.stage());
        if flights.is_some() {
            // Copies that were left out are the whole archive's affair.
            now.flights.retain(|id, _| planned.flights.contains_key(id));
        }
        let differences: Vec<String> = now
            .differences(&planned)
            .into_iter()
            .map(|cause| cause.words)
            .collect();
        if differences.is_empty() {
            return Ok(());
        }
        let what = format!(
            "the plan is of something else: since then {}; plan again",
            differences.join("; ")
        );
        Err(Error::config(&self.config.store, None, what))
    }

    /// Every flight whose files can be read, at the cost of its bytes.
    fn flights(&self, files: &[FlightFiles]) -> Vec<(String, String, f64)> {
        let bytes = |file: &FlightFiles| -> f64 {
            file.files
                .iter()
                .map(|path| {
                    self.contents
                        .of(path)
                        .map_or(0.0, |content| content.bytes as f64)
                })
                .sum()
        };
        let readable = files
            .iter()
            .filter(|file| self.inputs.content(&file.flight_id).is_ok());
        readable
            .map(|file| (file.flight_id.clone(), file.flight_id.clone(), bytes(file)))
            .collect()
    }

    /// Every maneuver of the campaign: a pass costs samples times the square of the parameters.
    fn maneuvers(&self, files: &[FlightFiles]) -> Result<Vec<(String, String, f64)>> {
        let (campaign, [ingest, segment]) = self.looked(files);
        let stale: BTreeSet<&String> = [&ingest, &segment]
            .iter()
            .flat_map(|s| s.stale.values().flatten())
            .collect();
        if let Some(first) = stale.first() {
            let what = format!(
                "{} flights are not ingested and segmented, {first} first: run their shards",
                stale.len()
            );
            return Err(Error::config(&self.config.store, None, what));
        }
        let cost = |m: &Maneuver| {
            let free = self.config.class(&m.class).map_or(0, |c| {
                c.statuses
                    .values()
                    .filter(|s| **s == Status::Estimated)
                    .count()
            });
            m.samples as f64 * (1.0 + free as f64).powi(2)
        };
        let item = |m: &Maneuver| {
            let file = files
                .iter()
                .find(|f| is_stretch(&m.flight_id, &f.flight_id))?;
            Some((m.maneuver_id.clone(), file.flight_id.clone(), cost(m)))
        };
        Ok(campaign.maneuvers.iter().filter_map(item).collect())
    }

    /// What the store has of ingest and segment.
    fn looked(&self, files: &[FlightFiles]) -> (Campaign, [status::StageStatus; 2]) {
        let mut campaign = Campaign::default();
        let ingest = self.ingest_status(files, &mut campaign, None);
        let segment = self.segment_status(&ingest, &mut campaign, None);
        (campaign, [ingest, segment])
    }

    fn missing(&self, plan: &Plan, files: &[FlightFiles]) -> BTreeSet<String> {
        let (campaign, looked) = self.looked(files);
        let stale = |status: &status::StageStatus| {
            status
                .stale
                .values()
                .flatten()
                .cloned()
                .collect::<Vec<String>>()
        };
        let unfinished: Vec<String> = looked.iter().flat_map(stale).collect();
        let unestimated: BTreeSet<String> = match plan.of {
            Of::Flights => BTreeSet::new(),
            Of::Maneuvers => stale(&self.estimate_status(&campaign, None))
                .into_iter()
                .collect(),
        };
        let is_missing = |item: &&Item| {
            unestimated.contains(&item.id)
                || unfinished
                    .iter()
                    .any(|stretch| is_stretch(stretch, &item.flight_id))
        };
        plan.items
            .iter()
            .filter(is_missing)
            .map(|item| item.id.clone())
            .collect()
    }

    /// Estimates the maneuvers of a shard.
    fn share(&self, campaign: &Campaign, items: &[&Item]) -> Result<()> {
        let found: BTreeMap<&str, &Maneuver> = campaign
            .maneuvers
            .iter()
            .map(|m| (m.maneuver_id.as_str(), m))
            .collect();
        if let Some(lost) = items
            .iter()
            .find(|item| !found.contains_key(item.id.as_str()))
        {
            let what = format!(
                "the plan's maneuver `{}` is not found in its flight: plan again",
                lost.id
            );
            return Err(Error::config(&self.config.store, None, what));
        }
        let mine: BTreeSet<&str> = items.iter().map(|item| item.id.as_str()).collect();
        let of_flight = |flight: &Flight| -> Vec<&Maneuver> {
            let own = campaign
                .maneuvers
                .iter()
                .filter(|m| m.flight_id == flight.flight_id);
            own.filter(|m| mine.contains(m.maneuver_id.as_str()))
                .collect()
        };
        self.progress.begin("estimate", items.len());
        let done = campaign
            .flights
            .par_iter()
            .try_for_each(|f| self.estimate_flight(f, &of_flight(f)).map(|_| ()));
        self.progress.end();
        done
    }
}
