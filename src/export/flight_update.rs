//! Tables of the export: the posterior, and the tunnel where it has no row.

use super::export_contents::ExportContents;
use super::export_table::{ExportTable, GridCell, is_same_breakpoint};
use crate::aero::Condition;
use crate::aero::wind_tunnel::each_or_none;
use crate::tables::PosteriorRow;

/// Share of the information from flight above which a value counts as flight's, percent.
const MOSTLY: f64 = 50.0;

/// Tables of all derivatives and combined sums that have a value anywhere, in the order of the
/// model.
#[must_use]
pub fn tables(contents: &ExportContents) -> Vec<ExportTable> {
    let derivatives = contents.aero_model.derivatives.iter().map(|d| &d.name);
    let names = derivatives.chain(contents.aero_model.combined.iter().map(|c| &c.name));
    names.filter_map(|name| contents.table(name)).collect()
}

impl ExportContents<'_> {
    fn table(&self, name: &str) -> Option<ExportTable> {
        let rows = self.posterior.iter().filter(|row| row.derivative == name);
        let rows: Vec<&PosteriorRow> = rows.collect();
        if rows.is_empty() {
            self.of_tunnel(name)
        } else {
            Some(of_posterior(&rows))
        }
    }

    /// Table of the tunnel over its own breakpoints; `None` without one.
    fn of_tunnel(&self, name: &str) -> Option<ExportTable> {
        let tunnel = self.tunnel.clamped();
        let (alphas_deg, machs) = (tunnel.alphas_deg(name), tunnel.machs(name));
        let thirds = tunnel.thirds(name);
        let source = tunnel.source_of(name);
        let source =
            source.map_or_else(|| "wind tunnel".to_owned(), |s| format!("wind tunnel: {s}"));
        let mut cells = Vec::new();
        for third in each_or_none(&thirds) {
            for mach in each_or_none(&machs) {
                for &alpha_deg in &alphas_deg {
                    let mach = mach.unwrap_or(0.0);
                    let read = tunnel.at(
                        name,
                        &Condition {
                            alpha_deg,
                            mach,
                            third,
                        },
                    )?;
                    cells.push(GridCell {
                        value: read.value,
                        uncertainty: read.uncertainty,
                        is_flight: false,
                        source: source.clone(),
                    });
                }
            }
        }
        (!cells.is_empty()).then_some(ExportTable {
            derivative: name.to_owned(),
            unit: self.aero_model.unit_of(name)?.name().to_owned(),
            alphas_deg,
            machs,
            thirds,
            cells,
        })
    }
}

/// Table of the posterior's rows of one derivative, which are in the order of the cells.
fn of_posterior(rows: &[&PosteriorRow]) -> ExportTable {
    let first = rows[0];
    ExportTable {
        derivative: first.derivative.clone(),
        unit: first.unit.clone(),
        alphas_deg: breakpoints(rows.iter().map(|row| row.alpha_deg)),
        machs: breakpoints(rows.iter().filter_map(|row| row.mach)),
        thirds: breakpoints(rows.iter().filter_map(|row| row.third)),
        cells: rows.iter().map(|row| cell(row)).collect(),
    }
}

fn cell(row: &PosteriorRow) -> GridCell {
    let is_flight = row.flight_share_pct.is_some_and(|share| share >= MOSTLY);
    let source = match (row.wind_tunnel, is_flight) {
        (None, _) => "posterior: flight alone",
        (_, true) => "posterior: mostly flight",
        (_, false) => "posterior: mostly wind tunnel",
    };
    GridCell {
        value: row.value,
        uncertainty: Some(row.standard_deviation),
        is_flight,
        source: source.to_owned(),
    }
}

/// Distinct values, ascending.
fn breakpoints(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all.dedup_by(|a, b| is_same_breakpoint(*a, *b));
    all
}
