//! The rows of the published tables, one struct per table. Field names are column names; a value
//! that does not exist is `None` (a null in Parquet, an empty field in CSV). The `maneuvers`
//! table's row is [`crate::maneuver::Maneuver`], the `problems` table's is
//! [`crate::error::Problem`].

use std::collections::BTreeMap;

mod words;

use serde::{Deserialize, Deserializer, Serialize};

use crate::aero::Output;
use crate::maneuver::Status;

pub use words::{
    ChangeVerdict, ChannelVerdict, CheckVerdict, CorrelationKind, EventVerdict, InstrumentVerdict,
    Outcome, Participation, PredictionStatus, StartingValues, Treatment, TunnelVerdict, Verdict,
};

/// `channels`: what ingest did to one channel of one flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelRow {
    pub flight_id: String,
    pub channel: String,
    pub signal: String,
    /// Samples on the record's clock.
    pub samples: usize,
    /// How often the channel is recorded; the record's rate unless the channel is slower.
    pub rate_hz: Option<f64>,
    /// Of the samples: on the line between two samples of a slower channel.
    pub between: usize,
    /// Bridged over short dropouts and lost frames, replaced single-sample spikes, and left
    /// missing.
    pub bridged: usize,
    pub despiked: usize,
    pub missing: usize,
    /// Left out because the channel stood still.
    pub stuck: usize,
    /// How often the value wrapped around.
    pub wraps: usize,
    /// The step of the recorder's numbers and the standard deviation of the noise, in the signal's
    /// unit. Of the clock: the jitter of its time stamps, s.
    pub quantisation: Option<f64>,
    pub noise: Option<f64>,
    /// Worst verdict of the checks that name this channel.
    pub verdict: ChannelVerdict,
}

/// `checks`: how one kinematic relation between channels came out in one flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckRow {
    pub flight_id: String,
    /// The relation in words, e.g. `theta rate against q and r`.
    pub relation: String,
    /// The signals it ties together, separated by spaces.
    pub signals: String,
    /// Least-squares slope of what is measured on what the other signals predict: 1 when units and
    /// signs are right.
    pub slope: Option<f64>,
    pub correlation: Option<f64>,
    pub verdict: CheckVerdict,
}

/// `instruments`: what the kinematic equations say of one instrument of one flight, y = (scale) x(t
/// − delay) + bias. Empty where the flight does not tell it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InstrumentRow {
    pub flight_id: String,
    pub channel: String,
    pub signal: String,
    /// Of the bias and its bound.
    pub unit: String,
    pub bias: Option<f64>,
    /// Standard deviations.
    pub bias_bound: Option<f64>,
    pub scale: Option<f64>,
    pub scale_bound: Option<f64>,
    /// Against the other channels.
    pub delay_s: Option<f64>,
    pub delay_bound_s: Option<f64>,
    /// What the record was corrected by: `bias scale delay`, some of them or none.
    pub applied: String,
    pub verdict: InstrumentVerdict,
}

/// `events`: the analyst's events against what segment found in the record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventRow {
    pub flight_id: String,
    pub given_class: Option<String>,
    pub given_start_s: Option<f64>,
    pub given_end_s: Option<f64>,
    pub found_class: Option<String>,
    pub found_start_s: Option<f64>,
    pub found_end_s: Option<f64>,
    pub verdict: EventVerdict,
}

/// `fits`: how the estimation of one maneuver ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitRow {
    pub maneuver_id: String,
    pub class: String,
    pub outcome: Outcome,
    /// Why it ended so, in words.
    pub reason: String,
    /// Starting values of the iteration that led to the outcome.
    pub start: Option<StartingValues>,
    pub iterations: usize,
    /// J of eq. 1.2 at the start of the iteration and at the end.
    pub initial_cost: Option<f64>,
    pub final_cost: Option<f64>,
    /// Of the information matrix with unit diagonal.
    pub condition_number: Option<f64>,
    /// Share of the output samples that were marked and left out of the cost.
    pub left_out: Option<f64>,
    /// Ratio of the lengths of the best and the worst determined direction: the root of the
    /// condition number.
    pub largest_condition_index: Option<f64>,
    /// Groups of parameters that the data hardly tell apart, worst first: `CN_0 CN_alpha; Cm_de
    /// Cm_dpv`.
    pub confounded: Option<String>,
}

