//! Export writes the flight-updated derivatives for simulators: the trend where there is data, the
//! tunnel elsewhere, each value marked with its source; as rows (CSV, Parquet), as DAVE-ML and as a
//! JSBSim aerodynamics section.
//!
//! A derivative's breakpoints are those of the tunnel and of the trend together. Flight was flown
//! at some Mach numbers only: where the tunnel depends on Mach (or a third variable), the lowest
//! and the highest flown are breakpoints too, flight's value stands between them, and the tunnel's
//! beyond. The constants of sums are exported so that the sums (`CN_ba = CN_0 + CN_alpha α`), which
//! flight tells best, come out as flown.

pub mod daveml;
pub mod jsbsim;
#[cfg(test)]
mod tests;
mod xml;

use std::collections::BTreeMap;

use crate::aero::wind_tunnel::TunnelPoint;
use crate::aero::{
    Buildup, Coefficient, Combined, Condition, Derivative, Regressor, WindTunnel, wind_tunnel,
};
use crate::aircraft::Aircraft;
use crate::maneuver::Maneuver;
use crate::settings::settings;
use crate::tables::{EstimateRow, ExportRow, TrendRow};
use crate::trend;

settings! {
    /// Settings of the export.
    pub struct Settings {
        /// Author of the model in the DAVE-ML file, which requires one.
        pub author: String = "not stated".into(),
        /// Organisation of the author.
        pub organisation: String = "not stated".into(),
        /// Date of the model in the DAVE-ML file, ISO 8601: `2026-11-21`. No clock sets it, so that
        /// the same input gives the same bytes.
        pub date: String = "not stated".into(),
        /// JSBSim's property for a signal of model.yaml, in the signal's unit and sign. Signals that
        /// are not named read `harvest/<signal>`.
        pub jsbsim_properties: BTreeMap<String, String> = BTreeMap::new(),
    }
}

/// All that an export is made from.
#[derive(Clone, Copy, Debug)]
pub struct Contents<'a> {
    pub title: &'a str,
    pub aircraft: &'a Aircraft,
    pub buildup: &'a Buildup,
    pub tunnel: &'a WindTunnel,
    pub trends: &'a [TrendRow],
    /// Of converged maneuvers: they say where was flown.
    pub estimates: &'a [EstimateRow],
    pub maneuvers: &'a [Maneuver],
    pub groups: &'a trend::Settings,
    pub settings: &'a Settings,
}

/// One derivative over its grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub derivative: String,
    pub unit: String,
    pub alphas_deg: Vec<f64>,
    /// Empty for a derivative that does not depend on Mach.
    pub machs: Vec<f64>,
    /// Of the third variable; empty for a derivative that does not depend on it.
    pub thirds: Vec<f64>,
    /// α varies fastest, then Mach.
    pub cells: Vec<Cell>,
}

/// One value of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    pub value: f64,
    /// Standard uncertainty, where it is known.
    pub uncertainty: Option<f64>,
    pub is_flight: bool,
    pub source: String,
}

/// Where a derivative was flown: the ranges of Mach and of the third variable.
struct Flown {
    mach: (f64, f64),
    third: Option<(f64, f64)>,
}

/// The tables of all derivatives and combined sums that have a value anywhere, in the order of the
/// model.
#[must_use]
pub fn tables(contents: &Contents) -> Vec<Table> {
    let derivatives = contents.buildup.derivatives.iter().map(|d| &d.name);
    let names = derivatives.chain(contents.buildup.combined.iter().map(|c| &c.name));
    let mut tables: Vec<Table> = names.filter_map(|name| contents.table(name)).collect();
    contents
        .buildup
        .combined
        .iter()
        .for_each(|sum| keep_sum(&mut tables, sum));
    tables
}

/// Where flight has the sum of a constant and a slope, the constant is what makes the exported sum
/// come out: the data tell the sum well and its parts, strongly correlated, badly; trends through
/// each part on its own would not add up to it.
fn keep_sum(tables: &mut [Table], sum: &Combined) {
    let named = |name: &str| tables.iter().find(|t| t.derivative == name);
    let (Some(whole), Some(slope), Some(constant)) =
        (named(&sum.name), named(&sum.slope), named(&sum.constant))
    else {
        return;
    };
    let kept = |(at, cell): (Condition, &Cell)| {
        let whole = whole.cell(&at).filter(|c| c.is_flight)?;
        let slope = slope.cell(&at).filter(|c| c.is_flight)?;
        let uncertainty = |whole: f64, slope: f64| whole.hypot(slope * at.alpha_deg);
        let source = format!("flight, {} − {} α", sum.name, sum.slope);
        let value = whole.value - slope.value * at.alpha_deg;
        let uncertainty = whole
            .uncertainty
            .zip(slope.uncertainty)
            .map(|(w, s)| uncertainty(w, s));
        cell.is_flight.then_some(Cell {
            value,
            uncertainty,
            is_flight: true,
            source,
        })
    };
    let kept: Vec<Option<Cell>> = constant.points().map(kept).collect();
    if let Some(constant) = tables.iter_mut().find(|t| t.derivative == sum.constant) {
        let replaced = constant.cells.iter_mut().zip(kept);
        replaced
            .filter_map(|(cell, kept)| Some((cell, kept?)))
            .for_each(|(cell, kept)| *cell = kept);
    }
}

