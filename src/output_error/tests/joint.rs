//! Joint estimation against single estimation, finite differences and simulated truth.

use approx::assert_relative_eq;

use super::super::consider::{self, Considered};
use super::super::{Bounded, Detail, Joint, Likelihood};
use super::*;

type Longitudinals = Case<3, Longitudinal>;

/// Maneuver of true derivatives and of its own biases, measured with noise.
fn measured_case(seed: u64, biases_g: [f64; 2]) -> (Longitudinals, Vec<f64>) {
    let (mut case, mut parameters) =
        case::<3, Longitudinal>(&truth(Axis::Longitudinal), &biases(Axis::Longitudinal));
    let first = case.derivatives();
    parameters[first..first + 2].copy_from_slice(&biases_g);
    measure(&mut case, &parameters, &mut Noise(seed), 0.0);
    (case, parameters)
}

fn precise() -> Settings {
    Settings {
        tolerance: 1e-13,
        ..Settings::default()
    }
}

fn fit_of<D: Bounded>(data: &D, start: Vec<f64>) -> Fit<D::Response> {
    let fit = estimate(
        data,
        start,
        TABLE,
        Weights::Table,
        [1e-6; OUTPUTS],
        &precise(),
    );
    assert_eq!(fit.outcome, Outcome::Converged, "{}", fit.reason);
    fit
}

#[test]
fn a_joint_fit_of_one_maneuver_is_its_own_fit() {
    let (case, parameters) = measured_case(3, [0.01, 0.02]);
    let joint = Joint::new([("only", &case)], |_| false).unwrap();
    let (alone, joined) = (
        fit_of(&case, parameters.clone()),
        fit_of(&joint, parameters),
    );
    assert_eq!(alone.values, joined.values);
    assert_eq!(alone.covariance, joined.covariance);
    assert_eq!(alone.covariance_corrected, joined.covariance_corrected);
    assert_eq!(
        (alone.iterations, alone.final_cost),
        (joined.iterations, joined.final_cost)
    );
}

#[test]
fn two_copies_of_a_maneuver_divide_its_bounds_by_the_root_of_two() {
    let (case, parameters) = measured_case(3, [0.01, 0.02]);
    let alone = fit_of(&case, parameters.clone());
    let joint = Joint::new([("a", &case), ("b", &case)], |_| false).unwrap();
    let shared = case.derivatives();
    let start = joint.parameters().assemble(
        &parameters[..shared],
        &[parameters.clone(), parameters.clone()],
    );
    let both = fit_of(&joint, start);
    // Shared parameters absorb a smaller share of two maneuvers' noise than of one's, which the
    // corrected bound counts.
    for (one, two, max_relative) in [
        (alone.covariance.unwrap(), both.covariance.unwrap(), 1e-4),
        (
            alone.covariance_corrected.unwrap(),
            both.covariance_corrected.unwrap(),
            6e-2,
        ),
    ] {
        for j in 0..shared {
            assert_relative_eq!(
                two[(j, j)].sqrt(),
                one[(j, j)].sqrt() / 2f64.sqrt(),
                max_relative = max_relative
            );
            let sd = one[(j, j)].sqrt();
            assert!(
                (both.values[j] - alone.values[j]).abs() < 1e-3 * sd,
                "{}",
                case.names[j]
            );
        }
    }
}

#[test]
fn the_joint_gradient_matches_finite_differences() {
    let ((a, at_a), (b, at_b)) = (
        measured_case(3, [0.0, 0.0]),
        measured_case(4, [0.05, -0.03]),
    );
    let joint = Joint::new([("a", &a), ("b", &b)], |_| false).unwrap();
    let mut at = joint
        .parameters()
        .assemble(&at_a[..a.derivatives()], &[at_a.clone(), at_b]);
    for (j, value) in at.iter_mut().enumerate() {
        *value *= if j % 2 == 0 { 1.01 } else { 0.99 };
    }
    let mut response = joint.response();
    let mut sums = |parameters: &[f64]| {
        joint
            .respond(Detail::Whole, parameters, &mut response)
            .unwrap();
        Likelihood::sums(&joint, &response, &TABLE)
    };
    let gradient = sums(&at).gradient;
    for j in 0..at.len() {
        let h = 1e-6 * at[j].abs().max(1e-2);
        let mut moved = at.clone();
        moved[j] += h;
        let up = sums(&moved).weighted_square;
        moved[j] -= 2.0 * h;
        let down = sums(&moved).weighted_square;
        let numeric = -(up - down) / (4.0 * h);
        let size = gradient[j].abs().max(1e-6 * gradient.amax());
        assert!(
            (gradient[j] - numeric).abs() < 1e-3 * size,
            "{}: {} {numeric}",
            joint.names()[j],
            gradient[j]
        );
    }
}

