//! One derivative made wrong step by step: margins fall, and the first failure is where the
//! laboratory's simulator has it.

use super::fixture::{flown, shipped, specification, truth, verdict};
use crate::aero::Regressor;
use crate::dynamics::motion::{ManeuverSignals, MassProperties};
use crate::flight::signal;
use crate::lab::simulator::aerodynamics::Aerodynamics;
use crate::lab::simulator::plant::{Plant, PlantInputs};
use crate::lab::simulator::{FlownManeuver, sensors};
use crate::rigid_body::{AirData, BodyState, Euler};
use crate::tables::{MatchVerdict, MatchVerdictRow};
use crate::units::DEG;
use nalgebra::Vector3;

fn row(flown: &FlownManeuver, name: &str, factor: f64) -> MatchVerdictRow {
    verdict(flown, &flown.record, truth(flown, name, factor))
}

#[test]
fn margins_fall_monotonically_as_a_derivative_goes_wrong() {
    for (class, name, steps) in [
        ("PPSS", "Cm_de", [1.0, 1.1, 1.2, 1.3, 1.4, 1.5]),
        ("PPSS", "CN_alpha", [1.0, 1.2, 1.4, 1.6, 1.8, 2.0]),
        ("PYRS", "Cl_da", [1.0, 1.05, 1.1, 1.15, 1.2, 1.25]),
        ("PYRS", "Cn_beta", [1.0, 0.9, 0.8, 0.7, 0.6, 0.5]),
    ] {
        let flown = flown(class, 10.0);
        let margins = steps.map(|factor| row(&flown, name, factor).margin.unwrap());
        for pair in margins.windows(2) {
            assert!(pair[1] < pair[0], "{class} {name}: {margins:?}");
        }
        assert!(
            margins[0] > 0.8 && margins[5] < 0.0,
            "{class} {name}: {margins:?}"
        );
    }
}

/// The laboratory's aircraft with one derivative wrong, flown with the recorded surfaces.
struct IndependentFlight {
    plant: Plant,
    values: Vec<f64>,
    state: BodyState,
    inputs: Vec<PlantInputs>,
    step_s: f64,
}

impl IndependentFlight {
    /// From the first sample of the maneuver, where the aircraft is in balance: the coefficient's
    /// constant takes up what the wrong derivative changes there.
    #[expect(
        clippy::default_trait_access,
        reason = "the type of a gust is the simulator's own"
    )]
    fn new(flown: &FlownManeuver, wrong: &str, factor: f64) -> IndependentFlight {
        let campaign = shipped();
        let (record, aircraft) = (&flown.record, &campaign.config.aircraft);
        let settings = campaign.simulator.settings();
        let aero_model = &campaign.config.aero_model;
        let names = &settings.surface_names;
        let aerodynamics =
            Aerodynamics::new(aero_model, campaign.config.tunnel.clone(), names).unwrap();
        let first = record.sample_at(flown.maneuver.start_s);
        let range = first..record.sample_at(flown.maneuver.end_s) + 1;
        let surfaces = names.iter().map(String::as_str);
        let window = ManeuverSignals::cut(
            aircraft,
            record,
            range.clone(),
            surfaces,
            MassProperties::Recorded,
        );
        let motion = window.unwrap().motion(aircraft).at(0);
        let at = |name: &str, k: usize| record.values(name).unwrap()[k];

        let mut values: Vec<f64> = flown.truth.iter().map(|d| d.value).collect();
        let index = aero_model.derivatives.iter().position(|d| d.name == wrong);
        let index = index.unwrap();
        let derivative = &aero_model.derivatives[index];
        let error = (factor - 1.0) * values[index];
        values[index] += error;
        let at_start = match &derivative.regressor {
            Regressor::Surface(name) => at(name, first),
            Regressor::Alpha => DEG * motion.alpha,
            Regressor::Beta => DEG * motion.beta,
            other => panic!("{other:?}"),
        };
        let constant = aero_model.derivatives.iter().position(|d| {
            d.coefficient == derivative.coefficient && d.regressor == Regressor::Constant
        });
        values[constant.unwrap()] -= error * at_start;

        let inputs = range.map(|k| PlantInputs {
            surfaces: names.iter().map(|name| at(name, k)).collect(),
            thrust_lbf: at(signal::THRUST, k),
            rpm: at(signal::RPM_LEFT, k) + at(signal::RPM_RIGHT, k),
            gust: Default::default(),
            mass_slug: at(signal::MASS, k),
        });
        let state = BodyState {
            velocity: AirData::velocity(motion.velocity, motion.alpha, motion.beta),
            rates: Vector3::from(motion.rates),
            attitude: Euler {
                phi: motion.phi,
                theta: motion.theta,
                psi: 0.0,
            }
            .attitude(),
            position: Vector3::new(0.0, 0.0, at(signal::ALTITUDE, first)),
        };
        IndependentFlight {
            plant: Plant {
                aircraft: aircraft.clone(),
                aerodynamics,
                loadings: settings.loadings.clone(),
            },
            values,
            state,
            inputs: inputs.collect(),
            step_s: record.step_s,
        }
    }

    /// Largest differences of some signals from the record.
    fn differences<const N: usize>(
        mut self,
        flown: &FlownManeuver,
        signals: [&str; N],
    ) -> [Vec<(f64, f64)>; N] {
        let first = flown.record.sample_at(flown.maneuver.start_s);
        let mut pairs = signals.map(|_| Vec::new());
        for (k, inputs) in self.inputs.iter().enumerate() {
            let outputs = self.plant.evaluate(&self.state, inputs, Some(&self.values));
            let aircraft = &self.plant.aircraft;
            let readings = sensors::readings(aircraft, &self.state, inputs, &outputs);
            for (pairs, name) in pairs.iter_mut().zip(signals) {
                let computed = readings.iter().find(|(own, _)| *own == name).unwrap().1;
                let measured = flown.record.values(name).unwrap()[first + k];
                pairs.push((measured, computed));
            }
            if let Some(next) = self.inputs.get(k + 1) {
                let steps = (self.step_s, 4);
                let values = Some(self.values.as_slice());
                self.state = self
                    .plant
                    .integrate(&self.state, (inputs, next), values, steps);
            }
        }
        pairs
    }
}

