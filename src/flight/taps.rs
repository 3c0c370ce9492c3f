//! A recorded signal between its samples: the cubic through two samples with the slopes of their
//! neighbours (Catmull and Rom), which has a continuous slope, so that a delay can be estimated
//! with the exact derivative of what was computed.

/// Four samples, their weights at a shift and the weights' slopes along it, per sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taps {
    /// Where the first tap is, relative to the sample.
    first: isize,
    weights: [f64; 4],
    slopes: [f64; 4],
}

impl Taps {
    /// The value `shift` samples later than a sample.
    #[must_use]
    pub fn at(shift: f64) -> Taps {
        let whole = shift.floor();
        let f = shift - whole;
        let (f2, f3) = (f * f, f * f * f);
        #[expect(clippy::cast_possible_truncation, reason = "a whole number of samples")]
        let first = whole as isize - 1;
        Taps {
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

    /// Σ weight · value(sample) at sample `k` of `samples`, and the same with the slopes, per
    /// sample; a tap beyond an end takes the end.
    pub fn sum(&self, k: usize, samples: usize, value: impl Fn(usize) -> f64) -> (f64, f64) {
        let (mut sum, mut slope) = (0.0, 0.0);
        for (sample, weight, by_shift) in self.each(k, samples) {
            let v = value(sample);
            sum += weight * v;
            slope += by_shift * v;
        }
        (sum, slope)
    }

    /// Where the first and the last tap are, relative to the sample.
    #[must_use]
    pub fn first(&self) -> isize {
        self.first
    }

    #[must_use]
    pub fn last(&self) -> isize {
        self.first + 3
    }

    /// The taps at sample `k`: sample, weight, slope of the weight.
    pub fn each(&self, k: usize, samples: usize) -> impl Iterator<Item = (usize, f64, f64)> {
        let (first, last) = (self.first, samples.saturating_sub(1));
        let place = move |i: usize| (k + i).saturating_add_signed(first).min(last);
        self.weights
            .into_iter()
            .zip(self.slopes)
            .enumerate()
            .map(move |(i, (w, s))| (place(i), w, s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn a_parabola_is_met_between_its_samples_with_its_slope() {
        let parabola = |t: f64| 2.0 - 0.3 * t + 0.05 * t * t;
        for shift in [-2.75, -1.0, -0.2, 0.0, 0.4, 1.0, 3.3] {
            let (value, slope) = Taps::at(shift).sum(10, 21, |k| parabola(k as f64));
            assert_abs_diff_eq!(value, parabola(10.0 + shift), epsilon = 1e-12);
            assert_abs_diff_eq!(slope, -0.3 + 0.1 * (10.0 + shift), epsilon = 1e-12);
        }
    }

    #[test]
    fn the_slope_is_that_of_the_value_across_a_sample_too() {
        let value = |shift| Taps::at(shift).sum(10, 21, |k| (k as f64).sin()).0;
        for shift in [-1.0, -0.3, 0.0, 0.7, 2.0] {
            let numeric = (value(shift + 1e-6) - value(shift - 1e-6)) / 2e-6;
            assert_abs_diff_eq!(
                Taps::at(shift).sum(10, 21, |k| (k as f64).sin()).1,
                numeric,
                epsilon = 1e-6
            );
        }
    }

    #[test]
    fn beyond_the_ends_the_ends_stand() {
        assert_abs_diff_eq!(Taps::at(-5.0).sum(0, 3, |k| [4.0, 5.0, 6.0][k]).0, 4.0);
        assert_abs_diff_eq!(Taps::at(5.0).sum(2, 3, |k| [4.0, 5.0, 6.0][k]).0, 6.0);
    }
}