/// Columns of `fits` beside those of [`FitRow`]: how well the derivatives of others predict the
/// maneuver.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PredictedRow {
    /// None for maneuvers estimated together.
    pub prediction: Option<PredictionStatus>,
    /// How many others it was predicted from.
    pub predicted_from: Option<usize>,
    /// J of eq. 1.2 of the prediction, to be held against `final_cost`.
    pub predicted_cost: Option<f64>,
    /// Theil's inequality coefficient over all outputs, weighted as in the cost, and the shares of
    /// its parts.
    pub theil: Option<f64>,
    pub theil_bias: Option<f64>,
    pub theil_variance: Option<f64>,
    pub theil_covariance: Option<f64>,
    /// Columns `theil_alpha`, `theil_q` and so on; the other axis's outputs have none.
    pub theil_of: BTreeMap<Output, f64>,
    /// Columns `r_squared_alpha`, `r_squared_q` and so on.
    pub r_squared_of: BTreeMap<Output, f64>,
}

/// `predictions`: one output of one maneuver, predicted with the derivatives of others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PredictionRow {
    pub maneuver_id: String,
    pub class: String,
    pub alpha_deg: f64,
    pub output: Output,
    pub unit: String,
    /// That count.
    pub samples: usize,
    /// Root mean square of measured minus predicted, in the unit.
    pub root_mean_square: f64,
    pub theil: Option<f64>,
    pub theil_bias: Option<f64>,
    pub theil_variance: Option<f64>,
    pub theil_covariance: Option<f64>,
    pub r_squared: Option<f64>,
}

/// `joint`: one maneuver of those that were estimated together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointRow {
    /// The `maneuver_id` of the joint rows of `fits`, `estimates` and `combined`.
    pub joint_id: String,
    pub class: String,
    /// Means over the maneuvers that take part.
    pub joint_alpha_deg: f64,
    pub joint_mach: f64,
    /// How many take part.
    pub maneuvers: usize,
    pub maneuver_id: String,
    pub flight_id: String,
    pub alpha_deg: f64,
    pub mach: f64,
    pub part: Participation,
    /// J of eq. 1.2 of this maneuver with its own derivatives, and with the shared ones.
    pub cost_alone: Option<f64>,
    pub cost_joint: Option<f64>,
}

/// `estimates`: one derivative of one maneuver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimateRow {
    pub maneuver_id: String,
    pub flight_id: String,
    pub class: String,
    pub alpha_deg: f64,
    pub mach: f64,
    pub derivative: String,
    pub unit: String,
    pub status: Status,
    /// The estimate, or the value it was held at; none when inactive.
    pub value: Option<f64>,
    /// Cramér-Rao bound in its sandwich form, with the uncertainty of the held values propagated;
    /// none unless estimated and determined by the data.
    pub bound: Option<f64>,
    /// The part of both bounds that comes from the uncertainty of the held values.
    pub bound_held: Option<f64>,
    /// The part of the corrected bound that comes from errors of calibration.
    pub bound_calibration: Option<f64>,
    /// The bound with the residuals' autocorrelation, noise of the surfaces and errors of
    /// calibration counted: half the width of a 95 % interval over 1.96, by Student's t as far as
    /// the autocorrelation is known from little.
    pub bound_corrected: Option<f64>,
    /// The tunnel's value at the maneuver's α and Mach.
    pub wind_tunnel: Option<f64>,
    /// By what factor the other parameters raise the estimate's variance above what it would be if
    /// they were known.
    pub variance_inflation: Option<f64>,
    /// Root mean square of the regressor about its mean: deg, or rad of a reduced rate; none for a
    /// constant.
    pub excitation: Option<f64>,
    /// Root mean square of derivative × regressor about its mean, in percent of the coefficient's.
    pub contribution_pct: Option<f64>,
    /// The same derivative by least squares on the measured accelerations, as a check.
    pub equation_error: Option<f64>,
    /// Why the evidence of the maneuver holds it at the tunnel's value; none where a table decides.
    pub held_because: Option<String>,
}

/// `correlations`: two regressors or two estimates of one maneuver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CorrelationRow {
    pub maneuver_id: String,
    pub class: String,
    pub kind: CorrelationKind,
    pub first: String,
    pub second: String,
    pub correlation: f64,
}

