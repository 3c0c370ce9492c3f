//! Fourier sums of several series at once, at some harmonics of their length.
//!
//! The samples n and N − n of N have the same cosine, and sines that differ in sign. Their sum and
//! their difference therefore take the place of both, and halve the products.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

/// Series that are summed side by side, so that their sums fill the vector registers.
const SIDE_BY_SIDE: usize = 8;

/// Harmonics that are summed together: independent sums hide the latency of each.
const TOGETHER: usize = 3;

/// Harmonics of a length: frequencies of a whole number of periods over the samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Harmonics {
    numbers: Range<usize>,
    /// Cosine and sine of each sample's fraction of a turn.
    turn: Vec<[f64; 2]>,
}

impl Harmonics {
    #[must_use]
    pub fn new(samples: usize, numbers: Range<usize>) -> Harmonics {
        let angle = |n: usize| TAU * n as f64 / samples as f64;
        Harmonics {
            numbers,
            turn: (0..samples)
                .map(|n| [angle(n).cos(), angle(n).sin()])
                .collect(),
        }
    }

    /// Numbers of periods over the samples.
    #[must_use]
    pub fn numbers(&self) -> Range<usize> {
        self.numbers.clone()
    }

    /// Number of harmonics.
    #[must_use]
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    /// Sums Σ x(n) e^(−2πi k n / N): a column for each series, real parts of all harmonics above their
    /// imaginary parts.
    #[must_use]
    pub fn sums(&self, series: &[Vec<f64>]) -> DMatrix<f64> {
        let mut sums = DMatrix::zeros(2 * self.len(), series.len());
        for (block, series) in series.chunks(SIDE_BY_SIDE).enumerate() {
            let mirrored = mirrored(series, self.turn.len());
            for first in (0..self.len()).step_by(TOGETHER) {
                let parts = Arch::new().dispatch(HarmonicSums {
                    turn: &self.turn,
                    mirrored: &mirrored,
                    numbers: std::array::from_fn(|k| self.numbers.start + first + k),
                });
                for (row, [real, imaginary]) in (first..self.len()).zip(parts) {
                    for i in 0..series.len() {
                        let column = block * SIDE_BY_SIDE + i;
                        sums[(row, column)] = real[i];
                        sums[(self.len() + row, column)] = imaginary[i];
                    }
                }
            }
        }
        sums
    }
}

/// Sums and differences of the samples n and N − n of each series, from n = 0 to the middle. A sample
/// that mirrors itself counts once in the sum; its sine is zero.
fn mirrored(series: &[Vec<f64>], samples: usize) -> Vec<[[f64; SIDE_BY_SIDE]; 2]> {
    let value = |i: usize, n: usize| series.get(i).map_or(0.0, |x| x[n]);
    let pair = |n: usize| match samples - n {
        other if n == 0 || other == n => {
            [std::array::from_fn(|i| value(i, n)), [0.0; SIDE_BY_SIDE]]
        }
        other => [
            std::array::from_fn(|i| value(i, n) + value(i, other)),
            std::array::from_fn(|i| value(i, n) - value(i, other)),
        ],
    };
    (0..samples).take(samples / 2 + 1).map(pair).collect()
}

/// Real and imaginary parts of successive harmonics of series side by side, compiled for the processor
/// at hand.
struct HarmonicSums<'a> {
    turn: &'a [[f64; 2]],
    mirrored: &'a [[[f64; SIDE_BY_SIDE]; 2]],
    numbers: [usize; TOGETHER],
}

impl WithSimd for HarmonicSums<'_> {
    type Output = [[[f64; SIDE_BY_SIDE]; 2]; TOGETHER];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let samples = self.turn.len();
        let steps = self.numbers.map(|number| number % samples.max(1));
        let mut real = [[0.0; SIDE_BY_SIDE]; TOGETHER];
        let mut imaginary = real;
        let mut places = [0; TOGETHER];
        for [sum, difference] in self.mirrored {
            for k in 0..TOGETHER {
                let [cosine, sine] = self.turn[places[k]];
                for i in 0..SIDE_BY_SIDE {
                    real[k][i] = cosine.mul_add(sum[i], real[k][i]);
                    imaginary[k][i] = (-sine).mul_add(difference[i], imaginary[k][i]);
                }
                places[k] += steps[k];
                if places[k] >= samples {
                    places[k] -= samples;
                }
            }
        }
        std::array::from_fn(|k| [real[k], imaginary[k]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn sums_of_many_series_are_those_of_the_definition() {
        for samples in [57, 58, 1, 2] {
            sums_are_those_of_the_definition(samples);
        }
    }

    #[test]
    fn series_without_samples_have_no_sums() {
        let sums = Harmonics::new(0, 1..3).sums(&[vec![]]);
        assert!(sums.iter().all(|sum| *sum == 0.0));
    }

    fn sums_are_those_of_the_definition(samples: usize) {
        let series: Vec<Vec<f64>> = (0..11)
            .map(|i| {
                (0..samples)
                    .map(|n| (0.37 * (n * (i + 1)) as f64).sin() + i as f64)
                    .collect()
            })
            .collect();
        let sums = Harmonics::new(samples, 3..10).sums(&series);
        for (column, x) in series.iter().enumerate() {
            for (row, k) in (3..10).enumerate() {
                let part = |of: fn(f64) -> f64| -> f64 {
                    let terms = x.iter().enumerate();
                    terms
                        .map(|(n, x)| x * of(-TAU * (k * n) as f64 / samples as f64))
                        .sum()
                };
                assert_relative_eq!(sums[(row, column)], part(f64::cos), epsilon = 1e-11);
                assert_relative_eq!(sums[(7 + row, column)], part(f64::sin), epsilon = 1e-11);
            }
        }
    }
}
