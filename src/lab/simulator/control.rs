//! Control: feedback that holds a trim, sticks geared to the surfaces, and flaps scheduled with α.
//!
//! The feedback of each axis is the linear-quadratic regulator of the motion linearised at the trim
//! by finite differences (Bryson's weights: one over the square of the deviation that is allowed),
//! so it holds a trim at any angle of attack whatever the derivatives are.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::air_data::AirData;
use super::body::{Euler, State};
use super::plant::Plant;
use super::settings::Settings;
use super::trim::Trim;
use crate::units::DEG;

/// A control law.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Law {
    /// Surfaces that feedback moves in pitch, and lateral-directionally, with the deflection it may
    /// use, deg.
    #[serde(default)]
    pub pitch: BTreeMap<String, f64>,
    #[serde(default)]
    pub lateral: BTreeMap<String, f64>,
    /// Deviations from trim that are allowed.
    #[serde(default)]
    pub hold: Hold,
    /// Pilot's control → surface → deg per inch.
    #[serde(default)]
    pub gearing: BTreeMap<String, BTreeMap<String, f64>>,
}

/// Deviations from trim that the feedback trades against the surfaces' deflection: small ones make
/// it stiff. The defaults let a test input be seen and keep the aircraft at its test point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Hold {
    pub velocity_ft_s: f64,
    pub alpha_deg: f64,
    pub q_deg_s: f64,
    pub theta_deg: f64,
    pub beta_deg: f64,
    pub p_deg_s: f64,
    pub r_deg_s: f64,
    pub phi_deg: f64,
}

impl Default for Hold {
    fn default() -> Self {
        Hold {
            velocity_ft_s: 60.0,
            alpha_deg: 8.0,
            q_deg_s: 15.0,
            theta_deg: 15.0,
            beta_deg: 6.0,
            p_deg_s: 20.0,
            r_deg_s: 10.0,
            phi_deg: 20.0,
        }
    }
}

/// Deviations of V, α, q, θ, and of β, p, r, φ, from trim: ft/s, deg, deg/s.
type Deviation = [f64; 4];

/// The states of an axis as deviations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    Pitch,
    Lateral,
}

/// The feedback around one trim.
#[derive(Clone, Debug)]
pub struct Feedback {
    /// Place of the surface, and deg per deviation.
    gains: Vec<(usize, Motion, Deviation)>,
    trim: [Deviation; 2],
}

/// V, α, q, θ and β, p, r, φ of a state.
fn motion(state: &State, air: &AirData) -> [Deviation; 2] {
    let Euler { phi, theta, .. } = state.euler();
    let w = state.rates;
    [
        [air.velocity_ft_s, air.alpha * DEG, w.y * DEG, theta * DEG],
        [air.beta * DEG, w.x * DEG, w.z * DEG, phi * DEG],
    ]
}

impl Feedback {
    /// # Errors
    /// A sentence: a surface that is not simulated, or a motion that these surfaces cannot hold.
    pub fn new(
        plant: &Plant,
        settings: &Settings,
        law: &Law,
        trim: &Trim,
        frozen: &[f64],
    ) -> Result<Feedback, String> {
        let h = &law.hold;
        let axes = [
            (
                Motion::Pitch,
                &law.pitch,
                [h.velocity_ft_s, h.alpha_deg, h.q_deg_s, h.theta_deg],
            ),
            (
                Motion::Lateral,
                &law.lateral,
                [h.beta_deg, h.p_deg_s, h.r_deg_s, h.phi_deg],
            ),
        ];
        let mut gains = Vec::new();
        for (axis, surfaces, allowed) in axes
            .into_iter()
            .filter(|(_, surfaces, _)| !surfaces.is_empty())
        {
            let places = surfaces
                .keys()
                .map(|name| settings.place(name))
                .collect::<Result<Vec<usize>, String>>()?;
            let (a, b) = linear(plant, trim, frozen, axis, &places);
            let authority: Vec<f64> = surfaces.values().copied().collect();
            let k = regulator(&a, &b, &allowed, &authority, 1.0 / settings.control_hz)
                .ok_or_else(|| format!("no feedback to {surfaces:?} holds the trim"))?;
            for (row, place) in places.into_iter().enumerate() {
                gains.push((place, axis, [0, 1, 2, 3].map(|j| k[(row, j)])));
            }
        }
        Ok(Feedback {
            gains,
            trim: motion(&trim.state, &trim.air),
        })
    }

    /// Adds to the commands, deg, what brings the motion back to trim.
    pub fn add(&self, state: &State, air: &AirData, commands: &mut [f64]) {
        let now = motion(state, air);
        for (place, axis, gains) in &self.gains {
            let (now, trim) = (now[*axis as usize], self.trim[*axis as usize]);
            let back: f64 = gains
                .iter()
                .zip(now)
                .zip(trim)
                .map(|((k, x), x0)| k * (x - x0))
                .sum();
            if let Some(command) = commands.get_mut(*place) {
                *command -= back;
            }
        }
    }
}