impl Contents<'_> {
    fn table(&self, name: &str) -> Option<Table> {
        let group = self.groups.group_of(name);
        let speaks =
            |t: &&TrendRow| t.derivative == name && group.is_some_and(|g| g.name == t.group);
        let trend: Vec<&TrendRow> = self.trends.iter().filter(speaks).collect();
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
        for third in each(&thirds) {
            for mach in each(&machs) {
                for &alpha_deg in &alphas_deg {
                    let there = trend.iter().copied().find(|t| same(t.alpha_deg, alpha_deg));
                    let there =
                        there.filter(|_| flown.as_ref().is_none_or(|f| f.holds(mach, third)));
                    let condition = Condition {
                        alpha_deg,
                        mach: mach.unwrap_or(0.0),
                        third,
                    };
                    cells.push(
                        there
                            .map(of_flight)
                            .or_else(|| of_tunnel(&clamped, name, &condition))?,
                    );
                }
            }
        }
        let unit = self.buildup.unit_of(name)?.name().to_owned();
        (!cells.is_empty()).then_some(Table {
            derivative: name.to_owned(),
            unit,
            alphas_deg,
            machs,
            thirds,
            cells,
        })
    }

    /// Between which Mach numbers and third values the maneuvers flew that speak for a derivative.
    fn flown(&self, name: &str) -> Option<Flown> {
        let group = self.groups.group_of(name)?;
        let estimates = self
            .estimates
            .iter()
            .filter(|e| e.derivative == name && e.value.is_some() && group.has(&e.class));
        let ids: std::collections::BTreeSet<&str> =
            estimates.map(|e| e.maneuver_id.as_str()).collect();
        let maneuvers = || {
            self.maneuvers
                .iter()
                .filter(|m| ids.contains(m.maneuver_id.as_str()))
        };
        let third = range(maneuvers().filter_map(|m| m.condition(self.tunnel).third));
        Some(Flown {
            mach: range(maneuvers().map(|m| m.mach))?,
            third,
        })
    }
}

impl Flown {
    fn holds(&self, mach: Option<f64>, third: Option<f64>) -> bool {
        let inside = |value: Option<f64>, range: Option<(f64, f64)>| match (value, range) {
            (Some(value), Some((low, high))) => (low..=high).contains(&value),
            _ => true,
        };
        inside(mach, Some(self.mach)) && inside(third, self.third)
    }
}

fn of_flight(t: &TrendRow) -> Cell {
    let uncertainty = Some(t.standard_error).filter(|e| e.is_finite());
    Cell {
        value: t.value,
        uncertainty,
        is_flight: true,
        source: format!("flight, trend of {}", t.group),
    }
}

fn of_tunnel(tunnel: &WindTunnel, name: &str, condition: &Condition) -> Option<Cell> {
    let read = tunnel.at(name, condition)?;
    let source = tunnel
        .source_of(name)
        .map_or_else(|| "wind tunnel".to_owned(), |s| format!("wind tunnel: {s}"));
    Some(Cell {
        value: read.value,
        uncertainty: read.uncertainty,
        is_flight: false,
        source,
    })
}

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-6
}

/// Both ascending, each value once.
fn union(own: Vec<f64>, others: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all = own;
    for other in others {
        if !all.iter().any(|own| same(*own, other)) {
            all.push(other);
        }
    }
    all.sort_by(f64::total_cmp);
    all
}

/// Each value, or once none.
fn each(values: &[f64]) -> Vec<Option<f64>> {
    if values.is_empty() {
        vec![None]
    } else {
        values.iter().copied().map(Some).collect()
    }
}

fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let finite: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    let low = finite.iter().copied().reduce(f64::min)?;
    Some((low, finite.iter().copied().reduce(f64::max)?))
}

