//! Flying a card: trim, control steps, samples.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::actuators::Surface;
use super::body::State;
use super::control::{Feedback, Law};
use super::plant::{Given, Instant};
use super::trim::Trim;
use super::{Card, Flown, Simulator, Tables, TrueDerivative, sensors, turbulence};
use crate::flight::record::Series;
use crate::flight::{Mark, Record, signal};
use crate::maneuver::{Maneuver, ManeuverOrigin, Quality, Recognised};
use crate::units::DEG;

/// α and β beyond which the build-up means nothing and the maneuver is lost, deg.
const LOST_DEG: f64 = 90.0;

/// The aircraft between two control steps.
struct Moment {
    state: State,
    given: Given,
    surfaces: Vec<Surface>,
    /// α that each scheduled surface follows, deg.
    followed: Vec<f64>,
}

/// What stays the same over a card.
struct Flight<'a> {
    simulator: &'a Simulator,
    card: &'a Card,
    law: &'a Law,
    trim: Trim,
    feedback: Feedback,
    frozen: Option<Vec<f64>>,
    gusts: Vec<Vector3<f64>>,
    step_s: f64,
}

pub(super) fn fly(simulator: &Simulator, card: &Card) -> Result<Flown, String> {
    let flight = Flight::new(simulator, card)?;
    let per_sample = simulator.settings.steps_per_sample();
    let samples = count(card.program.duration_s * simulator.settings.rate_hz) + 1;
    let mut moment = flight.begin();
    let mut signals: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let mut alphas = Vec::with_capacity(samples);
    for k in 0..samples * per_sample {
        let instant = flight.instant(&moment);
        if !(moment.state.is_finite() && within(&instant)) {
            let time_s = k as f64 * flight.step_s;
            return Err(format!("the aircraft departs at {time_s:.1} s of the card"));
        }
        if k % per_sample == 0 {
            alphas.push(instant.air.alpha * DEG);
            for (name, value) in flight.read(&moment, &instant, k) {
                signals.entry(name).or_default().push(value);
            }
        }
        moment = flight.next(&moment, &instant, k);
    }
    if let Some(psi) = signals.get_mut(signal::PSI) {
        unwrap(psi);
    }
    Ok(flight.flown(signals, &alphas))
}

/// A whole number of steps from a number that is one but for rounding.
fn count(steps: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "rounded and not negative"
    )]
    let steps = steps.round().max(0.0) as usize;
    steps
}

fn within(instant: &Instant) -> bool {
    let limit = LOST_DEG / DEG;
    instant.air.alpha.abs() < limit && instant.air.beta.abs() < limit
}

/// A heading without the jumps of ±360°, as a recorder's own filter leaves it.
fn unwrap(heading: &mut [f64]) {
    let mut turns = 0.0;
    let mut before = heading.first().copied().unwrap_or(0.0);
    for value in heading {
        let jump = *value - before;
        before = *value;
        turns -= if jump.abs() > 180.0 {
            360.0 * jump.signum()
        } else {
            0.0
        };
        *value += turns;
    }
}

