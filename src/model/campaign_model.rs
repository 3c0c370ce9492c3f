//! Posterior of a campaign.

use super::coefficient::CoefficientPosterior;
use super::rows::Rows;
use crate::aero::Coefficient;

/// Posterior of all coefficients.
#[derive(Clone, Debug, Default)]
pub struct Model {
    pub coefficients: Vec<(Coefficient, CoefficientPosterior)>,
    pub rows: Rows,
    /// Coefficients whose posterior could not be computed.
    pub failed: Vec<Coefficient>,
}
