//! Degrees of freedom of a variance from coloured residuals. The noise's spectrum is itself
//! estimated from a few seconds of data. Normal intervals are therefore too short, and Student's t
//! replaces them.
//!
//! | symbol | quantity |
//! |---|---|
//! | N | number of independent values from which the process is fitted |
//! | φ, σ² | coefficients of the autoregressive process A, and variance of its innovations |
//! | u | changes of one estimate with the values of an output, filtered by 1/A |
//! | Q = Σ u² | so that V = σ² Q is the variance of the estimate from this output |
//! | Γ | autocovariance matrix of the process |
//! | L, U | lower triangular matrices of the coefficients, with σ² Γ⁻¹ = L Lᵀ − U Uᵀ (Siddiqui 1958) |
//!
//! σ² and φ are independent, with var σ² = 2σ⁴/N and cov φ = σ² Γ⁻¹/N (Brockwell and Davis 1991,
//! sections 8.1 and 10.8). The delta method gives
//!
//! var V = 2V²/N + σ⁴ ∇Qᵀ cov φ ∇Q,
//!
//! where ∂u/∂φ_i is −u filtered once more, i samples late. Several outputs add their variances V.
//! The sum has ν = 2 (Σ V)²/Σ var V degrees of freedom (Satterthwaite 1946).

use super::autoregression::Autoregression;
use crate::numerics::linear_algebra::matrix::AlignedMatrix;

/// Estimated variance of each parameter, with the variance of that estimate.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct VarianceEstimates {
    variances: Vec<f64>,
    /// Variances of the variances.
    uncertainties: Vec<f64>,
}

/// Part of the variances from the coloured noise of one output.
pub(crate) struct ColouredPart<'a> {
    pub noise: &'a Autoregression,
    /// Changes of the estimates with each value of the output, filtered until they have decayed.
    pub filtered: AlignedMatrix,
    /// Degrees of freedom of the process: values, less those that the parameters absorb.
    pub degrees_of_freedom: f64,
}

impl VarianceEstimates {
    pub fn zero(parameters: usize) -> VarianceEstimates {
        VarianceEstimates {
            variances: vec![0.0; parameters],
            uncertainties: vec![0.0; parameters],
        }
    }

    /// Adds independent variances with these degrees of freedom.
    pub fn add(&mut self, variances: impl Iterator<Item = f64>, degrees_of_freedom: f64) {
        for (j, variance) in variances.enumerate().take(self.variances.len()) {
            self.variances[j] += variance;
            self.uncertainties[j] += 2.0 * variance * variance / degrees_of_freedom.max(1.0);
        }
    }

    /// Adds the variances from the coloured noise of one output.
    pub fn add_coloured(&mut self, part: &ColouredPart) {
        let ColouredPart {
            noise,
            filtered,
            degrees_of_freedom,
        } = part;
        let mut twice = filtered.clone();
        twice.filter_columns(&noise.coefficients);
        let covariance = coefficient_covariance(&noise.coefficients, *degrees_of_freedom);
        // Q, and −½ times its slopes along the coefficients.
        let square = filtered.lagged_products_by_column(filtered, 0);
        let slopes: Vec<Vec<f64>> = (1..=noise.coefficients.len())
            .map(|lag| twice.lagged_products_by_column(filtered, lag))
            .collect();
        for j in 0..self.variances.len() {
            let variance = noise.innovation * square[j];
            let gradient: Vec<f64> = slopes
                .iter()
                .map(|slopes| -2.0 * noise.innovation * slopes[j])
                .collect();
            let mut uncertainty = 2.0 * variance * variance / degrees_of_freedom.max(1.0);
            for (slope, row) in gradient.iter().zip(&covariance) {
                uncertainty += row
                    .iter()
                    .zip(&gradient)
                    .map(|(c, other)| slope * c * other)
                    .sum::<f64>();
            }
            self.variances[j] += variance;
            self.uncertainties[j] += uncertainty;
        }
    }

    /// Degrees of freedom of each variance; infinite for an exact one.
    pub fn degrees_of_freedom(&self) -> Vec<f64> {
        let pairs = self.variances.iter().zip(&self.uncertainties);
        pairs
            .map(|(variance, uncertainty)| {
                if *uncertainty > 0.0 {
                    2.0 * variance * variance / uncertainty
                } else {
                    f64::INFINITY
                }
            })
            .collect()
    }
}

