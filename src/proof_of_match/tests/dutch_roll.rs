//! Dutch roll of the flight's own estimates against that of a model.

use approx::assert_relative_eq;

use super::fixture::{flown, recording, shipped, simulation, truth};
use crate::estimate;
use crate::lab::simulator::FlownManeuver;
use crate::proof_of_match::OwnEstimates;
use crate::proof_of_match::dutch_roll::LateralModes;

/// Estimates without error.
fn exact(flown: &FlownManeuver) -> OwnEstimates {
    let truth = flown.truth.iter();
    OwnEstimates {
        values: truth.map(|d| (d.derivative.clone(), d.value)).collect(),
        estimated: vec![],
        covariance: vec![],
    }
}

#[test]
fn with_less_weathercock_stability_the_dutch_roll_is_slower_as_its_root_says() {
    let flown = flown("PYRS", 10.0);
    let config = &shipped().config;
    let means = estimate::means(&flown.record, &flown.maneuver, &config.buildup).unwrap();
    let model = (&config.aircraft, &config.buildup, &config.tunnel);
    let modes = LateralModes::new(model, (&flown.maneuver, &means), &exact(&flown)).unwrap();
    let recording = recording(&flown, &flown.record, &config.aircraft);
    let of = |factor: f64| {
        let database = truth(&flown, "Cn_beta", factor);
        let simulation = simulation(&flown, &config.aircraft, &recording, &database);
        modes.of_model(&simulation.aerodynamics.table).unwrap()
    };
    let same = of(1.0);
    assert_relative_eq!(same.period_s, modes.flight.period_s, max_relative = 1e-9);
    assert_relative_eq!(same.damping, modes.flight.damping, max_relative = 1e-9);
    assert!((1.0..8.0).contains(&same.period_s), "{same:?}");
    // Time to half: the amplitude falls as exp(-ζωt).
    let frequency =
        2.0 * std::f64::consts::PI / same.period_s / (1.0 - same.damping.powi(2)).sqrt();
    let decay = (-same.damping * frequency * same.half_s).exp();
    assert_relative_eq!(decay, 0.5, max_relative = 1e-9);
    let slower = of(0.7);
    assert!(slower.period_s > 1.02 * same.period_s, "{slower:?}");
    assert!(of(0.5).period_s > slower.period_s);
}
