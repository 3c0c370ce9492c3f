//! Dutch roll of the flight's own estimates against that of a model.

use approx::assert_relative_eq;

use super::fixture::{estimated, flown, recording, shipped, simulation, truth};
use crate::estimate;
use crate::lab::simulator::FlownManeuver;
use crate::numerics::statistics::random::RandomStream;
use crate::proof_of_match::dutch_roll::LateralModes;
use crate::tables::MatchedQuantity;

/// Equations of a maneuver that estimates some derivatives at the truth, with errors of so many per cent.
fn modes(flown: &FlownManeuver, names: &[&str], error_pct: f64) -> LateralModes {
    let config = &shipped().config;
    let means = estimate::means(&flown.record, &flown.maneuver, &config.aero_model).unwrap();
    let model = (&config.aircraft, &config.aero_model, &config.tunnel);
    let own = estimated(flown, names, error_pct);
    LateralModes::new(model, (&flown.maneuver, &means), &own).unwrap()
}

#[test]
fn with_less_weathercock_stability_the_dutch_roll_is_slower_as_its_root() {
    let flown = flown("PYRS", 10.0);
    let config = &shipped().config;
    let modes = modes(&flown, &[], 0.0);
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

/// Mean and standard deviation.
fn moments(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    (mean, (square / count).sqrt())
}

#[test]
fn repeat_flights_have_to_first_order_the_moments_of_drawn_ones() {
    const DRAWS: usize = 4000;
    let flown = flown("PYRS", 10.0);
    let config = &shipped().config;
    let modes = modes(&flown, &["Cl_p", "Cn_r", "Cn_beta"], 2.0);
    let recording = recording(&flown, &flown.record, &config.aircraft);
    let simulation = simulation(
        &flown,
        &config.aircraft,
        &recording,
        &truth(&flown, "", 1.0),
    );
    let table = &simulation.aerodynamics.table;
    // The maneuver holds Cl_beta: a repeat flight's estimates do not see that it deviates.
    let deviations: Vec<(usize, f64)> = ["Cn_beta", "Cn_r", "Cl_beta"]
        .iter()
        .map(|name| {
            let place = config
                .aero_model
                .derivatives
                .iter()
                .position(|d| d.name == *name);
            let truth = flown.truth.iter().find(|d| d.derivative == *name).unwrap();
            (place.unwrap(), 0.03 * truth.value.abs())
        })
        .collect();
    let mut stream = RandomStream::new(7, "repeat flights");
    let drawn: Vec<_> = (0..DRAWS)
        .map(|_| {
            let deviates: Vec<f64> = deviations.iter().map(|_| stream.normal()).collect();
            let deviation = |derivative: usize| {
                let own = deviations.iter().zip(&deviates);
                let own = own.filter(|((place, _), _)| *place == derivative);
                own.map(|((_, by), deviate)| by * deviate).sum::<f64>()
            };
            modes.of_repeat(table, deviation, &mut stream).unwrap()
        })
        .collect();
    for quantity in [
        MatchedQuantity::DutchRollPeriod,
        MatchedQuantity::DutchRollHalving,
        MatchedQuantity::DutchRollDamping,
    ] {
        let first_order = modes.of_repeats(quantity, table, &deviations).unwrap();
        let values: Vec<f64> = drawn.iter().filter_map(|d| d.value(quantity)).collect();
        let (middle, deviation) = moments(&values);
        let slopes = first_order.slopes.iter().zip(&deviations);
        let parts = slopes.map(|(slope, (_, by))| (slope * by).powi(2));
        let expected = (parts.sum::<f64>() + first_order.error.powi(2)).sqrt();
        // 4000 draws have a deviation to 1.1 %.
        assert_relative_eq!(deviation, expected, max_relative = 0.05);
        assert!(
            (middle - first_order.mean).abs() < 0.1 * expected,
            "{quantity}"
        );
        assert_relative_eq!(first_order.slopes[2], 0.0);
        assert!(first_order.slopes[0] != 0.0 && first_order.error > 0.0);
    }
}