/// `trends`: one derivative's least-squares trend across α for one group of classes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrendRow {
    pub derivative: String,
    pub unit: String,
    pub group: String,
    pub alpha_deg: f64,
    pub value: f64,
    /// Of the trend's value.
    pub standard_error: f64,
    pub lower_95: f64,
    pub upper_95: f64,
    /// Where one more maneuver's estimate is expected.
    pub prediction_lower_95: f64,
    pub prediction_upper_95: f64,
    /// How many maneuvers the trend is fitted through.
    pub maneuvers: usize,
    /// How many of them lie far from it: rows of `outliers`.
    pub outliers: usize,
    /// `polynomial`, or `spline` with its knots.
    pub curve: String,
    /// Order of the polynomial, or of the spline between its knots, that the criterion chose.
    pub order: usize,
    /// Standard deviation between maneuvers beyond their bounds.
    pub scatter: f64,
}

/// `outliers`: one maneuver's estimate that lies far from the trend of its group.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutlierRow {
    pub derivative: String,
    pub unit: String,
    pub group: String,
    pub maneuver_id: String,
    pub class: String,
    pub alpha_deg: f64,
    pub value: f64,
    pub bound: f64,
    /// The trend there.
    pub trend: f64,
    /// Value minus trend over its standard deviation.
    pub z: f64,
    /// What is left of the maneuver's weight in the trend: below one.
    pub weight_share: f64,
}

/// `comparison`: flight against tunnel for one derivative at one angle of attack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComparisonRow {
    pub derivative: String,
    pub unit: String,
    /// The trend's group that speaks for flight.
    pub group: String,
    pub alpha_deg: f64,
    /// At which the tunnel is read.
    pub mach: Option<f64>,
    pub flight: f64,
    pub standard_error: f64,
    pub wind_tunnel: Option<f64>,
    pub difference: Option<f64>,
    /// Standard error of the difference.
    pub uncertainty: Option<f64>,
    /// Of the tunnel's value.
    pub difference_pct: Option<f64>,
    /// Difference over its standard error.
    pub z: Option<f64>,
    pub verdict: TunnelVerdict,
}

/// `maneuver_comparison`: one derivative of one maneuver against the tunnel at the maneuver's own α
/// and Mach number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ManeuverComparisonRow {
    pub maneuver_id: String,
    pub class: String,
    pub derivative: String,
    pub unit: String,
    pub alpha_deg: f64,
    pub mach: f64,
    pub flight: f64,
    /// The corrected bound, where there is one.
    pub bound: f64,
    pub wind_tunnel: Option<f64>,
    pub difference: Option<f64>,
    /// Standard error of the difference.
    pub uncertainty: Option<f64>,
    pub difference_pct: Option<f64>,
    pub z: Option<f64>,
    pub verdict: TunnelVerdict,
}

/// `verdicts`: neighbouring angles of attack at which one derivative has the same verdict, in
/// words.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerdictRow {
    /// `wind tunnel`, or the folder of an earlier campaign.
    pub against: String,
    pub derivative: String,
    pub unit: String,
    pub group: String,
    pub alpha_from_deg: f64,
    pub alpha_to_deg: f64,
    pub verdict: Verdict,
    /// Median over the range.
    pub difference_pct: Option<f64>,
    /// `flight lower than tunnel from 35° to 60°, by 30%`.
    pub words: String,
}

/// `disagreements`: where flight and tunnel, or flight and an earlier campaign, are furthest apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DisagreementRow {
    pub rank: usize,
    pub against: String,
    pub derivative: String,
    pub unit: String,
    /// Where in the range of the verdict it is worst.
    pub alpha_deg: f64,
    pub flight: f64,
    /// The tunnel's or the earlier value.
    pub other: f64,
    pub difference: f64,
    pub z: Option<f64>,
    /// The difference's magnitude in percent of the derivative's typical size.
    pub size_pct: Option<f64>,
    pub words: String,
}

/// `changes`: a trend against the one of an earlier campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChangeRow {
    pub against: String,
    pub derivative: String,
    pub unit: String,
    pub group: String,
    pub alpha_deg: f64,
    pub flight: f64,
    pub standard_error: f64,
    pub before: Option<f64>,
    pub before_standard_error: Option<f64>,
    pub difference: Option<f64>,
    pub difference_pct: Option<f64>,
    pub z: Option<f64>,
    pub verdict: ChangeVerdict,
}

/// A number of a published table; one that does not exist is an empty field there, and no number
/// here.
fn published<'de, D: Deserializer<'de>>(field: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(field)?.unwrap_or(f64::NAN))
}

