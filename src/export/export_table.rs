//! One derivative over the grid of the export.

use crate::aero::Condition;
use crate::aero::wind_tunnel::each_or_none;
use crate::tables::{DrawRow, ExportRow};

/// One derivative over the grid of angle of attack, Mach number and third variable.
#[derive(Clone, Debug, PartialEq)]
pub struct ExportTable {
    pub derivative: String,
    pub unit: String,
    pub alphas_deg: Vec<f64>,
    /// Empty for a derivative that does not depend on Mach.
    pub machs: Vec<f64>,
    /// Values of the third variable; empty for a derivative that does not depend on it.
    pub thirds: Vec<f64>,
    /// One cell per point of the grid: α varies fastest, then Mach.
    pub cells: Vec<GridCell>,
}

/// One value of a table, with its source.
#[derive(Clone, Debug, PartialEq)]
pub struct GridCell {
    pub value: f64,
    /// Standard uncertainty, where known.
    pub uncertainty: Option<f64>,
    pub is_flight: bool,
    pub source: String,
}

/// `true` for breakpoints that are equal but for rounding.
pub(super) fn is_same_breakpoint(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-6
}

impl ExportTable {
    /// Points of the grid with their cells, in the order of the cells.
    pub fn points(&self) -> impl Iterator<Item = (Condition, &GridCell)> {
        let places = each_or_none(&self.thirds)
            .into_iter()
            .flat_map(move |third| {
                let machs = each_or_none(&self.machs).into_iter();
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

    /// Ranges of α by source: `posterior: mostly flight: 10° to 40°; wind tunnel: 5°`.
    ///
    /// For a table over Mach numbers, the ranges are those at a flown Mach number.
    #[must_use]
    pub fn sources(&self) -> String {
        let n = self.alphas_deg.len();
        let flights = |row: &&[GridCell]| row.iter().filter(|c| c.is_flight).count();
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

/// Rows of one draw's tables.
#[must_use]
pub fn draw_rows(draw: usize, tables: &[ExportTable]) -> Vec<DrawRow> {
    let row = |row: ExportRow| DrawRow {
        draw,
        derivative: row.derivative,
        alpha_deg: row.alpha_deg,
        mach: row.mach,
        third: row.third,
        value: row.value,
        unit: row.unit,
    };
    rows(tables).into_iter().map(row).collect()
}

/// Rows of the tables, in the columns of a wind-tunnel database.
#[must_use]
pub fn rows(tables: &[ExportTable]) -> Vec<ExportRow> {
    let row = |table: &ExportTable, at: Condition, cell: &GridCell| ExportRow {
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
