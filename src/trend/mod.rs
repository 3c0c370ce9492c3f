//! Trend fits least squares across α through the estimates of one derivative, for the group of
//! classes that speaks for it and for each class alone.
//!
//! The fit is in [`fit`]: a polynomial or spline in α that a criterion chooses, with weights
//! 1/(bound² + τ²), where τ is the scatter between maneuvers of a class beyond their bounds.

mod basis;
#[cfg(test)]
mod coverage;
mod fit;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error::{Problem, ProblemStage};
use crate::maneuver::Status;
use crate::settings::{elements, settings, single_values};
use crate::tables::{EstimateRow, OutlierRow, TrendRow};

use fit::{Point, Trend};

/// A trend through fewer maneuvers than this has no scatter to speak of and is not drawn.
const FEWEST_MANEUVERS: usize = 3;

settings! {
    /// Settings of the trends across angle of attack.
    pub struct Settings {
        /// Criterion that chooses the order of a trend's polynomial or spline: `aicc`, Akaike's
        /// with the correction for few data, or `bic`, Schwarz's. `bic` chooses lower orders, so
        /// trends become smoother and their standard errors smaller.
        pub criterion: Criterion = Criterion::default(),
        /// Highest order of the polynomial. Lower: smoother trends that may miss the bends of
        /// derivatives through stall. There are never more coefficients than flown angles of
        /// attack.
        pub max_order: usize = 10,
        /// Spacing of the angles of attack at which trends are published, deg. It changes the rows
        /// of the tables, not the fitted trends.
        pub alpha_step_deg: f64 = 5.0,
        /// Angles of attack at which trends may bend sharply, deg. With knots a trend is a spline of
        /// up to third order, or a polynomial of up to third order where that fits better. Without,
        /// it is a polynomial, or a spline between the flown angles of attack.
        pub knots_deg: Vec<f64> = Vec::new(),
        /// Distance from its trend beyond which a maneuver is listed in the table `outliers`,
        /// standard deviations. It changes that table only: the fit limits the influence of any
        /// maneuver beyond 1.5.
        pub outlier_z: f64 = 3.0,
        /// Classes whose maneuvers make the trend of each derivative. The first group that names a
        /// derivative, or that names none, is used. Other classes then have trends of their own only.
        pub groups: Vec<Group> = vec![Group {
            name: "all".into(),
            ..Group::default()
        }],
    }
    expert {
        /// Distance beyond the outermost maneuver within which a trend is still published, deg. At 0
        /// a maneuver flown for 60 deg with a mean of 59.8 deg loses the row at 60 deg.
        pub alpha_reach_deg: f64 = 0.5,
        /// Trends of single classes beside the groups' trends. `false` removes their rows.
        pub per_class: bool = true,
        /// Names without a trend, for instance sensor biases. The named ones lose their rows.
        pub leave_out: BTreeSet<String> = BTreeSet::new(),
    }
}

settings! {
    /// Classes that make the trends of some derivatives.
    pub struct Group {
        /// Name of the group, as the tables have it.
        pub name: String,
        /// Derivatives of the group; without any, all that no group before it names.
        #[serde(default)]
        pub derivatives: Vec<String>,
        /// Classes of the group; without any, all classes.
        #[serde(default)]
        pub classes: Vec<String>,
        /// Knots of the group's trends, deg, in place of `knots_deg` of all trends.
        #[serde(default)]
        pub knots_deg: Option<Vec<f64>>,
    }
}
elements!(Vec<Group>: Group as "[]");
single_values!(Criterion);

/// Criterion for the order of a trend. Both weigh the misfit against the number of coefficients.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Criterion {
    /// Akaike's criterion with the correction for few data.
    #[default]
    Aicc,
    /// The Bayesian criterion of Schwarz.
    Bic,
}

impl Settings {
    /// The group that speaks for a derivative; none where no group names it and none takes the
    /// rest.
    #[must_use]
    pub fn group_of(&self, derivative: &str) -> Option<&Group> {
        let names = |g: &&Group| g.derivatives.iter().any(|d| d == derivative);
        let rest = |g: &&Group| g.derivatives.is_empty();
        self.groups
            .iter()
            .find(names)
            .or_else(|| self.groups.iter().find(rest))
    }
}

impl Group {
    #[must_use]
    pub fn has(&self, class: &str) -> bool {
        self.classes.is_empty() || self.classes.iter().any(|c| c == class)
    }
}

/// What comes of trends.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trends {
    pub rows: Vec<TrendRow>,
    /// Every maneuver that lies far from a trend.
    pub outliers: Vec<OutlierRow>,
    pub problems: Vec<Problem>,
}

