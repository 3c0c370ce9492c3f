//! Fourier sums of several series at once, at some harmonics of their length.
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
            let rows: Vec<[f64; SIDE_BY_SIDE]> = (0..self.turn.len())
                .map(|n| std::array::from_fn(|i| series.get(i).map_or(0.0, |x| x[n])))
                .collect();
            for first in (0..self.len()).step_by(TOGETHER) {
                let parts = Arch::new().dispatch(HarmonicSums {
                    turn: &self.turn,
                    rows: &rows,
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

/// Real and imaginary parts of successive harmonics of series side by side, compiled for the processor
/// at hand.
struct HarmonicSums<'a> {
    turn: &'a [[f64; 2]],
    rows: &'a [[f64; SIDE_BY_SIDE]],
    numbers: [usize; TOGETHER],
}

impl WithSimd for HarmonicSums<'_> {
    type Output = [[[f64; SIDE_BY_SIDE]; 2]; TOGETHER];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let samples = self.rows.len();
        let steps = self.numbers.map(|number| number % samples.max(1));
        let mut real = [[0.0; SIDE_BY_SIDE]; TOGETHER];
        let mut imaginary = real;
        let mut places = [0; TOGETHER];
        for row in self.rows {
            for k in 0..TOGETHER {
                let [cosine, sine] = self.turn[places[k]];
                for i in 0..SIDE_BY_SIDE {
                    real[k][i] += cosine * row[i];
                    imaginary[k][i] -= sine * row[i];
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
        let samples = 57;
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
