//! The merge of flight and tunnel: the trend where flight has data, the tunnel elsewhere.

use std::collections::BTreeSet;

use super::contents::Contents;
use super::derivative_table::{DerivativeTable, GridCell, each_or_none, is_same_breakpoint};
use crate::aero::{Combined, Condition, WindTunnel};
use crate::tables::TrendRow;

/// Tables of all derivatives and combined sums that have a value anywhere, in the order of the
/// model.
#[must_use]
pub fn tables(contents: &Contents) -> Vec<DerivativeTable> {
    let derivatives = contents.buildup.derivatives.iter().map(|d| &d.name);
    let names = derivatives.chain(contents.buildup.combined.iter().map(|c| &c.name));
    let mut tables: Vec<DerivativeTable> = names.filter_map(|name| contents.table(name)).collect();
    contents
        .buildup
        .combined
        .iter()
        .for_each(|sum| keep_sum(&mut tables, sum));
    tables
}

/// Replaces the constant of a sum by the sum less its slope's part, where flight has both.
///
/// The data determine the sum well and its strongly correlated parts badly. Trends through each part
/// alone would not add up to the sum.
fn keep_sum(tables: &mut [DerivativeTable], sum: &Combined) {
    let named = |name: &str| tables.iter().find(|t| t.derivative == name);
    let (Some(whole), Some(slope), Some(constant)) =
        (named(&sum.name), named(&sum.slope), named(&sum.constant))
    else {
        return;
    };
    let kept = |(at, cell): (Condition, &GridCell)| {
        let whole = whole.cell(&at).filter(|c| c.is_flight)?;
        let slope = slope.cell(&at).filter(|c| c.is_flight)?;
        let uncertainty = |whole: f64, slope: f64| whole.hypot(slope * at.alpha_deg);
        let source = format!("flight, {} − {} α", sum.name, sum.slope);
        let value = whole.value - slope.value * at.alpha_deg;
        let uncertainty = whole
            .uncertainty
            .zip(slope.uncertainty)
            .map(|(w, s)| uncertainty(w, s));
        cell.is_flight.then_some(GridCell {
            value,
            uncertainty,
            is_flight: true,
            source,
        })
    };
    let kept: Vec<Option<GridCell>> = constant.points().map(kept).collect();
    if let Some(constant) = tables.iter_mut().find(|t| t.derivative == sum.constant) {
        let replaced = constant.cells.iter_mut().zip(kept);
        replaced
            .filter_map(|(cell, kept)| Some((cell, kept?)))
            .for_each(|(cell, kept)| *cell = kept);
    }
}

impl Contents<'_> {
    /// Table of a derivative or sum: the trend within the flown ranges, the tunnel elsewhere.
    fn table(&self, name: &str) -> Option<DerivativeTable> {
        let group = self.groups.group_of(name);
        let is_flight_value =
            |t: &&TrendRow| t.derivative == name && group.is_some_and(|g| g.name == t.group);
        let trend: Vec<&TrendRow> = self.trends.iter().filter(is_flight_value).collect();
        let flown = self.flown(name).filter(|_| !trend.is_empty());
        let clamped = self.tunnel.clamped();
        let alphas_deg = union(clamped.alphas_deg(name), trend.iter().map(|t| t.alpha_deg));
        let of_mach = flown.as_ref().map(|f| [f.mach.0, f.mach.1]);
        let of_third = flown
            .as_ref()
            .and_then(|f| f.third)
            .map(|(low, high)| [low, high]);
        let widened = |own: Vec<f64>, flown: Option<[f64; 2]>| {
            if own.is_empty() {
                own
            } else {
                union(own, flown.into_iter().flatten())
            }
        };
        let machs = widened(clamped.machs(name), of_mach);
        let thirds = widened(clamped.thirds(name), of_third);
        let mut cells = Vec::new();
        for third in each_or_none(&thirds) {
            for mach in each_or_none(&machs) {
                for &alpha_deg in &alphas_deg {
                    let there = trend
                        .iter()
                        .copied()
                        .find(|t| is_same_breakpoint(t.alpha_deg, alpha_deg));
                    let there =
                        there.filter(|_| flown.as_ref().is_none_or(|f| f.contains(mach, third)));
                    let condition = Condition {
                        alpha_deg,
                        mach: mach.unwrap_or(0.0),
                        third,
                    };
                    cells.push(
                        there
                            .map(flight_cell)
                            .or_else(|| tunnel_cell(&clamped, name, &condition))?,
                    );
                }
            }
        }
        let unit = self.buildup.unit_of(name)?.name().to_owned();
        (!cells.is_empty()).then_some(DerivativeTable {
            derivative: name.to_owned(),
            unit,
            alphas_deg,
            machs,
            thirds,
            cells,
        })
    }

    /// Ranges of Mach number and third variable of the maneuvers behind a derivative's trend.
    fn flown(&self, name: &str) -> Option<FlownRange> {
        let group = self.groups.group_of(name)?;
        let estimates = self
            .estimates
            .iter()
            .filter(|e| e.derivative == name && e.value.is_some() && group.has(&e.class));
        let ids: BTreeSet<&str> = estimates.map(|e| e.maneuver_id.as_str()).collect();
        let maneuvers = || {
            self.maneuvers
                .iter()
                .filter(|m| ids.contains(m.maneuver_id.as_str()))
        };
        let third = range(maneuvers().filter_map(|m| m.condition(self.tunnel).third));
        Some(FlownRange {
            mach: range(maneuvers().map(|m| m.mach))?,
            third,
        })
    }
}

impl FlownRange {
    fn contains(&self, mach: Option<f64>, third: Option<f64>) -> bool {
        let inside = |value: Option<f64>, range: Option<(f64, f64)>| match (value, range) {
            (Some(value), Some((low, high))) => (low..=high).contains(&value),
            _ => true,
        };
        inside(mach, Some(self.mach)) && inside(third, self.third)
    }
}

fn flight_cell(t: &TrendRow) -> GridCell {
    let uncertainty = Some(t.standard_error).filter(|e| e.is_finite());
    GridCell {
        value: t.value,
        uncertainty,
        is_flight: true,
        source: format!("flight, trend of {}", t.group),
    }
}

fn tunnel_cell(tunnel: &WindTunnel, name: &str, condition: &Condition) -> Option<GridCell> {
    let read = tunnel.at(name, condition)?;
    let source = tunnel
        .source_of(name)
        .map_or_else(|| "wind tunnel".to_owned(), |s| format!("wind tunnel: {s}"));
    Some(GridCell {
        value: read.value,
        uncertainty: read.uncertainty,
        is_flight: false,
        source,
    })
}

/// Ranges of Mach number and third variable at which a derivative was flown.
struct FlownRange {
    mach: (f64, f64),
    third: Option<(f64, f64)>,
}

/// Both sets of breakpoints, ascending, each once.
fn union(own: Vec<f64>, others: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all = own;
    for other in others {
        if !all.iter().any(|own| is_same_breakpoint(*own, other)) {
            all.push(other);
        }
    }
    all.sort_by(f64::total_cmp);
    all
}

fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let finite: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    let low = finite.iter().copied().reduce(f64::min)?;
    Some((low, finite.iter().copied().reduce(f64::max)?))
}
