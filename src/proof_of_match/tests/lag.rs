//! Aircraft whose coefficients depend on the rate of the angle of attack.

use super::fixture::database;
use crate::aero::{Condition, Regressor};
use crate::lab::simulator::FlownManeuver;
use crate::lab::simulator::tests::{shipped_campaign, with_lag};
use crate::proof_of_match::aerodynamics::Aerodynamics;
use crate::proof_of_match::free_run::Simulation;
use crate::proof_of_match::maneuver_recording::ManeuverRecording;
use crate::proof_of_match::start;

/// Place of α among the outputs.
const ALPHA: usize = 0;

#[test]
fn a_lag_is_flown_again() {
    let campaign = with_lag(shipped_campaign());
    let (aircraft, aero_model) = (&campaign.config.aircraft, &campaign.config.aero_model);
    let card = campaign.card("PPSS", 15.0).unwrap();
    let flown: FlownManeuver = campaign.simulator.fly(&card).unwrap();
    let recorded = (&flown.record, &flown.maneuver);
    let recording =
        ManeuverRecording::new(recorded.0, recorded.1, (aircraft, aero_model), 1.0).unwrap();
    let condition = Condition {
        alpha_deg: flown.maneuver.alpha_deg,
        mach: flown.maneuver.mach,
        third: None,
    };
    let largest_difference = |factor: f64| {
        let model = database(&flown, |own| {
            let derivative = aero_model.derivative(&own.derivative).unwrap();
            let is_lag = derivative.regressor == Regressor::AlphaRate;
            own.value * if is_lag { factor } else { 1.0 }
        });
        let simulation = Simulation {
            aircraft,
            recording: &recording,
            aerodynamics: Aerodynamics::new((aircraft, aero_model), (&model, &model), &condition),
        };
        let start = start::matched(&simulation).start;
        let run = simulation.fly(&start, recording.samples, 1);
        let pairs = run.outputs.iter().zip(&recording.measured);
        let differences = pairs.map(|(own, measured)| (own[ALPHA] - measured[ALPHA]).abs());
        differences.fold(0.0, f64::max)
    };
    let [with, without] = [1.0, 0.0].map(largest_difference);
    assert!(with < 0.1, "{with}");
    assert!(without > 5.0 * with, "{without} beside {with}");
}
