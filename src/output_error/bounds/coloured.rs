//! Scatter of the estimates under coloured residuals (after Morelli and Klein 1997): H⁻¹ [Σ Sᵀ W R
//! W S] H⁻¹ with R the autocovariance of the noise, in a form that stays positive and counts the
//! degrees of freedom.
//!
//! Residuals are not the noise: the parameters have followed it, most where it is slow. With C = S
//! H⁻¹ W, the change of the estimates with each value, the residuals are (I − S Cᵀ) times the noise
//! and their covariance is (I − S Cᵀ) R (I − C Sᵀ), so what the parameters took, R C Sᵀ + S Cᵀ R −
//! S K Sᵀ with K = Cᵀ R C their own covariance, is added back, round after round until R settles. R
//! of each output is that of an autoregressive process, by which the changes are filtered: every
//! variance is a sum of squares.
//!
//! Most outputs are white to the process, and then nothing is filtered: R C Sᵀ is S H⁻¹ Sᵀ times a
//! number. White noise that has settled is left alone while that of other outputs goes on.
//!
//! Variances from a noise that is itself estimated are known with few degrees of freedom
//! ([`freedom`]).
//!
//! Noise is seen through blocks of samples: what moves slower than a block is the autoregressive
//! process, with few coefficients even where it is far slower; what moves faster is white within
//! the blocks. Parameters act slower than a block, so the process decides, and a slow component
//! counts that is small beside the sensors' white noise.

use nalgebra::DMatrix;

use super::autoregression::Autoregression;
use super::freedom;
use super::freedom::{Known, Part};
use crate::numerics::matrix::{LONGEST_LAG, Padded};
use crate::output_error::case::blocks::{Block, samples_of_block};

/// Longest memory of a process, blocks.
const ORDER: usize = 12;
const _: () = assert!(ORDER <= LONGEST_LAG);
/// A process has at most one coefficient per so many blocks.
const BLOCKS_PER_COEFFICIENT: usize = 10;
const ROUNDS: usize = 30;
/// An output's noise is settled when its long-run variance changes by no more than this share.
const SETTLED: f64 = 0.01;
/// White noise that has settled is left alone while the parameters follow it alike, to this share
/// of its variance.
const STILL: f64 = 1e-3;
/// Where the parameters leave at least this share of white noise, its strength follows from the
/// residuals' at once.
const LITTLE: f64 = 0.95;

/// One output of one maneuver, seen through blocks of samples.
#[derive(Clone, Debug)]
pub struct Series {
    /// Of a sample.
    weight: f64,
    /// Samples of a block.
    block: f64,
    /// Means of the blocks' residuals.
    residuals: Padded,
    /// Variance of the samples about their block's mean, and the degrees of freedom with which it
    /// is known.
    fast: f64,
    fast_freedom: f64,
    /// Of each block how many samples count, and the sums of their sensitivities.
    pub(crate) counts: Vec<f64>,
    pub(crate) sensitivities: Padded,
    /// Σ s sᵀ of these sums, and of the samples' sensitivities about their block's mean.
    between: Padded,
    within: Padded,
}

/// The noise of each output.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Noise(Vec<OutputNoise>);

#[derive(Clone, Debug, PartialEq)]
struct OutputNoise {
    /// Of the blocks' means.
    slow: Autoregression,
    /// Variance of the samples about their block's mean.
    fast: f64,
}

/// The scatter of the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimated {
    pub covariance: DMatrix<f64>,
    /// Degrees of freedom with which each variance is known.
    pub freedom: Vec<f64>,
}

impl Estimated {
    /// The covariance whose roots times 1.96 are intervals of 95 %: Student's, not normal ones.
    #[must_use]
    pub fn of_student(mut self) -> DMatrix<f64> {
        for (j, freedom) in self.freedom.iter().enumerate() {
            let factor = freedom::longer(*freedom);
            self.covariance.row_mut(j).scale_mut(factor);
            self.covariance.column_mut(j).scale_mut(factor);
        }
        self.covariance
    }
}

