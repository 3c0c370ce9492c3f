//! Maneuver classes in the report: figures, markers, outcomes.

pub mod class_figures;
pub mod class_markers;
pub mod class_outcomes;
