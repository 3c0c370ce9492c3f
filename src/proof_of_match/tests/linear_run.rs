//! Slopes of a run against free runs with small deviations.

use approx::assert_relative_eq;

use super::fixture::{flown, recording, shipped, simulation};
use crate::aero::{AeroModel, Condition, Regressor, WindTunnel};
use crate::lab::simulator::FlownManeuver;
use crate::lab::simulator::tests::{shipped_campaign, with_lag};
use crate::proof_of_match::aerodynamics::Aerodynamics;
use crate::proof_of_match::free_run::{FreeRun, Simulation, Start};
use crate::proof_of_match::linear_run::Parameter;
use crate::proof_of_match::maneuver_recording::ManeuverRecording;
use crate::proof_of_match::start::{self, PARAMETERS};

/// Samples of a run, and those in a step of it.
const STEPS: (usize, usize) = (240, 4);

/// Effect of a deviation on the motion at which differences are taken, of the order of 1e-4.
fn deviation(parameter: Parameter) -> f64 {
    match parameter {
        Parameter::Start(2) => 1e-3,
        Parameter::Start(_) => 1e-6,
        Parameter::Derivative(_) => 1e-7,
    }
}

/// Run with one parameter changed.
fn moved((simulation, start): (&Simulation, &Start), parameter: Parameter, by: f64) -> FreeRun {
    let (mut simulation, mut start) = (simulation.clone(), start.clone());
    match parameter {
        Parameter::Start(place) => start = start.with_change(place, by),
        Parameter::Derivative(place) => {
            simulation.aerodynamics.table.raise(place, by);
        }
    }
    simulation.fly(&start, STEPS.0, STEPS.1)
}

/// Compares the slopes along all parameters with central differences of free runs.
fn compare(simulation: &Simulation, aero_model: &AeroModel) {
    let start = start::matched(simulation).start;
    let derivatives = aero_model.derivatives.iter().enumerate();
    let moving = derivatives.filter(|(_, d)| d.regressor != Regressor::Constant);
    let parameters: Vec<Parameter> = moving
        .map(|(place, _)| Parameter::Derivative(place))
        .chain((0..PARAMETERS).map(Parameter::Start))
        .collect();
    let linear = simulation.fly_with_slopes((&start, &parameters), STEPS);
    assert_eq!(linear.run, simulation.fly(&start, STEPS.0, STEPS.1));
    for (row, parameter) in parameters.iter().enumerate() {
        let by = deviation(*parameter);
        let [up, down] = [by, -by].map(|by| moved((simulation, &start), *parameter, by));
        for (output, slopes) in linear.slopes.iter().enumerate() {
            let slopes = slopes.row(row);
            let largest = slopes.amax();
            for (k, slope) in slopes.iter().enumerate() {
                let difference = up.outputs[k][output] - down.outputs[k][output];
                // Rounding is 1e-13 of an output of 100.
                let rounding = 1e-12 * 100.0 / by;
                assert_relative_eq!(
                    difference / (2.0 * by),
                    *slope,
                    epsilon = 1e-5 * largest + rounding
                );
            }
        }
    }
}

#[test]
fn slopes_are_those_of_free_runs_with_small_deviations() {
    for (class, alpha_deg) in [("PPSS", 10.0), ("OLAT", 20.0), ("PYRSTV", 30.0)] {
        let flown = flown(class, alpha_deg);
        let config = &shipped().config;
        let recording = recording(&flown, &flown.record, &config.aircraft);
        let simulation = simulation(&flown, &config.aircraft, &recording, &config.tunnel);
        compare(&simulation, &config.aero_model);
    }
}

#[test]
fn slopes_of_an_aircraft_with_a_lag_are_those_of_free_runs() {
    let campaign = with_lag(shipped_campaign());
    let (aircraft, aero_model) = (&campaign.config.aircraft, &campaign.config.aero_model);
    let card = campaign.card("PPSS", 15.0).unwrap();
    let flown: FlownManeuver = campaign.simulator.fly(&card).unwrap();
    let (record, maneuver) = (&flown.record, &flown.maneuver);
    let recording = ManeuverRecording::new(record, maneuver, (aircraft, aero_model), 1.0).unwrap();
    let condition = Condition {
        alpha_deg: maneuver.alpha_deg,
        mach: maneuver.mach,
        third: None,
    };
    let model: WindTunnel = super::fixture::database(&flown, |own| own.value);
    let simulation = Simulation {
        aircraft,
        recording: &recording,
        aerodynamics: Aerodynamics::new((aircraft, aero_model), (&model, &model), &condition),
    };
    compare(&simulation, aero_model);
}
