//! Agreement of a computed response with the measured one: Theil's inequality coefficient with its
//! parts, and R².
//!
//! Let z be the n measured and y the computed values of one output. Theil's coefficient is
//!
//! U = √(Σ (y−z)²/n) / (√(Σ z²/n) + √(Σ y²/n)),
//!
//! from 0 (perfect) to 1 (no relation). The mean square in the numerator is the sum of three parts,
//! each published as its share (Theil 1966; Klein and Morelli 2006, section 11.3; Jategaonkar 2015,
//! section 11.4):
//!
//! - bias: squared difference of the means;
//! - variance: squared difference of the standard deviations σ_y and σ_z;
//! - covariance: 2 (1 − ρ) σ_y σ_z, with ρ the correlation of y and z.
//!
//! A good model leaves almost nothing to bias and variance. R² = 1 − Σ (z−y)² / Σ (z−z̄)² is one
//! for a perfect prediction and can be negative.

use crate::dynamics::OUTPUTS;
use crate::numerics::statistics::mean::mean;
use crate::output_error::case::Measurements;

/// Theil's inequality coefficient and the shares of its parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Theil {
    pub coefficient: f64,
    pub bias: f64,
    pub variance: f64,
    pub covariance: f64,
}

/// Moments of pairs of measured z and computed y of one output.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutputAgreement {
    pub samples: usize,
    mean_measured: f64,
    mean_computed: f64,
    /// Mean square of the measured values about their mean.
    square_measured: f64,
    /// Mean square of the computed values about their mean.
    square_computed: f64,
    /// Mean product of measured and computed values about their means.
    product: f64,
}

impl OutputAgreement {
    /// Moments of pairs (measured, computed).
    #[must_use]
    fn of_pairs(pairs: &[(f64, f64)]) -> OutputAgreement {
        let mean_measured = mean_of(pairs, |z, _| z);
        let mean_computed = mean_of(pairs, |_, y| y);
        OutputAgreement {
            samples: pairs.len(),
            mean_measured,
            mean_computed,
            square_measured: mean_of(pairs, |z, _| (z - mean_measured).powi(2)),
            square_computed: mean_of(pairs, |_, y| (y - mean_computed).powi(2)),
            product: mean_of(pairs, |z, y| (z - mean_measured) * (y - mean_computed)),
        }
    }

    /// Moments of each output, over the samples that count.
    #[must_use]
    pub fn of_outputs(
        measured: &Measurements,
        computed: &[[f64; OUTPUTS]],
    ) -> [OutputAgreement; OUTPUTS] {
        let samples = measured.values.iter().zip(&measured.used).zip(computed);
        std::array::from_fn(|o| {
            let counted = samples.clone().filter(|((_, used), _)| used[o]);
            let pairs: Vec<(f64, f64)> = counted.map(|((z, _), y)| (z[o], y[o])).collect();
            OutputAgreement::of_pairs(&pairs)
        })
    }

    /// Standard deviation of the measured values.
    #[must_use]
    pub fn measured_deviation(&self) -> f64 {
        self.square_measured.sqrt()
    }

    /// Mean squares of the difference's three parts: bias, variance, covariance.
    fn parts(&self) -> [f64; 3] {
        let (z, y) = (self.square_measured.sqrt(), self.square_computed.sqrt());
        [
            (self.mean_computed - self.mean_measured).powi(2),
            (y - z).powi(2),
            // Below zero by rounding only.
            (2.0 * (y * z - self.product)).max(0.0),
        ]
    }

    /// Root mean square of measured minus computed.
    #[must_use]
    pub fn root_mean_square(&self) -> f64 {
        self.parts().iter().sum::<f64>().sqrt()
    }

    /// Share of the measured variance that the computed response explains; `None` without variance.
    #[must_use]
    pub fn r_squared(&self) -> Option<f64> {
        let left: f64 = self.parts().iter().sum();
        (self.square_measured > 0.0).then(|| 1.0 - left / self.square_measured)
    }

    /// Theil's coefficient of this output; `None` if both series are zero throughout.
    #[must_use]
    pub fn theil(&self) -> Option<Theil> {
        theil(&[(*self, 1.0)])
    }
}

/// Mean of a function of the pairs.
fn mean_of(pairs: &[(f64, f64)], value: impl Fn(f64, f64) -> f64) -> f64 {
    mean(pairs.iter().map(|&(z, y)| value(z, y)))
}