/// A row of published `trends`, as far as it is compared with: an earlier campaign's or another
/// night's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PublishedTrend {
    pub derivative: String,
    pub unit: String,
    pub group: String,
    pub alpha_deg: f64,
    #[serde(deserialize_with = "published")]
    pub value: f64,
    #[serde(deserialize_with = "published")]
    pub standard_error: f64,
}

impl From<&TrendRow> for PublishedTrend {
    fn from(row: &TrendRow) -> PublishedTrend {
        PublishedTrend {
            derivative: row.derivative.clone(),
            unit: row.unit.clone(),
            group: row.group.clone(),
            alpha_deg: row.alpha_deg,
            value: row.value,
            standard_error: row.standard_error,
        }
    }
}

/// A row of published `comparison`, as far as nights are compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PublishedVerdict {
    pub derivative: String,
    pub alpha_deg: f64,
    pub verdict: TunnelVerdict,
}

impl From<&ComparisonRow> for PublishedVerdict {
    fn from(row: &ComparisonRow) -> PublishedVerdict {
        PublishedVerdict {
            derivative: row.derivative.clone(),
            alpha_deg: row.alpha_deg,
            verdict: row.verdict,
        }
    }
}

/// `flight_updated`: one derivative at one grid point of the export.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExportRow {
    pub derivative: String,
    pub alpha_deg: f64,
    pub mach: Option<f64>,
    /// The third variable of the tables; its column has its name.
    pub third: Option<f64>,
    pub value: f64,
    pub unit: String,
    /// Standard uncertainty, where it is known.
    pub uncertainty: Option<f64>,
    pub source: String,
    /// 1 where the value is flight's, 0 where it is the tunnel's.
    pub is_flight: usize,
}

/// `beyond_tunnel`: where a tunnel table was to be read beyond its ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BeyondRow {
    /// Empty for the comparison of trends.
    pub maneuver_id: String,
    pub alpha_deg: f64,
    pub mach: f64,
    /// `alpha_deg`, `mach`, or the third variable.
    pub variable: String,
    pub read_at: f64,
    pub tabulated_from: f64,
    pub tabulated_to: f64,
    pub treatment: Treatment,
    pub derivatives: String,
}

/// The time histories of one maneuver, measured against computed, as in the paper's Figures 4 and
/// 12.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct History {
    pub maneuver_id: String,
    pub class: String,
    pub alpha_deg: f64,
    pub time_s: Vec<f64>,
    pub outputs: Vec<HistoryOutput>,
    /// What drove the maneuver: label with unit, values.
    pub controls: Vec<(String, Vec<f64>)>,
}

/// One output of a [`History`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HistoryOutput {
    pub label: String,
    pub unit: String,
    #[serde(deserialize_with = "with_missing")]
    pub measured: Vec<f64>,
    #[serde(deserialize_with = "with_missing")]
    pub computed: Vec<f64>,
    /// Samples left out of the cost.
    pub marked: Vec<bool>,
}

/// Numbers of which some are missing: JSON has no word for a number that is none.
fn with_missing<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let values = Vec::<Option<f64>>::deserialize(deserializer)?;
    Ok(values.into_iter().map(|v| v.unwrap_or(f64::NAN)).collect())
}

/// `coverage`: what the bounds of one derivative are worth in one maneuver recorded many times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoverageRow {
    pub class: String,
    pub alpha_deg: f64,
    /// Noise: `white` or `coloured`, of the outputs; `noise on every channel`.
    pub residuals: String,
    /// `table` or `estimated`.
    pub weights: String,
    pub derivative: String,
    pub unit: String,
    pub truth: f64,
    pub realisations: usize,
    pub converged: usize,
    /// Mean of the estimates less the truth, and their standard deviation.
    pub bias: f64,
    pub scatter: f64,
    pub bias_over_scatter: f64,
    /// Scatter over the root mean square of `bound`, and how often ±1 and ±1.96 of it hold the
    /// truth.
    pub scatter_over_bound: f64,
    pub coverage_68: f64,
    pub coverage_95: f64,
    /// The same of `bound_corrected`.
    pub scatter_over_corrected: f64,
    pub corrected_coverage_68: f64,
    pub corrected_coverage_95: f64,
}

/// `starts`: how often the iteration reaches the minimum that it reaches from the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StartRow {
    pub class: String,
    pub alpha_deg: f64,
    /// Where it starts.
    pub start: String,
    pub records: usize,
    /// Reached from there.
    pub alone: usize,
    /// Reached as the program does it: from the equation error's solution where it does not
    /// converge from there.
    pub reached: usize,
}
