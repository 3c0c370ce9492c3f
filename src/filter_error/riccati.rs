//! Covariance of the steady filter's prediction: P = A (P − P Cᵀ S⁻¹ C P) Aᵀ + Q with
//! S = C P Cᵀ + R.
//!
//! It is solved by doubling: a round goes on by as many steps as all rounds before it. Slopes of P
//! obey the closed loop's Lyapunov equation, which is doubled likewise.

use nalgebra::SMatrix;

use crate::dynamics::OUTPUTS;

/// Most rounds: 2²⁴ steps.
const ROUNDS: usize = 24;
/// Relative change below which a solution has settled.
const SETTLED: f64 = 1e-13;

/// Square matrix of the states.
pub(super) type States<const NX: usize> = SMatrix<f64, NX, NX>;
/// Outputs along the states.
pub(super) type Observation<const NX: usize> = SMatrix<f64, OUTPUTS, NX>;

/// Linear system with noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct NoisySystem<const NX: usize> {
    pub a: States<NX>,
    pub c: Observation<NX>,
    pub q: States<NX>,
    /// Variances of the outputs.
    pub r: [f64; OUTPUTS],
}

/// Change of a system along a parameter.
pub(super) type SystemSlope<const NX: usize> = NoisySystem<NX>;

/// Covariances of the steady filter.
#[derive(Clone, Debug)]
pub(super) struct SteadyFilter<const NX: usize> {
    /// Covariance of the prediction.
    pub prediction: States<NX>,
    /// Covariance of the corrected state.
    corrected: States<NX>,
    gain: SMatrix<f64, NX, OUTPUTS>,
    system: NoisySystem<NX>,
    /// Closed loop A (1 − K C), and its powers 2, 4, 8, ….
    powers: Vec<States<NX>>,
}

impl<const NX: usize> SteadyFilter<NX> {
    /// Solves the Riccati equation; `None` where it has no finite solution.
    pub fn of(system: NoisySystem<NX>) -> Option<Self> {
        let prediction = solve(&system)?;
        let mut s = system.c * prediction * system.c.transpose();
        for o in 0..OUTPUTS {
            s[(o, o)] += system.r[o];
        }
        let gain = prediction * system.c.transpose() * s.try_inverse()?;
        let open = States::identity() - gain * system.c;
        let corrected = symmetric(open * prediction);
        let mut filter = SteadyFilter {
            prediction,
            corrected,
            gain,
            system,
            powers: vec![system.a * open],
        };
        filter.square_powers();
        Some(filter)
    }

    /// Filter without process noise: it corrects nothing, whether or not the airframe is stable.
    pub fn still(system: NoisySystem<NX>) -> Self {
        SteadyFilter {
            prediction: States::zeros(),
            corrected: States::zeros(),
            gain: SMatrix::zeros(),
            system,
            powers: vec![],
        }
    }

    fn square_powers(&mut self) {
        while let Some(last) = self.powers.last().copied() {
            let square = last * last;
            if square.amax() < SETTLED || self.powers.len() >= ROUNDS {
                break;
            }
            self.powers.push(square);
        }
    }

    /// Slope of the prediction's covariance along a parameter.
    ///
    /// The corrected covariance is stationary in the gain, so only changes of the system count:
    /// dP = Ā dP Āᵀ + A [K dR Kᵀ − K dC P⁺ − (K dC P⁺)ᵀ] Aᵀ + dA P⁺ Aᵀ + A P⁺ dAᵀ + dQ.
    pub fn slope(&self, change: &SystemSlope<NX>) -> States<NX> {
        if self.powers.is_empty() {
            return States::zeros();
        }
        let a = &self.system.a;
        let mut inner = States::zeros();
        for o in 0..OUTPUTS {
            let column = self.gain.column(o);
            inner += column * column.transpose() * change.r[o];
        }
        let through_outputs = self.gain * change.c * self.corrected;
        inner -= through_outputs + through_outputs.transpose();
        let through_step = change.a * self.corrected * a.transpose();
        let source = a * inner * a.transpose() + through_step + through_step.transpose() + change.q;
        let mut sum = symmetric(source);
        for power in &self.powers {
            sum += power * sum * power.transpose();
        }
        sum
    }
}

/// Doubles the Riccati recursion until it settles.
fn solve<const NX: usize>(system: &NoisySystem<NX>) -> Option<States<NX>> {
    let mut information = Observation::<NX>::zeros();
    for o in 0..OUTPUTS {
        information.set_row(o, &(system.c.row(o) / system.r[o]));
    }
    let (mut a, mut g, mut h) = (
        system.a.transpose(),
        system.c.transpose() * information,
        system.q,
    );
    for _ in 0..ROUNDS {
        let w = (States::identity() + g * h).try_inverse()?;
        let step = a.transpose() * h * w * a;
        g = symmetric(g + a * w * g * a.transpose());
        a = a * w * a;
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

fn symmetric<const N: usize>(m: SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    (m + m.transpose()) * 0.5
}
