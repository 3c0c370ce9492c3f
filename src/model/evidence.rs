//! Results of a maneuver, in the form that the posterior reads.

use crate::estimate::Covariance;
use crate::maneuver::Maneuver;
use crate::tables::EstimateRow;

/// Results of one maneuver.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a> {
    pub maneuver: &'a Maneuver,
    pub estimates: &'a [EstimateRow],
    /// Sums that the tunnel tabulates.
    pub combined: &'a [EstimateRow],
    pub covariance: &'a Covariance,
}

/// Evidence in the order of the maneuvers' ids, which is that of the flights and of the times in them.
#[must_use]
pub fn in_order<'a>(evidence: &[Evidence<'a>]) -> Vec<Evidence<'a>> {
    let mut evidence = evidence.to_vec();
    evidence.sort_by(|a, b| a.maneuver.maneuver_id.cmp(&b.maneuver.maneuver_id));
    evidence
}
