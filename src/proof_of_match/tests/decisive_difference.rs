//! Decisive difference of a repeat flight, against flights of moved aircraft and of drawn ones.

use approx::assert_relative_eq;

use super::fixture::{
    estimated, flown, noisy, recording, shipped, simulation, specification, truth,
};
use super::repeat_flight::{drawn, posterior};
use crate::aero::{Axis, WindTunnel};
use crate::estimate;
use crate::model::LocalPosterior;
use crate::numerics::statistics::random::RandomStream;
use crate::proof_of_match::outputs::output_index;
use crate::proof_of_match::{ProofInputs, RecordedManeuver, decisive_difference};
use crate::tables::{MatchedQuantity, ModelSource};

/// Decisive difference of a class at 20 deg when a database predicts it, about the truth.
fn decisive(
    class: &str,
    database: WindTunnel,
    model: ModelSource,
    local: &LocalPosterior,
) -> crate::proof_of_match::DecisiveDifference {
    let flown = flown(class, 20.0);
    let record = noisy(&flown, 1);
    let mean = truth(&flown, "", 1.0);
    let basis = ProofInputs {
        aircraft: &shipped().config.aircraft,
        aero_model: &shipped().config.aero_model,
        models: &[(model, database)],
        posterior: &mean,
        tunnel: &shipped().config.tunnel,
        specification: &specification(),
    };
    let flown = RecordedManeuver {
        record: &record,
        maneuver: &flown.maneuver,
        local: Some(local),
        own: None,
    };
    decisive_difference(&basis, &flown).unwrap()
}

#[test]
fn its_mean_is_that_of_the_slopes_where_one_derivative_is_wrong() {
    let flown = flown("OLAT", 20.0);
    let local = posterior(&flown, 10.0);
    let right = decisive("OLAT", truth(&flown, "", 1.0), ModelSource::Tunnel, &local);
    assert_relative_eq!(right.mean, 0.0, epsilon = 1e-9);
    for derivative in ["Cl_p", "Cn_beta"] {
        let wrong = truth(&flown, derivative, 1.01);
        let own = decisive("OLAT", wrong, ModelSource::Tunnel, &local);
        let (value, slope) = own
            .slopes
            .iter()
            .find(|(value, _)| value.derivative == derivative)
            .unwrap();
        let place = local.values.iter().position(|v| v == value).unwrap();
        // The model has 1 % more, so the repeat flight has less.
        let expected = -0.01 * local.mean[place] * slope;
        assert_relative_eq!(own.mean, expected, max_relative = 0.1, epsilon = 0.02);
    }
}

#[test]
fn the_model_that_is_the_posterior_has_no_mean_difference() {
    let flown = flown("PPSS", 20.0);
    let local = posterior(&flown, 10.0);
    let database = truth(&flown, "Cm_q", 2.0);
    let own = decisive("PPSS", database, ModelSource::Posterior, &local);
    assert!(own.follows_mean);
    assert_relative_eq!(own.mean, 0.0, epsilon = 1e-12);
}

