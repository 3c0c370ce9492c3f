//! Proof of match in the report: section, charts, strip charts.

pub mod match_charts;
pub mod match_section;
pub mod match_strips;
