//! Export of the flight-updated derivatives for simulators.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::campaign_lineage::campaign_lineage;
use super::table_metadata::shelf_of_stage;
use crate::config::Config;
use crate::error::{Problem, Result};
use crate::export::{self, ExportContents, daveml, jsbsim};
use crate::lineage::Stage;
use crate::numerics::statistics::random::RandomStream;
use crate::pipeline::{Campaign, Conductor, Progress};
use crate::store::table::TableFolder;
use crate::store::{atomic, table};

/// Files and values of an export.
#[derive(Clone, Debug)]
pub struct Exported {
    pub files: Vec<PathBuf>,
    /// Number of values from flight.
    pub from_flight: usize,
    /// Number of all values.
    pub values: usize,
    /// Derivatives of the model that neither flight nor tunnel gives.
    pub missing: Vec<String>,
    pub problems: Vec<Problem>,
}

/// Models to be drawn from the posterior.
#[derive(Clone, Copy, Debug, Default)]
pub struct Draws {
    pub number: usize,
    /// Seed of the random numbers: the same seed draws the same models.
    pub seed: u64,
}

/// Brings the campaign up to date, waiting up to `wait` for another run to leave the store. Writes
/// `flight_updated` into a folder: as CSV, Parquet, DAVE-ML (`.dml`), and as a JSBSim section
/// (`_jsbsim.xml`). The published night stays as it is.
///
/// # Errors
/// A fault that stops the run.
pub fn export(
    config: &Config,
    folder: &Path,
    draws: Draws,
    wait: Duration,
    progress: &dyn Progress,
) -> Result<Exported> {
    let conductor = Conductor::open(config, wait, progress)?;
    let campaign = conductor.campaign(Stage::Model)?;
    let shelf = shelf_of_stage(folder, &campaign_lineage(&conductor), Stage::Model);
    let correlations = campaign.model.correlations();
    let contents = ExportContents {
        title: &config.title,
        aircraft: &config.aircraft,
        aero_model: &config.aero_model,
        tunnel: &config.tunnel,
        posterior: &campaign.model.rows.posterior,
        correlations: &correlations,
        settings: &config.export,
    };
    let mut exported = write(&contents, &campaign, folder, &shelf)?;
    if draws.number > 0 {
        exported
            .files
            .extend(write_draws(&contents, &campaign, folder, &shelf, draws)?);
    }
    Ok(exported)
}

/// Writes the models drawn: one table of all, and a JSBSim section of each.
fn write_draws(
    contents: &ExportContents,
    campaign: &Campaign,
    folder: &Path,
    shelf: &TableFolder,
    draws: Draws,
) -> Result<Vec<PathBuf>> {
    let mut all = Vec::new();
    let mut files = ["draws.csv", "draws.parquet"]
        .map(|name| folder.join(name))
        .to_vec();
    let sampler = campaign.model.sampler();
    let mut stream = RandomStream::new(draws.seed, "draws");
    for draw in 1..=draws.number {
        let posterior = sampler.draw(&mut stream);
        let drawn = ExportContents {
            posterior: &posterior,
            ..*contents
        };
        let tables = export::tables(&drawn);
        let section = folder.join(format!("draw_{draw:04}_jsbsim.xml"));
        atomic::place(&section, jsbsim::section(&drawn, &tables).as_bytes())?;
        files.push(section);
        all.extend(export::draw_rows(draw, &tables));
    }
    table::publish(shelf, &all)?;
    Ok(files)
}

fn write(
    contents: &ExportContents,
    campaign: &Campaign,
    folder: &Path,
    shelf: &TableFolder,
) -> Result<Exported> {
    let tables = export::tables(contents);
    let rows = export::rows(&tables);
    let third = contents
        .tunnel
        .settings()
        .third
        .as_ref()
        .map(|third| third.name.as_str());
    table::publish_export(shelf, &rows, third)?;
    let (dml, section) = (
        folder.join("flight_updated.dml"),
        folder.join("flight_updated_jsbsim.xml"),
    );
    atomic::place(&dml, daveml::document(contents, &tables).as_bytes())?;
    atomic::place(&section, jsbsim::section(contents, &tables).as_bytes())?;
    let tables_of_rows =
        ["flight_updated.csv", "flight_updated.parquet"].map(|name| folder.join(name));
    let names = contents
        .aero_model
        .derivatives
        .iter()
        .map(|d| d.name.clone());
    Ok(Exported {
        files: tables_of_rows.into_iter().chain([dml, section]).collect(),
        from_flight: rows.iter().filter(|r| r.is_flight == 1).count(),
        values: rows.len(),
        missing: names
            .filter(|name| !tables.iter().any(|t| t.derivative == *name))
            .collect(),
        problems: campaign.problems.clone(),
    })
}
