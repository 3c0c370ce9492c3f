//! Computation of a campaign in shards: dealing the work, one shard's share, missing items, and the
//! merge.
//!
//! Shards have only the store in common. An artefact is named by the fingerprint of everything that
//! decides it. A shard that runs twice, even at the same time, therefore makes the same bytes.
//! Artefacts of a killed shard stay valid. A merge is a run that finds all artefacts made.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use super::plan::{DealtKind, Item, Shard, ShardPlan, ShardWork, array};
use crate::config::Config;
use crate::error::{Error, Result};
use crate::flight::is_stretch;
use crate::lineage::{Lineage, Stage};
use crate::maneuver::{Maneuver, Status};
use crate::night::{RunOutcome, campaign_lineage, run};
use crate::pipeline::{AbsentArtefacts, Campaign, Conductor, Progress, load_or_make_maneuvers};
use crate::recorder::FlightCorrections;
use crate::store::archive::{self, FlightFiles};
use crate::store::files;
use crate::surfaces::DelayCorrection;

/// Reads a plan's file.
///
/// # Errors
/// [`Error::Config`] naming the file that cannot be read or is no valid plan.
pub fn read_plan(file: &Path) -> Result<ShardPlan> {
    ShardPlan::read(&files::text(file)?).map_err(|why| Error::config(file, None, why))
}

/// Deals the campaign's flights, or the maneuvers found in them, to shards, and writes the plan.
///
/// # Errors
/// No archive, a store in use; for maneuvers, flights that are not yet ingested and segmented.
pub fn deal(
    config: &Config,
    dealt: DealtKind,
    shards: usize,
    file: &Path,
    progress: &dyn Progress,
) -> Result<ShardPlan> {
    let archive = archive::find(&config.archive)?;
    let mut conductor = Conductor::open_shared(
        config,
        archive,
        AbsentArtefacts::Report,
        Duration::ZERO,
        progress,
    )?;
    conductor.remember_contents()?;
    let (work, delays, corrections) = match dealt {
        DealtKind::Flights => (flights(&conductor), vec![], vec![]),
        DealtKind::Maneuvers => maneuvers(&mut conductor)?,
    };
    let mut plan = ShardPlan::deal(dealt, shards, work, delays, &campaign_lineage(&conductor));
    plan.corrections = corrections;
    conductor.runner.store.check_transfers()?;
    files::place_text(file, &plan.text())?;
    Ok(plan)
}

/// Computes a shard's share into the store, as far as `until`, and returns the number of artefacts
/// that were made.
///
/// # Errors
/// The plan has another lineage; one of its flights cannot be read; the disk fails
/// ([`Error::is_transient`]).
pub fn compute(
    config: &Config,
    plan: &ShardPlan,
    shard: Shard,
    until: Stage,
    wait: Duration,
    progress: &dyn Progress,
) -> Result<usize> {
    if shard.of != plan.shards {
        let what = format!(
            "the plan deals to {} shards, not {}: give --shard i/{0}",
            plan.shards, shard.of
        );
        return Err(Error::config(&config.store, None, what));
    }
    let items: Vec<&Item> = plan.share(shard.number).collect();
    let flight_ids: BTreeSet<&str> = items.iter().map(|item| item.flight_id.as_str()).collect();
    let mut archive = archive::find(&config.archive)?;
    archive.retain(|f| flight_ids.contains(f.flight_id.as_str()));
    let conductor = Conductor::open_shared(config, archive, AbsentArtefacts::Make, wait, progress)?;
    check_lineage(plan, &conductor, Some(&flight_ids))?;
    let mut campaign = conductor.campaign(until.min(Stage::Segment))?;
    if let Some((flight, why)) = campaign.unread.first_key_value() {
        let what = format!("the flight could not be read: {why}");
        return Err(Error::store(Path::new(flight), &what));
    }
    match plan.of {
        DealtKind::Maneuvers => {
            campaign.correct_flights(&plan.corrections);
            estimate(&conductor, &campaign, plan, &items)?;
        }
        DealtKind::Flights if until >= Stage::Segment => conductor.surfaces(&mut campaign)?,
        DealtKind::Flights => {}
    }
    let store = &conductor.runner.store;
    store.send_unsent()?;
    Ok(store.made())
}

/// Items of a plan whose artefacts are missing.
///
/// # Errors
/// No archive, or the plan has another lineage.
pub fn missing_items(
    config: &Config,
    plan: &ShardPlan,
    progress: &dyn Progress,
) -> Result<BTreeSet<String>> {
    let conductor = Conductor::read_only(config, progress)?;
    check_lineage(plan, &conductor, None)?;
    let mut campaign = conductor.campaign(plan.of.last_stage())?;
    conductor.runner.store.check_transfers()?;
    let mut missing = |stage| -> Vec<String> {
        let artefacts = campaign.state(stage).missing.iter();
        artefacts.map(|artefact| artefact.item.clone()).collect()
    };
    let flights = [missing(Stage::Ingest), missing(Stage::Segment)].concat();
    let maneuvers: BTreeSet<String> = missing(Stage::Estimate).into_iter().collect();
    let is_missing = |item: &&Item| {
        maneuvers.contains(&item.id)
            || flights
                .iter()
                .any(|flight| is_stretch(flight, &item.flight_id))
    };
    let items = plan.items.iter().filter(is_missing);
    Ok(items.map(|item| item.id.clone()).collect())
}

