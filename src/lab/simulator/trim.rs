//! Trim: steady straight flight at an angle of attack and altitude, by Newton's method.
//!
//! Conditions: u̇ = v̇ = ẇ = 0 and ṗ = q̇ = ṙ = 0 without rotation or sideslip. Unknowns: speed,
//! thrust, one surface each in pitch, roll and yaw, and a small bank angle that balances the side
//! force. If level flight needs more than the maximum thrust, thrust is at its maximum and the
//! flight path angle takes its place among the unknowns.

use nalgebra::{SMatrix, SVector, Vector3};

use super::card::Card;
use super::gust::Gust;
use super::plant::{Plant, PlantInputs};
use super::settings::Settings;
use crate::earth::air;
use crate::rigid_body::{AirData, BodyState, Euler};
use crate::units::DEG;

/// Starting values of the iteration; the trim does not depend on them beyond the norm at which it ends. Gravity
/// is g of `units/constants.rs`, to four digits.
const START_GRAVITY_FT_S2: f64 = 32.17;
const START_THRUST_PER_WEIGHT: f64 = 0.3;
const START_PATH_ANGLE: f64 = -0.2;

/// Limits of the iteration: Newton steps, and halvings of each.
const NEWTON_STEPS: usize = 100;
const HALVINGS: i32 = 20;

/// Norms of the residual, ft/s²: the iteration ends below the first; the trim is valid below the
/// second.
const SOLVED: f64 = 1e-11;
const ACCEPTED: f64 = 1e-8;

/// Lower limit of the speed during the iteration.
const LEAST_SPEED_FT_S: f64 = 50.0;

/// Relative step of the central differences. It affects the rate of convergence, not the trim.
const RELATIVE_STEP: f64 = 1e-4;

/// Flight condition to trim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrimPoint {
    pub alpha_deg: f64,
    pub altitude_ft: f64,
    pub mass_slug: f64,
    pub heading_deg: f64,
}

impl TrimPoint {
    /// Flight condition at the start of a card.
    #[must_use]
    pub fn of(card: &Card) -> TrimPoint {
        TrimPoint {
            alpha_deg: card.alpha_deg,
            altitude_ft: card.altitude_ft,
            mass_slug: card.mass_slug,
            heading_deg: card.heading_deg,
        }
    }
}

/// Trimmed flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Trim {
    pub state: BodyState,
    pub inputs: PlantInputs,
    pub air: AirData,
}

/// Speed, thrust or flight path angle, pitch, roll and yaw surface, bank angle.
type Unknowns = SVector<f64, 6>;

/// Meaning of the second unknown: thrust, lbf, in level flight; or flight path angle, rad, at a given
/// thrust, lbf.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SecondUnknown {
    Thrust,
    PathAngle { thrust_lbf: f64 },
}

struct TrimProblem<'a> {
    plant: &'a Plant,
    settings: &'a Settings,
    point: TrimPoint,
    /// Scheduled deflections, or zero.
    surfaces: Vec<f64>,
    /// Indices of the pitch, roll and yaw surface.
    trimmers: [usize; 3],
    second: SecondUnknown,
}

/// Trims the aircraft at a flight condition.
///
/// # Errors
/// The reason: no balance exists, or it needs a surface beyond its limit.
pub fn trim(plant: &Plant, settings: &Settings, point: TrimPoint) -> Result<Trim, String> {
    let mut surfaces: Vec<f64> = settings.scheduled_deflections(point.alpha_deg);
    let roll = settings.surface_index(&settings.trim.roll);
    let yaw = settings.surface_index(&settings.trim.yaw);
    for trimmer in &settings.trim.pitch {
        let pitch = settings.surface_index(&trimmer.signal)?;
        let trimmers = [pitch, roll.clone()?, yaw.clone()?];
        let problem = TrimProblem {
            plant,
            settings,
            point,
            surfaces: surfaces.clone(),
            trimmers,
            second: SecondUnknown::Thrust,
        };
        let trim = problem.solve_within_thrust()?;
        let needed = trim.inputs.surfaces.get(pitch).copied().unwrap_or(0.0);
        if (trimmer.lower_deg..=trimmer.upper_deg).contains(&needed) {
            return problem.within_limits(trim);
        }
        if let Some(surface) = surfaces.get_mut(pitch) {
            *surface = needed.clamp(trimmer.lower_deg, trimmer.upper_deg);
        }
    }
    Err(format!(
        "no pitch surface can trim α = {}° within its limits",
        point.alpha_deg
    ))
}

