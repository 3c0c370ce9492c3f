//! Trend fits the estimates of each derivative across α by least squares, for the derivative's
//! group of classes and for each class alone.
//!
//! The fit is in [`fit`]: a polynomial or spline in α, whose order a criterion chooses. The weights
//! are 1/(bound² + τ²), with τ the scatter between maneuvers of a class beyond their bounds. Where
//! the maneuvers are too few for a trend, [`means`] gives a mean at each flown α.

mod basis;
#[cfg(test)]
mod coverage;
mod fit;
mod lack_of_fit;
mod means;
mod point;
mod robust;
mod scatter;
mod settings;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::error::{Problem, ProblemStage};
use crate::maneuver::Status;
use crate::numerics::statistics::normal::NORMAL_95;
use crate::tables::{EstimateRow, OutlierRow, TrendRow};

use fit::Trend;
use means::{Mean, means};
use point::{TrendPoint, count_flown};

pub use settings::Settings;
#[cfg(test)]
pub use settings::TrendGroup;

/// Least number of maneuvers for a trend: the scatter of fewer cannot be estimated.
const FEWEST_MANEUVERS: usize = 3;

/// Name of a mean in the column `curve`.
const MEAN: &str = "mean";

/// Trends of all derivatives, outliers and problems.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trends {
    pub rows: Vec<TrendRow>,
    /// The maneuvers that lie far from a trend.
    pub outliers: Vec<OutlierRow>,
    pub problems: Vec<Problem>,
}

/// Fits the trends of every derivative: its group's, then its classes'. Derivatives keep the order
/// in which they first appear.
///
/// `estimates` must come from converged fits. Estimates with status `estimated`, a value and a
/// bound (the corrected one where there is one) count. A group of fewer than three maneuvers has
/// means instead of a trend; a class of fewer is skipped. A trend is published at the multiples of
/// the step and at the derivative's `breakpoints`, deg, inside the range of its data.
#[must_use]
pub fn trends(
    estimates: &[EstimateRow],
    settings: &Settings,
    breakpoints: impl Fn(&str) -> Vec<f64> + Sync,
) -> Trends {
    let each: Vec<Trends> = by_derivative(estimates, settings)
        .into_par_iter()
        .map(|(derivative, own)| {
            trends_of_derivative(derivative, &own, settings, &breakpoints(derivative))
        })
        .collect();
    let mut trends = Trends::default();
    for own in each {
        trends.rows.extend(own.rows);
        trends.outliers.extend(own.outliers);
        trends.problems.extend(own.problems);
    }
    trends
}

/// Fits the trends of one derivative.
fn trends_of_derivative(
    derivative: &str,
    own: &[&EstimateRow],
    settings: &Settings,
    further: &[f64],
) -> Trends {
    let mut trends = Trends::default();
    let group = settings.group_of(derivative);
    if let Some(group) = group {
        let members = members(own, |class| group.has(class));
        let knots = group.knots_deg.as_ref().unwrap_or(&settings.knots_deg);
        if members.len() < FEWEST_MANEUVERS {
            trends.rows = mean_rows(&members, &group.name, settings);
        } else {
            match fit_trend(&members, &group.name, settings, knots, further) {
                Ok((rows, outliers)) => (trends.rows, trends.outliers) = (rows, outliers),
                Err(reason) => trends
                    .problems
                    .push(problem(derivative, &group.name, reason)),
            }
        }
    }
    if settings.per_class {
        let mut classes: BTreeSet<&str> = own.iter().map(|e| e.class.as_str()).collect();
        classes.retain(|class| group.is_none_or(|group| group.name != *class));
        for class in classes {
            let members = members(own, |other| other == class);
            // Outliers of the class's trend are not published: the group's trend names them too.
            let of_class = fit_trend(&members, class, settings, &settings.knots_deg, further);
            trends
                .rows
                .extend(of_class.map(|(rows, _)| rows).unwrap_or_default());
        }
    }
    trends
}

/// Estimates of some classes.
fn members<'a>(
    estimates: &[&'a EstimateRow],
    is_member: impl Fn(&str) -> bool,
) -> Vec<&'a EstimateRow> {
    let members = estimates.iter().filter(|e| is_member(&e.class));
    members.copied().collect()
}

