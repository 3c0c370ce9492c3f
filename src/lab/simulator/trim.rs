//! Trim: the steady straight flight at an angle of attack and height, found by Newton's method.
//!
//! No rotation, no sideslip: u̇ = v̇ = ẇ = 0 and ṗ = q̇ = ṙ = 0, for the speed, the thrust, one
//! surface each in pitch, roll and yaw, and a small bank that carries what side force is left.
//! Where level flight takes more thrust than there is, thrust is the greatest and the path
//! descends.

use nalgebra::{SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};

use super::air_data::AirData;
use super::body::{Euler, State};
use super::plant::{Given, Plant};
use super::settings::Settings;

/// Which surfaces trim.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrimSurfaces {
    /// The first that can within its limits; those before it stand at theirs.
    pub pitch: Vec<Trimmer>,
    pub roll: String,
    pub yaw: String,
}

/// A surface with the limits within which it is used for trim.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trimmer {
    pub signal: String,
    pub lower_deg: f64,
    pub upper_deg: f64,
}

/// What is to be flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    pub alpha_deg: f64,
    pub altitude_ft: f64,
    pub mass_slug: f64,
    pub heading_deg: f64,
}

/// Steady flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Trim {
    pub state: State,
    pub given: Given,
    pub air: AirData,
    /// Flight path above the horizon, rad.
    pub climb: f64,
}

/// Speed, thrust or path, pitch, roll and yaw surface, bank.
type Unknowns = SVector<f64, 6>;

/// What the second unknown is: thrust (lbf, for level flight), or the path (rad) at this thrust.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Power {
    Level,
    Limited(f64),
}

struct Search<'a> {
    plant: &'a Plant,
    settings: &'a Settings,
    point: Point,
    /// Surfaces at their schedule, or at zero.
    surfaces: Vec<f64>,
    /// Places of the three trimming surfaces.
    places: [usize; 3],
    power: Power,
}

