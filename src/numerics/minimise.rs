//! Minimum of a smooth function of some dozens of variables by Newton's steps (Nocedal and Wright, chapter 3).

use nalgebra::{Cholesky, DMatrix, DVector};

/// Least decrease of a step, relative to that of the tangent (Armijo).
const LEAST_DECREASE: f64 = 1e-4;

/// Largest change of a variable in a step.
const LONGEST: f64 = 1.0;

/// Halvings of a step before the search ends.
const HALVINGS: usize = 25;

/// Value and derivatives of a function at a point.
#[derive(Clone, Debug)]
pub struct LocalExpansion {
    pub value: f64,
    pub gradient: DVector<f64>,
    /// Second derivatives.
    pub curvature: DMatrix<f64>,
    /// Positive definite matrix that replaces the second derivatives if they are not positive
    /// definite.
    pub expected: DMatrix<f64>,
}

impl LocalExpansion {
    /// Newton's step; `None` if neither matrix is positive definite.
    fn step(&self) -> Option<DVector<f64>> {
        let root = Cholesky::new(self.curvature.clone());
        let root = root.or_else(|| Cholesky::new(self.expected.clone()))?;
        Some(-root.solve(&self.gradient))
    }
}

/// Minimum of a function from a start.
///
/// `function` returns `None` outside its domain. The search ends once √(sᵀ H s) of a step s falls
/// below `tolerance`, with H the second derivatives. For a negative log density that is the
/// distance in standard deviations. The search also ends after `steps`, or if no step decreases the
/// function.
#[must_use]
pub fn minimum(
    start: DVector<f64>,
    steps: usize,
    tolerance: f64,
    mut function: impl FnMut(&DVector<f64>) -> Option<LocalExpansion>,
) -> DVector<f64> {
    let Some(mut local) = function(&start) else {
        return start;
    };
    let mut at = start;
    for _ in 0..steps {
        let Some(mut step) = local.step() else {
            break;
        };
        let slope = step.dot(&local.gradient);
        if slope.abs().sqrt() < tolerance {
            break;
        }
        let longest = step.amax();
        if longest > LONGEST {
            step *= LONGEST / longest;
        }
        let Some((next, there)) = decreased(&at, &local, step, &mut function) else {
            break;
        };
        (at, local) = (next, there);
    }
    at
}

/// First of a step and its halvings at which the function decreases.
fn decreased(
    at: &DVector<f64>,
    local: &LocalExpansion,
    mut step: DVector<f64>,
    function: &mut impl FnMut(&DVector<f64>) -> Option<LocalExpansion>,
) -> Option<(DVector<f64>, LocalExpansion)> {
    for _ in 0..HALVINGS {
        let next = at + &step;
        let wanted = local.value + LEAST_DECREASE * step.dot(&local.gradient);
        if let Some(there) = function(&next)
            && there.value <= wanted
        {
            return Some((next, there));
        }
        step *= 0.5;
    }
    None
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn vector<const N: usize>(values: [f64; N]) -> DVector<f64> {
        DVector::from_column_slice(&values)
    }

    #[test]
    fn a_curved_valley_is_followed_to_its_minimum() {
        // Rosenbrock.
        let valley = |x: &DVector<f64>| {
            let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
            let bend = 2.0 - 400.0 * (b - 2.0 * x[0] * x[0]);
            let twist = -400.0 * x[0];
            Some(LocalExpansion {
                value: a * a + 100.0 * b * b,
                gradient: vector([-2.0 * a - 400.0 * x[0] * b, 200.0 * b]),
                curvature: DMatrix::from_row_slice(2, 2, &[bend, twist, twist, 200.0]),
                expected: DMatrix::identity(2, 2),
            })
        };
        let at = minimum(vector([-1.2, 1.0]), 200, 1e-9, valley);
        assert_relative_eq!(at, vector([1.0, 1.0]), epsilon = 1e-8);
    }

    #[test]
    fn a_step_into_nothing_is_shortened() {
        let half_line = |x: &DVector<f64>| {
            let x = x[0];
            (x > 0.0).then(|| LocalExpansion {
                value: x - x.ln(),
                gradient: vector([1.0 - 1.0 / x]),
                curvature: DMatrix::from_element(1, 1, 1.0 / (x * x)),
                expected: DMatrix::identity(1, 1),
            })
        };
        let at = minimum(vector([2.5]), 100, 1e-10, half_line);
        assert_relative_eq!(at[0], 1.0, epsilon = 1e-9);
    }

    #[test]
    fn a_summit_is_left_by_the_expected_second_derivatives() {
        let wave = |x: &DVector<f64>| {
            Some(LocalExpansion {
                value: x[0].cos(),
                gradient: vector([-x[0].sin()]),
                curvature: DMatrix::from_element(1, 1, -x[0].cos()),
                expected: DMatrix::identity(1, 1),
            })
        };
        let at = minimum(vector([0.1]), 100, 1e-10, wave);
        assert_relative_eq!(at[0], std::f64::consts::PI, epsilon = 1e-9);
    }
}
