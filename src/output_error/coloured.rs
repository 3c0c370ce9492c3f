//! Scatter of the estimates under coloured residuals (after Morelli and Klein 1997): H⁻¹ [Σ Sᵀ W R W S] H⁻¹ with R the
//! autocovariance of the noise, in a form that stays positive and counts the degrees of freedom.
//!
//! Residuals are not the noise: the parameters have followed it, most where it is slow. With P = S H⁻¹ Sᵀ W their
//! covariance is (I − P) R (I − P)ᵀ, so what P took is added back, round after round until R settles. R of each output is
//! that of an autoregressive process, by which the sensitivities are filtered: every variance is a sum of squares.
//!
//! For this sensitivities are taken as S T with T Tᵀ = H⁻¹, which makes H the unit matrix.
//!
//! Variances from a noise that is itself estimated are known with few degrees of freedom ([`freedom`]).
//!
//! Noise is seen through blocks of samples: what moves slower than a block is the autoregressive process, with few
//! coefficients even where it is far slower; what moves faster is white within the blocks. Parameters act slower than a
//! block, so the process decides, and a slow component counts that is small beside the sensors' white noise.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(clippy::needless_range_loop, reason = "plain indices become straight code for the vectors")]

use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

use super::autoregression::Autoregression;
use super::freedom::{self, Known, Part};
use super::kernel::load;
use super::lanes::{Aligned, VECTOR};
use super::normal::Rows;

/// Length of a block, s: the short period and the test inputs are several times longer.
const BLOCK_S: f64 = 0.2;
/// Longest memory of a process, blocks.
const ORDER: usize = 12;
/// A process has at most one coefficient per so many blocks.
const BLOCKS_PER_COEFFICIENT: usize = 10;
const ROUNDS: usize = 30;
/// R is settled when no output's long-run variance changes by more than this share.
const SETTLED: f64 = 0.01;

