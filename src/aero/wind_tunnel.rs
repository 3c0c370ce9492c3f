//! The wind-tunnel database: derivatives tabulated over angle of attack and, where the tunnel has
//! them, Mach number and a third variable.
//!
//! A table is read along α at the Mach numbers and third values on either side, then across Mach,
//! then across the third variable, linearly or by a monotone cubic ([`super::interpolation`]).
//! Beyond its ends a table has the value at the end (clamped) or none (refused), by the settings;
//! [`WindTunnel::extrapolations`] lists such readings.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::interpolation::{Interpolation, interval_at, linear, monotone};
use crate::settings::{settings, single_values};

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

/// Flight condition at which the tables are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    pub alpha_deg: f64,
    pub mach: f64,
    /// Third variable; `None` where unknown, and [`Third::at`] is used.
    pub third: Option<f64>,
}

settings! {
    /// Reading of the wind-tunnel tables.
    pub struct Settings {
        /// Interpolation between the tabulated points: `linear`, or `monotone_cubic` (Fritsch and
        /// Carlson), which is smooth and does not overshoot. It changes every value read between
        /// points.
        pub interpolation: Interpolation = Interpolation::default(),
        /// Reading beyond the ends of a table: `clamp` takes the value at the end, `refuse` gives no
        /// value. With `refuse` maneuvers that hold a derivative there are rejected.
        pub extrapolation: Extrapolation = Extrapolation::default(),
        /// Variable of the tables besides alpha and Mach number, where they have one.
        pub third: Option<Third> = None,
    }
}

/// Reading of a table beyond its ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Extrapolation {
    /// The value at the end.
    #[default]
    Clamp,
    /// No value.
    Refuse,
}

single_values!(Interpolation, Extrapolation);

settings! {
    /// Third variable of the tables.
    pub struct Third {
        /// Its column in CSV and Parquet, its variable in DAVE-ML. A mean flight condition of the
        /// maneuvers (`altitude_ft`, `qbar_psf`, `velocity_ft_s`, `mass_slug`, `x_cg_ft`) is read at
        /// each maneuver's own value.
        pub name: String,
        /// Value at which the tables are read where the maneuver has none, in the variable's unit.
        pub at: f64,
    }
}

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

/// A point with its third variable, `None` for a table that does not depend on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Entry {
    third: Option<f64>,
    point: TunnelPoint,
}

/// Tables by derivative name. Names are compared without underscores, so that a database may write
/// `CNalpha`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WindTunnel {
    /// Entries sorted by the third variable, then Mach, then α.
    tables: BTreeMap<String, Vec<Entry>>,
    settings: Settings,
}

