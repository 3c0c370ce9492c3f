//! The comparison's tables: flight against the tunnel, trend by trend and maneuver by maneuver, and
//! against the tables of earlier campaigns.

use std::collections::BTreeSet;

use super::{Campaign, Run};
use crate::compare::against::{self, Earlier};
use crate::compare::{self, beyond, ranges};
use crate::config::Config;
use crate::error::Result;
use crate::lineage::Stage;
use crate::output_error::Outcome;
use crate::store::{files, table};
use crate::tables::EstimateRow;

/// The published trends of the earlier campaigns that the analyst names.
pub(crate) fn earlier(config: &Config) -> Result<Vec<Earlier>> {
    let read =
        |folder: &std::path::PathBuf| Ok(Earlier::new(folder, files::earlier_trends(folder)?));
    config.compare.against.iter().map(read).collect()
}

/// The estimates and combined sums of the maneuvers that converged, without biases.
pub(crate) fn converged(config: &Config, campaign: &Campaign) -> Vec<EstimateRow> {
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
    campaign.estimated().filter(counts).cloned().collect()
}

impl Run<'_> {
    pub(crate) fn compare(&self, campaign: &mut Campaign) -> Result<()> {
        let config = self.config;
        let (tunnel, settings, shelf) =
            (&config.tunnel, &config.compare, self.shelf(Stage::Compare));
        let comparison = compare::comparison(
            &campaign.trends,
            &campaign.maneuvers,
            tunnel,
            &config.trend,
            settings,
        );
        let of_maneuvers = compare::of_maneuvers(
            &converged(config, campaign),
            &campaign.maneuvers,
            tunnel,
            settings,
        );
        let beyond = beyond::beyond(
            &campaign.estimates,
            &campaign.maneuvers,
            &comparison,
            tunnel,
        );
        let (mut verdicts, mut worst) = ranges::of_tunnel(&comparison, tunnel, settings);
        let mut changes = Vec::new();
        for before in &self.earlier {
            let rows = against::changes(&campaign.trends, before, &config.trend, settings);
            let (words, furthest) = ranges::of_changes(&rows, &before.name, settings);
            changes.extend(rows);
            verdicts.extend(words);
            worst.extend(furthest);
        }
        (
            campaign.comparison,
            campaign.verdicts,
            campaign.disagreements,
        ) = (comparison, verdicts, worst);
        campaign.changes = changes;
        table::publish(&shelf, &campaign.comparison)?;
        table::publish(&shelf, &of_maneuvers)?;
        table::publish(&shelf, &campaign.verdicts)?;
        table::publish(&shelf, &campaign.disagreements)?;
        table::publish(&shelf, &campaign.changes)?;
        table::publish(&shelf, &beyond)
    }
}