/// One output of one maneuver, seen through blocks of samples.
#[derive(Clone, Debug)]
pub struct Series {
    /// Of a sample.
    weight: f64,
    /// Samples of a block.
    block: usize,
    parameters: usize,
    /// Which blocks have a sample that counts, and the means of their residuals.
    used: Vec<bool>,
    residuals: Vec<f64>,
    /// Variance of the samples about their block's mean, and the degrees of freedom with which it is known.
    fast: f64,
    fast_freedom: f64,
    /// Means of the sensitivities over the blocks, a row of whole vectors for each; of a block that does not count whole
    /// they are less.
    sensitivities: Aligned,
    /// Σ s sᵀ of the blocks once their parameters are final: white noise needs it again and again.
    between: Option<Scatter>,
    /// Σ s sᵀ of the samples' sensitivities about their block's mean.
    within: DMatrix<f64>,
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

/// Covariance of the parameters, where T Tᵀ = H⁻¹ and each output has independent noise.
#[must_use]
pub fn covariance(root: &DMatrix<f64>, outputs: Vec<Series>) -> Estimated {
    let outputs = transformed(root, outputs);
    let noise = settled(&outputs);
    let covariance = root * gradient_covariance(&outputs, &noise) * root.transpose();
    let mut known = Known::nothing(root.nrows());
    for (output, noise) in outputs.iter().zip(&noise.0) {
        output.know(noise, root, &mut known);
    }
    Estimated { covariance, freedom: known.freedom() }
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
    let series = Series::new(step_s, 1.0, &residuals, &used, DMatrix::zeros(1, 1), |_, _| ());
    let slow = series.fitted(&series.autocovariances()).long_run_variance();
    (slow * series.block as f64).max(variance)
}

/// Σ Sᵀ W R W S: what noise does to the gradient.
#[must_use]
pub fn gradient_covariance(outputs: &[Series], noise: &Noise) -> DMatrix<f64> {
    let mut scatter = Scatter::zeros(outputs.first().map_or(0, |o| o.parameters));
    let mut filtered = Vec::new();
    for (output, noise) in outputs.iter().zip(&noise.0) {
        scatter.add(&output.within, output.weight * output.weight * noise.fast);
        output.filter(&noise.slow, &mut filtered, &mut scatter);
    }
    scatter.whole()
}

fn transformed(root: &DMatrix<f64>, mut outputs: Vec<Series>) -> Vec<Series> {
    for output in &mut outputs {
        output.transform(root);
    }
    outputs
}

/// The noise of outputs whose H is the unit matrix, when what the parameters took is added back.
fn settled(outputs: &[Series]) -> Noise {
    let observed: Vec<Vec<f64>> = outputs.iter().map(Series::autocovariances).collect();
    let pairs: Vec<Vec<f64>> = outputs.iter().map(Series::pairs).collect();
    let mut slow: Vec<_> = outputs.iter().zip(&observed).map(|(o, seen)| o.fitted(seen)).collect();
    let mut fast = Scatter::zeros(outputs.first().map_or(0, |o| o.parameters));
    for output in outputs {
        fast.add(&output.within, output.weight * output.weight * output.fast);
    }
    let mut spread: Vec<Vec<f64>> = vec![Vec::new(); outputs.len()];
    for _ in 0..ROUNDS {
        let mut scatter = fast.clone();
        for ((output, noise), spread) in outputs.iter().zip(&slow).zip(&mut spread) {
            output.filter(noise, spread, &mut scatter);
            output.filter_back(noise, spread);
        }
        scatter.mirror();
        let mut next = Vec::with_capacity(slow.len());
        for (((output, seen), pairs), spread) in outputs.iter().zip(&observed).zip(&pairs).zip(&spread) {
            let taken = output.taken(spread, &scatter);
            let whole: Vec<f64> = seen.iter().zip(taken.iter().zip(pairs)).map(|(s, (t, n))| s + t / n).collect();
            next.push(output.fitted(&whole));
        }
        let settled = slow.iter().zip(&next).all(|(a, b)| {
            let (a, b) = (a.long_run_variance(), b.long_run_variance());
            (a - b).abs() <= SETTLED * b
        });
        slow = next;
        if settled {
            break;
        }
    }
    Noise(outputs.iter().zip(slow).map(|(o, slow)| OutputNoise { slow, fast: o.fast }).collect())
}

/// Parameters padded to whole vectors.
fn width(parameters: usize) -> usize {
    parameters.next_multiple_of(VECTOR)
}

impl Series {
    /// Sees one output through blocks. `residuals` are zero where a sample does not count, `add_sum` adds the
    /// sensitivities of some samples' to a row, zero those of what does not count, and `squares` is Σ s sᵀ over all.
    #[must_use]
    pub fn new(
        step_s: f64,
        weight: f64,
        residuals: &[f64],
        used: &[bool],
        squares: DMatrix<f64>,
        add_sum: impl Fn(std::ops::Range<usize>, &mut [f64]),
    ) -> Series {
        let (block, parameters) = (samples_of_block(step_s), squares.nrows());
        let blocks = used.len().div_ceil(block);
        let (fast, fast_freedom) = fast_variance(residuals, used, block);
        let mut series = Series {
            weight,
            block,
            parameters,
            used: Vec::with_capacity(blocks),
            residuals: Vec::with_capacity(blocks),
            fast,
            fast_freedom,
            sensitivities: Aligned::zeros(blocks * width(parameters)),
            between: None,
            within: squares,
        };
        let rows = series.sensitivities.slice_mut().chunks_exact_mut(width(parameters).max(1));
        for ((k, used), row) in used.chunks(block).enumerate().zip(rows) {
            let count = used.iter().filter(|used| **used).count();
            let samples = k * block..k * block + used.len();
            series.used.push(count > 0);
            series.residuals.push(residuals[samples.clone()].iter().sum::<f64>() / count.max(1) as f64);
            add_sum(samples, row);
            // So that a sum's square counts per sample.
            let scale = 1.0 / (count.max(1) as f64).sqrt();
            for s in row.iter_mut() {
                *s *= scale;
            }
        }
        let mut between = Scatter::zeros(parameters);
        between.add_squares(series.sensitivities.slice(), 1.0);
        series.within -= between.whole();
        let rows = series.sensitivities.slice_mut().chunks_exact_mut(width(parameters).max(1));
        for (used, row) in used.chunks(block).zip(rows) {
            let count = used.iter().filter(|used| **used).count().max(1) as f64;
            for s in row.iter_mut() {
                *s *= count.sqrt() / block as f64;
            }
        }
        series
    }