/// Covariance (L Lᵀ − U Uᵀ)/N of the coefficients of a process that is fitted to N values.
fn coefficient_covariance(coefficients: &[f64], values: f64) -> Vec<Vec<f64>> {
    let p = coefficients.len();
    let lower = |i: usize, k: usize| if i == k { 1.0 } else { coefficients[i - k - 1] };
    let upper = |i: usize, k: usize| coefficients[p - 1 - (i - k)];
    let mut covariance = vec![vec![0.0; p]; p];
    for (i, row) in covariance.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            let products =
                (0..=i.min(j)).map(|k| lower(i, k) * lower(j, k) - upper(i, k) * upper(j, k));
            *entry = products.sum::<f64>() / values.max(1.0);
        }
    }
    covariance
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use nalgebra::DMatrix;

    use super::*;
    use crate::output_error::tests::Noise;

    #[test]
    fn the_covariance_of_the_coefficients_is_the_inverse_of_the_process_s() {
        // v_k = 1.2 v_{k−1} − 0.5 v_{k−2} + e_k: ρ1 = 1.2/1.5, γ0 = σ²/(1 − 1.2 ρ1 + 0.5 ρ2).
        let (r1, r2) = (0.8, 1.2 * 0.8 - 0.5);
        let variance = 1.0 / (1.0 - 1.2 * r1 + 0.5 * r2);
        let own =
            DMatrix::from_row_slice(2, 2, &[variance, variance * r1, variance * r1, variance]);
        let expected = own.try_inverse().unwrap() / 50.0;
        let said = coefficient_covariance(&[-1.2, 0.5], 50.0);
        for i in 0..2 {
            for j in 0..2 {
                assert_relative_eq!(said[i][j], expected[(i, j)], max_relative = 1e-12);
            }
        }
    }

    /// Variance of a mean, with its degrees of freedom.
    fn variance_of_mean(noise: &Autoregression, values: usize) -> (f64, f64) {
        let mut changes = AlignedMatrix::zeros(values, 1);
        changes
            .rows_mut()
            .for_each(|row| row[0] = 1.0 / values as f64);
        let mut filtered = changes.with_zero_rows(noise.memory(values));
        filtered.filter_columns(&noise.coefficients);
        let mut estimates = VarianceEstimates::zero(1);
        estimates.add_coloured(&ColouredPart {
            noise,
            filtered,
            degrees_of_freedom: values as f64 - 1.0,
        });
        (estimates.variances[0], estimates.degrees_of_freedom()[0])
    }

    #[test]
    fn the_variance_of_a_mean_of_white_values_has_as_many_degrees_of_freedom_as_residuals() {
        let white = Autoregression {
            coefficients: vec![],
            innovation: 2.0,
        };
        let (variance, freedom) = variance_of_mean(&white, 20);
        assert_relative_eq!(variance, 2.0 / 20.0, max_relative = 1e-12);
        assert_relative_eq!(freedom, 19.0, max_relative = 1e-12);
    }

    #[test]
    fn variances_of_a_coloured_mean_scatter_as_their_degrees_of_freedom_predict() {
        // First-order processes of 400 values, fitted again and again.
        let (values, draws, a) = (400, 400, 0.6);
        let truth = Autoregression {
            coefficients: vec![-a],
            innovation: 1.0,
        };
        let (_, freedom) = variance_of_mean(&truth, values);
        let mut noise = Noise(31);
        let mut variances = Vec::new();
        for _ in 0..draws {
            let mut v = 0.0;
            let series: Vec<f64> = (0..values)
                .map(|_| {
                    v = a * v + noise.gaussian();
                    v
                })
                .collect();
            let lag = |l: usize| {
                series
                    .iter()
                    .zip(&series[l..])
                    .map(|(a, b)| a * b)
                    .sum::<f64>()
                    / values as f64
            };
            let fitted = Autoregression::fitted(&[lag(0), lag(1)], values as f64);
            variances.push(variance_of_mean(&fitted, values).0);
        }
        let mean = variances.iter().sum::<f64>() / f64::from(draws);
        let of = variances
            .iter()
            .map(|v| (v - mean) * (v - mean))
            .sum::<f64>()
            / f64::from(draws);
        // 400 draws give the variance of a variance to some 10%.
        assert_relative_eq!(2.0 * mean * mean / of, freedom, max_relative = 0.25);
    }
}
