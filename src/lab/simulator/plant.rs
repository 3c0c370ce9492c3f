//! Plant: aerodynamics, thrust, angular momentum of the engines and gravity on the rigid body.

use std::borrow::Cow;

use nalgebra::Vector3;

use super::aerodynamics::Aerodynamics;
use super::gust::Gust;
use crate::aircraft::Aircraft;
use crate::earth::gravity_ft_s2;
use crate::rigid_body::{AirData, BodyState, Loading, Loads, StateRate, body};
use crate::units::DEG;

/// Inputs of the plant at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantInputs {
    /// Deflections in the order of the simulated surfaces, deg.
    pub surfaces: Vec<f64>,
    pub thrust_lbf: f64,
    /// Sum of the engine speeds, 1/min.
    pub rpm: f64,
    pub gust: Gust,
    pub mass_slug: f64,
}

impl PlantInputs {
    /// Interpolates linearly between these inputs (0) and others (1).
    fn interpolated(&self, end: &PlantInputs, fraction: f64) -> PlantInputs {
        let mix = |a: f64, b: f64| a + fraction * (b - a);
        PlantInputs {
            surfaces: self
                .surfaces
                .iter()
                .zip(&end.surfaces)
                .map(|(a, b)| mix(*a, *b))
                .collect(),
            thrust_lbf: mix(self.thrust_lbf, end.thrust_lbf),
            rpm: mix(self.rpm, end.rpm),
            gust: self.gust.interpolated(&end.gust, fraction),
            mass_slug: mix(self.mass_slug, end.mass_slug),
        }
    }
}

/// Air data, mass properties, accelerations and state rate at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantOutputs {
    pub air: AirData,
    pub loading: Loading,
    /// Specific force at the c.g. in body axes, ft/s²: force without gravity per mass.
    pub specific_force: Vector3<f64>,
    pub rate: StateRate,
}

/// The aircraft with its aerodynamics and loadings.
#[derive(Clone, Debug)]
pub struct Plant {
    pub aircraft: Aircraft,
    pub aerodynamics: Aerodynamics,
    /// At least one, by ascending mass.
    pub loadings: Vec<Loading>,
}

impl Plant {
    /// Evaluates the plant. `frozen` holds the derivatives constant; `None` reads the tables at the
    /// present α and Mach number.
    #[must_use]
    pub fn evaluate(
        &self,
        state: &BodyState,
        inputs: &PlantInputs,
        frozen: Option<&[f64]>,
    ) -> PlantOutputs {
        let at = |alpha_rate: f64| self.evaluate_at(alpha_rate, state, inputs, frozen);
        if !self.aerodynamics.have_lag() {
            return at(0.0);
        }
        let gust = inputs.gust.velocity;
        let implied = |alpha_rate: f64| {
            let rate = at(alpha_rate).rate.velocity + state.rates.cross(&gust);
            AirData::alpha_rate(&(state.velocity - gust), &rate)
        };
        at(AirData::alpha_rate_in_balance(implied))
    }

    /// Loads and accelerations of the plant at this α̇, rad/s.
    fn evaluate_at(
        &self,
        alpha_rate: f64,
        state: &BodyState,
        inputs: &PlantInputs,
        frozen: Option<&[f64]>,
    ) -> PlantOutputs {
        let loading = Loading::at_mass(&self.loadings, inputs.mass_slug);
        let air = AirData::new(&(state.velocity - inputs.gust.velocity), state.position.z);
        let values = frozen.map_or_else(
            || Cow::Owned(self.aerodynamics.values(air.alpha * DEG, air.mach)),
            Cow::Borrowed,
        );
        let (aerodynamic, moment) = self.aerodynamics.loads(
            &self.aircraft,
            &values,
            &air,
            (&(state.rates - inputs.gust.rates), alpha_rate),
            &inputs.surfaces,
        );
        let thrust = self.aircraft.thrust(inputs.thrust_lbf, loading.cg());
        let force = aerodynamic + Vector3::new(thrust.forward_lbf, 0.0, thrust.down_lbf);
        let moment = moment + Vector3::new(0.0, thrust.pitch_ft_lbf, 0.0);
        let per_minute = 2.0 * std::f64::consts::PI / 60.0;
        let loads = Loads {
            force,
            moment,
            engine_momentum: self.aircraft.engine_inertia_slug_ft2 * inputs.rpm * per_minute,
            gravity_ft_s2: gravity_ft_s2(self.aircraft.latitude_deg, state.position.z),
        };
        PlantOutputs {
            air,
            rate: body::state_rate(state, &loading.mass(), &loads),
            loading,
            specific_force: force / loading.mass_slug,
        }
    }

    /// Integrates the state over `step_s` in `parts` Runge-Kutta steps, with inputs linear in time
    /// between `start` and `end`.
    #[must_use]
    pub fn integrate(
        &self,
        state: &BodyState,
        (start, end): (&PlantInputs, &PlantInputs),
        frozen: Option<&[f64]>,
        (step_s, parts): (f64, u32),
    ) -> BodyState {
        let mut state = *state;
        let part_count = f64::from(parts);
        for part in 0..parts {
            state = body::runge_kutta_step(&state, step_s / part_count, |state, within| {
                let inputs = start.interpolated(end, (f64::from(part) + within) / part_count);
                self.evaluate(state, &inputs, frozen).rate
            });
        }
        state
    }
}