    /// The same with other parameters: `places` says where each stands among them.
    #[must_use]
    pub fn widened(&self, places: &[usize], parameters: usize) -> Series {
        let (own, wide) = (width(self.parameters).max(1), width(parameters).max(1));
        let mut sensitivities = Aligned::zeros(self.used.len() * wide);
        let rows = sensitivities.slice_mut().chunks_exact_mut(wide).zip(self.sensitivities.slice().chunks_exact(own));
        for (wide, own) in rows {
            places.iter().zip(own).for_each(|(&place, s)| wide[place] = *s);
        }
        let mut within = DMatrix::zeros(parameters, parameters);
        for (j, &column) in places.iter().enumerate() {
            for (i, &row) in places.iter().enumerate() {
                within[(row, column)] = self.within[(i, j)];
            }
        }
        Series { parameters, sensitivities, within, between: None, ..self.clone() }
    }

    /// The weight of a block's mean.
    fn block_weight(&self) -> f64 {
        self.weight * self.block as f64
    }

    /// S to S T.
    fn transform(&mut self, root: &DMatrix<f64>) {
        let width = width(self.parameters);
        let rows = rows_of(root, width);
        let before = std::mem::replace(&mut self.sensitivities, Aligned::zeros(self.used.len() * width));
        let (rows, from) = (rows.slice(), before.slice());
        Arch::new().dispatch(Product { from, matrix: rows, to: self.sensitivities.slice_mut(), width });
        let mut between = Scatter::zeros(self.parameters);
        between.add_squares(self.sensitivities.slice(), 1.0);
        self.between = Some(between);
        self.within = root.transpose() * &self.within * root;
    }

    /// Adds what this output's noise gives the parameters, and how well that is known. Sensitivities are S T.
    fn know(&self, noise: &OutputNoise, root: &DMatrix<f64>, known: &mut Known) {
        let (width, weight) = (width(self.parameters), self.block_weight());
        let own = root * &self.within * root.transpose();
        let within = self.weight * self.weight * noise.fast;
        known.add(own.diagonal().iter().map(|v| within * v), self.fast_freedom);
        let matrix = rows_of(&root.transpose(), width);
        let mut changes = vec![0.0; (self.used.len() + noise.slow.memory(self.used.len())) * width];
        let from = self.sensitivities.slice();
        Arch::new().dispatch(Product { from, matrix: matrix.slice(), to: &mut changes[..from.len()], width });
        for change in &mut changes {
            *change *= weight;
        }
        // With H the unit matrix, this is what the parameters took of the blocks.
        let taken = weight * from.iter().map(|s| s * s).sum::<f64>();
        let freedom = self.used.iter().filter(|used| **used).count() as f64 - taken;
        Arch::new().dispatch(Part { noise: &noise.slow, changes, width, freedom, known });
    }

    fn fitted(&self, autocovariances: &[f64]) -> Autoregression {
        Autoregression::fitted(autocovariances, self.used.iter().filter(|used| **used).count())
    }

    fn lags(&self) -> usize {
        1 + ORDER.min(self.used.len() / BLOCKS_PER_COEFFICIENT)
    }

    /// Pairs of blocks that count, at lags 0, 1, …, at least one.
    fn pairs(&self) -> Vec<f64> {
        let count = |lag: usize| self.used.iter().zip(&self.used[lag..]).filter(|(a, b)| **a && **b).count();
        (0..self.lags()).map(|lag| count(lag).max(1) as f64).collect()
    }

    fn autocovariances(&self) -> Vec<f64> {
        let sum = |lag: usize| self.residuals.iter().zip(&self.residuals[lag..]).map(|(a, b)| a * b).sum::<f64>();
        self.pairs().iter().enumerate().map(|(lag, pairs)| sum(lag) / pairs).collect()
    }

    /// S filtered by the noise; adds Sᵀ W R W S to the lower triangle of the scatter.
    fn filter(&self, noise: &Autoregression, filtered: &mut Vec<f64>, scatter: &mut Scatter) {
        let width = width(self.parameters);
        filtered.clear();
        filtered.extend_from_slice(self.sensitivities.slice());
        let factor = self.block_weight().powi(2) * noise.innovation;
        if let Some(between) = self.between.as_ref().filter(|_| noise.coefficients.is_empty()) {
            scatter.add_scatter(between, factor);
            return;
        }
        filtered.resize(filtered.len() + width * noise.memory(self.used.len()), 0.0);
        Arch::new().dispatch(Filter { noise, series: filtered, width, back: false });
        scatter.add_squares(filtered, factor);
    }

