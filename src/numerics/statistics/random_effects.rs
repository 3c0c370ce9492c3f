//! Random effects: one quantity, observed several times with known errors and an unknown scatter.
//!
//! y_i = x_iᵀ β + u_i + e_i with e_i of the known variance s_i² and u_i of the common variance τ².
//! With weights w_i = 1/(s_i² + τ²) the coefficients β are those of weighted least squares. τ²
//! solves the moment equation of Paule and Mandel, Σ w_i (y_i − x_iᵀ β)² = n − p. τ² is zero where
//! the left side is below n − p without scatter. For equal s_i this is restricted maximum
//! likelihood. (R. C. Paule, J. Mandel, J. Res. NBS 87 (1982) 377; R. DerSimonian, R. Kacker,
//! Contemp. Clin. Trials 28 (2007) 105.) The trends solve the same equation for residuals of a given fit, with
//! Huber's cut (`scatter.rs` of the trends).

use nalgebra::{SMatrix, SVector};

use super::chi_squared;
use super::normal::NORMAL_90;
use crate::numerics::bisection::try_last_that_holds;

/// Halvings of the interval of τ²: to 2⁻⁶⁰ of its length, the last digit. The ends are at most a
/// factor of four apart, unless τ² is below the smallest variance.
const HALVINGS: usize = 60;

/// Probability that the scatter exceeds its limit.
const TAIL: f64 = 0.1;

/// An observation with its variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    pub value: f64,
    pub variance: f64,
}

/// Coefficients of a regression with random effects.
#[derive(Clone, Debug, PartialEq)]
pub struct RandomEffects<const P: usize> {
    pub coefficients: SVector<f64, P>,
    pub covariance: SMatrix<f64, P, P>,
    /// τ².
    pub scatter_variance: f64,
    /// Observations less coefficients.
    pub degrees_of_freedom: f64,
}

/// Weighted least squares at one τ².
struct WeightedFit<const P: usize> {
    coefficients: SVector<f64, P>,
    covariance: SMatrix<f64, P, P>,
    /// Σ w (y − xᵀβ)².
    squares: f64,
}

impl<const P: usize> RandomEffects<P> {
    /// Fit with the regressors of each observation. `None` with too few observations, or where they do
    /// not determine the coefficients.
    #[must_use]
    pub fn of(
        observations: &[Observation],
        regressors: impl Fn(usize) -> [f64; P],
    ) -> Option<RandomEffects<P>> {
        let freedom = observations.len().checked_sub(P).filter(|f| *f > 0)? as f64;
        let scatter_variance = scatter_variance(observations, &regressors, freedom)?;
        let fit = WeightedFit::of(observations, &regressors, scatter_variance)?;
        Some(RandomEffects {
            coefficients: fit.coefficients,
            covariance: fit.covariance,
            scatter_variance,
            degrees_of_freedom: freedom,
        })
    }
}

impl RandomEffects<1> {
    /// Mean of the observations.
    #[must_use]
    pub fn mean_of(observations: &[Observation]) -> Option<RandomEffects<1>> {
        RandomEffects::of(observations, |_| [1.0])
    }

    /// Upper 90 % limit of τ²: the larger of two limits. At the first one, the weighted sum of
    /// squares about the mean, which has a χ² distribution, is at its lower 10 % (W. Viechtbauer,
    /// Stat. Med. 26 (2007) 37). The second is the smallest τ² that the observations can show: 1.28
    /// times its standard error √(2/Σ s⁻⁴) without scatter. It covers the case of variances that
    /// are stated too large, which hide a scatter from the first limit.
    #[must_use]
    pub fn scatter_limit(&self, observations: &[Observation]) -> Option<f64> {
        let least = chi_squared::quantile(TAIL, self.degrees_of_freedom)?;
        let shown = scatter_variance(observations, &|_| [1.0], least)?;
        let information: f64 = observations.iter().map(|y| y.variance.powi(-2)).sum();
        Some(shown.max(NORMAL_90 * (2.0 / information).sqrt()))
    }

    #[must_use]
    pub fn mean(&self) -> f64 {
        self.coefficients[0]
    }

    /// Variance of the mean.
    #[must_use]
    pub fn variance(&self) -> f64 {
        self.covariance[(0, 0)]
    }
}

/// τ² at which the weighted sum of squares is `wanted`; zero where it is less without scatter. The sum
/// falls with τ².
fn scatter_variance<const P: usize>(
    observations: &[Observation],
    regressors: &impl Fn(usize) -> [f64; P],
    wanted: f64,
) -> Option<f64> {
    let squares = |scatter| Some(WeightedFit::of(observations, regressors, scatter)?.squares);
    if squares(0.0)? <= wanted {
        return Some(0.0);
    }
    let variances = observations.iter().map(|y| y.variance);
    let least = variances.fold(f64::INFINITY, f64::min);
    let (mut low, mut high) = (0.0, least.max(f64::MIN_POSITIVE));
    while squares(high)? > wanted {
        low = high;
        high *= 4.0;
    }
    let is_too_small = |scatter| Some(squares(scatter)? > wanted);
    let (low, high) = try_last_that_holds((low, high), HALVINGS, is_too_small)?;
    Some(0.5 * (low + high))
}

