//! A subject is one derivative with everything the report says about it, gathered from the tables.

use std::collections::{BTreeMap, BTreeSet};

use super::Contents;
use super::notation::coefficient_of;
use crate::aero::{Axis, Coefficient};
use crate::tables::{ComparisonRow, EstimateRow, TrendRow};

/// One estimate that is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<'a> {
    pub class: &'a str,
    pub alpha_deg: f64,
    pub value: f64,
    pub bound: f64,
    /// Whether the bound counts the residuals' autocorrelation.
    pub corrected: bool,
}

/// One derivative and what is known of it.
#[derive(Clone, Debug)]
pub struct Subject<'a> {
    pub name: &'a str,
    pub unit: &'a str,
    pub coefficient: Option<Coefficient>,
    pub axis: Option<Axis>,
    pub points: Vec<Point<'a>>,
    /// Estimates that the data do not determine: they have no bound.
    pub undetermined: usize,
    /// Estimates of fits that did not converge or were rejected.
    pub unconverged: usize,
    /// The trend's group that speaks for flight.
    pub group: &'a str,
    pub trend: Vec<&'a TrendRow>,
    pub comparison: Vec<&'a ComparisonRow>,
    /// α and the tunnel's value there.
    pub tunnel: Vec<(f64, f64)>,
}

impl Subject<'_> {
    /// Whether flight is compared with the tunnel here; a bias of an instrument is not, whatever
    /// rows there are.
    #[must_use]
    pub fn is_compared(&self) -> bool {
        self.coefficient.is_some() && !self.comparison.is_empty()
    }

    /// How many maneuvers speak for flight: those of the trend, or of the estimates where there is
    /// no trend.
    #[must_use]
    pub fn maneuvers(&self) -> usize {
        self.trend
            .first()
            .map_or(self.points.len(), |row| row.maneuvers)
    }

    /// Where this derivative stands: the coefficients in the order of the equations, the biases
    /// last.
    fn place(&self) -> (bool, Option<Coefficient>, Option<Axis>) {
        (self.coefficient.is_none(), self.coefficient, self.axis)
    }
}

/// Every derivative that was estimated, has a trend or is compared: by coefficient, then in the
/// order of the model.
#[must_use]
pub fn gather<'a>(contents: &Contents<'a>) -> Vec<Subject<'a>> {
    let failed = failed_fits(contents);
    let estimates = by_name(contents.estimates, |row| &row.derivative);
    let trends = by_name(contents.trends, |row| &row.derivative);
    let comparisons = by_name(contents.comparison, |row| &row.derivative);
    let axes: BTreeMap<&str, Axis> = contents
        .classes
        .iter()
        .map(|(name, _, axis)| (name.as_str(), *axis))
        .collect();
    let mut subjects: Vec<Subject> = names(contents)
        .into_iter()
        .map(|name| {
            let of = Rows {
                estimates: estimates.get(name).map_or(&[], Vec::as_slice),
                trends: trends.get(name).map_or(&[], Vec::as_slice),
                comparison: comparisons.get(name).map_or(&[], Vec::as_slice),
            };
            subject(name, &of, &failed, &axes)
        })
        .collect();
    subjects.sort_by_key(Subject::place);
    subjects
}

/// The names of the subjects, in the order of the model; those it does not name come last, by the
/// alphabet.
fn names<'a>(contents: &Contents<'a>) -> Vec<&'a str> {
    let estimated = contents
        .estimates
        .iter()
        .filter(|e| e.status == "estimated")
        .map(|e| e.derivative.as_str());
    let trends = contents.trends.iter().map(|t| t.derivative.as_str());
    let compared = contents.comparison.iter().map(|c| c.derivative.as_str());
    let mut left: BTreeSet<&str> = estimated.chain(trends).chain(compared).collect();
    let mut names: Vec<&str> = contents
        .order
        .iter()
        .map(String::as_str)
        .filter(|name| left.remove(name))
        .collect();
    names.extend(left);
    names
}

fn failed_fits<'a>(contents: &Contents<'a>) -> BTreeSet<&'a str> {
    let failed = |outcome: &str| matches!(outcome, "not_converged" | "rejected");
    contents
        .fits
        .iter()
        .filter(|f| failed(&f.outcome))
        .map(|f| f.maneuver_id.as_str())
        .collect()
}