/// Covariance of the parameters, given H⁻¹, where each output has independent noise.
#[must_use]
pub(crate) fn covariance(inverse: &Padded, outputs: &[Series]) -> Estimated {
    let outputs = settled(inverse, outputs);
    let mut known = Known::nothing(inverse.columns());
    for output in &outputs {
        output.know(&mut known);
    }
    Estimated {
        covariance: scatter(&outputs, inverse.columns()).matrix(),
        freedom: known.freedom(),
    }
}

/// The noise that residuals of a fit speak for, given H⁻¹.
#[must_use]
pub fn noise(inverse: &DMatrix<f64>, outputs: &[Series]) -> Noise {
    let inverse = Padded::symmetric(inverse);
    let settled = settled(&inverse, outputs).into_iter();
    Noise(
        settled
            .map(|o| OutputNoise {
                slow: o.slow,
                fast: o.output.fast,
            })
            .collect(),
    )
}

/// The variance of white noise that is as strong as the slowest part of these values, NaN where one
/// does not count, and never weaker than the values are.
#[must_use]
pub fn level(values: &[f64], step_s: f64) -> f64 {
    let counted = |values: &[f64]| {
        let finite = || values.iter().filter(|v| v.is_finite());
        (
            Block {
                count: finite().count() as f64,
                residual: finite().sum(),
            },
            finite().map(|v| v * v).sum::<f64>(),
        )
    };
    let (all, square) = counted(values);
    let series = Series::new(
        step_s,
        1.0,
        values.len(),
        square,
        &DMatrix::zeros(1, 1),
        |samples, _| counted(&values[samples]).0,
    );
    let pairs = series.pairs();
    let slow =
        Autoregression::fitted(&series.autocovariances(&pairs), pairs[0]).long_run_variance();
    (slow * series.block).max(square / all.count.max(1.0))
}

/// Σ Sᵀ W R W S: what noise does to the gradient.
#[must_use]
pub fn gradient_covariance(outputs: &[Series], noise: &Noise) -> DMatrix<f64> {
    let parameters = outputs.first().map_or(0, |o| o.between.columns());
    let mut scatter = Padded::zeros(parameters, parameters);
    for (output, noise) in outputs.iter().zip(&noise.0) {
        scatter.add(&output.within, output.weight.powi(2) * noise.fast);
        let factor = output.weight.powi(2) * noise.slow.innovation;
        if noise.slow.is_white() {
            scatter.add(&output.between, factor);
        } else {
            scatter.add(
                &output
                    .filtered(&output.sensitivities, &noise.slow)
                    .squares(),
                factor,
            );
        }
    }
    scatter.matrix()
}

impl Series {
    /// Sees one output's `samples` through blocks: of each `block_of` writes the sensitivities of
    /// some samples that count, added up, to a row. `square` and `squares` are Σ v² and Σ s sᵀ of
    /// all samples that count.
    #[must_use]
    pub fn new(
        step_s: f64,
        weight: f64,
        samples: usize,
        square: f64,
        squares: &DMatrix<f64>,
        mut block_of: impl FnMut(std::ops::Range<usize>, &mut [f64]) -> Block,
    ) -> Series {
        let (length, parameters) = (samples_of_block(step_s), squares.nrows());
        let (blocks, block) = (samples.div_ceil(length), length as f64);
        let mut sensitivities = Padded::zeros(blocks, parameters);
        let (mut counts, mut residuals) = (Vec::with_capacity(blocks), Vec::with_capacity(blocks));
        let (mut square, mut freedom) = (square, 0.0);
        // Of blocks that do not count whole, what their mean's square is larger by.
        let mut more = Vec::new();
        for (k, row) in sensitivities.rows_mut().enumerate() {
            let Block { count, residual } =
                block_of(k * length..samples.min((k + 1) * length), row);
            let mean = residual / count.max(1.0);
            counts.push(count);
            residuals.push(mean);
            square -= residual * mean;
            freedom += (count - 1.0).max(0.0);
            if count > 0.0 && count < block {
                let factor = (1.0 / count - 1.0 / block).sqrt();
                more.extend(row.iter().map(|s| factor * s));
            }
        }
        let between = sensitivities.squares();
        let mut within = Padded::symmetric(squares);
        within.add(&between, -1.0 / block);
        if !more.is_empty() {
            within.add(&Padded::of_rows(&more, parameters).squares(), -1.0);
        }
        let fast_freedom = f64::max(freedom, 1.0);
        let fast = square.max(0.0) / fast_freedom;
        let residuals = Padded::column(&residuals);
        Series {
            weight,
            block,
            residuals,
            fast,
            fast_freedom,
            counts,
            sensitivities,
            between,
            within,
        }
    }

