//! Prior covariance of one derivative's difference between points of its grid, for any size and length
//! (the equation is that of module `prior`).

use nalgebra::DMatrix;

use super::scale_prior::Scale;
use crate::numerics::statistics::matern::matern_3_2;

/// Variance of the offset over the variance of the part that fades over α.
const OFFSET: f64 = 0.25;

/// Covariance between two lists of points.
#[derive(Clone, Debug)]
pub struct PriorCovariance {
    /// Variance for unit size, pair by pair of points.
    pub shape: DMatrix<f64>,
    /// Distance over α, deg.
    pub distance: DMatrix<f64>,
    /// Correlation across Mach number and third variable.
    pub across: DMatrix<f64>,
}

/// Covariance for a scale, with its first and second derivative by the logarithm of the length. The
/// derivative of each by the logarithm of the size is twice the matrix itself.
#[derive(Clone, Debug)]
pub struct CovarianceSlopes {
    pub value: DMatrix<f64>,
    pub by_length: DMatrix<f64>,
    pub by_length_twice: DMatrix<f64>,
}

impl PriorCovariance {
    /// Covariance between some of the points.
    #[must_use]
    pub fn select(&self, rows: &[usize], columns: &[usize]) -> PriorCovariance {
        let select = |matrix: &DMatrix<f64>| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
                matrix[(rows[i], columns[j])]
            })
        };
        PriorCovariance {
            shape: select(&self.shape),
            distance: select(&self.distance),
            across: select(&self.across),
        }
    }

    /// Covariance for a scale.
    #[must_use]
    pub fn for_scale(&self, scale: &Scale) -> DMatrix<f64> {
        let factor = variance_factor(scale);
        self.for_each_pair(|at| {
            let correlation = matern_3_2(self.distance[at] / scale.length_deg) * self.across[at];
            factor * self.shape[at] * (correlation + OFFSET)
        })
    }

    /// Covariance for a scale with its derivatives. With r = √3 d/ℓ, dM/d ln ℓ = −r dM/dr = r² exp(−r), and
    /// d²M/(d ln ℓ)² = (r³ − 2 r²) exp(−r).
    #[must_use]
    pub fn slopes(&self, scale: &Scale) -> CovarianceSlopes {
        let factor = variance_factor(scale);
        let r = self.distance.map(|d| 3f64.sqrt() * d / scale.length_deg);
        let faded = r.map(|r| (-r).exp());
        let covariance = |at| factor * self.shape[at] * self.across[at] * faded[at];
        let offset = |at| factor * self.shape[at] * OFFSET;
        CovarianceSlopes {
            value: self.for_each_pair(|at| covariance(at) * (1.0 + r[at]) + offset(at)),
            by_length: self.for_each_pair(|at| covariance(at) * r[at] * r[at]),
            by_length_twice: self
                .for_each_pair(|at| covariance(at) * r[at] * r[at] * (r[at] - 2.0)),
        }
    }

    fn for_each_pair(&self, value: impl Fn((usize, usize)) -> f64) -> DMatrix<f64> {
        let (rows, columns) = self.shape.shape();
        DMatrix::from_fn(rows, columns, |i, j| value((i, j)))
    }
}

/// Factor of `shape` for a size s: s² over the correlation 1 + `OFFSET` at distance zero. The
/// variance at a point is thus s² times its shape.
#[must_use]
pub fn variance_factor(scale: &Scale) -> f64 {
    scale.size * scale.size / (1.0 + OFFSET)
}
