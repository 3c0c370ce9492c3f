//! The filter against finite differences, closed forms, a plain simulation and Monte Carlo.

mod inputs;
mod joint;
mod calibration_gradients;
mod plain_pass;

use std::collections::BTreeMap;

use approx::{assert_abs_diff_eq, assert_relative_eq};
use nalgebra::SVector;

use super::bounds::bounds;
use super::filter::Filter;
use super::joint_filter::JointFilter;
use super::noise::{Noise, NoiseParameter};
use super::scoring::{self, Scored, minimise};
use crate::aero::{Axis, Bias, Derivative};
use crate::dynamics::tests::aircraft;
use crate::dynamics::{
    Equations, InGusts, Lateral, LateralInGusts, Longitudinal, LongitudinalInGusts, OUTPUTS,
};
use crate::numerics::runge_kutta::{self, POINT};
use crate::output_error::sharing::SharedParameters;
use crate::output_error::tests::{
    Noise as Draws, SAMPLES, biases, nothing_measured, signals, truth, with_products,
};
use crate::output_error::theil::OutputAgreement;
use crate::output_error::{Case, InitialState, Model};
use crate::units::RAD;

/// Noise of light turbulence and ordinary instruments.
fn light() -> Noise {
    Noise {
        angle: 0.06 * RAD,
        gusts: [0.5 * RAD, 0.3 * RAD],
        corner: 3.0,
        correlations: [0.3, -0.4],
        outputs: [0.05, 0.1, 0.05, 0.005, 0.003],
    }
}

struct Simulated<const NX: usize, E: InGusts<NX>> {
    filter: Filter<NX, E>,
    /// True derivatives, biases and initial states.
    own: Vec<f64>,
}

fn values_by_name(truth: &[(Derivative, f64)]) -> BTreeMap<&str, f64> {
    truth.iter().map(|(d, v)| (d.name.as_str(), *v)).collect()
}

/// Filter of the test record with everything free and nothing measured, and its true parameters.
fn prepared<const NX: usize, E: InGusts<NX>>(
    truth: &[(Derivative, f64)],
    biases: &[Bias],
) -> Simulated<NX, E> {
    let model = Model {
        free: truth.iter().map(|(d, _)| d).collect(),
        held: vec![],
        biases: biases.iter().collect(),
        initial_state: InitialState::Estimated,
    };
    let known: Vec<Option<f64>> = biases.iter().map(|_| Some(0.05)).collect();
    let filter = Filter::<NX, E>::new(&aircraft(), &signals(), nothing_measured(), &model, &known);
    let values = values_by_name(truth);
    let mut own: Vec<f64> = filter.case.starting_values(|name| values[name]);
    own.extend(biases.iter().map(|_| 0.01));
    own.extend(filter.case.start.iter().take(E::states_in_still_air()));
    Simulated { filter, own }
}

impl<const NX: usize, E: InGusts<NX>> Simulated<NX, E> {
    /// Flies the true maneuver through gusts and measures it.
    fn fly(&mut self, noise: &Noise, draws: &mut Draws) {
        let (case, step_s) = (&self.filter.case, self.filter.case.step_s);
        let root = nalgebra::Cholesky::new(
            noise.covariance::<NX, E>(step_s) + nalgebra::SMatrix::identity() * 1e-24,
        )
        .unwrap()
        .l();
        let first = self.filter.first_noise() - E::states_in_still_air();
        let mut x = SVector::<f64, NX>::zeros();
        for i in 0..E::states_in_still_air() {
            x[i] = self.own[first + i];
        }
        x = E::decayed(x, 0.0);
        let mut measured = Vec::new();
        for sample in 0..case.samples() {
            let y = plain_outputs(case, &self.own, sample, &x);
            let biases = self.filter.biases(&self.own);
            measured.push(std::array::from_fn(|o| {
                y[o] + biases[o] + noise.outputs[o] * draws.gaussian()
            }));
            x = plain_step(case, &self.own, sample, &E::decayed(x, noise.decay(step_s)));
            let white = SVector::<f64, NX>::from_fn(|_, _| draws.gaussian());
            x += root * white;
        }
        self.filter.case.measurements.values = measured;
    }
}

