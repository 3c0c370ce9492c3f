//! Trends and comparison of the campaign. They are small and made anew each time from the
//! estimates.

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::compare::earlier_campaign::{self, Earlier};
use crate::compare::{self, extrapolation, ranges};
use crate::config::Config;
use crate::error::Result;
use crate::output_error::Outcome;
use crate::pipeline::campaign::Campaign;
use crate::store::files;
use crate::tables::EstimateRow;
use crate::trend;

/// Version of the trends.
pub const TREND_VERSION: u32 = 5;

/// Version of the comparison.
pub const COMPARE_VERSION: u32 = 2;

/// Reads the published trends of the earlier campaigns that the analyst names.
///
/// # Errors
/// [`crate::error::Error::Config`] naming the table that cannot be read.
pub fn read_earlier(config: &Config) -> Result<Vec<Earlier>> {
    let read = |folder: &PathBuf| Ok(Earlier::new(folder, files::earlier_trends(folder)?));
    config.compare.against.iter().map(read).collect()
}

/// Estimates and combined sums of the maneuvers that converged, without biases.
#[must_use]
fn converged_estimates(config: &Config, campaign: &Campaign) -> Vec<EstimateRow> {
    let converged: BTreeSet<&str> = campaign
        .fits
        .iter()
        .filter(|f| f.outcome == Outcome::Converged)
        .map(|f| f.maneuver_id.as_str())
        .collect();
    let names = config.derivative_names();
    let counts = |row: &&EstimateRow| {
        converged.contains(&*row.maneuver_id) && names.contains(&row.derivative)
    };
    campaign
        .estimates_and_sums()
        .filter(counts)
        .cloned()
        .collect()
}

/// Fits the trends of the estimates as they are published.
pub fn fit_trends(config: &Config, campaign: &mut Campaign) {
    let estimates = converged_estimates(config, campaign);
    let found = trend::trends(&estimates, &config.trend, |name| {
        config.tunnel.alphas_deg(name)
    });
    campaign.trends = found.rows;
    campaign.problems.extend(found.problems);
    campaign.outliers = found.outliers;
}

/// Compares posterior and maneuvers with the tunnel, and trends with earlier campaigns.
pub fn compare(config: &Config, earlier: &[Earlier], campaign: &mut Campaign) {
    let (tunnel, settings) = (&config.tunnel, &config.compare);
    let maneuvers = &campaign.maneuvers;
    let comparison = compare::compare_posterior(
        &campaign.model.rows.posterior,
        maneuvers,
        tunnel,
        &config.trend,
        settings,
    );
    let converged = converged_estimates(config, campaign);
    let maneuver_comparison = compare::compare_maneuvers(&converged, maneuvers, tunnel, settings);
    let extrapolations =
        extrapolation::extrapolations(&campaign.estimates, maneuvers, &comparison, tunnel);
    let (mut verdicts, mut disagreements) = ranges::ranges_of_tunnel(&comparison, tunnel, settings);
    let mut changes = Vec::new();
    for campaign_before in earlier {
        let rows =
            earlier_campaign::changes(&campaign.trends, campaign_before, &config.trend, settings);
        let (words, largest) = ranges::ranges_of_changes(&rows, &campaign_before.name, settings);
        changes.extend(rows);
        verdicts.extend(words);
        disagreements.extend(largest);
    }
    campaign.comparison = comparison;
    campaign.maneuver_comparison = maneuver_comparison;
    campaign.extrapolations = extrapolations;
    campaign.verdicts = verdicts;
    campaign.disagreements = disagreements;
    campaign.changes = changes;
}