/// Theil's coefficient of several outputs together, weighted as in the cost; `None` if all are
/// zero. For an exact prediction the parts are zero, since there is no difference to divide.
#[must_use]
pub fn theil(outputs: &[(OutputAgreement, f64)]) -> Option<Theil> {
    let (mut parts, mut measured, mut computed) = ([0.0; 3], 0.0, 0.0);
    for (output, weight) in outputs {
        let weight = weight * output.samples as f64;
        for (sum, part) in parts.iter_mut().zip(output.parts()) {
            *sum += weight * part;
        }
        measured += weight * (output.square_measured + output.mean_measured.powi(2));
        computed += weight * (output.square_computed + output.mean_computed.powi(2));
    }
    let (difference, size) = (parts.iter().sum::<f64>(), measured.sqrt() + computed.sqrt());
    let [bias, variance, covariance] = if difference > 0.0 {
        parts.map(|part| part / difference)
    } else {
        [0.0; 3]
    };
    (size > 0.0).then(|| Theil {
        coefficient: difference.sqrt() / size,
        bias,
        variance,
        covariance,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    /// A sine over whole periods: mean 0, mean square 1/2.
    fn sine(k: usize) -> f64 {
        (std::f64::consts::TAU * k as f64 / 100.0).sin()
    }

    fn cosine(k: usize) -> f64 {
        (std::f64::consts::TAU * k as f64 / 100.0).cos()
    }

    fn agreement(z: impl Fn(usize) -> f64, y: impl Fn(usize) -> f64) -> OutputAgreement {
        OutputAgreement::of_pairs(&(0..400).map(|k| (z(k), y(k))).collect::<Vec<_>>())
    }

    #[test]
    fn a_pure_offset_is_all_bias() {
        let a = agreement(sine, |k| sine(k) + 0.5);
        let u = a.theil().unwrap();
        assert_abs_diff_eq!(
            [u.bias, u.variance, u.covariance][..],
            [1.0, 0.0, 0.0][..],
            epsilon = 1e-9
        );
        assert_relative_eq!(
            u.coefficient,
            0.5 / (0.5f64.sqrt() + 0.75f64.sqrt()),
            max_relative = 1e-12
        );
        assert_relative_eq!(a.r_squared().unwrap(), 0.5, max_relative = 1e-12);
        assert_relative_eq!(a.root_mean_square(), 0.5, max_relative = 1e-12);
    }

    #[test]
    fn a_pure_scale_is_all_variance() {
        let a = agreement(sine, |k| 1.5 * sine(k));
        let u = a.theil().unwrap();
        assert_abs_diff_eq!(
            [u.bias, u.variance, u.covariance][..],
            [0.0, 1.0, 0.0][..],
            epsilon = 1e-9
        );
        assert_relative_eq!(u.coefficient, 0.2, max_relative = 1e-12);
        assert_relative_eq!(a.r_squared().unwrap(), 0.75, max_relative = 1e-12);
    }

    #[test]
    fn another_shape_of_the_same_size_is_all_covariance() {
        let a = agreement(sine, cosine);
        let u = a.theil().unwrap();
        assert_abs_diff_eq!(
            [u.bias, u.variance, u.covariance][..],
            [0.0, 0.0, 1.0][..],
            epsilon = 1e-9
        );
        assert_relative_eq!(u.coefficient, 0.5f64.sqrt(), max_relative = 1e-12);
        assert_relative_eq!(a.r_squared().unwrap(), -1.0, max_relative = 1e-12);
    }

    #[test]
    fn the_shares_add_up_to_one_and_the_parts_to_the_mean_square() {
        let pairs: Vec<(f64, f64)> = (0..57)
            .map(|k| (sine(k) + 0.3, 0.7 * cosine(3 * k) - 0.1 * sine(k)))
            .collect();
        let a = OutputAgreement::of_pairs(&pairs);
        let u = a.theil().unwrap();
        assert_relative_eq!(
            u.bias + u.variance + u.covariance,
            1.0,
            max_relative = 1e-12
        );
        let square = pairs.iter().map(|(z, y)| (z - y).powi(2)).sum::<f64>() / 57.0;
        assert_relative_eq!(a.root_mean_square().powi(2), square, max_relative = 1e-12);
    }

    #[test]
    fn outputs_together_count_by_weight_and_nothing_is_no_number() {
        let (good, bad) = (agreement(sine, sine), agreement(sine, |k| sine(k) + 1.0));
        assert_abs_diff_eq!(
            theil(&[(good, 1.0), (bad, 0.0)]).unwrap().coefficient,
            0.0,
            epsilon = 1e-9
        );
        let both = theil(&[(good, 1.0), (bad, 1.0)]).unwrap();
        assert!(both.coefficient < bad.theil().unwrap().coefficient && both.bias > 0.999);
        assert_eq!(OutputAgreement::of_pairs(&[]).theil(), None);
        assert_eq!(agreement(|_| 2.0, sine).r_squared(), None);
    }
}
