//! Scatter of the estimates under coloured residuals (after Morelli and Klein 1997): H⁻¹ [Σ Sᵀ W R W S] H⁻¹ with R the
//! autocovariance of the noise, in a form that stays positive and counts the degrees of freedom.
//!
//! Residuals are not the noise: the parameters have followed it, most where it is slow. With P = S H⁻¹ Sᵀ W their
//! covariance is (I − P) R (I − P)ᵀ, so what P took is added back, round after round until R settles. R of each output is
//! that of an autoregressive process, by which the sensitivities are filtered: every variance is a sum of squares.
//!
//! For this sensitivities are taken as S T with T Tᵀ = H⁻¹, which makes H the unit matrix.

use nalgebra::DMatrix;

use super::autoregression::Autoregression;

/// Longest memory of a process, samples.
const ORDER: usize = 12;
/// A process has at most one coefficient per so many samples.
const SAMPLES_PER_COEFFICIENT: usize = 20;
const ROUNDS: usize = 10;
/// R is settled when no output's long-run variance changes by more than this share.
const SETTLED: f64 = 0.1;

/// One output of one maneuver.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
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
pub struct Noise(Vec<Autoregression>);

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

/// Σ Sᵀ W R W S: what noise does to the gradient.
#[must_use]
pub fn gradient_covariance(outputs: &[Series], noise: &Noise) -> DMatrix<f64> {
    let n = outputs.first().map_or(0, Series::parameters);
    let mut scatter = DMatrix::zeros(n, n);
    for (output, noise) in outputs.iter().zip(&noise.0) {
        output.spread(noise, &mut scatter);
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
    let observed: Vec<Vec<f64>> = outputs.iter().map(Series::autocovariances).collect();
    let fitted = |o: &Series, covariances: &[f64]| Autoregression::fitted(covariances, o.count());
    let mut noise: Vec<_> = outputs.iter().zip(&observed).map(|(o, seen)| fitted(o, seen)).collect();
    let n = outputs.first().map_or(0, Series::parameters);
    let mut scatter = DMatrix::zeros(n, n);
    for _ in 0..ROUNDS {
        scatter.fill(0.0);
        let spread: Vec<_> = outputs.iter().zip(&noise).map(|(o, noise)| o.spread(noise, &mut scatter)).collect();
        scatter.fill_upper_triangle_with_lower_triangle();
        let whole = |(o, (seen, spread)): (&Series, (&Vec<f64>, &Vec<f64>))| {
            let whole: Vec<f64> = seen.iter().zip(o.taken(spread, &scatter)).map(|(s, t)| s + t).collect();
            fitted(o, &whole)
        };
        let next: Vec<_> = outputs.iter().zip(observed.iter().zip(&spread)).map(whole).collect();
        let settled = noise.iter().zip(&next).all(|(a, b)| {
            let (a, b) = (a.long_run_variance(), b.long_run_variance());
            (a - b).abs() <= SETTLED * b
        });
        noise = next;
        if settled {
            break;
        }
    }
    Noise(noise)
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
        (0..=ORDER.min(samples / SAMPLES_PER_COEFFICIENT)).map(mean).collect()
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
        series.chunks_exact(n).for_each(|row| super::cost::add_square(scatter, factor, row));
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
        // Fewer than SAMPLES_PER_COEFFICIENT samples: white noise is all that is considered.
        let values = [1.0, 3.0, 2.0, 5.0, 4.0, 1.0, 0.0, 2.0, 3.0, 1.0, 99.0];
        let used: Vec<bool> = (0..values.len()).map(|k| k < 10).collect();
        let square: f64 = values[..10].iter().map(|v| (v - 2.2) * (v - 2.2)).sum();
        // Ten samples, so that a degree of freedom not counted would be 10%.
        assert_relative_eq!(of_the_mean(&values, &used), square / 9.0 / 10.0, max_relative = 0.02);
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