    /// The same with other parameters: `places` says where each stands among them.
    #[must_use]
    pub fn widened(&self, places: &[usize], parameters: usize) -> Series {
        let place = |own: &[f64], wide: &mut [f64]| {
            places
                .iter()
                .zip(own)
                .for_each(|(&place, s)| wide[place] = *s)
        };
        let mut sensitivities = Padded::zeros(self.blocks(), parameters);
        self.sensitivities
            .rows()
            .zip(sensitivities.rows_mut())
            .for_each(|(own, wide)| place(own, wide));
        let square = |own: &Padded| {
            let mut wide = Padded::zeros(parameters, parameters);
            for (own, &row) in own.rows().zip(places) {
                wide.rows_mut()
                    .skip(row)
                    .take(1)
                    .for_each(|wide| place(own, wide));
            }
            wide
        };
        let (between, within) = (square(&self.between), square(&self.within));
        Series {
            sensitivities,
            between,
            within,
            ..self.clone()
        }
    }

    fn blocks(&self) -> usize {
        self.counts.len()
    }

    fn lags(&self) -> usize {
        1 + ORDER.min(self.blocks() / BLOCKS_PER_COEFFICIENT)
    }

    /// Pairs of blocks that count, at lags 0, 1, …, at least one.
    fn pairs(&self) -> Vec<f64> {
        let used: Vec<f64> = self.counts.iter().map(|count| count.min(1.0)).collect();
        let used = Padded::column(&used);
        used.lagged(&used, self.lags())
            .iter()
            .map(|pairs| pairs.max(1.0))
            .collect()
    }

    fn autocovariances(&self, pairs: &[f64]) -> Vec<f64> {
        let sums = self.residuals.lagged(&self.residuals, self.lags());
        sums.iter()
            .zip(pairs)
            .map(|(sum, pairs)| sum / pairs)
            .collect()
    }

    /// Rows of the blocks filtered by a process, until that has died away.
    fn filtered(&self, rows: &Padded, process: &Autoregression) -> Padded {
        let mut filtered = rows.followed_by(process.memory(self.blocks()));
        filtered.filter(&process.coefficients);
        filtered
    }

    /// R times rows of which these are the filtered ones, of noise with unit innovation.
    fn spread(&self, mut filtered: Padded, process: &Autoregression) -> Padded {
        filtered.filter_back(&process.coefficients);
        filtered.truncate(self.blocks());
        let unused = filtered
            .rows_mut()
            .zip(&self.counts)
            .filter(|(_, count)| **count <= 0.0);
        unused.for_each(|(row, _)| row.fill(0.0));
        filtered
    }
}

/// The outputs with the noise that is left when what the parameters took is added back.
fn settled<'a>(inverse: &'a Padded, outputs: &'a [Series]) -> Vec<Settling<'a>> {
    let mut outputs: Vec<_> = outputs
        .iter()
        .map(|output| Settling::new(inverse, output))
        .collect();
    for _ in 0..ROUNDS {
        let scatter = scatter(&outputs, inverse.columns());
        for output in &mut outputs {
            output.settle(&scatter);
        }
        if outputs.iter().all(|o| o.settled) {
            break;
        }
    }
    outputs
}

/// The parameters' covariance by all outputs' noise.
fn scatter(outputs: &[Settling], parameters: usize) -> Padded {
    let mut sum = Padded::zeros(parameters, parameters);
    for output in outputs {
        sum.add(&output.by_fast, 1.0);
        sum.add(&output.by_slow, 1.0);
    }
    sum
}