/// The trim at a point, or why there is none.
///
/// # Errors
/// A sentence: nothing balances the aircraft here, or only a surface beyond its limit.
pub fn trim(plant: &Plant, settings: &Settings, point: Point) -> Result<Trim, String> {
    let mut surfaces: Vec<f64> = settings.scheduled(point.alpha_deg);
    let surfaces_of = &settings.trim;
    let [roll, yaw] = [&surfaces_of.roll, &surfaces_of.yaw].map(|name| settings.place(name));
    for trimmer in &surfaces_of.pitch {
        let pitch = settings.place(&trimmer.signal)?;
        let places = [pitch, roll.clone()?, yaw.clone()?];
        let search = Search {
            plant,
            settings,
            point,
            surfaces: surfaces.clone(),
            places,
            power: Power::Level,
        };
        let found = search.with_thrust_limit()?;
        let needed = found.given.surfaces.get(pitch).copied().unwrap_or(0.0);
        if (trimmer.lower_deg..=trimmer.upper_deg).contains(&needed) {
            return search.within_limits(found);
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

impl Search<'_> {
    fn with_thrust_limit(&self) -> Result<Trim, String> {
        let limit = self.settings.engine.max_thrust(self.point.altitude_ft);
        match self.solve() {
            Ok(level) if level.given.thrust_lbf <= limit => Ok(level),
            _ => Search {
                power: Power::Limited(limit),
                surfaces: self.surfaces.clone(),
                ..*self
            }
            .solve(),
        }
    }

    fn within_limits(&self, found: Trim) -> Result<Trim, String> {
        for place in self.places {
            let (Some(deg), Some(name)) = (
                found.given.surfaces.get(place),
                self.settings.surface_names.get(place),
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
        Ok(found)
    }

    /// The flight that a set of unknowns is.
    fn flight(&self, x: &Unknowns) -> Trim {
        let alpha = self.point.alpha_deg / crate::units::DEG;
        let (thrust_lbf, climb) = match self.power {
            Power::Level => (x[1], 0.0),
            Power::Limited(limit) => (limit, x[1]),
        };
        let phi = x[5];
        // sin γ = cos α sin θ − sin α cos φ cos θ, solved for θ.
        let (forward, down) = (alpha.cos(), alpha.sin() * phi.cos());
        let theta =
            down.atan2(forward) + (climb.sin() / forward.hypot(down)).clamp(-1.0, 1.0).asin();
        let mut surfaces = self.surfaces.clone();
        for (place, deg) in self.places.into_iter().zip([x[2], x[3], x[4]]) {
            if let Some(surface) = surfaces.get_mut(place) {
                *surface = deg;
            }
        }
        let velocity = AirData::velocity(x[0], alpha, 0.0);
        let psi = self.point.heading_deg / crate::units::DEG;
        Trim {
            state: State {
                velocity,
                rates: Vector3::zeros(),
                attitude: Euler { phi, theta, psi }.attitude(),
                position: Vector3::new(0.0, 0.0, self.point.altitude_ft),
            },
            given: Given {
                surfaces,
                thrust_lbf,
                rpm: 2.0 * self.settings.engine.rpm(thrust_lbf),
                gust: Vector3::zeros(),
                mass_slug: self.point.mass_slug,
            },
            air: AirData::new(&velocity, self.point.altitude_ft),
            climb,
        }
    }

    /// Accelerations that are to vanish, ft/s² and 0.02 rad/s².
    fn residual(&self, x: &Unknowns) -> Unknowns {
        let flight = self.flight(x);
        // In trim the tables are read where they will be frozen: at the point's α and the speed's
        // Mach number.
        let slope = self.plant.instant(&flight.state, &flight.given, None).slope;
        let (v, w) = (slope.velocity, slope.rates * 50.0);
        Unknowns::from([v.x, v.y, v.z, w.x, w.y, w.z])
    }

    fn solve(&self) -> Result<Trim, String> {
        let gravity = 32.17;
        let weight = self.point.mass_slug * gravity;
        let density = crate::earth::air(self.point.altitude_ft).density_slug_ft3;
        let speed = (2.0 * weight / (density * self.plant.aircraft.wing_area_ft2)).sqrt();
        let second = if self.power == Power::Level {
            0.3 * weight
        } else {
            -0.2
        };
        let mut x = Unknowns::from([speed, second, 0.0, 0.0, 0.0, 0.0]);
        let mut residual = self.residual(&x);
        for _ in 0..100 {
            if residual.norm() < 1e-11 {
                break;
            }
            let slopes = self.slopes(&x);
            let Some(change) = slopes.lu().solve(&-residual) else {
                break;
            };
            let Some((next, after)) = self.shortened(&x, &change, residual.norm()) else {
                break;
            };
            (x, residual) = (next, after);
        }
        if residual.norm() < 1e-8 {
            Ok(self.flight(&x))
        } else {
            let (alpha, height) = (self.point.alpha_deg, self.point.altitude_ft);
            Err(format!(
                "nothing trims α = {alpha}° at {height} ft: {:.1e} ft/s² are left",
                residual.norm()
            ))
        }
    }

    /// The first of the halved Newton steps that comes nearer.
    fn shortened(
        &self,
        x: &Unknowns,
        change: &Unknowns,
        before: f64,
    ) -> Option<(Unknowns, Unknowns)> {
        (0..20).find_map(|halvings| {
            let next = x + change * 0.5_f64.powi(halvings);
            let after = (next[0] > 50.0).then(|| self.residual(&next))?;
            (after.norm() < before).then_some((next, after))
        })
    }

    fn slopes(&self, x: &Unknowns) -> SMatrix<f64, 6, 6> {
        let mut slopes = SMatrix::<f64, 6, 6>::zeros();
        for j in 0..6 {
            let h = 1e-4 * x[j].abs().max(0.1);
            let moved = |d: f64| {
                let mut x = *x;
                x[j] += d;
                self.residual(&x)
            };
            slopes.set_column(j, &((moved(h) - moved(-h)) / (2.0 * h)));
        }
        slopes
    }
}
