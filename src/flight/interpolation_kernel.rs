//! Interpolation kernel of Catmull and Rom: the cubic through two samples with the slopes of their
//! neighbours. Its slope is continuous, so a delay can be estimated with the exact derivative of
//! the interpolated value.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use pulp::{Arch, Simd, WithSimd};

/// Number of samples that an interpolated value depends on.
pub const WIDTH: usize = 4;

/// Weights of four samples at a shift, and the slopes of the weights along the shift, per sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InterpolationKernel {
    /// Offset of the first of the four samples.
    first: isize,
    weights: [f64; WIDTH],
    slopes: [f64; WIDTH],
}

impl InterpolationKernel {
    /// Kernel of the value `shift` samples later than a sample.
    #[must_use]
    pub fn at(shift: f64) -> InterpolationKernel {
        let whole = shift.floor();
        let f = shift - whole;
        let (f2, f3) = (f * f, f * f * f);
        #[expect(clippy::cast_possible_truncation, reason = "a whole number of samples")]
        let first = whole as isize - 1;
        InterpolationKernel {
            first,
            weights: [
                -0.5 * f + f2 - 0.5 * f3,
                1.0 - 2.5 * f2 + 1.5 * f3,
                0.5 * f + 2.0 * f2 - 1.5 * f3,
                0.5 * (f3 - f2),
            ],
            slopes: [
                -0.5 + 2.0 * f - 1.5 * f2,
                -5.0 * f + 4.5 * f2,
                0.5 + 4.0 * f - 4.5 * f2,
                1.5 * f2 - f,
            ],
        }
    }

    /// Interpolates at sample `k` of `samples`: the value, and its slope along the shift, per
    /// sample.
    #[inline]
    pub fn interpolate(
        &self,
        k: usize,
        samples: usize,
        value: impl Fn(usize) -> f64,
    ) -> (f64, f64) {
        let (mut sum, mut slope) = (0.0, 0.0);
        let inside = k.checked_add_signed(self.first);
        if let Some(first) = inside.filter(|first| first + WIDTH <= samples) {
            for i in 0..WIDTH {
                let v = value(first + i);
                sum += self.weights[i] * v;
                slope += self.slopes[i] * v;
            }
            return (sum, slope);
        }
        for (sample, weight, by_shift) in self.weights_at(k, samples) {
            let v = value(sample);
            sum += weight * v;
            slope += by_shift * v;
        }
        (sum, slope)
    }

    /// Interpolates at sample `k` and the samples after it, as many as `to` has.
    pub fn interpolate_from(&self, k: usize, values: &[f64], to: &mut [f64]) {
        let first = k.checked_add_signed(self.first);
        let inside = first.and_then(|first| values.get(first..first + to.len() + WIDTH - 1));
        let Some(inside) = inside else {
            for (i, to) in to.iter_mut().enumerate() {
                *to = self.interpolate(k + i, values.len(), |k| values[k]).0;
            }
            return;
        };
        Arch::new().dispatch(Interpolation {
            weights: self.weights,
            values: inside,
            to,
        });
    }

    /// Distributes values at sample `k` and the samples after it over the samples from which they
    /// are interpolated: the transpose of [`Self::interpolate_from`].
    pub fn share_out(&self, k: usize, values: &[f64], to: &mut [f64]) {
        let first = k.checked_add_signed(self.first);
        let Some(first) = first.filter(|first| first + values.len() + WIDTH <= to.len() + 1) else {
            for (i, value) in values.iter().enumerate() {
                for (sample, weight, _) in self.weights_at(k + i, to.len()) {
                    to[sample] += weight * value;
                }
            }
            return;
        };
        Arch::new().dispatch(Distribution {
            weights: self.weights,
            values,
            to: &mut to[first..],
        });
    }

    /// Samples, weights and slopes of the weights at sample `k` of `samples`. The end sample stands
    /// for samples beyond an end.
    pub fn weights_at(&self, k: usize, samples: usize) -> impl Iterator<Item = (usize, f64, f64)> {
        let (first, last) = (self.first, samples.saturating_sub(1));
        let place = move |i: usize| (k + i).saturating_add_signed(first).min(last);
        self.weights
            .into_iter()
            .zip(self.slopes)
            .enumerate()
            .map(move |(i, (weight, slope))| (place(i), weight, slope))
    }
}

