//! Stated probabilities against repeat flights of aircraft that are drawn from the posterior.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::fixture::{
    database, flown, noisy, proof_with, recording, shipped, simulation, specification, truth,
};
use crate::aero::{Derivative, Regressor, WindTunnel};
use crate::flight::Record;
use crate::lab::simulator::FlownManeuver;
use crate::model::{LocalKind, LocalPosterior, LocalValue};
use crate::numerics::statistics::forecasts::reliability;
use crate::numerics::statistics::random::RandomStream;
use crate::proof_of_match::outputs::MATCHED;
use crate::proof_of_match::start;
use crate::tables::MatchVerdict;

/// Repeat flights of each maneuver.
const REPEATS: u32 = 40;

/// Posterior about the truth: independent errors in per cent of the derivatives of the axis.
pub fn posterior(flown: &FlownManeuver, error_pct: f64) -> LocalPosterior {
    let aero_model = &shipped().config.aero_model;
    let is_known = |d: &&Derivative| d.regressor != Regressor::Constant;
    let derivatives = aero_model
        .derivatives_of(flown.maneuver.axis)
        .filter(is_known);
    let derivatives: Vec<&Derivative> = derivatives.collect();
    let value = |d: &&Derivative| {
        let own = flown.truth.iter().find(|own| own.derivative == d.name);
        own.unwrap().value
    };
    let mean = DVector::from_iterator(derivatives.len(), derivatives.iter().map(value));
    let deviations = mean.map(|value| 0.01 * error_pct * value);
    LocalPosterior {
        values: derivatives
            .iter()
            .map(|d| LocalValue {
                coefficient: d.coefficient,
                derivative: d.name.clone(),
                kind: LocalKind::Derivative,
                is_mach_slope: false,
            })
            .collect(),
        covariance: DMatrix::from_diagonal(&deviations.map(|d| d * d)),
        mean,
    }
}

/// Database of an aircraft drawn from a posterior.
pub fn drawn(
    flown: &FlownManeuver,
    posterior: &LocalPosterior,
    stream: &mut RandomStream,
) -> WindTunnel {
    let values = posterior.values.iter().enumerate();
    let values: BTreeMap<&str, f64> = values
        .map(|(i, value)| {
            let deviation = posterior.covariance[(i, i)].sqrt() * stream.normal();
            (value.derivative.as_str(), posterior.mean[i] + deviation)
        })
        .collect();
    database(flown, |own| {
        let drawn = values.get(own.derivative.as_str());
        drawn.copied().unwrap_or(own.value)
    })
}

/// Record of a repeat flight: the outputs of an aircraft that flies with the recorded surfaces, and
/// noise.
fn repeat(flown: &FlownManeuver, aircraft: &WindTunnel, seed: u64) -> Record {
    let own = &shipped().config.aircraft;
    let recording = recording(flown, &flown.record, own);
    let simulation = simulation(flown, own, &recording, aircraft);
    let start = start::matched(&simulation).start;
    let run = simulation.fly(&start, recording.samples, 1);
    assert!(!run.has_departed);
    let mut repeat = flown.clone();
    let first = flown.record.sample_at(flown.maneuver.start_s);
    for (output, quantity) in MATCHED.iter().enumerate() {
        let series = repeat.record.signals.get_mut(quantity.name()).unwrap();
        for (k, outputs) in run.outputs.iter().enumerate() {
            series.values[first + k] = outputs[output];
        }
    }
    noisy(&repeat, seed)
}

