//! Prior of one derivative's difference from the tunnel: a Gaussian process over the flight
//! condition (Kennedy and O'Hagan 2001).
//!
//! With f the difference, t the tunnel's table over its root mean square ρ, s the relative size and ℓ
//! the length of the difference,
//!
//! cov f(α), f(α′) = s² ρ² (½ + ½ t t′) · ⅘ (M(|α − α′|/ℓ) + ¼),  M(d) = (1 + √3 d) exp(−√3 d).
//!
//! Half of the difference scales with the table, half does not. The quarter is an offset common to all
//! angles of attack. Where the table states its uncertainty u, u u′ stands for ρ² (½ + ½ t t′).
//! Across Mach number and third variable M falls over the range of the table.

use nalgebra::DMatrix;

use super::grid::{Grid, Node};
use crate::aero::Condition;
use crate::tables::Knowledge;

/// Standard deviation of the logarithm of the size.
const SPREAD_OF_SIZE: f64 = 0.8;

/// Standard deviation of the logarithm of the size of a table with stated uncertainties.
const SPREAD_OF_STATED_SIZE: f64 = 0.4;

/// Standard deviation of the logarithm of the length.
const SPREAD_OF_LENGTH: f64 = 0.5;

/// Share of the offset beside the part that fades over α.
const OFFSET: f64 = 0.25;

/// Prior of one derivative, or sum of derivatives.
#[derive(Clone, Debug)]
pub struct Prior {
    pub name: String,
    pub known: Knowledge,
    pub grid: Grid,
    /// Tunnel's value at the points of the grid; zero without a table.
    pub mean: Vec<f64>,
    /// Variance for unit size, pair by pair of points.
    shape: DMatrix<f64>,
    /// Distance over α, deg.
    distance: DMatrix<f64>,
    /// Correlation across Mach number and third variable.
    across: DMatrix<f64>,
    /// Centre of the prior of size and length.
    pub centre: Scale,
}

/// Size and length of a difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Size over that of the table, or over its stated uncertainty.
    pub size: f64,
    pub length_deg: f64,
}

/// Tunnel's table of a derivative, read at the points of a grid.
#[derive(Clone, Debug)]
pub struct Table {
    pub known: Knowledge,
    pub mean: Vec<f64>,
    /// Stated uncertainty at each point.
    pub uncertainty: Vec<f64>,
    /// Root mean square, or the order of magnitude.
    pub size: f64,
}

impl Prior {
    #[must_use]
    pub fn new(name: String, grid: Grid, table: Table, centre: Scale) -> Prior {
        let nodes = grid.nodes();
        let n = nodes.len();
        let shape = |i: usize, j: usize| match table.known {
            Knowledge::Table => 0.5 * table.size * table.size + 0.5 * table.mean[i] * table.mean[j],
            Knowledge::TableWithUncertainty => table.uncertainty[i] * table.uncertainty[j],
            Knowledge::Magnitude => table.size * table.size,
        };
        let across = |a: &Node, b: &Node| {
            fading_between(a.mach, b.mach, &grid.machs)
                * fading_between(a.third, b.third, &grid.thirds)
        };
        Prior {
            shape: DMatrix::from_fn(n, n, shape),
            distance: DMatrix::from_fn(n, n, |i, j| {
                (nodes[i].alpha_deg - nodes[j].alpha_deg).abs()
            }),
            across: DMatrix::from_fn(n, n, |i, j| across(&nodes[i], &nodes[j])),
            name,
            known: table.known,
            mean: table.mean,
            grid,
            centre,
        }
    }

    /// Covariance of the difference at the points of the grid.
    #[must_use]
    pub fn covariance(&self, scale: &Scale) -> DMatrix<f64> {
        self.scaled(scale, fading, OFFSET)
    }

    /// Derivative of the covariance by the logarithm of the length.
    #[must_use]
    pub fn covariance_by_length(&self, scale: &Scale) -> DMatrix<f64> {
        // With r = √3 d/ℓ, dM/d ln ℓ = −r dM/dr = r² exp(−r).
        let by_length = |distance: f64| {
            let r = 3f64.sqrt() * distance;
            r * r * (-r).exp()
        };
        self.scaled(scale, by_length, 0.0)
    }

    fn scaled(&self, scale: &Scale, over_alpha: impl Fn(f64) -> f64, offset: f64) -> DMatrix<f64> {
        let factor = scale.size * scale.size / (1.0 + OFFSET);
        DMatrix::from_fn(self.mean.len(), self.mean.len(), |i, j| {
            let at = (i, j);
            let fading = over_alpha(self.distance[at] / scale.length_deg) * self.across[at];
            factor * self.shape[at] * (fading + offset)
        })
    }

    /// Variance of what lies between the points of the grid: of the difference at a condition about the
    /// straight line through its neighbours.
    #[must_use]
    pub fn between(&self, scale: &Scale, at: &Condition) -> f64 {
        let shares = self.grid.shares(at);
        let nodes = self.grid.nodes();
        let correlation = |alpha_deg: f64, i: usize| {
            fading((alpha_deg - nodes[i].alpha_deg).abs() / scale.length_deg)
        };
        let (mut line, mut cross, mut shape) = (0.0, 0.0, 0.0);
        for &(i, share) in &shares {
            cross += share * correlation(at.alpha_deg, i);
            for &(j, other) in &shares {
                let fading = correlation(nodes[j].alpha_deg, i) * self.across[(i, j)];
                line += share * other * fading;
                shape += share * other * self.shape[(i, j)];
            }
        }
        let factor = scale.size * scale.size / (1.0 + OFFSET);
        factor * shape * (1.0 - 2.0 * cross + line).max(0.0)
    }

    /// −log of the prior of a scale, with its derivatives by the logarithms of size and length.
    #[must_use]
    pub fn penalty(&self, scale: &Scale) -> (f64, [f64; 2]) {
        let size = (scale.size / self.centre.size).ln() / self.spread_of_size();
        let length = (scale.length_deg / self.centre.length_deg).ln() / SPREAD_OF_LENGTH;
        (
            0.5 * (size * size + length * length),
            [size / self.spread_of_size(), length / SPREAD_OF_LENGTH],
        )
    }

    fn spread_of_size(&self) -> f64 {
        match self.known {
            Knowledge::TableWithUncertainty => SPREAD_OF_STATED_SIZE,
            Knowledge::Table | Knowledge::Magnitude => SPREAD_OF_SIZE,
        }
    }
}

/// Matérn correlation of order 3/2 at a distance over its length.
#[must_use]
pub fn fading(distance: f64) -> f64 {
    let r = 3f64.sqrt() * distance;
    (1.0 + r) * (-r).exp()
}

fn fading_between(a: Option<f64>, b: Option<f64>, points: &[f64]) -> f64 {
    let range = points
        .last()
        .zip(points.first())
        .map(|(high, low)| high - low);
    match (a, b, range) {
        (Some(a), Some(b), Some(range)) if range > 0.0 => fading((a - b).abs() / range),
        _ => 1.0,
    }
}
