//! Independent deviations with a covariance, and draws of them.

use nalgebra::{DMatrix, DVector};

use crate::numerics::random::RandomStream;
use crate::numerics::root::{root_with_pivots, symmetric_root};
use crate::numerics::symmetric::{scale, scaled};

/// Share of the largest variance, in units of the parameters' own, below which a direction is left out:
/// it adds 3 % of a standard deviation.
const LEAST_VARIANCE: f64 = 1e-3;

/// Independent deviations of parameters.
///
/// A draw starts from a deviate for each parameter and the symmetric root, which is continuous. The directions serve as
/// coordinates alone: which there are, and in which order, is decided by small differences of
/// variances and must not decide a draw.
#[derive(Clone, Debug)]
pub struct Deviations {
    /// Deviations whose sum, each times an independent standard normal deviate, has the covariance.
    /// They are ranked in units of the standard deviations.
    pub directions: Vec<DVector<f64>>,
    /// Deviates of the directions, from those of the parameters.
    by_parameter: DMatrix<f64>,
}

impl Deviations {
    /// Deviations with a covariance.
    #[must_use]
    pub fn of(covariance: &DMatrix<f64>) -> Deviations {
        let deviations = covariance.diagonal().map(|v| v.max(0.0).sqrt());
        let correlations = scaled(covariance, &scale(covariance));
        let (root, pivots) = root_with_pivots(&correlations, LEAST_VARIANCE);
        let columns = root.column_iter();
        let mut by_parameter = symmetric_root(correlations).select_rows(&pivots);
        // Pivots have positive variances, so the triangle has a solution.
        root.select_rows(&pivots)
            .solve_lower_triangular_mut(&mut by_parameter);
        Deviations {
            directions: columns
                .map(|column| column.component_mul(&deviations))
                .collect(),
            by_parameter,
        }
    }

    /// Standard normal deviates of the directions, drawn.
    pub fn drawn(&self, stream: &mut RandomStream) -> Vec<f64> {
        let of_parameters = DVector::from_fn(self.by_parameter.ncols(), |_, _| stream.normal());
        (&self.by_parameter * of_parameters).as_slice().to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn sum(deviations: &Deviations, deviates: &[f64]) -> DVector<f64> {
        let both = deviations.directions.iter().zip(deviates);
        let own = both.map(|(direction, deviate)| direction * *deviate);
        own.reduce(|a, b| a + b).unwrap()
    }

    #[test]
    fn independent_deviations_have_the_covariance() {
        let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 1e-3, 1e-3, 1e-6]);
        let deviations = Deviations::of(&covariance);
        let own = deviations.directions.iter().map(|d| d * d.transpose());
        let own = own.reduce(|a, b| a + b).unwrap();
        assert_relative_eq!(own, covariance, epsilon = 1e-12);
        for size in [0, 2] {
            let none = Deviations::of(&DMatrix::zeros(size, size));
            assert!(none.directions.is_empty());
            assert!(none.drawn(&mut RandomStream::new(1, "none")).is_empty());
        }
    }

    #[test]
    fn drawn_deviates_are_independent_and_standard_normal() {
        let covariance =
            DMatrix::from_row_slice(3, 3, &[4.0, 1.9, 0.1, 1.9, 1.0, 0.0, 0.1, 0.0, 9.0]);
        let deviations = Deviations::of(&covariance);
        let own = &deviations.by_parameter * deviations.by_parameter.transpose();
        assert_relative_eq!(own, DMatrix::identity(3, 3), epsilon = 1e-12);
    }

    #[test]
    fn a_draw_moves_as_little_as_the_covariance_whatever_the_order_of_the_directions() {
        // After the first parameter both others have the same variance left, and 1e-9 decides the order.
        let covariance = |by: f64| {
            let last = 0.4 + by;
            DMatrix::from_row_slice(3, 3, &[1.0, 0.4, last, 0.4, 1.0, 0.2, last, 0.2, 1.0])
        };
        let draw = |by: f64| {
            let deviations = Deviations::of(&covariance(by));
            let deviates = deviations.drawn(&mut RandomStream::new(5, "a repeat flight"));
            (
                deviations.directions[1].clone(),
                sum(&deviations, &deviates),
            )
        };
        let (before, now) = (draw(-1e-9), draw(1e-9));
        assert!((before.0 - now.0).amax() > 0.1, "another second direction");
        assert_relative_eq!(before.1, now.1, epsilon = 1e-8);
    }
}
