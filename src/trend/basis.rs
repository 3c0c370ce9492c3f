//! Basis functions of a trend: Legendre polynomials of the α range scaled to −1..1, or B-splines (Cox
//! and de Boor's recursion) between knots.

use nalgebra::RowDVector;

/// Basis functions of α; a trend is their linear combination.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Basis {
    /// Range of the data in α, deg.
    range: (f64, f64),
    order: usize,
    /// Knots inside the range, ascending, deg; empty for a polynomial.
    knots: Vec<f64>,
}

impl Basis {
    pub(super) fn polynomial(range: (f64, f64), order: usize) -> Basis {
        Basis {
            range,
            order,
            knots: Vec::new(),
        }
    }

    /// A spline of an order between 1 and 3; knots outside the range of the data are left out.
    pub(super) fn spline(range: (f64, f64), order: usize, knots_deg: &[f64]) -> Basis {
        let mut knots: Vec<f64> = knots_deg
            .iter()
            .copied()
            .filter(|k| range.0 < *k && *k < range.1)
            .collect();
        knots.sort_by(f64::total_cmp);
        knots.dedup();
        Basis {
            range,
            order,
            knots,
        }
    }

    pub(super) fn order(&self) -> usize {
        self.order
    }

    /// Number of coefficients.
    pub(super) fn size(&self) -> usize {
        self.order + 1 + self.knots.len()
    }

    /// Name of the basis in the table `trends`.
    pub(super) fn name(&self) -> String {
        if self.knots.is_empty() {
            return "polynomial".to_owned();
        }
        let knots: Vec<String> = self.knots.iter().map(|k| format!("{k}")).collect();
        format!("spline, knots {}", knots.join(" "))
    }

    /// Values of the functions at an angle of attack.
    pub(super) fn row(&self, alpha_deg: f64) -> RowDVector<f64> {
        if self.knots.is_empty() {
            self.legendre(alpha_deg)
        } else {
            self.splines(alpha_deg)
        }
    }

    fn legendre(&self, alpha_deg: f64) -> RowDVector<f64> {
        let (low, high) = self.range;
        let x = if high > low {
            (2.0 * alpha_deg - low - high) / (high - low)
        } else {
            0.0
        };
        let mut p = vec![1.0, x];
        for j in 1..self.order {
            let n = j as f64;
            p.push(((2.0 * n + 1.0) * x * p[j] - n * p[j - 1]) / (n + 1.0));
        }
        RowDVector::from_iterator(self.order + 1, p.into_iter().take(self.order + 1))
    }

    fn splines(&self, alpha_deg: f64) -> RowDVector<f64> {
        let (low, high) = self.range;
        let ends = |end: f64| std::iter::repeat_n(end, self.order + 1);
        let knots: Vec<f64> = ends(low)
            .chain(self.knots.iter().copied())
            .chain(ends(high))
            .collect();
        let x = alpha_deg.clamp(low, high);
        // Order 0 is one on the interval of x; at the upper end, on the last interval of non-zero
        // length.
        let inside = |i: usize| {
            knots[i] < knots[i + 1] && knots[i] <= x && (x < knots[i + 1] || knots[i + 1] >= high)
        };
        let interval = (0..knots.len() - 1).find(|i| inside(*i));
        let mut values: Vec<f64> = (0..knots.len() - 1)
            .map(|i| f64::from(u8::from(Some(i) == interval)))
            .collect();
        for order in 1..=self.order {
            let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
            // The next function is still that of the order below.
            for i in 0..knots.len() - 1 - order {
                let rising = share(x - knots[i], knots[i + order] - knots[i]);
                let falling = share(
                    knots[i + order + 1] - x,
                    knots[i + order + 1] - knots[i + 1],
                );
                values[i] = rising * values[i] + falling * values[i + 1];
            }
            values.pop();
        }
        RowDVector::from_vec(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const DESIGN: [(f64, [f64; 6]); 6] = [
        (0.0, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        (
            0.3,
            [
                0.342_999_999_999_999_9,
                0.579,
                0.07575,
                0.002_249_999_999_999_999_4,
                0.0,
                0.0,
            ],
        ),
        (
            1.0,
            [
                0.0,
                0.444_444_444_444_444_4,
                0.472_222_222_222_222_2,
                0.083_333_333_333_333_33,
                0.0,
                0.0,
            ],
        ),
        (
            2.2,
            [
                0.0,
                0.028_444_444_444_444_43,
                0.372_222_222_222_222_2,
                0.503_333_333_333_333_4,
                0.096_000_000_000_000_04,
                0.0,
            ],
        ),
        (
            3.5,
            [
                0.0,
                0.0,
                0.010_416_666_666_666_666,
                0.184_027_777_777_777_76,
                0.680_555_555_555_555_6,
                0.125,
            ],
        ),
        (4.0, [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
    ];

    #[test]
    fn splines_sum_to_one_and_are_none_below_zero() {
        for order in 1..=3 {
            let basis = Basis::spline((5.0, 60.0), order, &[20.0, 35.0, 80.0]);
            assert_eq!(basis.size(), order + 3);
            for k in 0..=110 {
                let row = basis.row(5.0 + 0.5 * f64::from(k));
                assert_eq!(row.len(), basis.size());
                assert_relative_eq!(row.sum(), 1.0, max_relative = 1e-14);
                assert!(row.iter().all(|v| *v >= 0.0));
            }
        }
    }

    #[test]
    fn a_cubic_spline_s_values_are_those_of_an_independent_implementation() {
        // scipy.interpolate.BSpline.design_matrix on the knots 0 0 0 0 1 3 4 4 4 4.
        let basis = Basis::spline((0.0, 4.0), 3, &[1.0, 3.0]);
        for (x, expected) in DESIGN {
            for (value, expected) in basis.row(x).iter().zip(expected) {
                assert_relative_eq!(*value, expected, epsilon = 1e-14);
            }
        }
    }

    #[test]
    fn a_spline_of_order_one_is_a_line_between_its_knots() {
        let basis = Basis::spline((0.0, 10.0), 1, &[4.0]);
        assert_eq!(basis.row(4.0).as_slice(), [0.0, 1.0, 0.0]);
        assert_eq!(basis.row(1.0).as_slice(), [0.75, 0.25, 0.0]);
        assert_eq!(basis.row(10.0).as_slice(), [0.0, 0.0, 1.0]);
    }
}
