//! Equation error: derivatives by linear least squares on the coefficients that the measured
//! accelerations imply.
//!
//! It needs no integration, so it cannot diverge even if the airframe is unstable. A gust that the
//! vane measures is not an error of the equation. It therefore serves as a start for output error
//! and, with bounds, as a second opinion ([`regression`]).
//!
//! The regression is in the frequency domain (Morelli; Klein and Morelli 2006, chapter 7). Fourier
//! sums over the maneuver are linear: the equation between a coefficient and its regressors holds
//! for their sums as it holds for their samples. Harmonics from 0.1 to 2.5 Hz contain the
//! airframe's motion; drift below and noise above are left out. The measured angular accelerations
//! are slopes of local straight lines through the rates: accelerations averaged by a short window.
//! All other terms are averaged by the same window, so that the equation still holds.
//!
//! Least squares in time ([`regress_coefficient`]) gives the starting values where the regression
//! has no result.
//!
//! Noise of the regressors remains: it attenuates derivatives by its share of the regressor's
//! variance inside the band.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::cost::add_square;
use super::whittle;
use crate::dynamics::motion::slope_reach;
use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};
use crate::numerics::linear_algebra::symmetric::solve_damped;
use crate::numerics::series::harmonics::Harmonics;
use crate::output_error::case::build_up::BuildUpTerm;
use crate::output_error::case::{Case, Measurements};

/// Weight of the prior values relative to the data, at unit diagonal: small, but enough to fix
/// directions that the data do not determine.
const PRIOR_WEIGHT: f64 = 1e-4;
/// Band of the harmonics, Hz: the rigid airframe's modes (Klein and Morelli 2006, section 7.3).
const BAND_HZ: [f64; 2] = [0.1, 2.5];
/// Half width of the triangle that smooths the residuals' spectrum. Simulated 95 % intervals cover 2
/// to 3 points less with 0.2 Hz, and within a point the same from 0.6 to 1 Hz.
const SMOOTHING_HZ: f64 = 0.6;
/// Longest gap that counts as bridged, s: a quarter of the band's shortest period.
const LONGEST_BRIDGE_S: f64 = 0.1;
/// Ratio of a regressor's range to its size below which it counts as constant.
const STILL: f64 = 1e-9;

/// Starting values with the derivatives from equation error: by [`regression`], with the constant
/// from the mean. Without a result of the regression, by least squares in time. Derivatives that
/// the data do not determine stay near `prior`, as do biases and initial states.
#[must_use]
pub fn start<const NX: usize, E: Equations<NX>>(case: &Case<NX, E>, prior: &[f64]) -> Vec<f64> {
    start_from(case, prior, &regression(case, case, &BTreeMap::new()))
}

/// Starting values as [`start`] returns them, from a [`regression`] of the case that exists already.
#[must_use]
pub fn start_from<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    prior: &[f64],
    regression: &Regression,
) -> Vec<f64> {
    let mut values = prior.to_vec();
    for k in 0..COEFFICIENTS {
        let range = case.ranges[k].clone();
        if !is_measured(case, k) {
            // The stand-in of its accelerometer has the mean of trimmed flight, and no motion.
            shift_constant(case, k, &mut values);
        } else if regression.values[range.clone()].iter().any(Option::is_some) {
            for j in range {
                values[j] = regression.values[j].unwrap_or(values[j]);
            }
            shift_constant(case, k, &mut values);
        } else if let Some(change) = regress_coefficient(case, k, prior) {
            for (v, d) in values[range].iter_mut().zip(change.iter()) {
                *v += d;
            }
        }
    }
    values
}

/// `true` if the measured motion implies a coefficient: a moment, or a force whose accelerometer is
/// recorded.
fn is_measured<const NX: usize, E: Equations<NX>>(case: &Case<NX, E>, coefficient: usize) -> bool {
    let Some(accelerometer) = E::AXIS.coefficients()[coefficient].accelerometer() else {
        return true;
    };
    let output = E::AXIS.outputs().iter().position(|o| *o == accelerometer);
    output.is_some_and(|output| case.measurements.have(output))
}

