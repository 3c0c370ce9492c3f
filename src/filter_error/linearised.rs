//! Mean linear system of a maneuver. Rates and outputs are linear in the coefficients, and the
//! coefficients in the derivatives ξ_j. The slopes along the states are therefore affine in the
//! derivatives: A = A₀ + Σ ξ_j A_j.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use nalgebra::{SMatrix, SVector};
use pulp::{Arch, Simd, WithSimd};

use crate::dynamics::{COEFFICIENTS, Equations, OUTPUTS};
use crate::numerics::linear_algebra::small::product;
use crate::output_error::Case;

/// Stride of the samples at which the slopes are computed: enough for a mean.
const SLOPE_STRIDE: usize = 4;

/// Slopes of the rates and outputs along the states, means along the measured motion.
#[derive(Clone, Debug)]
pub(super) struct Linearised<const NX: usize> {
    step_s: f64,
    held: StateSlopes<NX>,
    /// Slopes per unit of each free derivative.
    free: Vec<StateSlopes<NX>>,
}

/// Slopes of rates (1/s) and of outputs along the states.
#[derive(Clone, Copy, Debug)]
struct StateSlopes<const NX: usize> {
    rates: SMatrix<f64, NX, NX>,
    outputs: SMatrix<f64, OUTPUTS, NX>,
}

/// System of one step with the states x and outputs y: x(k+1) = Φ x(k), y(k) = C x(k).
#[derive(Clone, Copy, Debug)]
pub(super) struct Discrete<const NX: usize> {
    pub step: SMatrix<f64, NX, NX>,
    pub outputs: SMatrix<f64, OUTPUTS, NX>,
}

impl<const NX: usize> StateSlopes<NX> {
    fn zeros() -> Self {
        StateSlopes {
            rates: SMatrix::zeros(),
            outputs: SMatrix::zeros(),
        }
    }

    #[inline(always)]
    fn add(&mut self, other: &StateSlopes<NX>, factor: f64) {
        self.rates += other.rates * factor;
        self.outputs += other.outputs * factor;
    }
}

impl<const NX: usize> Linearised<NX> {
    pub fn of<E: Equations<NX>>(case: &Case<NX, E>) -> Self {
        let mut linearised = Linearised {
            step_s: case.step_s,
            held: StateSlopes::zeros(),
            free: vec![StateSlopes::zeros(); case.derivatives()],
        };
        Arch::new().dispatch(SlopeSums {
            case,
            sums: &mut linearised,
        });
        for output in (0..OUTPUTS).filter(|&o| !case.measurements.have(o)) {
            linearised.clear_output(output);
        }
        linearised
    }

    /// Clears the slopes of an output that never counts, so that the steady filter takes nothing from it.
    fn clear_output(&mut self, output: usize) {
        for slopes in self.free.iter_mut().chain([&mut self.held]) {
            slopes.outputs.row_mut(output).fill(0.0);
        }
    }

    #[inline(always)]
    fn add_sample<E: Equations<NX>>(&mut self, case: &Case<NX, E>, sample: usize, share: f64) {
        let x = &case.motion.states[sample];
        let unit = UnitSlopes::at(case, sample, x);
        let held = case.held.at(2 * sample);
        let mut whole = unit.still;
        for (k, value) in held.coefficients(x).into_iter().enumerate() {
            whole.add(&unit.changes[k], value);
            for i in 0..NX {
                unit.add_through_coefficient(k, i, held.slope[k][i], &mut whole);
            }
        }
        self.held.add(&whole, share);
        for (term, sum) in case.terms.iter().zip(&mut self.free) {
            let column = case.columns[term.column][2 * sample];
            let regressor = column * term.state.map_or(1.0, |i| x[i]);
            sum.add(&unit.changes[term.coefficient], share * regressor);
            if let Some(state) = term.state {
                unit.add_through_coefficient(term.coefficient, state, share * column, sum);
            }
        }
    }

    /// System of one step with these derivatives.
    #[inline(always)]
    pub fn discrete(&self, derivatives: &[f64]) -> DiscreteSystem<'_, NX> {
        let mut mean = self.held;
        for (free, value) in self.free.iter().zip(derivatives) {
            mean.add(free, *value);
        }
        let exponential = Exponential::of(mean.rates * self.step_s);
        DiscreteSystem {
            linearised: self,
            system: Discrete {
                step: exponential.sums[ORDER],
                outputs: mean.outputs,
            },
            exponential,
        }
    }
}

/// Sums of the slopes over the samples, compiled for the processor at hand.
struct SlopeSums<'a, const NX: usize, E: Equations<NX>> {
    case: &'a Case<NX, E>,
    sums: &'a mut Linearised<NX>,
}