    /// R S of blocks that count, from S filtered.
    fn filter_back(&self, noise: &Autoregression, filtered: &mut Vec<f64>) {
        let width = width(self.parameters);
        Arch::new().dispatch(Filter { noise, series: filtered, width, back: true });
        filtered.truncate(self.used.len() * width);
        for (row, used) in filtered.chunks_exact_mut(width.max(1)).zip(&self.used) {
            let factor = if *used { noise.innovation } else { 0.0 };
            for s in row.iter_mut() {
                *s *= factor;
            }
        }
    }

    /// What the parameters have taken out of the noise's autocovariances: R − (I − P) R (I − P)ᵀ summed along its
    /// diagonals.
    fn taken(&self, spread: &[f64], scatter: &Scatter) -> Vec<f64> {
        let width = width(self.parameters);
        let mut scattered = Aligned::zeros(self.used.len() * width);
        let s = self.sensitivities.slice();
        Arch::new().dispatch(Product { from: s, matrix: scatter.rows.slice(), to: scattered.slice_mut(), width });
        for (scattered, spread) in scattered.slice_mut().iter_mut().zip(spread) {
            *scattered = self.block_weight() * spread - *scattered;
        }
        let shifted = |a: &[f64], b: &[f64]| Arch::new().dispatch(Shifted { a, b, width, lags: self.lags() });
        let (before, after) = (shifted(scattered.slice(), s), shifted(s, spread));
        before.iter().zip(after).map(|(before, after)| before + self.block_weight() * after).collect()
    }
}

/// A matrix row by row, each padded to `width`.
fn rows_of(matrix: &DMatrix<f64>, width: usize) -> Aligned {
    let mut rows = Aligned::zeros(matrix.nrows() * width);
    for (i, row) in rows.slice_mut().chunks_exact_mut(width.max(1)).enumerate() {
        row.iter_mut().zip(matrix.row(i).iter()).for_each(|(row, v)| *row = *v);
    }
    rows
}

/// Samples of a block.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive number")]
pub(super) fn samples_of_block(step_s: f64) -> usize {
    (BLOCK_S / step_s).round().max(1.0) as usize
}

/// Variance of the residuals about their block's mean, and its degrees of freedom.
fn fast_variance(residuals: &[f64], used: &[bool], block: usize) -> (f64, f64) {
    let (mut square, mut freedom) = (0.0, 0);
    for (v, used) in residuals.chunks(block).zip(used.chunks(block)) {
        let counted = || v.iter().zip(used).filter(|(_, used)| **used).map(|(v, _)| *v);
        let count = counted().count();
        let mean = counted().sum::<f64>() / count.max(1) as f64;
        square += counted().map(|v| (v - mean) * (v - mean)).sum::<f64>();
        freedom += count.saturating_sub(1);
    }
    let freedom = freedom.max(1) as f64;
    (square / freedom, freedom)
}

/// Σ Sᵀ W R W S, rows of whole vectors.
#[derive(Clone, Debug)]
struct Scatter {
    parameters: usize,
    rows: Aligned,
}

impl Scatter {
    fn zeros(parameters: usize) -> Scatter {
        Scatter { parameters, rows: Aligned::zeros(width(parameters) * width(parameters)) }
    }

    fn add(&mut self, matrix: &DMatrix<f64>, factor: f64) {
        let width = width(self.parameters);
        for (row, own) in self.rows.slice_mut().chunks_exact_mut(width.max(1)).zip(matrix.column_iter()) {
            row.iter_mut().zip(own.iter()).for_each(|(sum, v)| *sum += factor * v);
        }
    }

    /// Adds factor Σ s sᵀ of rows to the lower triangle.
    fn add_squares(&mut self, rows: &[f64], factor: f64) {
        let width = width(self.parameters);
        if width == 0 {
            return;
        }
        let mut sum = Aligned::zeros(width * width);
        let squares = Squares { rows, parameters: self.parameters, matrix: sum.slice_mut(), width };
        Arch::new().dispatch(squares);
        self.rows.slice_mut().iter_mut().zip(sum.slice()).for_each(|(total, s)| *total += factor * s);
    }

    fn add_scatter(&mut self, other: &Scatter, factor: f64) {
        self.rows.slice_mut().iter_mut().zip(other.rows.slice()).for_each(|(total, s)| *total += factor * s);
    }

