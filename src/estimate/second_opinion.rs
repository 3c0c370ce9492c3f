//! Equation error beside output error.

use crate::output_error::equation_error::Regression;
use crate::tables::EstimateRow;

/// Adds the estimates by equation error, with their bounds, to the rows of a fit.
pub(super) fn add_second_opinion(names: &[String], second: &Regression, rows: &mut [EstimateRow]) {
    for row in rows {
        let Some(j) = names.iter().position(|name| *name == row.derivative) else {
            continue;
        };
        row.equation_error = second.values[j];
        row.equation_error_bound = second.values[j].map(|_| second.covariance[(j, j)].sqrt());
    }
}
