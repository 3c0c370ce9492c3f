//! Entries of the tables: tabulated values with the variables at which they stand.

use serde::{Deserialize, Serialize};

/// One tabulated value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TunnelPoint {
    pub alpha_deg: f64,
    /// `None` for a table that does not depend on Mach.
    pub mach: Option<f64>,
    pub value: f64,
    /// Standard uncertainty of the value, where the database states one.
    pub uncertainty: Option<f64>,
    /// Source of the value, where the database states one.
    pub source: Option<String>,
}

impl TunnelPoint {
    /// Value of a table that depends on α alone, without uncertainty or source.
    #[must_use]
    pub fn new(alpha_deg: f64, value: f64) -> TunnelPoint {
        TunnelPoint {
            alpha_deg,
            mach: None,
            value,
            uncertainty: None,
            source: None,
        }
    }
}

/// Each value of a breakpoint's list, or a single `None` for a table without that variable.
#[must_use]
pub fn each_or_none(values: &[f64]) -> Vec<Option<f64>> {
    if values.is_empty() {
        vec![None]
    } else {
        values.iter().copied().map(Some).collect()
    }
}

/// A value read from the tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TunnelValue {
    pub value: f64,
    pub uncertainty: Option<f64>,
}

/// A point with its third variable, `None` for a table that does not depend on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Entry {
    pub third: Option<f64>,
    pub point: TunnelPoint,
}

impl Entry {
    /// Sort key within a table: third variable, Mach, α.
    pub fn place(&self) -> (f64, f64, f64) {
        (
            self.third.unwrap_or(0.0),
            self.point.mach.unwrap_or(0.0),
            self.point.alpha_deg,
        )
    }

    pub fn value(&self) -> TunnelValue {
        TunnelValue {
            value: self.point.value,
            uncertainty: self.point.uncertainty,
        }
    }
}

/// Rows of a block, one for each Mach number.
pub(super) fn rows_of_mach(block: &[Entry]) -> Vec<&[Entry]> {
    block
        .chunk_by(|a, b| a.point.mach == b.point.mach)
        .collect()
}

/// Distinct values of a variable, ascending.
pub(super) fn breakpoints(table: &[Entry], of: impl Fn(&Entry) -> Option<f64>) -> Vec<f64> {
    let mut values: Vec<f64> = table.iter().filter_map(of).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}