/// Outputs of a state by the plain equations.
pub(crate) fn plain_outputs<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    parameters: &[f64],
    sample: usize,
    x: &SVector<f64, NX>,
) -> SVector<f64, OUTPUTS> {
    let c = case.build_up_at(parameters, 2 * sample).coefficients(x);
    let inputs = &case.motion.rate_inputs[2 * sample];
    E::outputs(inputs, &case.motion.sensor_inputs[sample], x, &c).outputs
}

/// State after a step of the plain equations.
pub(crate) fn plain_step<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    parameters: &[f64],
    sample: usize,
    x: &SVector<f64, NX>,
) -> SVector<f64, NX> {
    let last = 2 * case.samples() - 2;
    let slope = |stage: usize, x: &SVector<f64, NX>| {
        let point = (2 * sample + POINT[stage]).min(last);
        let c = case.build_up_at(parameters, point).coefficients(x);
        E::rates(&case.motion.rate_inputs[point], x, &c).rates
    };
    runge_kutta::step(x, case.step_s, slope, |x, slope, h| x + slope * h)
}

/// Compares the slopes of the cost with finite differences, some samples being left out.
fn assert_gradient_matches_differences<const NX: usize, E: InGusts<NX>>() {
    let truth = with_products(E::AXIS);
    let mut simulated = prepared::<NX, E>(&truth, &biases(E::AXIS));
    simulated.fly(&light(), &mut Draws(20_261_122));
    let mut measurements = simulated.filter.case.measurements.clone();
    for k in (0..SAMPLES).filter(|k| k % 7 == 3) {
        measurements.used[k][k % OUTPUTS] = false;
    }
    let given = biases(E::AXIS);
    let model = Model {
        free: truth.iter().map(|(d, _)| d).collect(),
        held: vec![],
        biases: given.iter().collect(),
        initial_state: InitialState::Estimated,
    };
    let filter = Filter::<NX, E>::new(
        &aircraft(),
        &signals(),
        measurements,
        &model,
        &[Some(0.05), None],
    );
    let mut at = filter.with_noise(&simulated.own, &light());
    for (j, value) in at.iter_mut().enumerate() {
        *value *= 1.0 + 0.01 * (j % 5) as f64;
    }
    let response = filter.respond(&at).unwrap();
    let (gradient, information) = (response.gradient(), response.information());
    // A pass without sensitivities takes the same steps.
    let alone = filter.innovations(&at).unwrap();
    assert_eq!(alone.whitened, response.whitened);
    assert_eq!(alone.predicted, response.predicted);
    let cost = |j: usize, d: f64| {
        let mut moved = at.clone();
        moved[j] += d;
        filter.innovations(&moved).unwrap().cost
    };
    for j in 0..at.len() {
        let unit = 1.0 / information[(j, j)].sqrt();
        let h = 1e-3 * unit;
        let numeric = -(cost(j, h) - cost(j, -h)) / (2.0 * h);
        // In units of the parameter's own bound.
        assert_abs_diff_eq!(gradient[j] * unit, numeric * unit, epsilon = 2e-5);
    }
}

#[test]
fn the_noise_of_an_output_that_never_counts_has_no_effect() {
    let truth = truth(Axis::Longitudinal);
    let mut simulated = prepared::<4, LongitudinalInGusts>(&truth, &[]);
    simulated.fly(&light(), &mut Draws(3));
    let mut measurements = simulated.filter.case.measurements.clone();
    for used in &mut measurements.used {
        used[3] = false;
    }
    let model = Model {
        free: truth.iter().map(|(d, _)| d).collect(),
        initial_state: InitialState::Estimated,
        ..Model::default()
    };
    let filter =
        Filter::<4, LongitudinalInGusts>::new(&aircraft(), &signals(), measurements, &model, &[]);
    let respond = |an: f64| {
        let mut noise = light();
        noise.outputs[3] = an;
        let response = filter.respond(&filter.with_noise(&simulated.own, &noise));
        response.unwrap()
    };
    let (quiet, loud) = (respond(1e-6), respond(1.0));
    assert_relative_eq!(quiet.cost, loud.cost, max_relative = 1e-9);
    let an = filter.parameters() - 2;
    assert_eq!(
        filter.noise_parameters()[an - filter.first_noise()],
        NoiseParameter::Output(3)
    );
    for response in [quiet, loud] {
        assert_abs_diff_eq!(response.gradient()[an], 0.0, epsilon = 1e-12);
        assert_abs_diff_eq!(response.information()[(an, an)], 0.0, epsilon = 1e-12);
    }
}

