//! The plant: aerodynamics, thrust, engines' momentum and gravity on the body at one instant, and
//! the step between two.

use nalgebra::Vector3;

use super::aerodynamics::Aerodynamics;
use super::air_data::AirData;
use super::body::{self, Action, Slope, State};
use super::loading::Loading;
use crate::aircraft::Aircraft;
use crate::earth::gravity_ft_s2;

/// What is given at an instant besides the state.
#[derive(Clone, Debug, PartialEq)]
pub struct Given {
    /// In the order of the simulated surfaces, deg.
    pub surfaces: Vec<f64>,
    pub thrust_lbf: f64,
    /// Sum of the engines' speeds.
    pub rpm: f64,
    /// Velocity of the air over the ground in body axes, ft/s.
    pub gust: Vector3<f64>,
    pub mass_slug: f64,
}

impl Given {
    /// Between this (0) and another instant (1).
    fn towards(&self, end: &Given, part: f64) -> Given {
        let mix = |a: f64, b: f64| a + part * (b - a);
        Given {
            surfaces: self
                .surfaces
                .iter()
                .zip(&end.surfaces)
                .map(|(a, b)| mix(*a, *b))
                .collect(),
            thrust_lbf: mix(self.thrust_lbf, end.thrust_lbf),
            rpm: mix(self.rpm, end.rpm),
            gust: self.gust.lerp(&end.gust, part),
            mass_slug: mix(self.mass_slug, end.mass_slug),
        }
    }
}

/// Everything about one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    pub air: AirData,
    pub loading: Loading,
    /// Specific force at the c.g. in body axes, ft/s²: all forces but gravity over the mass.
    pub specific_force: Vector3<f64>,
    pub slope: Slope,
}

/// The aircraft with its aerodynamics and loadings.
#[derive(Clone, Debug)]
pub struct Plant {
    pub aircraft: Aircraft,
    pub aerodynamics: Aerodynamics,
    /// By ascending mass, at least one.
    pub loadings: Vec<Loading>,
}

impl Plant {
    /// The instant of a state; `frozen` are the derivatives' values, else the tables are read at α
    /// and Mach.
    #[must_use]
    pub fn instant(&self, state: &State, given: &Given, frozen: Option<&[f64]>) -> Instant {
        let loading = Loading::at_mass(&self.loadings, given.mass_slug);
        let air = AirData::new(&(state.velocity - given.gust), state.position.z);
        let read;
        let values = if let Some(values) = frozen {
            values
        } else {
            read = self
                .aerodynamics
                .values(air.alpha * crate::units::DEG, air.mach);
            &read
        };
        let (aerodynamic, moment) =
            self.aerodynamics
                .loads(&self.aircraft, values, &air, &state.rates, &given.surfaces);
        let force = aerodynamic + Vector3::new(given.thrust_lbf, 0.0, 0.0);
        let per_minute = 2.0 * std::f64::consts::PI / 60.0;
        let action = Action {
            force,
            moment,
            engine_momentum: self.aircraft.engine_inertia_slug_ft2 * given.rpm * per_minute,
            gravity_ft_s2: gravity_ft_s2(self.aircraft.latitude_deg, state.position.z),
        };
        let slope = body::slope(state, &loading, &action);
        Instant {
            air,
            loading,
            specific_force: force / loading.mass_slug,
            slope,
        }
    }

    /// The state after `step_s`, in `parts` Runge-Kutta steps, with everything given linear in time
    /// between `start` and `end`.
    #[must_use]
    pub fn advance(
        &self,
        state: &State,
        (start, end): (&Given, &Given),
        frozen: Option<&[f64]>,
        (step_s, parts): (f64, u32),
    ) -> State {
        let mut state = *state;
        let parts_f = f64::from(parts);
        for part in 0..parts {
            state = body::step(&state, step_s / parts_f, |at, within| {
                let given = start.towards(end, (f64::from(part) + within) / parts_f);
                self.instant(at, &given, frozen).slope
            });
        }
        state
    }
}
