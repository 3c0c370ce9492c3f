//! Flight condition at which tables are read.

/// Flight condition at which the tables are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    pub alpha_deg: f64,
    pub mach: f64,
    /// Third variable; `None` if unknown, and [`super::Third::at`] is used.
    pub third: Option<f64>,
}
