//! Equation error: derivatives by linear least squares on the coefficients that the measured
//! accelerations imply.
//!
//! It needs no integration and so cannot diverge, whatever the airframe's stability. Noise in the
//! regressors biases it. So it serves as a start for output error and as a check of it
//! ([`regression`]), not as a result.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::cost::add_square;
use super::information::Identification;
use crate::dynamics::motion::SLOPE_REACH;
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};
use crate::numerics::symmetric::{scale, scaled};
use crate::output_error::case::Case;

/// Weight of the prior values against the data, at unit diagonal: small, but enough to hold what
/// the data do not determine.
const PRIOR_WEIGHT: f64 = 1e-4;

/// Starting values with the derivatives from equation error. Derivatives that the data do not
/// determine stay near `prior`, as do biases and initial states.
#[must_use]
pub fn start<const NX: usize, E: Equations<NX>>(case: &Case<NX, E>, prior: &[f64]) -> Vec<f64> {
    let mut values = prior.to_vec();
    for k in 0..COEFFICIENTS {
        let range = case.ranges[k].clone();
        if let Some(change) = regress_coefficient(case, k, prior) {
            for (v, d) in values[range].iter_mut().zip(change.iter()) {
                *v += d;
            }
        }
    }
    values
}

/// Least-squares change of the derivatives of one coefficient against the prior values.
fn regress_coefficient<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    coefficient: usize,
    prior: &[f64],
) -> Option<DVector<f64>> {
    let range = case.ranges[coefficient].clone();
    let mut regressors = vec![0.0; case.derivatives()];
    let build_up = case.build_up(prior);
    let (mut normal, mut right) = (
        DMatrix::zeros(range.len(), range.len()),
        DVector::zeros(range.len()),
    );
    for (sample, (state, implied)) in case.states.iter().zip(&case.implied).enumerate() {
        let computed = build_up.at(2 * sample).coefficients(state);
        case.regressors_at(2 * sample, state, &mut regressors);
        let error = implied[coefficient] - computed[coefficient];
        let row = &regressors[range.clone()];
        add_square(&mut normal, 1.0, row);
        for (b, r) in right.iter_mut().zip(row) {
            *b += error * r;
        }
    }
    normal.fill_upper_triangle_with_lower_triangle();
    let unit = scale(&normal);
    let mut scaled = scaled(&normal, &unit);
    for i in 0..range.len() {
        scaled[(i, i)] += PRIOR_WEIGHT;
    }
    let solution = Cholesky::new(scaled)?.solve(&right.component_mul(&unit));
    let change = solution.component_mul(&unit);
    change.iter().all(|d| d.is_finite()).then_some(change)
}

/// Condition number of the scaled normal matrix beyond which a regression has no result.
const MAX_CONDITION_NUMBER: f64 = 1e10;

/// Derivatives by least squares on the measured accelerations alone, as a check of output error.
/// Parameters are in the order of the case; `None` for biases, initial states, and a coefficient
/// with proportional regressors.
///
/// The measured angular accelerations are slopes of local straight lines through the rates:
/// accelerations averaged by a short window. Forces and regressors are averaged by the same window,
/// so that a fast change (the edge of a step) is not rounded on one side of the equation only. A
/// linear filter on both sides leaves the derivatives unchanged. Samples whose window contains an
/// excluded sample do not count. Noise in the regressors remains: it attenuates derivatives by its
/// share of the regressor's variance.
#[must_use]
pub fn regression<const NX: usize, E: Equations<NX>>(case: &Case<NX, E>) -> Vec<Option<f64>> {
    let none = vec![0.0; case.parameters()];
    let window = slope_window();
    let mut values = vec![None; case.parameters()];
    for k in 0..COEFFICIENTS {
        let range = case.ranges[k].clone();
        if range.is_empty() {
            continue;
        }
        let rows = regression_rows(case, k, &none);
        let (mut normal, mut right) = (
            DMatrix::zeros(range.len(), range.len()),
            DVector::zeros(range.len()),
        );
        let moment = E::AXIS.coefficients()[k].is_moment();
        for (rows, used) in rows
            .windows(window.len())
            .zip(case.measurements.used.windows(window.len()))
        {
            if used.iter().any(|used| *used != [true; OUTPUTS]) {
                continue;
            }
            let row = windowed_mean(&window, rows);
            let [regressors @ .., held, force] = row.as_slice() else {
                continue;
            };
            // A moment's acceleration is a slope, which is averaged by the window already.
            let implied = if moment {
                rows[SLOPE_REACH].last().unwrap_or(force)
            } else {
                force
            };
            add_square(&mut normal, 1.0, regressors);
            for (b, r) in right.iter_mut().zip(regressors) {
                *b += (implied - held) * r;
            }
        }
        normal.fill_upper_triangle_with_lower_triangle();
        if let Identification::Determined { inverse, .. } =
            Identification::of(&normal, MAX_CONDITION_NUMBER)
        {
            for (v, d) in values[range].iter_mut().zip((inverse * right).iter()) {
                *v = Some(*d);
            }
        }
    }
    values
}

