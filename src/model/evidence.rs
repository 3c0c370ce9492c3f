//! Results of a maneuver, in the form that the posterior reads.

use crate::estimate::Covariance;
use crate::maneuver::Maneuver;
use crate::tables::EstimateRow;

/// Results of one maneuver: condition, estimates, and their covariance.
#[derive(Clone, Copy, Debug)]
pub struct ManeuverResults<'a> {
    pub maneuver: &'a Maneuver,
    pub estimates: &'a [EstimateRow],
    /// Estimates of the sums of derivatives that the tunnel tabulates.
    pub combined: &'a [EstimateRow],
    pub covariance: &'a Covariance,
}

/// Sorts the evidence by the maneuvers' ids, and thus by flight and time.
#[must_use]
pub fn in_order<'a>(evidence: &[ManeuverResults<'a>]) -> Vec<ManeuverResults<'a>> {
    let mut evidence = evidence.to_vec();
    evidence.sort_by(|a, b| a.maneuver.maneuver_id.cmp(&b.maneuver.maneuver_id));
    evidence
}