impl<const P: usize> WeightedFit<P> {
    fn of(
        observations: &[Observation],
        regressors: impl Fn(usize) -> [f64; P],
        scatter: f64,
    ) -> Option<WeightedFit<P>> {
        let mut information = SMatrix::<f64, P, P>::zeros();
        let mut moment = SVector::<f64, P>::zeros();
        let rows = observations.iter().enumerate();
        let rows = rows.map(|(i, y)| {
            let weight = 1.0 / (y.variance + scatter);
            (SVector::from(regressors(i)), y.value, weight)
        });
        for (x, y, weight) in rows.clone() {
            information += weight * x * x.transpose();
            moment += weight * y * x;
        }
        let covariance = information.try_inverse()?;
        let coefficients = covariance * moment;
        let squares = rows
            .map(|(x, y, weight)| weight * (y - x.dot(&coefficients)).powi(2))
            .sum();
        Some(WeightedFit {
            coefficients,
            covariance,
            squares,
        })
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::numerics::statistics::random::RandomStream;
    use crate::numerics::statistics::student;

    fn observations(values: &[f64], deviations: &[f64]) -> Vec<Observation> {
        let both = values.iter().zip(deviations);
        both.map(|(value, deviation)| Observation {
            value: *value,
            variance: deviation * deviation,
        })
        .collect()
    }

    #[test]
    fn equal_errors_have_the_scatter_of_restricted_maximum_likelihood() {
        let values = [1.0, 2.0, 4.0, 9.0];
        let found = RandomEffects::mean_of(&observations(&values, &[0.5; 4])).unwrap();
        let variance = values.iter().map(|v| (v - 4.0_f64).powi(2)).sum::<f64>() / 3.0;
        assert_relative_eq!(found.mean(), 4.0, max_relative = 1e-12);
        assert_relative_eq!(found.scatter_variance, variance - 0.25, max_relative = 1e-9);
        assert_relative_eq!(found.variance(), variance / 4.0, max_relative = 1e-9);
    }

    #[test]
    fn observations_that_agree_have_no_scatter_and_the_weighted_mean() {
        let found = RandomEffects::mean_of(&observations(&[1.0, 1.2, 0.9], &[1.0, 2.0, 0.5]));
        let found = found.unwrap();
        assert!(found.scatter_variance == 0.0);
        assert_relative_eq!(found.mean(), (1.0 + 0.3 + 3.6) / 5.25, max_relative = 1e-12);
        assert_relative_eq!(found.variance(), 1.0 / 5.25, max_relative = 1e-12);
        assert!(RandomEffects::mean_of(&observations(&[1.0], &[1.0])).is_none());
    }

    #[test]
    fn a_line_with_scatter_has_the_coefficients_of_least_squares() {
        let values = [0.0, 1.0, 5.0, 4.0, 9.0];
        let line = |i: usize| [1.0, i as f64];
        let found = RandomEffects::of(&observations(&values, &[1e-9; 5]), line).unwrap();
        // Slope Σ (x − 2) y / 10, and the residual variance over n − 2.
        let slope = (-1.0 + 4.0 + 18.0) / 10.0;
        let residual = |i: usize| values[i] - 3.8 - slope * (i as f64 - 2.0);
        let variance = (0..5).map(|i| residual(i).powi(2)).sum::<f64>() / 3.0;
        assert_relative_eq!(found.coefficients[1], slope, max_relative = 1e-9);
        assert_relative_eq!(
            found.covariance[(1, 1)],
            variance / 10.0,
            max_relative = 1e-9
        );
    }

    #[test]
    fn the_limit_of_the_scatter_is_what_the_observations_would_not_show() {
        let observations = observations(&[1.0; 8], &[0.5; 8]);
        let found = RandomEffects::mean_of(&observations).unwrap();
        let limit = found.scatter_limit(&observations).unwrap();
        assert_relative_eq!(limit, 1.281_551_6 * 0.25 * 0.5, max_relative = 1e-6);
    }

    #[test]
    fn the_limit_of_the_scatter_holds_it() {
        const TIMES: usize = 300;
        let mut random = RandomStream::new(9, "scatter");
        let mut above = 0;
        for _ in 0..TIMES {
            let values: Vec<f64> = (0..8)
                .map(|_| (1.0_f64 + 0.25).sqrt() * random.normal())
                .collect();
            let observations = observations(&values, &[0.5; 8]);
            let found = RandomEffects::mean_of(&observations).unwrap();
            above += usize::from(found.scatter_limit(&observations).unwrap() < 1.0);
        }
        let share = above as f64 / TIMES as f64;
        assert!((share - TAIL).abs() < 0.05, "{share} beyond the limit");
    }

    #[test]
    fn intervals_of_the_mean_hold_it() {
        const TIMES: usize = 600;
        let mut random = RandomStream::new(7, "random effects");
        let mut inside = 0;
        for _ in 0..TIMES {
            let draw = |k: usize| {
                let deviation = 0.3 + 0.2 * (k % 4) as f64;
                let value = 5.0 + 0.8 * random.normal() + deviation * random.normal();
                (value, deviation)
            };
            let (values, deviations): (Vec<f64>, Vec<f64>) = (0..8).map(draw).unzip();
            let found = RandomEffects::mean_of(&observations(&values, &deviations)).unwrap();
            let width = student::quantile_95(found.degrees_of_freedom) * found.variance().sqrt();
            inside += usize::from((found.mean() - 5.0).abs() < width);
        }
        let share = inside as f64 / TIMES as f64;
        assert!((share - 0.95).abs() < 0.03, "{share}");
    }
}
