//! Interpolation kernel of Catmull and Rom: the cubic through two samples with the slopes of their
//! neighbours. Its slope is continuous, so a delay can be estimated with the exact derivative of
//! the interpolated value.

/// Number of samples that an interpolated value depends on.
const WIDTH: usize = 4;

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

    /// Offset of the first sample of the kernel.
    #[must_use]
    pub fn first_offset(&self) -> isize {
        self.first
    }

    /// Offset of the last sample of the kernel.
    #[must_use]
    pub fn last_offset(&self) -> isize {
        self.first + 3
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
