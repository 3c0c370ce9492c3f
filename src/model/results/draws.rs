//! Models drawn from the posterior, and the correlations between its derivatives.

use nalgebra::{DMatrix, DVector};

use super::campaign_model::Model;
use super::published::PublishedDerivative;
use crate::model::fusion::coefficient::CoefficientPosterior;
use crate::numerics::linear_algebra::root::{EXACT, root};
use crate::numerics::statistics::random::RandomStream;
use crate::tables::PosteriorRow;

/// Correlation below which derivatives count as independent: the sampling error of a few hundred draws.
const LEAST_CORRELATION: f64 = 0.05;

/// Two derivatives whose errors are correlated.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrelatedDerivatives {
    pub first: String,
    pub second: String,
    /// Mean of the correlations at the same condition.
    pub correlation: f64,
}

/// Source of models drawn from a posterior.
#[derive(Clone, Debug)]
pub struct Sampler<'a> {
    rows: &'a [PosteriorRow],
    coefficients: Vec<CoefficientSampler>,
}

/// Sampler of one coefficient: a draw is mean + root · (independent standard normal deviates).
#[derive(Clone, Debug)]
struct CoefficientSampler {
    quantities: Vec<PublishedDerivative>,
    mean: DVector<f64>,
    root: DMatrix<f64>,
}

impl Sampler<'_> {
    /// Rows of the posterior with the values of one draw.
    #[must_use]
    pub fn draw(&self, stream: &mut RandomStream) -> Vec<PosteriorRow> {
        let mut values = Vec::with_capacity(self.rows.len());
        for sampler in &self.coefficients {
            let differences = &sampler.mean + stream.deviations(&sampler.root);
            for quantity in &sampler.quantities {
                values.extend(quantity.values(&differences));
            }
        }
        let rows = self.rows.iter().zip(values);
        rows.map(|(row, value)| PosteriorRow {
            value,
            ..row.clone()
        })
        .collect()
    }
}

impl Model {
    /// Source of models drawn from the posterior.
    #[must_use]
    pub fn sampler(&self) -> Sampler<'_> {
        let all = self.coefficients.iter();
        Sampler {
            rows: &self.rows.posterior,
            coefficients: all.map(|(_, posterior)| posterior.sampler()).collect(),
        }
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
    fn sampler(&self) -> CoefficientSampler {
        let n = self.unknowns.differences;
        let covariance = self.gaussian.covariance.view((0, 0), (n, n)).into_owned();
        CoefficientSampler {
            quantities: self.quantities(),
            mean: self.gaussian.mean.rows(0, n).into_owned(),
            root: root(&covariance, EXACT),
        }
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
                if correlation.abs() >= LEAST_CORRELATION {
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