    /// Copies the lower triangle to the upper one.
    fn mirror(&mut self) {
        let width = width(self.parameters);
        let rows = self.rows.slice_mut();
        for i in 0..self.parameters {
            for j in 0..i {
                rows[j * width + i] = rows[i * width + j];
            }
        }
    }

    fn whole(&self) -> DMatrix<f64> {
        let width = width(self.parameters);
        let at = |i: usize, j: usize| self.rows.slice()[i.max(j) * width + i.min(j)];
        DMatrix::from_fn(self.parameters, self.parameters, at)
    }
}

/// Σ s sᵀ of rows into the lower triangle of a matrix.
struct Squares<'a> {
    rows: &'a [f64],
    parameters: usize,
    matrix: &'a mut [f64],
    width: usize,
}

impl WithSimd for Squares<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let used: Vec<usize> = (0..self.width / VECTOR).map(|v| (self.parameters - v * VECTOR).min(VECTOR)).collect();
        let rows = Rows { values: self.rows, stride: self.width, samples: self.rows.len() / self.width };
        rows.add_squares(simd, &used, self.matrix, self.width);
    }
}

/// Rows times a matrix, all of `width`; of the matrix there are as many rows as count.
struct Product<'a> {
    from: &'a [f64],
    matrix: &'a [f64],
    to: &'a mut [f64],
    width: usize,
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        if self.width == 0 {
            return;
        }
        let rows = self.from.len() / self.width;
        let mut row = 0;
        while row + ROWS_AT_ONCE <= rows {
            self.some::<S, ROWS_AT_ONCE>(simd, row);
            row += ROWS_AT_ONCE;
        }
        for row in row..rows {
            self.some::<S, 1>(simd, row);
        }
    }
}

/// As many sums side by side as hide how long one of them waits for itself.
const ROWS_AT_ONCE: usize = 6;

impl Product<'_> {
    /// `N` rows from one on.
    #[inline(always)]
    fn some<S: Simd, const N: usize>(&mut self, simd: S, row: usize) {
        let width = self.width;
        for lane in (0..width).step_by(S::F64_LANES) {
            let mut sums = [simd.splat_f64s(0.0); N];
            for (i, matrix) in self.matrix.chunks_exact(width).enumerate() {
                let entries = load::<S>(matrix, lane);
                for n in 0..N {
                    let factor = simd.splat_f64s(self.from[(row + n) * width + i]);
                    sums[n] = simd.mul_add_f64s(factor, entries, sums[n]);
                }
            }
            for n in 0..N {
                super::kernel::store::<S>(self.to, (row + n) * width + lane, sums[n]);
            }
        }
    }
}

/// Rows filtered by a process in place.
struct Filter<'a> {
    noise: &'a Autoregression,
    series: &'a mut [f64],
    width: usize,
    back: bool,
}

impl WithSimd for Filter<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        if self.width == 0 {
        } else if self.back {
            self.noise.filter_back(self.series, self.width);
        } else {
            self.noise.filter(self.series, self.width);
        }
    }
}

/// Σ a_k · b_{k+lag} over rows at lags 0, 1, …
struct Shifted<'a> {
    a: &'a [f64],
    b: &'a [f64],
    width: usize,
    lags: usize,
}

/// Lags at once, so that a row is read for several.
const LAGS_AT_ONCE: usize = 4;

impl WithSimd for Shifted<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
        let rows = self.a.len() / self.width.max(1);
        let mut sums = vec![0.0; self.lags];
        for (group, sums) in sums.chunks_mut(LAGS_AT_ONCE).enumerate() {
            let first = group * LAGS_AT_ONCE;
            let together = rows.saturating_sub(first + LAGS_AT_ONCE - 1);
            let at_once = self.some::<S, LAGS_AT_ONCE>(simd, first, 0..together);
            for (n, sum) in sums.iter_mut().enumerate() {
                let rest = together..rows.saturating_sub(first + n);
                *sum = at_once[n] + self.some::<S, 1>(simd, first + n, rest)[0];
            }
        }
        sums
    }
}

