//! Equation error as a second opinion on output error.

use nalgebra::{DMatrix, DVector};

use crate::numerics::linear_algebra::symmetric::inverse;
use crate::numerics::statistics::chi_squared::exceedance;
use crate::output_error::Fit;
use crate::output_error::equation_error::Regression;
use crate::tables::EstimateRow;

/// Adds the estimates by equation error, with their bounds, to the rows of a fit.
pub(in crate::estimate) fn add_second_opinion(
    names: &[String],
    second: &Regression,
    rows: &mut [EstimateRow],
) {
    for row in rows {
        let Some(j) = names.iter().position(|name| *name == row.derivative) else {
            continue;
        };
        row.equation_error = second.values[j];
        row.equation_error_bound = second.values[j].map(|_| second.covariance[(j, j)].sqrt());
    }
}

/// Distance of a fit from equation error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Distance {
    /// Number of derivatives that both estimate.
    pub derivatives: usize,
    /// Square of the differences in joint standard errors, over all derivatives.
    pub square: f64,
}

impl Distance {
    /// Distance over the derivatives that both estimate; `None` without any, or without bounds.
    ///
    /// Both estimates use the same data and the same held values, so the covariance of their
    /// difference is less than the sum of their covariances. The sum is used here, so the distance
    /// is underestimated.
    pub fn between(fit: &Fit, second: &Regression) -> Option<Distance> {
        let corrected = fit.covariance_corrected.as_ref()?;
        let common: Vec<usize> = (0..second.values.len())
            .filter(|&j| second.values[j].is_some())
            .collect();
        let differences = common
            .iter()
            .filter_map(|&j| Some(fit.values[j] - second.values[j]?));
        let differences = DVector::from_vec(differences.collect());
        let sum = DMatrix::from_fn(common.len(), common.len(), |i, j| {
            corrected[(common[i], common[j])] + second.covariance[(common[i], common[j])]
        });
        (!common.is_empty()).then_some(Distance {
            derivatives: common.len(),
            square: differences.dot(&(inverse(&sum)? * &differences)),
        })
    }

    /// Root mean square over the derivatives.
    pub fn per_derivative(&self) -> f64 {
        (self.square / self.derivatives as f64).sqrt()
    }

    /// Probability of a larger distance, if both methods are right.
    pub fn probability(&self) -> f64 {
        exceedance(self.square, self.derivatives)
    }
}
