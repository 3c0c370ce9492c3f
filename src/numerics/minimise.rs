//! Minimum of a smooth function of some dozens of variables by quasi-Newton steps (BFGS; Nocedal and
//! Wright, chapter 6).

use nalgebra::{DMatrix, DVector};

/// Decrease of a step over that of the tangent, at least (Armijo).
const LEAST_DECREASE: f64 = 1e-4;

/// Longest change of a variable in a step.
const LONGEST: f64 = 1.0;

/// Halvings of a step before the search ends.
const HALVINGS: usize = 25;

/// Minimum of a function from a start.
///
/// `function` returns the value and its gradient, or `None` where it has none. The search ends at
/// a gradient below `tolerance` in all variables, after `steps`, or where no step decreases.
#[must_use]
pub fn minimum(
    start: DVector<f64>,
    steps: usize,
    tolerance: f64,
    mut function: impl FnMut(&DVector<f64>) -> Option<(f64, DVector<f64>)>,
) -> DVector<f64> {
    let Some((mut value, mut gradient)) = function(&start) else {
        return start;
    };
    let n = start.len();
    let mut at = start;
    let mut inverse = DMatrix::<f64>::identity(n, n);
    for step in 0..steps {
        if gradient.amax() < tolerance {
            break;
        }
        let mut direction = -(&inverse * &gradient);
        if direction.dot(&gradient) >= 0.0 {
            inverse.fill_with_identity();
            direction = -&gradient;
        }
        let longest = direction.amax();
        if longest > LONGEST {
            direction *= LONGEST / longest;
        }
        let slope = direction.dot(&gradient);
        let mut found = None;
        for _ in 0..HALVINGS {
            let next = &at + &direction;
            if let Some((lower, there)) = function(&next)
                && lower <= value + LEAST_DECREASE * slope
            {
                found = Some((next, lower, there));
                break;
            }
            direction *= 0.5;
        }
        let Some((next, lower, there)) = found else {
            break;
        };
        let (moved, turned) = (&next - &at, &there - &gradient);
        update(&mut inverse, &moved, &turned, step == 0);
        (at, value, gradient) = (next, lower, there);
    }
    at
}

/// Updates the inverse of the second derivatives by a step and the change of the gradient.
fn update(inverse: &mut DMatrix<f64>, moved: &DVector<f64>, turned: &DVector<f64>, is_first: bool) {
    let curvature = moved.dot(turned);
    if curvature <= 1e-12 * moved.norm() * turned.norm() {
        return;
    }
    if is_first {
        *inverse *= curvature / turned.norm_squared();
    }
    let image = &*inverse * turned;
    let factor = (1.0 + turned.dot(&image) / curvature) / curvature;
    *inverse += factor * moved * moved.transpose()
        - (&image * moved.transpose() + moved * image.transpose()) / curvature;
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
            let gradient = vector([-2.0 * a - 400.0 * x[0] * b, 200.0 * b]);
            Some((a * a + 100.0 * b * b, gradient))
        };
        let at = minimum(vector([-1.2, 1.0]), 200, 1e-9, valley);
        assert_relative_eq!(at, vector([1.0, 1.0]), epsilon = 1e-8);
    }

    #[test]
    fn a_step_into_nothing_is_shortened() {
        let half_line =
            |x: &DVector<f64>| (x[0] > 0.0).then(|| (x[0] - x[0].ln(), vector([1.0 - 1.0 / x[0]])));
        let at = minimum(vector([0.1]), 100, 1e-10, half_line);
        assert_relative_eq!(at[0], 1.0, epsilon = 1e-9);
    }
}
