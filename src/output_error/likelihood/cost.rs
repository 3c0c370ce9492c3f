//! The cost J (1.2), its gradient (1.4) and the Gauss-Newton second gradient (1.5), as sums over
//! the samples that count.
//!
//! The sums omit the printed factor 1/(n_t n_z), so that the information matrix (1.7) is the second
//! gradient without any factor. [`Sums::cost`] is J as printed.

use nalgebra::{DMatrix, DVector};

use crate::dynamics::OUTPUTS;
use crate::output_error::case::Measurements;
use crate::output_error::kernel::response::Response;

/// Sums Σ w v², Σ Sᵀ W v and Σ Sᵀ W S over the samples that count, with residuals v, sensitivities
/// S and weights w.
#[derive(Clone, Debug, PartialEq)]
pub struct Sums {
    pub weighted_square: f64,
    pub gradient: DVector<f64>,
    pub information: DMatrix<f64>,
    /// Number of output samples that count.
    pub count: usize,
}

impl Sums {
    /// Cost J (1.2).
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.weighted_square / (2.0 * self.count.max(1) as f64)
    }
}

/// Residuals, measured minus computed; zero where a sample does not count.
#[must_use]
pub fn residuals(measurements: &Measurements, response: &Response) -> Vec<[f64; OUTPUTS]> {
    let rows = measurements
        .values
        .iter()
        .zip(&measurements.used)
        .zip(&response.outputs);
    rows.map(|((z, used), y)| std::array::from_fn(|o| if used[o] { z[o] - y[o] } else { 0.0 }))
        .collect()
}

/// Sums of a response for weights W (on residuals in deg, deg/s and g).
#[must_use]
pub fn sums(response: &Response, weights: &[f64; OUTPUTS]) -> Sums {
    let sums = &response.sums;
    Sums {
        weighted_square: (0..OUTPUTS).map(|o| weights[o] * sums.square(o)).sum(),
        gradient: sums.gradient(weights),
        information: sums.information(weights),
        count: (0..OUTPUTS).map(|o| sums.count(o)).sum(),
    }
}

/// Variances of the residuals v, from Σ v² and the number of samples of each output. The
/// parameters' degrees of freedom are spread evenly over the outputs.
#[must_use]
pub fn residual_variances(outputs: [(f64, usize); OUTPUTS], parameters: usize) -> [f64; OUTPUTS] {
    let total: usize = outputs.iter().map(|(_, used)| used).sum();
    let free_share = 1.0 - (parameters as f64 / total.max(1) as f64).min(0.9);
    outputs.map(|(square, used)| square / (used.max(1) as f64 * free_share))
}

/// Adds w s sᵀ to the lower triangle.
pub(super) fn add_square(matrix: &mut DMatrix<f64>, w: f64, s: &[f64]) {
    for (j, mut column) in matrix.column_iter_mut().enumerate() {
        let factor = w * s[j];
        for (m, s) in column.as_mut_slice()[j..].iter_mut().zip(&s[j..]) {
            *m += factor * s;
        }
    }
}
