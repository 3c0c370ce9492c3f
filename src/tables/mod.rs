//! Rows of the published tables, one struct per table, and the page that explains them.
//!
//! Field names are column names. A value that does not exist is `None`: a null in Parquet, an empty
//! field in CSV. The row of `maneuvers` is [`crate::maneuver::Maneuver`], that of `unknown`
//! [`crate::maneuver::UnclassifiedExcitation`], that of `problems` [`crate::error::Problem`].

mod bounds_study;
mod comparison;
mod estimates;
mod export;
mod flight_plan;
mod flights;
mod history;
mod page;
mod posterior;
mod predictions;
mod proof_of_match;
mod published;
mod qualities;
mod trends;

pub use bounds_study::{ConditionRow, CoverageRow, StartRow, StartVariant, Weights};
pub use comparison::{
    ChangeRow, ChangeVerdict, ComparisonRow, DisagreementRow, ExtrapolationRow,
    ManeuverComparisonRow, Treatment, TunnelDifference, TunnelVerdict, Verdict, VerdictRow,
};
pub use estimates::{
    CorrelationKind, CorrelationRow, EstimateRow, EstimationMethod, FitRow, JOINT_FLIGHT, JointRow,
    Outcome, Participation, StartingValues,
};
pub use export::{DrawRow, ExportRow};
pub use flight_plan::{GoalKind, NextCardRow, NextGoalRow};
pub use flights::{
    ALL_FLIGHTS, ChannelRow, ChannelVerdict, CheckRow, CheckVerdict, CommonErrorVerdict, EventRow,
    EventVerdict, FlightRow, InstrumentError, InstrumentRow, InstrumentTrend, InstrumentTrendRow,
    InstrumentVerdict,
};
pub use history::{History, HistoryOutput};
pub use page::page;
pub use posterior::{
    ContributionRow, CovarianceRow, LeftOutKind, LiftAndDragRow, PosteriorRow, PriorSource,
    ScaleRow, SelfCheckRow,
};
pub use predictions::{AgreementRow, PredictedRow, PredictionStatus};
pub use proof_of_match::{MatchRow, MatchVerdict, MatchVerdictRow, MatchedQuantity, ModelSource};
pub use published::{PublishedTrend, PublishedVerdict};
pub use qualities::{
    ALL_PARAGRAPHS, Airframe, DeviationBasis, FlyingQuality, Level, LevelRow, QualityRow, RootRow,
};
pub use trends::{OutlierRow, TrendRow};
