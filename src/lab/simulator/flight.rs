//! Flight of a card: trim, control steps, recorded samples.

use std::collections::{BTreeMap, BTreeSet};

use super::actuators::SurfaceState;
use super::card::{Card, DerivativeLookup, FlightCondition};
use super::control::Feedback;
use super::flown::{FlownManeuver, TrueDerivative};
use super::gust::{Gust, GustPath};
use super::law::ControlLaw;
use super::plant::{Plant, PlantInputs, PlantOutputs};
use super::sensors;
use super::settings::Settings;
use super::trim::{self, Trim, TrimPoint};
use crate::error::did_you_mean;
use crate::flight::record::Series;
use crate::flight::{Mark, Record, signal};
use crate::maneuver::{Maneuver, ManeuverOrigin, Quality, Recognised};
use crate::numerics::series::sample_count::nearest;
use crate::numerics::statistics::mean::{mean, root_mean_square};
use crate::rigid_body::{BodyState, DEPARTURE_DEG};
use crate::units::DEG;

/// State of the aircraft at a control step.
struct AircraftState {
    body: BodyState,
    inputs: PlantInputs,
    surfaces: Vec<SurfaceState>,
    /// Lagged α of each surface's schedule, deg.
    schedule_alpha_deg: Vec<f64>,
}

/// Constants of a card's flight.
struct CardFlight<'a> {
    plant: &'a Plant,
    settings: &'a Settings,
    card: &'a Card,
    law: &'a ControlLaw,
    trim: Trim,
    feedback: Feedback,
    frozen: Option<Vec<f64>>,
    gusts: Vec<Gust>,
    step_s: f64,
}

/// Flies a card from trim.
///
/// # Errors
/// The reason: no trim, no stabilising feedback, or a departure.
pub fn fly(plant: &Plant, settings: &Settings, card: &Card) -> Result<FlownManeuver, String> {
    let flight = CardFlight::new(plant, settings, card)?;
    let per_sample = settings.steps_per_sample();
    let samples = nearest(card.program.duration_s * settings.rate_hz) + 1;
    let mut state = flight.initial_state();
    let mut signals: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let mut alphas_deg = Vec::with_capacity(samples);
    for step in 0..samples * per_sample {
        let outputs = flight.evaluate(&state);
        if has_departed(&state, &outputs) {
            let time_s = step as f64 * flight.step_s;
            return Err(format!("the aircraft departs at {time_s:.1} s of the card"));
        }
        if step % per_sample == 0 {
            alphas_deg.push(outputs.air.alpha * DEG);
            for (name, value) in flight.signals(&state, &outputs, step) {
                signals.entry(name).or_default().push(value);
            }
        }
        state = flight.advance(&state, &outputs, step);
    }
    if let Some(heading) = signals.get_mut(signal::PSI) {
        unwrap_heading(heading);
    }
    Ok(flight.flown(signals, &alphas_deg))
}

/// Gusts of turbulence and discrete gusts together, along a path.
fn gusts(condition: &FlightCondition, path: &GustPath, seed: u64) -> Vec<Gust> {
    let mut sum = vec![Gust::default(); path.count];
    let turbulence = condition.turbulence.iter();
    let discrete = condition.discrete_gusts.iter();
    let parts = turbulence
        .map(|t| t.gusts(path, seed))
        .chain(discrete.map(|d| d.gusts(path, seed)));
    for part in parts {
        for (total, gust) in sum.iter_mut().zip(&part) {
            *total = total.plus(gust);
        }
    }
    sum
}

fn has_departed(state: &AircraftState, outputs: &PlantOutputs) -> bool {
    let limit = DEPARTURE_DEG / DEG;
    let within = outputs.air.alpha.abs() < limit && outputs.air.beta.abs() < limit;
    !(state.body.is_finite() && within)
}

/// Removes the jumps of ±360° from a heading.
fn unwrap_heading(heading: &mut [f64]) {
    let mut offset = 0.0;
    let mut previous = heading.first().copied().unwrap_or(0.0);
    for value in heading {
        let jump = *value - previous;
        previous = *value;
        offset -= if jump.abs() > 180.0 {
            360.0 * jump.signum()
        } else {
            0.0
        };
        *value += offset;
    }
}