impl TrimProblem<'_> {
    /// Solves for level flight, or for the path angle at maximum thrust.
    fn solve_within_thrust(&self) -> Result<Trim, String> {
        let limit = self.settings.engine.max_thrust(self.point.altitude_ft);
        match self.solve() {
            Ok(level) if level.inputs.thrust_lbf <= limit => Ok(level),
            _ => TrimProblem {
                second: SecondUnknown::PathAngle { thrust_lbf: limit },
                surfaces: self.surfaces.clone(),
                ..*self
            }
            .solve(),
        }
    }

    /// Rejects a trim with a surface beyond its limit.
    fn within_limits(&self, trim: Trim) -> Result<Trim, String> {
        for index in self.trimmers {
            let (Some(deg), Some(name)) = (
                trim.inputs.surfaces.get(index),
                self.settings.surface_names.get(index),
            ) else {
                continue;
            };
            if let Some(actuator) = self.settings.surfaces.get(name)
                && !(actuator.lower_deg..=actuator.upper_deg).contains(deg)
            {
                let alpha = self.point.alpha_deg;
                return Err(format!(
                    "trim at α = {alpha}° takes {deg:.1}° of `{name}`, beyond its limit"
                ));
            }
        }
        Ok(trim)
    }

    /// Flight described by a set of unknowns.
    fn flight(&self, x: &Unknowns) -> Trim {
        let alpha = self.point.alpha_deg / DEG;
        let (thrust_lbf, path_angle) = match self.second {
            SecondUnknown::Thrust => (x[1], 0.0),
            SecondUnknown::PathAngle { thrust_lbf } => (thrust_lbf, x[1]),
        };
        let phi = x[5];
        // sin γ = cos α sin θ − sin α cos φ cos θ, solved for θ.
        let (forward, down) = (alpha.cos(), alpha.sin() * phi.cos());
        let theta = down.atan2(forward)
            + (path_angle.sin() / forward.hypot(down))
                .clamp(-1.0, 1.0)
                .asin();
        let mut surfaces = self.surfaces.clone();
        for (index, deg) in self.trimmers.into_iter().zip([x[2], x[3], x[4]]) {
            if let Some(surface) = surfaces.get_mut(index) {
                *surface = deg;
            }
        }
        let velocity = AirData::velocity(x[0], alpha, 0.0);
        let psi = self.point.heading_deg / DEG;
        Trim {
            state: BodyState {
                velocity,
                rates: Vector3::zeros(),
                attitude: Euler { phi, theta, psi }.attitude(),
                position: Vector3::new(0.0, 0.0, self.point.altitude_ft),
            },
            inputs: PlantInputs {
                surfaces,
                thrust_lbf,
                rpm: 2.0 * self.settings.engine.rpm(thrust_lbf),
                gust: Gust::default(),
                mass_slug: self.point.mass_slug,
            },
            air: AirData::new(&velocity, self.point.altitude_ft),
        }
    }

    /// Residual accelerations, ft/s² and 0.02 rad/s².
    fn residual(&self, x: &Unknowns) -> Unknowns {
        let flight = self.flight(x);
        let rate = self
            .plant
            .evaluate(&flight.state, &flight.inputs, None)
            .rate;
        let (v, w) = (rate.velocity, rate.rates * 50.0);
        Unknowns::from([v.x, v.y, v.z, w.x, w.y, w.z])
    }

    fn solve(&self) -> Result<Trim, String> {
        let weight = self.point.mass_slug * START_GRAVITY_FT_S2;
        let density = air(self.point.altitude_ft).density_slug_ft3;
        let speed = (2.0 * weight / (density * self.plant.aircraft.wing_area_ft2)).sqrt();
        let second = if self.second == SecondUnknown::Thrust {
            START_THRUST_PER_WEIGHT * weight
        } else {
            START_PATH_ANGLE
        };
        let mut x = Unknowns::from([speed, second, 0.0, 0.0, 0.0, 0.0]);
        let mut residual = self.residual(&x);
        for _ in 0..NEWTON_STEPS {
            if residual.norm() < SOLVED {
                break;
            }
            let jacobian = self.jacobian(&x);
            let Some(step) = jacobian.lu().solve(&-residual) else {
                break;
            };
            let Some((next, after)) = self.damped_step(&x, &step, residual.norm()) else {
                break;
            };
            (x, residual) = (next, after);
        }
        if residual.norm() < ACCEPTED {
            Ok(self.flight(&x))
        } else {
            let (alpha, altitude_ft) = (self.point.alpha_deg, self.point.altitude_ft);
            Err(format!(
                "nothing trims α = {alpha}° at {altitude_ft} ft: {:.1e} ft/s² are left",
                residual.norm()
            ))
        }
    }

    /// Halves a Newton step until the residual decreases.
    fn damped_step(
        &self,
        x: &Unknowns,
        step: &Unknowns,
        before: f64,
    ) -> Option<(Unknowns, Unknowns)> {
        (0..HALVINGS).find_map(|halvings| {
            let next = x + step * 0.5_f64.powi(halvings);
            let after = (next[0] > LEAST_SPEED_FT_S).then(|| self.residual(&next))?;
            (after.norm() < before).then_some((next, after))
        })
    }

    /// Jacobian of the residual by central differences.
    fn jacobian(&self, x: &Unknowns) -> SMatrix<f64, 6, 6> {
        let mut jacobian = SMatrix::<f64, 6, 6>::zeros();
        for j in 0..6 {
            let h = RELATIVE_STEP * x[j].abs().max(0.1);
            let residual_at = |d: f64| {
                let mut x = *x;
                x[j] += d;
                self.residual(&x)
            };
            jacobian.set_column(j, &((residual_at(h) - residual_at(-h)) / (2.0 * h)));
        }
        jacobian
    }
}