/// Weighted sums of four values each, compiled for the processor at hand.
struct Interpolation<'a> {
    weights: [f64; WIDTH],
    values: &'a [f64],
    to: &'a mut [f64],
}

impl WithSimd for Interpolation<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let [a, b, c, d] = self.weights;
        for (to, near) in self.to.iter_mut().zip(self.values.windows(WIDTH)) {
            *to = a * near[0] + b * near[1] + c * near[2] + d * near[3];
        }
    }
}

/// The transpose of [`Interpolation`].
struct Distribution<'a> {
    weights: [f64; WIDTH],
    values: &'a [f64],
    to: &'a mut [f64],
}

impl WithSimd for Distribution<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (i, weight) in self.weights.into_iter().enumerate() {
            for (to, value) in self.to[i..].iter_mut().zip(self.values) {
                *to += weight * value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn a_parabola_and_its_slope_are_interpolated_exactly() {
        let parabola = |t: f64| 2.0 - 0.3 * t + 0.05 * t * t;
        for shift in [-2.75, -1.0, -0.2, 0.0, 0.4, 1.0, 3.3] {
            let (value, slope) =
                InterpolationKernel::at(shift).interpolate(10, 21, |k| parabola(k as f64));
            assert_abs_diff_eq!(value, parabola(10.0 + shift), epsilon = 1e-12);
            assert_abs_diff_eq!(slope, -0.3 + 0.1 * (10.0 + shift), epsilon = 1e-12);
        }
    }

    #[test]
    fn the_slope_is_the_derivative_of_the_value_across_a_sample_too() {
        let value = |shift| {
            InterpolationKernel::at(shift)
                .interpolate(10, 21, |k| (k as f64).sin())
                .0
        };
        for shift in [-1.0, -0.3, 0.0, 0.7, 2.0] {
            let numeric = (value(shift + 1e-6) - value(shift - 1e-6)) / 2e-6;
            assert_abs_diff_eq!(
                InterpolationKernel::at(shift)
                    .interpolate(10, 21, |k| (k as f64).sin())
                    .1,
                numeric,
                epsilon = 1e-6
            );
        }
    }

    #[test]
    fn many_samples_are_interpolated_as_each_of_them_is() {
        let values: Vec<f64> = (0..12).map(|k| f64::from(k).sin()).collect();
        for shift in [-2.3, 0.0, 0.6] {
            let kernel = InterpolationKernel::at(shift);
            for (k, count) in [(0, 12), (4, 5)] {
                let mut many = vec![0.0; count];
                kernel.interpolate_from(k, &values, &mut many);
                let each = (0..count).map(|i| kernel.interpolate(k + i, 12, |k| values[k]).0);
                assert_eq!(many, each.collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn sharing_out_is_the_transpose_of_interpolation() {
        let (values, shares): (Vec<f64>, Vec<f64>) = (0..12)
            .map(|k| (f64::from(k).sin(), f64::from(k).cos()))
            .unzip();
        for shift in [-2.3, 0.0, 0.6] {
            let kernel = InterpolationKernel::at(shift);
            for (k, count) in [(0, 12), (4, 5)] {
                let (mut interpolated, mut shared) = (vec![0.0; count], vec![0.0; 12]);
                kernel.interpolate_from(k, &values, &mut interpolated);
                kernel.share_out(k, &shares[..count], &mut shared);
                let product =
                    |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
                assert_abs_diff_eq!(
                    product(&interpolated, &shares),
                    product(&values, &shared),
                    epsilon = 1e-12
                );
            }
        }
    }

    #[test]
    fn samples_beyond_an_end_are_the_end_sample() {
        assert_abs_diff_eq!(
            InterpolationKernel::at(-5.0)
                .interpolate(0, 3, |k| [4.0, 5.0, 6.0][k])
                .0,
            4.0
        );
        assert_abs_diff_eq!(
            InterpolationKernel::at(5.0)
                .interpolate(2, 3, |k| [4.0, 5.0, 6.0][k])
                .0,
            6.0
        );
    }
}
