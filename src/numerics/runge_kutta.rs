//! The classical fourth-order Runge-Kutta tableau and its step.
//!
//! A step serves a state and its sensitivities alike. Sensitivities are those of the discrete
//! integration: each stage is differentiated at the state where its slope was taken. A Gauss-Newton
//! step so has the exact gradient of the integrated response.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

/// Stages of a step.
pub const STAGES: usize = 4;
/// Place of each stage: start (0), middle (1) or end (2) of the step.
pub const POINT: [usize; STAGES] = [0, 1, 1, 2];

/// Time over which each stage's slope leads to the next stage, s.
#[inline(always)]
#[must_use]
pub fn reaches_s(step_s: f64) -> [f64; STAGES] {
    let half = 0.5 * step_s;
    [half, half, step_s, 0.0]
}

/// Weight of each stage's slope in the step, s.
#[inline(always)]
#[must_use]
pub fn weights_s(step_s: f64) -> [f64; STAGES] {
    let (sixth, third) = (step_s / 6.0, step_s / 3.0);
    [sixth, third, third, sixth]
}

/// State after one step of `step_s` from `x`. `slope(stage, x)` returns the rate at a stage, and
/// `plus(x, slope, h)` returns x + h slope.
///
/// The stages are written out, so that the compiler knows the number of each.
#[inline(always)]
pub fn step<X>(
    x: &X,
    step_s: f64,
    mut slope: impl FnMut(usize, &X) -> X,
    plus: impl Fn(&X, &X, f64) -> X,
) -> X {
    let (reaches, weights) = (reaches_s(step_s), weights_s(step_s));
    let rate = slope(0, x);
    let (at, end) = (plus(x, &rate, reaches[0]), plus(x, &rate, weights[0]));
    let rate = slope(1, &at);
    let (at, end) = (plus(x, &rate, reaches[1]), plus(&end, &rate, weights[1]));
    let rate = slope(2, &at);
    let (at, end) = (plus(x, &rate, reaches[2]), plus(&end, &rate, weights[2]));
    let rate = slope(3, &at);
    plus(&end, &rate, weights[3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Integrates x' = a x², x(0) = 1, whose solution is 1/(1 − a t), with its sensitivity to a.
    fn integrate(a: f64, steps: u32) -> (f64, f64) {
        let (mut x, mut s, h) = (1.0, 0.0, 1.0 / f64::from(steps));
        for _ in 0..steps {
            let mut at = [0.0; STAGES];
            let next = step(
                &x,
                h,
                |stage, x| {
                    at[stage] = *x;
                    a * x * x
                },
                |x, slope, h| x + h * slope,
            );
            s = step(
                &s,
                h,
                |stage, s| 2.0 * a * at[stage] * s + at[stage] * at[stage],
                |x, slope, h| x + h * slope,
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
        // With three steps the discrete sensitivity differs from the continuous 1/(1 − a)² by more
        // than the tolerance.
        let h = 1e-6;
        let numeric = (integrate(0.4 + h, 3).0 - integrate(0.4 - h, 3).0) / (2.0 * h);
        let (_, exact) = integrate(0.4, 3);
        assert_relative_eq!(exact, numeric, max_relative = 1e-9);
        assert!((exact - 1.0 / (0.6 * 0.6)).abs() > 1e-5);
    }
}
