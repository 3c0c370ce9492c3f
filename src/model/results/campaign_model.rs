//! Posterior of a campaign.

use super::rows::CoefficientTables;
use crate::aero::Coefficient;
use crate::model::fusion::coefficient::CoefficientPosterior;

/// Posterior of all coefficients.
#[derive(Clone, Debug, Default)]
pub struct Model {
    pub coefficients: Vec<(Coefficient, CoefficientPosterior)>,
    pub rows: CoefficientTables,
    /// Coefficients whose posterior could not be computed.
    pub failed: Vec<(Coefficient, Failure)>,
}

/// Reason for which a coefficient has no posterior.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// An estimate, or a covariance, is not finite.
    NotFinite,
    /// The grids of its derivatives have this number of points, more than [`MOST_POINTS`].
    TooManyPoints(usize),
}

/// Largest number of points of a coefficient's grids. Time grows with their cube and memory with
/// their square: 2,000 points take some seconds and 32 MB a matrix. The largest published tables
/// have some hundred.
pub const MOST_POINTS: usize = 2000;