/// Largest difference over the width of a tolerance.
fn ratio(pairs: &[(f64, f64)], within: f64, pct: f64) -> f64 {
    let ratios = pairs
        .iter()
        .map(|(z, y)| (z - y).abs() / within.max(0.01 * pct * z.abs()));
    ratios.fold(0.0, f64::max)
}

/// The independent verdict, from the regulation's numbers.
fn is_inside(flown: &FlownManeuver, wrong: &str, factor: f64) -> bool {
    let flight = IndependentFlight::new(flown, wrong, factor);
    if flown.maneuver.class == "PPSS" {
        let signals = [signal::THETA, signal::Q, signal::AN];
        let [theta, q, an] = flight.differences(flown, signals);
        let pitch = ratio(&theta, 1.5, 0.0).min(ratio(&q, 2.0, 0.0));
        return pitch <= 1.0 && ratio(&an, 0.1, 0.0) <= 1.0;
    }
    let [p, r] = flight.differences(flown, [signal::P, signal::R]);
    ratio(&p, 2.0, 10.0) <= 1.0 && ratio(&r, 2.0, 10.0) <= 1.0
}

#[test]
fn the_first_failure_is_where_the_laboratory_s_simulator_fails() {
    for (class, name, step) in [
        ("PPSS", "Cm_de", 0.01),
        ("PPSS", "CN_alpha", 0.02),
        ("PYRS", "Cl_da", 0.005),
        ("PYRS", "Cn_beta", -0.01),
    ] {
        let flown = flown(class, 10.0);
        let first_failure = |is_inside: &dyn Fn(f64) -> bool| {
            let factors = (1..120).map(|k| 1.0 + step * f64::from(k));
            factors
                .into_iter()
                .find(|factor| !is_inside(*factor))
                .unwrap()
        };
        let own =
            first_failure(&|factor| row(&flown, name, factor).verdict == MatchVerdict::Inside);
        let independent = first_failure(&|factor| is_inside(&flown, name, factor));
        let ratio = (own - 1.0) / (independent - 1.0);
        assert!(
            (0.9..1.1).contains(&ratio),
            "{class} {name}: {own} {independent}"
        );
    }
    let judged = specification().tests;
    assert_eq!(judged.len(), 4, "those judged above, and the Dutch roll");
}