impl Shifted<'_> {
    /// Those at `N` lags from one on, over some of the rows. Lanes are summed eight apart and then in one order, so that
    /// the width of vectors does not show.
    #[inline(always)]
    fn some<S: Simd, const N: usize>(&self, simd: S, lag: usize, rows: std::ops::Range<usize>) -> [f64; N] {
        let width = self.width;
        let mut lanes = [[0.0; VECTOR]; N];
        for part in (0..VECTOR).step_by(S::F64_LANES) {
            let mut sums = [simd.splat_f64s(0.0); N];
            for k in rows.clone() {
                for lane in (part..width).step_by(VECTOR) {
                    let a = load::<S>(self.a, k * width + lane);
                    for n in 0..N {
                        let b = load::<S>(self.b, (k + lag + n) * width + lane);
                        sums[n] = simd.mul_add_f64s(a, b, sums[n]);
                    }
                }
            }
            for n in 0..N {
                super::kernel::store::<S>(&mut lanes[n], part, sums[n]);
            }
        }
        lanes.map(|lanes| lanes.iter().sum())
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::super::tests::Noise;
    use super::*;

    /// The variance stated for the mean of values, given their residuals from it; H = w N and T = 1/√H.
    fn of_the_mean(values: &[f64], used: &[bool]) -> Estimated {
        let weight = 3.0;
        let count = used.iter().filter(|used| **used).count() as f64;
        let of = |used: bool, value: f64| if used { value } else { 0.0 };
        let mean = values.iter().zip(used).map(|(v, used)| of(*used, *v)).sum::<f64>() / count;
        let residuals: Vec<f64> = values.iter().zip(used).map(|(v, used)| of(*used, v - mean)).collect();
        let squares = DMatrix::from_element(1, 1, count);
        let series = Series::new(0.1, weight, &residuals, used, squares, |samples, row| {
            row[0] += used[samples].iter().map(|used| of(*used, 1.0)).sum::<f64>();
        });
        covariance(&DMatrix::from_element(1, 1, 1.0 / (weight * count).sqrt()), vec![series])
    }

    #[test]
    fn the_variance_of_a_mean_of_white_values_has_n_minus_one_degrees_of_freedom() {
        // Fewer than BLOCKS_PER_COEFFICIENT blocks: white noise is all that is considered. The blocks' means speak alone.
        let means = [1.0, 3.0, 2.0, 5.0, 4.0, 1.0, 0.0, 2.0, 3.0];
        let values: Vec<f64> = means.iter().flat_map(|m| [m + 0.5, m - 0.5]).collect();
        let mean = means.iter().sum::<f64>() / 9.0;
        let square: f64 = means.iter().map(|v| (v - mean) * (v - mean)).sum();
        // Nine blocks, so that a degree of freedom not counted would be 11%.
        let said = of_the_mean(&values, &[true; 18]);
        assert_relative_eq!(said.covariance[(0, 0)], square / 8.0 / 9.0, max_relative = 0.02);
        // The interval is Student's with as many.
        assert_relative_eq!(said.freedom[0], 8.0, max_relative = 1e-9);
        let longer = said.clone().of_student()[(0, 0)] / said.covariance[(0, 0)];
        assert_relative_eq!(longer.sqrt(), 2.306 / 1.960, max_relative = 1e-3);
    }

    #[test]
    fn white_noise_does_to_the_gradient_of_other_parameters_what_their_change_says() {
        let (count, weight, t) = (40, 3.0, 0.25);
        let residuals: Vec<f64> = (0..count).map(|k| if k % 4 < 2 { 1.0 } else { -1.0 }).collect();
        let squares = DMatrix::from_element(1, 1, f64::from(count));
        let mut series = Series::new(0.1, weight, &residuals, &vec![true; residuals.len()], squares, |samples, row| {
            row[0] += samples.len() as f64;
        });
        let white = Autoregression { coefficients: vec![], innovation: 2.0 };
        let noise = super::Noise(vec![OutputNoise { slow: white, fast: 1.0 }]);
        let before = gradient_covariance(&[series.clone()], &noise)[(0, 0)];
        series.transform(&DMatrix::from_element(1, 1, t));
        let after = gradient_covariance(&[series], &noise)[(0, 0)];
        // A block of two samples whose mean has the variance 2 gives the sum over it 8.
        assert_relative_eq!(before, weight * weight * 8.0 * f64::from(count) / 2.0, max_relative = 1e-12);
        assert_relative_eq!(after, t * t * before, max_relative = 1e-12);
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
        let (normal, student) = (f64::from(normal) / f64::from(draws), f64::from(student) / f64::from(draws));
        // 1000 draws give a share to 0.7 %.
        assert!(student > normal + 0.005, "Student {student}, normal {normal}");
        assert!((0.93..0.975).contains(&student), "Student {student}, normal {normal}");
    }
}