impl<const NX: usize, E: Equations<NX>> WithSimd for SlopeSums<'_, NX, E> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let samples = (0..self.case.samples()).step_by(SLOPE_STRIDE);
        let share = 1.0 / samples.len().max(1) as f64;
        for sample in samples {
            self.sums.add_sample(self.case, sample, share);
        }
    }
}

/// System of one step for given derivatives.
pub(super) struct DiscreteSystem<'a, const NX: usize> {
    linearised: &'a Linearised<NX>,
    pub system: Discrete<NX>,
    exponential: Exponential<NX>,
}

impl<const NX: usize> DiscreteSystem<'_, NX> {
    /// Slopes of the system along the free derivatives.
    #[inline(always)]
    pub fn slopes(&self) -> Vec<Discrete<NX>> {
        let Linearised { step_s, free, .. } = self.linearised;
        let mut slopes = Vec::with_capacity(free.len());
        for free in free {
            slopes.push(Discrete {
                step: self.exponential.slope(&(free.rates * *step_s)),
                outputs: free.outputs,
            });
        }
        slopes
    }
}

/// Slopes of rates and outputs at one sample, by coefficient.
struct UnitSlopes<const NX: usize> {
    /// Slopes at zero coefficients.
    still: StateSlopes<NX>,
    /// Changes of the slopes per unit of each coefficient that does not depend on the state.
    changes: [StateSlopes<NX>; COEFFICIENTS],
    rates: SMatrix<f64, NX, COEFFICIENTS>,
    outputs: SMatrix<f64, OUTPUTS, COEFFICIENTS>,
}

impl<const NX: usize> UnitSlopes<NX> {
    #[inline(always)]
    fn at<E: Equations<NX>>(case: &Case<NX, E>, sample: usize, x: &SVector<f64, NX>) -> Self {
        let (inputs, sensors) = (
            &case.motion.rate_inputs[2 * sample],
            &case.motion.sensor_inputs[sample],
        );
        let slopes = |c: &[f64; COEFFICIENTS]| StateSlopes {
            rates: E::rates(inputs, x, c).by_state,
            outputs: E::outputs(inputs, sensors, x, c).by_state,
        };
        let still = slopes(&[0.0; COEFFICIENTS]);
        let changes = std::array::from_fn(|k| {
            let mut c = [0.0; COEFFICIENTS];
            c[k] = 1.0;
            let mut change = slopes(&c);
            change.add(&still, -1.0);
            change
        });
        UnitSlopes {
            still,
            changes,
            rates: E::rates(inputs, x, &[0.0; COEFFICIENTS]).by_coefficient,
            outputs: E::outputs(inputs, sensors, x, &[0.0; COEFFICIENTS]).by_coefficient,
        }
    }

    /// Adds the slopes by a coefficient's slope along a state: one column.
    #[inline(always)]
    fn add_through_coefficient(
        &self,
        k: usize,
        state: usize,
        slope: f64,
        sum: &mut StateSlopes<NX>,
    ) {
        for i in 0..NX {
            sum.rates[(i, state)] += self.rates[(i, k)] * slope;
        }
        for o in 0..OUTPUTS {
            sum.outputs[(o, state)] += self.outputs[(o, k)] * slope;
        }
    }
}

/// Order of the exponential: that of a Runge-Kutta step.
const ORDER: usize = 4;

/// Matrix exponential exp A to fourth order, by Horner's rule.
///
/// The sums are S₀ = 1 and S_n = 1 + A S_(n−1) / (5 − n); S₄ is the result.
struct Exponential<const N: usize> {
    a: SMatrix<f64, N, N>,
    sums: [SMatrix<f64, N, N>; ORDER + 1],
}

impl<const N: usize> Exponential<N> {
    #[inline(always)]
    fn of(a: SMatrix<f64, N, N>) -> Self {
        let mut sums = [SMatrix::identity(); ORDER + 1];
        for n in 1..=ORDER {
            let rest = product(&a, &sums[n - 1]) * SUM_FACTORS[n - 1];
            sums[n] += rest;
        }
        Exponential { a, sums }
    }

    /// Slope of exp A along the change dA of A.
    #[inline(always)]
    fn slope(&self, change: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
        let mut slope = SMatrix::zeros();
        for n in 1..=ORDER {
            slope = (product(change, &self.sums[n - 1]) + product(&self.a, &slope))
                * SUM_FACTORS[n - 1];
        }
        slope
    }
}

/// Factor 1/(5 − n) of the n-th sum.
const SUM_FACTORS: [f64; ORDER] = [1.0 / 4.0, 1.0 / 3.0, 1.0 / 2.0, 1.0];
