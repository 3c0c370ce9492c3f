//! Prior of one derivative's difference from the tunnel: a Gaussian process over the flight
//! condition (Kennedy and O'Hagan 2001).
//!
//! | symbol | quantity |
//! |---|---|
//! | f(α) | difference at the angle of attack α, in the derivative's unit |
//! | ρ | root mean square of the tunnel's table, in the derivative's unit |
//! | t | tunnel's value over ρ, at α; t′ at α′ |
//! | s | relative size of the difference |
//! | ℓ | length of the difference, deg |
//! | M(d) | Matérn correlation of order 3/2 at the distance d in lengths |
//!
//! With M(d) = (1 + √3 d) exp(−√3 d), the covariance is
//!
//! cov f(α), f(α′) = s² ρ² (½ + ½ t t′) · ⅘ (M(|α − α′|/ℓ) + ¼).
//!
//! Half of the difference scales with the table, half does not. The quarter is an offset common to
//! all angles of attack. Where the table states its uncertainty u, u u′ stands for ρ² (½ + ½ t t′).
//! Across Mach number and third variable M falls over the range of the table.

use nalgebra::{DMatrix, DVector};

use super::grid::{Grid, Node};
use super::prior_covariance::{PriorCovariance, variance_factor};
use super::scale_prior::{Scale, ScalePrior};
use crate::aero::Condition;
use crate::numerics::statistics::matern::matern_3_2;
use crate::tables::PriorSource;

/// Prior of one derivative, or sum of derivatives.
#[derive(Clone, Debug)]
pub struct DerivativePrior {
    pub name: String,
    pub source: PriorSource,
    pub grid: Grid,
    /// Tunnel's value at the points of the grid; zero without a table.
    pub mean: Vec<f64>,
    /// Between all points of the grid.
    pub covariance: PriorCovariance,
    /// Prior of size and length.
    pub scale: ScalePrior,
}

/// Tunnel's table of a derivative, read at the points of a grid.
#[derive(Clone, Debug)]
pub struct TableOnGrid {
    pub source: PriorSource,
    pub mean: Vec<f64>,
    /// Stated uncertainty at each point.
    pub uncertainty: Vec<f64>,
    /// Root mean square, or the order of magnitude.
    pub size: f64,
}

/// Change of a derivative over a step of the angle of attack.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    /// Change of the tunnel's value.
    pub of_tunnel: f64,
    /// Prior variance of the change of the difference from the tunnel.
    pub variance: f64,
}

impl DerivativePrior {
    #[must_use]
    pub fn new(name: String, grid: Grid, table: TableOnGrid, centre: Scale) -> DerivativePrior {
        let nodes = grid.nodes();
        let n = nodes.len();
        let shape = |i: usize, j: usize| match table.source {
            PriorSource::Table => {
                0.5 * table.size * table.size + 0.5 * table.mean[i] * table.mean[j]
            }
            PriorSource::TableWithUncertainty => table.uncertainty[i] * table.uncertainty[j],
            PriorSource::Magnitude => table.size * table.size,
        };
        let across = |a: &Node, b: &Node| {
            matern_3_2_between(a.mach, b.mach, &grid.machs)
                * matern_3_2_between(a.third, b.third, &grid.thirds)
        };
        let covariance = PriorCovariance {
            shape: DMatrix::from_fn(n, n, shape),
            distance: DMatrix::from_fn(n, n, |i, j| {
                (nodes[i].alpha_deg - nodes[j].alpha_deg).abs()
            }),
            across: DMatrix::from_fn(n, n, |i, j| across(&nodes[i], &nodes[j])),
        };
        DerivativePrior {
            covariance,
            scale: ScalePrior::new(centre, table.source),
            name,
            source: table.source,
            mean: table.mean,
            grid,
        }
    }

    /// Tunnel's value at a condition; linear between the points of the grid.
    #[must_use]
    pub fn tunnel_value(&self, at: &Condition) -> f64 {
        let shares = self.grid.shares(at).into_iter();
        shares.map(|(i, share)| share * self.mean[i]).sum()
    }

    /// Half of the change from `step_deg` below a condition's angle of attack to `step_deg` above it.
    #[must_use]
    pub fn change_over(&self, scale: &Scale, at: &Condition, step_deg: f64) -> Change {
        let half_at = |step_deg: f64, half: f64| {
            let alpha_deg = at.alpha_deg + step_deg;
            let shares = self.grid.shares(&Condition { alpha_deg, ..*at });
            shares.into_iter().map(move |(i, share)| (i, half * share))
        };
        let both = half_at(step_deg, 0.5).chain(half_at(-step_deg, -0.5));
        let (places, weights): (Vec<usize>, Vec<f64>) = both.unzip();
        let weights = DVector::from_vec(weights);
        let covariance = self.covariance.select(&places, &places).for_scale(scale);
        let of_tunnel = places.iter().map(|&i| self.mean[i]);
        Change {
            of_tunnel: of_tunnel.zip(&weights).map(|(t, weight)| weight * t).sum(),
            variance: weights.dot(&(covariance * &weights)).max(0.0),
        }
    }

    /// Variance of the difference at a condition about the straight line between the neighbouring
    /// points of the grid.
    #[must_use]
    pub fn variance_between_points(&self, scale: &Scale, at: &Condition) -> f64 {
        let shares = self.grid.shares(at);
        let nodes = self.grid.nodes();
        let PriorCovariance {
            shape: shapes,
            across,
            ..
        } = &self.covariance;
        let correlation = |alpha_deg: f64, i: usize| {
            matern_3_2((alpha_deg - nodes[i].alpha_deg).abs() / scale.length_deg)
        };
        let (mut line, mut cross, mut shape) = (0.0, 0.0, 0.0);
        for &(i, share) in &shares {
            cross += share * correlation(at.alpha_deg, i);
            for &(j, other) in &shares {
                let between = correlation(nodes[j].alpha_deg, i) * across[(i, j)];
                line += share * other * between;
                shape += share * other * shapes[(i, j)];
            }
        }
        variance_factor(scale) * shape * (1.0 - 2.0 * cross + line).max(0.0)
    }
}

fn matern_3_2_between(a: Option<f64>, b: Option<f64>, points: &[f64]) -> f64 {
    let range = points
        .last()
        .zip(points.first())
        .map(|(high, low)| high - low);
    match (a, b, range) {
        (Some(a), Some(b), Some(range)) if range > 0.0 => matern_3_2((a - b).abs() / range),
        _ => 1.0,
    }
}