/// Shifts the constant so that the mean of the coefficient's build-up equals the mean implied by
/// the measured accelerations.
fn shift_constant<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    coefficient: usize,
    values: &mut [f64],
) {
    let constant = case.ranges[coefficient]
        .clone()
        .find(|&j| is_constant(case, j));
    let kept = kept_samples(&case.measurements, case.step_s);
    let count = kept.iter().filter(|kept| **kept).count();
    let Some(constant) = constant.filter(|_| count > 0) else {
        return;
    };
    let build_up = case.build_up(values);
    let mut error = 0.0;
    for sample in (0..case.samples()).filter(|&sample| kept[sample]) {
        let computed = build_up
            .at(2 * sample)
            .coefficients(&case.motion.states[sample]);
        error += case.motion.implied[sample][coefficient] - computed[coefficient];
    }
    values[constant] += error / count as f64;
}

/// `true` if a free derivative is the constant of its coefficient: its regressor is one.
fn is_constant<const NX: usize, E: Equations<NX>>(case: &Case<NX, E>, derivative: usize) -> bool {
    let term = case.terms[derivative];
    let column = case.columns[term.column].iter();
    term.state.is_none() && column.take(case.samples()).all(|r| (r - 1.0).abs() < STILL)
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
    for (sample, (state, implied)) in case
        .motion
        .states
        .iter()
        .zip(&case.motion.implied)
        .enumerate()
    {
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
    let change = solve_damped(&normal, &right, PRIOR_WEIGHT)?;
    change.iter().all(|d| d.is_finite()).then_some(change)
}

/// Derivatives by equation error, with the covariance of their errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Regression {
    /// Values in the order of the case's parameters; `None` for
    ///
    /// - biases, initial states and constants, which appear in no harmonic;
    /// - regressors that do not move;
    /// - coefficients with proportional regressors or too few harmonics;
    /// - forces whose accelerometer is not recorded.
    pub values: Vec<Option<f64>>,
    /// Covariance of the errors; zero for parameters without a value. It includes the residuals'
    /// spectrum and the uncertainty of held values, but no errors of calibration.
    pub covariance: DMatrix<f64>,
}

/// Estimates the derivatives from the measured accelerations alone, as a second opinion on output
/// error.
///
/// `wide` is the maneuver with the held derivatives free as well, and `uncertainties` the standard
/// uncertainty of each held value, by name.
#[must_use]
pub fn regression<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    wide: &Case<NX, E>,
    uncertainties: &BTreeMap<&str, f64>,
) -> Regression {
    let parameters = case.parameters();
    let mut found = Regression {
        values: vec![None; parameters],
        covariance: DMatrix::zeros(parameters, parameters),
    };
    let Some(spectra) = Spectra::transform(case, wide) else {
        return found;
    };
    for k in (0..COEFFICIENTS).filter(|&k| is_measured(case, k)) {
        let regressor = |j: usize| spectra.regressor(&case.names[j]);
        let free = case.ranges[k].clone().filter(|&j| regressor(j).is_some());
        let free: Vec<usize> = free.collect();
        let columns: Vec<usize> = free.iter().filter_map(|&j| regressor(j)).collect();
        let Some(regression) = spectra.regress(k, &columns) else {
            continue;
        };
        let mut covariance = regression.covariance.clone();
        for name in wide.names[wide.ranges[k].clone()]
            .iter()
            .map(String::as_str)
        {
            if let (Some(uncertainty), Some(term)) =
                (uncertainties.get(name), spectra.regressor(name))
            {
                let change = regression.change_by(&spectra.sums.column(term).into_owned());
                covariance += &change * change.transpose() * uncertainty.powi(2);
            }
        }
        for (i, &row) in free.iter().enumerate() {
            found.values[row] = Some(regression.values[i]);
            for (j, &column) in free.iter().enumerate() {
                found.covariance[(row, column)] = covariance[(i, j)];
            }
        }
    }
    found
}

/// Fourier sums of all terms of a maneuver's equations.
struct Spectra<'a> {
    /// Fourier sums, one column per series: the implied coefficients less their held parts, then
    /// the distinct regressors.
    sums: DMatrix<f64>,
    /// Column of the regressor of each derivative that acts; `None` if the regressor does not move.
    regressors: BTreeMap<&'a str, Option<usize>>,
    /// Half width of the smoothing triangle, in harmonics.
    smoothing: f64,
    /// Share of the samples that count.
    kept_share: f64,
}

