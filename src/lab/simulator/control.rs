//! Feedback that holds a trim: per axis the linear-quadratic regulator of the motion linearised at
//! the trim by finite differences.
//!
//! Weights after Bryson: one over the square of the allowed deviation. The regulator holds a trim at
//! any angle of attack and with any derivatives.

use nalgebra::{DMatrix, DVector, Vector3};

use super::law::ControlLaw;
use super::plant::Plant;
use super::settings::Settings;
use super::trim::Trim;
use crate::rigid_body::{AirData, BodyState, Euler};
use crate::units::DEG;

/// Step of the central differences, deg or ft/s.
const DIFFERENCE_STEP: f64 = 0.01;

/// Terms of the matrix exponential; with steps of 0.0125 s the twelfth is below rounding.
const SERIES_TERMS: u32 = 12;

/// Limit of Riccati steps: 250 s of motion at 80 steps per second.
const RICCATI_STEPS: usize = 20_000;

/// Relative change of the gains at which the recursion ends.
const GAIN_TOLERANCE: f64 = 1e-10;

/// Four motion variables of an axis: V, α, q, θ or β, p, r, φ; ft/s, deg, deg/s.
type Variables = [f64; 4];

/// Axis of the feedback.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FeedbackAxis {
    Pitch,
    Lateral,
}

/// Feedback about one trim.
#[derive(Clone, Debug)]
pub struct Feedback {
    gains: Vec<SurfaceGains>,
    trim: [Variables; 2],
}

/// Gains of one surface, deg per unit of each variable.
#[derive(Clone, Copy, Debug)]
struct SurfaceGains {
    surface: usize,
    axis: FeedbackAxis,
    gains: Variables,
}

/// Motion variables of both axes.
fn motion_variables(state: &BodyState, air: &AirData) -> [Variables; 2] {
    let Euler { phi, theta, .. } = state.euler();
    let w = state.rates;
    [
        [air.velocity_ft_s, air.alpha * DEG, w.y * DEG, theta * DEG],
        [air.beta * DEG, w.x * DEG, w.z * DEG, phi * DEG],
    ]
}

impl Feedback {
    /// Designs the feedback of a control law about a trim with frozen derivatives.
    ///
    /// # Errors
    /// The reason: a surface is not simulated, or the law's surfaces cannot stabilise the motion.
    pub fn new(
        plant: &Plant,
        settings: &Settings,
        law: &ControlLaw,
        trim: &Trim,
        frozen: &[f64],
    ) -> Result<Feedback, String> {
        let hold = &law.hold;
        let axes = [
            (
                FeedbackAxis::Pitch,
                &law.pitch,
                [
                    hold.velocity_ft_s,
                    hold.alpha_deg,
                    hold.q_deg_s,
                    hold.theta_deg,
                ],
            ),
            (
                FeedbackAxis::Lateral,
                &law.lateral,
                [hold.beta_deg, hold.p_deg_s, hold.r_deg_s, hold.phi_deg],
            ),
        ];
        let mut gains = Vec::new();
        for (axis, surfaces, allowed) in axes
            .into_iter()
            .filter(|(_, surfaces, _)| !surfaces.is_empty())
        {
            let indices = surfaces
                .keys()
                .map(|name| settings.surface_index(name))
                .collect::<Result<Vec<usize>, String>>()?;
            let (a, b) = linearised(plant, trim, frozen, axis, &indices);
            let authority: Vec<f64> = surfaces.values().copied().collect();
            let k = regulator(&a, &b, &allowed, &authority, 1.0 / settings.control_hz)
                .ok_or_else(|| format!("no feedback to {surfaces:?} holds the trim"))?;
            for (row, surface) in indices.into_iter().enumerate() {
                gains.push(SurfaceGains {
                    surface,
                    axis,
                    gains: [0, 1, 2, 3].map(|j| k[(row, j)]),
                });
            }
        }
        Ok(Feedback {
            gains,
            trim: motion_variables(&trim.state, &trim.air),
        })
    }

    /// Subtracts the feedback from the surface commands, deg.
    pub fn apply(&self, state: &BodyState, air: &AirData, commands: &mut [f64]) {
        let variables = motion_variables(state, air);
        for row in &self.gains {
            let axis = row.axis as usize;
            let feedback: f64 = row
                .gains
                .iter()
                .zip(variables[axis])
                .zip(self.trim[axis])
                .map(|((k, x), x0)| k * (x - x0))
                .sum();
            if let Some(command) = commands.get_mut(row.surface) {
                *command -= feedback;
            }
        }
    }
}

