//! Interpolation in a table: linear, or the monotone cubic of Fritsch and Carlson (1980) with the
//! slopes of Fritsch and Butland (1984). It never overshoots the points on either side.
//!
//! On an interval of length h with the values y₀, y₁ and the slopes d₀, d₁ the cubic is Hermite's.
//! The slope d at a point is the weighted harmonic mean of the chords on either side, with slopes δ₋
//! and δ₊ and lengths h₋ and h₊:
//!
//! 1/d = (w₁/δ₋ + w₂/δ₊)/(w₁ + w₂), w₁ = 2h₊ + h₋, w₂ = h₊ + 2h₋.
//!
//! It is zero where the chords differ in sign. At an end it is the three-point slope, kept monotone.

use serde::{Deserialize, Serialize};

use crate::numerics::cubic_curve::hermite;

/// Interpolation between the points of a table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    #[default]
    Linear,
    MonotoneCubic,
}

/// Interval of `x` among `n` ascending points: the index of its lower point, and the fraction along
/// it from 0 to 1.
///
/// Beyond the ends of the table it is the end point. A single point counts as an interval of no
/// length.
pub(super) fn interval_at(n: usize, x_of: impl Fn(usize) -> f64, x: f64) -> (usize, f64) {
    let last = n.saturating_sub(1);
    let (mut low, mut high) = (0, last);
    while high > low + 1 {
        let middle = low.midpoint(high);
        if x_of(middle) <= x {
            low = middle;
        } else {
            high = middle;
        }
    }
    let (a, b) = (x_of(low), x_of(high));
    (
        low,
        if b > a {
            ((x - a) / (b - a)).clamp(0.0, 1.0)
        } else {
            0.0
        },
    )
}

/// Linear value at a fraction of an interval: exactly the table's at its ends.
pub(super) fn linear(y0: f64, y1: f64, fraction: f64) -> f64 {
    if fraction >= 1.0 {
        y1
    } else {
        y0 + fraction * (y1 - y0)
    }
}

/// The monotone cubic at a fraction of the interval that begins at point `low` of `n`.
pub(super) fn monotone(
    n: usize,
    low: usize,
    fraction: f64,
    x_of: impl Fn(usize) -> f64,
    y_of: impl Fn(usize) -> f64,
) -> f64 {
    let high = (low + 1).min(n.saturating_sub(1));
    let (y0, y1) = (y_of(low), y_of(high));
    if n < 3 || fraction <= 0.0 || fraction >= 1.0 {
        return linear(y0, y1, fraction);
    }
    let length = |i: usize| x_of(i + 1) - x_of(i);
    let chord = |i: usize| (y_of(i + 1) - y_of(i)) / length(i);
    let slope = |i: usize| {
        if i == 0 {
            end_slope(length(0), length(1), chord(0), chord(1))
        } else if i == n - 1 {
            end_slope(length(n - 2), length(n - 3), chord(n - 2), chord(n - 3))
        } else {
            inner_slope(length(i - 1), length(i), chord(i - 1), chord(i))
        }
    };
    let slopes = [slope(low), slope(high)];
    hermite(length(low), fraction, [y0, y1], slopes).0
}

fn inner_slope(h0: f64, h1: f64, chord0: f64, chord1: f64) -> f64 {
    if chord0 * chord1 <= 0.0 {
        return 0.0;
    }
    let (w0, w1) = (2.0 * h1 + h0, h1 + 2.0 * h0);
    (w0 + w1) / (w0 / chord0 + w1 / chord1)
}

/// Three-point slope at an end, with `chord0` next to it. It has the sign of the chord, and at most
/// three times its size where the table turns.
fn end_slope(h0: f64, h1: f64, chord0: f64, chord1: f64) -> f64 {
    let slope = ((2.0 * h0 + h1) * chord0 - h0 * chord1) / (h0 + h1);
    if slope * chord0 <= 0.0 {
        0.0
    } else if chord0 * chord1 <= 0.0 && slope.abs() > 3.0 * chord0.abs() {
        3.0 * chord0
    } else {
        slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const PCHIP: [(f64, f64); 9] = [
        (0.25, 0.311_941_964_285_714_25),
        (0.5, 0.602_678_571_428_571_4),
        (1.5, 1.151_785_714_285_714_2),
        (2.5, 1.321_428_571_428_571_2),
        (3.2, 1.824_000_000_000_000_5),
        (3.9, 3.9345),
        (4.5, 3.84375),
        (5.7, 3.060_749_999_999_999_6),
        (6.5, 3.0),
    ];

    fn read(points: &[(f64, f64)], x: f64) -> f64 {
        let (low, fraction) = interval_at(points.len(), |i| points[i].0, x);
        monotone(
            points.len(),
            low,
            fraction,
            |i| points[i].0,
            |i| points[i].1,
        )
    }

    #[test]
    fn the_monotone_cubic_is_that_of_an_independent_implementation() {
        // scipy.interpolate.PchipInterpolator on the same points.
        let points = [
            (0.0, 0.0),
            (1.0, 1.0),
            (3.0, 1.5),
            (4.0, 4.0),
            (6.0, 3.0),
            (7.0, 3.0),
        ];
        for (x, expected) in PCHIP {
            assert_relative_eq!(read(&points, x), expected, max_relative = 1e-13);
        }
    }

    #[test]
    fn a_straight_line_stays_straight_and_nothing_overshoots() {
        let line = [(0.0, 1.0), (2.0, 3.0), (3.0, 4.0), (7.0, 8.0)];
        let step = [(0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (3.0, 1.0)];
        for k in 0..=70 {
            let x = 0.1 * f64::from(k);
            assert_relative_eq!(read(&line, x), 1.0 + x, max_relative = 1e-14);
            assert!((0.0..=1.0).contains(&read(&step, x)), "{x}");
        }
    }

    #[test]
    fn the_points_themselves_come_back_to_the_bit() {
        let points = [(0.1, 0.3), (0.7, 0.1), (0.9, 0.7), (1.3, 0.2)];
        for (x, y) in points {
            assert_eq!(read(&points, x).to_bits(), y.to_bits());
            let (low, fraction) = interval_at(points.len(), |i| points[i].0, x);
            assert_eq!(
                linear(points[low].1, points[(low + 1).min(3)].1, fraction).to_bits(),
                y.to_bits()
            );
        }
    }

    #[test]
    fn two_points_are_a_line_and_one_is_a_constant() {
        assert_relative_eq!(read(&[(0.0, 1.0), (2.0, 2.0)], 0.5), 1.25);
        assert_relative_eq!(read(&[(5.0, 1.0)], 0.5), 1.0);
    }
}
