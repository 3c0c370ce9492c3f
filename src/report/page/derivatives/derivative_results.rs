//! Results of one derivative, gathered from the tables: estimates, trend, comparison, tunnel.

use std::collections::{BTreeMap, BTreeSet};

use crate::aero::{Axis, Coefficient};
use crate::maneuver::Status;
use crate::report::contents::{Contents, group_by};
use crate::report::notation::coefficient_of;
use crate::tables::{ComparisonRow, EstimateRow, Outcome, PosteriorRow, TrendRow};

/// One estimate as it is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatePoint<'a> {
    pub class: &'a str,
    pub alpha_deg: f64,
    pub value: f64,
    pub bound: f64,
    /// `true` if the bound is corrected for the autocorrelation of the residuals.
    pub is_corrected: bool,
}

/// Everything that the report shows about one derivative.
#[derive(Clone, Debug)]
pub struct DerivativeResults<'a> {
    pub name: &'a str,
    pub unit: &'a str,
    /// `None` for an instrument bias.
    pub coefficient: Option<Coefficient>,
    pub axis: Option<Axis>,
    pub points: Vec<EstimatePoint<'a>>,
    /// Number of estimates that the data do not determine: they have no bound.
    pub undetermined: usize,
    /// Number of estimates from fits that did not converge or were rejected.
    pub unconverged: usize,
    /// Group of classes whose trend is the flight result.
    pub group: &'a str,
    pub trend: Vec<&'a TrendRow>,
    /// Posterior at the Mach number and third variable where flight gave most.
    pub posterior: Vec<&'a PosteriorRow>,
    pub comparison: Vec<&'a ComparisonRow>,
    /// Angle of attack (deg) and wind-tunnel value.
    pub tunnel: Vec<(f64, f64)>,
}

impl DerivativeResults<'_> {
    /// `true` if flight is compared with the tunnel. An instrument bias never is.
    #[must_use]
    pub fn is_compared(&self) -> bool {
        self.coefficient.is_some() && !self.comparison.is_empty()
    }

    /// Number of maneuvers behind the trend, or of estimates where there is no trend.
    #[must_use]
    pub fn maneuvers(&self) -> usize {
        self.trend
            .first()
            .map_or(self.points.len(), |row| row.maneuvers)
    }

    /// Sort key: coefficients in the order of the equations, biases last.
    fn sort_key(&self) -> (bool, Option<Coefficient>, Option<Axis>) {
        (self.coefficient.is_none(), self.coefficient, self.axis)
    }
}

/// Collects every derivative that is estimated, has a trend or is compared: by coefficient, then in
/// the order of the model.
#[must_use]
pub fn collect<'a>(contents: &Contents<'a>) -> Vec<DerivativeResults<'a>> {
    let failed = failed_fits(contents);
    let estimates = group_by(contents.estimates, |row| &row.derivative);
    let trends = group_by(contents.trends, |row| &row.derivative);
    let posterior = group_by(contents.posterior, |row| &row.derivative);
    let comparisons = group_by(contents.comparison, |row| &row.derivative);
    let axes: BTreeMap<&str, Axis> = contents
        .classes
        .iter()
        .map(|c| (c.name.as_str(), c.axis))
        .collect();
    let mut derivatives: Vec<DerivativeResults> = names(contents)
        .into_iter()
        .map(|name| {
            let rows = DerivativeRows {
                estimates: estimates.get(name).map_or(&[], Vec::as_slice),
                trends: trends.get(name).map_or(&[], Vec::as_slice),
                posterior: posterior.get(name).map_or(&[], Vec::as_slice),
                comparison: comparisons.get(name).map_or(&[], Vec::as_slice),
            };
            rows.results(name, &failed, &axes)
        })
        .collect();
    derivatives.sort_by_key(DerivativeResults::sort_key);
    derivatives
}

/// Names in the order of the model; names that the model lacks come last, alphabetically.
fn names<'a>(contents: &Contents<'a>) -> Vec<&'a str> {
    let estimated = contents
        .estimates
        .iter()
        .filter(|e| e.status == Status::Estimated)
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

/// Maneuvers whose fit did not converge, was rejected or is doubtful.
fn failed_fits<'a>(contents: &Contents<'a>) -> BTreeSet<&'a str> {
    contents
        .fits
        .iter()
        .filter(|f| {
            matches!(
                f.outcome,
                Outcome::NotConverged | Outcome::Rejected | Outcome::Doubtful
            )
        })
        .map(|f| f.maneuver_id.as_str())
        .collect()
}

/// Rows of one derivative in the tables.
struct DerivativeRows<'a, 'r> {
    estimates: &'r [&'a EstimateRow],
    trends: &'r [&'a TrendRow],
    posterior: &'r [&'a PosteriorRow],
    comparison: &'r [&'a ComparisonRow],
}

