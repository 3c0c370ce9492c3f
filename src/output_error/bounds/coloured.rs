//! Covariance of the estimates under coloured residuals (after Morelli and Klein 1997).
//!
//! | symbol | quantity | unit |
//! |---|---|---|
//! | S | sensitivities of one output's samples to the parameters | output/parameter |
//! | W | weight of the output in the cost | 1/output² |
//! | H = Σ Sᵀ W S | information matrix, summed over the outputs | 1/parameter² |
//! | R | autocovariance of the output's noise between any two samples | output² |
//! | C = S H⁻¹ W | change of the estimates with each sample of the output | parameter/output |
//! | K = Cᵀ R C | covariance of the estimates from the output's noise | parameter² |
//!
//! S has a row for each sample. The covariance of the estimates is the sum of K over the outputs,
//! H⁻¹ [Σ Sᵀ W R W S] H⁻¹. Every variance is a sum of squares with degrees of freedom of its own
//! ([`degrees_of_freedom`](super::degrees_of_freedom)).
//!
//! # Noise from residuals
//!
//! The fit follows part of the noise, most where the noise is slow: it is *absorbed* by the
//! parameters. The residuals are (I − S Cᵀ) times the noise, so their covariance is
//! (I − S Cᵀ) R (I − C Sᵀ). It is smaller than R by the absorbed part,
//!
//! R C Sᵀ + S Cᵀ R − S K Sᵀ.
//!
//! R is found by iteration. Each round adds the absorbed part, computed with the present R, to the
//! residuals' covariance. It fits an autoregressive process to the sum. The rounds end when R has
//! settled.
//!
//! # Cost
//!
//! The samples are means over blocks ([`BlockSeries`]); noise within the blocks is white. For
//! coloured noise C is filtered by the process, which replaces products with R. For white noise
//! R C Sᵀ is S H⁻¹ Sᵀ times a number, and nothing is filtered. White noise that has settled is not
//! computed again while other outputs are iterated.

use nalgebra::DMatrix;

use super::autoregression::{Autoregression, HIGHEST_ORDER};
use super::block_series::BlockSeries;
use super::degrees_of_freedom::{ColouredPart, VarianceEstimates};
use super::residual_means::ResidualMeans;
use crate::numerics::linear_algebra::matrix::AlignedMatrix;
use crate::numerics::series::lagged_products::lagged_products;
use crate::numerics::statistics::student;
use crate::output_error::case::blocks::{BlockSums, samples_per_block};

/// Largest number of rounds in which the absorbed part is added back.
const MOST_ROUNDS: usize = 30;
/// Relative change of an output's long-run variance in a round below which its noise has settled.
const SETTLED: f64 = 0.01;
/// Change of the absorbed variance, as a share of the variance, below which settled white noise is
/// not computed again. A bound is accurate to some hundredths only.
const UNCHANGED: f64 = 1e-3;
/// Smallest fraction of the noise variance in the residuals for which white noise is found in one
/// round: the residuals' variance is divided by the fraction.
const MOSTLY_LEFT: f64 = 0.95;

/// Estimated noise of each output, in the order of the outputs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResidualNoise(Vec<OutputNoise>);

#[derive(Clone, Debug, PartialEq)]
struct OutputNoise {
    /// Autoregressive process of the block means.
    slow: Autoregression,
    /// Variance of the samples about their block mean, in the square of the output's unit.
    fast_variance: f64,
}

/// Covariance of the parameters with the degrees of freedom of each variance.
#[derive(Clone, Debug, PartialEq)]
pub struct CovarianceEstimate {
    pub covariance: DMatrix<f64>,
    pub degrees_of_freedom: Vec<f64>,
}

impl CovarianceEstimate {
    /// Covariance widened by Student's t, so that ±1.96 standard errors are an interval of 95 %.
    #[must_use]
    pub fn widened_by_student_t(mut self) -> DMatrix<f64> {
        for (j, degrees_of_freedom) in self.degrees_of_freedom.iter().enumerate() {
            let factor = student::widening_95(*degrees_of_freedom);
            self.covariance.row_mut(j).scale_mut(factor);
            self.covariance.column_mut(j).scale_mut(factor);
        }
        self.covariance
    }
}

