//! Products of a series with itself at lags.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use pulp::{Arch, Simd, WithSimd};

/// Greatest number of lags, lag 0 included: the sums of all lags lie side by side in the lanes of
/// vectors.
pub(crate) const MOST_LAGS: usize = 16;

/// Sums Σ_k v_k v_{k+lag} at lags 0, 1, …, at most [`MOST_LAGS`] of them.
pub(crate) fn lagged_products(values: &[f64], lags: usize) -> Vec<f64> {
    let mut sums = Arch::new().dispatch(LaggedProducts(values)).to_vec();
    sums.truncate(lags);
    sums
}

struct LaggedProducts<'a>(&'a [f64]);

impl WithSimd for LaggedProducts<'_> {
    type Output = [f64; MOST_LAGS];

    /// Each sum is added in the order of the series, so that all widths of vectors give the same bits.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f64; MOST_LAGS] {
        let mut sums = [0.0; MOST_LAGS];
        for later in self.0.array_windows::<MOST_LAGS>() {
            for (sum, value) in sums.iter_mut().zip(later) {
                *sum = later[0].mul_add(*value, *sum);
            }
        }
        let last = (self.0.len() + 1).saturating_sub(MOST_LAGS);
        for k in last..self.0.len() {
            for (sum, value) in sums.iter_mut().zip(&self.0[k..]) {
                *sum = self.0[k].mul_add(*value, *sum);
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use pulp::Scalar;

    use super::*;

    fn series(length: usize) -> Vec<f64> {
        (0..length).map(|k| (1.3 * (k * k) as f64).sin()).collect()
    }

    #[test]
    fn products_of_short_and_long_series_are_those_of_their_pairs() {
        for length in [0, 1, 5, MOST_LAGS - 1, MOST_LAGS, MOST_LAGS + 1, 75] {
            let values = series(length);
            let sums = lagged_products(&values, MOST_LAGS);
            for (lag, sum) in sums.iter().enumerate() {
                let pairs = values.iter().zip(values.iter().skip(lag));
                let expected: f64 = pairs.map(|(now, later)| now * later).sum();
                assert!((sum - expected).abs() < 1e-13, "{length} {lag}");
            }
            assert_eq!(lagged_products(&values, 3), sums[..3]);
        }
    }

    #[test]
    fn every_width_of_vectors_gives_the_same_bits() {
        let values = series(75);
        let scalar = Scalar.vectorize(LaggedProducts(&values));
        let widest = lagged_products(&values, MOST_LAGS);
        assert_eq!(
            scalar.map(f64::to_bits).to_vec(),
            widest.iter().map(|s| s.to_bits()).collect::<Vec<_>>()
        );
    }
}
