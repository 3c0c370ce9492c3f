//! Results of a maneuver, as the posterior takes them.

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
