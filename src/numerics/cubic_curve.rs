//! Curve through points of given slopes: Hermite's cubic between them, straight lines beyond.

/// A point of the curve: abscissa, ordinate and slope.
type Knot = (f64, f64, f64);

/// Curve through knots, with a continuous slope.
#[derive(Clone, Debug, PartialEq)]
pub struct CubicCurve {
    knots: Vec<Knot>,
}

impl CubicCurve {
    /// Curve through knots of ascending abscissa; `None` without a knot.
    #[must_use]
    pub fn through(knots: Vec<Knot>) -> Option<CubicCurve> {
        (!knots.is_empty()).then_some(CubicCurve { knots })
    }

    /// Ordinate and slope at an abscissa.
    #[must_use]
    pub fn at(&self, x: f64) -> (f64, f64) {
        let knots = &self.knots;
        let above = knots.partition_point(|knot| knot.0 <= x);
        if above == 0 || above == knots.len() {
            let (x0, y0, slope) = knots[above.saturating_sub(1)];
            return (y0 + slope * (x - x0), slope);
        }
        let ((x0, y0, d0), (x1, y1, d1)) = (knots[above - 1], knots[above]);
        hermite(x1 - x0, (x - x0) / (x1 - x0), [y0, y1], [d0, d1])
    }
}

/// Ordinate and slope of Hermite's cubic at the fraction `t` of an interval of length `h`, from the ordinates
/// and slopes at its ends. With the chord c = (y₁ − y₀)/h:
/// y = y₀ + h t [d₀ + t (3c − 2d₀ − d₁) + t² (d₀ + d₁ − 2c)].
#[inline]
pub fn hermite(h: f64, t: f64, [y0, y1]: [f64; 2], [d0, d1]: [f64; 2]) -> (f64, f64) {
    let chord = (y1 - y0) / h;
    let (second, third) = (3.0 * chord - 2.0 * d0 - d1, d0 + d1 - 2.0 * chord);
    let ordinate = y0 + h * t * (d0 + t * (second + t * third));
    (ordinate, d0 + t * (2.0 * second + 3.0 * t * third))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_cubic_comes_back_between_the_knots_with_its_slope() {
        let cubic = |x: f64| (1.0 - 2.0 * x + 0.5 * x * x * x, -2.0 + 1.5 * x * x);
        let knots = [-1.0, 0.5, 2.0, 5.0].map(|x| (x, cubic(x).0, cubic(x).1));
        let curve = CubicCurve::through(knots.to_vec()).unwrap();
        for k in 0..=60 {
            let x = -1.0 + 0.1 * f64::from(k);
            assert_relative_eq!(curve.at(x).0, cubic(x).0, epsilon = 1e-12);
            assert_relative_eq!(curve.at(x).1, cubic(x).1, epsilon = 1e-12);
        }
    }

    #[test]
    fn beyond_the_last_knot_the_curve_is_its_tangent() {
        let curve = CubicCurve::through(vec![(5.0, 1.0, 0.2), (10.0, 3.0, 0.5)]).unwrap();
        assert_eq!(curve.at(4.0), (0.8, 0.2));
        assert_eq!(curve.at(12.0), (4.0, 0.5));
        assert_eq!(curve.at(10.0), (3.0, 0.5));
    }

    #[test]
    fn a_single_knot_is_a_line_and_none_is_no_curve() {
        let line = CubicCurve::through(vec![(1.0, 2.0, 3.0)]).unwrap();
        assert_eq!(line.at(2.0), (5.0, 3.0));
        assert_eq!(CubicCurve::through(vec![]), None);
    }
}
