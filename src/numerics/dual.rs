//! Dual numbers: a value with its exact slopes along several parameters.
//!
//! Arithmetic follows the rules of differentiation. A number without slopes is a constant, and costs
//! what a plain number costs.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value and its slopes. No slopes stand for zeros.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dual {
    pub value: f64,
    pub slopes: Vec<f64>,
}

impl Dual {
    /// A value with its slopes.
    #[must_use]
    pub fn new(value: f64, slopes: Vec<f64>) -> Dual {
        Dual { value, slopes }
    }

    /// Function of one number, from its value and its derivative there.
    fn of(self, value: f64, derivative: f64) -> Dual {
        Dual {
            value,
            slopes: scaled(self.slopes, derivative),
        }
    }

    /// Square root; NaN of a negative number.
    #[must_use]
    pub fn sqrt(self) -> Dual {
        let root = self.value.sqrt();
        self.of(root, 0.5 / root)
    }
}

impl From<f64> for Dual {
    fn from(value: f64) -> Dual {
        Dual::new(value, Vec::new())
    }
}

fn scaled(mut slopes: Vec<f64>, factor: f64) -> Vec<f64> {
    for slope in &mut slopes {
        *slope *= factor;
    }
    slopes
}

/// Sum of slopes, of which either may be absent.
fn sum(a: Vec<f64>, b: Vec<f64>) -> Vec<f64> {
    if a.is_empty() {
        return b;
    }
    let mut a = a;
    for (a, b) in a.iter_mut().zip(b) {
        *a += b;
    }
    a
}

impl Add for Dual {
    type Output = Dual;

    fn add(self, other: Dual) -> Dual {
        Dual::new(self.value + other.value, sum(self.slopes, other.slopes))
    }
}

impl Neg for Dual {
    type Output = Dual;

    fn neg(self) -> Dual {
        Dual::new(-self.value, scaled(self.slopes, -1.0))
    }
}

impl Sub for Dual {
    type Output = Dual;

    fn sub(self, other: Dual) -> Dual {
        self + -other
    }
}

impl Mul for Dual {
    type Output = Dual;

    fn mul(self, other: Dual) -> Dual {
        let (a, b) = (self.value, other.value);
        Dual::new(a * b, sum(scaled(self.slopes, b), scaled(other.slopes, a)))
    }
}

impl Mul<f64> for Dual {
    type Output = Dual;

    fn mul(self, factor: f64) -> Dual {
        Dual::new(self.value * factor, scaled(self.slopes, factor))
    }
}

impl Div for Dual {
    type Output = Dual;

    fn div(self, other: Dual) -> Dual {
        let (a, b) = (self.value, other.value);
        let slopes = sum(
            scaled(self.slopes, 1.0 / b),
            scaled(other.slopes, -a / (b * b)),
        );
        Dual::new(a / b, slopes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// A function with every operation.
    fn function(x: Dual, y: Dual) -> Dual {
        let product = x.clone() * y.clone() * 3.0;
        (product - Dual::from(1.5)) / (y.clone() + x.sqrt()) + -y
    }

    #[test]
    fn slopes_are_those_of_central_differences() {
        let at = |x: f64, y: f64| function(x.into(), y.into()).value;
        let found = function(
            Dual::new(2.0, vec![1.0, 0.0]),
            Dual::new(0.7, vec![0.0, 1.0]),
        );
        let h = 1e-5;
        let by_x = (at(2.0 + h, 0.7) - at(2.0 - h, 0.7)) / (2.0 * h);
        let by_y = (at(2.0, 0.7 + h) - at(2.0, 0.7 - h)) / (2.0 * h);
        assert_relative_eq!(found.value, at(2.0, 0.7));
        assert_relative_eq!(found.slopes[0], by_x, max_relative = 1e-8);
        assert_relative_eq!(found.slopes[1], by_y, max_relative = 1e-8);
    }
}