/// Name of a derivative as databases are searched for it: without underscores.
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

    /// The same tables, constant beyond their ends.
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

    /// Takes another database's table of a derivative in place of its own; where the other has none, its
    /// own stays.
    pub fn take_table(&mut self, derivative: &str, other: &WindTunnel) {
        let key = key(derivative);
        if let Some(table) = other.tables.get(&key) {
            self.tables.insert(key, table.clone());
        }
    }

    fn table(&self, derivative: &str) -> &[Entry] {
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

    /// The value at an angle of attack and Mach number, at the settings' third variable.
    #[must_use]
    pub fn value(&self, derivative: &str, alpha_deg: f64, mach: f64) -> Option<TunnelValue> {
        self.at(
            derivative,
            &Condition {
                alpha_deg,
                mach,
                third: None,
            },
        )
    }

    /// Value at a flight condition; `None` without a table, or where extrapolation is needed and
    /// refused.
    #[must_use]
    pub fn at(&self, derivative: &str, condition: &Condition) -> Option<TunnelValue> {
        self.reader(derivative)?.at(condition)
    }

    /// Table of a derivative, for many readings; `None` without one.
    #[must_use]
    pub fn reader(&self, derivative: &str) -> Option<TableReader<'_>> {
        let (derivative, table) = self.tables.get_key_value(&key(derivative))?;
        let blocks = table.chunk_by(|a, b| a.third == b.third);
        Some(TableReader {
            tunnel: self,
            derivative,
            blocks: blocks.map(rows_of_mach).collect(),
        })
    }

    fn third_at(&self, condition: &Condition) -> f64 {
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
        let mut beyond = Vec::new();
        let mut note = |variable: &str, read_at: f64, (from, to): (f64, f64)| {
            let known = beyond
                .iter()
                .any(|b: &ExtrapolatedReading| b.variable == variable);
            if !known && !(from..=to).contains(&read_at) {
                beyond.push(ExtrapolatedReading {
                    variable: variable.to_owned(),
                    read_at,
                    from,
                    to,
                });
            }
        };
        let thirds = breakpoints(table, |e| e.third);
        if let (Some(range), Some(name)) = (
            ends(&thirds),
            self.settings.third.as_ref().map(|t| t.name.as_str()),
        ) {
            note(name, third, range);
        }
        let blocks: Vec<&[Entry]> = table.chunk_by(|a, b| a.third == b.third).collect();
        for block in either_side(&blocks, |b| b[0].third.unwrap_or(0.0), third) {
            if let Some(range) = ends(&breakpoints(block, |e| e.point.mach)) {
                note("mach", condition.mach, range);
            }
            let rows = rows_of_mach(block);
            for row in either_side(&rows, |r| r[0].point.mach.unwrap_or(0.0), condition.mach) {
                if let Some(range) = ends(&breakpoints(row, |e| Some(e.point.alpha_deg))) {
                    note("alpha_deg", condition.alpha_deg, range);
                }
            }
        }
        beyond
    }
}

impl Entry {
    fn place(&self) -> (f64, f64, f64) {
        (
            self.third.unwrap_or(0.0),
            self.point.mach.unwrap_or(0.0),
            self.point.alpha_deg,
        )
    }

    fn value(&self) -> TunnelValue {
        TunnelValue {
            value: self.point.value,
            uncertainty: self.point.uncertainty,
        }
    }
}

/// Table of one derivative: blocks of the third variable, in them rows of Mach, in them α.
#[derive(Clone, Debug)]
pub struct TableReader<'a> {
    tunnel: &'a WindTunnel,
    derivative: &'a str,
    blocks: Vec<Vec<&'a [Entry]>>,
}

impl TableReader<'_> {
    /// Value at a flight condition; `None` where extrapolation is needed and refused.
    #[must_use]
    pub fn at(&self, condition: &Condition) -> Option<TunnelValue> {
        let (tunnel, blocks) = (self.tunnel, &self.blocks);
        let refused = tunnel.settings.extrapolation == Extrapolation::Refuse;
        if refused && !tunnel.extrapolations(self.derivative, condition).is_empty() {
            return None;
        }
        let scheme = tunnel.settings.interpolation;
        let third = |i: usize| blocks[i][0][0].third.unwrap_or(0.0);
        let across_mach = |i: usize| {
            let rows = &blocks[i];
            let mach = |j: usize| rows[j][0].point.mach.unwrap_or(0.0);
            let along_alpha = |j: usize| {
                let row = rows[j];
                let alpha = |k: usize| row[k].point.alpha_deg;
                interpolated(
                    row.len(),
                    alpha,
                    |k| row[k].value(),
                    condition.alpha_deg,
                    scheme,
                )
            };
            interpolated(rows.len(), mach, along_alpha, condition.mach, scheme)
        };
        Some(interpolated(
            blocks.len(),
            third,
            across_mach,
            tunnel.third_at(condition),
            scheme,
        ))
    }
}

fn rows_of_mach(block: &[Entry]) -> Vec<&[Entry]> {
    block
        .chunk_by(|a, b| a.point.mach == b.point.mach)
        .collect()
}

