//! The classical fourth-order Runge-Kutta step, for a state and for its sensitivities alike.
//!
//! The sensitivities are those of the discrete integration, not of the continuous equation: each
//! stage's slope is differentiated where the state's own was taken, so a Gauss-Newton step sees the
//! exact gradient of what was integrated.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

/// Slopes that a step takes.
pub const STAGES: usize = 4;
/// Which of start (0), middle (1) and end (2) of the step each slope is taken at.
pub const POINT: [usize; STAGES] = [0, 1, 1, 2];
/// The end of one step of `step_s` from `x`. `slope(stage, x)` is the rate at a stage, and
/// `along(x, h, slope)` is x + h slope.
#[inline(always)]
pub fn step<X: Copy>(
    x: X,
    step_s: f64,
    mut slope: impl FnMut(usize, X) -> X,
    along: impl Fn(X, f64, X) -> X,
) -> X {
    let half = 0.5 * step_s;
    let k1 = slope(0, x);
    let k2 = slope(1, along(x, half, k1));
    let k3 = slope(2, along(x, half, k2));
    let k4 = slope(3, along(x, step_s, k3));
    let (sixth, third) = (step_s / 6.0, step_s / 3.0);
    along(
        along(along(along(x, sixth, k1), third, k2), third, k3),
        sixth,
        k4,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn along(x: f64, h: f64, slope: f64) -> f64 {
        x + h * slope
    }

    /// x' = a x² with x(0) = 1: x(t) = 1/(1 − a t); one parameter, a.
    fn integrate(a: f64, steps: u32) -> (f64, f64) {
        let (mut x, mut s, h) = (1.0, 0.0, 1.0 / f64::from(steps));
        for _ in 0..steps {
            let mut at = [0.0; STAGES];
            let next = step(
                x,
                h,
                |stage, x| {
                    at[stage] = x;
                    a * x * x
                },
                along,
            );
            s = step(
                s,
                h,
                |stage, s| 2.0 * a * at[stage] * s + at[stage] * at[stage],
                along,
            );
            x = next;
        }
        (x, s)
    }

    #[test]
    fn the_error_falls_with_the_fourth_power_of_the_step() {
        let exact = 1.0 / (1.0 - 0.4);
        let error = |steps| (integrate(0.4, steps).0 - exact).abs();
        let ratio = error(8) / error(16);
        assert!(
            (14.0..18.0).contains(&ratio),
            "halving the step divides the error by {ratio}"
        );
    }

    #[test]
    fn sensitivities_are_those_of_the_discrete_integration() {
        // With only three steps the discrete slope differs from the continuous 1/(1 − a)² by more
        // than the tolerance.
        let h = 1e-6;
        let numeric = (integrate(0.4 + h, 3).0 - integrate(0.4 - h, 3).0) / (2.0 * h);
        let (_, exact) = integrate(0.4, 3);
        assert_relative_eq!(exact, numeric, max_relative = 1e-9);
        assert!((exact - 1.0 / (0.6 * 0.6)).abs() > 1e-5);
    }
}
