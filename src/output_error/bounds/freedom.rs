//! How well a variance from coloured residuals is known: the noise's spectrum is itself an estimate
//! from a few seconds, so normal intervals are too short, and Student's t takes the normal
//! distribution's place.
//!
//! An output gives a parameter the variance V = σ² Q(φ), Q being Σ u² of what the process 1/A
//! filters the parameter's sensitivities to. Of an autoregressive process fitted to N values var σ²
//! = 2σ⁴/N and cov φ = σ² Γ⁻¹/N, independent of each other (Brockwell and Davis 1991, sections 8.1
//! and 10.8), with σ² Γ⁻¹ = L Lᵀ − U Uᵀ of its own coefficients (Siddiqui 1958). Then var V = 2V²/N
//! + σ⁴ ∇Qᵀ cov φ ∇Q (delta method), where ∂u/∂φ_i is −u filtered once more, i samples late.
//! Variances of several outputs add up to V with ν = 2V²/Σ var V degrees of freedom (Satterthwaite
//! 1946).

use super::autoregression::Autoregression;
use crate::numerics::matrix::Padded;

/// A variance, and the variance of it as an estimate, of each parameter.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Known {
    variance: Vec<f64>,
    of_variance: Vec<f64>,
}

/// Fewer degrees of freedom are not told from so many: the delta method is none for variances known
/// to less than their size.
const FEWEST: f64 = 3.0;

impl Known {
    pub fn nothing(parameters: usize) -> Known {
        Known {
            variance: vec![0.0; parameters],
            of_variance: vec![0.0; parameters],
        }
    }

    /// Adds independent parts that are known with so many degrees of freedom.
    pub fn add(&mut self, parts: impl Iterator<Item = f64>, freedom: f64) {
        for ((variance, of), part) in self
            .variance
            .iter_mut()
            .zip(&mut self.of_variance)
            .zip(parts)
        {
            *variance += part;
            *of += 2.0 * part * part / freedom.max(1.0);
        }
    }

    /// Degrees of freedom of each variance.
    pub fn freedom(&self) -> Vec<f64> {
        let of = |(variance, of): (&f64, &f64)| {
            if *of > 0.0 {
                2.0 * variance * variance / of
            } else {
                f64::INFINITY
            }
        };
        self.variance
            .iter()
            .zip(&self.of_variance)
            .map(of)
            .collect()
    }
}

/// What one output's process gives each parameter.
pub(crate) struct Part<'a> {
    pub noise: &'a Autoregression,
    /// The change of the estimates with each value of the output, filtered by the process until
    /// that has died away.
    pub filtered: Padded,
    /// Values the process is known from, less what the parameters took of them.
    pub freedom: f64,
    pub known: &'a mut Known,
}

impl Part<'_> {
    /// Adds it to what is known.
    pub fn add(self) {
        let Part {
            noise,
            filtered,
            freedom,
            known,
        } = self;
        let order = noise.coefficients.len();
        let mut twice = filtered.clone();
        twice.filter(&noise.coefficients);
        let covariance = coefficient_covariance(&noise.coefficients, freedom);
        // Σ u², and −½ of its slopes along the coefficients.
        let square = filtered.column_products(&filtered, 0);
        let slopes: Vec<Vec<f64>> = (1..=order)
            .map(|i| twice.column_products(&filtered, i))
            .collect();
        for (j, (known, of_known)) in known
            .variance
            .iter_mut()
            .zip(&mut known.of_variance)
            .enumerate()
        {
            let (variance, slope) = (noise.innovation * square[j], |i: usize| {
                -2.0 * noise.innovation * slopes[i][j]
            });
            let mut of_variance = 2.0 * variance * variance / freedom.max(1.0);
            for (i, row) in covariance.iter().enumerate() {
                of_variance += row
                    .iter()
                    .enumerate()
                    .map(|(l, c)| slope(i) * c * slope(l))
                    .sum::<f64>();
            }
            *known += variance;
            *of_known += of_variance;
        }
    }
}