impl<'a> CardFlight<'a> {
    fn new(
        plant: &'a Plant,
        settings: &'a Settings,
        card: &'a Card,
    ) -> Result<CardFlight<'a>, String> {
        let law = settings.laws.get(&card.program.law).ok_or_else(|| {
            let near = did_you_mean(&card.program.law, settings.laws.keys().map(String::as_str));
            format!("no law `{}`{near}", card.program.law)
        })?;
        let trim = trim::trim(plant, settings, TrimPoint::of(card))?;
        let at_trim = plant.aerodynamics.values(card.alpha_deg, trim.air.mach);
        let feedback = Feedback::new(plant, settings, law, &trim, &at_trim)?;
        let step_s = 1.0 / settings.control_hz;
        let steps =
            (nearest(card.program.duration_s * settings.rate_hz) + 2) * settings.steps_per_sample();
        let path = GustPath {
            speed_ft_s: trim.air.velocity_ft_s,
            span_ft: plant.aircraft.span_ft,
            step_s,
            count: steps,
        };
        let gusts = gusts(&card.condition, &path, card.seed);
        let frozen = (card.condition.derivatives == DerivativeLookup::Frozen).then_some(at_trim);
        Ok(CardFlight {
            plant,
            settings,
            card,
            law,
            trim,
            feedback,
            frozen,
            gusts,
            step_s,
        })
    }

    /// Trimmed state in the first gust, at the trimmed airspeed.
    fn initial_state(&self) -> AircraftState {
        let mut inputs = self.trim.inputs.clone();
        inputs.gust = self.gust(0);
        let body = BodyState {
            velocity: self.trim.state.velocity + inputs.gust.velocity,
            ..self.trim.state
        };
        let surfaces = inputs
            .surfaces
            .iter()
            .map(|deg| SurfaceState {
                deg: *deg,
                deg_s: 0.0,
            })
            .collect();
        AircraftState {
            body,
            surfaces,
            schedule_alpha_deg: vec![self.card.alpha_deg; inputs.surfaces.len()],
            inputs,
        }
    }

    fn gust(&self, step: usize) -> Gust {
        self.gusts.get(step).copied().unwrap_or_default()
    }

    fn evaluate(&self, state: &AircraftState) -> PlantOutputs {
        self.plant
            .evaluate(&state.body, &state.inputs, self.frozen.as_deref())
    }

    /// Sum of the test inputs on a signal at a control step.
    fn test_input(&self, name: &str, step: usize) -> f64 {
        let time_s = step as f64 * self.step_s;
        self.card
            .program
            .inputs
            .iter()
            .filter(|input| input.signal == name)
            .map(|input| input.deflection_at(time_s))
            .sum()
    }

    /// Surface commands at a control step, deg: trim or schedule, test inputs, gearing, feedback.
    fn commands(&self, state: &AircraftState, outputs: &PlantOutputs, step: usize) -> Vec<f64> {
        let mut commands = self.trim.inputs.surfaces.clone();
        for ((command, name), alpha_deg) in commands
            .iter_mut()
            .zip(&self.settings.surface_names)
            .zip(&state.schedule_alpha_deg)
        {
            if let Some(schedule) = self.settings.schedules.get(name) {
                *command = schedule.deflection_at(*alpha_deg);
            }
            *command += self.test_input(name, step);
            for (stick, gears) in &self.law.gearing {
                *command += gears
                    .get(name)
                    .map_or(0.0, |gear| gear * self.test_input(stick, step));
            }
        }
        self.feedback
            .apply(&state.body, &outputs.air, &mut commands);
        commands
    }

    /// Integrates one control step.
    fn advance(&self, state: &AircraftState, outputs: &PlantOutputs, step: usize) -> AircraftState {
        let surfaces = self.moved_surfaces(state, &self.commands(state, outputs, step));
        let inputs = self.next_inputs(state, &surfaces, step);
        let body = self.plant.integrate(
            &state.body,
            (&state.inputs, &inputs),
            self.frozen.as_deref(),
            (self.step_s, self.settings.parts),
        );
        AircraftState {
            body,
            inputs,
            surfaces,
            schedule_alpha_deg: self.lagged_alphas(state, outputs.air.alpha * DEG),
        }
    }

    fn moved_surfaces(&self, state: &AircraftState, commands: &[f64]) -> Vec<SurfaceState> {
        let actuators = self.settings.surfaces.values();
        actuators
            .zip(&state.surfaces)
            .zip(commands)
            .map(|((actuator, surface), command)| actuator.advance(*surface, *command, self.step_s))
            .collect()
    }

    /// First-order lag of the α that enters each surface's schedule.
    fn lagged_alphas(&self, state: &AircraftState, alpha_deg: f64) -> Vec<f64> {
        let lagged = |(name, previous): (&String, &f64)| {
            let lag_s = self.settings.schedules.get(name).map_or(0.0, |s| s.lag_s);
            let decay = if lag_s > 0.0 {
                (-self.step_s / lag_s).exp()
            } else {
                0.0
            };
            alpha_deg + decay * (previous - alpha_deg)
        };
        self.settings
            .surface_names
            .iter()
            .zip(&state.schedule_alpha_deg)
            .map(lagged)
            .collect()
    }

    /// Inputs of the plant at the end of a control step.
    fn next_inputs(
        &self,
        state: &AircraftState,
        surfaces: &[SurfaceState],
        step: usize,
    ) -> PlantInputs {
        let engine = &self.settings.engine;
        let throttle_lbf = self.trim.inputs.thrust_lbf + self.test_input(signal::THRUST, step);
        let altitude_ft = state.body.position.z;
        let thrust_lbf = engine.advance(
            state.inputs.thrust_lbf,
            throttle_lbf,
            altitude_ft,
            self.step_s,
        );
        let burnt_slug = engine.fuel_slug_per_lbf_s * state.inputs.thrust_lbf * self.step_s;
        PlantInputs {
            surfaces: surfaces.iter().map(|s| s.deg).collect(),
            thrust_lbf,
            rpm: 2.0 * engine.rpm(thrust_lbf),
            gust: self.gust(step + 1),
            mass_slug: state.inputs.mass_slug - burnt_slug,
        }
    }

    /// All recorded signals at a control step.
    fn signals(
        &self,
        state: &AircraftState,
        outputs: &PlantOutputs,
        step: usize,
    ) -> Vec<(String, f64)> {
        let time_s = step as f64 * self.step_s;
        let readings = sensors::readings(&self.plant.aircraft, &state.body, &state.inputs, outputs);
        let surfaces = self
            .settings
            .surface_names
            .iter()
            .zip(&state.inputs.surfaces)
            .map(|(name, deg)| (name.clone(), *deg));
        let laws = self.settings.laws.values();
        let sticks: BTreeSet<&String> = laws.flat_map(|law| law.gearing.keys()).collect();
        let sticks = sticks
            .into_iter()
            .map(|name| (name.clone(), self.test_input(name, step)));
        let flags = self.card.program.flags.iter().map(|(name, (from, to))| {
            let is_set = (*from..*to).contains(&time_s);
            (name.clone(), f64::from(u8::from(is_set)))
        });
        readings
            .into_iter()
            .map(|(name, value)| (name.to_owned(), value))
            .chain(surfaces)
            .chain(sticks)
            .chain(flags)
            .collect()
    }

    fn flown(&self, signals: BTreeMap<String, Vec<f64>>, alphas_deg: &[f64]) -> FlownManeuver {
        let measured = |values: Vec<f64>| Series {
            marks: vec![Mark::Measured; values.len()],
            values,
        };
        let record = Record {
            flight_id: self.card.flight_id.clone(),
            start_s: self.card.start_s,
            step_s: 1.0 / self.settings.rate_hz,
            samples: alphas_deg.len(),
            signals: signals
                .into_iter()
                .map(|(name, values)| (name, measured(values)))
                .collect(),
            remaining_errors: BTreeMap::new(),
        };
        let maneuver = self.maneuver(&record, alphas_deg);
        FlownManeuver {
            truth: self.truth(&maneuver),
            record,
            maneuver,
        }
    }

    /// True derivatives: the frozen values, or the tables at the maneuver's mean α and Mach number.
    fn truth(&self, maneuver: &Maneuver) -> Vec<TrueDerivative> {
        let aerodynamics = &self.plant.aerodynamics;
        let values = self
            .frozen
            .clone()
            .unwrap_or_else(|| aerodynamics.values(maneuver.alpha_deg, maneuver.mach));
        aerodynamics
            .derivatives()
            .iter()
            .zip(values)
            .map(|(derivative, value)| TrueDerivative {
                derivative: derivative.name.clone(),
                unit: derivative.unit().name(),
                value,
            })
            .collect()
    }

    fn maneuver(&self, record: &Record, alphas_deg: &[f64]) -> Maneuver {
        let (from_s, to_s) = self.card.program.maneuver_s;
        let first = record.sample_at(record.start_s + from_s);
        let last = record.sample_at(record.start_s + to_s).max(first);
        let mean_of = |name: &str| {
            let values = record.values(name).and_then(|v| v.get(first..=last));
            mean(values.unwrap_or_default().iter().copied())
        };
        let start_s = record.time_s(first);
        let alphas_deg = alphas_deg.get(first..=last).unwrap_or_default();
        let alpha_deg = mean(alphas_deg.iter().copied());
        let about_mean = alphas_deg.iter().map(|alpha| alpha - alpha_deg);
        Maneuver {
            maneuver_id: format!("{}_t{:05}", record.flight_id, start_s.floor()),
            flight_id: record.flight_id.clone(),
            class: self.card.class.clone(),
            axis: self.card.axis,
            start_s,
            end_s: record.time_s(last),
            alpha_deg,
            mach: mean_of(signal::MACH),
            qbar_psf: mean_of(signal::QBAR),
            velocity_ft_s: mean_of(signal::VELOCITY),
            altitude_ft: mean_of(signal::ALTITUDE),
            mass_slug: mean_of(signal::MASS),
            x_cg_ft: mean_of(signal::X_CG),
            samples: last - first + 1,
            origin: ManeuverOrigin::Flown,
            recognised: Recognised::default(),
            quality: Quality {
                alpha_rms_deg: Some(root_mean_square(about_mean)),
                ..Quality::default()
            },
        }
    }
}
