//! Scatter of the estimates under coloured residuals (after Morelli and Klein 1997): H⁻¹ [Σ Sᵀ W R W S] H⁻¹ with R the
//! autocovariance of the noise, in a form that stays positive and counts the degrees of freedom.
//!
//! Residuals are not the noise: the parameters have followed it, most where it is slow. With P = S H⁻¹ Sᵀ W their
//! covariance is (I − P) R (I − P)ᵀ, so what P took is added back, round after round until R settles. R of each output is
//! that of an autoregressive process, by which the sensitivities are filtered: every variance is a sum of squares.
//!
//! For this sensitivities are taken as S T with T Tᵀ = H⁻¹, which makes H the unit matrix.
//!
//! Noise is seen through blocks of samples: what moves slower than a block is the autoregressive process, with few
//! coefficients even where it is far slower; what moves faster is white within the blocks. Parameters act slower than a
//! block, so the process decides, and a slow component counts that is small beside the sensors' white noise.

use nalgebra::DMatrix;

use super::autoregression::Autoregression;
use super::cost::add_square;

/// Length of a block, s: the short period and the test inputs are several times longer.
const BLOCK_S: f64 = 0.2;
/// Longest memory of a process, blocks.
const ORDER: usize = 12;
/// A process has at most one coefficient per so many blocks.
const BLOCKS_PER_COEFFICIENT: usize = 10;
const ROUNDS: usize = 30;
/// R is settled when no output's long-run variance changes by more than this share.
const SETTLED: f64 = 0.01;

/// One output of one maneuver.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    pub step_s: f64,
    pub weight: f64,
    /// Of the residuals, were they white.
    pub variance: f64,
    /// Zero where a sample does not count.
    pub residuals: Vec<f64>,
    pub used: Vec<bool>,
    /// ∂(output)/∂(parameters), sample by sample; zero where a sample does not count.
    pub sensitivities: Vec<f64>,
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

/// Covariance of the parameters, where T Tᵀ = H⁻¹ and each output has independent noise.
#[must_use]
pub fn covariance(root: &DMatrix<f64>, outputs: Vec<Series>) -> DMatrix<f64> {
    let outputs = transformed(root, outputs);
    root * gradient_covariance(&outputs, &settled(&outputs)) * root.transpose()
}

/// The noise that residuals of a fit speak for, where T Tᵀ = H⁻¹.
#[must_use]
pub fn noise(root: &DMatrix<f64>, outputs: Vec<Series>) -> Noise {
    settled(&transformed(root, outputs))
}

/// The variance of white noise that is as strong as the slowest part of these values, NaN where one does not count, and
/// never weaker than the values are.
#[must_use]
pub fn level(values: &[f64], step_s: f64) -> f64 {
    let used: Vec<bool> = values.iter().map(|v| v.is_finite()).collect();
    let count = used.iter().filter(|used| **used).count().max(1) as f64;
    let residuals: Vec<f64> = values.iter().map(|v| if v.is_finite() { *v } else { 0.0 }).collect();
    let variance = residuals.iter().map(|v| v * v).sum::<f64>() / count;
    let sensitivities = vec![0.0; values.len()];
    let series = Series { step_s, weight: 1.0, variance, residuals, used, sensitivities };
    let blocks = series.blocks();
    let slow = Autoregression::fitted(&blocks.autocovariances(), blocks.count()).long_run_variance();
    (slow * series.block() as f64).max(variance)
}

/// Σ Sᵀ W R W S: what noise does to the gradient.
#[must_use]
pub fn gradient_covariance(outputs: &[Series], noise: &Noise) -> DMatrix<f64> {
    let n = outputs.first().map_or(0, Series::parameters);
    let mut scatter = DMatrix::zeros(n, n);
    for (output, noise) in outputs.iter().zip(&noise.0) {
        output.add_fast(noise.fast, &mut scatter);
        output.blocks().spread(&noise.slow, &mut scatter);
    }
    scatter.fill_upper_triangle_with_lower_triangle();
    scatter
}

fn transformed(root: &DMatrix<f64>, mut outputs: Vec<Series>) -> Vec<Series> {
    for output in &mut outputs {
        output.transform(root);
    }
    outputs
}