#[test]
fn the_gradient_is_that_of_finite_differences_for_every_parameter() {
    assert_gradient_matches_differences::<4, LongitudinalInGusts>();
    assert_gradient_matches_differences::<6, LateralInGusts>();
}

/// Compares predictions without process noise with the outputs of output error.
fn assert_still_air_is_output_error<
    const NX: usize,
    E: Equations<NX>,
    const NG: usize,
    G: InGusts<NG>,
>() {
    let (truth, given) = (truth(E::AXIS), biases(E::AXIS));
    let mut simulated = prepared::<NG, G>(&truth, &given);
    simulated.fly(&light(), &mut Draws(7));
    let still = Noise::without_gusts(light().outputs);
    let at = simulated.filter.with_noise(&simulated.own, &still);
    let predicted = simulated.filter.respond(&at).unwrap();
    let model = Model {
        free: truth.iter().map(|(d, _)| d).collect(),
        held: vec![],
        biases: given.iter().collect(),
        initial_state: InitialState::Estimated,
    };
    let case = Case::<NX, E>::new(&aircraft(), &signals(), nothing_measured(), &model);
    let mut response = case.response();
    case.respond(&simulated.own, &mut response).unwrap();
    for (filter, output_error) in predicted.predicted.iter().zip(&response.outputs) {
        assert_abs_diff_eq!(filter[..], output_error[..], epsilon = 1e-9);
    }
}

#[test]
fn without_process_noise_predictions_are_the_outputs_of_output_error() {
    assert_still_air_is_output_error::<3, Longitudinal, 4, LongitudinalInGusts>();
    assert_still_air_is_output_error::<4, Lateral, 6, LateralInGusts>();
}

/// Share of each output's variance that the equations along the air's angle explain.
fn explained<const NX: usize, E: InGusts<NX>>(
    filter: &Filter<NX, E>,
    at: &[f64],
) -> [f64; OUTPUTS] {
    let computed = filter.outputs_along_air(at).unwrap();
    let agreements = OutputAgreement::of_outputs(&filter.case.measurements, &computed);
    agreements.map(|agreement| agreement.r_squared().unwrap())
}

/// Compares a maneuver in moderate turbulence with the equations along the air's angle: with the true
/// derivatives they explain all outputs but the attitude, with others' not.
fn assert_sound_derivatives_explain_motion_in_gusts<const NX: usize, E: InGusts<NX>>() {
    let moderate = Noise {
        angle: 2.5 * light().angle,
        gusts: light().gusts.map(|g| 2.5 * g),
        ..light()
    };
    let mut simulated = prepared::<NX, E>(&truth(E::AXIS), &biases(E::AXIS));
    let mut draws = Draws(29);
    for _ in 0..5 {
        simulated.fly(&moderate, &mut draws);
        let mut at = simulated.filter.with_noise(&simulated.own, &moderate);
        let sound = explained(&simulated.filter, &at);
        for (output, share) in E::AXIS.outputs().into_iter().zip(sound) {
            assert!(share > 0.3 || output.is_attitude(), "{output}: {share}");
        }
        // Opposite moments of the surfaces.
        for (name, value) in simulated.filter.names().iter().zip(&mut at) {
            if ["Cm_de", "Cl_da", "Cn_dr"].contains(&&**name) {
                *value = -*value;
            }
        }
        let wrong = explained(&simulated.filter, &at);
        assert!(wrong[1] < 0.0, "{wrong:?}");
    }
}

#[test]
fn sound_derivatives_explain_motion_in_gusts_and_wrong_ones_do_not() {
    assert_sound_derivatives_explain_motion_in_gusts::<4, LongitudinalInGusts>();
    assert_sound_derivatives_explain_motion_in_gusts::<6, LateralInGusts>();
}

