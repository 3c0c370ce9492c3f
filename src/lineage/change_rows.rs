//! Changes from one published night to the next: the rows of `alert.json` and of the report's
//! section.

use serde::{Deserialize, Serialize};

use super::differences::Cause;
use crate::schema::words;
use crate::tables::{InstrumentError, InstrumentTrend, TunnelVerdict};

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

/// A maneuver that is new, gone or changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ManeuverChange {
    pub maneuver_id: String,
    pub class: String,
    pub what: ManeuverDifference,
    /// Differences of a changed maneuver; outcome of a new one.
    pub words: String,
    pub because: String,
}

/// A number that moved by more than its uncertainty: an estimate of a maneuver, or a trend at an
/// angle of attack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    pub derivative: String,
    /// Maneuver, or group of the trend.
    pub of: String,
    pub alpha_deg: f64,
    pub before: f64,
    pub now: f64,
    pub uncertainty: f64,
    pub because: String,
}

/// A verdict that changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerdictChange {
    pub derivative: String,
    pub alpha_deg: f64,
    pub before: TunnelVerdict,
    pub now: TunnelVerdict,
    pub because: String,
}

/// Information of flight about a derivative since the earlier night.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InformationGain {
    pub derivative: String,
    /// Divergence of the posterior over α from the posterior of the earlier night, nats.
    pub nats: f64,
    /// Angle of attack at which the posterior moved most, with its mean and standard deviation there.
    pub alpha_deg: f64,
    pub before: f64,
    pub before_deviation: f64,
    pub now: f64,
    pub now_deviation: f64,
}

/// Flight or class that the rest of the campaign contradicts, but did not in the earlier night.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contradiction {
    /// Flight or class.
    pub item: String,
    pub coefficient: String,
    pub estimates: usize,
    /// Share of its estimates inside the 95 % interval of their prediction by the rest.
    pub inside_95_pct: f64,
}

/// Error of an instrument that steps or drifts over the flights, but did not in the earlier night.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InstrumentChange {
    pub channel: String,
    pub error: InstrumentError,
    pub what: InstrumentTrend,
    /// First flight of the step or drift.
    pub since: String,
    /// Size of the step, or drift from the first flight to the last.
    pub change: f64,
    /// Standard deviation of `change`.
    pub bound: f64,
    pub unit: String,
}

/// Changes between two nights: the content of `alert.json`, and a section of the report.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Changes {
    /// Name of the night compared with; `None` for a first night.
    pub since: Option<String>,
    /// `true` if a value moved, vanished or changed, an instrument changed, the rest of the campaign
    /// contradicts a part, or the nights cannot be compared. New maneuvers alone are no alert.
    pub alert: bool,
    /// Reason why the values of the two nights cannot be compared; `None` if they can be.
    #[serde(default)]
    pub not_compared: Option<String>,
    /// Differences of flights, configuration and code.
    pub causes: Vec<Cause>,
    pub maneuvers: Vec<ManeuverChange>,
    pub estimates: Vec<Moved>,
    pub trends: Vec<Moved>,
    /// Trends that only the later night has, `derivative, group`.
    pub new_trends: Vec<String>,
    /// Trends that only the earlier night has.
    pub gone_trends: Vec<String>,
    pub verdicts: Vec<VerdictChange>,
    /// Information of flight about the derivatives, the most first.
    pub learnt: Vec<InformationGain>,
    pub contradictions: Vec<Contradiction>,
    /// Instruments whose errors changed since the earlier night, or over the flights of a first night.
    #[serde(default)]
    pub instruments: Vec<InstrumentChange>,
}

impl Changes {
    /// `true` if no published value differs.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.maneuvers.is_empty()
            && self.estimates.is_empty()
            && self.trends.is_empty()
            && self.new_trends.is_empty()
            && self.gone_trends.is_empty()
            && self.verdicts.is_empty()
            && self.contradictions.is_empty()
            && self.instruments.is_empty()
    }
}
