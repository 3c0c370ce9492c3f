//! Publishing of a campaign's tables.

use std::path::Path;

use super::table_metadata::shelf_of_stage;
use crate::error::Result;
use crate::lineage::{Lineage, Stage};
use crate::pipeline::Campaign;
use crate::store::table::{self, TableFolder};
use crate::tables::{EstimateRow, FitRow, JointRow, MatchRow, MatchVerdictRow, PredictedRow};

/// Writes the tables of all stages as far as `until` into a folder, without the problems.
///
/// # Errors
/// [`crate::error::Error::Io`] naming the file that cannot be written.
pub fn publish_tables(
    campaign: &Campaign,
    until: Stage,
    folder: &Path,
    lineage: &Lineage,
) -> Result<()> {
    let shelf = |stage| shelf_of_stage(folder, lineage, stage);
    publish_ingest(&shelf(Stage::Ingest), campaign)?;
    if until >= Stage::Segment {
        publish_segment(&shelf(Stage::Segment), campaign)?;
    }
    if until >= Stage::Estimate {
        publish_estimate(&shelf(Stage::Estimate), campaign)?;
    }
    if until >= Stage::Model {
        publish_model(&shelf(Stage::Model), campaign)?;
    }
    if until >= Stage::Trend {
        publish_trend(&shelf(Stage::Trend), campaign)?;
    }
    if until >= Stage::Qualities {
        publish_qualities(&shelf(Stage::Qualities), campaign)?;
    }
    if until >= Stage::Match {
        publish_match(&shelf(Stage::Match), campaign)?;
    }
    if until >= Stage::Compare {
        publish_compare(&shelf(Stage::Compare), campaign)?;
    }
    Ok(())
}

/// Writes the table of the problems of all stages as far as `until` into a folder.
///
/// # Errors
/// As [`publish_tables`].
pub fn publish_problems(
    campaign: &Campaign,
    until: Stage,
    folder: &Path,
    lineage: &Lineage,
) -> Result<()> {
    let shelf = shelf_of_stage(folder, lineage, until);
    table::publish(&shelf, &campaign.problems)
}

fn publish_ingest(shelf: &TableFolder, campaign: &Campaign) -> Result<()> {
    table::publish(shelf, &campaign.flight_rows)?;
    table::publish(shelf, &campaign.channels)?;
    table::publish(shelf, &campaign.checks)?;
    table::publish(shelf, &campaign.instruments)
}

fn publish_segment(shelf: &TableFolder, campaign: &Campaign) -> Result<()> {
    table::publish(shelf, &campaign.maneuvers)?;
    table::publish(shelf, &campaign.unknown)?;
    table::publish(shelf, &campaign.events)
}

/// Publishes the rows of the maneuvers, then the rows of joint estimates.
fn publish_estimate(shelf: &TableFolder, campaign: &Campaign) -> Result<()> {
    let joined = || campaign.joined.iter().map(|j| &j.estimated);
    let fits: Vec<FitRow> = followed_by(&campaign.fits, joined().map(|e| &e.fit));
    let joint_estimates = joined().flat_map(|e| &e.estimates);
    let estimates: Vec<EstimateRow> = followed_by(&campaign.estimates, joint_estimates);
    let joint_sums = joined().flat_map(|e| &e.combined);
    let sums: Vec<EstimateRow> = followed_by(&campaign.combined, joint_sums);
    let predicted = campaign.predicted.iter().map(|p| p.summary.clone());
    let predicted: Vec<PredictedRow> = predicted.collect();
    let members = campaign.joined.iter().flat_map(|j| &j.members);
    let members: Vec<JointRow> = members.cloned().collect();
    table::publish(shelf, &campaign.correlations)?;
    table::publish_fits(shelf, &fits, &predicted)?;
    table::publish_as(shelf, "fit_outputs", &campaign.fit_outputs)?;
    table::publish(shelf, &campaign.instrument_trends)?;
    table::publish(shelf, &estimates)?;
    table::publish_as(shelf, "combined", &sums)?;
    table::publish(shelf, &members)?;
    table::publish(shelf, &campaign.predictions())
}

/// Rows followed by others.
fn followed_by<'a, T: Clone + 'a>(rows: &[T], others: impl Iterator<Item = &'a T>) -> Vec<T> {
    let mut all = rows.to_vec();
    all.extend(others.cloned());
    all
}

fn publish_trend(shelf: &TableFolder, campaign: &Campaign) -> Result<()> {
    table::publish(shelf, &campaign.outliers)?;
    table::publish(shelf, &campaign.trends)
}

fn publish_model(shelf: &TableFolder, campaign: &Campaign) -> Result<()> {
    let rows = &campaign.model.rows;
    table::publish(shelf, &rows.posterior)?;
    table::publish(shelf, &rows.covariance)?;
    table::publish(shelf, &rows.scales)?;
    table::publish(shelf, &rows.contributions)?;
    table::publish(shelf, &rows.self_check)?;
    table::publish(shelf, &campaign.lift_and_drag)
}

fn publish_qualities(shelf: &TableFolder, campaign: &Campaign) -> Result<()> {
    let found = &campaign.qualities;
    table::publish(shelf, &found.qualities)?;
    table::publish(shelf, &found.levels)?;
    table::publish(shelf, &found.roots)
}

fn publish_match(shelf: &TableFolder, campaign: &Campaign) -> Result<()> {
    let matched = &campaign.matched;
    let rows: Vec<MatchRow> = matched.iter().flat_map(|m| &m.rows).cloned().collect();
    let verdicts = matched.iter().flat_map(|m| &m.verdicts);
    let verdicts: Vec<MatchVerdictRow> = verdicts.cloned().collect();
    table::publish(shelf, &rows)?;
    table::publish(shelf, &verdicts)
}

fn publish_compare(shelf: &TableFolder, campaign: &Campaign) -> Result<()> {
    table::publish(shelf, &campaign.comparison)?;
    table::publish(shelf, &campaign.maneuver_comparison)?;
    table::publish(shelf, &campaign.verdicts)?;
    table::publish(shelf, &campaign.disagreements)?;
    table::publish(shelf, &campaign.changes)?;
    table::publish(shelf, &campaign.extrapolations)
}
