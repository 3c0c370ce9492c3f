//! Models drawn from the posterior, and the correlations between its derivatives.

use nalgebra::DVector;

use super::campaign_model::Model;
use super::coefficient::CoefficientPosterior;
use crate::numerics::random::RandomStream;
use crate::numerics::root::{EXACT, root};
use crate::tables::PosteriorRow;

/// Correlation below which derivatives count as independent: the sampling error of a few hundred draws.
const LEAST: f64 = 0.05;

/// Two derivatives whose errors are correlated.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrelatedDerivatives {
    pub first: String,
    pub second: String,
    /// Mean of the correlations at the same condition.
    pub correlation: f64,
}

impl Model {
    /// Rows of the posterior with the values of one draw.
    #[must_use]
    pub fn drawn(&self, stream: &mut RandomStream) -> Vec<PosteriorRow> {
        let mut values = Vec::new();
        for (_, coefficient) in &self.coefficients {
            values.extend(coefficient.drawn(stream));
        }
        let rows = self.rows.posterior.iter().zip(values);
        rows.map(|(row, value)| PosteriorRow {
            value,
            ..row.clone()
        })
        .collect()
    }

    /// Correlations between the published derivatives of each coefficient.
    #[must_use]
    pub fn correlations(&self) -> Vec<CorrelatedDerivatives> {
        let all = self.coefficients.iter();
        all.flat_map(|(_, coefficient)| coefficient.correlations())
            .collect()
    }
}

impl CoefficientPosterior {
    /// Values of all published quantities in one draw, in the order of the rows.
    fn drawn(&self, stream: &mut RandomStream) -> Vec<f64> {
        let n = self.unknowns.differences;
        let covariance = self.gaussian.covariance.view((0, 0), (n, n)).into_owned();
        let root = root(&covariance, EXACT);
        let deviates = DVector::from_fn(root.ncols(), |_, _| stream.normal());
        let differences = self.gaussian.mean.rows(0, n) + root * deviates;
        let mut values = Vec::new();
        for quantity in self.quantities() {
            for (row, tunnel) in quantity.rows.iter().zip(&quantity.tunnel) {
                let difference: f64 = row.iter().map(|(place, w)| w * differences[*place]).sum();
                values.push(tunnel + difference);
            }
        }
        values
    }

    fn correlations(&self) -> Vec<CorrelatedDerivatives> {
        let quantities = self.quantities();
        let mut pairs = Vec::new();
        for (i, first) in quantities.iter().enumerate() {
            for second in &quantities[i + 1..] {
                if first.nodes != second.nodes {
                    continue;
                }
                let correlation = self.mean_correlation(first, second);
                if correlation.abs() >= LEAST {
                    pairs.push(CorrelatedDerivatives {
                        first: first.name.clone(),
                        second: second.name.clone(),
                        correlation,
                    });
                }
            }
        }
        pairs
    }
}
