//! Flying qualities of the campaign. They are made anew each time from the posterior.

use crate::config::Config;
use crate::error::ProblemStage;
use crate::maneuver::{Maneuver, Means};
use crate::pipeline::campaign::Campaign;
use crate::pipeline::problems::problem;
use crate::qualities::{self, JudgedAircraft};

/// Version of the flying qualities.
pub const QUALITIES_VERSION: u32 = 3;

/// Computes the flying qualities of the posterior, where the pipeline has a specification.
pub fn judge_qualities(config: &Config, campaign: &mut Campaign) {
    let Some(specification) = &config.qualities else {
        return;
    };
    let flown = flown_means(campaign);
    let basis = JudgedAircraft {
        model: &campaign.model,
        aircraft: &config.aircraft,
        aero_model: &config.aero_model,
        tunnel: &config.tunnel,
        specification,
    };
    let found = qualities::qualities(&basis, &flown);
    if found.qualities.is_empty() && !flown.is_empty() {
        let reason =
            "no angle of attack of the posterior was flown, or the posterior is not finite";
        let problem = problem(ProblemStage::Qualities, "", "qualities", reason);
        campaign.problems.push(problem);
    }
    campaign.qualities = found;
}

/// Maneuvers in whose conditions flying qualities are judged, with their means.
pub fn flown_means(campaign: &Campaign) -> Vec<(&Maneuver, &Means)> {
    let maneuvers = campaign.maneuvers.iter().zip(&campaign.means);
    maneuvers
        .filter(|(maneuver, _)| !maneuver.is_rejected())
        .filter_map(|(maneuver, means)| Some((maneuver, means.as_ref()?)))
        .collect()
}
