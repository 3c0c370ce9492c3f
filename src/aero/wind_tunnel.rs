//! The wind-tunnel database: derivatives tabulated over angle of attack and, where the tunnel has it, Mach number.

use std::collections::BTreeMap;

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
    /// Where the value comes from, where the database says.
    pub source: Option<String>,
}

/// A value read off the tables between their points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TunnelValue {
    pub value: f64,
    pub uncertainty: Option<f64>,
}

/// The tables, by derivative name. Names are compared without underscores, so a database may write `CNalpha`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WindTunnel {
    /// Points sorted by Mach, then α.
    tables: BTreeMap<String, Vec<TunnelPoint>>,
}

fn key(derivative: &str) -> String {
    derivative.chars().filter(|c| *c != '_').collect()
}

impl WindTunnel {
    /// Adds one point; points may come in any order.
    pub fn insert(&mut self, derivative: &str, point: TunnelPoint) {
        let table = self.tables.entry(key(derivative)).or_default();
        let place = |p: &TunnelPoint| (p.mach.unwrap_or(0.0), p.alpha_deg);
        let at = table.partition_point(|p| place(p) < place(&point));
        table.insert(at, point);
    }

    #[must_use]
    pub fn has(&self, derivative: &str) -> bool {
        self.tables.contains_key(&key(derivative))
    }

    /// Where the values come from, as far as the database says: every source once, sorted.
    #[must_use]
    pub fn sources(&self) -> Vec<&str> {
        let mut sources: Vec<&str> = self.tables.values().flatten().filter_map(|p| p.source.as_deref()).collect();
        sources.sort_unstable();
        sources.dedup();
        sources
    }

    /// The α at which a derivative is tabulated (at any Mach), ascending.
    #[must_use]
    pub fn alphas_deg(&self, derivative: &str) -> Vec<f64> {
        let mut alphas: Vec<f64> =
            self.tables.get(&key(derivative)).into_iter().flatten().map(|p| p.alpha_deg).collect();
        alphas.sort_by(f64::total_cmp);
        alphas.dedup();
        alphas
    }

    /// Root mean square of a derivative's tabulated values: its typical size. Zero for one without a table.
    #[must_use]
    pub fn root_mean_square(&self, derivative: &str) -> f64 {
        let table = self.tables.get(&key(derivative)).map_or(&[][..], Vec::as_slice);
        let square: f64 = table.iter().map(|p| p.value * p.value).sum();
        (square / table.len().max(1) as f64).sqrt()
    }

    /// The value at an angle of attack and Mach number: linear between the tabulated points, constant beyond the ends.
    #[must_use]
    pub fn value(&self, derivative: &str, alpha_deg: f64, mach: f64) -> Option<TunnelValue> {
        let table = self.tables.get(&key(derivative))?;
        let rows: Vec<&[TunnelPoint]> = table.chunk_by(|a, b| a.mach == b.mach).collect();
        let upper = rows.partition_point(|row| row[0].mach.unwrap_or(0.0) < mach).min(rows.len() - 1);
        let lower = upper.saturating_sub(usize::from(rows[upper][0].mach.unwrap_or(0.0) > mach));
        let (low, high) = (along_alpha(rows[lower], alpha_deg), along_alpha(rows[upper], alpha_deg));
        let (m0, m1) = (rows[lower][0].mach.unwrap_or(0.0), rows[upper][0].mach.unwrap_or(0.0));
        Some(between(low, high, fraction(m0, m1, mach)))
    }
}

fn along_alpha(row: &[TunnelPoint], alpha_deg: f64) -> TunnelValue {
    let upper = row.partition_point(|p| p.alpha_deg < alpha_deg).min(row.len() - 1);
    let lower = upper.saturating_sub(usize::from(row[upper].alpha_deg > alpha_deg));
    let at = |i: usize| TunnelValue { value: row[i].value, uncertainty: row[i].uncertainty };
    between(at(lower), at(upper), fraction(row[lower].alpha_deg, row[upper].alpha_deg, alpha_deg))
}

/// Where `x` lies from `a` (0) to `b` (1), kept inside; 0 where the two coincide.
fn fraction(a: f64, b: f64, x: f64) -> f64 {
    if b > a { ((x - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 }
}

fn between(a: TunnelValue, b: TunnelValue, f: f64) -> TunnelValue {
    let mix = |x: f64, y: f64| x + f * (y - x);
    TunnelValue { value: mix(a.value, b.value), uncertainty: a.uncertainty.zip(b.uncertainty).map(|(x, y)| mix(x, y)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn tunnel(points: &[(f64, Option<f64>, f64)]) -> WindTunnel {
        let mut tunnel = WindTunnel::default();
        for &(alpha_deg, mach, value) in points {
            tunnel.insert("CN_alpha", TunnelPoint { alpha_deg, mach, value, uncertainty: None, source: None });
        }
        tunnel
    }

    fn value(tunnel: &WindTunnel, alpha_deg: f64, mach: f64) -> f64 {
        tunnel.value("CNalpha", alpha_deg, mach).expect("tabulated").value
    }

    #[test]
    fn a_table_is_linear_between_its_points_and_constant_beyond() {
        let t = tunnel(&[(20.0, None, 3.0), (10.0, None, 1.0), (30.0, None, 2.0)]);
        for (alpha, expected) in
            [(10.0, 1.0), (12.5, 1.5), (20.0, 3.0), (25.0, 2.5), (30.0, 2.0), (5.0, 1.0), (60.0, 2.0)]
        {
            assert_relative_eq!(value(&t, alpha, 0.3), expected);
        }
    }

    #[test]
    fn mach_is_interpolated_where_the_tables_have_it() {
        let t =
            tunnel(&[(10.0, Some(0.2), 1.0), (20.0, Some(0.2), 2.0), (10.0, Some(0.6), 3.0), (20.0, Some(0.6), 6.0)]);
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
}
