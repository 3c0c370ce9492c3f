//! Readings beyond the ends of a table.

use super::condition::Condition;
use super::database::WindTunnel;
use super::entries::{Entry, breakpoints, rows_of_mach};
use crate::aero::interpolation::interval_at;

/// A reading of a table beyond its ends.
#[derive(Clone, Debug, PartialEq)]
pub struct ExtrapolatedReading {
    /// `alpha_deg`, `mach`, or the third variable's name.
    pub variable: String,
    pub read_at: f64,
    /// Lower end of the table.
    pub from: f64,
    /// Upper end of the table.
    pub to: f64,
}

impl WindTunnel {
    /// Third variable at which the tables are read: the condition's, or else the value in the
    /// settings.
    pub(super) fn third_at(&self, condition: &Condition) -> f64 {
        condition
            .third
            .or(self.settings.third.as_ref().map(|t| t.at))
            .unwrap_or(0.0)
    }

    /// Variables in which a reading lies beyond a derivative's table.
    ///
    /// The ends are those of the rows on either side of the reading, which may differ in length.
    #[must_use]
    pub fn extrapolations(
        &self,
        derivative: &str,
        condition: &Condition,
    ) -> Vec<ExtrapolatedReading> {
        let table = self.table(derivative);
        let third = self.third_at(condition);
        let mut extrapolated: Vec<ExtrapolatedReading> = Vec::new();
        let mut compare = |variable: &str, read_at: f64, (from, to): (f64, f64)| {
            let is_listed = extrapolated.iter().any(|one| one.variable == variable);
            if !is_listed && !(from..=to).contains(&read_at) {
                extrapolated.push(ExtrapolatedReading {
                    variable: variable.to_owned(),
                    read_at,
                    from,
                    to,
                });
            }
        };
        let thirds = breakpoints(table, |e| e.third);
        if let (Some(range), Some(variable)) = (ends(&thirds), &self.settings.third) {
            compare(&variable.name, third, range);
        }
        let blocks: Vec<&[Entry]> = table.chunk_by(|a, b| a.third == b.third).collect();
        for block in either_side(&blocks, |b| b[0].third.unwrap_or(0.0), third) {
            if let Some(range) = ends(&breakpoints(block, |e| e.point.mach)) {
                compare("mach", condition.mach, range);
            }
            let rows = rows_of_mach(block);
            for row in either_side(&rows, |r| r[0].point.mach.unwrap_or(0.0), condition.mach) {
                if let Some(range) = ends(&breakpoints(row, |e| Some(e.point.alpha_deg))) {
                    compare("alpha_deg", condition.alpha_deg, range);
                }
            }
        }
        extrapolated
    }
}

fn ends(ascending: &[f64]) -> Option<(f64, f64)> {
    Some((*ascending.first()?, *ascending.last()?))
}

/// Items on either side of `x`; a single one where `x` is at an item or beyond the ends.
fn either_side<T>(items: &[T], x_of: impl Fn(&T) -> f64, x: f64) -> &[T] {
    if items.is_empty() {
        return items;
    }
    let (low, fraction) = interval_at(items.len(), |i| x_of(&items[i]), x);
    let high = (low + 1).min(items.len() - 1);
    if fraction <= 0.0 {
        &items[low..=low]
    } else if fraction >= 1.0 {
        &items[high..=high]
    } else {
        &items[low..=high]
    }
}
