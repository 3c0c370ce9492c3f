//! The coarse response: its gradient, and the check that it does not change the minimum.

use nalgebra::DVector;

use super::super::newton_raphson::{descend, minimise};
use super::super::{Detail, Likelihood};
use super::*;

/// Maneuver of true derivatives, measured with noise.
fn measured_case<const NX: usize, E: Equations<NX>>(seed: u64) -> (Case<NX, E>, Vec<f64>) {
    let (mut case, parameters) = case::<NX, E>(&truth(E::AXIS), &biases(E::AXIS));
    measure(&mut case, &parameters, &mut Noise(seed), 0.0);
    assert!(case.has_coarse());
    (case, parameters)
}

fn assert_gradient_matches_differences<const NX: usize, E: Equations<NX>>() {
    let (mut case, mut parameters) = measured_case::<NX, E>(20_261_121);
    case.measurements.used[7] = [false; OUTPUTS];
    case.measurements.used[8][2] = false;
    for value in &mut parameters {
        *value *= 1.1;
    }
    let mut response = case.response();
    let mut at = |parameters: &[f64]| {
        Likelihood::respond(&case, Detail::Coarse, parameters, &mut response).unwrap();
        Likelihood::sums(&case, &response, &TABLE)
    };
    let gradient = at(&parameters).gradient;
    for j in 0..parameters.len() {
        let h = 1e-5 * parameters[j].abs().max(1e-2);
        let mut moved = |d: f64| {
            let mut moved = parameters.clone();
            moved[j] += d;
            at(&moved).weighted_square
        };
        let numeric = -(moved(h) - moved(-h)) / (4.0 * h);
        assert_relative_eq!(
            gradient[j],
            numeric,
            max_relative = 1e-4,
            epsilon = 1e-6 * gradient.amax()
        );
    }
}

#[test]
fn the_coarse_gradient_matches_differences_of_the_coarse_cost() {
    assert_gradient_matches_differences::<3, Longitudinal>();
    assert_gradient_matches_differences::<4, Lateral>();
}

#[test]
fn coarse_sums_approximate_those_of_all_samples() {
    let (case, parameters) = measured_case::<3, Longitudinal>(20_261_122);
    let off: Vec<f64> = parameters.iter().map(|value| 1.2 * value).collect();
    let (mut coarse, mut whole) = (case.response(), case.response());
    Likelihood::respond(&case, Detail::Coarse, &off, &mut coarse).unwrap();
    Likelihood::respond(&case, Detail::Whole, &off, &mut whole).unwrap();
    let [coarse, whole] =
        [coarse, whole].map(|response| Likelihood::sums(&case, &response, &TABLE));
    assert_eq!(coarse.count, whole.count);
    assert_relative_eq!(coarse.cost(), whole.cost(), max_relative = 0.02);
    for j in 0..parameters.len() {
        assert_relative_eq!(
            coarse.information[(j, j)],
            whole.information[(j, j)],
            max_relative = 0.05
        );
    }
}

fn assert_same_minimum<const NX: usize, E: Equations<NX>>() {
    let (case, parameters) = measured_case::<NX, E>(20_261_123);
    let start: Vec<f64> = parameters.iter().map(|value| 1.2 * value).collect();
    let settings = Settings {
        tolerance: 1e-13,
        ..Settings::default()
    };
    let approached = minimise(&case, start.clone(), TABLE, &settings);
    let alone = descend(&case, start.clone(), TABLE, &settings, case.response());
    assert_eq!(
        (approached.outcome, alone.outcome),
        (Outcome::Converged, Outcome::Converged)
    );
    let information = Likelihood::sums(&case, &alone.response, &TABLE).information;
    // Squared distance in standard deviations of the noise that the weights assume.
    let apart = DVector::from_iterator(
        start.len(),
        approached
            .values
            .iter()
            .zip(&alone.values)
            .map(|(a, b)| a - b),
    );
    let distance = (&information * &apart).dot(&apart);
    assert!(distance < 1e-6, "{}: {distance:e}", E::AXIS.name());
    assert_relative_eq!(
        approached.final_cost.unwrap(),
        alone.final_cost.unwrap(),
        max_relative = 1e-11
    );
}

#[test]
fn the_coarse_approach_does_not_change_the_minimum() {
    assert_same_minimum::<3, Longitudinal>();
    assert_same_minimum::<4, Lateral>();
}

#[test]
fn a_maneuver_with_few_samples_a_parameter_has_no_coarse_response() {
    let (mut case, _) = measured_case::<3, Longitudinal>(20_261_124);
    let few = 15 * case.parameters();
    case.measurements.values.truncate(few);
    case.measurements.used.truncate(few);
    assert!(!case.has_coarse());
}