/// The usable estimates of each derivative, derivatives in order of appearance.
fn by_derivative<'a>(
    estimates: &'a [EstimateRow],
    settings: &Settings,
) -> Vec<(&'a str, Vec<&'a EstimateRow>)> {
    let mut order: Vec<(&str, Vec<&EstimateRow>)> = Vec::new();
    let mut place: BTreeMap<&str, usize> = BTreeMap::new();
    let is_free = |e: &&EstimateRow| {
        e.status == Status::Estimated && !settings.leave_out.contains(&e.derivative)
    };
    for estimate in estimates.iter().filter(is_free) {
        let at = *place.entry(&estimate.derivative).or_insert(order.len());
        if at == order.len() {
            order.push((&estimate.derivative, Vec::new()));
        }
        if point(estimate).is_some() {
            order[at].1.push(estimate);
        }
    }
    order
}

/// The point of an estimate, with class and flown α at index 0; `None` without a value and a bound.
fn point(e: &EstimateRow) -> Option<TrendPoint> {
    let bound = e.bound_corrected.or(e.bound)?;
    let p = TrendPoint {
        alpha_deg: e.alpha_deg,
        value: e.value?,
        bound,
        class: 0,
        flown: 0,
    };
    (p.alpha_deg.is_finite() && p.value.is_finite() && bound.is_finite() && bound > 0.0)
        .then_some(p)
}

/// Fits one trend: its rows on the published grid, and its outliers.
fn fit_trend(
    members: &[&EstimateRow],
    group: &str,
    settings: &Settings,
    knots_deg: &[f64],
    breakpoints: &[f64],
) -> Result<(Vec<TrendRow>, Vec<OutlierRow>), String> {
    if members.len() < FEWEST_MANEUVERS {
        return Err(format!(
            "{} maneuvers with an estimate and a bound are too few for a trend",
            members.len()
        ));
    }
    let placed = placed(members, settings);
    let points: Vec<TrendPoint> = placed.iter().map(|(p, _)| *p).collect();
    let fit = Trend::through(&points, settings, knots_deg)
        .ok_or("the least-squares fit has no solution")?;
    let outliers = outliers(&placed, &fit, group, settings.outlier_z);
    let quantile_95 = fit.best.quantile_95();
    let one_more = fit.best.deviation_of_one_more();
    let row = |alpha_deg: f64| {
        let (value, fit_error) = fit.value_and_error(clamp_to_data(&points, alpha_deg));
        let common_error = common_error(members, alpha_deg, settings.alpha_step_deg);
        let standard_error = fit_error.hypot(common_error);
        let half_width = quantile_95 * standard_error;
        let prediction = quantile_95 * standard_error.hypot(one_more);
        TrendRow {
            derivative: members[0].derivative.clone(),
            unit: members[0].unit.clone(),
            group: group.to_owned(),
            alpha_deg,
            value,
            standard_error,
            lower_95: value - half_width,
            upper_95: value + half_width,
            prediction_lower_95: value - prediction,
            prediction_upper_95: value + prediction,
            maneuvers: points.len(),
            outliers: outliers.len(),
            curve: fit.best.basis().name(),
            order: fit.best.basis().order(),
            scatter: fit.best.scatter(),
        }
    };
    let grid = grid(&points, settings, breakpoints);
    Ok((grid.into_iter().map(row).collect(), outliers))
}

