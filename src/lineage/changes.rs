//! Changes from one published night to the next: the rows of `alert.json` and of the report's
//! section.

use serde::{Deserialize, Serialize};

use super::differences::Cause;
use crate::schema::words;
use crate::tables::TunnelVerdict;

words! {
    /// Difference of a maneuver between two nights.
    pub enum ManeuverDifference {
        /// Only the later night has it.
        New = "new",
        /// Only the earlier night has it.
        Gone = "gone",
        /// Class, times or outcome differ.
        Changed = "changed",
    }
}

/// A maneuver that is new, gone, or no longer what it was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ManeuverChange {
    pub maneuver_id: String,
    pub class: String,
    pub what: ManeuverDifference,
    /// What is different about a changed one; the outcome of a new one.
    pub words: String,
    pub because: String,
}

/// A number that moved by more than its uncertainty: of a maneuver, or of a trend at an angle of
/// attack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    pub derivative: String,
    /// The maneuver, or the trend's group.
    pub of: String,
    pub alpha_deg: f64,
    pub before: f64,
    pub now: f64,
    pub uncertainty: f64,
    pub because: String,
}

/// A verdict that is another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerdictChange {
    pub derivative: String,
    pub alpha_deg: f64,
    pub before: TunnelVerdict,
    pub now: TunnelVerdict,
    pub because: String,
}

/// Everything that changed between two nights: the alert file, and a section of the report.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Changes {
    /// The night that it is held against; none for a first one.
    pub since: Option<String>,
    /// Whether somebody should look: something moved, is gone, or is not what it was. New maneuvers
    /// alone are no alert.
    pub alert: bool,
    /// What went in differently: flights, configuration, code.
    pub causes: Vec<Cause>,
    pub maneuvers: Vec<ManeuverChange>,
    pub estimates: Vec<Moved>,
    pub trends: Vec<Moved>,
    /// Trends that one of the two nights does not have, `derivative, group`.
    pub new_trends: Vec<String>,
    pub gone_trends: Vec<String>,
    pub verdicts: Vec<VerdictChange>,
}

impl Changes {
    /// Whether nothing that was published differs.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.maneuvers.is_empty()
            && self.estimates.is_empty()
            && self.trends.is_empty()
            && self.new_trends.is_empty()
            && self.gone_trends.is_empty()
            && self.verdicts.is_empty()
    }
}
