//! Mean of several estimates θ of the same parameters, weighted by their whole covariances C: (Σ
//! C⁻¹)⁻¹ Σ C⁻¹ θ.
//!
//! To first order the mean equals the joint estimate from the same data. Weights by each
//! parameter's own bound would fail: constant and slope of one maneuver are strongly correlated,
//! and only their sum is well determined.

use nalgebra::{DMatrix, DVector};

use crate::numerics::linear_algebra::symmetric::{inverse, solve_damped};

/// Estimates of some of the wanted parameters, with their covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Places among the wanted parameters, one for each value.
    pub places: Vec<usize>,
    pub values: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

/// Weighted mean of `n` parameters; `None` if a parameter is in no estimate or a covariance has no
/// inverse.
#[must_use]
pub fn weighted(estimates: &[Estimate], n: usize) -> Option<DVector<f64>> {
    let (mut information, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
    for estimate in estimates {
        let precision = inverse(&estimate.covariance)?;
        let pull = &precision * &estimate.values;
        for (i, &row) in estimate.places.iter().enumerate() {
            right[row] += pull[i];
            for (j, &column) in estimate.places.iter().enumerate() {
                information[(row, column)] += precision[(i, j)];
            }
        }
    }
    let mean = solve_damped(&information, &right, 0.0)?;
    mean.iter().all(|v| v.is_finite()).then_some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn estimate(values: [f64; 2], covariance: [f64; 4]) -> Estimate {
        let (values, covariance) = (
            DVector::from(values.to_vec()),
            DMatrix::from_row_slice(2, 2, &covariance),
        );
        Estimate {
            places: vec![0, 1],
            values,
            covariance,
        }
    }

    #[test]
    fn the_mean_of_one_is_itself_and_of_two_alike_their_middle() {
        let a = estimate([1.0, -2.0], [4.0, -1.9, -1.9, 1.0]);
        let b = estimate([3.0, -4.0], [4.0, -1.9, -1.9, 1.0]);
        let one = weighted(std::slice::from_ref(&a), 2).unwrap();
        let two = weighted(&[a, b], 2).unwrap();
        assert_relative_eq!(one, DVector::from(vec![1.0, -2.0]), max_relative = 1e-9);
        assert_relative_eq!(two, DVector::from(vec![2.0, -3.0]), max_relative = 1e-9);
    }

    #[test]
    fn what_is_well_determined_of_correlated_parameters_is_kept() {
        // θ₀ + 20 θ₁ is 3 in both and known to a thousandth; θ₁ alone is known to a tenth in one,
        // to ten in the other.
        let of = |slope: f64, variance: f64| {
            let c = [
                400.0 * variance + 1e-6,
                -20.0 * variance,
                -20.0 * variance,
                variance,
            ];
            estimate([3.0 - 20.0 * slope, slope], c)
        };
        let mean = weighted(&[of(0.05, 0.01), of(4.0, 100.0)], 2).unwrap();
        assert_relative_eq!(mean[0] + 20.0 * mean[1], 3.0, max_relative = 1e-6);
        assert_relative_eq!(mean[1], 0.05, max_relative = 0.02);
    }

    #[test]
    fn a_parameter_that_no_estimate_has_leaves_no_mean() {
        let one = Estimate {
            places: vec![1],
            values: DVector::from(vec![1.0]),
            covariance: DMatrix::identity(1, 1),
        };
        assert!(weighted(&[one], 2).is_none());
    }
}