/// Largest deviation of an output between an aircraft of the posterior and its mean, in the steady
/// order of the samples, both from the same start.
#[test]
fn its_deviation_is_that_of_drawn_aircraft() {
    const AIRCRAFT: usize = 400;
    let flown = flown("OLAT", 20.0);
    let local = posterior(&flown, 3.0);
    let mean = truth(&flown, "", 1.0);
    let own = decisive("OLAT", mean.clone(), ModelSource::Tunnel, &local);
    let aircraft = &shipped().config.aircraft;
    let record = noisy(&flown, 1);
    let recorded = recording(&flown, &record, aircraft);
    let output = output_index(own.quantity).unwrap();
    let about = simulation(&flown, aircraft, &recorded, &mean);
    let start = crate::proof_of_match::start::matched(&about).start;
    let run = about.fly(&start, recorded.samples, 1);
    let mut stream = RandomStream::new(4, "aircraft");
    let mut squares = vec![0.0; recorded.samples];
    for _ in 0..AIRCRAFT {
        let other = drawn(&flown, &local, &mut stream);
        let other = simulation(&flown, aircraft, &recorded, &other);
        let other = other.fly(&start, recorded.samples, 1);
        for (k, sum) in squares.iter_mut().enumerate() {
            let difference = other.outputs[k][output] - run.outputs[k][output];
            *sum += difference * difference / AIRCRAFT as f64;
        }
    }
    let slopes = local.values.iter().map(|value| {
        let own = own.slopes.iter().find(|(other, _)| other == value);
        own.map_or(0.0, |(_, slope)| *slope)
    });
    let slopes = nalgebra::DVector::from_iterator(local.values.len(), slopes);
    let deviation = (&local.covariance * &slopes).dot(&slopes).sqrt();
    // The decisive sample is the one with the smallest probability to be inside.
    let tolerance = |k: usize| {
        let tests = specification().tests;
        let all = tests
            .iter()
            .filter(|t| t.axis == Axis::Lateral)
            .flat_map(|t| &t.all_of)
            .flat_map(|r| &r.one_of);
        let same = all
            .filter(|t| t.quantity == own.quantity)
            .map(|t| t.width(recorded.measured[k][output]));
        same.fold(f64::INFINITY, f64::min)
    };
    let in_tolerances = (0..recorded.samples).map(|k| squares[k].sqrt() / tolerance(k));
    let largest = in_tolerances.fold(0.0, f64::max);
    assert!(
        own.quantity == MatchedQuantity::RollRate || own.quantity == MatchedQuantity::YawRate,
        "{:?}",
        own.quantity
    );
    // 400 aircraft give a deviation to 3.5 %; the noise moves the decisive sample a little.
    assert_relative_eq!(deviation, largest, max_relative = 0.12);
    // The model is the posterior's mean.
    assert_relative_eq!(own.mean, 0.0, epsilon = 1e-12);
}

#[test]
fn a_dutch_roll_that_is_wrong_decides_with_its_difference_in_tolerances() {
    let flown = flown("PYRS", 10.0);
    let config = &shipped().config;
    let local = posterior(&flown, 1.0);
    let mut of_period = specification();
    of_period.tests.retain(|t| t.axis == Axis::Lateral);
    for test in &mut of_period.tests {
        test.all_of
            .retain(|r| r.one_of[0].quantity == MatchedQuantity::DutchRollPeriod);
    }
    let means = estimate::means(&flown.record, &flown.maneuver, &config.aero_model).unwrap();
    let own = estimated(&flown, &["Cn_beta", "Cn_r"], 1.0);
    let record = noisy(&flown, 1);
    let mean = truth(&flown, "", 1.0);
    let decisive = |database: WindTunnel, own| {
        let basis = ProofInputs {
            aircraft: &config.aircraft,
            aero_model: &config.aero_model,
            models: &[(ModelSource::Tunnel, database)],
            posterior: &mean,
            tunnel: &config.tunnel,
            specification: &of_period,
        };
        let flown = RecordedManeuver {
            record: &record,
            maneuver: &flown.maneuver,
            local: Some(&local),
            own,
        };
        decisive_difference(&basis, &flown)
    };
    let right = decisive(truth(&flown, "", 1.0), Some((&means, &own))).unwrap();
    assert_eq!(right.quantity, MatchedQuantity::DutchRollPeriod);
    assert_relative_eq!(right.mean, 0.0, epsilon = 1e-9);
    let wrong = decisive(truth(&flown, "Cn_beta", 1.02), Some((&means, &own))).unwrap();
    let slope = wrong.slopes.iter().find(|(v, _)| v.derivative == "Cn_beta");
    let value = flown.truth.iter().find(|d| d.derivative == "Cn_beta");
    let expected = -0.02 * value.unwrap().value * slope.unwrap().1;
    // Less weathercock stability than the model has: a longer period.
    assert!(wrong.mean > 0.0);
    assert_relative_eq!(wrong.mean, expected, max_relative = 0.05);
    assert!(decisive(truth(&flown, "", 1.0), None).is_err());
    // A model that does not oscillate fails every repeat flight: it is no goal to be decided.
    let unstable = decisive(truth(&flown, "Cn_beta", -20.0), Some((&means, &own)));
    assert_eq!(
        unstable,
        Err("its Dutch roll does not oscillate".to_owned())
    );
}
