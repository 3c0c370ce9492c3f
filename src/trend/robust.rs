//! Weighted least squares in which one outlier distorts neither the coefficients nor τ.
//!
//! | symbol | quantity | unit |
//! |---|---|---|
//! | n, p | number of points, number of coefficients | – |
//! | b, τ | bound of a point, scatter between maneuvers | derivative |
//! | V | diagonal matrix of the variances b² + τ² of the points | derivative² |
//! | X | design: value of each basis function (column) at each point (row) | – |
//! | u | residual of a point over its standard deviation √(b² + τ²) | – |
//! | ψ(u) | u limited to ±[`HUBER`] | – |
//! | m | share of the points with \|u\| up to [`HUBER`] | – |
//! | K | correction for few points, 1 + (p/n)(1 − m)/m | – |
//!
//! The solution weights a residual beyond [`HUBER`] standard deviations as if it were at that limit
//! (Huber's weights); τ² is Huber's proposal 2. The coefficients are an M-estimate, whose
//! covariance is (Huber 1981, section 7.6)
//!
//! K² · [Σψ²(u)/(n − p)] / m² · (Xᵀ V⁻¹ X)⁻¹.
//!
//! The bracket scales the covariance by the actual residuals instead of the residuals that bounds
//! and τ predict, which matters with few data.

use nalgebra::{DMatrix, DVector};

use super::scatter::{HUBER, total_variances};
use crate::numerics::linear_algebra::symmetric;
use crate::numerics::vectors::simd::vectorised;

/// Largest number of steps of the iteration between coefficients, τ² and Huber's weights; about ten
/// suffice.
const MOST_STEPS: usize = 100;
/// Change by a step below which the iteration has settled: of the trend over the smallest standard deviation,
/// and of each variance over itself.
const SETTLED: f64 = 1e-6;

/// Residual of one maneuver's estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Residual {
    /// Residual over its standard deviation, which the estimate's leverage on the trend reduces.
    pub z: f64,
    /// Huber's weight over the full weight 1/(b² + τ²): one, less for an outlier.
    pub share: f64,
}

/// Coefficients and scatter τ² of a design, solved together.
pub(super) struct RobustSolution {
    pub coefficients: DVector<f64>,
    /// (Xᵀ W X)⁻¹, with W the diagonal matrix of `weights`.
    inverse: DMatrix<f64>,
    /// Weight of each point: Huber's weight over the variance.
    weights: DVector<f64>,
    pub residuals: DVector<f64>,
    /// Variance b² + τ² of each point.
    pub variances: Vec<f64>,
}

impl RobustSolution {
    /// Solves for points with these values and squared bounds `bounds2`, with one τ for each
    /// stratum; `None` if the normal equations have none.
    pub(super) fn solve(
        design: &DMatrix<f64>,
        values: &DVector<f64>,
        bounds2: &[f64],
        strata: &[Vec<usize>],
    ) -> Option<RobustSolution> {
        let mut weights = inverse_variances(bounds2);
        let (mut coefficients, mut inverse) = weighted_solution(design, values, &weights)?;
        let mut variances = vec![f64::INFINITY; values.len()];
        for _ in 0..MOST_STEPS {
            let residuals = values - design * &coefficients;
            let freedom = residual_freedom(design, &weights, &inverse);
            let before = variances;
            variances = total_variances(&residuals, bounds2, &freedom, strata);
            let weighed = residuals
                .iter()
                .zip(&variances)
                .map(|(r, v)| weight(*r, *v));
            weights = DVector::from_iterator(values.len(), weighed);
            let next = weighted_solution(design, values, &weights)?;
            let moved = (design * (&next.0 - &coefficients)).amax();
            (coefficients, inverse) = next;
            if have_settled(&variances, &before) && moved <= SETTLED * smallest(&variances).sqrt() {
                break;
            }
        }
        Some(RobustSolution {
            residuals: values - design * &coefficients,
            coefficients,
            inverse,
            weights,
            variances,
        })
    }

    /// Residual and variance of each point.
    pub(super) fn deviations(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let residuals = self.residuals.iter().copied();
        residuals.zip(self.variances.iter().copied())
    }