#[test]
fn stated_probabilities_are_the_shares_of_repeat_flights_that_pass() {
    let mut expected = 0.0;
    let mut passed = 0.0;
    let mut variance = 0.0;
    for (class, alpha_deg, error_pct) in [
        ("PPSS", 10.0, 10.0),
        ("PYRS", 10.0, 8.0),
        ("PPSS", 20.0, 20.0),
        ("OLAT", 20.0, 10.0),
    ] {
        let flown = flown(class, alpha_deg);
        let local = posterior(&flown, error_pct);
        let mean = truth(&flown, "", 1.0);
        let mut stream = RandomStream::new(11, class);
        let mut shares = (0.0, 0.0);
        for seed in 0..REPEATS {
            let aircraft = drawn(&flown, &local, &mut stream);
            let record = repeat(&flown, &aircraft, u64::from(seed));
            let matched = proof_with(
                &flown,
                &record,
                (mean.clone(), &mean, (seed == 0).then_some(&local)),
                &specification(),
            );
            let verdict = &matched.verdicts[0];
            if seed == 0 {
                shares.0 = 0.01 * verdict.repeat_pct.unwrap();
            }
            let inside = u8::from(verdict.verdict == MatchVerdict::Inside);
            shares.1 += f64::from(inside) / f64::from(REPEATS);
        }
        let error = (0.25 / f64::from(REPEATS)).sqrt();
        assert!(
            (shares.0 - shares.1).abs() < 3.0 * error,
            "{class} {alpha_deg}: {shares:?}"
        );
        expected += shares.0;
        passed += shares.1;
        variance += shares.0 * (1.0 - shares.0) / f64::from(REPEATS);
    }
    assert!(
        (0.8..3.2).contains(&expected),
        "neither certain: {expected}"
    );
    let together = (passed - expected).abs();
    assert!(
        together < 3.0 * f64::sqrt(variance),
        "{passed} of {expected}"
    );
}

#[test]
fn a_deficiency_of_the_posterior_is_expected_again_in_the_repeat_flight() {
    let flown = flown("PPSS", 10.0);
    let record = noisy(&flown, 3);
    // A narrow posterior around a wrong derivative.
    let local = posterior(&flown, 1.0);
    let mean = truth(&flown, "Cm_de", 1.8);
    let judged = |model: WindTunnel| {
        let models = (model, &mean, Some(&local));
        let verdict = proof_with(&flown, &record, models, &specification())
            .verdicts
            .remove(0);
        (verdict.verdict, 0.01 * verdict.repeat_pct.unwrap())
    };
    let (verdict, probability) = judged(mean.clone());
    assert_eq!(verdict, MatchVerdict::Outside);
    assert!(probability < 0.05, "{probability}");
    let (verdict, probability) = judged(truth(&flown, "", 1.0));
    assert_eq!(verdict, MatchVerdict::Inside);
    assert!(probability > 0.95, "{probability}");
}

/// Forecast of one repeat flight, and whether it passes.
fn forecast(flown: &FlownManeuver, error_pct: f64, seed: u32) -> (f64, bool) {
    let local = posterior(flown, error_pct);
    let mean = truth(flown, "", 1.0);
    let mut stream = RandomStream::new(u64::from(seed), &flown.maneuver.maneuver_id);
    let aircraft = drawn(flown, &local, &mut stream);
    let record = repeat(flown, &aircraft, u64::from(seed));
    let models = (mean.clone(), &mean, Some(&local));
    let verdict = proof_with(flown, &record, models, &specification())
        .verdicts
        .remove(0);
    let is_inside = verdict.verdict == MatchVerdict::Inside;
    (0.01 * verdict.repeat_pct.unwrap(), is_inside)
}

/// `make match-study`.
#[test]
#[ignore = "half a minute: 540 maneuvers of nine classes"]
fn probabilities_are_calibrated_over_540_maneuvers() {
    let classes: Vec<&String> = shipped().cards.programs.keys().collect();
    let of_class = |class: &&String| {
        let mut forecasts = Vec::new();
        for alpha_deg in [10.0, 20.0, 30.0] {
            let flown = flown(class, alpha_deg);
            for seed in 0..20 {
                let error_pct = [5.0, 10.0, 20.0, 30.0][seed as usize % 4];
                forecasts.push(forecast(&flown, error_pct, seed));
            }
        }
        forecasts
    };
    let forecasts: Vec<(f64, bool)> = classes.par_iter().flat_map_iter(of_class).collect();
    assert_eq!(forecasts.len(), 540);
    let score = reliability(&forecasts);
    assert!(score < 0.01, "reliability part of the Brier score: {score}");
}