/// Covariance of the parameters from H⁻¹ and the outputs' residuals, whose noise is independent.
#[must_use]
pub(crate) fn covariance(inverse: &AlignedMatrix, outputs: &[BlockSeries]) -> CovarianceEstimate {
    let outputs = settle_noise(inverse, outputs);
    let mut estimates = VarianceEstimates::zero(inverse.columns());
    for output in &outputs {
        output.add_variances(&mut estimates);
    }
    CovarianceEstimate {
        covariance: total_covariance(&outputs, inverse.columns()).to_dense(),
        degrees_of_freedom: estimates.degrees_of_freedom(),
    }
}

/// Estimates the noise from a fit's residuals and H⁻¹.
#[must_use]
pub fn residual_noise(inverse: &DMatrix<f64>, outputs: &[BlockSeries]) -> ResidualNoise {
    let inverse = AlignedMatrix::from_symmetric(inverse);
    let settled = settle_noise(&inverse, outputs).into_iter();
    let noise = settled.map(|output| OutputNoise {
        slow: output.slow,
        fast_variance: output.series.fast_variance,
    });
    ResidualNoise(noise.collect())
}

/// Variance of the white noise whose spectrum equals that of these values at frequency zero; at least
/// the mean square of the values. Values that are NaN do not count.
#[must_use]
pub fn slow_noise_level(values: &[f64], step_s: f64) -> f64 {
    let counted = || values.iter().filter(|v| v.is_finite());
    let square = counted().map(|v| v * v).sum::<f64>();
    let length = samples_per_block(step_s);
    let blocks = values.chunks(length);
    let mut means = ResidualMeans::with_room(length, blocks.len());
    for block in blocks {
        means.push(finite_sums(block));
    }
    let pairs = means.pairs();
    let slow = Autoregression::fitted(&means.autocovariances(&pairs), pairs[0]);
    let level = slow.long_run_variance() * means.length;
    level.max(square / (counted().count() as f64).max(1.0))
}

/// Gain in log-likelihood, in nats, of an autoregressive process over white noise as the description
/// of these values, less the penalty for its coefficients. Values that are NaN do not count.
#[must_use]
pub fn likelihood_gain(values: &[f64]) -> f64 {
    let finite: Vec<f64> = values
        .iter()
        .map(|v| if v.is_finite() { *v } else { 0.0 })
        .collect();
    let counts: Vec<f64> = values.iter().map(|v| f64::from(v.is_finite())).collect();
    let pairs = lagged_products(&counts, 1 + HIGHEST_ORDER);
    let sums = lagged_products(&finite, 1 + HIGHEST_ORDER);
    let autocovariances: Vec<f64> = sums
        .iter()
        .zip(&pairs)
        .map(|(s, n)| s / n.max(1.0))
        .collect();
    let process = Autoregression::fitted(&autocovariances, pairs[0]);
    process.likelihood_gain(autocovariances[0], pairs[0])
}

/// Sums of the values that are finite.
fn finite_sums(values: &[f64]) -> BlockSums {
    let finite = || values.iter().filter(|v| v.is_finite());
    BlockSums {
        count: finite().count() as f64,
        residual: finite().sum(),
    }
}

/// Covariance Σ Sᵀ W R W S of the cost's gradient for the given noise of the outputs.
#[must_use]
pub fn gradient_covariance(outputs: &[BlockSeries], noise: &ResidualNoise) -> DMatrix<f64> {
    let parameters = outputs.first().map_or(0, |o| o.between.columns());
    let mut covariance = AlignedMatrix::zeros(parameters, parameters);
    for (output, noise) in outputs.iter().zip(&noise.0) {
        let square = output.weight.powi(2);
        covariance.add_scaled(&output.within, square * noise.fast_variance);
        let factor = square * noise.slow.innovation;
        if noise.slow.is_white() {
            covariance.add_scaled(&output.between, factor);
        } else {
            let filtered = output.filtered(&output.sensitivities, &noise.slow);
            covariance.add_scaled(&filtered.gram(), factor);
        }
    }
    covariance.to_dense()
}