/// Publishes the work of the shards of a plan of maneuvers.
///
/// # Errors
/// Missing artefacts, with the shards that lack them; otherwise the errors of [`run`].
pub fn merge(
    config: &Config,
    plan: &ShardPlan,
    wait: Duration,
    progress: &dyn Progress,
) -> Result<RunOutcome> {
    if plan.of != DealtKind::Maneuvers {
        let what = "a merge takes the plan of maneuvers (harvest plan --of maneuvers)";
        return Err(Error::config(&config.store, None, what));
    }
    let missing = missing_items(config, plan, progress)?;
    if !missing.is_empty() {
        let shards = array(&plan.shards_of(&missing));
        let (count, all) = (missing.len(), plan.items.len());
        let what =
            format!("{count} of {all} maneuvers are missing, of shards {shards}: run these shards");
        return Err(Error::config(&config.store, None, what));
    }
    run(config, Stage::Report, wait, progress)
}

/// Checks that a plan has the lineage of this archive, configuration and code; with `flights`, only
/// of these flights.
fn check_lineage(
    plan: &ShardPlan,
    conductor: &Conductor,
    flights: Option<&BTreeSet<&str>>,
) -> Result<()> {
    let mut planned: Lineage = plan.lineage.clone();
    let mut now = campaign_lineage(conductor).until(plan.of.last_stage());
    if let Some(flights) = flights {
        planned
            .flights
            .retain(|id, _| flights.contains(id.as_str()));
        // Copies that were left out are listed for the whole archive.
        now.flights.retain(|id, _| planned.flights.contains_key(id));
    }
    let causes = now.differences(&planned);
    if causes.is_empty() {
        return Ok(());
    }
    let words: Vec<String> = causes.into_iter().map(|cause| cause.words).collect();
    let what = format!(
        "the plan does not match: since then {}; plan again",
        words.join("; ")
    );
    Err(Error::config(&conductor.runner.config.store, None, what))
}

/// Every flight whose files can be read, at the cost of its bytes.
fn flights(conductor: &Conductor) -> Vec<ShardWork> {
    let contents = &conductor.runner.contents;
    let bytes = |file: &FlightFiles| -> f64 {
        let digests = file.files.iter().filter_map(|path| contents.of(path).ok());
        digests.map(|digest| digest.bytes as f64).sum()
    };
    let is_readable = |file: &&FlightFiles| {
        conductor
            .flight_contents
            .fingerprint(&file.flight_id)
            .is_ok()
    };
    let work = |file: &FlightFiles| ShardWork {
        id: file.flight_id.clone(),
        flight_id: file.flight_id.clone(),
        cost: bytes(file),
    };
    let readable = conductor.archive.iter().filter(is_readable);
    readable.map(work).collect()
}

/// Work on maneuvers, with the corrections that all flights together decide.
type ManeuverWork = (Vec<ShardWork>, Vec<DelayCorrection>, Vec<FlightCorrections>);

/// Lists the maneuvers of the campaign as work for shards, with the corrections of surfaces and
/// instruments, which need the evidence of all flights.
fn maneuvers(conductor: &mut Conductor) -> Result<ManeuverWork> {
    let config = conductor.runner.config;
    let mut campaign = conductor.campaign(Stage::Segment)?;
    let mut missing: BTreeSet<String> = BTreeSet::new();
    for stage in [Stage::Ingest, Stage::Segment] {
        let artefacts = campaign.state(stage).missing.iter();
        missing.extend(artefacts.map(|artefact| artefact.item.clone()));
    }
    if let Some(first) = missing.first() {
        let what = format!(
            "{} flights are not ingested and segmented, {first} first: run their shards",
            missing.len()
        );
        return Err(Error::config(&config.store, None, what));
    }
    // The shards of the flights have made the evidence, but for rows that two flights share.
    conductor.runner.absent = AbsentArtefacts::Make;
    conductor.surfaces(&mut campaign)?;
    let work = |m: &Maneuver| {
        let mut archive = conductor.archive.iter();
        let file = archive.find(|f| is_stretch(&m.flight_id, &f.flight_id))?;
        Some(ShardWork {
            id: m.maneuver_id.clone(),
            flight_id: file.flight_id.clone(),
            cost: cost(config, m),
        })
    };
    let work = campaign.maneuvers.iter().filter_map(work).collect();
    Ok((work, campaign.delays, campaign.flight_corrections))
}

/// Cost of estimating a maneuver: samples times the square of the parameters.
fn cost(config: &Config, maneuver: &Maneuver) -> f64 {
    let statuses = config.class(&maneuver.class).map(|c| c.statuses.values());
    let estimated = statuses
        .into_iter()
        .flatten()
        .filter(|status| **status == Status::Estimated)
        .count();
    maneuver.samples as f64 * (1.0 + estimated as f64).powi(2)
}

/// Estimates the maneuvers of a shard.
fn estimate(
    conductor: &Conductor,
    campaign: &Campaign,
    plan: &ShardPlan,
    items: &[&Item],
) -> Result<()> {
    let by_id: BTreeMap<&str, &Maneuver> = campaign
        .maneuvers
        .iter()
        .map(|m| (m.maneuver_id.as_str(), m))
        .collect();
    let maneuver = |item: &&Item| {
        by_id.get(item.id.as_str()).copied().ok_or_else(|| {
            let what = format!(
                "the plan's maneuver `{}` is not found in its flight: plan again",
                item.id
            );
            Error::config(&conductor.runner.config.store, None, what)
        })
    };
    let maneuvers: Result<Vec<&Maneuver>> = items.iter().map(maneuver).collect();
    load_or_make_maneuvers(
        &conductor.runner,
        &campaign.flights,
        &maneuvers?,
        &plan.delays,
    )
    .map(|_| ())
}