impl<'a> Spectra<'a> {
    /// Fourier sums at the harmonics inside the band; `None` without any.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "small positive numbers"
    )]
    fn transform<const NX: usize, E: Equations<NX>>(
        case: &Case<NX, E>,
        wide: &'a Case<NX, E>,
    ) -> Option<Spectra<'a>> {
        let reach = slope_reach(case.step_s);
        let inner = reach..case.samples().checked_sub(reach)?;
        let samples = inner.len();
        let duration_s = samples as f64 * case.step_s;
        let first = (BAND_HZ[0] * duration_s).ceil().max(1.0) as usize;
        let end = ((BAND_HZ[1] * duration_s) as usize + 1).min(samples / 2);
        let kept = kept_samples(&case.measurements, case.step_s);
        let trend =
            StraightLine::through_samples(kept.get(inner.clone())?).filter(|_| first < end)?;
        let mut series = implied_without_accelerations(case);
        let regressors = add_regressors(wide, &mut series);
        let window = slope_window(reach);
        for series in &mut series {
            *series = windowed_means(&window, series);
        }
        add_accelerations(case, inner, &mut series);
        for series in &mut series {
            trend.remove(series);
        }
        Some(Spectra {
            sums: Harmonics::new(samples, first..end).sums(&series),
            regressors,
            smoothing: SMOOTHING_HZ * duration_s,
            kept_share: trend.samples / samples as f64,
        })
    }

    fn regressor(&self, name: &str) -> Option<usize> {
        *self.regressors.get(name)?
    }

    /// Regression of a coefficient on the regressors of these columns.
    fn regress(&self, coefficient: usize, columns: &[usize]) -> Option<whittle::WhittleRegression> {
        let equations = whittle::SpectralEquations {
            response: &self.sums.column(coefficient).into_owned(),
            regressors: &self.sums.select_columns(columns),
            smoothing: self.smoothing,
            independent: self.kept_share,
        };
        equations.solve()
    }
}

/// Histories of each coefficient that the measured motion implies, less its held part and the part
/// that depends on the angular accelerations.
fn implied_without_accelerations<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
) -> Vec<Vec<f64>> {
    let mut series = vec![vec![]; COEFFICIENTS];
    for (sample, state) in case.motion.states.iter().enumerate() {
        let held = case.held.at(2 * sample).coefficients(state);
        let rest = case.motion.implied_without_accelerations[sample];
        for (k, series) in series.iter_mut().enumerate() {
            series.push(rest[k] - held[k]);
        }
    }
    series
}

/// Adds the part of the implied coefficients that depends on the angular accelerations. These are
/// averaged by the window already.
fn add_accelerations<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    samples: Range<usize>,
    series: &mut [Vec<f64>],
) {
    for (k, series) in series.iter_mut().take(COEFFICIENTS).enumerate() {
        for (value, sample) in series.iter_mut().zip(samples.clone()) {
            let rest = case.motion.implied_without_accelerations[sample][k];
            *value += case.motion.implied[sample][k] - rest;
        }
    }
}

/// Adds the distinct regressors that move. Returns the column of each derivative's regressor.
fn add_regressors<'a, const NX: usize, E: Equations<NX>>(
    wide: &'a Case<NX, E>,
    series: &mut Vec<Vec<f64>>,
) -> BTreeMap<&'a str, Option<usize>> {
    let mut places: BTreeMap<&str, Option<usize>> = BTreeMap::new();
    for (j, (name, term)) in wide.names.iter().zip(&wide.terms).enumerate() {
        let is_same =
            |other: &BuildUpTerm| (other.column, other.state) == (term.column, term.state);
        let place = if let Some(other) = wide.terms[..j].iter().position(is_same) {
            places[wide.names[other].as_str()]
        } else {
            let regressor = wide.measured_regressor(j);
            let place = does_move(&regressor).then_some(series.len());
            if place.is_some() {
                series.push(regressor);
            }
            place
        };
        places.insert(name, place);
    }
    places
}

fn does_move(regressor: &[f64]) -> bool {
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for r in regressor {
        (least, most) = (least.min(*r), most.max(*r));
    }
    most - least > STILL * least.abs().max(most.abs())
}

/// Means of a series under the window at each of its samples but the outermost.
fn windowed_means(window: &[f64], series: &[f64]) -> Vec<f64> {
    let mean = |values: &[f64]| window.iter().zip(values).map(|(w, x)| w * x).sum();
    series.windows(window.len()).map(mean).collect()
}