/// The rows of each derivative, in their order.
pub fn by_name<'a, T>(
    rows: &'a [T],
    name: impl Fn(&'a T) -> &'a str,
) -> BTreeMap<&'a str, Vec<&'a T>> {
    let mut of: BTreeMap<&str, Vec<&T>> = BTreeMap::new();
    for row in rows {
        of.entry(name(row)).or_default().push(row);
    }
    of
}

struct Rows<'a, 'r> {
    estimates: &'r [&'a EstimateRow],
    trends: &'r [&'a TrendRow],
    comparison: &'r [&'a ComparisonRow],
}

fn subject<'a>(
    name: &'a str,
    of: &Rows<'a, '_>,
    failed: &BTreeSet<&str>,
    axes: &BTreeMap<&str, Axis>,
) -> Subject<'a> {
    let estimated: Vec<&EstimateRow> = of
        .estimates
        .iter()
        .copied()
        .filter(|e| e.status == "estimated" && e.value.is_some())
        .collect();
    let (spoiled, sound): (Vec<&EstimateRow>, Vec<&EstimateRow>) = estimated
        .iter()
        .partition(|e| failed.contains(e.maneuver_id.as_str()));
    let points: Vec<Point> = sound.iter().filter_map(|e| point(e)).collect();
    let group = of
        .comparison
        .first()
        .map(|c| c.group.as_str())
        .or(of.trends.first().map(|t| t.group.as_str()));
    let coefficient = coefficient_of(name);
    let unit = (of.comparison.first().map(|c| c.unit.as_str()))
        .or(of.trends.first().map(|t| t.unit.as_str()))
        .or(of.estimates.first().map(|e| e.unit.as_str()));
    let axis_of_class = || {
        estimated
            .first()
            .and_then(|e| axes.get(e.class.as_str()))
            .copied()
    };
    Subject {
        name,
        unit: unit.unwrap_or("-"),
        coefficient,
        axis: coefficient.map(Coefficient::axis).or_else(axis_of_class),
        undetermined: sound.len() - points.len(),
        unconverged: spoiled.len(),
        points,
        group: group.unwrap_or_default(),
        trend: sorted(
            of.trends
                .iter()
                .copied()
                .filter(|t| Some(t.group.as_str()) == group),
            |t| t.alpha_deg,
        ),
        comparison: sorted(of.comparison.iter().copied(), |c| c.alpha_deg),
        tunnel: tunnel(of),
    }
}

fn point(row: &EstimateRow) -> Option<Point<'_>> {
    let finite = |v: Option<f64>| v.filter(|v| v.is_finite());
    let corrected = finite(row.bound_corrected);
    let bound = corrected.or(finite(row.bound))?;
    let value = finite(row.value)?;
    let alpha_deg = finite(Some(row.alpha_deg))?;
    Some(Point {
        class: &row.class,
        alpha_deg,
        value,
        bound: bound.abs(),
        corrected: corrected.is_some(),
    })
}

/// The tunnel's values: those of the comparison, or where a derivative is not compared those that
/// the estimation used.
fn tunnel(of: &Rows) -> Vec<(f64, f64)> {
    let compared = of.comparison.iter().map(|c| (c.alpha_deg, c.wind_tunnel));
    let used = of.estimates.iter().map(|e| (e.alpha_deg, e.wind_tunnel));
    let of_both: Vec<_> = if of.comparison.is_empty() {
        used.collect()
    } else {
        compared.collect()
    };
    let mut values: Vec<(f64, f64)> = of_both
        .into_iter()
        .filter_map(|(alpha, value)| value.map(|v| (alpha, v)))
        .filter(|(alpha, value)| alpha.is_finite() && value.is_finite())
        .collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    values
}

/// The rows by angle of attack; those without one are left out.
fn sorted<'a, T>(rows: impl Iterator<Item = &'a T>, alpha_deg: impl Fn(&T) -> f64) -> Vec<&'a T> {
    let mut rows: Vec<&T> = rows.filter(|row| alpha_deg(row).is_finite()).collect();
    rows.sort_by(|a, b| alpha_deg(a).total_cmp(&alpha_deg(b)));
    rows
}
