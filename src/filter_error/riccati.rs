//! Covariance of the steady filter's prediction error, by the Riccati equation.
//!
//! | symbol | quantity |
//! |---|---|
//! | A | change of the predicted state with the corrected state one step before |
//! | C | change of the outputs with the state |
//! | Q, R | covariances of the states' noise in a step and of the outputs' noise |
//! | P, P⁺ | covariances of the predicted state's and of the corrected state's error |
//! | S = C P Cᵀ + R | covariance of the innovations |
//! | K = P Cᵀ S⁻¹ | gain |
//! | Ā = A (1 − K C) | closed loop |
//!
//! P is constant from step to step: P = A (P − P Cᵀ S⁻¹ C P) Aᵀ + Q.
//!
//! The equation is solved by doubling: each round advances by as many steps as all rounds before
//! it. The slope dP along a parameter obeys the Lyapunov equation of the closed loop, which is
//! solved by doubling too.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use nalgebra::SMatrix;

use crate::dynamics::OUTPUTS;
use crate::numerics::linear_algebra::small::{product, product_transposed, sandwich};

/// Largest number of rounds: 2²⁴ steps.
const ROUNDS: usize = 24;
/// Relative change below which a solution has settled.
const SETTLED: f64 = 1e-13;

/// Square matrix over the states, such as a covariance.
pub(super) type StateMatrix<const NX: usize> = SMatrix<f64, NX, NX>;
/// Slopes of the outputs along the states (C).
pub(super) type OutputSlopes<const NX: usize> = SMatrix<f64, OUTPUTS, NX>;

/// Linear system with noise: the matrices A, C and Q, and the diagonal of R.
#[derive(Clone, Copy, Debug)]
pub(super) struct NoisySystem<const NX: usize> {
    pub a: StateMatrix<NX>,
    pub c: OutputSlopes<NX>,
    pub q: StateMatrix<NX>,
    /// Variances of the outputs' noise, the diagonal of R.
    pub r: [f64; OUTPUTS],
}

/// Change of a system along a parameter.
pub(super) type SystemSlope<const NX: usize> = NoisySystem<NX>;

/// Steady filter of a system: gain and error covariances.
#[derive(Clone, Debug)]
pub(super) struct SteadyFilter<const NX: usize> {
    /// Covariance P of the predicted state.
    pub prediction: StateMatrix<NX>,
    /// Covariance P⁺ of the corrected state.
    corrected: StateMatrix<NX>,
    /// Gain K for the mean output noise. Only the slopes of P use it; the gains applied to samples are
    /// in `gains`.
    gain: SMatrix<f64, NX, OUTPUTS>,
    pub system: NoisySystem<NX>,
    /// Closed loop Ā, and its powers 2, 4, 8, ….
    powers: Vec<StateMatrix<NX>>,
}

impl<const NX: usize> SteadyFilter<NX> {
    /// Solves the Riccati equation; `None` if it has no finite solution.
    #[inline(always)]
    pub fn solve_system(system: NoisySystem<NX>) -> Option<Self> {
        let prediction = solve(&system)?;
        let mut s = sandwich(&system.c, &prediction);
        for o in 0..OUTPUTS {
            s[(o, o)] += system.r[o];
        }
        let gain = product(
            &product_transposed(&prediction, &system.c),
            &s.try_inverse()?,
        );
        let open = StateMatrix::identity() - product(&gain, &system.c);
        let corrected = symmetric(product(&open, &prediction));
        let mut filter = SteadyFilter {
            prediction,
            corrected,
            gain,
            system,
            powers: vec![product(&system.a, &open)],
        };
        filter.square_powers();
        Some(filter)
    }

    /// Filter without process noise: its gain is zero, whether or not the airframe is stable.
    pub fn without_process_noise(system: NoisySystem<NX>) -> Self {
        SteadyFilter {
            prediction: StateMatrix::zeros(),
            corrected: StateMatrix::zeros(),
            gain: SMatrix::zeros(),
            system,
            powers: vec![],
        }
    }

    #[inline(always)]
    fn square_powers(&mut self) {
        while let Some(last) = self.powers.last() {
            let square = product(last, last);
            if square.amax() < SETTLED || self.powers.len() >= ROUNDS {
                break;
            }
            self.powers.push(square);
        }
    }

    /// Slope dP of the prediction's covariance along a parameter, from the slopes of the system.
    ///
    /// With prefix d for a slope, and the symbols of this file,
    ///
    /// dP = Ā dP Āᵀ + A [K dR Kᵀ − K dC P⁺ − (K dC P⁺)ᵀ] Aᵀ + dA P⁺ Aᵀ + A P⁺ dAᵀ + dQ.
    ///
    /// The slope of the gain does not enter, because the gain minimises P⁺.
    #[inline(always)]
    pub fn slope(&self, change: &SystemSlope<NX>) -> StateMatrix<NX> {
        if self.powers.is_empty() {
            return StateMatrix::zeros();
        }
        let a = &self.system.a;
        let mut inner = StateMatrix::zeros();
        for (o, r) in change.r.iter().enumerate().filter(|(_, r)| **r != 0.0) {
            let column = self.gain.column(o);
            inner += column * column.transpose() * *r;
        }
        let through_outputs = product(&product(&self.gain, &change.c), &self.corrected);
        inner -= through_outputs + through_outputs.transpose();
        let through_step = product_transposed(&product(&change.a, &self.corrected), a);
        let step = through_step + through_step.transpose();
        let mut sum = symmetric(sandwich(a, &inner) + step + change.q);
        for power in &self.powers {
            sum += sandwich(power, &sum);
        }
        sum
    }
}

/// Solves for P by doubling the Riccati recursion until it settles; `None` if it does not stay
/// finite.
#[inline(always)]
fn solve<const NX: usize>(system: &NoisySystem<NX>) -> Option<StateMatrix<NX>> {
    let mut information = OutputSlopes::<NX>::zeros();
    for o in 0..OUTPUTS {
        information.set_row(o, &(system.c.row(o) / system.r[o]));
    }
    let (mut a, mut g, mut h) = (
        system.a.transpose(),
        product(&system.c.transpose(), &information),
        system.q,
    );
    for _ in 0..ROUNDS {
        let w = (StateMatrix::identity() + product(&g, &h)).try_inverse()?;
        let step = product(&product(&product(&a.transpose(), &h), &w), &a);
        let aw = product(&a, &w);
        g = symmetric(g + product_transposed(&product(&aw, &g), &a));
        a = product(&aw, &a);
        h = symmetric(h + step);
        if !h.iter().all(|v| v.is_finite()) {
            return None;
        }
        if step.amax() <= SETTLED * h.amax() {
            break;
        }
    }
    Some(h)
}

#[inline(always)]
fn symmetric<const N: usize>(m: SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    (m + m.transpose()) * 0.5
}
