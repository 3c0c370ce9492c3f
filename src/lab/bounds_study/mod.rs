//! Study of the bounds: simulated maneuvers with known derivatives are flown and recorded many
//! times under several conditions, and estimated with the campaign's settings. Errors of the
//! estimates are compared with their bounds.
//!
//! The conditions of the cards (`study: conditions:`) state what is flown, in which air, and how it
//! is recorded. Instruments have noise only, and held values are true. The study writes the tables
//! `conditions`, `coverage` and `starts` and a page of the documentation.

mod recordings;
mod coverage;
mod condition_rows;
mod starts;
mod page;

use std::path::Path;

use crate::error::{Problem, Result};
use crate::lab::campaign::{RecordNoise, SimulatedCampaign, StudyCondition};
use crate::lab::simulator::{Card, DerivativeLookup};
use crate::maneuver::Class;
use crate::numerics::statistics::random::derived_seed;
use crate::output_error::estimation::Weights;
use crate::pipeline::Progress;
use crate::store::{atomic, table};
use crate::tables::{ConditionRow, CoverageRow, StartRow};

use condition_rows::Scales;
use coverage::MeasuredPoint;
use page::StudyTables;
use recordings::StudyManeuver;

/// Tables of a study.
#[derive(Clone, Debug, Default)]
pub struct BoundsStudy {
    pub conditions: Vec<ConditionRow>,
    pub coverage: Vec<CoverageRow>,
    pub starts: Vec<StartRow>,
    /// Test points that could not be flown.
    pub problems: Vec<Problem>,
}

/// Records of the coverage study per record of the study of starting values, which estimates each
/// record six times.
const RECORDS_PER_START: usize = 10;

/// Runs the study, writes its tables into a folder, and its page.
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
    let points = test_points(campaign);
    let conditions = &campaign.cards.study.conditions;
    progress.begin("validate", points.len() * (conditions.len() + 1));
    for condition in conditions {
        study.measure(campaign, &points, condition, progress);
    }
    study.vary_starts(campaign, &points, progress);
    progress.end();
    let shelf = table::TableFolder::of(out);
    table::publish(&shelf, &study.conditions)?;
    table::publish(&shelf, &study.coverage)?;
    table::publish(&shelf, &study.starts)?;
    let tables = StudyTables {
        conditions: &study.conditions,
        coverage: &study.coverage,
        starts: &study.starts,
    };
    let text = page::page(command, conditions, tables);
    atomic::place(page, text.as_bytes())?;
    Ok(study)
}

/// A card to be flown under every condition.
struct TestPoint<'a> {
    class: &'a Class,
    card: Card,
}

impl TestPoint<'_> {
    fn seed(&self, campaign: &SimulatedCampaign) -> u64 {
        derived_seed(campaign.cards.seed, &self.card.flight_id)
    }
}

impl BoundsStudy {
    /// Measures one condition at every test point.
    fn measure(
        &mut self,
        campaign: &SimulatedCampaign,
        points: &[TestPoint],
        condition: &StudyCondition,
        progress: &dyn Progress,
    ) {
        let count = campaign.cards.study.realisations;
        let mut measured = Vec::with_capacity(points.len());
        for point in points {
            match StudyManeuver::new(campaign, point.class, &point.card, condition) {
                Ok(maneuver) => {
                    let seed = point.seed(campaign);
                    let (result, problem) = MeasuredPoint::measure(&maneuver, count, seed);
                    measured.push(result);
                    if let Some(problem) = problem {
                        self.note(problem);
                    }
                }
                Err(problem) => self.note(problem),
            }
            progress.advance(&point.card.flight_id);
        }
        let scales = Scales {
            aero_model: &campaign.config.aero_model,
            truth: &campaign.config.tunnel,
        };
        let rows = condition_rows::condition_rows(&condition.name, &measured, scales);
        self.conditions.extend(rows);
        let rows = measured.iter().flat_map(|m| m.rows(&condition.name));
        self.coverage.extend(rows);
    }

    /// Repeats the estimation of simulated records from other starting values. The records meet the
    /// assumptions of the theory (`assumed_condition`).
    fn vary_starts(
        &mut self,
        campaign: &SimulatedCampaign,
        points: &[TestPoint],
        progress: &dyn Progress,
    ) {
        let condition = assumed_condition();
        let count = campaign
            .cards
            .study
            .realisations
            .div_ceil(RECORDS_PER_START);
        for point in points {
            let starts = StudyManeuver::new(campaign, point.class, &point.card, &condition)
                .and_then(|maneuver| {
                    let aero_model = &campaign.config.aero_model;
                    starts::starts(&maneuver, aero_model, count, point.seed(campaign))
                });
            match starts {
                Ok(rows) => self.starts.extend(rows),
                Err(problem) => self.note(problem),
            }
            progress.advance(&point.card.flight_id);
        }
    }

    /// Adds a problem, unless it is listed already.
    fn note(&mut self, problem: Problem) {
        if !self.problems.contains(&problem) {
            self.problems.push(problem);
        }
    }
}

/// Condition that the theory assumes: still air and white noise of the outputs, weighted by the
/// tables.
fn assumed_condition() -> StudyCondition {
    StudyCondition {
        name: String::new(),
        turbulence: None,
        discrete_gusts: None,
        derivatives: DerivativeLookup::Frozen,
        surface_delay_s: 0.0,
        noise: RecordNoise::White,
        weights: Some(Weights::Table),
    }
}

fn test_points(campaign: &SimulatedCampaign) -> Vec<TestPoint<'_>> {
    let classes = campaign.config.classes.iter();
    classes
        .flat_map(|class| {
            angles_of_attack(campaign, &class.name)
                .into_iter()
                .filter_map(move |alpha_deg| {
                    let card = campaign.card(&class.name, alpha_deg)?;
                    Some(TestPoint { class, card })
                })
        })
        .collect()
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
