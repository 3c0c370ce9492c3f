//! The classical fourth-order Runge-Kutta step for a state and its sensitivities together.
//!
//! The sensitivities are those of the discrete integration, not of the continuous equation: each stage's slope is
//! differentiated as it is computed, so a Gauss-Newton step sees the exact gradient of what was integrated.

use nalgebra::SVector;

/// Sensitivities of `NX` states to the parameters: one row per state, one column per parameter.
pub type Rows<const NX: usize> = [Vec<f64>; NX];

/// Where in the step a slope is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    Start,
    Middle,
    End,
}

/// A state with its sensitivities, and the working space of a step. Nothing is allocated after `new`.
#[derive(Clone, Debug)]
pub struct Integrator<const NX: usize> {
    pub state: SVector<f64, NX>,
    pub sensitivity: Rows<NX>,
    stage: Rows<NX>,
    slope: Rows<NX>,
    sum: Rows<NX>,
}

impl<const NX: usize> Integrator<NX> {
    /// An integrator at a state whose sensitivities to `parameters` parameters are all zero.
    #[must_use]
    pub fn new(state: SVector<f64, NX>, parameters: usize) -> Self {
        let rows = || std::array::from_fn(|_| vec![0.0; parameters]);
        Integrator { state, sensitivity: rows(), stage: rows(), slope: rows(), sum: rows() }
    }

    /// One step of `step_s`. `slope(stage, x, s, ds)` returns the rates at state `x` and writes the rates of its
    /// sensitivities `s` to `ds`.
    pub fn step(
        &mut self,
        step_s: f64,
        mut slope: impl FnMut(Stage, &SVector<f64, NX>, &Rows<NX>, &mut Rows<NX>) -> SVector<f64, NX>,
    ) {
        let k1 = slope(Stage::Start, &self.state, &self.sensitivity, &mut self.slope);
        self.advance(0.5 * step_s, step_s / 6.0, true);
        let k2 = slope(Stage::Middle, &(self.state + k1 * (0.5 * step_s)), &self.stage, &mut self.slope);
        self.advance(0.5 * step_s, step_s / 3.0, false);
        let k3 = slope(Stage::Middle, &(self.state + k2 * (0.5 * step_s)), &self.stage, &mut self.slope);
        self.advance(step_s, step_s / 3.0, false);
        let k4 = slope(Stage::End, &(self.state + k3 * step_s), &self.stage, &mut self.slope);
        for ((s, sum), d) in self.sensitivity.iter_mut().zip(&self.sum).zip(&self.slope) {
            for ((s, sum), d) in s.iter_mut().zip(sum).zip(d) {
                *s += sum + step_s / 6.0 * d;
            }
        }
        self.state += (k1 + (k2 + k3) * 2.0 + k4) * (step_s / 6.0);
    }

    /// Adds `share` of the last slope to the sum, and puts the sensitivities `ahead` of the start along it.
    fn advance(&mut self, ahead: f64, share: f64, first: bool) {
        let rows = self.sensitivity.iter().zip(&self.slope).zip(self.stage.iter_mut().zip(self.sum.iter_mut()));
        for ((s, d), (stage, sum)) in rows {
            for ((s, d), (stage, sum)) in s.iter().zip(d).zip(stage.iter_mut().zip(sum.iter_mut())) {
                *stage = s + ahead * d;
                *sum = if first { share * d } else { *sum + share * d };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// x' = a x² with x(0) = 1: x(t) = 1/(1 − a t); one parameter, a.
    fn integrate(a: f64, steps: u32) -> (f64, f64) {
        let mut it = Integrator::new(SVector::from([1.0]), 1);
        for _ in 0..steps {
            it.step(1.0 / f64::from(steps), |_, x, s, ds| {
                ds[0][0] = 2.0 * a * x[0] * s[0][0] + x[0] * x[0];
                SVector::from([a * x[0] * x[0]])
            });
        }
        (it.state[0], it.sensitivity[0][0])
    }

    #[test]
    fn the_error_falls_with_the_fourth_power_of_the_step() {
        let exact = 1.0 / (1.0 - 0.4);
        let error = |steps| (integrate(0.4, steps).0 - exact).abs();
        let ratio = error(8) / error(16);
        assert!((14.0..18.0).contains(&ratio), "halving the step divides the error by {ratio}");
    }

    #[test]
    fn sensitivities_are_those_of_the_discrete_integration() {
        // With only three steps the discrete slope differs from the continuous 1/(1 − a)² by more than the tolerance.
        let h = 1e-6;
        let numeric = (integrate(0.4 + h, 3).0 - integrate(0.4 - h, 3).0) / (2.0 * h);
        let (_, exact) = integrate(0.4, 3);
        assert_relative_eq!(exact, numeric, max_relative = 1e-9);
        assert!((exact - 1.0 / (0.6 * 0.6)).abs() > 1e-5);
    }
}
