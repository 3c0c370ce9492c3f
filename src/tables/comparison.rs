//! Tables of comparison: flight against the wind tunnel and against earlier campaigns.

use serde::{Deserialize, Serialize, Serializer};

use crate::schema::{Entry, Words, table, words};

table! {
    /// Columns of `comparison` and `maneuver_comparison` about the tunnel.
    pub struct TunnelDifference {
        /// Tunnel's value, in the column `unit`.
        pub wind_tunnel: Option<f64>,
        /// Flight minus tunnel, in the column `unit`.
        pub difference: Option<f64>,
        /// Standard error of the difference, in the column `unit`. For the posterior its standard
        /// deviation; for a maneuver the root sum of squares of its bound and the tunnel's stated
        /// error.
        pub uncertainty: Option<f64>,
        /// Difference over the tunnel's magnitude.
        pub difference_pct: Option<f64> ["%"],
        /// Difference over its standard error.
        pub z: Option<f64> ["1"],
        /// Verdict on flight against tunnel.
        pub verdict: TunnelVerdict,
    }
}

table! {
    /// Posterior against the wind tunnel.
    pub struct ComparisonRow in "comparison" per "derivative and angle of attack" {
        /// Name of the derivative in the model.
        pub derivative: String,
        /// Unit of the derivative.
        pub unit: String,
        /// Group of classes that has the derivative's trend.
        pub group: String,
        /// Angle of attack: the tunnel's breakpoints where it has some, else the posterior's.
        pub alpha_deg: f64 ["deg"],
        /// Mean Mach number of the group's maneuvers near that angle.
        pub mach: Option<f64> ["1"],
        /// Value of the posterior, in the column `unit`.
        pub flight: f64,
        /// Standard deviation of the posterior, in the column `unit`.
        pub standard_error: f64,
        /// Share of the information that flight gave.
        pub flight_share_pct: Option<f64> ["%"],
        /// Comparison with the tunnel.
        pub tunnel: TunnelDifference,
    }
}

words! {
    /// Verdict on flight against the wind tunnel.
    pub enum TunnelVerdict {
        /// The difference is within 2 (`agreement_z`) in z or within 5 % (`agreement_pct`).
        Agrees = "agrees",
        /// Flight is higher, in the algebraic sense.
        FlightHigher = "flight higher",
        /// Flight is lower, in the algebraic sense: −0.3 is lower than −0.2.
        FlightLower = "flight lower",
        /// The values are on different sides of zero, each by more than 2 (`agreement_z`) of its
        /// standard errors.
        SignDiffers = "sign differs",
        /// Flight gave less than 10 % (`learnt_pct`) of the information.
        NothingLearnt = "nothing learnt",
        /// The table has no value, or `compare: not_comparable:` names the derivative.
        NoTunnelValue = "no tunnel value",
    }
}

table! {
    /// Estimates of converged maneuvers against the wind tunnel.
    pub struct ManeuverComparisonRow in "maneuver_comparison"
        per "maneuver and derivative that it estimates" {
        /// Maneuver.
        pub maneuver_id: String,
        /// Class of the maneuver.
        pub class: String,
        /// Name of the derivative in the model.
        pub derivative: String,
        /// Unit of the derivative.
        pub unit: String,
        /// Mean angle of attack of the maneuver, at which the tunnel is read.
        pub alpha_deg: f64 ["deg"],
        /// Mean Mach number of the maneuver, at which the tunnel is read.
        pub mach: f64 ["1"],
        /// Estimate, in the column `unit`.
        pub flight: f64,
        /// Corrected bound of the estimate, or its bound where there is none, in the column `unit`.
        pub bound: f64,
        /// Comparison with the tunnel.
        pub tunnel: TunnelDifference,
    }
}

table! {
    /// Trends against the trends of earlier campaigns or nights, where `compare: against:` or
    /// `--against` names their folders.
    pub struct ChangeRow in "changes" per "derivative, angle of attack and earlier campaign" {
        /// Folder of the earlier campaign.
        pub against: String,
        /// Name of the derivative in the model.
        pub derivative: String,
        /// Unit of the derivative.
        pub unit: String,
        /// Group whose trend is flight's value.
        pub group: String,
        /// Angle of attack.
        pub alpha_deg: f64 ["deg"],
        /// Value of the trend now, in the column `unit`.
        pub flight: f64,
        /// Standard error of the trend now, in the column `unit`.
        pub standard_error: f64,
        /// Value of the earlier trend of the same group, linear between its angles of attack, in the
        /// column `unit`.
        pub before: Option<f64>,
        /// Standard error of the earlier trend, in the column `unit`.
        pub before_standard_error: Option<f64>,
        /// Now minus before, in the column `unit`.
        pub difference: Option<f64>,
        /// Difference over the earlier magnitude.
        pub difference_pct: Option<f64> ["%"],
        /// Difference over the root sum of squares of both standard errors, which are not
        /// independent where both campaigns share flights.
        pub z: Option<f64> ["1"],
        /// Verdict on now against before.
        pub verdict: ChangeVerdict,
    }
}