impl Table {
    /// The table's points with their cells, in the order of the cells.
    pub fn points(&self) -> impl Iterator<Item = (Condition, &Cell)> {
        let places = each(&self.thirds).into_iter().flat_map(move |third| {
            let machs = each(&self.machs).into_iter();
            machs.flat_map(move |mach| {
                self.alphas_deg
                    .iter()
                    .map(move |&alpha_deg| (third, mach, alpha_deg))
            })
        });
        let condition = |(third, mach, alpha_deg): (Option<f64>, Option<f64>, f64)| Condition {
            alpha_deg,
            mach: mach.unwrap_or(f64::NAN),
            third,
        };
        places.map(condition).zip(&self.cells)
    }

    /// The cell at one of the table's own points.
    fn cell(&self, at: &Condition) -> Option<&Cell> {
        let own = |a: f64, b: f64| same(a, b) || a.is_nan() || b.is_nan();
        let there = |(point, _): &(Condition, &Cell)| {
            let third = point.third.zip(at.third).is_none_or(|(a, b)| same(a, b));
            same(point.alpha_deg, at.alpha_deg) && own(point.mach, at.mach) && third
        };
        self.points().find(there).map(|(_, cell)| cell)
    }

    /// Where each source stands, in words: `flight, trend of all: 10° to 40°; wind tunnel: 5°, 45°
    /// to 60°`. Of a table over Mach numbers: at those that were flown.
    #[must_use]
    pub fn sources(&self) -> String {
        let n = self.alphas_deg.len();
        let flights = |row: &&[Cell]| row.iter().filter(|c| c.is_flight).count();
        let Some(row) = self.cells.chunks(n.max(1)).max_by_key(flights) else {
            return String::new();
        };
        let mut words: Vec<(String, Vec<String>)> = Vec::new();
        let mut done = 0;
        for run in row.chunk_by(|a, b| a.source == b.source) {
            let (from, to) = (self.alphas_deg[done], self.alphas_deg[done + run.len() - 1]);
            done += run.len();
            let span = if run.len() == 1 {
                format!("{from}°")
            } else {
                format!("{from}° to {to}°")
            };
            match words
                .iter_mut()
                .find(|(source, _)| *source == run[0].source)
            {
                Some((_, spans)) => spans.push(span),
                None => words.push((run[0].source.clone(), vec![span])),
            }
        }
        let words: Vec<String> = words
            .into_iter()
            .map(|(source, spans)| format!("{source}: {}", spans.join(", ")))
            .collect();
        words.join("; ")
    }
}

/// The tables as rows, which `wind_tunnel:` reads as a database again.
#[must_use]
pub fn rows(tables: &[Table]) -> Vec<ExportRow> {
    let row = |table: &Table, at: Condition, cell: &Cell| ExportRow {
        derivative: table.derivative.clone(),
        alpha_deg: at.alpha_deg,
        mach: Some(at.mach).filter(|_| !table.machs.is_empty()),
        third: at.third,
        value: cell.value,
        unit: table.unit.clone(),
        uncertainty: cell.uncertainty,
        source: cell.source.clone(),
        is_flight: usize::from(cell.is_flight),
    };
    tables
        .iter()
        .flat_map(|table| table.points().map(move |(at, cell)| row(table, at, cell)))
        .collect()
}

/// The tables as a database, read linearly and clamped, as simulators read them.
#[must_use]
pub fn database(tables: &[Table], settings: &wind_tunnel::Settings) -> WindTunnel {
    let mut database = WindTunnel::new(wind_tunnel::Settings {
        third: settings.third.clone(),
        ..Default::default()
    });
    for table in tables {
        for (at, cell) in table.points() {
            let point = TunnelPoint {
                alpha_deg: at.alpha_deg,
                mach: Some(at.mach).filter(|_| !table.machs.is_empty()),
                value: cell.value,
                uncertainty: cell.uncertainty,
                source: Some(cell.source.clone()),
            };
            database.insert_at(&table.derivative, at.third, point);
        }
    }
    database
}

/// The derivatives of one coefficient that have a table, with or without the vanes'.
fn terms<'a>(
    contents: &'a Contents,
    tables: &'a [Table],
    coefficient: Coefficient,
    vanes: bool,
) -> impl Iterator<Item = &'a Derivative> {
    contents.buildup.derivatives.iter().filter(move |d| {
        let is_vane = matches!(d.regressor, Regressor::Vane(_));
        d.coefficient == coefficient
            && is_vane == vanes
            && tables.iter().any(|t| t.derivative == d.name)
    })
}

/// All coefficients, forces first.
const COEFFICIENTS: [Coefficient; 6] = [
    Coefficient::CN,
    Coefficient::CA,
    Coefficient::CY,
    Coefficient::Cl,
    Coefficient::Cm,
    Coefficient::Cn,
];
