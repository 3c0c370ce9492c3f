//! Derivatives of a model over angle of attack in the flight condition of one maneuver, tabulated
//! closely for the inner loop.
//!
//! A row of the table has the derivatives of all coefficients along one factor, in the lanes of a vector.
#![expect(
    clippy::inline_always,
    reason = "compiled into free runs for the processor at hand"
)]

use crate::aero::{AeroModel, Condition, WindTunnel};
use crate::numerics::series::trapezoid::running_integral;
use crate::numerics::vectors::simd::VECTOR;

/// Spacing of the table, deg. Between its points the table is linear, as most databases are.
const STEP_DEG: f64 = 1.0;

/// Reach of the table on either side of the maneuver's mean, deg. Beyond it, derivatives are
/// constant.
const REACH_DEG: f64 = 20.0;

/// Numbers of all coefficients side by side, padded to a whole vector.
pub type CoefficientLanes = [f64; VECTOR];

/// Row of the derivatives along α.
pub const ALPHA_ROW: usize = 0;

/// First row of the other derivatives. The constants are before it, as no change contains them.
pub const FIRST_ROW: usize = 2;

/// Place of a derivative in a table: row of its factor, and index of its coefficient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DerivativePlace {
    pub row: usize,
    pub coefficient: usize,
}

/// Derivatives over angle of attack. Derivatives along α are tabulated as their integrals from the
/// table's start.
#[derive(Clone, Debug, PartialEq)]
pub struct DerivativeTable {
    first_deg: f64,
    /// Node by node, factor by factor; zero where the build-up has no derivative.
    values: Vec<CoefficientLanes>,
    rows: usize,
    /// Place of each derivative, in the order of the build-up.
    pub places: Vec<DerivativePlace>,
}

impl DerivativeTable {
    /// Tabulates a model at a maneuver's condition. A derivative that the model lacks is taken from
    /// the fallback, or is zero.
    #[must_use]
    pub fn new(
        (aero_model, places): (&AeroModel, Vec<DerivativePlace>),
        (model, fallback): (&WindTunnel, &WindTunnel),
        condition: &Condition,
    ) -> DerivativeTable {
        let first_deg = ((condition.alpha_deg - REACH_DEG) / STEP_DEG).floor() * STEP_DEG;
        let nodes = node_count();
        let ends = places.iter().map(|place| place.row + 1);
        let rows = ends.fold(FIRST_ROW, usize::max);
        let mut values = vec![[0.0; VECTOR]; nodes * rows];
        for (derivative, place) in aero_model.derivatives.iter().zip(&places) {
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
            if place.row == ALPHA_ROW {
                column = running_integral(&column, STEP_DEG);
            }
            for (node, value) in column.into_iter().enumerate() {
                values[node * rows + place.row][place.coefficient] += value;
            }
        }
        DerivativeTable {
            first_deg,
            values,
            rows,
            places,
        }
    }

    /// Raises one derivative by a constant.
    #[cfg(test)]
    pub fn raise(&mut self, derivative: usize, by: f64) {
        let DerivativePlace { row, coefficient } = self.places[derivative];
        for (node, rows) in self.values.chunks_mut(self.rows).enumerate() {
            let distance = if row == ALPHA_ROW {
                STEP_DEG * node as f64
            } else {
                1.0
            };
            rows[row][coefficient] += by * distance;
        }
    }

    /// Entries on both sides of an angle of attack.
    #[inline]
    #[must_use]
    pub fn entries(&self, alpha_deg: f64) -> Entries<'_> {
        let steps = (alpha_deg - self.first_deg) / STEP_DEG;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative; what is no number becomes 0"
        )]
        let node = (steps.max(0.0) as usize).min(node_count() - 2);
        let both = &self.values[node * self.rows..][..2 * self.rows];
        let (low, high) = both.split_at(self.rows);
        let fraction = steps - node as f64;
        Entries {
            low,
            high,
            fraction,
            fraction_inside: fraction.clamp(0.0, 1.0),
        }
    }

    /// Derivative at an angle of attack, constant beyond the table.
    #[must_use]
    pub fn value(&self, alpha_deg: f64, derivative: usize) -> f64 {
        let DerivativePlace { row, coefficient } = self.places[derivative];
        self.entries(alpha_deg).values(row)[coefficient]
    }
}

/// Entries of a table on both sides of an angle of attack.
#[derive(Clone, Copy, Debug)]
pub struct Entries<'a> {
    low: &'a [CoefficientLanes],
    high: &'a [CoefficientLanes],
    /// Fraction of the interval; below 0 or above 1 beyond the table.
    fraction: f64,
    /// Fraction of the interval, limited to the table.
    fraction_inside: f64,
}

impl Entries<'_> {
    /// Derivatives along a factor, constant beyond the table.
    #[inline(always)]
    #[must_use]
    pub fn values(&self, row: usize) -> CoefficientLanes {
        self.row_between(self.fraction_inside, row)
    }

    /// Adds the products of numbers, one for each row, with the derivatives of the rows from [`FIRST_ROW`] on.
    #[inline(always)]
    pub fn add_products(&self, numbers: &[f64], sums: &mut CoefficientLanes) {
        let rows = numbers.len();
        let (low, high) = (&self.low[..rows], &self.high[..rows]);
        for row in FIRST_ROW..rows {
            for c in 0..VECTOR {
                let value = between(self.fraction_inside, low[row][c], high[row][c]);
                sums[c] = numbers[row].mul_add(value, sums[c]);
            }
        }
    }

    /// Integrals of the derivatives along α; beyond the table a derivative is constant.
    #[inline(always)]
    #[must_use]
    pub fn integrals(&self) -> CoefficientLanes {
        self.row_between(self.fraction, ALPHA_ROW)
    }

    /// Slopes of a factor's derivatives along α, per deg.
    #[inline(always)]
    #[must_use]
    pub fn value_slopes(&self, row: usize) -> CoefficientLanes {
        let is_inside = (0.0..=1.0).contains(&self.fraction);
        if is_inside {
            self.slopes(row)
        } else {
            [0.0; VECTOR]
        }
    }

    /// Slopes of the integrals along α, per deg.
    #[inline(always)]
    #[must_use]
    pub fn integral_slopes(&self) -> CoefficientLanes {
        self.slopes(ALPHA_ROW)
    }

    #[inline(always)]
    fn slopes(&self, row: usize) -> CoefficientLanes {
        let (low, high) = (&self.low[row], &self.high[row]);
        let mut slopes = [0.0; VECTOR];
        for c in 0..VECTOR {
            slopes[c] = (high[c] - low[c]) / STEP_DEG;
        }
        slopes
    }

    #[inline(always)]
    fn row_between(&self, fraction: f64, row: usize) -> CoefficientLanes {
        let (low, high) = (&self.low[row], &self.high[row]);
        let mut values = [0.0; VECTOR];
        for c in 0..VECTOR {
            values[c] = between(fraction, low[c], high[c]);
        }
        values
    }
}

/// Value at a fraction of an interval.
#[inline(always)]
fn between(fraction: f64, low: f64, high: f64) -> f64 {
    fraction.mul_add(high - low, low)
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