/// The noise of outputs whose H is the unit matrix, when what the parameters took is added back.
fn settled(outputs: &[Series]) -> Noise {
    let blocks: Vec<Series> = outputs.iter().map(Series::blocks).collect();
    let observed: Vec<Vec<f64>> = blocks.iter().map(Series::autocovariances).collect();
    let fitted = |o: &Series, covariances: &[f64]| Autoregression::fitted(covariances, o.count());
    let mut slow: Vec<_> = blocks.iter().zip(&observed).map(|(o, seen)| fitted(o, seen)).collect();
    let n = outputs.first().map_or(0, Series::parameters);
    let mut fast = DMatrix::zeros(n, n);
    for output in outputs {
        output.add_fast(output.fast_variance(), &mut fast);
    }
    for _ in 0..ROUNDS {
        let mut scatter = fast.clone();
        let spread: Vec<_> = blocks.iter().zip(&slow).map(|(o, noise)| o.spread(noise, &mut scatter)).collect();
        scatter.fill_upper_triangle_with_lower_triangle();
        let whole = |(o, (seen, spread)): (&Series, (&Vec<f64>, &Vec<f64>))| {
            let whole: Vec<f64> = seen.iter().zip(o.taken(spread, &scatter)).map(|(s, t)| s + t).collect();
            fitted(o, &whole)
        };
        let next: Vec<_> = blocks.iter().zip(observed.iter().zip(&spread)).map(whole).collect();
        let settled = slow.iter().zip(&next).all(|(a, b)| {
            let (a, b) = (a.long_run_variance(), b.long_run_variance());
            (a - b).abs() <= SETTLED * b
        });
        slow = next;
        if settled {
            break;
        }
    }
    Noise(outputs.iter().zip(slow).map(|(o, slow)| OutputNoise { slow, fast: o.fast_variance() }).collect())
}

impl Series {
    /// S to S T.
    fn transform(&mut self, root: &DMatrix<f64>) {
        let n = root.nrows();
        let mut before = vec![0.0; n];
        for row in self.sensitivities.chunks_exact_mut(n) {
            before.copy_from_slice(row);
            for (new, column) in row.iter_mut().zip(root.column_iter()) {
                *new = dot(&before, column.as_slice());
            }
        }
    }

    /// Samples of a block.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive number")]
    fn block(&self) -> usize {
        (BLOCK_S / self.step_s).round().max(1.0) as usize
    }

    /// Means of residuals and sensitivities over blocks, with the weight that a block has. Of a block that does not count
    /// whole the sensitivities are less.
    fn blocks(&self) -> Series {
        let (block, n) = (self.block(), self.parameters());
        let mut blocks = Series {
            step_s: self.step_s * block as f64,
            weight: self.weight * block as f64,
            variance: self.variance / block as f64,
            residuals: Vec::new(),
            used: Vec::new(),
            sensitivities: Vec::new(),
        };
        for (k, used) in self.used.chunks(block).enumerate() {
            let count = used.iter().filter(|used| **used).count();
            let samples = k * block..k * block + used.len();
            blocks.used.push(count > 0);
            blocks.residuals.push(self.residuals[samples.clone()].iter().sum::<f64>() / count.max(1) as f64);
            let first = blocks.sensitivities.len();
            blocks.sensitivities.resize(first + n, 0.0);
            for row in self.sensitivities[samples.start * n..samples.end * n].chunks_exact(n) {
                for (mean, s) in blocks.sensitivities[first..].iter_mut().zip(row) {
                    *mean += s / block as f64;
                }
            }
        }
        blocks
    }

    /// Variance of the residuals about their block's mean.
    fn fast_variance(&self) -> f64 {
        let (mut square, mut freedom) = (0.0, 0);
        for (v, used) in self.residuals.chunks(self.block()).zip(self.used.chunks(self.block())) {
            let counted = || v.iter().zip(used).filter(|(_, used)| **used).map(|(v, _)| *v);
            let count = counted().count();
            let mean = counted().sum::<f64>() / count.max(1) as f64;
            square += counted().map(|v| (v - mean) * (v - mean)).sum::<f64>();
            freedom += count.saturating_sub(1);
        }
        square / freedom.max(1) as f64
    }

    /// Adds to the lower triangle of the scatter what white noise within the blocks does.
    fn add_fast(&self, variance: f64, scatter: &mut DMatrix<f64>) {
        let (block, n) = (self.block(), self.parameters());
        let factor = self.weight * self.weight * variance;
        let mut deviation = vec![0.0; n];
        for (rows, used) in self.sensitivities.chunks(block * n).zip(self.used.chunks(block)) {
            let count = used.iter().filter(|used| **used).count().max(1) as f64;
            let mut mean = vec![0.0; n];
            for row in rows.chunks_exact(n) {
                mean.iter_mut().zip(row).for_each(|(mean, s)| *mean += s / count);
            }
            for (row, _) in rows.chunks_exact(n).zip(used).filter(|(_, used)| **used) {
                for (deviation, (s, mean)) in deviation.iter_mut().zip(row.iter().zip(&mean)) {
                    *deviation = s - mean;
                }
                add_square(scatter, factor, &deviation);
            }
        }
    }

    fn count(&self) -> usize {
        self.used.iter().filter(|used| **used).count()
    }

    fn parameters(&self) -> usize {
        self.sensitivities.len() / self.used.len().max(1)
    }

    /// Σ_k f(k, k + lag) over the pairs of samples that count, per pair, at lags 0, 1, …
    fn per_pair(&self, f: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let samples = self.used.len();
        let mean = |lag: usize| {
            let pairs = (0..samples - lag).map(|k| (k, k + lag)).filter(|&(k, l)| self.used[k] && self.used[l]);
            let (sum, count) = pairs.fold((0.0, 0_usize), |(sum, count), (k, l)| (sum + f(k, l), count + 1));
            sum / count.max(1) as f64
        };
        (0..=ORDER.min(samples / BLOCKS_PER_COEFFICIENT)).map(mean).collect()
    }