impl<'a> Flight<'a> {
    fn new(simulator: &'a Simulator, card: &'a Card) -> Result<Flight<'a>, String> {
        let (plant, settings) = (&simulator.plant, &simulator.settings);
        let law = settings.laws.get(&card.program.law).ok_or_else(|| {
            let near = crate::error::did_you_mean(
                &card.program.law,
                settings.laws.keys().map(String::as_str),
            );
            format!("no law `{}`{near}", card.program.law)
        })?;
        let trim = simulator.trim(card)?;
        let at_trim = plant.aerodynamics.values(card.alpha_deg, trim.air.mach);
        let feedback = Feedback::new(plant, settings, law, &trim, &at_trim)?;
        let step_s = 1.0 / settings.control_hz;
        let steps =
            (count(card.program.duration_s * settings.rate_hz) + 2) * settings.steps_per_sample();
        let gusts = card.turbulence.as_ref().map_or_else(
            || vec![Vector3::zeros(); steps],
            |t| turbulence::gusts(t, trim.air.velocity_ft_s, step_s, steps, card.seed),
        );
        let frozen = (card.tables == Tables::Frozen).then_some(at_trim);
        Ok(Flight {
            simulator,
            card,
            law,
            trim,
            feedback,
            frozen,
            gusts,
            step_s,
        })
    }

    fn begin(&self) -> Moment {
        let mut given = self.trim.given.clone();
        given.gust = self.gust(0);
        // The aircraft meets the first gust at its trimmed speed through the air.
        let state = State {
            velocity: self.trim.state.velocity + given.gust,
            ..self.trim.state
        };
        let surfaces = given
            .surfaces
            .iter()
            .map(|deg| Surface {
                deg: *deg,
                deg_s: 0.0,
            })
            .collect();
        Moment {
            state,
            surfaces,
            followed: vec![self.card.alpha_deg; given.surfaces.len()],
            given,
        }
    }

    fn gust(&self, k: usize) -> Vector3<f64> {
        self.gusts.get(k).copied().unwrap_or_default()
    }

    fn instant(&self, moment: &Moment) -> Instant {
        self.simulator
            .plant
            .instant(&moment.state, &moment.given, self.frozen.as_deref())
    }

    /// The sum of the inputs on a signal at a control step.
    fn input(&self, name: &str, k: usize) -> f64 {
        let time_s = k as f64 * self.step_s;
        self.card
            .program
            .inputs
            .iter()
            .filter(|i| i.signal == name)
            .map(|i| i.at(time_s))
            .sum()
    }

    /// What the surfaces are told at a control step, deg.
    fn commands(&self, moment: &Moment, instant: &Instant, k: usize) -> Vec<f64> {
        let settings = &self.simulator.settings;
        let mut commands = self.trim.given.surfaces.clone();
        for ((command, name), followed) in commands
            .iter_mut()
            .zip(&settings.surface_names)
            .zip(&moment.followed)
        {
            if let Some(schedule) = settings.schedules.get(name) {
                *command = schedule.at(*followed);
            }
            *command += self.input(name, k);
            for (stick, gears) in &self.law.gearing {
                *command += gears
                    .get(name)
                    .map_or(0.0, |gear| gear * self.input(stick, k));
            }
        }
        self.feedback
            .add(&moment.state, &instant.air, &mut commands);
        commands
    }

    /// One control step on.
    fn next(&self, moment: &Moment, instant: &Instant, k: usize) -> Moment {
        let settings = &self.simulator.settings;
        let commands = self.commands(moment, instant, k);
        let actuators = settings.surfaces.values();
        let surfaces: Vec<Surface> = actuators
            .zip(&moment.surfaces)
            .zip(&commands)
            .map(|((actuator, surface), command)| actuator.advance(*surface, *command, self.step_s))
            .collect();
        let alpha_deg = instant.air.alpha * DEG;
        let follow = |(name, before): (&String, &f64)| {
            let lag_s = settings.schedules.get(name).map_or(0.0, |s| s.lag_s);
            let keep = if lag_s > 0.0 {
                (-self.step_s / lag_s).exp()
            } else {
                0.0
            };
            alpha_deg + keep * (before - alpha_deg)
        };
        let followed = settings
            .surface_names
            .iter()
            .zip(&moment.followed)
            .map(follow)
            .collect();
        let engine = &settings.engine;
        let throttle = self.trim.given.thrust_lbf + self.input(signal::THRUST, k);
        let altitude_ft = moment.state.position.z;
        let thrust_lbf =
            engine.advance(moment.given.thrust_lbf, throttle, altitude_ft, self.step_s);
        let burnt = engine.fuel_slug_per_lbf_s * moment.given.thrust_lbf * self.step_s;
        let given = Given {
            surfaces: surfaces.iter().map(|s| s.deg).collect(),
            thrust_lbf,
            rpm: 2.0 * engine.rpm(thrust_lbf),
            gust: self.gust(k + 1),
            mass_slug: moment.given.mass_slug - burnt,
        };
        let state = self.simulator.plant.advance(
            &moment.state,
            (&moment.given, &given),
            self.frozen.as_deref(),
            (self.step_s, settings.parts),
        );
        Moment {
            state,
            given,
            surfaces,
            followed,
        }
    }

    /// Every signal at a control step.
    fn read(&self, moment: &Moment, instant: &Instant, k: usize) -> Vec<(String, f64)> {
        let settings = &self.simulator.settings;
        let time_s = k as f64 * self.step_s;
        let program = &self.card.program;
        let read = sensors::read(
            &self.simulator.plant.aircraft,
            &moment.state,
            &moment.given,
            instant,
        );
        let surfaces = settings
            .surface_names
            .iter()
            .zip(&moment.given.surfaces)
            .map(|(n, v)| (n.clone(), *v));
        let controls: std::collections::BTreeSet<&String> = settings
            .laws
            .values()
            .flat_map(|law| law.gearing.keys())
            .collect();
        let controls = controls
            .into_iter()
            .map(|name| (name.clone(), self.input(name, k)));
        let flags = program.flags.iter().map(|(name, (from, to))| {
            (
                name.clone(),
                f64::from(u8::from((*from..*to).contains(&time_s))),
            )
        });
        read.into_iter()
            .map(|(n, v)| (n.to_owned(), v))
            .chain(surfaces)
            .chain(controls)
            .chain(flags)
            .collect()
    }

    fn flown(&self, signals: BTreeMap<String, Vec<f64>>, alphas: &[f64]) -> Flown {
        let series = |values: Vec<f64>| Series {
            marks: vec![Mark::Measured; values.len()],
            values,
        };
        let record = Record {
            flight_id: self.card.flight_id.clone(),
            start_s: self.card.start_s,
            step_s: 1.0 / self.simulator.settings.rate_hz,
            samples: alphas.len(),
            signals: signals
                .into_iter()
                .map(|(name, values)| (name, series(values)))
                .collect(),
        };
        let maneuver = self.maneuver(&record, alphas);
        let aerodynamics = &self.simulator.plant.aerodynamics;
        let values = self
            .frozen
            .clone()
            .unwrap_or_else(|| aerodynamics.values(maneuver.alpha_deg, maneuver.mach));
        let truth = aerodynamics
            .derivatives()
            .iter()
            .zip(values)
            .map(|(d, value)| TrueDerivative {
                derivative: d.name.clone(),
                unit: d.unit().name(),
                value,
            });
        Flown {
            truth: truth.collect(),
            record,
            maneuver,
        }
    }

    fn maneuver(&self, record: &Record, alphas: &[f64]) -> Maneuver {
        let (from_s, to_s) = self.card.program.maneuver_s;
        let first = record.sample_at(record.start_s + from_s);
        let last = record.sample_at(record.start_s + to_s).max(first);
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let of = |name: &str| {
            mean(
                record
                    .values(name)
                    .and_then(|v| v.get(first..=last))
                    .unwrap_or_default(),
            )
        };
        let start_s = record.time_s(first);
        Maneuver {
            maneuver_id: format!("{}_t{:05}", record.flight_id, start_s.floor()),
            flight_id: record.flight_id.clone(),
            class: self.card.class.clone(),
            axis: self.card.axis,
            start_s,
            end_s: record.time_s(last),
            alpha_deg: mean(alphas.get(first..=last).unwrap_or_default()),
            mach: of(signal::MACH),
            qbar_psf: of(signal::QBAR),
            velocity_ft_s: of(signal::VELOCITY),
            altitude_ft: of(signal::ALTITUDE),
            mass_slug: of(signal::MASS),
            x_cg_ft: of(signal::X_CG),
            samples: last - first + 1,
            origin: ManeuverOrigin::Flown,
            recognised: Recognised::default(),
            quality: Quality::default(),
        }
    }
}
