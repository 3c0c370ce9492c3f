//! Result of segment for one record.

use crate::error::Problem;
use crate::maneuver::{Maneuver, UnclassifiedExcitation};

/// The maneuvers of one record in the order of their starts, excitation that fits no class, and
/// problems.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Segmented {
    pub maneuvers: Vec<Maneuver>,
    pub unknown: Vec<UnclassifiedExcitation>,
    pub problems: Vec<Problem>,
}
