//! Stages that are made anew in each run.

pub mod qualities_stage;
pub mod report_stage;
pub mod model_stage;
pub mod trend_stage;