words! {
    /// Verdict on flight against an earlier campaign.
    pub enum ChangeVerdict {
        /// The difference is within 2 (`agreement_z`) in z or within 5 % (`agreement_pct`).
        Agrees = "agrees",
        /// The value is higher now, in the algebraic sense.
        Higher = "higher than before",
        /// The value is lower now, in the algebraic sense.
        Lower = "lower than before",
        /// The values are on different sides of zero, each by more than 2 (`agreement_z`) of its
        /// standard errors.
        SignDiffers = "sign differs",
        /// The earlier campaign has no trend at this angle of attack.
        NotThereBefore = "not there before",
    }
}

table! {
    /// Ranges of angle of attack with one verdict, in words.
    pub struct VerdictRow in "verdicts" per "derivative and range of α with one verdict" {
        /// `wind tunnel`, or the folder of an earlier campaign (`compare: against:`, `--against`).
        pub against: String,
        /// Name of the derivative in the model.
        pub derivative: String,
        /// Unit of the derivative.
        pub unit: String,
        /// Group whose trend is flight's value.
        pub group: String,
        /// First angle of attack of the range.
        pub alpha_from_deg: f64 ["deg"],
        /// Last angle of attack of the range.
        pub alpha_to_deg: f64 ["deg"],
        /// Verdict of `comparison` or `changes`.
        pub verdict: Verdict,
        /// Median over the range of the difference over the other value's magnitude.
        pub difference_pct: Option<f64> ["%"],
        /// Range in words: `flight lower than tunnel from 35° to 60°, by 30%`. The percentage is
        /// the median, with the extremes in brackets if they are far from it.
        pub words: String,
    }
}

/// Verdict of `comparison` or of `changes`. Read back, a word of both is the tunnel's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub enum Verdict {
    Tunnel(TunnelVerdict),
    Change(ChangeVerdict),
}

impl Words for Verdict {
    const ENTRIES: &'static [Entry] = &[];

    fn word(&self) -> &str {
        match self {
            Verdict::Tunnel(verdict) => verdict.name(),
            Verdict::Change(verdict) => verdict.name(),
        }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.word())
    }
}

impl Serialize for Verdict {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.word())
    }
}

table! {
    /// Largest disagreements with the tunnel and with each earlier campaign, at most 20 (`worst`)
    /// for each.
    pub struct DisagreementRow in "disagreements"
        per "range of `verdicts` that disagrees, the worst first" {
        /// Rank by `size_pct`, from 1.
        pub rank: usize ["1"],
        /// `wind tunnel`, or the folder of an earlier campaign.
        pub against: String,
        /// Name of the derivative in the model.
        pub derivative: String,
        /// Unit of the derivative.
        pub unit: String,
        /// Angle of attack in the range at which the two values are furthest apart.
        pub alpha_deg: f64 ["deg"],
        /// Value of the trend, in the column `unit`.
        pub flight: f64,
        /// Tunnel's or earlier value, in the column `unit`.
        pub other: f64,
        /// Flight minus other, in the column `unit`.
        pub difference: f64,
        /// Difference over its standard error.
        pub z: Option<f64> ["1"],
        /// Difference's magnitude over the root mean square of the derivative's table, so that it
        /// does not grow where the table goes through zero.
        pub size_pct: Option<f64> ["%"],
        /// Range in words, as in `verdicts`.
        pub words: String,
    }
}

table! {
    /// Readings of the tunnel beyond the ends of its tables.
    pub struct ExtrapolationRow in "beyond_tunnel" per "reading of the tunnel beyond its tables" {
        /// Maneuver; empty for the comparison of a trend.
        pub maneuver_id: String,
        /// Angle of attack of the reading.
        pub alpha_deg: f64 ["deg"],
        /// Mach number of the reading.
        pub mach: f64 ["1"],
        /// Variable that is beyond its range: `alpha_deg`, `mach` or the third variable.
        pub variable: String,
        /// Value of the variable.
        pub read_at: f64 ["the variable's unit"],
        /// Lower end of the tables.
        pub tabulated_from: f64 ["the variable's unit"],
        /// Upper end of the tables.
        pub tabulated_to: f64 ["the variable's unit"],
        /// Result of the reading, by `tunnel: extrapolation:`.
        pub treatment: Treatment,
        /// Derivatives whose tables end there, separated by spaces.
        pub derivatives: String,
    }
}

words! {
    /// Result of reading the tunnel beyond its tables.
    pub enum Treatment {
        /// The value at the end of the table.
        Clamped = "clamped",
        /// No value.
        Refused = "refused",
    }
}
