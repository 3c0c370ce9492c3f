//! Maneuvers in the report: table, pages, strip charts, predictions.

pub mod history_strips;
pub mod maneuver_page;
pub mod maneuver_table;
pub mod prediction_table;
