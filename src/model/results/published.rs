//! Published quantities of a coefficient's posterior: its terms, and the constants of sums.

use nalgebra::DVector;

use crate::model::fusion::coefficient::CoefficientPosterior;
use crate::model::fusion::unknowns::{SparseRow, covariance_between, weighted_sum};
use crate::model::prior::grid::Node;
use crate::model::prior::term::PosteriorTerm;
use crate::tables::PriorSource;

/// A published derivative or sum over the points of its grid: tunnel + rows · differences.
#[derive(Clone, Debug)]
pub struct PublishedDerivative {
    pub name: String,
    pub unit: &'static str,
    pub nodes: Vec<Node>,
    /// Index of the term that has the same grid.
    pub term: usize,
    /// Tunnel's values; zero at points without one.
    pub tunnel: Vec<f64>,
    pub has_tunnel: bool,
    /// Weights of the differences in the value, point by point.
    pub rows: Vec<SparseRow>,
}

impl CoefficientPosterior {
    /// Published quantities: each term; for a sum, its constant as well.
    #[must_use]
    pub fn quantities(&self) -> Vec<PublishedDerivative> {
        let mut quantities = Vec::new();
        for (i, term) in self.terms.iter().enumerate() {
            quantities.push(self.of_term(i, term));
            quantities.extend(self.constant(i, term));
        }
        quantities
    }

    fn of_term(&self, i: usize, term: &PosteriorTerm) -> PublishedDerivative {
        let start = self.unknowns.starts[i];
        PublishedDerivative {
            name: term.prior.name.clone(),
            unit: term.unit,
            nodes: term.prior.grid.nodes(),
            term: i,
            tunnel: term.prior.mean.clone(),
            has_tunnel: term.prior.source != PriorSource::Magnitude,
            rows: (0..term.prior.grid.len())
                .map(|node| vec![(start + node, 1.0)])
                .collect(),
        }
    }

    /// Constant of a sum: the sum less the slope times α.
    fn constant(&self, i: usize, term: &PosteriorTerm) -> Option<PublishedDerivative> {
        let slope = term.slope.as_ref()?;
        let j = self.terms.iter().position(|t| t.derivative == *slope)?;
        let slope = &self.terms[j].prior;
        let mut constant = self.of_term(i, term);
        constant.name.clone_from(&term.derivative);
        constant.has_tunnel &= slope.source != PriorSource::Magnitude;
        for (node, (at, row)) in constant.nodes.iter().zip(&mut constant.rows).enumerate() {
            for (place, share) in slope.grid.shares(&at.condition()) {
                let weight = -at.alpha_deg * share;
                row.push((self.unknowns.starts[j] + place, weight));
                constant.tunnel[node] += weight * slope.mean[place];
            }
        }
        Some(constant)
    }

    /// Value of a quantity at each of its points.
    #[must_use]
    pub fn values(&self, quantity: &PublishedDerivative) -> Vec<f64> {
        quantity.values(&self.gaussian.mean)
    }

    /// Mean over the points of the correlation of two quantities on one grid.
    #[must_use]
    pub fn mean_correlation(
        &self,
        first: &PublishedDerivative,
        second: &PublishedDerivative,
    ) -> f64 {
        let covariance = &self.gaussian.covariance;
        let correlation = |(a, b): (&SparseRow, &SparseRow)| {
            let variances =
                covariance_between(a, a, covariance) * covariance_between(b, b, covariance);
            if variances > 0.0 {
                covariance_between(a, b, covariance) / variances.sqrt()
            } else {
                0.0
            }
        };
        let pairs = first.rows.iter().zip(&second.rows);
        pairs.map(correlation).sum::<f64>() / first.rows.len().max(1) as f64
    }

    /// Number of maneuvers that estimate a term within its length of an angle of attack.
    #[must_use]
    pub fn maneuvers_near(&self, term: usize, alphas_deg: &[f64], alpha_deg: f64) -> usize {
        let reach = self.scales[term].length_deg;
        let near = self.estimated.iter().filter(|(place, terms)| {
            terms.contains(&term) && (alphas_deg[**place] - alpha_deg).abs() <= reach
        });
        near.count()
    }
}

impl PublishedDerivative {
    /// Value at each point for given differences from the tunnel.
    #[must_use]
    pub fn values(&self, differences: &DVector<f64>) -> Vec<f64> {
        let points = self.rows.iter().zip(&self.tunnel);
        points
            .map(|(row, tunnel)| tunnel + weighted_sum(row, differences))
            .collect()
    }
}
