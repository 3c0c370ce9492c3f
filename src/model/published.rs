//! Quantities of a coefficient's posterior that are published: its terms, and the constants of sums.

use nalgebra::{DMatrix, DVector};

use super::coefficient::CoefficientPosterior;
use super::grid::Node;
use super::posterior::prior;
use super::term::Term;
use super::unknowns::SparseRow;
use crate::tables::Knowledge;

/// A published derivative or sum over the points of its grid: tunnel + rows · differences.
#[derive(Clone, Debug)]
pub struct Quantity {
    pub name: String,
    pub unit: &'static str,
    pub nodes: Vec<Node>,
    /// Term whose grid it has.
    pub term: usize,
    /// Tunnel's values; zero where it has none.
    pub tunnel: Vec<f64>,
    pub has_tunnel: bool,
    /// Weights of the differences, point by point.
    pub rows: Vec<SparseRow>,
}

impl CoefficientPosterior {
    /// Published quantities: each term, and after a sum its constant.
    #[must_use]
    pub fn quantities(&self) -> Vec<Quantity> {
        let mut quantities = Vec::new();
        for (i, term) in self.terms.iter().enumerate() {
            quantities.push(self.of_term(i, term));
            quantities.extend(self.constant(i, term));
        }
        quantities
    }

    fn of_term(&self, i: usize, term: &Term) -> Quantity {
        let start = self.unknowns.starts[i];
        Quantity {
            name: term.prior.name.clone(),
            unit: term.unit,
            nodes: term.prior.grid.nodes(),
            term: i,
            tunnel: term.prior.mean.clone(),
            has_tunnel: term.prior.known != Knowledge::Magnitude,
            rows: (0..term.prior.grid.len())
                .map(|node| vec![(start + node, 1.0)])
                .collect(),
        }
    }

    /// Constant of a sum: the sum less the slope times α.
    fn constant(&self, i: usize, term: &Term) -> Option<Quantity> {
        let slope = term.slope.as_ref()?;
        let j = self.terms.iter().position(|t| t.derivative == *slope)?;
        let slope = &self.terms[j].prior;
        let mut constant = self.of_term(i, term);
        constant.name.clone_from(&term.derivative);
        constant.has_tunnel &= slope.known != Knowledge::Magnitude;
        for (node, (at, row)) in constant.nodes.iter().zip(&mut constant.rows).enumerate() {
            for (place, share) in slope.grid.shares(&at.condition()) {
                let weight = -at.alpha_deg * share;
                row.push((self.unknowns.starts[j] + place, weight));
                constant.tunnel[node] += weight * slope.mean[place];
            }
        }
        Some(constant)
    }

    /// Values of a quantity, with their covariance.
    #[must_use]
    pub fn values(&self, quantity: &Quantity) -> (Vec<f64>, DMatrix<f64>) {
        let rows = self.dense(quantity);
        let n = self.unknowns.differences;
        let mean: DVector<f64> = &rows * self.gaussian.mean.rows(0, n);
        let values = mean.iter().zip(&quantity.tunnel).map(|(f, t)| t + f);
        let covariance = self.gaussian.covariance.view((0, 0), (n, n));
        (values.collect(), &rows * covariance * rows.transpose())
    }

    /// Covariance of a quantity before flight.
    #[must_use]
    pub fn prior_covariance(&self, quantity: &Quantity) -> DMatrix<f64> {
        let rows = self.dense(quantity);
        let prior = prior(&self.terms, &self.scales);
        &rows * prior * rows.transpose()
    }

    /// Mean over the points of the correlation of two quantities on one grid.
    #[must_use]
    pub fn mean_correlation(&self, first: &Quantity, second: &Quantity) -> f64 {
        let n = self.unknowns.differences;
        let covariance = self.gaussian.covariance.view((0, 0), (n, n));
        let (first, second) = (self.dense(first), self.dense(second));
        let points = first.nrows();
        let sum: f64 = (0..points)
            .map(|i| {
                let (a, b) = (first.row(i), second.row(i));
                let between = |x: nalgebra::RowDVector<f64>, y: nalgebra::RowDVector<f64>| {
                    (x * covariance).dot(&y)
                };
                let (a, b) = (a.into_owned(), b.into_owned());
                let variances = between(a.clone(), a.clone()) * between(b.clone(), b.clone());
                if variances > 0.0 {
                    between(a, b) / variances.sqrt()
                } else {
                    0.0
                }
            })
            .sum();
        sum / points.max(1) as f64
    }

    fn dense(&self, quantity: &Quantity) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(quantity.rows.len(), self.unknowns.differences);
        for (i, row) in quantity.rows.iter().enumerate() {
            for (place, weight) in row {
                dense[(i, *place)] += weight;
            }
        }
        dense
    }

    /// Number of maneuvers of full weight that estimate a term within its length of an angle of
    /// attack, rounded.
    #[must_use]
    pub fn maneuvers_near(&self, term: usize, alphas_deg: &[f64], alpha_deg: f64) -> usize {
        let reach = self.scales[term].length_deg;
        let near = self.estimated.iter().filter(|(place, terms)| {
            terms.contains(&term) && (alphas_deg[**place] - alpha_deg).abs() <= reach
        });
        near.count()
    }
}
