//! Assessment of a fit: its residuals, an estimate by a second method, and the outcome that follows.

pub mod diagnostics;
pub mod second_opinion;
pub mod credibility;