/// Estimates with their points, sorted by α: sums do not depend on the order in which the maneuvers
/// come.
fn placed<'a>(
    members: &[&'a EstimateRow],
    settings: &Settings,
) -> Vec<(TrendPoint, &'a EstimateRow)> {
    let classes: BTreeSet<&str> = members.iter().map(|e| e.class.as_str()).collect();
    let class = |e: &EstimateRow| classes.iter().position(|c| *c == e.class).unwrap_or(0);
    let of_class = |e: &EstimateRow| {
        Some(TrendPoint {
            class: class(e),
            ..point(e)?
        })
    };
    let mut placed: Vec<(TrendPoint, &EstimateRow)> = members
        .iter()
        .filter_map(|e| Some((of_class(e)?, *e)))
        .collect();
    placed.sort_by(|a, b| {
        a.0.key()
            .partial_cmp(&b.0.key())
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    let points = placed.iter_mut().map(|(point, _)| point);
    count_flown(points, settings.alpha_step_deg);
    placed
}

/// Rows of the means of maneuvers that are too few for a trend.
fn mean_rows(members: &[&EstimateRow], group: &str, settings: &Settings) -> Vec<TrendRow> {
    let points: Vec<TrendPoint> = placed(members, settings)
        .iter()
        .map(|(point, _)| *point)
        .collect();
    let row = |mean: Mean| {
        let common = common_error(members, mean.alpha_deg, settings.alpha_step_deg);
        let standard_error = mean.standard_error.hypot(common);
        let half = NORMAL_95 * standard_error;
        let prediction = NORMAL_95 * standard_error.hypot(mean.one_more);
        TrendRow {
            derivative: members[0].derivative.clone(),
            unit: members[0].unit.clone(),
            group: group.to_owned(),
            alpha_deg: mean.alpha_deg,
            value: mean.value,
            standard_error,
            lower_95: mean.value - half,
            upper_95: mean.value + half,
            prediction_lower_95: mean.value - prediction,
            prediction_upper_95: mean.value + prediction,
            maneuvers: mean.maneuvers,
            outliers: 0,
            curve: MEAN.to_owned(),
            order: 0,
            scatter: mean.scatter,
        }
    };
    means(&points).into_iter().map(row).collect()
}

/// The maneuvers further than `limit` standard deviations from the trend.
fn outliers(
    placed: &[(TrendPoint, &EstimateRow)],
    fit: &Trend,
    group: &str,
    limit: f64,
) -> Vec<OutlierRow> {
    let far = placed
        .iter()
        .zip(fit.best.residuals())
        .filter(|(_, residual)| residual.z.abs() > limit);
    far.map(|((point, estimate), residual)| OutlierRow {
        derivative: estimate.derivative.clone(),
        unit: estimate.unit.clone(),
        group: group.to_owned(),
        maneuver_id: estimate.maneuver_id.clone(),
        class: estimate.class.clone(),
        alpha_deg: point.alpha_deg,
        value: point.value,
        bound: point.bound,
        trend: fit.best.value_and_error(point.alpha_deg).0,
        z: residual.z,
        weight_share: residual.share,
    })
    .collect()
}

/// Clamps α to the range of the data: a trend is not continued past its last maneuver.
fn clamp_to_data(points: &[TrendPoint], alpha_deg: f64) -> f64 {
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return alpha_deg;
    };
    alpha_deg.max(first.alpha_deg).min(last.alpha_deg)
}

/// Standard error of the trend at an α from held values and the instruments' calibration.
///
/// Errors of held values and of instruments are common to the maneuvers, so they do not average
/// out. The result is the mean over the maneuvers within a step of α, with weights 1/bound²; if
/// there are none, over the flown α on either side.
fn common_error(members: &[&EstimateRow], alpha_deg: f64, step_deg: f64) -> f64 {
    let nearest = |side: f64| {
        let distances = members.iter().map(|e| side * (e.alpha_deg - alpha_deg));
        distances.filter(|d| *d >= 0.0).min_by(f64::total_cmp)
    };
    let reach = match (nearest(-1.0), nearest(1.0)) {
        (Some(below), Some(above)) if below.min(above) > step_deg => {
            below.max(above) + 0.5 * step_deg
        }
        (Some(only), None) | (None, Some(only)) => only.max(step_deg),
        _ => step_deg,
    };
    let near = members
        .iter()
        .filter(|e| (e.alpha_deg - alpha_deg).abs() <= reach);
    let (mut sum, mut weights) = (0.0, 0.0);
    for (e, p) in near.filter_map(|e| Some((e, point(e)?))) {
        let weight = p.bound.powi(-2);
        sum += weight
            * e.bound_held
                .unwrap_or(0.0)
                .hypot(e.bound_calibration.unwrap_or(0.0));
        weights += weight;
    }
    if weights > 0.0 { sum / weights } else { 0.0 }
}

/// The multiples of the step and the breakpoints inside the range of the data, ascending.
fn grid(points: &[TrendPoint], settings: &Settings, breakpoints: &[f64]) -> Vec<f64> {
    let (step, reach) = (settings.alpha_step_deg, settings.alpha_reach_deg);
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return Vec::new();
    };
    let (from, to) = (first.alpha_deg - reach, last.alpha_deg + reach);
    let mut grid: Vec<f64> = breakpoints
        .iter()
        .copied()
        .filter(|a| (from..=to).contains(a))
        .collect();
    if step > 0.0 {
        let steps = std::iter::successors(Some((from / step).ceil()), |k| Some(k + 1.0));
        let multiples = steps.map(|k| k * step).take_while(|alpha| *alpha <= to);
        // A breakpoint that equals a multiple but for rounding is published once, as the tunnel has it.
        let new: Vec<f64> = multiples
            .filter(|alpha| !breakpoints.iter().any(|b| (b - alpha).abs() < 1e-6 * step))
            .collect();
        grid.extend(new);
    }
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    grid
}

fn problem(derivative: &str, group: &str, reason: String) -> Problem {
    Problem {
        stage: ProblemStage::Trend,
        flight_id: String::new(),
        place: format!("{derivative}, group {group}"),
        reason,
    }
}