/// Distinct values of a variable, ascending.
fn breakpoints(table: &[Entry], of: impl Fn(&Entry) -> Option<f64>) -> Vec<f64> {
    let mut values: Vec<f64> = table.iter().filter_map(of).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
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

/// Value interpolated along one variable. Uncertainties are interpolated linearly in any case.
fn interpolated(
    n: usize,
    x_of: impl Fn(usize) -> f64,
    value_of: impl Fn(usize) -> TunnelValue,
    x: f64,
    scheme: Interpolation,
) -> TunnelValue {
    let (low, fraction) = interval_at(n, &x_of, x);
    let high = (low + 1).min(n.saturating_sub(1));
    let (a, b) = (value_of(low), value_of(high));
    let value = match scheme {
        Interpolation::Linear => linear(a.value, b.value, fraction),
        Interpolation::MonotoneCubic => monotone(n, low, fraction, &x_of, |i| value_of(i).value),
    };
    TunnelValue {
        value,
        uncertainty: a
            .uncertainty
            .zip(b.uncertainty)
            .map(|(u, v)| linear(u, v, fraction)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn tunnel(points: &[(f64, Option<f64>, f64)]) -> WindTunnel {
        let mut tunnel = WindTunnel::default();
        for &(alpha_deg, mach, value) in points {
            tunnel.insert(
                "CN_alpha",
                TunnelPoint {
                    mach,
                    ..TunnelPoint::new(alpha_deg, value)
                },
            );
        }
        tunnel
    }

    fn value(tunnel: &WindTunnel, alpha_deg: f64, mach: f64) -> f64 {
        tunnel
            .value("CNalpha", alpha_deg, mach)
            .expect("tabulated")
            .value
    }

    #[test]
    fn a_table_is_linear_between_its_points_and_constant_beyond() {
        let t = tunnel(&[(20.0, None, 3.0), (10.0, None, 1.0), (30.0, None, 2.0)]);
        for (alpha, expected) in [
            (10.0, 1.0),
            (12.5, 1.5),
            (20.0, 3.0),
            (25.0, 2.5),
            (30.0, 2.0),
            (5.0, 1.0),
            (60.0, 2.0),
        ] {
            assert_relative_eq!(value(&t, alpha, 0.3), expected);
        }
    }

    #[test]
    fn mach_is_interpolated_where_the_tables_have_it() {
        let t = tunnel(&[
            (10.0, Some(0.2), 1.0),
            (20.0, Some(0.2), 2.0),
            (10.0, Some(0.6), 3.0),
            (20.0, Some(0.6), 6.0),
        ]);
        assert_relative_eq!(value(&t, 15.0, 0.2), 1.5);
        assert_relative_eq!(value(&t, 15.0, 0.4), 3.0);
        assert_relative_eq!(value(&t, 20.0, 0.5), 5.0);
        assert_relative_eq!(value(&t, 20.0, 0.9), 6.0);
        assert_relative_eq!(value(&t, 20.0, 0.1), 2.0);
    }

    #[test]
    fn an_unknown_derivative_has_no_value() {
        assert_eq!(tunnel(&[(10.0, None, 1.0)]).value("CN_q", 10.0, 0.3), None);
    }

    fn points() -> Vec<(f64, Option<f64>, f64)> {
        let mach = [0.2, 0.6];
        mach.iter()
            .flat_map(|&m| {
                (0..4).map(move |k| (10.0 * f64::from(k), Some(m), f64::from(k * k) + m))
            })
            .collect()
    }

    #[test]
    fn a_third_variable_is_interpolated_and_read_at_its_setting_where_it_is_not_known() {
        let third = Some(Third {
            name: "altitude_ft".into(),
            at: 20e3,
        });
        let mut t = WindTunnel::new(Settings {
            third,
            ..Settings::default()
        });
        for (altitude, factor) in [(10e3, 1.0), (30e3, 3.0)] {
            for (alpha_deg, mach, value) in points() {
                let point = TunnelPoint {
                    mach,
                    ..TunnelPoint::new(alpha_deg, factor * value)
                };
                t.insert_at("CN_alpha", Some(altitude), point);
            }
        }
        let at = |third: Option<f64>| {
            t.at(
                "CN_alpha",
                &Condition {
                    alpha_deg: 15.0,
                    mach: 0.4,
                    third,
                },
            )
            .expect("tabulated")
            .value
        };
        // (1 + 4)/2 + 0.4 at the first altitude.
        assert_relative_eq!(at(Some(10e3)), 2.9, max_relative = 1e-14);
        assert_relative_eq!(at(Some(25e3)), 2.5 * 2.9, max_relative = 1e-14);
        assert_relative_eq!(at(None), 2.0 * 2.9, max_relative = 1e-14);
        assert_eq!(t.thirds("CN_alpha"), [10e3, 30e3]);
        assert_eq!(t.machs("CN_alpha"), [0.2, 0.6]);
    }

    #[test]
    fn a_monotone_cubic_runs_through_the_points_and_differs_between_them() {
        let mut cubic = WindTunnel::new(Settings {
            interpolation: Interpolation::MonotoneCubic,
            ..Settings::default()
        });
        let straight = tunnel(&points());
        for (alpha_deg, mach, value) in points() {
            cubic.insert(
                "CN_alpha",
                TunnelPoint {
                    mach,
                    ..TunnelPoint::new(alpha_deg, value)
                },
            );
        }
        for (alpha, mach, v) in points() {
            assert_relative_eq!(
                value(&cubic, alpha, mach.expect("mach")),
                v,
                max_relative = 1e-14
            );
        }
        // Closed form for k² at unit spacing between 1 and 2: chords 1, 3, 5 have the slopes 1.5
        // and 3.75.
        let expected = 0.5 * (1.0 + 4.0) + (1.5 - 3.75) / 8.0 + 0.2;
        assert_relative_eq!(value(&cubic, 15.0, 0.2), expected, max_relative = 1e-14);
        assert!((value(&straight, 15.0, 0.2) - expected).abs() > 0.1);
    }

    #[test]
    fn beyond_the_ends_it_is_clamped_or_refused_and_says_so() {
        let clamped = tunnel(&points());
        let mut refusing = WindTunnel::new(Settings {
            extrapolation: Extrapolation::Refuse,
            ..Settings::default()
        });
        for (alpha_deg, mach, value) in points() {
            refusing.insert(
                "CN_alpha",
                TunnelPoint {
                    mach,
                    ..TunnelPoint::new(alpha_deg, value)
                },
            );
        }
        let beyond = Condition {
            alpha_deg: 31.0,
            mach: 0.7,
            third: None,
        };
        assert_relative_eq!(clamped.at("CN_alpha", &beyond).expect("clamped").value, 9.6);
        assert_eq!(refusing.at("CN_alpha", &beyond), None);
        let named = |variable: &str, read_at, from, to| ExtrapolatedReading {
            variable: variable.into(),
            read_at,
            from,
            to,
        };
        let both = [
            named("mach", 0.7, 0.2, 0.6),
            named("alpha_deg", 31.0, 0.0, 30.0),
        ];
        assert_eq!(refusing.extrapolations("CN_alpha", &beyond), both);
        let inside = Condition {
            alpha_deg: 30.0,
            mach: 0.2,
            third: None,
        };
        assert_eq!(refusing.extrapolations("CN_alpha", &inside), []);
        assert_eq!(
            refusing.at("CN_alpha", &inside),
            clamped.at("CN_alpha", &inside)
        );
    }

    #[test]
    fn a_shorter_row_at_one_mach_ends_where_it_ends() {
        let t = tunnel(&[
            (0.0, Some(0.2), 0.0),
            (30.0, Some(0.2), 3.0),
            (0.0, Some(0.6), 0.0),
            (10.0, Some(0.6), 1.0),
        ]);
        let at = |alpha_deg, mach| {
            t.extrapolations(
                "CN_alpha",
                &Condition {
                    alpha_deg,
                    mach,
                    third: None,
                },
            )
        };
        assert_eq!(at(20.0, 0.2), []);
        assert_eq!(
            at(20.0, 0.3),
            [ExtrapolatedReading {
                variable: "alpha_deg".into(),
                read_at: 20.0,
                from: 0.0,
                to: 10.0
            }]
        );
    }
}
