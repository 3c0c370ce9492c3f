//! The next flight: posterior, cards and goals read, the plan made and published.

use std::path::{Path, PathBuf};
use std::time::Duration;

use rayon::prelude::*;

use super::candidate::{CandidateCard, candidates, reach_deg};
use super::choice::Budget;
use super::experience::CampaignHistory;
use super::goal_file;
use super::goal_points::{GoalBasis, Matches};
use super::goals::{Goal, GoalSubject};
use super::kneeboard;
use super::plan::{CampaignState, Plan, Rehearsal, plan};
use super::rehearsal::{self, RehearsalBasis};
use crate::config::Config;
use crate::drawing_cache::DrawingCache;
use crate::error::{Error, Problem, Result};
use crate::lab::campaign::TestCards;
use crate::lineage::Stage;
use crate::night::{campaign_lineage, shelf_of_stage};
use crate::pdf;
use crate::pipeline::{Campaign, Conductor, Progress, decisive_differences, evidence, flown_means};
use crate::proof_of_match::of_posterior;
use crate::qualities::{self, FlownConditions};
use crate::store::table::TableFolder;
use crate::store::{atomic, files, table};

/// Published files of the page.
const PAGE: &str = "kneeboard.html";
const PRINTED_PAGE: &str = "kneeboard.pdf";

/// Request for a plan.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// Test cards, YAML.
    pub cards: &'a Path,
    /// Goals, YAML; without them every quantity of the posterior is one.
    pub goals: Option<&'a Path>,
    /// Flight time.
    pub minutes: f64,
}

/// The plan of the next flight as published.
#[derive(Clone, Debug)]
pub struct PlannedFlight {
    pub plan: Plan,
    pub files: Vec<PathBuf>,
    /// Problems of the campaign.
    pub problems: Vec<Problem>,
}

/// Plans the next flight from the posterior, which is brought up to date first, waiting up to `wait`
/// for another run to leave the store. Writes tables and page into a folder. The published night stays
/// as it is.
///
/// # Errors
/// A fault that stops the run, or a mistake in the cards or goals.
pub fn plan_next_flight(
    config: &Config,
    request: &Request,
    folder: &Path,
    wait: Duration,
    progress: &dyn Progress,
) -> Result<PlannedFlight> {
    let cards = read_cards(config, request.cards)?;
    let conductor = Conductor::open(config, wait, progress)?;
    let campaign = conductor.campaign(Stage::Model)?;
    let goals = goal_file::read(request.goals, config, &campaign.model)?;
    let specification = config.qualities.as_ref();
    let qualities = specification.map(|specification| qualities::JudgedAircraft {
        model: &campaign.model,
        aircraft: &config.aircraft,
        aero_model: &config.aero_model,
        tunnel: &config.tunnel,
        specification,
    });
    let conditions = FlownConditions::new(&flown_means(&campaign), &config.tunnel);
    let qualities = qualities.as_ref().map(|basis| (basis, &conditions));
    let matches = decisive_matches(&conductor, &campaign, &goals)?;
    let reached = GoalBasis {
        model: &campaign.model,
        qualities,
        matches: &matches,
        reach_deg: reach_deg(candidates(&cards.cards, config).iter()),
    };
    goal_file::check_reached(request.goals, &goals, &reached)?;
    let rehearsals = rehearse(config, &cards, &campaign, progress)?;
    let flown = evidence(&campaign);
    let state = CampaignState {
        model: &campaign.model,
        evidence: &flown,
        history: CampaignHistory {
            maneuvers: &campaign.maneuvers,
            fits: &campaign.fits,
            covariances: &campaign.covariances,
            contributions: &campaign.model.rows.contributions,
        },
        aero_model: &config.aero_model,
        tunnel: &config.tunnel,
        settings: &config.model,
        qualities,
        matches: &matches,
    };
    let next = &cards.cards.next;
    let budget = Budget::of(next, request.minutes);
    let plan = plan(&state, &rehearsals, &goals, budget);
    let page = kneeboard::page(config, &plan, request.minutes, &cards.cards)
        .map_err(|what| Error::store(&folder.join(PAGE), &what))?;
    let shelf = shelf_of_stage(folder, &campaign_lineage(&conductor), Stage::Model);
    Ok(PlannedFlight {
        files: place_plan(&plan, &page, folder, &shelf)?,
        plan,
        problems: campaign.problems,
    })
}