impl<'a> DerivativeRows<'a, '_> {
    fn results(
        &self,
        name: &'a str,
        failed_fits: &BTreeSet<&str>,
        axes: &BTreeMap<&str, Axis>,
    ) -> DerivativeResults<'a> {
        let mut estimated = self.estimates.to_vec();
        estimated.retain(|e| e.status == Status::Estimated && e.value.is_some());
        let is_unconverged = |e: &&&EstimateRow| failed_fits.contains(e.maneuver_id.as_str());
        let (unconverged, sound): (Vec<&EstimateRow>, Vec<&EstimateRow>) =
            estimated.iter().partition(is_unconverged);
        let points: Vec<EstimatePoint> = sound.iter().filter_map(|e| point(e)).collect();
        let coefficient = coefficient_of(name);
        let axis_of_class = || {
            let first = estimated.first()?;
            axes.get(first.class.as_str()).copied()
        };
        let group = self.group();
        let trends = self.trends.iter().copied();
        let trend = trends.filter(|row| Some(row.group.as_str()) == group);
        DerivativeResults {
            name,
            unit: self.unit(),
            coefficient,
            axis: coefficient.map(Coefficient::axis).or_else(axis_of_class),
            undetermined: sound.len() - points.len(),
            unconverged: unconverged.len(),
            points,
            group: group.unwrap_or_default(),
            trend: sorted_by_alpha(trend, |t| t.alpha_deg),
            posterior: self.posterior(),
            comparison: sorted_by_alpha(self.comparison.iter().copied(), |c| c.alpha_deg),
            tunnel: self.tunnel(),
        }
    }

    /// Posterior at the Mach number and third variable where flight gave most.
    fn posterior(&self) -> Vec<&'a PosteriorRow> {
        let share = |row: &PosteriorRow| row.flight_share_pct.unwrap_or(0.0);
        let all = self.posterior.iter().copied();
        let most = all.clone().max_by(|a, b| share(a).total_cmp(&share(b)));
        let place = most.map(|row| (row.mach, row.third));
        let there = all.filter(|row| Some((row.mach, row.third)) == place);
        sorted_by_alpha(there, |row| row.alpha_deg)
    }

    /// Group of the compared trend, or of the first trend.
    fn group(&self) -> Option<&'a str> {
        let compared = self.comparison.first().map(|c| c.group.as_str());
        compared.or(self.trends.first().map(|t| t.group.as_str()))
    }

    fn unit(&self) -> &'a str {
        let compared = self.comparison.first().map(|c| c.unit.as_str());
        compared
            .or(self.trends.first().map(|t| t.unit.as_str()))
            .or(self.estimates.first().map(|e| e.unit.as_str()))
            .unwrap_or("-")
    }

    /// Tunnel values of the comparison. For a derivative that is not compared, the tunnel values
    /// used in the estimation.
    fn tunnel(&self) -> Vec<(f64, f64)> {
        let compared = self
            .comparison
            .iter()
            .map(|c| (c.alpha_deg, c.tunnel.wind_tunnel));
        let used = self.estimates.iter().map(|e| (e.alpha_deg, e.wind_tunnel));
        let rows: Vec<_> = if self.comparison.is_empty() {
            used.collect()
        } else {
            compared.collect()
        };
        let mut values: Vec<(f64, f64)> = rows
            .into_iter()
            .filter_map(|(alpha, value)| value.map(|v| (alpha, v)))
            .filter(|(alpha, value)| alpha.is_finite() && value.is_finite())
            .collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        values
    }
}

/// The estimate as a point of the figure; `None` without a finite value and bound.
fn point(row: &EstimateRow) -> Option<EstimatePoint<'_>> {
    let finite = |v: Option<f64>| v.filter(|v| v.is_finite());
    let corrected = finite(row.bound_corrected);
    let bound = corrected.or(finite(row.bound))?;
    Some(EstimatePoint {
        class: &row.class,
        alpha_deg: finite(Some(row.alpha_deg))?,
        value: finite(row.value)?,
        bound: bound.abs(),
        is_corrected: corrected.is_some(),
    })
}

/// Sorts rows by angle of attack, without those that have none.
fn sorted_by_alpha<'a, T>(
    rows: impl Iterator<Item = &'a T>,
    alpha_deg: impl Fn(&T) -> f64,
) -> Vec<&'a T> {
    let mut rows: Vec<&T> = rows.filter(|row| alpha_deg(row).is_finite()).collect();
    rows.sort_by(|a, b| alpha_deg(a).total_cmp(&alpha_deg(b)));
    rows
}
