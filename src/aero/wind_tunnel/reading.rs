//! Reading of the tables at a flight condition: along α, then across Mach, then across the third variable.

use super::condition::Condition;
use super::database::{WindTunnel, key};
use super::entries::{Entry, TunnelValue, rows_of_mach};
use super::settings::Extrapolation;
use crate::aero::interpolation::{Interpolation, interval_at, linear, monotone};

impl WindTunnel {
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
}

/// Table of one derivative: blocks of the third variable, in them rows of Mach, in them α.
#[derive(Clone, Debug)]
pub struct TableReader<'a> {
    tunnel: &'a WindTunnel,
    derivative: &'a str,
    blocks: Vec<Vec<&'a [Entry]>>,
}

impl TableReader<'_> {
    /// Value at a flight condition; `None` if extrapolation is needed and refused.
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
    let a = value_of(low);
    let b = if high == low { a } else { value_of(high) };
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
