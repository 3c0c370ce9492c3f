//! The stages of a campaign, in order.

use serde::{Deserialize, Serialize};

/// The stages in order.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    #[default]
    Ingest,
    Segment,
    Estimate,
    Trend,
    Compare,
    Report,
}

impl Stage {
    pub const ALL: [Stage; 6] = [
        Stage::Ingest,
        Stage::Segment,
        Stage::Estimate,
        Stage::Trend,
        Stage::Compare,
        Stage::Report,
    ];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Stage::Ingest => "ingest",
            Stage::Segment => "segment",
            Stage::Estimate => "estimate",
            Stage::Trend => "trend",
            Stage::Compare => "compare",
            Stage::Report => "report",
        }
    }
}