/// Rates of an axis's variables at a trim with perturbed variables and surfaces.
fn perturbed_rates(
    plant: &Plant,
    trim: &Trim,
    frozen: &[f64],
    axis: FeedbackAxis,
    perturbation: Variables,
    surfaces: &[(usize, f64)],
) -> Variables {
    let mut variables = motion_variables(&trim.state, &trim.air);
    variables[axis as usize]
        .iter_mut()
        .zip(perturbation)
        .for_each(|(value, d)| *value += d);
    let [[speed, alpha, q, theta], [beta, p, r, phi]] = variables;
    let psi = trim.state.euler().psi;
    let state = BodyState {
        velocity: AirData::velocity(speed, alpha / DEG, beta / DEG),
        rates: Vector3::new(p, q, r) / DEG,
        attitude: Euler {
            phi: phi / DEG,
            theta: theta / DEG,
            psi,
        }
        .attitude(),
        ..trim.state
    };
    let mut inputs = trim.inputs.clone();
    for (index, deg) in surfaces {
        if let Some(surface) = inputs.surfaces.get_mut(*index) {
            *surface += deg;
        }
    }
    let rate = plant.evaluate(&state, &inputs, Some(frozen)).rate;
    let (v, v_dot, w_dot) = (state.velocity, rate.velocity, rate.rates);
    let (phi_dot, theta_dot) = state.euler_rates(&rate);
    let speed_dot = v.dot(&v_dot) / speed;
    let across = v.x.hypot(v.z);
    let alpha_dot = (v.x * v_dot.z - v.z * v_dot.x) / (across * across);
    let beta_dot = (v_dot.y - v.y * speed_dot / speed) / across;
    match axis {
        FeedbackAxis::Pitch => [speed_dot, alpha_dot * DEG, w_dot.y * DEG, theta_dot * DEG],
        FeedbackAxis::Lateral => [beta_dot * DEG, w_dot.x * DEG, w_dot.z * DEG, phi_dot * DEG],
    }
}

/// Matrices A and B of ẋ = A x + B δ at the trim.
fn linearised(
    plant: &Plant,
    trim: &Trim,
    frozen: &[f64],
    axis: FeedbackAxis,
    surfaces: &[usize],
) -> (DMatrix<f64>, DMatrix<f64>) {
    let difference = |rates: &dyn Fn(f64) -> Variables| {
        let (up, down) = (rates(DIFFERENCE_STEP), rates(-DIFFERENCE_STEP));
        [0, 1, 2, 3].map(|i| (up[i] - down[i]) / (2.0 * DIFFERENCE_STEP))
    };
    let mut a = DMatrix::zeros(4, 4);
    for j in 0..4 {
        let column = difference(&|step| {
            let mut perturbation = [0.0; 4];
            perturbation[j] = step;
            perturbed_rates(plant, trim, frozen, axis, perturbation, &[])
        });
        a.set_column(j, &DVector::from_row_slice(&column));
    }
    let mut b = DMatrix::zeros(4, surfaces.len());
    for (j, surface) in surfaces.iter().enumerate() {
        let column = difference(&|step| {
            perturbed_rates(plant, trim, frozen, axis, [0.0; 4], &[(*surface, step)])
        });
        b.set_column(j, &DVector::from_row_slice(&column));
    }
    (a, b)
}

/// Gains K of δ = −K x that minimise Σ xᵀQx + δᵀRδ of the sampled motion: the fixed point of the
/// Riccati recursion. `None` when the closed loop is unstable.
fn regulator(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    allowed_deviations: &[f64],
    allowed_deflections: &[f64],
    step_s: f64,
) -> Option<DMatrix<f64>> {
    let n = a.nrows();
    // Σ (A t)^k / k! and its integral for the input: exact to rounding for a control step.
    let (mut phi, mut gamma) = (DMatrix::identity(n, n), DMatrix::zeros(n, n));
    let mut power = DMatrix::identity(n, n) * step_s;
    for k in 1..SERIES_TERMS {
        gamma += &power;
        power = &power * a * (step_s / f64::from(k + 1));
    }
    phi += a * &gamma;
    let gamma = gamma * b;
    let (q, r) = (
        bryson(allowed_deviations) * step_s,
        bryson(allowed_deflections) * step_s,
    );
    let mut p = q.clone();
    let mut gains = DMatrix::zeros(b.ncols(), n);
    for _ in 0..RICCATI_STEPS {
        let gamma_p = gamma.transpose() * &p;
        let next = (&r + &gamma_p * &gamma).lu().solve(&(gamma_p * &phi))?;
        let settled = (&next - &gains).norm() < GAIN_TOLERANCE * next.norm();
        gains = next;
        if settled {
            break;
        }
        p = &q + phi.transpose() * &p * (&phi - &gamma * &gains);
        p = (&p + p.transpose()) * 0.5;
    }
    let stable = (phi - gamma * &gains)
        .complex_eigenvalues()
        .iter()
        .all(|z| z.norm() < 1.0);
    stable.then_some(gains)
}

/// Weight matrix after Bryson: inverse squares of the allowed values.
fn bryson(allowed: &[f64]) -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVector::from_iterator(
        allowed.len(),
        allowed.iter().map(|v| 1.0 / (v * v)),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_regulator_of_an_integrator_has_its_known_gain() {
        // ẋ = δ with weights 1/4 on x and 1 on δ: K = 1/2 in the limit of short steps.
        let one = DMatrix::from_element(1, 1, 1.0);
        let k = regulator(&(&one * 0.0), &one, &[2.0], &[1.0], 1e-3).unwrap();
        assert_relative_eq!(k[(0, 0)], 0.5, max_relative = 1e-3);
        // A motion without control effect has no stabilising gain.
        assert!(regulator(&one, &(&one * 0.0), &[2.0], &[1.0], 1e-2).is_none());
    }
}