/// Writes the tables and the page of a plan, and names their files.
fn place_plan(plan: &Plan, page: &str, folder: &Path, shelf: &TableFolder) -> Result<Vec<PathBuf>> {
    table::publish(shelf, &plan.cards)?;
    table::publish(shelf, &plan.goals)?;
    files::place_text(&folder.join(PAGE), page)?;
    let printed = folder.join(PRINTED_PAGE);
    let bytes = pdf::pdf(page, &DrawingCache::default());
    let bytes = bytes.map_err(|what| Error::store(&printed, &what))?;
    atomic::place(&printed, &bytes)?;
    let names = [
        "next_cards.csv",
        "next_cards.parquet",
        "next_goals.csv",
        "next_goals.parquet",
    ];
    let names = names.into_iter().chain([PAGE, PRINTED_PAGE]);
    Ok(names.map(|name| folder.join(name)).collect())
}

/// Reads the cards and checks them against the pipeline's classes.
fn read_cards(config: &Config, file: &Path) -> Result<TestCards> {
    if !files::is_file(file) {
        let what = "there is no such file of test cards: write one after pipelines/harv/cards.yaml \
                    (docs/next.md), or name another with --cards";
        return Err(Error::not_found(file, what));
    }
    let cards = TestCards::read(file)?;
    let classes: Vec<&str> = config.classes.iter().map(|c| c.name.as_str()).collect();
    cards.check_programs(&classes)?;
    Ok(cards)
}

/// Finds what decides the matches among the goals.
fn decisive_matches(conductor: &Conductor, campaign: &Campaign, goals: &[Goal]) -> Result<Matches> {
    let specification = conductor.runner.config.proof_of_match.as_ref();
    let first = specification.and_then(|own| own.models.first());
    let mut matches = Matches::new();
    for (place, goal) in goals.iter().enumerate() {
        let Some(GoalSubject::Match(class, model)) = goal.subject() else {
            continue;
        };
        let Some(model) = model.or(first.copied()) else {
            continue;
        };
        let found = decisive_differences(&conductor.runner, campaign, (class, model))?;
        matches.insert(place, (model, found));
    }
    Ok(matches)
}

/// Rehearses the candidates, in their order.
fn rehearse(
    config: &Config,
    cards: &TestCards,
    campaign: &Campaign,
    progress: &dyn Progress,
) -> Result<Vec<Rehearsal>> {
    let posterior = of_posterior(&campaign.model.rows.posterior, &config.tunnel.clamped());
    let derivatives = rehearsal::derivatives(config, posterior, &campaign.estimates);
    let simulator = cards.simulator(config, derivatives)?;
    let instruments = rehearsal::instruments(&cards.cards.instruments, &campaign.channels);
    let basis = RehearsalBasis {
        config,
        simulator: &simulator,
        instruments: &instruments,
        remaining_errors: &rehearsal::remaining_errors(&campaign.instruments),
        delays: &campaign.delays,
        limits: &cards.cards.next.limits,
    };
    let all = candidates(&cards.cards, config);
    progress.begin("rehearse", all.len());
    let rehearse = |candidate: CandidateCard| {
        let result = basis.rehearse(&candidate);
        progress.advance(&candidate.card.class);
        Rehearsal { candidate, result }
    };
    let rehearsals = all.into_par_iter().map(rehearse).collect();
    progress.end();
    Ok(rehearsals)
}