/// Estimates the noise of all outputs: adds back the part that the parameters absorb until all
/// outputs have settled.
fn settle_noise<'a>(
    inverse: &'a AlignedMatrix,
    outputs: &'a [BlockSeries],
) -> Vec<NoiseIteration<'a>> {
    let mut outputs: Vec<_> = outputs
        .iter()
        .map(|output| NoiseIteration::new(inverse, output))
        .collect();
    for _ in 0..MOST_ROUNDS {
        let covariance = total_covariance(&outputs, inverse.columns());
        for output in &mut outputs {
            output.iterate(&covariance);
        }
        if outputs.iter().all(|o| o.settled) {
            break;
        }
    }
    outputs
}

/// Covariance of the parameters from the noise of all outputs.
fn total_covariance(outputs: &[NoiseIteration], parameters: usize) -> AlignedMatrix {
    let mut sum = AlignedMatrix::zeros(parameters, parameters);
    for output in outputs {
        sum.add_scaled(&output.covariance_from_fast, 1.0);
        sum.add_scaled(&output.covariance_from_slow, 1.0);
    }
    sum
}

/// Estimate of one output's noise while its rounds run, and the covariance that it causes.
struct NoiseIteration<'a> {
    series: &'a BlockSeries,
    inverse: &'a AlignedMatrix,
    /// Pairs of blocks at lags 0, 1, …
    pairs: Vec<f64>,
    /// Autocovariances of the residuals at lags 0, 1, …
    observed: Vec<f64>,
    /// Present estimate of the process of the block means.
    slow: Autoregression,
    /// Variance of the blocks' means.
    variance: f64,
    /// Covariance of the parameters from the noise within blocks.
    covariance_from_fast: AlignedMatrix,
    /// Covariance of the parameters from the noise of the blocks' means.
    covariance_from_slow: AlignedMatrix,
    /// Covariance of the parameters if the blocks' means were white with unit variance.
    covariance_from_white: AlignedMatrix,
    /// Change C of the estimates with each block mean; `None` until the noise is coloured.
    changes: Option<AlignedMatrix>,
    /// Product R C, with R the autocovariance of the process for innovations of variance one;
    /// `None` for white noise.
    process_times_changes: Option<AlignedMatrix>,
    /// Mean variance of the block means that the parameters absorb (diagonal of S K Sᵀ), in the round
    /// in which the absorbed part was last added.
    absorbed_variance: f64,
    settled: bool,
}