/// Rates of an axis's deviations at a trim with the deviations and some surfaces moved.
fn rates(
    plant: &Plant,
    trim: &Trim,
    frozen: &[f64],
    axis: Motion,
    x: Deviation,
    moved: &[(usize, f64)],
) -> Deviation {
    let mut both = motion(&trim.state, &trim.air);
    both[axis as usize]
        .iter_mut()
        .zip(x)
        .for_each(|(value, d)| *value += d);
    let [[speed, alpha, q, theta], [beta, p, r, phi]] = both;
    let psi = trim.state.euler().psi;
    let state = State {
        velocity: AirData::velocity(speed, alpha / DEG, beta / DEG),
        rates: nalgebra::Vector3::new(p, q, r) / DEG,
        attitude: Euler {
            phi: phi / DEG,
            theta: theta / DEG,
            psi,
        }
        .attitude(),
        ..trim.state
    };
    let mut given = trim.given.clone();
    for (place, deg) in moved {
        if let Some(surface) = given.surfaces.get_mut(*place) {
            *surface += deg;
        }
    }
    let instant = plant.instant(&state, &given, Some(frozen));
    let (v, v_dot, w_dot) = (state.velocity, instant.slope.velocity, instant.slope.rates);
    let (phi_dot, theta_dot) = state.euler_rates(&instant.slope);
    let speed_dot = v.dot(&v_dot) / speed;
    let across = v.x.hypot(v.z);
    let alpha_dot = (v.x * v_dot.z - v.z * v_dot.x) / (across * across);
    let beta_dot = (v_dot.y - v.y * speed_dot / speed) / across;
    match axis {
        Motion::Pitch => [speed_dot, alpha_dot * DEG, w_dot.y * DEG, theta_dot * DEG],
        Motion::Lateral => [beta_dot * DEG, w_dot.x * DEG, w_dot.z * DEG, phi_dot * DEG],
    }
}

/// ẋ = A x + B δ at the trim.
fn linear(
    plant: &Plant,
    trim: &Trim,
    frozen: &[f64],
    axis: Motion,
    places: &[usize],
) -> (DMatrix<f64>, DMatrix<f64>) {
    let slope = |at: &dyn Fn(f64) -> Deviation| {
        let h = 0.01;
        let (up, down) = (at(h), at(-h));
        [0, 1, 2, 3].map(|i| (up[i] - down[i]) / (2.0 * h))
    };
    let mut a = DMatrix::zeros(4, 4);
    for j in 0..4 {
        let column = slope(&|d| {
            let mut x = [0.0; 4];
            x[j] = d;
            rates(plant, trim, frozen, axis, x, &[])
        });
        a.set_column(j, &DVector::from_row_slice(&column));
    }
    let mut b = DMatrix::zeros(4, places.len());
    for (j, place) in places.iter().enumerate() {
        let column = slope(&|d| rates(plant, trim, frozen, axis, [0.0; 4], &[(*place, d)]));
        b.set_column(j, &DVector::from_row_slice(&column));
    }
    (a, b)
}

/// Gains K of δ = −K x that minimise Σ xᵀQx + δᵀRδ of the sampled motion, from the Riccati
/// recursion run until it settles.
fn regulator(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    allowed: &[f64],
    used: &[f64],
    step_s: f64,
) -> Option<DMatrix<f64>> {
    let n = a.nrows();
    // Σ (A t)^k / k!, and the same for the input: exact to rounding for a control step.
    let (mut phi, mut gamma) = (DMatrix::identity(n, n), DMatrix::zeros(n, n));
    let mut power = DMatrix::identity(n, n) * step_s;
    for k in 1..12_u32 {
        gamma += &power;
        power = &power * a * (step_s / f64::from(k + 1));
    }
    phi += a * &gamma;
    let gamma = gamma * b;
    let square = |x: &[f64]| {
        DMatrix::from_diagonal(&DVector::from_iterator(
            x.len(),
            x.iter().map(|v| 1.0 / (v * v)),
        ))
    };
    let (q, r) = (square(allowed) * step_s, square(used) * step_s);
    let mut p = q.clone();
    let mut gains = DMatrix::zeros(b.ncols(), n);
    for _ in 0..20_000 {
        let across = gamma.transpose() * &p;
        let next = (&r + &across * &gamma).lu().solve(&(across * &phi))?;
        let settled = (&next - &gains).norm() < 1e-10 * next.norm();
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
        // A motion that no surface reaches cannot be held.
        assert!(regulator(&one, &(&one * 0.0), &[2.0], &[1.0], 1e-2).is_none());
    }
}