/// The trends of every derivative, in the order in which the derivatives first appear: its group's,
/// then its classes'.
///
/// Give it the estimates of converged fits only. Of them it takes those with status `estimated`, a
/// value and a bound (the corrected one where there is one). A group of fewer than three maneuvers
/// has no trend and is a problem; a single class of so few is passed over. A trend is published at
/// the multiples of the step and at the derivative's `breakpoints`, deg, as far as they lie inside
/// its data.
#[must_use]
pub fn trends(
    estimates: &[EstimateRow],
    settings: &Settings,
    breakpoints: impl Fn(&str) -> Vec<f64> + Sync,
) -> Trends {
    let each: Vec<Trends> = by_derivative(estimates, settings)
        .into_par_iter()
        .map(|(derivative, of_it)| {
            of_derivative(derivative, &of_it, settings, &breakpoints(derivative))
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

/// Those of one derivative.
fn of_derivative(
    derivative: &str,
    of_it: &[&EstimateRow],
    settings: &Settings,
    further: &[f64],
) -> Trends {
    let mut trends = Trends::default();
    let group = settings.group_of(derivative);
    if let Some(group) = group {
        let members: Vec<&EstimateRow> = of_it
            .iter()
            .filter(|e| group.has(&e.class))
            .copied()
            .collect();
        let knots = group.knots_deg.as_ref().unwrap_or(&settings.knots_deg);
        match trend(&members, &group.name, settings, knots, further) {
            Ok((rows, outliers)) => (trends.rows, trends.outliers) = (rows, outliers),
            Err(reason) => trends
                .problems
                .push(problem(derivative, &group.name, reason)),
        }
    }
    if settings.per_class {
        let names: BTreeSet<&str> = of_it.iter().map(|e| e.class.as_str()).collect();
        for class in names
            .into_iter()
            .filter(|name| group.is_none_or(|g| g.name != *name))
        {
            let members: Vec<&EstimateRow> =
                of_it.iter().filter(|e| e.class == class).copied().collect();
            // What lies far from its class's trend alone is no more than a hint, and its group's
            // names it too.
            let of_class = trend(&members, class, settings, &settings.knots_deg, further);
            trends
                .rows
                .extend(of_class.map(|(rows, _)| rows).unwrap_or_default());
        }
    }
    trends
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

/// An estimate as the fit sees it, of the first class; none without a value and a bound.
fn point(e: &EstimateRow) -> Option<Point> {
    let bound = e.bound_corrected.or(e.bound)?;
    let p = Point {
        alpha_deg: e.alpha_deg,
        value: e.value?,
        bound,
        class: 0,
    };
    (p.alpha_deg.is_finite() && p.value.is_finite() && bound.is_finite() && bound > 0.0)
        .then_some(p)
}

/// One trend on the published grid, and the maneuvers far from it.
fn trend(
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
    let classes: BTreeSet<&str> = members.iter().map(|e| e.class.as_str()).collect();
    let class = |e: &EstimateRow| classes.iter().position(|c| *c == e.class).unwrap_or(0);
    let of_class = |e: &EstimateRow| {
        Some(Point {
            class: class(e),
            ..point(e)?
        })
    };
    let mut placed: Vec<(Point, &EstimateRow)> = members
        .iter()
        .filter_map(|e| Some((of_class(e)?, *e)))
        .collect();
    // Sums do not depend on the order in which the maneuvers come.
    placed.sort_by(|a, b| {
        a.0.key()
            .partial_cmp(&b.0.key())
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    let points: Vec<Point> = placed.iter().map(|(p, _)| *p).collect();
    let fit = Trend::through(&points, settings, knots_deg)
        .ok_or("the least-squares fit has no solution")?;
    let outliers = outliers(&placed, &fit, group, settings.outlier_z);
    let (half_width, named) = (fit.best.quantile_95(), outliers.len());
    let one_more = fit.best.one_more();
    let row = |alpha_deg: f64| {
        let (value, own_error) = fit.at(inside(&points, alpha_deg));
        let standard_error =
            own_error.hypot(common_error(members, alpha_deg, settings.alpha_step_deg));
        let prediction = half_width * standard_error.hypot(one_more);
        TrendRow {
            derivative: members[0].derivative.clone(),
            unit: members[0].unit.clone(),
            group: group.to_owned(),
            alpha_deg,
            value,
            standard_error,
            lower_95: value - half_width * standard_error,
            upper_95: value + half_width * standard_error,
            prediction_lower_95: value - prediction,
            prediction_upper_95: value + prediction,
            maneuvers: points.len(),
            outliers: named,
            curve: fit.best.basis().name(),
            order: fit.best.basis().order(),
            scatter: fit.best.scatter(),
        }
    };
    Ok((
        grid(&points, settings, breakpoints)
            .into_iter()
            .map(row)
            .collect(),
        outliers,
    ))
}

/// The maneuvers further than `limit` standard deviations from the trend.
fn outliers(
    placed: &[(Point, &EstimateRow)],
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
        trend: fit.best.at(point.alpha_deg).0,
        z: residual.z,
        weight_share: residual.share,
    })
    .collect()
}

/// α, or the end of the data where it lies a little beyond: a trend is not continued past its last
/// maneuver.
fn inside(points: &[Point], alpha_deg: f64) -> f64 {
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return alpha_deg;
    };
    alpha_deg.max(first.alpha_deg).min(last.alpha_deg)
}

/// What the uncertainty of held values and of the instruments' calibration does to the trend at an
/// angle of attack. Maneuvers that hold the same derivative at the same tunnel err together, and so
/// do those with the same instruments: it does not average out. It is the mean over the maneuvers
/// within a step of α, each with its weight 1/bound².
fn common_error(members: &[&EstimateRow], alpha_deg: f64, step_deg: f64) -> f64 {
    let near = members
        .iter()
        .filter(|e| (e.alpha_deg - alpha_deg).abs() <= step_deg);
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
fn grid(points: &[Point], settings: &Settings, breakpoints: &[f64]) -> Vec<f64> {
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
        // A breakpoint that is a multiple but for rounding stands once, as the tunnel writes it.
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