/// One output while its noise settles, and what that does to the parameters.
struct Settling<'a> {
    output: &'a Series,
    inverse: &'a Padded,
    /// Pairs of blocks and the residuals' autocovariances at lags 0, 1, …
    pairs: Vec<f64>,
    observed: Vec<f64>,
    /// The noise of the blocks' means, and its variance.
    slow: Autoregression,
    variance: f64,
    /// Parts of the parameters' covariance: by the noise within blocks, by that of their means, and
    /// by the latter were it white with unit variance.
    by_fast: Padded,
    by_slow: Padded,
    by_white: Padded,
    /// The change of the parameters with each block's mean, and R times it for unit innovation;
    /// none as long as the noise is white.
    changes: Option<Padded>,
    spread: Option<Padded>,
    /// Variance of what the parameters made of the noise, S K Sᵀ, when that was last added back.
    followed: f64,
    settled: bool,
}

impl<'a> Settling<'a> {
    fn new(inverse: &'a Padded, output: &'a Series) -> Settling<'a> {
        let square = output.weight.powi(2);
        let by_white = inverse.about(&output.between).times(square);
        let pairs = output.pairs();
        let observed = output.autocovariances(&pairs);
        let mut settling = Settling {
            output,
            inverse,
            pairs,
            slow: Autoregression::white(0.0),
            variance: 0.0,
            by_fast: inverse.about(&output.within).times(square * output.fast),
            by_slow: by_white.clone(),
            by_white,
            changes: None,
            spread: None,
            followed: 0.0,
            settled: false,
            observed: vec![],
        };
        settling.take(&observed);
        settling.observed = observed;
        settling
    }

    /// Takes the process with these autocovariances for its noise.
    fn take(&mut self, autocovariances: &[f64]) {
        let (output, inverse) = (self.output, self.inverse);
        let slow = Autoregression::fitted(autocovariances, self.pairs[0]);
        if slow.is_white() {
            self.by_slow = self.by_white.clone().times(slow.innovation);
        } else {
            let new = || output.sensitivities.product(inverse).times(output.weight);
            let filtered = output.filtered(self.changes.get_or_insert_with(new), &slow);
            self.by_slow = filtered.squares().times(slow.innovation);
            self.spread = Some(output.spread(filtered, &slow));
        }
        self.slow = slow;
        self.variance = autocovariances.first().copied().unwrap_or(0.0);
    }

    /// Adds back what the parameters, of this covariance, took. White noise is at once made as
    /// strong as leaves residuals as strong as they are; then only what others do to the parameters
    /// can change it.
    fn settle(&mut self, scatter: &Padded) {
        let (pairs, block) = (self.pairs[0], self.output.block);
        let followed = scatter.dot(&self.output.between) / (block * block * pairs);
        let still = (followed - self.followed).abs() <= STILL * self.variance;
        if self.settled && still && self.slow.is_white() {
            return;
        }
        self.followed = followed;
        let taken = self.taken(scatter);
        let left = self.variance - taken[0] / pairs;
        let stronger = if self.slow.is_white() && left > LITTLE * self.variance {
            self.observed[0] / left
        } else {
            1.0
        };
        let shares = taken
            .iter()
            .zip(&self.pairs)
            .map(|(taken, pairs)| stronger * taken / pairs);
        let whole: Vec<f64> = self
            .observed
            .iter()
            .zip(shares)
            .map(|(observed, share)| observed + share)
            .collect();
        let expected = stronger * self.slow.long_run_variance();
        self.take(&whole);
        let found = self.slow.long_run_variance();
        self.settled = (expected - found).abs() <= SETTLED * found;
    }

    /// R C Sᵀ + S Cᵀ R − S K Sᵀ summed along its diagonals.
    fn taken(&mut self, scatter: &Padded) -> Vec<f64> {
        let (sums, block, lags) = (
            &self.output.sensitivities,
            self.output.block,
            self.output.lags(),
        );
        let factor = self.slow.innovation / block;
        let mut inner = scatter.clone().times(-0.5 / (block * block));
        if let Some(mut half) = self.spread.take() {
            half.add_product(sums, &inner.times(1.0 / factor));
            let both = half
                .lagged(sums, lags)
                .into_iter()
                .zip(sums.lagged(&half, lags));
            both.map(|(before, after)| factor * (before + after))
                .collect()
        } else {
            inner.add(self.inverse, factor * self.output.weight);
            sums.product(&inner)
                .lagged(sums, lags)
                .iter()
                .map(|half| 2.0 * half)
                .collect()
        }
    }

    /// Adds what the noise gives the parameters, and how well that is known.
    fn know(&self, known: &mut Known) {
        known.add(self.by_fast.diagonal(), self.output.fast_freedom);
        // What the parameters took of the blocks.
        let taken = self.output.weight / self.output.block * self.inverse.dot(&self.output.between);
        let freedom = self.pairs[0] - taken;
        match &self.changes {
            Some(changes) if !self.slow.is_white() => {
                let filtered = self.output.filtered(changes, &self.slow);
                Part {
                    noise: &self.slow,
                    filtered,
                    freedom,
                    known,
                }
                .add();
            }
            _ => known.add(self.by_slow.diagonal(), freedom),
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::output_error::tests::Noise;

    /// An output whose sensitivity is one wherever it counts.
    fn of_a_sum(weight: f64, residuals: &[f64], used: &[bool]) -> Series {
        let count = |used: &[bool]| used.iter().filter(|used| **used).count() as f64;
        let (square, squares) = (
            residuals.iter().map(|v| v * v).sum(),
            DMatrix::from_element(1, 1, count(used)),
        );
        Series::new(
            0.1,
            weight,
            residuals.len(),
            square,
            &squares,
            |samples, row| {
                let block = Block {
                    count: count(&used[samples.clone()]),
                    residual: residuals[samples].iter().sum(),
                };
                row[0] += block.count;
                block
            },
        )
    }

    /// The variance stated for the mean of values, given their residuals from it; H = w N and H⁻¹ =
    /// 1/H.
    fn of_the_mean(values: &[f64], used: &[bool]) -> Estimated {
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
        let series = of_a_sum(weight, &residuals, used);
        covariance(
            &Padded::symmetric(&DMatrix::from_element(1, 1, 1.0 / (weight * count))),
            &[series],
        )
    }

    #[test]
    fn the_variance_of_a_mean_of_white_values_has_n_minus_one_degrees_of_freedom() {
        // Fewer than BLOCKS_PER_COEFFICIENT blocks: white noise is all that is considered. The
        // blocks' means speak alone.
        let means = [1.0, 3.0, 2.0, 5.0, 4.0, 1.0, 0.0, 2.0, 3.0];
        let values: Vec<f64> = means.iter().flat_map(|m| [m + 0.5, m - 0.5]).collect();
        let mean = means.iter().sum::<f64>() / 9.0;
        let square: f64 = means.iter().map(|v| (v - mean) * (v - mean)).sum();
        // Nine blocks, so that a degree of freedom not counted would be 11%.
        let said = of_the_mean(&values, &[true; 18]);
        assert_relative_eq!(
            said.covariance[(0, 0)],
            square / 8.0 / 9.0,
            max_relative = 0.02
        );
        // The interval is Student's with as many.
        assert_relative_eq!(said.freedom[0], 8.0, max_relative = 1e-9);
        let longer = said.clone().of_student()[(0, 0)] / said.covariance[(0, 0)];
        assert_relative_eq!(longer.sqrt(), 2.306 / 1.960, max_relative = 1e-3);
    }

    #[test]
    fn white_noise_does_to_the_gradient_what_it_does_to_the_blocks() {
        let (count, weight) = (40, 3.0);
        let residuals: Vec<f64> = (0..count)
            .map(|k| if k % 4 < 2 { 1.0 } else { -1.0 })
            .collect();
        let series = of_a_sum(weight, &residuals, &vec![true; residuals.len()]);
        let noise = super::Noise(vec![OutputNoise {
            slow: Autoregression::white(2.0),
            fast: 1.0,
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
            stated += of_the_mean(&values, &used).covariance[(0, 0)] / f64::from(draws);
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
    fn intervals_hold_the_mean_of_few_coloured_values_as_often_as_they_say() {
        // 30 periods of a slow process: normal intervals hold the truth in nine cases of ten.
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
            let said = of_the_mean(&values, &vec![true; samples]);
            let within = |variance: f64| u32::from(mean.abs() < 1.96 * variance.sqrt());
            normal += within(said.covariance[(0, 0)]);
            student += within(said.of_student()[(0, 0)]);
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