    fn autocovariances(&self) -> Vec<f64> {
        self.per_pair(|k, l| self.residuals[k] * self.residuals[l])
    }

    /// R S; adds Sᵀ W R W S to the lower triangle of the scatter.
    fn spread(&self, noise: &Autoregression, scatter: &mut DMatrix<f64>) -> Vec<f64> {
        let n = self.parameters();
        let mut series = self.sensitivities.clone();
        series.resize(series.len() + n * noise.memory(self.used.len()), 0.0);
        noise.filter(&mut series, n);
        let factor = self.weight * self.weight * noise.innovation;
        series.chunks_exact(n).for_each(|row| add_square(scatter, factor, row));
        noise.filter_back(&mut series, n);
        series.truncate(self.sensitivities.len());
        for s in &mut series {
            *s *= noise.innovation;
        }
        series
    }

    /// What the parameters have taken out of the noise's autocovariances: R − (I − P) R (I − P)ᵀ along its diagonals.
    fn taken(&self, spread: &[f64], scatter: &DMatrix<f64>) -> Vec<f64> {
        let n = self.parameters();
        let mut scattered = Vec::with_capacity(self.sensitivities.len());
        for row in self.sensitivities.chunks_exact(n) {
            scattered.extend(scatter.column_iter().map(|column| dot(row, column.as_slice())));
        }
        let s = |k: usize| &self.sensitivities[k * n..(k + 1) * n];
        let at = |rows: &[f64], k: usize, l: usize| dot(&rows[k * n..(k + 1) * n], s(l));
        self.per_pair(|k, l| self.weight * (at(spread, k, l) + at(spread, l, k)) - at(&scattered, k, l))
    }
}

/// a·b, summed in lanes: one running sum would keep the processor from multiplying several at once.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    const LANES: usize = 8;
    let (mut a, mut b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let mut sums = [0.0; LANES];
    for (a, b) in a.by_ref().zip(b.by_ref()) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::super::tests::Noise;
    use super::*;

    /// The variance stated for the mean of values, given their residuals from it; H = w N and T = 1/√H.
    fn of_the_mean(values: &[f64], used: &[bool]) -> f64 {
        let weight = 3.0;
        let count = used.iter().filter(|used| **used).count() as f64;
        let of = |used: bool, value: f64| if used { value } else { 0.0 };
        let mean = values.iter().zip(used).map(|(v, used)| of(*used, *v)).sum::<f64>() / count;
        let series = Series {
            step_s: 0.1,
            weight,
            variance: 0.0,
            residuals: values.iter().zip(used).map(|(v, used)| of(*used, v - mean)).collect(),
            used: used.to_vec(),
            sensitivities: used.iter().map(|used| of(*used, 1.0)).collect(),
        };
        covariance(&DMatrix::from_element(1, 1, 1.0 / (weight * count).sqrt()), vec![series])[(0, 0)]
    }

    #[test]
    fn the_variance_of_a_mean_of_white_values_has_n_minus_one_degrees_of_freedom() {
        // Fewer than BLOCKS_PER_COEFFICIENT blocks: white noise is all that is considered. The blocks' means speak alone.
        let means = [1.0, 3.0, 2.0, 5.0, 4.0, 1.0, 0.0, 2.0, 3.0];
        let values: Vec<f64> = means.iter().flat_map(|m| [m + 0.5, m - 0.5]).collect();
        let mean = means.iter().sum::<f64>() / 9.0;
        let square: f64 = means.iter().map(|v| (v - mean) * (v - mean)).sum();
        // Nine blocks, so that a degree of freedom not counted would be 11%.
        assert_relative_eq!(of_the_mean(&values, &[true; 18]), square / 8.0 / 9.0, max_relative = 0.02);
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
            stated += of_the_mean(&values, &used) / f64::from(draws);
            let counted: Vec<f64> = values.iter().zip(&used).filter(|(_, used)| **used).map(|(v, _)| *v).collect();
            let mean = counted.iter().sum::<f64>() / counted.len() as f64;
            scatter += mean * mean / f64::from(draws);
        }
        let product = |k: usize, l: usize| c.powi(i32::try_from(k.abs_diff(l)).unwrap());
        let counted: Vec<usize> = (0..samples).filter(|&k| used[k]).collect();
        let sum: f64 = counted.iter().flat_map(|&k| counted.iter().map(move |&l| product(k, l))).sum();
        let exact = sum / (counted.len() * counted.len()) as f64;
        // 200 draws give the scatter to 10%, the mean of the stated variances to some 3%.
        assert_relative_eq!(stated, exact, max_relative = 0.1);
        assert_relative_eq!(scatter, exact, max_relative = 0.3);
    }
}
