//! The conductor of the study of bounds: flies the test points of the cards, records them many
//! times, and writes the tables and the page that say what the bounds are worth.

use std::collections::BTreeMap;
use std::path::Path;

use crate::aero::WindTunnel;
use crate::error::{Problem, Result};
use crate::estimate::{self, Basis};
use crate::lab::campaign::SimulatedCampaign;
use crate::lab::simulator::Flown;
use crate::lab::simulator::noise::seed_of;
use crate::maneuver::Class;
use crate::output_error::estimation::Weights;
use crate::pipeline::Progress;
use crate::store::{atomic, table};
use crate::tables::{CoverageRow, StartRow};

mod coverage;
mod page;
mod recordings;
mod starts;

use recordings::{Residuals, Setting, Subject};

/// What a study found.
#[derive(Clone, Debug, Default)]
pub struct BoundsStudy {
    pub coverage: Vec<CoverageRow>,
    pub starts: Vec<StartRow>,
    /// Test points that could not be flown.
    pub problems: Vec<Problem>,
}

/// The ways in which every maneuver is recorded and weighted.
const SETTINGS: [(Residuals, Weights); 5] = [
    (Residuals::White, Weights::Table),
    (Residuals::White, Weights::Estimated),
    (Residuals::Coloured, Weights::Table),
    (Residuals::Coloured, Weights::Estimated),
    (Residuals::EveryChannel, Weights::Table),
];

/// One in so many records serves for the study of starting values, which estimates each six times.
const RECORDS_PER_START: usize = 10;

/// Makes the study and writes `coverage` and `starts` into a folder, and the page.
///
/// # Errors
/// A disk that says no.
pub fn run(
    simulation: &SimulatedCampaign,
    out: &Path,
    page: &Path,
    command: &str,
    progress: &dyn Progress,
) -> Result<BoundsStudy> {
    let mut found = BoundsStudy::default();
    let mut flown: Vec<(&Class, Flown)> = Vec::new();
    for class in &simulation.config.classes {
        for alpha_deg in angles(simulation, &class.name) {
            let Some(card) = simulation.card(&class.name, alpha_deg) else {
                continue;
            };
            match simulation.simulator.fly(&card) {
                Ok(maneuver) => flown.push((class, maneuver)),
                Err(problem) => found.problems.push(problem),
            }
        }
    }
    // Held values are true and instruments calibrated: what bounds count of either is nothing that
    // the scatter could show.
    let settings = estimate::Settings {
        held_uncertainty_pct: 0.0,
        calibration: BTreeMap::new(),
        ..simulation.config.estimate.clone()
    };
    let study = simulation.cards.study;
    progress.begin("validate", flown.len() * (SETTINGS.len() + 1));
    for (residuals, weights) in SETTINGS {
        for (class, maneuver) in &flown {
            let (truth, seed) = (
                recordings::tunnel_of_truth(maneuver),
                seed_of(simulation.cards.seed, &name(maneuver)),
            );
            let subject = subject(simulation, class, maneuver, &truth, &settings);
            let setting = Setting {
                residuals,
                coloured_time_s: study.coloured_time_s,
                weights,
            };
            found.coverage.extend(coverage::coverage(
                &subject,
                setting,
                study.realisations,
                seed,
            ));
            progress.advance(&name(maneuver));
        }
    }
    for (class, maneuver) in &flown {
        let (truth, seed) = (
            recordings::tunnel_of_truth(maneuver),
            seed_of(simulation.cards.seed, &name(maneuver)),
        );
        let subject = subject(simulation, class, maneuver, &truth, &settings);
        let setting = Setting {
            residuals: Residuals::White,
            coloured_time_s: 0.0,
            weights: Weights::Table,
        };
        let records = study.realisations.div_ceil(RECORDS_PER_START);
        found
            .starts
            .extend(starts::starts(&subject, setting, records, seed));
        progress.advance(&name(maneuver));
    }
    progress.end();
    let shelf = table::Shelf::of(out);
    table::publish(&shelf, &found.coverage)?;
    table::publish(&shelf, &found.starts)?;
    atomic::place(
        page,
        page::page(command, &found.coverage, &found.starts).as_bytes(),
    )?;
    Ok(found)
}

fn name(maneuver: &Flown) -> String {
    maneuver.maneuver.flight_id.clone()
}

fn subject<'a>(
    simulation: &'a SimulatedCampaign,
    class: &'a Class,
    flown: &'a Flown,
    truth: &'a WindTunnel,
    settings: &'a estimate::Settings,
) -> Subject<'a> {
    let config = &simulation.config;
    let basis = Basis::new(&config.aircraft, &config.buildup, truth, settings);
    Subject {
        class,
        flown,
        instruments: &simulation.cards.instruments,
        basis,
    }
}

/// Angles of attack for a class's study, spread over those that its cards have.
fn angles(simulation: &SimulatedCampaign, class: &str) -> Vec<f64> {
    let flights = simulation.cards.flights.values();
    let points = flights.flat_map(|f| &f.points).filter(|p| p.class == class);
    let mut angles: Vec<f64> = points.flat_map(|p| p.alpha_deg.iter().copied()).collect();
    angles.sort_by(f64::total_cmp);
    angles.dedup();
    let wanted = simulation.cards.study.points.clamp(1, angles.len().max(1));
    let place = |k: usize| k * angles.len().saturating_sub(1) / (wanted - 1).max(1);
    (0..wanted.min(angles.len()))
        .map(|k| angles[place(k)])
        .collect()
}
