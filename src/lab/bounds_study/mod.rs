//! Study of the bounds: simulated maneuvers with known derivatives are recorded many times, each time
//! with fresh noise, and estimated. The scatter of the estimates is compared with their bounds.
//!
//! Instruments have noise only, and held values are true. Writes the tables `coverage` and `starts`
//! and a page of the documentation.

mod recordings;
mod coverage;
mod starts;
mod page;

use std::collections::BTreeMap;
use std::path::Path;

use crate::aero::WindTunnel;
use crate::error::{Problem, Result};
use crate::estimate::{self, Context};
use crate::lab::campaign::SimulatedCampaign;
use crate::lab::simulator::FlownManeuver;
use crate::lab::simulator::random::derived_seed;
use crate::maneuver::Class;
use crate::output_error::estimation::Weights;
use crate::pipeline::Progress;
use crate::store::{atomic, table};
use crate::tables::{CoverageRow, StartRow};

use crate::tables::Residuals;
use recordings::{Scenario, StudyManeuver};

/// Tables of a study.
#[derive(Clone, Debug, Default)]
pub struct BoundsStudy {
    pub coverage: Vec<CoverageRow>,
    pub starts: Vec<StartRow>,
    /// Test points that could not be flown.
    pub problems: Vec<Problem>,
}

/// Combinations of residuals and weights in the study of coverage.
const COMBINATIONS: [(Residuals, Weights); 5] = [
    (Residuals::White, Weights::Table),
    (Residuals::White, Weights::Estimated),
    (Residuals::Coloured, Weights::Table),
    (Residuals::Coloured, Weights::Estimated),
    (Residuals::EveryChannel, Weights::Table),
];

/// Records of the coverage study per record of the study of starting values, which estimates each
/// record six times.
const RECORDS_PER_START: usize = 10;

/// Makes the study, writes its tables into a folder, and its page.
///
/// # Errors
/// [`crate::error::Error::Io`] or [`crate::error::Error::Store`] naming the file.
pub fn run(
    campaign: &SimulatedCampaign,
    out: &Path,
    page: &Path,
    command: &str,
    progress: &dyn Progress,
) -> Result<BoundsStudy> {
    let mut study = BoundsStudy::default();
    let flown = fly_test_points(campaign, &mut study.problems);
    progress.begin("validate", flown.len() * (COMBINATIONS.len() + 1));
    for (residuals, weights) in COMBINATIONS {
        let scenario = Scenario {
            residuals,
            coloured_time_s: campaign.cards.study.coloured_time_s,
            weights,
        };
        for maneuver in &flown {
            study
                .coverage
                .extend(study_coverage(campaign, maneuver, scenario));
            progress.advance(maneuver.name());
        }
    }
    for maneuver in &flown {
        study.starts.extend(study_starts(campaign, maneuver));
        progress.advance(maneuver.name());
    }
    progress.end();
    let shelf = table::Shelf::of(out);
    table::publish(&shelf, &study.coverage)?;
    table::publish(&shelf, &study.starts)?;
    let text = page::page(command, &study.coverage, &study.starts);
    atomic::place(page, text.as_bytes())?;
    Ok(study)
}

/// A flown test point with its class and true derivatives.
struct TestPoint<'a> {
    class: &'a Class,
    flown: FlownManeuver,
    truth: WindTunnel,
}

impl TestPoint<'_> {
    fn name(&self) -> &str {
        &self.flown.maneuver.flight_id
    }
}

fn fly_test_points<'a>(
    campaign: &'a SimulatedCampaign,
    problems: &mut Vec<Problem>,
) -> Vec<TestPoint<'a>> {
    let mut points = Vec::new();
    for class in &campaign.config.classes {
        for alpha_deg in angles_of_attack(campaign, &class.name) {
            let Some(card) = campaign.card(&class.name, alpha_deg) else {
                continue;
            };
            match campaign.simulator.fly(&card) {
                Ok(flown) => points.push(TestPoint {
                    class,
                    truth: recordings::true_tables(&flown.truth),
                    flown,
                }),
                Err(problem) => problems.push(problem),
            }
        }
    }
    points
}

/// Angles of attack of a class's study, spread over those of its cards.
fn angles_of_attack(campaign: &SimulatedCampaign, class: &str) -> Vec<f64> {
    let flights = campaign.cards.flights.values();
    let points = flights.flat_map(|f| &f.points).filter(|p| p.class == class);
    let mut angles: Vec<f64> = points.flat_map(|p| p.alpha_deg.iter().copied()).collect();
    angles.sort_by(f64::total_cmp);
    angles.dedup();
    let count = campaign.cards.study.points.clamp(1, angles.len().max(1));
    let index = |k: usize| k * angles.len().saturating_sub(1) / (count - 1).max(1);
    (0..count.min(angles.len()))
        .map(|k| angles[index(k)])
        .collect()
}

/// Settings of the estimates: no uncertainty of held values and instruments, which the study does not
/// vary.
fn study_settings(campaign: &SimulatedCampaign) -> estimate::Settings {
    estimate::Settings {
        held_uncertainty_pct: 0.0,
        calibration: BTreeMap::new(),
        ..campaign.config.estimate.clone()
    }
}

fn study_coverage(
    campaign: &SimulatedCampaign,
    point: &TestPoint,
    scenario: Scenario,
) -> Vec<CoverageRow> {
    let settings = study_settings(campaign);
    let maneuver = study_maneuver(campaign, point, &settings);
    let realisations = campaign.cards.study.realisations;
    coverage::coverage(&maneuver, scenario, realisations, seed(campaign, point))
}

fn study_starts(campaign: &SimulatedCampaign, point: &TestPoint) -> Vec<StartRow> {
    let settings = study_settings(campaign);
    let maneuver = study_maneuver(campaign, point, &settings);
    let scenario = Scenario {
        residuals: Residuals::White,
        coloured_time_s: 0.0,
        weights: Weights::Table,
    };
    let records = campaign
        .cards
        .study
        .realisations
        .div_ceil(RECORDS_PER_START);
    starts::starts(&maneuver, scenario, records, seed(campaign, point))
}

fn seed(campaign: &SimulatedCampaign, point: &TestPoint) -> u64 {
    derived_seed(campaign.cards.seed, point.name())
}

fn study_maneuver<'a>(
    campaign: &'a SimulatedCampaign,
    point: &'a TestPoint,
    settings: &'a estimate::Settings,
) -> StudyManeuver<'a> {
    let config = &campaign.config;
    StudyManeuver {
        class: point.class,
        flown: &point.flown,
        instruments: &campaign.cards.instruments,
        context: Context::new(&config.aircraft, &config.buildup, &point.truth, settings),
    }
}