impl<'a> NoiseIteration<'a> {
    fn new(inverse: &'a AlignedMatrix, series: &'a BlockSeries) -> NoiseIteration<'a> {
        let square = series.weight.powi(2);
        let by_white = inverse.sandwich(&series.between).scaled_by(square);
        let by_fast = inverse.sandwich(&series.within);
        let pairs = series.means.pairs();
        let observed = series.means.autocovariances(&pairs);
        let mut iteration = NoiseIteration {
            series,
            inverse,
            pairs,
            slow: Autoregression::white(0.0),
            variance: 0.0,
            covariance_from_fast: by_fast.scaled_by(square * series.fast_variance),
            covariance_from_slow: by_white.clone(),
            covariance_from_white: by_white,
            changes: None,
            process_times_changes: None,
            absorbed_variance: 0.0,
            settled: false,
            observed: vec![],
        };
        iteration.set_noise(&observed);
        iteration.observed = observed;
        iteration
    }

    /// Sets the noise to the process with these autocovariances.
    fn set_noise(&mut self, autocovariances: &[f64]) {
        let (series, inverse) = (self.series, self.inverse);
        let slow = Autoregression::fitted(autocovariances, self.pairs[0]);
        if slow.is_white() {
            self.covariance_from_slow = self
                .covariance_from_white
                .clone()
                .scaled_by(slow.innovation);
        } else {
            let changes = self.changes.get_or_insert_with(|| {
                series
                    .sensitivities
                    .product(inverse)
                    .scaled_by(series.weight)
            });
            let filtered = series.filtered(changes, &slow);
            self.covariance_from_slow = filtered.gram().scaled_by(slow.innovation);
            self.process_times_changes = Some(series.times_autocovariance(filtered, &slow));
        }
        self.slow = slow;
        self.variance = autocovariances.first().copied().unwrap_or(0.0);
    }

    /// Runs one round: adds the part that the parameters absorb, for their present covariance, to
    /// the residuals' autocovariances, and fits the noise to the sum. White noise of which the
    /// residuals keep most is solved for directly, so only other outputs can change its variance
    /// later.
    fn iterate(&mut self, covariance: &AlignedMatrix) {
        let (pairs, length) = (self.pairs[0], self.series.means.length);
        let absorbed_variance = covariance.dot(&self.series.between) / (length * length * pairs);
        let change = (absorbed_variance - self.absorbed_variance).abs();
        if self.settled && change <= UNCHANGED * self.variance && self.slow.is_white() {
            return;
        }
        self.absorbed_variance = absorbed_variance;
        let absorbed = self.absorbed_autocovariance(covariance);
        let left = self.variance - absorbed[0] / pairs;
        let stronger = if self.slow.is_white() && left > MOSTLY_LEFT * self.variance {
            self.observed[0] / left
        } else {
            1.0
        };
        let by_lag = absorbed.iter().zip(&self.pairs).zip(&self.observed);
        let whole: Vec<f64> = by_lag
            .map(|((absorbed, pairs), observed)| observed + stronger * absorbed / pairs)
            .collect();
        let expected = stronger * self.slow.long_run_variance();
        self.set_noise(&whole);
        let fitted = self.slow.long_run_variance();
        self.settled = (expected - fitted).abs() <= SETTLED * fitted;
    }

    /// Absorbed part R C Sᵀ + S Cᵀ R − S K Sᵀ, summed over all pairs of blocks at each lag.
    ///
    /// With X = R C − ½ S K the part is X Sᵀ + S Xᵀ. For white noise R is a number, and the two
    /// products are equal.
    fn absorbed_autocovariance(&mut self, covariance: &AlignedMatrix) -> Vec<f64> {
        let (series, lags) = (self.series, self.series.means.lags());
        let (sums, length) = (&series.sensitivities, series.means.length);
        let factor = self.slow.innovation / length;
        let mut inner = covariance.clone().scaled_by(-0.5 / (length * length));
        if let Some(mut x) = self.process_times_changes.take() {
            x.add_product(sums, &inner.scaled_by(1.0 / factor));
            let x_with_s = x.lagged_products(sums, lags);
            let s_with_x = sums.lagged_products(&x, lags);
            let by_lag = x_with_s.iter().zip(s_with_x);
            by_lag
                .map(|(x_with_s, s_with_x)| factor * (x_with_s + s_with_x))
                .collect()
        } else {
            inner.add_scaled(self.inverse, factor * series.weight);
            let half = sums.product(&inner).lagged_products(sums, lags);
            half.iter().map(|half| 2.0 * half).collect()
        }
    }

    /// Adds the variances of the parameters from this output.
    fn add_variances(&self, estimates: &mut VarianceEstimates) {
        let series = self.series;
        estimates.add(
            self.covariance_from_fast.diagonal(),
            series.fast_degrees_of_freedom,
        );
        let absorbed_blocks =
            series.weight / series.means.length * self.inverse.dot(&series.between);
        let degrees_of_freedom = self.pairs[0] - absorbed_blocks;
        match &self.changes {
            Some(changes) if !self.slow.is_white() => estimates.add_coloured(&ColouredPart {
                noise: &self.slow,
                filtered: series.filtered(changes, &self.slow),
                degrees_of_freedom,
            }),
            _ => estimates.add(self.covariance_from_slow.diagonal(), degrees_of_freedom),
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::output_error::tests::Noise;

    #[test]
    fn the_gain_of_a_colour_is_that_of_its_innovations() {
        const SAMPLES: usize = 20_000;
        let (correlation, mut noise) = (0.9_f64, Noise(7));
        let change = (1.0 - correlation * correlation).sqrt();
        let mut value = 0.0;
        let mut next = |_| {
            value = correlation * value + change * noise.gaussian();
            value
        };
        let mut values: Vec<f64> = (0..SAMPLES).map(&mut next).collect();
        let exact = -(SAMPLES as f64) * change.ln();
        assert_relative_eq!(likelihood_gain(&values), exact, max_relative = 0.02);
        // Values that do not count gain nothing.
        values.resize(2 * SAMPLES, f64::NAN);
        assert_relative_eq!(likelihood_gain(&values), exact, max_relative = 0.02);

        let white: Vec<f64> = (0..SAMPLES).map(|_| noise.gaussian()).collect();
        assert!(likelihood_gain(&white).abs() < 5.0);
        assert_relative_eq!(likelihood_gain(&[]), 0.0);
    }

    /// Series of an output whose sensitivity is one wherever it counts.
    fn unit_series(weight: f64, residuals: &[f64], used: &[bool]) -> BlockSeries {
        let count = |used: &[bool]| used.iter().filter(|used| **used).count() as f64;
        let (square, squares) = (
            residuals.iter().map(|v| v * v).sum(),
            DMatrix::from_element(1, 1, count(used)),
        );
        BlockSeries::new(
            0.1,
            weight,
            residuals.len(),
            square,
            &squares,
            |samples, row| {
                let block = BlockSums {
                    count: count(&used[samples.clone()]),
                    residual: residuals[samples].iter().sum(),
                };
                row[0] += block.count;
                block
            },
        )
    }

    /// Covariance of the mean of values from their residuals; H = w N.
    fn estimate_mean(values: &[f64], used: &[bool]) -> CovarianceEstimate {
        let weight = 3.0;
        let count = used.iter().filter(|used| **used).count() as f64;
        let of = |used: bool, value: f64| if used { value } else { 0.0 };
        let mean = values
            .iter()
            .zip(used)
            .map(|(v, used)| of(*used, *v))
            .sum::<f64>()
            / count;
        let residuals: Vec<f64> = values
            .iter()
            .zip(used)
            .map(|(v, used)| of(*used, v - mean))
            .collect();
        let series = unit_series(weight, &residuals, used);
        covariance(
            &AlignedMatrix::from_symmetric(&DMatrix::from_element(1, 1, 1.0 / (weight * count))),
            &[series],
        )
    }

    #[test]
    fn the_variance_of_a_mean_of_white_values_has_n_minus_one_degrees_of_freedom() {
        // With fewer than BLOCKS_PER_COEFFICIENT blocks only white noise is considered.
        let means = [1.0, 3.0, 2.0, 5.0, 4.0, 1.0, 0.0, 2.0, 3.0];
        let values: Vec<f64> = means.iter().flat_map(|m| [m + 0.5, m - 0.5]).collect();
        let mean = means.iter().sum::<f64>() / 9.0;
        let square: f64 = means.iter().map(|v| (v - mean) * (v - mean)).sum();
        // One of nine degrees of freedom more would be 11 %.
        let estimate = estimate_mean(&values, &[true; 18]);
        assert_relative_eq!(
            estimate.covariance[(0, 0)],
            square / 8.0 / 9.0,
            max_relative = 0.02
        );
        assert_relative_eq!(estimate.degrees_of_freedom[0], 8.0, max_relative = 1e-9);
        let longer = estimate.clone().widened_by_student_t()[(0, 0)] / estimate.covariance[(0, 0)];
        assert_relative_eq!(longer.sqrt(), 2.306 / 1.960, max_relative = 1e-3);
    }

    #[test]
    fn the_gradient_covariance_of_white_noise_is_that_of_the_blocks() {
        let (count, weight) = (40, 3.0);
        let residuals: Vec<f64> = (0..count)
            .map(|k| if k % 4 < 2 { 1.0 } else { -1.0 })
            .collect();
        let series = unit_series(weight, &residuals, &vec![true; residuals.len()]);
        let noise = ResidualNoise(vec![OutputNoise {
            slow: Autoregression::white(2.0),
            fast_variance: 1.0,
        }]);
        // A block of two samples whose mean has the variance 2 gives the sum over it 8.
        let expected = weight * weight * 8.0 * f64::from(count) / 2.0;
        assert_relative_eq!(
            gradient_covariance(&[series], &noise)[(0, 0)],
            expected,
            max_relative = 1e-12
        );
    }

    #[test]
    fn the_variance_of_a_mean_of_coloured_values_is_that_of_the_process_also_with_gaps() {
        let (samples, draws, c) = (400, 200, 0.9_f64);
        let used: Vec<bool> = (0..samples).map(|k| k % 50 > 2).collect();
        let mut noise = Noise(20_260_102);
        let (mut stated, mut scatter) = (0.0, 0.0);
        for _ in 0..draws {
            let mut value = noise.gaussian();
            let values: Vec<f64> = (0..samples)
                .map(|_| {
                    value = c * value + (1.0 - c * c).sqrt() * noise.gaussian();
                    value
                })
                .collect();
            stated += estimate_mean(&values, &used).covariance[(0, 0)] / f64::from(draws);
            let counted: Vec<f64> = values
                .iter()
                .zip(&used)
                .filter(|(_, used)| **used)
                .map(|(v, _)| *v)
                .collect();
            let mean = counted.iter().sum::<f64>() / counted.len() as f64;
            scatter += mean * mean / f64::from(draws);
        }
        let product = |k: usize, l: usize| c.powi(i32::try_from(k.abs_diff(l)).unwrap());
        let counted: Vec<usize> = (0..samples).filter(|&k| used[k]).collect();
        let sum: f64 = counted
            .iter()
            .flat_map(|&k| counted.iter().map(move |&l| product(k, l)))
            .sum();
        let exact = sum / (counted.len() * counted.len()) as f64;
        // 200 draws give the scatter to 10%, the mean of the stated variances to some 3%.
        assert_relative_eq!(stated, exact, max_relative = 0.1);
        assert_relative_eq!(scatter, exact, max_relative = 0.3);
    }

    #[test]
    fn student_intervals_of_few_coloured_values_have_their_nominal_coverage() {
        // With 30 periods of a slow process, normal intervals cover the truth in nine cases of ten.
        let (samples, draws, c) = (160, 1000, 0.8_f64);
        let mut noise = Noise(20_260_303);
        let (mut normal, mut student) = (0, 0);
        for _ in 0..draws {
            let mut value = noise.gaussian();
            let values: Vec<f64> = (0..samples)
                .map(|_| {
                    value = c * value + (1.0 - c * c).sqrt() * noise.gaussian();
                    value
                })
                .collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let estimate = estimate_mean(&values, &vec![true; samples]);
            let within = |variance: f64| u32::from(mean.abs() < 1.96 * variance.sqrt());
            normal += within(estimate.covariance[(0, 0)]);
            student += within(estimate.widened_by_student_t()[(0, 0)]);
        }
        let (normal, student) = (
            f64::from(normal) / f64::from(draws),
            f64::from(student) / f64::from(draws),
        );
        // 1000 draws give a share to 0.7 %.
        assert!(
            student > normal + 0.005,
            "Student {student}, normal {normal}"
        );
        assert!(
            (0.93..0.975).contains(&student),
            "Student {student}, normal {normal}"
        );
    }
}