#[test]
fn shared_derivatives_and_own_biases_are_recovered_within_their_bounds() {
    let ((a, at_a), (b, at_b)) = (measured_case(5, [0.0, 0.0]), measured_case(6, [0.3, -0.05]));
    let joint = Joint::new([("a", &a), ("b", &b)], |_| false).unwrap();
    let truth = joint
        .parameters()
        .assemble(&at_a[..a.derivatives()], &[at_a.clone(), at_b]);
    let start = truth.iter().map(|v| 1.1 * v).collect();
    let fit = fit_of(&joint, start);
    let covariance = fit.covariance.unwrap();
    for (j, name) in joint.names().iter().enumerate() {
        let z = (fit.values[j] - truth[j]).abs() / covariance[(j, j)].sqrt();
        assert!(z < 4.5, "{name} is {z:.1} bounds from the truth");
    }
    let bias = joint
        .names()
        .iter()
        .position(|n| n == "Q_bias of b")
        .unwrap();
    assert!(
        (fit.values[bias] - 0.3).abs() < 0.05,
        "{}",
        fit.values[bias]
    );
    assert!(covariance[(0, 0)] < fit_of(&a, at_a).covariance.unwrap()[(0, 0)]);
}

#[test]
fn the_error_of_a_held_value_does_not_average_out() {
    let truth = truth(Axis::Longitudinal);
    let (wide, parameters) = measured_case(3, [0.0, 0.0]);
    let model = Model {
        free: truth
            .iter()
            .map(|(d, _)| d)
            .filter(|d| d.name != "Cm_de")
            .collect(),
        held: truth
            .iter()
            .filter(|(d, _)| d.name == "Cm_de")
            .map(|(d, v)| (d, *v))
            .collect(),
        ..Model::default()
    };
    let case = Longitudinals::new(&aircraft(), &signals(), wide.measurements.clone(), &model);
    let values: BTreeMap<&str, f64> = wide
        .names
        .iter()
        .map(String::as_str)
        .zip(parameters)
        .collect();
    let start: Vec<f64> = case.names.iter().map(|n| values[n.as_str()]).collect();
    let uncertainties = [("Cm_de", 1e-4)].into();
    let mut alone = fit_of(&case, start.clone());
    consider::consider(&case, &wide, &values, &uncertainties, &mut alone);
    let joint = Joint::new([("a", &case), ("b", &case)], |_| false).unwrap();
    let mut both = fit_of(
        &joint,
        joint.parameters().assemble(
            &start[..case.derivatives()],
            &[start.clone(), start.clone()],
        ),
    );
    let considered = [0, 1].map(|i| Considered {
        case: &case,
        wide: &wide,
        values: values.clone(),
        places: joint.parameters().places(i).to_vec(),
    });
    consider::consider_together(&considered, &uncertainties, &mut both);
    let (one, two) = (
        alone.covariance_held.unwrap(),
        both.covariance_held.unwrap(),
    );
    for j in 0..case.derivatives() {
        assert_relative_eq!(two[(j, j)], one[(j, j)], max_relative = 1e-6);
    }
}

#[test]
fn maneuvers_with_other_free_derivatives_are_not_joined() {
    let (a, _) = measured_case(3, [0.0, 0.0]);
    let (b, _) = case::<3, Longitudinal>(&truth(Axis::Longitudinal)[1..], &[]);
    let error = Joint::new([("a", &a), ("b", &b)], |_| false).unwrap_err();
    assert!(error.starts_with("b has other free derivatives"), "{error}");
}

#[test]
fn a_derivative_of_each_maneuver_s_own_is_estimated_for_each() {
    let ((a, at_a), (mut b, mut at_b)) =
        (measured_case(5, [0.0, 0.0]), measured_case(6, [0.0, 0.0]));
    let constant = b.names.iter().position(|n| n == "Cm_0").unwrap();
    at_b[constant] += 0.002;
    measure(&mut b, &at_b, &mut Noise(6), 0.0);
    let joint = Joint::new([("a", &a), ("b", &b)], |name| name.ends_with("_0")).unwrap();
    assert!(!joint.names().contains(&"Cm_0".to_owned()));
    let shared: Vec<f64> = joint
        .parameters()
        .shared()
        .iter()
        .map(|&j| at_a[j])
        .collect();
    let truth = joint.parameters().assemble(&shared, &[at_a, at_b]);
    let fit = fit_of(&joint, truth.iter().map(|v| 1.02 * v).collect());
    let covariance = fit.covariance.unwrap();
    for (j, name) in joint.names().iter().enumerate() {
        let z = (fit.values[j] - truth[j]).abs() / covariance[(j, j)].sqrt();
        assert!(z < 4.5, "{name} is {z:.1} bounds from the truth");
    }
}