/// Rows of all samples: regressors of a coefficient, its held part, and the value that the measured
/// motion implies.
fn regression_rows<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    coefficient: usize,
    none: &[f64],
) -> Vec<Vec<f64>> {
    let mut regressors = vec![0.0; case.derivatives()];
    let build_up = case.build_up(none);
    let samples = case.states.iter().zip(&case.implied).enumerate();
    let row = samples.map(|(sample, (state, implied))| {
        let held = build_up.at(2 * sample).coefficients(state);
        case.regressors_at(2 * sample, state, &mut regressors);
        let mut row = regressors[case.ranges[coefficient].clone()].to_vec();
        row.extend([held[coefficient], implied[coefficient]]);
        row
    });
    row.collect()
}

/// Weighted mean of the rows under the window.
fn windowed_mean(window: &[f64], rows: &[Vec<f64>]) -> Vec<f64> {
    let mut mean = vec![0.0; rows.first().map_or(0, Vec::len)];
    for (weight, row) in window.iter().zip(rows) {
        for (s, r) in mean.iter_mut().zip(row) {
            *s += weight * r;
        }
    }
    mean
}

/// Window of the slope of a local straight line. The slope Σ d (x(k+d) − x(k−d)) / Σ 2 d² is a
/// weighted mean of the increments, and an increment is the mean of the derivative at its ends.
fn slope_window() -> Vec<f64> {
    let reach = SLOPE_REACH;
    // Increment i lies between samples i and i+1 of the window. Slopes over a distance d of at
    // least `nearest` contain it.
    let across = |i: usize| -> f64 {
        let nearest = if i < reach { reach - i } else { i + 1 - reach };
        (nearest..=reach).map(|d| d as f64).sum()
    };
    let total: f64 = (0..2 * reach).map(across).sum();
    (0..=2 * reach)
        .map(|j| {
            let before = if j > 0 { across(j - 1) } else { 0.0 };
            let after = if j < 2 * reach { across(j) } else { 0.0 };
            0.5 * (before + after) / total
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_windowed_mean_of_a_derivative_is_the_slope_of_the_straight_line() {
        // The mean of an increment's ends is exact for a derivative that is linear over it: x = t².
        let x = |t: f64| t.powi(2);
        let derivative = |t: f64| 2.0 * t;
        let reach = i32::try_from(SLOPE_REACH).unwrap();
        let slope: f64 = (1..=reach)
            .map(|d| f64::from(d) * (x(10.0 + f64::from(d)) - x(10.0 - f64::from(d))))
            .sum::<f64>()
            / (1..=reach).map(|d| 2.0 * f64::from(d * d)).sum::<f64>();
        let seen: f64 = (-reach..=reach)
            .zip(slope_window())
            .map(|(d, w)| w * derivative(10.0 + f64::from(d)))
            .sum();
        assert_relative_eq!(seen, slope, max_relative = 1e-12);
    }

    #[test]
    fn the_window_rounds_an_edge_as_the_straight_line_does() {
        // A derivative that grows by one per sample from sample 0 on, and its integral.
        let rate = |k: i32| 0.5 * f64::from(k.max(0)).powi(2);
        let derivative = |k: i32| f64::from(k.max(0));
        let reach = i32::try_from(SLOPE_REACH).unwrap();
        let window = slope_window();
        assert_relative_eq!(window.iter().sum::<f64>(), 1.0, max_relative = 1e-12);
        for k in -6..=6 {
            let slope: f64 = (1..=reach)
                .map(|d| f64::from(d) * (rate(k + d) - rate(k - d)))
                .sum::<f64>()
                / (1..=reach).map(|d| 2.0 * f64::from(d * d)).sum::<f64>();
            let seen: f64 = (-reach..=reach)
                .zip(&window)
                .map(|(d, w)| w * derivative(k + d))
                .sum();
            assert_relative_eq!(seen, slope, epsilon = 1e-12);
        }
    }
}