#[test]
fn outputs_along_still_air_are_those_of_output_error() {
    let axis = Axis::Lateral;
    let mut simulated = prepared::<6, LateralInGusts>(&truth(axis), &biases(axis));
    simulated.fly(&light(), &mut Draws(7));
    let at = simulated
        .filter
        .with_noise(&simulated.own, &Noise::without_gusts(light().outputs));
    let along = simulated.filter.outputs_along_air(&at).unwrap();
    let predicted = simulated.filter.respond(&at).unwrap().predicted;
    for (along, predicted) in along.iter().zip(&predicted) {
        assert_abs_diff_eq!(along[..], predicted[..], epsilon = 1e-9);
    }
}

#[test]
fn the_gain_of_the_angle_alone_is_the_limit_of_its_filter() {
    let noise = light();
    let (q, r) = (noise.angle.powi(2), (noise.outputs[0] * RAD).powi(2));
    let mut predicted = q;
    for _ in 0..1000 {
        predicted = predicted * r / (predicted + r) + q;
    }
    let limit = predicted / (predicted + r);
    assert_relative_eq!(noise.angle_gain(0), limit, max_relative = 1e-12);
    assert_abs_diff_eq!(Noise::without_gusts(noise.outputs).angle_gain(0), 0.0);
}

#[test]
fn rotary_gusts_without_gusts_of_the_angle_are_not_of_the_air() {
    let step_s = 0.025;
    // The size that belongs to the angle's walk: σ √(ω / 2Δt).
    let belongs = light().angle * (light().corner / (2.0 * step_s)).sqrt();
    let with_rotary = |size: f64| Noise {
        gusts: [size * belongs; 2],
        ..light()
    };
    assert!(light().is_of_air(2, step_s) && with_rotary(9.9).is_of_air(2, step_s));
    assert!(!with_rotary(10.1).is_of_air(2, step_s));
    assert!(!Noise::without_gusts(light().outputs).is_of_air(2, step_s));
}

/// Checks at the true parameters that the innovations are white with the computed covariance.
fn assert_innovations_are_white<const NX: usize, E: InGusts<NX>>() {
    let mut simulated = prepared::<NX, E>(&truth(E::AXIS), &biases(E::AXIS));
    let (mut squares, mut products, mut count) = ([0.0; OUTPUTS], [0.0; OUTPUTS], 0.0);
    let mut draws = Draws(3);
    for _ in 0..30 {
        simulated.fly(&light(), &mut draws);
        let at = simulated.filter.with_noise(&simulated.own, &light());
        let white = simulated.filter.innovations(&at).unwrap().whitened;
        // The gain is that of the steady filter, which begins with the uncertainty of the steady
        // state.
        let white = &white[40..];
        for pair in white.windows(2) {
            for o in 0..OUTPUTS {
                squares[o] += pair[0][o] * pair[0][o];
                products[o] += pair[0][o] * pair[1][o];
            }
        }
        count += (white.len() - 1) as f64;
    }
    for o in 0..OUTPUTS {
        // 8,400 values: their variance is known to 1.5 %, their correlation to 0.011.
        assert_relative_eq!(squares[o] / count, 1.0, epsilon = 0.06);
        assert_abs_diff_eq!(products[o] / squares[o], 0.0, epsilon = 0.04);
    }
}

#[test]
fn innovations_at_the_truth_are_white_with_the_computed_covariance() {
    assert_innovations_are_white::<4, LongitudinalInGusts>();
    assert_innovations_are_white::<6, LateralInGusts>();
}

/// Minimum from a start.
fn scored_from<const NX: usize, E: InGusts<NX>>(
    filter: &JointFilter<NX, E>,
    start: Vec<f64>,
) -> Scored {
    let floors = filter.floors(&vec![[1e-6; OUTPUTS]; filter.filters().len()]);
    let scored = minimise(filter, start, &floors, &scoring::Settings::default()).unwrap();
    assert!(scored.converged, "{}", scored.reason);
    scored
}

