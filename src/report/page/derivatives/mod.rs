//! Derivatives in the report: pages, verdicts, correlations.

pub mod correlation_triangle;
pub mod derivative_page;
pub mod derivative_results;
pub mod identifiability_tables;
pub mod verdict_ranges;
pub mod verdict_table;
