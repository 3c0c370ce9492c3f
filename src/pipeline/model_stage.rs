//! Posterior of the campaign. It is made anew each time from the estimates.

use std::collections::BTreeMap;

use super::campaign::Campaign;
use super::problems::problem;
use crate::config::Config;
use crate::error::ProblemStage;
use crate::model::{self, Evidence};
use crate::output_error::Outcome;
use crate::tables::EstimateRow;

/// Version of the posterior.
pub const MODEL_VERSION: u32 = 1;

/// Computes the posterior from the maneuvers that converged.
pub fn fit_model(config: &Config, campaign: &mut Campaign) {
    let estimates = by_maneuver(&campaign.estimates);
    let combined = by_maneuver(&campaign.combined);
    let maneuvers = campaign.maneuvers.iter().zip(&campaign.covariances);
    let evidence = maneuvers.zip(&campaign.fits).filter_map(|(pair, fit)| {
        let (maneuver, covariance) = pair;
        let covariance = covariance.as_ref()?;
        (fit.outcome == Outcome::Converged).then_some(Evidence {
            maneuver,
            estimates: estimates.get(maneuver.maneuver_id.as_str())?,
            combined: combined
                .get(maneuver.maneuver_id.as_str())
                .copied()
                .unwrap_or_default(),
            covariance,
        })
    });
    let evidence: Vec<Evidence> = evidence.collect();
    let found = model::model(&evidence, &config.buildup, &config.tunnel, &config.model);
    for coefficient in &found.failed {
        let place = format!("{coefficient:?}");
        let reason =
            "its posterior could not be computed: an estimate or a covariance is not finite";
        let problem = problem(ProblemStage::Model, "", &place, reason);
        campaign.problems.push(problem);
    }
    campaign.model = found;
}

/// Rows of each maneuver, which stand together.
fn by_maneuver(rows: &[EstimateRow]) -> BTreeMap<&str, &[EstimateRow]> {
    rows.chunk_by(|a, b| a.maneuver_id == b.maneuver_id)
        .map(|own| (own[0].maneuver_id.as_str(), own))
        .collect()
}