/// Covariance of the coefficients of a process that is known from so many values.
fn coefficient_covariance(coefficients: &[f64], values: f64) -> Vec<Vec<f64>> {
    let p = coefficients.len();
    let forward = |i: usize, k: usize| if i == k { 1.0 } else { coefficients[i - k - 1] };
    let backward = |i: usize, k: usize| coefficients[p - 1 - (i - k)];
    let at = |i: usize, j: usize| {
        let part = |k: usize| forward(i, k) * forward(j, k) - backward(i, k) * backward(j, k);
        (0..=i.min(j)).map(part).sum::<f64>() / values.max(1.0)
    };
    (0..p).map(|i| (0..p).map(|j| at(i, j)).collect()).collect()
}

/// By how much an interval of 95 % of Student's distribution is longer than the normal one: the
/// expansion of Abramowitz and Stegun 26.7.5, to 0.2 % from three degrees of freedom on.
#[must_use]
pub fn longer(freedom: f64) -> f64 {
    const X: f64 = 1.959_963_984_540_054;
    let (v, x2) = (freedom.max(FEWEST), X * X);
    // The terms over x, in powers of x².
    let first = (x2 + 1.0) / 4.0;
    let second = ((5.0 * x2 + 16.0) * x2 + 3.0) / 96.0;
    let third = (((3.0 * x2 + 19.0) * x2 + 17.0) * x2 - 15.0) / 384.0;
    let fourth = ((((79.0 * x2 + 776.0) * x2 + 1482.0) * x2 - 1920.0) * x2 - 945.0) / 92_160.0;
    1.0 + (first + (second + (third + fourth / v) / v) / v) / v
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use nalgebra::DMatrix;
    use statrs::distribution::{ContinuousCDF, StudentsT};

    use super::*;
    use crate::output_error::tests::Noise;

    #[test]
    fn intervals_are_longer_as_student_says() {
        for freedom in [3.0, 4.0, 6.5, 10.0, 30.0, 1000.0] {
            let t = StudentsT::new(0.0, 1.0, freedom)
                .unwrap()
                .inverse_cdf(0.975);
            assert_relative_eq!(
                longer(freedom),
                t / 1.959_963_984_540_054,
                max_relative = 2e-3
            );
        }
        assert_relative_eq!(longer(f64::INFINITY), 1.0);
        assert_relative_eq!(longer(0.0), longer(3.0));
    }

    #[test]
    fn the_coefficients_covariance_is_the_inverse_of_the_process_s_own() {
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

    /// Degrees of freedom of the variance of the mean of so many values.
    fn of_the_mean(noise: &Autoregression, values: usize) -> (f64, f64) {
        let changes = Padded::column(&vec![1.0 / values as f64; values]);
        let mut filtered = changes.followed_by(noise.memory(values));
        filtered.filter(&noise.coefficients);
        let mut known = Known::nothing(1);
        Part {
            noise,
            filtered,
            freedom: values as f64 - 1.0,
            known: &mut known,
        }
        .add();
        (known.variance[0], known.freedom()[0])
    }

    #[test]
    fn the_variance_of_a_mean_of_white_values_has_as_many_degrees_of_freedom_as_residuals() {
        let white = Autoregression {
            coefficients: vec![],
            innovation: 2.0,
        };
        let (variance, freedom) = of_the_mean(&white, 20);
        assert_relative_eq!(variance, 2.0 / 20.0, max_relative = 1e-12);
        assert_relative_eq!(freedom, 19.0, max_relative = 1e-12);
    }

    #[test]
    fn the_scatter_of_variances_of_a_coloured_mean_is_as_said() {
        // First-order processes of 400 values, fitted again and again.
        let (values, draws, a) = (400, 400, 0.6);
        let truth = Autoregression {
            coefficients: vec![-a],
            innovation: 1.0,
        };
        let (_, freedom) = of_the_mean(&truth, values);
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
            variances.push(of_the_mean(&fitted, values).0);
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