/// Estimates simulated maneuvers in gusts: the bounds must be the scatter of the estimates.
fn assert_estimates_scatter_as_bounded<const NX: usize, E: InGusts<NX>>() {
    const FLIGHTS: usize = 24;
    let mut simulated = prepared::<NX, E>(&truth(E::AXIS), &biases(E::AXIS));
    let mut draws = Draws(11);
    let (mut square, mut count, mut within) = (0.0, 0.0, 0.0);
    for _ in 0..FLIGHTS {
        simulated.fly(&light(), &mut draws);
        let start = Noise::starting(light().outputs);
        let start = simulated.filter.with_noise(&simulated.own, &start);
        let own = SharedParameters::of_one(simulated.filter.names());
        let filter = JointFilter::new(std::slice::from_ref(&simulated.filter), &own);
        let scored = scored_from(&filter, start);
        let bounds = bounds(&filter, &scored, 1e10).unwrap();
        let covariance = bounds.corrected(&filter, &scored);
        for j in 0..simulated.filter.case.derivatives() {
            let z = (scored.parameters[j] - simulated.own[j]) / covariance[(j, j)].sqrt();
            square += z * z;
            count += 1.0;
            within += f64::from(u8::from(z.abs() < 1.96));
        }
    }
    // Some 300 estimates, which correlate within a flight.
    assert!(
        (0.6..1.5).contains(&(square / count)),
        "mean square of z: {}",
        square / count
    );
    assert!(
        (0.88..0.99).contains(&(within / count)),
        "95 % intervals hold {}",
        within / count
    );
}

#[test]
fn estimates_in_gusts_scatter_by_their_bounds() {
    assert_estimates_scatter_as_bounded::<4, LongitudinalInGusts>();
    assert_estimates_scatter_as_bounded::<6, LateralInGusts>();
}

/// In still air the noise of the process goes to its floor and is fixed there.
#[test]
fn in_still_air_the_process_noise_is_fixed_at_its_floor() {
    let axis = Axis::Longitudinal;
    let mut simulated = prepared::<4, LongitudinalInGusts>(&truth(axis), &biases(axis));
    let still = Noise {
        angle: 1e-9,
        gusts: [1e-9; 2],
        ..light()
    };
    simulated.fly(&still, &mut Draws(5));
    let start = simulated
        .filter
        .with_noise(&simulated.own, &Noise::starting(light().outputs));
    let own = SharedParameters::of_one(simulated.filter.names());
    let filter = JointFilter::new(std::slice::from_ref(&simulated.filter), &own);
    let scored = scored_from(&filter, start);
    let noise = simulated.filter.noise(&scored.parameters);
    assert!(noise.angle < 0.004 * RAD, "{} deg", noise.angle / RAD);
}

#[test]
fn slopes_of_the_noise_are_those_of_finite_differences() {
    let at = light().parameters(2);
    let step_s = 0.025;
    for (j, parameter) in NoiseParameter::all(2).into_iter().enumerate() {
        let h = 1e-6;
        let moved = |d: f64| {
            let mut moved = at.clone();
            moved[j] += d;
            Noise::of_parameters(&moved, 2)
        };
        let q = |d: f64| moved(d).covariance::<6, LateralInGusts>(step_s);
        let numeric = (q(h) - q(-h)) / (2.0 * h);
        let slope = light().covariance_slope::<6, LateralInGusts>(parameter, step_s);
        assert_abs_diff_eq!(slope, numeric, epsilon = 1e-6 * q(0.0).amax());
        let decay = (moved(h).decay(step_s) - moved(-h).decay(step_s)) / (2.0 * h);
        assert_abs_diff_eq!(
            light().decay_slope(parameter, step_s),
            decay,
            epsilon = 1e-8
        );
    }
}

#[test]
fn a_rotary_gust_keeps_its_size_over_the_steps() {
    // First order: σ² = decay² σ² + variance of the change.
    let step_s = 0.025;
    let q = light().covariance::<4, LongitudinalInGusts>(step_s);
    let left = (-3.0f64 * step_s).exp().powi(2) * (0.5 * RAD).powi(2);
    assert_relative_eq!(left + q[(3, 3)], (0.5 * RAD).powi(2), max_relative = 1e-12);
    assert_relative_eq!(q[(0, 0)], (0.06 * RAD).powi(2), max_relative = 1e-12);
    assert_relative_eq!(
        q[(0, 3)] / (q[(0, 0)] * q[(3, 3)]).sqrt(),
        0.3,
        max_relative = 1e-12
    );
}
