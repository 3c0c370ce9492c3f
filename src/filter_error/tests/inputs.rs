//! Noise of the inputs in the filter: exact slopes, white innovations, honest bounds.

use super::*;
use crate::output_error::NoisyInputs;
use crate::output_error::surface_noise::noisy_surfaces;
use crate::output_error::tests::{window_of, with_noisy_surfaces};

/// Instruments so good that noise of the surfaces shows.
const OUTPUTS_NOISE: [f64; OUTPUTS] = [0.02, 0.02, 0.02, 0.002, 0.001];
const SURFACE_NOISE_DEG: f64 = 0.1;

fn model_of(truth: &[(Derivative, f64)]) -> Model<'_> {
    Model {
        free: truth.iter().map(|(d, _)| d).collect(),
        initial_state: InitialState::Estimated,
        ..Model::default()
    }
}

/// Maneuver in still air, flown with exact surfaces and recorded with noisy ones.
fn recorded<const NX: usize, E: InGusts<NX>>(
    truth: &[(Derivative, f64)],
    draws: &mut Draws,
) -> Simulated<NX, E> {
    let mut exact = prepared::<NX, E>(truth, &[]);
    let still = Noise {
        angle: 1e-9,
        gusts: [1e-9; 2],
        outputs: OUTPUTS_NOISE,
        ..light()
    };
    exact.fly(&still, draws);
    let signals = window_of(&with_noisy_surfaces(SURFACE_NOISE_DEG, draws));
    let model = model_of(truth);
    let inputs = NoisyInputs {
        surfaces: noisy_surfaces(&aircraft(), &signals, &model),
        pressure_variance: 0.0,
    };
    let measured = exact.filter.case.measurements.clone();
    let filter = Filter::<NX, E>::new(&aircraft(), &signals, measured, &model, &[]);
    Simulated {
        filter: filter.with_noisy_inputs(inputs),
        own: exact.own,
    }
}

/// Compares slopes of the cost with finite differences where surfaces and dynamic pressure are noisy.
fn assert_gradient_matches_differences<const NX: usize, E: InGusts<NX>>(noise: &Noise) {
    let truth = truth(E::AXIS);
    let mut draws = Draws(42);
    let recorded = recorded::<NX, E>(&truth, &mut draws);
    let signals = window_of(&with_noisy_surfaces(SURFACE_NOISE_DEG, &mut draws));
    let inputs = NoisyInputs {
        surfaces: noisy_surfaces(&aircraft(), &signals, &model_of(&truth)),
        pressure_variance: 1e-4,
    };
    let filter = recorded.filter.with_noisy_inputs(inputs);
    let mut at = filter.with_noise(&recorded.own, noise);
    for (j, value) in at.iter_mut().take(filter.first_noise()).enumerate() {
        *value *= 1.0 + 0.01 * (j % 5) as f64;
    }
    let response = filter.respond(&at).unwrap();
    let (gradient, information) = (response.gradient(), response.information());
    let cost = |j: usize, d: f64| {
        let mut moved = at.clone();
        moved[j] += d;
        filter.innovations(&moved).unwrap().cost
    };
    for j in 0..filter.first_noise() {
        let unit = 1.0 / information[(j, j)].sqrt();
        let h = 1e-3 * unit;
        let numeric = -(cost(j, h) - cost(j, -h)) / (2.0 * h);
        // In units of the parameter's own bound.
        assert_abs_diff_eq!(gradient[j] * unit, numeric * unit, epsilon = 2e-5);
    }
}

#[test]
fn the_gradient_with_noisy_inputs_is_that_of_finite_differences() {
    let still = Noise::without_gusts(OUTPUTS_NOISE);
    for noise in [still, light()] {
        assert_gradient_matches_differences::<4, LongitudinalInGusts>(&noise);
        assert_gradient_matches_differences::<6, LateralInGusts>(&noise);
    }
}

/// Correlation of neighbouring innovations of the pitch or roll rate, and their mean square, at the
/// truth.
fn innovations_of_maneuvers<const NX: usize, E: InGusts<NX>>(exact: bool) -> (f64, f64) {
    let truth = truth(E::AXIS);
    let mut draws = Draws(8);
    let (mut squares, mut products, mut count) = (0.0, 0.0, 0.0);
    for _ in 0..20 {
        let mut recorded = recorded::<NX, E>(&truth, &mut draws);
        if exact {
            recorded.filter = recorded.filter.with_noisy_inputs(NoisyInputs::default());
        }
        let still = Noise::without_gusts(OUTPUTS_NOISE);
        let at = recorded.filter.with_noise(&recorded.own, &still);
        let white = recorded.filter.innovations(&at).unwrap().whitened;
        for pair in white.windows(2) {
            squares += pair[0][1] * pair[0][1];
            products += pair[0][1] * pair[1][1];
            count += 1.0;
        }
    }
    (products / squares, squares / count)
}

#[test]
fn innovations_with_noisy_surfaces_are_white_with_the_computed_covariance() {
    let assert_white = |(correlation, variance): (f64, f64), (correlation_of_exact, _)| {
        // 6,380 values: their variance is known to 2 %, their correlation to 0.013.
        assert_relative_eq!(variance, 1.0, epsilon = 0.08);
        assert_abs_diff_eq!(correlation, 0.0, epsilon = 0.05);
        assert!(correlation_of_exact > 0.3, "{correlation_of_exact}");
    };
    assert_white(
        innovations_of_maneuvers::<4, LongitudinalInGusts>(false),
        innovations_of_maneuvers::<4, LongitudinalInGusts>(true),
    );
    assert_white(
        innovations_of_maneuvers::<6, LateralInGusts>(false),
        innovations_of_maneuvers::<6, LateralInGusts>(true),
    );
}

/// Mean square of the distances of estimates from the truth, in bounds.
fn mean_square_distance<const NX: usize, E: InGusts<NX>>() -> f64 {
    const MANEUVERS: usize = 24;
    let truth = truth(E::AXIS);
    let mut draws = Draws(31);
    let (mut square, mut count) = (0.0, 0.0);
    for _ in 0..MANEUVERS {
        let recorded = recorded::<NX, E>(&truth, &mut draws);
        let start = Noise::with_small_gusts(OUTPUTS_NOISE);
        let start = recorded.filter.with_noise(&recorded.own, &start);
        let own = SharedParameters::of_one(recorded.filter.names());
        let filter = JointFilter::new(std::slice::from_ref(&recorded.filter), &own);
        let scored = scored_from(&filter, start);
        let bounds = bounds(&filter, &scored, 1e10).unwrap();
        let covariance = bounds.corrected(&filter, &scored);
        for j in 0..recorded.filter.case.derivatives() {
            square += (scored.parameters[j] - recorded.own[j]).powi(2) / covariance[(j, j)];
            count += 1.0;
        }
    }
    square / count
}

#[test]
fn estimates_with_noisy_surfaces_scatter_by_their_bounds() {
    // Some 300 estimates of an axis, which correlate within a maneuver.
    for mean_square in [
        mean_square_distance::<4, LongitudinalInGusts>(),
        mean_square_distance::<6, LateralInGusts>(),
    ] {
        assert!((0.6..1.4).contains(&mean_square), "{mean_square}");
    }
}
