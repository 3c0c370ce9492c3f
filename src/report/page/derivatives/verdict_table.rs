//! Table of verdicts: flight against wind tunnel, a row per derivative.

use std::collections::BTreeMap;

use serde::Serialize;

use super::derivative_results::DerivativeResults;
use super::verdict_ranges;
use crate::aero::Axis;
use crate::numerics::statistics::order_statistics::quantile;
use crate::report::figure::scale::extent;
use crate::report::figure::verdict_bar;
use crate::report::notation::{self, DASH, angle, number};

/// Width of the bar of verdicts over angle of attack, px.
const BAR_WIDTH: u32 = 130;

/// Largest percentage that is printed; beyond it the reference value is close to zero.
pub const LARGEST_PERCENTAGE: f64 = 999.5;

/// One row of the table.
#[derive(Clone, Debug, Serialize)]
pub struct VerdictRow {
    pub name: String,
    pub symbol: String,
    pub unit: String,
    /// Anchor of the derivative's page; empty if there is none.
    pub anchor: String,
    pub phrase: String,
    pub bar: String,
    pub difference: String,
    pub maneuvers: usize,
    pub bound: String,
}

/// Verdicts of one axis.
#[derive(Clone, Debug, Serialize)]
pub struct VerdictGroup {
    pub title: String,
    pub alpha_from: String,
    pub alpha_to: String,
    pub rows: Vec<VerdictRow>,
}

/// The verdict tables, one per axis that has compared derivatives.
#[must_use]
pub fn by_axis(
    derivatives: &[DerivativeResults],
    anchors: &BTreeMap<&str, String>,
) -> Vec<VerdictGroup> {
    [
        (Axis::Longitudinal, "Longitudinal"),
        (Axis::Lateral, "Lateral-directional"),
    ]
    .into_iter()
    .filter_map(|(axis, title)| {
        let compared: Vec<&DerivativeResults> = derivatives
            .iter()
            .filter(|d| d.axis == Some(axis) && d.is_compared())
            .collect();
        (!compared.is_empty()).then(|| group(title, &compared, anchors))
    })
    .collect()
}

fn group(
    title: &str,
    derivatives: &[&DerivativeResults],
    anchors: &BTreeMap<&str, String>,
) -> VerdictGroup {
    let alphas = derivatives
        .iter()
        .flat_map(|d| d.comparison.iter().map(|c| c.alpha_deg));
    let (from, to) = extent(alphas).unwrap_or((0.0, 1.0));
    VerdictGroup {
        title: title.to_owned(),
        alpha_from: angle(from),
        alpha_to: angle(to),
        rows: derivatives
            .iter()
            .map(|derivative| row(derivative, anchors, (from, to)))
            .collect(),
    }
}

fn row(
    derivative: &DerivativeResults,
    anchors: &BTreeMap<&str, String>,
    alpha_deg: (f64, f64),
) -> VerdictRow {
    let ranges = verdict_ranges::ranges(&derivative.comparison);
    let segments = verdict_ranges::bar_segments(&ranges);
    VerdictRow {
        name: derivative.name.to_owned(),
        symbol: notation::symbol(derivative.name),
        unit: notation::unit(derivative.unit),
        anchor: anchors.get(derivative.name).cloned().unwrap_or_default(),
        phrase: verdict_ranges::phrase(&ranges),
        bar: verdict_bar::draw(&segments, alpha_deg, BAR_WIDTH),
        difference: largest_difference(derivative),
        maneuvers: derivative.maneuvers(),
        bound: typical_bound(derivative),
    }
}

/// Largest difference between flight and tunnel, with its percentage of the tunnel's value there.
fn largest_difference(derivative: &DerivativeResults) -> String {
    let differences = derivative
        .comparison
        .iter()
        .filter_map(|row| Some((row, row.tunnel.difference.filter(|d| d.is_finite())?)));
    let largest = differences.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let Some((row, difference)) = largest else {
        return DASH.to_owned();
    };
    let percentage = row
        .tunnel
        .difference_pct
        .filter(|pct| pct.is_finite() && pct.abs() < LARGEST_PERCENTAGE)
        .map_or_else(String::new, |pct| {
            format!(" ({}{} %)", plus(pct), notation::fixed(pct, 0))
        });
    format!(
        "{}{}{percentage} at {}",
        plus(difference),
        number(Some(difference), 2),
        angle(row.alpha_deg)
    )
}

/// The sign of a positive number, which is not written otherwise.
fn plus(value: f64) -> &'static str {
    if value > 0.0 { "+" } else { "" }
}

/// Median bound, with its percentage of the median estimate.
fn typical_bound(derivative: &DerivativeResults) -> String {
    let bounds: Vec<f64> = derivative.points.iter().map(|p| p.bound).collect();
    let sizes: Vec<f64> = derivative.points.iter().map(|p| p.value.abs()).collect();
    let (Some(bound), Some(size)) = (quantile(bounds, 0.5), quantile(sizes, 0.5)) else {
        return DASH.to_owned();
    };
    let percentage = 100.0 * bound / size;
    let percentage = if percentage < LARGEST_PERCENTAGE {
        format!(" ({} %)", number(Some(percentage), 2))
    } else {
        String::new()
    };
    format!("±{}{percentage}", number(Some(bound), 2))
}
