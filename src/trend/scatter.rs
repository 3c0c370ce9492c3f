//! Scatter between maneuvers beyond their bounds, by Paule and Mandel's equation with Huber's cut.
//! [`crate::numerics::statistics::random_effects`] solves the equation without the cut, and with the fit in it.

use nalgebra::DVector;

use super::point::TrendPoint;
use crate::numerics::bisection::last_above;
use crate::numerics::statistics::order_statistics::upper_median;

/// Standard deviations beyond which the influence of a residual stays constant: Huber's weights. The
/// fit then tolerates a quarter of outliers, and loses 4% of efficiency where there are none.
pub(super) const HUBER: f64 = 1.5;
/// The mean of min(u², `HUBER`²) for standard normal u, which replaces one in the equation for τ².
pub(super) const HUBER_VARIANCE: f64 = 0.778_465;
/// Least bound, as a share of the median bound: bounds are uncertain by a factor of a few.
const BOUND_FLOOR: f64 = 0.25;
/// Most halvings of the interval of τ². The interval begins at zero. If τ² is 2⁻ⁿ of the upper end,
/// it takes n halvings to reach it and 53 for its digits. 200 halvings allow n = 147. The search
/// ends earlier at neighbours.
const HALVINGS: usize = 200;
/// Least number of maneuvers of a class with a scatter of its own; classes with fewer maneuvers
/// share the scatter of all.
const OWN_SCATTER: usize = 8;

/// Bounds squared, none smaller than the floor.
pub(super) fn floored_variances(points: &[TrendPoint]) -> Vec<f64> {
    let floor = BOUND_FLOOR * upper_median(points.iter().map(|p| p.bound)).unwrap_or(0.0);
    points.iter().map(|p| p.bound.max(floor).powi(2)).collect()
}

/// The points of each stratum, a set with one τ: every class with a scatter of its own, then all
/// points, if any remain.
pub(super) fn strata(points: &[TrendPoint]) -> Vec<Vec<usize>> {
    let classes = points
        .iter()
        .map(|p| p.class)
        .max()
        .map_or(0, |most| most + 1);
    let of = |class: usize| {
        (0..points.len())
            .filter(|i| points[*i].class == class)
            .collect::<Vec<usize>>()
    };
    let mut strata: Vec<Vec<usize>> = (0..classes)
        .map(of)
        .filter(|own| own.len() >= OWN_SCATTER)
        .collect();
    if strata.iter().map(Vec::len).sum::<usize>() < points.len() {
        strata.push((0..points.len()).collect());
    }
    strata
}

/// Variance b² + τ² of each point. τ is that of its class if the class is a stratum, otherwise that
/// of all points.
pub(super) fn total_variances(
    residuals: &DVector<f64>,
    variances: &[f64],
    freedom: &[f64],
    strata: &[Vec<usize>],
) -> Vec<f64> {
    let mut total = variances.to_vec();
    for stratum in strata.iter().rev() {
        let scatter2 = scatter_squared(residuals, variances, freedom, stratum);
        for i in stratum {
            total[*i] = variances[*i] + scatter2;
        }
    }
    total
}

/// Solves for τ² of some of the points. The sum of their squared residuals over their variances,
/// with outliers cut, must equal its expectation. The sum falls as τ² grows, so bisection finds τ².
pub(super) fn scatter_squared(
    residuals: &DVector<f64>,
    variances: &[f64],
    freedom: &[f64],
    stratum: &[usize],
) -> f64 {
    let expected = HUBER_VARIANCE * stratum.iter().map(|i| freedom[*i]).sum::<f64>();
    let cut = |i: &usize, scatter2: f64| {
        (residuals[*i].powi(2) / (variances[*i] + scatter2)).min(HUBER * HUBER)
    };
    let sum = |scatter2: f64| stratum.iter().map(|i| cut(i, scatter2)).sum::<f64>();
    if sum(0.0) <= expected || expected <= 0.0 {
        return 0.0;
    }
    let square: f64 = stratum.iter().map(|i| residuals[*i].powi(2)).sum();
    last_above((0.0, square / expected), HALVINGS, expected, sum).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_variance_of_cut_normal_residuals_is_that_of_its_integral() {
        let density = |u: f64| (-0.5 * u * u).exp() / std::f64::consts::TAU.sqrt();
        let h = 1e-3;
        let integral: f64 = (-8000..8000)
            .map(|i| (f64::from(i) + 0.5) * h)
            .map(|u| (u * u).min(HUBER * HUBER) * density(u) * h)
            .sum();
        assert_relative_eq!(integral, HUBER_VARIANCE, max_relative = 1e-5);
    }
}
