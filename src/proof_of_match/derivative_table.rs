//! Derivatives of a model over angle of attack in the flight condition of one maneuver, tabulated
//! closely for the inner loop.

use crate::aero::{AeroModel, Condition, Regressor, WindTunnel};
use crate::numerics::series::trapezoid::running_integral;

/// Spacing of the table, deg. Between its points the table is linear, as most databases are.
const STEP_DEG: f64 = 1.0;

/// Reach of the table on either side of the maneuver's mean, deg. Beyond it, derivatives are
/// constant.
const REACH_DEG: f64 = 20.0;

/// Derivatives over angle of attack. A derivative along α is tabulated as its integral from the
/// table's start.
#[derive(Clone, Debug, PartialEq)]
pub struct DerivativeTable {
    first_deg: f64,
    nodes: usize,
    /// Node by node, each derivative in the order of the build-up.
    values: Vec<f64>,
    derivatives: usize,
}

/// Position of an angle of attack in a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TablePosition {
    row: usize,
    /// Fraction of the interval; below 0 or above 1 beyond the table.
    fraction: f64,
}

impl DerivativeTable {
    /// Tabulates a model at a maneuver's condition. A derivative that the model lacks is taken from
    /// the fallback, or is zero.
    #[must_use]
    pub fn new(
        aero_model: &AeroModel,
        model: &WindTunnel,
        fallback: &WindTunnel,
        condition: &Condition,
    ) -> DerivativeTable {
        let first_deg = ((condition.alpha_deg - REACH_DEG) / STEP_DEG).floor() * STEP_DEG;
        let nodes = node_count();
        let derivatives = aero_model.derivatives.len();
        let mut values = vec![0.0; nodes * derivatives];
        for (i, derivative) in aero_model.derivatives.iter().enumerate() {
            let name = &derivative.name;
            let source = model.reader(name).or_else(|| fallback.reader(name));
            let at = |node: usize| {
                let alpha_deg = first_deg + STEP_DEG * node as f64;
                let condition = Condition {
                    alpha_deg,
                    ..*condition
                };
                let read = source.as_ref().and_then(|table| table.at(&condition));
                read.map_or(0.0, |v| v.value)
            };
            let mut column: Vec<f64> = (0..nodes).map(at).collect();
            if derivative.regressor == Regressor::Alpha {
                column = running_integral(&column, STEP_DEG);
            }
            for (node, value) in column.into_iter().enumerate() {
                values[node * derivatives + i] = value;
            }
        }
        DerivativeTable {
            first_deg,
            nodes,
            values,
            derivatives,
        }
    }

    /// Raises one derivative by a constant.
    #[cfg(test)]
    pub fn raise(&mut self, derivative: usize, regressor: &Regressor, by: f64) {
        for (node, row) in self.values.chunks_mut(self.derivatives).enumerate() {
            let distance = if *regressor == Regressor::Alpha {
                STEP_DEG * node as f64
            } else {
                1.0
            };
            row[derivative] += by * distance;
        }
    }

    /// Number of its derivatives.
    #[must_use]
    pub fn derivatives(&self) -> usize {
        self.derivatives
    }

    #[inline]
    #[must_use]
    pub fn position_of(&self, alpha_deg: f64) -> TablePosition {
        let steps = (alpha_deg - self.first_deg) / STEP_DEG;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative; what is no number becomes 0"
        )]
        let row = (steps.max(0.0) as usize).min(self.nodes - 2);
        TablePosition {
            row,
            fraction: steps - row as f64,
        }
    }

    /// Entries of all derivatives on both sides of a position.
    #[inline]
    #[must_use]
    pub fn entries(&self, place: TablePosition) -> Entries<'_> {
        let both = &self.values[place.row * self.derivatives..][..2 * self.derivatives];
        let (low, high) = both.split_at(self.derivatives);
        Entries {
            low,
            high,
            fraction: place.fraction,
            fraction_inside: place.fraction.clamp(0.0, 1.0),
        }
    }

    /// Derivative at a position, constant beyond the table.
    #[must_use]
    pub fn value(&self, place: TablePosition, derivative: usize) -> f64 {
        self.entries(place).value(derivative)
    }
}

/// Entries of a table on both sides of a place.
#[derive(Clone, Copy, Debug)]
pub struct Entries<'a> {
    low: &'a [f64],
    high: &'a [f64],
    fraction: f64,
    /// Fraction of the interval, limited to the table.
    fraction_inside: f64,
}

impl Entries<'_> {
    /// Derivative, constant beyond the table.
    #[inline]
    #[must_use]
    pub fn value(&self, derivative: usize) -> f64 {
        self.between(self.fraction_inside, derivative)
    }

    /// Reads all derivatives as [`Entries::value`] does.
    #[inline]
    pub fn read_into(&self, values: &mut [f64]) {
        let both = self.low.iter().zip(self.high);
        for (value, (low, high)) in values.iter_mut().zip(both) {
            *value = low + self.fraction_inside * (high - low);
        }
    }

    /// Integral of a derivative along α; beyond the table the derivative is constant.
    #[inline]
    #[must_use]
    pub fn integral(&self, derivative: usize) -> f64 {
        self.between(self.fraction, derivative)
    }

    /// Slope of the derivative along α, per deg.
    #[must_use]
    pub fn value_slope(&self, derivative: usize) -> f64 {
        let is_inside = (0.0..=1.0).contains(&self.fraction);
        if is_inside {
            self.integral_slope(derivative)
        } else {
            0.0
        }
    }

    /// Slope of the integral of a derivative along α, per deg.
    #[must_use]
    pub fn integral_slope(&self, derivative: usize) -> f64 {
        (self.high[derivative] - self.low[derivative]) / STEP_DEG
    }

    #[inline]
    fn between(&self, fraction: f64, derivative: usize) -> f64 {
        let (low, high) = (self.low[derivative], self.high[derivative]);
        low + fraction * (high - low)
    }
}

fn node_count() -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small positive constant"
    )]
    let intervals = (2.0 * REACH_DEG / STEP_DEG) as usize + 1;
    intervals + 1
}
