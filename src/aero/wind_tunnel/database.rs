//! The database: tables by derivative, with their breakpoints, sources and typical sizes.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::entries::{Entry, TunnelPoint, breakpoints};
use super::settings::{Extrapolation, Settings};

/// Tables by derivative name. Names are compared without underscores, so that a database may write
/// `CNalpha`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WindTunnel {
    /// Entries sorted by the third variable, then Mach, then α.
    pub(super) tables: BTreeMap<String, Vec<Entry>>,
    pub(super) settings: Settings,
}

/// Key of a derivative's table: its name without underscores.
#[must_use]
pub fn key(derivative: &str) -> String {
    derivative.replace('_', "")
}

impl WindTunnel {
    /// A database without tables yet, to be read by the settings.
    #[must_use]
    pub fn new(settings: Settings) -> WindTunnel {
        WindTunnel {
            tables: BTreeMap::new(),
            settings,
        }
    }

    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Copy of the tables that is constant beyond their ends.
    #[must_use]
    pub fn clamped(&self) -> WindTunnel {
        let settings = Settings {
            extrapolation: Extrapolation::Clamp,
            ..self.settings.clone()
        };
        WindTunnel {
            tables: self.tables.clone(),
            settings,
        }
    }

    /// Adds one point; points may come in any order.
    pub fn insert(&mut self, derivative: &str, point: TunnelPoint) {
        self.insert_at(derivative, None, point);
    }

    /// Adds one point at a value of the third variable; points may come in any order.
    pub fn insert_at(&mut self, derivative: &str, third: Option<f64>, point: TunnelPoint) {
        let entry = Entry { third, point };
        let table = self.tables.entry(key(derivative)).or_default();
        let at = table.partition_point(|e| e.place() < entry.place());
        table.insert(at, entry);
    }

    /// Replaces the table of a derivative by another database's; keeps its own if the other has
    /// none.
    pub fn take_table(&mut self, derivative: &str, other: &WindTunnel) {
        let key = key(derivative);
        if let Some(table) = other.tables.get(&key) {
            self.tables.insert(key, table.clone());
        }
    }

    /// Entries of a derivative's table; empty without a table.
    pub(super) fn table(&self, derivative: &str) -> &[Entry] {
        self.tables
            .get(&key(derivative))
            .map_or(&[][..], Vec::as_slice)
    }

    #[must_use]
    pub fn has(&self, derivative: &str) -> bool {
        self.tables.contains_key(&key(derivative))
    }

    /// Sources that the database states, each once, sorted.
    #[must_use]
    pub fn sources(&self) -> Vec<&str> {
        let mut sources: Vec<&str> = self
            .tables
            .values()
            .flatten()
            .filter_map(|e| e.point.source.as_deref())
            .collect();
        sources.sort_unstable();
        sources.dedup();
        sources
    }

    /// The source of a derivative's first value that states one.
    #[must_use]
    pub fn source_of(&self, derivative: &str) -> Option<&str> {
        self.table(derivative)
            .iter()
            .find_map(|e| e.point.source.as_deref())
    }

    /// The α at which a derivative is tabulated (at any Mach), ascending.
    #[must_use]
    pub fn alphas_deg(&self, derivative: &str) -> Vec<f64> {
        breakpoints(self.table(derivative), |e| Some(e.point.alpha_deg))
    }

    /// The Mach numbers at which a derivative is tabulated, ascending; empty for one that does not
    /// depend on Mach.
    #[must_use]
    pub fn machs(&self, derivative: &str) -> Vec<f64> {
        breakpoints(self.table(derivative), |e| e.point.mach)
    }

    /// The values of the third variable at which a derivative is tabulated, ascending; empty for
    /// one that does not depend on it.
    #[must_use]
    pub fn thirds(&self, derivative: &str) -> Vec<f64> {
        breakpoints(self.table(derivative), |e| e.third)
    }

    /// Root mean square of a derivative's tabulated values: its typical size. Zero for one without
    /// a table.
    #[must_use]
    pub fn root_mean_square(&self, derivative: &str) -> f64 {
        let table = self.table(derivative);
        let square: f64 = table.iter().map(|e| e.point.value * e.point.value).sum();
        (square / table.len().max(1) as f64).sqrt()
    }
}