    /// Covariance of the coefficients, by the equation of this file.
    pub(super) fn covariance(&self, design: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let (n, p) = (design.nrows() as f64, design.ncols() as f64);
        let u2 = || self.deviations().map(|(r, v)| r * r / v);
        let kept = u2().filter(|u2| *u2 <= HUBER * HUBER).count() as f64 / n;
        let cut: f64 = u2().map(|u2| u2.min(HUBER * HUBER)).sum();
        // At least half of the residuals lie within the cut of any fit worth publishing.
        let kept = kept.max(0.5);
        let correction = 1.0 + p / n * (1.0 - kept) / kept;
        let scale = correction * correction * cut / (n - p) / (kept * kept);
        let weights = inverse_variances(&self.variances);
        Some(weighted_solution(design, &self.residuals, &weights)?.1 * scale)
    }

    /// Residuals over their standard deviations: leverage reduces the variance of a residual.
    pub(super) fn standardised(&self, design: &DMatrix<f64>) -> Vec<Residual> {
        let residual = |(i, form): (usize, f64)| {
            let freedom = (1.0 - self.weights[i] * form).max(1e-6);
            Residual {
                z: self.residuals[i] / (self.variances[i] * freedom).sqrt(),
                share: self.weights[i] * self.variances[i],
            }
        };
        let quadratic_forms = quadratic_forms(design, &self.inverse).into_iter();
        quadratic_forms.enumerate().map(residual).collect()
    }
}

fn have_settled(variances: &[f64], before: &[f64]) -> bool {
    let mut pairs = variances.iter().zip(before);
    pairs.all(|(now, before)| (now - before).abs() <= SETTLED * now)
}

fn smallest(variances: &[f64]) -> f64 {
    variances.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Weights of the points from their variances alone, without Huber's weights.
pub(super) fn inverse_variances(variances: &[f64]) -> DVector<f64> {
    DVector::from_iterator(variances.len(), variances.iter().map(|v| 1.0 / v))
}

/// Degrees of freedom 1 − h that each residual keeps. The leverage h of a point is the share of its
/// value in the fitted value.
fn residual_freedom(
    design: &DMatrix<f64>,
    weights: &DVector<f64>,
    inverse: &DMatrix<f64>,
) -> Vec<f64> {
    let quadratic_forms = quadratic_forms(design, inverse).into_iter().zip(weights);
    quadratic_forms
        .map(|(form, weight)| (1.0 - weight * form).max(0.0))
        .collect()
}

/// Quadratic form x M xᵀ of each row x of the design with the matrix M, for all rows side by side. For
/// products this small the linear-algebra library takes several times as long.
fn quadratic_forms(design: &DMatrix<f64>, matrix: &DMatrix<f64>) -> Vec<f64> {
    let mut forms = vec![0.0; design.nrows()];
    let mut image = forms.clone();
    vectorised(
        #[inline(always)]
        || {
            for (own, elements) in design.column_iter().zip(matrix.column_iter()) {
                image.fill(0.0);
                for (values, element) in design.column_iter().zip(&elements) {
                    for (sum, value) in image.iter_mut().zip(values.as_slice()) {
                        *sum += element * value;
                    }
                }
                for ((form, image), value) in forms.iter_mut().zip(&image).zip(own.as_slice()) {
                    *form += image * value;
                }
            }
        },
    );
    forms
}

/// Coefficients and their covariance for given weights.
pub(super) fn weighted_solution(
    design: &DMatrix<f64>,
    values: &DVector<f64>,
    weights: &DVector<f64>,
) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let weighted = DMatrix::from_fn(design.nrows(), design.ncols(), |i, j| {
        weights[i] * design[(i, j)]
    });
    let weighted = weighted.transpose();
    let inverse = symmetric::inverse(&(&weighted * design))?;
    Some((&inverse * (&weighted * values), inverse))
}

/// Weight of a residual: one over the variance, less for an outlier.
fn weight(residual: f64, variance: f64) -> f64 {
    let u = residual.abs() / variance.sqrt();
    if u > HUBER {
        HUBER / u / variance
    } else {
        1.0 / variance
    }
}