/// Window of the slope of a local straight line. The slope at sample k of a series x is Σ d (x(k+d)
/// − x(k−d)) / Σ 2 d² over the distances d within reach. It is a weighted mean of the increments,
/// and an increment is the mean of the derivative at its ends.
fn slope_window(reach: usize) -> Vec<f64> {
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

/// Samples outside gaps that are too long to bridge, and further from them than a slope reaches. Outputs
/// that are not recorded have no gaps.
fn kept_samples(measurements: &Measurements, step_s: f64) -> Vec<bool> {
    let samples = measurements.used.len();
    let reach = slope_reach(step_s);
    let mut kept = vec![true; samples];
    for o in (0..OUTPUTS).filter(|&o| measurements.have(o)) {
        let mut start = 0;
        for end in 0..=samples {
            if measurements.used.get(end).is_none_or(|used| used[o]) {
                if (end - start) as f64 * step_s > LONGEST_BRIDGE_S {
                    kept[start.saturating_sub(reach)..(end + reach).min(samples)].fill(false);
                }
                start = end + 1;
            }
        }
    }
    kept
}

/// Straight line over the samples that count. The line is removed from every series, so that the
/// equations still hold. A drift would otherwise leak into all harmonics.
struct StraightLine<'a> {
    kept: &'a [bool],
    samples: f64,
    /// Mean place of the samples, and the sum of squares about it.
    middle: f64,
    spread: f64,
}

impl StraightLine<'_> {
    /// `None` for fewer samples than a straight line needs.
    fn through_samples(kept: &[bool]) -> Option<StraightLine<'_>> {
        let mut trend = StraightLine {
            kept,
            samples: 0.0,
            middle: 0.0,
            spread: 0.0,
        };
        trend.samples = trend.sum(|_| 1.0);
        trend.middle = trend.sum(|n| n as f64) / trend.samples.max(1.0);
        trend.spread = trend.sum(|n| trend.offset(n).powi(2));
        (trend.spread > 0.0).then_some(trend)
    }

    fn offset(&self, n: usize) -> f64 {
        n as f64 - self.middle
    }

    fn sum(&self, term: impl Fn(usize) -> f64) -> f64 {
        let places = self.kept.iter().enumerate();
        places
            .filter(|(_, kept)| **kept)
            .map(|(n, _)| term(n))
            .sum()
    }

    /// Removes the straight line from a series; samples that do not count become zero.
    fn remove(&self, series: &mut [f64]) {
        let mean = self.sum(|n| series[n]) / self.samples;
        let slope = self.sum(|n| self.offset(n) * series[n]) / self.spread;
        for (n, x) in series.iter_mut().enumerate() {
            *x = if self.kept[n] {
                *x - mean - slope * self.offset(n)
            } else {
                0.0
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_windowed_mean_of_a_derivative_is_the_slope_of_the_straight_line() {
        // A derivative that grows by one per sample from sample 0 on, and its integral: the window
        // rounds an edge as the straight line does.
        let rate = |k: i32| 0.5 * f64::from(k.max(0)).powi(2);
        let derivative = |k: i32| f64::from(k.max(0));
        let reach = 4;
        let window = slope_window(4);
        assert_relative_eq!(window.iter().sum::<f64>(), 1.0, max_relative = 1e-12);
        let series: Vec<f64> = (-10..=10).map(derivative).collect();
        let means = windowed_means(&window, &series);
        for (k, mean) in (-10 + reach..=10 - reach).zip(means) {
            let slope: f64 = (1..=reach)
                .map(|d| f64::from(d) * (rate(k + d) - rate(k - d)))
                .sum::<f64>()
                / (1..=reach).map(|d| 2.0 * f64::from(d * d)).sum::<f64>();
            assert_relative_eq!(mean, slope, epsilon = 1e-12);
        }
    }

    #[test]
    fn gaps_that_are_bridged_count_and_long_ones_do_not() {
        let mut measurements = Measurements {
            values: vec![],
            used: vec![[true; OUTPUTS]; 60],
        };
        for sample in [10, 11, 12, 13, 30, 31, 32, 33, 34] {
            measurements.used[sample][2] = false;
        }
        let left_out: Vec<usize> = kept_samples(&measurements, 0.025)
            .iter()
            .enumerate()
            .filter(|(_, kept)| !**kept)
            .map(|(n, _)| n)
            .collect();
        assert_eq!(left_out, (26..39).collect::<Vec<_>>());
    }

    #[test]
    fn a_straight_line_is_taken_off_the_samples_that_count() {
        let kept: Vec<bool> = (0..50).map(|n| !(20..25).contains(&n)).collect();
        let mut series: Vec<f64> = (0..50).map(|n| 3.0 - 0.2 * f64::from(n)).collect();
        series[22] = 1e6;
        StraightLine::through_samples(&kept)
            .unwrap()
            .remove(&mut series);
        assert!(series.iter().all(|x| x.abs() < 1e-12), "{series:?}");
        assert!(StraightLine::through_samples(&[true, false]).is_none());
    }
}
