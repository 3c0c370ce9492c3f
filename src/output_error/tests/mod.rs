//! The estimator against finite differences, simulated truth, and Monte Carlo for the bounds.

mod calibration;
mod coarse;
mod equation_error;
mod joint;
mod width;

use std::collections::BTreeMap;

use approx::{assert_abs_diff_eq, assert_relative_eq};

use super::case::blocks::BlockSums;
use super::estimation::{Weights, estimate};
use super::newton_raphson::Settings;
use super::{Case, Fit, InitialState, Measurements, Model, Outcome, consider, cost};
use crate::aero::{Axis, Bias, Coefficient, Derivative, Regressor};
use crate::dynamics::motion::{ManeuverSignals, MassProperties};
use crate::dynamics::tests::aircraft;
use crate::dynamics::{Equations, Lateral, Longitudinal, OUTPUTS};
use crate::flight::record::Series;
use crate::flight::{Mark, Record, signal};

pub(crate) const SAMPLES: usize = 320;
const STEP_S: f64 = 0.025;

pub(crate) fn derivative(name: &str, coefficient: Coefficient, regressor: Regressor) -> Derivative {
    Derivative {
        name: name.into(),
        coefficient,
        regressor,
    }
}

pub(crate) fn surface(name: &str) -> Regressor {
    Regressor::Surface(name.into())
}

/// Build-up with every kind of regressor, and true values of a stable fighter at α 20°.
pub(crate) fn truth(axis: Axis) -> Vec<(Derivative, f64)> {
    use Coefficient::{CA, CN, CY, Cl, Cm, Cn};
    let vane = |name: &str| Regressor::Vane(name.into());
    match axis {
        Axis::Longitudinal => vec![
            (derivative("CN_0", CN, Regressor::Constant), 0.1),
            (derivative("CN_alpha", CN, Regressor::Alpha), 0.06),
            (derivative("CN_q", CN, Regressor::PitchRate), 4.0),
            (derivative("CN_de", CN, surface("de_deg")), 0.012),
            (derivative("CN_dpv", CN, vane("dpv_deg")), 95.0),
            (derivative("Cm_0", Cm, Regressor::Constant), 0.1),
            (derivative("Cm_alpha", Cm, Regressor::Alpha), -0.006),
            (derivative("Cm_q", Cm, Regressor::PitchRate), -5.0),
            (derivative("Cm_de", Cm, surface("de_deg")), -0.012),
            (derivative("Cm_dpv", Cm, vane("dpv_deg")), -1700.0),
            (derivative("CA_0", CA, Regressor::Constant), 0.02),
            (derivative("CA_alpha", CA, Regressor::Alpha), 0.002),
        ],
        Axis::Lateral => vec![
            (derivative("CY_0", CY, Regressor::Constant), 0.001),
            (derivative("CY_beta", CY, Regressor::Beta), -0.012),
            (derivative("CY_dr", CY, surface("dr_deg")), 0.004),
            (derivative("Cl_0", Cl, Regressor::Constant), 0.0001),
            (derivative("Cl_beta", Cl, Regressor::Beta), -0.0015),
            (derivative("Cl_p", Cl, Regressor::RollRate), -0.35),
            (derivative("Cl_r", Cl, Regressor::YawRate), 0.2),
            (derivative("Cl_da", Cl, surface("da_deg")), 0.0011),
            (derivative("Cn_beta", Cn, Regressor::Beta), 0.0015),
            (derivative("Cn_p", Cn, Regressor::RollRate), 0.02),
            (derivative("Cn_r", Cn, Regressor::YawRate), -0.3),
            (derivative("Cn_dr", Cn, surface("dr_deg")), -0.0012),
            (derivative("Cn_dyv", Cn, vane("dyv_deg")), 2000.0),
        ],
    }
}

/// [`truth`] with products, magnitudes and airspeed as further regressors of its coefficients.
pub(crate) fn with_products(axis: Axis) -> Vec<(Derivative, f64)> {
    use Coefficient::{CN, Cl, Cm, Cn};
    let further = match axis {
        Axis::Longitudinal => vec![
            ("alpha * alpha", CN, 1e-4),
            ("alpha * de_deg", Cm, -1e-4),
            ("alpha * alpha", Cm, -2e-5),
            ("q * alpha", Cm, -0.05),
            ("velocity_ft_s", CN, 1e-5),
            ("alpha_dot", Cm, -3.0),
        ],
        Axis::Lateral => vec![
            ("abs(beta)", Cn, 1e-4),
            ("alpha * beta", Cl, -2e-5),
            ("alpha * p", Cl, -0.002),
        ],
    };
    let mut truth = truth(axis);
    for (written, coefficient, value) in further {
        let name = format!("{coefficient:?} along {written}");
        let own = derivative(&name, coefficient, Regressor::parse(written).unwrap());
        let alike = truth
            .iter()
            .rposition(|(d, _)| d.coefficient == coefficient);
        truth.insert(alike.unwrap(), (own, value));
    }
    truth
}

fn doublet(k: usize, start: usize, half: usize, size: f64) -> f64 {
    match k {
        k if k >= start && k < start + half => size,
        k if k >= start + half && k < start + 2 * half => -size,
        _ => 0.0,
    }
}

/// Record of trimmed flight with doublets on every surface.
pub(crate) fn record() -> Record {
    let constant = |v: f64| vec![v; SAMPLES];
    let of = |f: &dyn Fn(usize) -> f64| (0..SAMPLES).map(f).collect::<Vec<_>>();
    let wave = |k: usize, size: f64| size * (0.11 * k as f64).sin();
    let signals: Vec<(&str, Vec<f64>)> = vec![
        (signal::ALPHA_VANE, constant(20.0)),
        (signal::BETA_VANE, of(&|k| wave(k, 0.5))),
        (signal::VELOCITY, of(&|k| 320.0 + wave(k, 2.0))),
        (signal::MACH, constant(0.32)),
        (signal::ALTITUDE, constant(25_000.0)),
        (signal::P, of(&|k| wave(k, 2.0))),
        (signal::Q, of(&|k| wave(k, 1.0))),
        (signal::R, of(&|k| wave(k, 1.0))),
        (signal::THETA, constant(18.0)),
        (signal::PHI, of(&|k| wave(k, 3.0))),
        (signal::AN, constant(0.95)),
        (signal::AX, constant(0.3)),
        (signal::AY, constant(0.0)),
        (signal::QBAR, of(&|k| 52.0 + wave(k, 0.5))),
        (signal::THRUST, constant(10_000.0)),
        (signal::RPM_LEFT, constant(12_000.0)),
        (signal::RPM_RIGHT, constant(12_000.0)),
        (signal::MASS, constant(1040.0)),
        (signal::X_CG, constant(38.2)),
        (signal::Y_CG, constant(0.0)),
        (signal::Z_CG, constant(8.7)),
        (signal::IX, constant(22_360.0)),
        (signal::IY, constant(173_300.0)),
        (signal::IZ, constant(187_300.0)),
        (signal::IXZ, constant(-2080.0)),
        (
            "de_deg",
            of(&|k| doublet(k, 20, 40, 3.0) + doublet(k, 220, 20, 2.0)),
        ),
        ("dpv_deg", of(&|k| doublet(k, 120, 30, 5.0))),
        (
            "da_deg",
            of(&|k| doublet(k, 20, 30, 5.0) + doublet(k, 240, 15, 5.0)),
        ),
        ("dr_deg", of(&|k| doublet(k, 90, 30, 6.0))),
        ("dyv_deg", of(&|k| doublet(k, 160, 30, 6.0))),
    ];
    let series = |values: Vec<f64>| Series {
        marks: vec![Mark::Measured; values.len()],
        values,
    };
    Record {
        flight_id: "synthetic".into(),
        start_s: 0.0,
        step_s: STEP_S,
        samples: SAMPLES,
        signals: signals
            .into_iter()
            .map(|(name, values)| (name.to_owned(), series(values)))
            .collect(),
        remaining_errors: BTreeMap::new(),
    }
}

const SURFACES: [&str; 5] = ["de_deg", "dpv_deg", "da_deg", "dr_deg", "dyv_deg"];

/// The record with white noise on its surfaces.
pub(crate) fn with_noisy_surfaces(sd_deg: f64, noise: &mut Noise) -> Record {
    let mut record = record();
    for name in SURFACES {
        for value in &mut record.signals.get_mut(name).unwrap().values {
            *value += sd_deg * noise.gaussian();
        }
    }
    record
}

pub(crate) fn signals() -> ManeuverSignals {
    window_of(&record())
}

pub(crate) fn window_of(record: &Record) -> ManeuverSignals {
    let mass = MassProperties::Recorded;
    ManeuverSignals::cut(&aircraft(), record, 0..SAMPLES, SURFACES, mass).unwrap()
}

pub(crate) fn nothing_measured() -> Measurements {
    Measurements {
        values: vec![[0.0; OUTPUTS]; SAMPLES],
        used: vec![[true; OUTPUTS]; SAMPLES],
    }
}

/// Case with everything free, biases on two outputs too, and its true parameters.
fn case<const NX: usize, E: Equations<NX>>(
    truth: &[(Derivative, f64)],
    biases: &[Bias],
) -> (Case<NX, E>, Vec<f64>) {
    let model = Model {
        free: truth.iter().map(|(d, _)| d).collect(),
        held: vec![],
        biases: biases.iter().collect(),
        initial_state: InitialState::Estimated,
    };
    let case = Case::new(&aircraft(), &signals(), nothing_measured(), &model);
    let values: BTreeMap<&str, f64> = truth.iter().map(|(d, v)| (d.name.as_str(), *v)).collect();
    let mut parameters = case.starting_values(|name| values[name]);
    for (j, _) in biases.iter().enumerate() {
        parameters[case.derivatives() + j] = 0.01;
    }
    (case, parameters)
}

pub(crate) fn biases(axis: Axis) -> Vec<Bias> {
    let outputs = axis.outputs();
    [outputs[1], outputs[4]]
        .map(|output| Bias {
            name: format!("{output:?}_bias"),
            output,
        })
        .to_vec()
}

fn assert_sensitivities_match_differences<const NX: usize, E: Equations<NX>>() {
    let (case, parameters) = case::<NX, E>(&truth(E::AXIS), &biases(E::AXIS));
    let (mut at, mut up, mut down) = (case.response(), case.response(), case.response());
    case.respond(&parameters, &mut at).unwrap();
    let sensitivities = case.sensitivities(&parameters).unwrap();
    for j in 0..parameters.len() {
        let h = 1e-5 * parameters[j].abs().max(1e-2);
        let moved = |d: f64| {
            parameters
                .iter()
                .enumerate()
                .map(|(i, v)| if i == j { v + d } else { *v })
                .collect::<Vec<_>>()
        };
        case.respond(&moved(h), &mut up).unwrap();
        case.respond(&moved(-h), &mut down).unwrap();
        for k in (0..SAMPLES).step_by(37) {
            for o in 0..OUTPUTS {
                let numeric = (up.outputs[k][o] - down.outputs[k][o]) / (2.0 * h);
                let scale = numeric.abs().max(1e-3 / parameters[j].abs().max(1e-2));
                assert_abs_diff_eq!(
                    sensitivities.at(k, o, j) / scale,
                    numeric / scale,
                    epsilon = 2e-5
                );
            }
        }
    }
}

#[test]
fn sensitivities_are_those_of_finite_differences_for_every_parameter() {
    assert_sensitivities_match_differences::<3, Longitudinal>();
    assert_sensitivities_match_differences::<4, Lateral>();
}

#[test]
#[expect(
    clippy::needless_range_loop,
    reason = "an output's number counts in the case, the pass and the residuals"
)]
fn a_whole_pass_sums_its_sensitivities_over_blocks_of_counted_samples() {
    let axis = Axis::Longitudinal;
    let (mut case, parameters) = case::<3, Longitudinal>(&truth(axis), &biases(axis));
    for k in (0..SAMPLES).filter(|k| k % 5 == 0) {
        case.measurements.used[k][2] = false;
    }
    let mut response = case.response();
    case.respond(&parameters, &mut response).unwrap();
    let sensitivities = case.sensitivities(&parameters).unwrap();
    let residuals = cost::residuals(&case.measurements, &response);
    let (normal, block) = (&response.sums, response.sums.samples_per_block());
    assert!(block > 1);
    for b in 0..SAMPLES.div_ceil(block) {
        let samples = b * block..((b + 1) * block).min(SAMPLES);
        for o in 0..OUTPUTS {
            let mut sums = vec![0.0; parameters.len()];
            let BlockSums { count, residual } = normal.block(b, o, &mut sums);
            let counted = samples
                .clone()
                .filter(|&k| case.measurements.used[k][o])
                .count();
            assert_abs_diff_eq!(count, counted as f64);
            assert_abs_diff_eq!(
                residual,
                samples.clone().map(|k| residuals[k][o]).sum::<f64>(),
                epsilon = 1e-12
            );
            for (j, sum) in sums.iter().enumerate() {
                let each = samples.clone().map(|k| sensitivities.at(k, o, j));
                let (expected, size) = (each.clone().sum::<f64>(), each.map(f64::abs).sum::<f64>());
                assert_abs_diff_eq!(*sum, expected, epsilon = 1e-12 * (1.0 + size));
            }
        }
    }
}

/// Standard deviations of the noise, deg, deg/s, g, in the order of the outputs.
pub(crate) const NOISE: [f64; OUTPUTS] = [0.08, 0.05, 0.05, 0.01, 0.005];

/// Weights that are not the inverse of the noise's variances, as those of Tables 2 and 4 are not.
pub(crate) const TABLE: [f64; OUTPUTS] = [12.0, 60.0, 30.0, 5000.0, 9000.0];

/// Uniform numbers of a linear congruential generator, made Gaussian by the sum of twelve.
pub(crate) struct Noise(pub u64);

impl Noise {
    pub fn gaussian(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Replaces the measurements of a case by its response to `parameters` plus noise whose successive
/// samples have the correlation `colour`.
pub(crate) fn measure<const NX: usize, E: Equations<NX>>(
    case: &mut Case<NX, E>,
    parameters: &[f64],
    noise: &mut Noise,
    colour: f64,
) {
    let mut response = case.response();
    case.respond(parameters, &mut response).unwrap();
    let mut state = NOISE.map(|sd| sd * noise.gaussian());
    let fresh = (1.0 - colour * colour).sqrt();
    for (k, y) in response.outputs.iter().enumerate() {
        for o in 0..OUTPUTS {
            case.measurements.values[k][o] = y[o] + state[o];
            state[o] = colour * state[o] + fresh * NOISE[o] * noise.gaussian();
        }
    }
}

fn fit<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    start: Vec<f64>,
    weights: Weights,
) -> Fit {
    estimate(
        case,
        start,
        TABLE,
        weights,
        [1e-6; OUTPUTS],
        &Settings::default(),
    )
}

fn assert_truth_is_recovered<const NX: usize, E: Equations<NX>>() {
    let (mut case, parameters) = case::<NX, E>(&truth(E::AXIS), &biases(E::AXIS));
    let mut response = case.response();
    case.respond(&parameters, &mut response).unwrap();
    case.measurements.values.clone_from(&response.outputs);
    let start = parameters.iter().map(|v| 1.2 * v).collect();
    let settings = Settings {
        tolerance: 1e-14,
        ..Settings::default()
    };
    let fit = estimate(
        &case,
        start,
        TABLE,
        Weights::Table,
        [1e-6; OUTPUTS],
        &settings,
    );
    assert_eq!(fit.outcome, Outcome::Converged, "{}", fit.reason);
    for (value, truth) in fit.values.iter().zip(&parameters) {
        assert_relative_eq!(*value, *truth, max_relative = 1e-4, epsilon = 1e-7);
    }
}

#[test]
fn true_parameters_are_recovered_from_a_response_without_noise() {
    assert_truth_is_recovered::<3, Longitudinal>();
    assert_truth_is_recovered::<4, Lateral>();
}

/// Scatter of estimates over bounds (white and corrected), parameter by parameter.
fn scatter<const NX: usize, E: Equations<NX>>(
    draws: u32,
    colour: f64,
    weights: Weights,
) -> Vec<(String, f64, f64)> {
    let (mut case, parameters) = case::<NX, E>(&truth(E::AXIS), &[]);
    let (n, mut noise) = (parameters.len(), Noise(20_260_101));
    let (mut square, mut white, mut corrected) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for _ in 0..draws {
        measure(&mut case, &parameters, &mut noise, colour);
        let fit = fit(&case, parameters.clone(), weights);
        assert_eq!(fit.outcome, Outcome::Converged, "{}", fit.reason);
        let (w, c) = (fit.covariance.unwrap(), fit.covariance_corrected.unwrap());
        for j in 0..n {
            square[j] += (fit.values[j] - parameters[j]).powi(2);
            white[j] += w[(j, j)];
            corrected[j] += c[(j, j)];
        }
    }
    (0..n)
        .map(|j| {
            (
                case.names[j].clone(),
                (square[j] / white[j]).sqrt(),
                (square[j] / corrected[j]).sqrt(),
            )
        })
        .collect()
}

#[test]
fn bounds_match_the_scatter_under_white_noise_for_other_weights() {
    // 120 draws give a scatter to 6.5 %; three standard errors to each side.
    for (name, white, _) in scatter::<3, Longitudinal>(120, 0.0, Weights::Table) {
        assert!(
            (0.8..1.2).contains(&white),
            "{name}: scatter is {white:.2} of the bound"
        );
    }
    for (name, white, _) in scatter::<4, Lateral>(120, 0.0, Weights::Table) {
        assert!(
            (0.8..1.2).contains(&white),
            "{name}: scatter is {white:.2} of the bound"
        );
    }
}

#[test]
fn corrected_bounds_match_the_scatter_under_coloured_noise() {
    // 80 draws give a scatter to 8 %; three standard errors to each side. Student's t widens the
    // bound by some 10 %.
    for (name, white, corrected) in scatter::<3, Longitudinal>(80, 0.9, Weights::Table) {
        assert!(
            white > 2.0,
            "{name}: the white bound should be far too small, the scatter is {white:.2} of it"
        );
        assert!(
            (0.66..1.14).contains(&corrected),
            "{name}: the scatter is {corrected:.2} of the corrected bound"
        );
    }
}

#[test]
fn estimated_weights_settle_at_the_inverse_of_the_noise_s_variances() {
    let (mut case, parameters) = case::<3, Longitudinal>(&truth(Axis::Longitudinal), &[]);
    measure(&mut case, &parameters, &mut Noise(7), 0.0);
    let fit = fit(&case, parameters, Weights::Estimated);
    assert_eq!(fit.outcome, Outcome::Converged, "{}", fit.reason);
    for (weight, sd) in fit.weights.iter().zip(NOISE) {
        assert_relative_eq!(weight.powf(-0.5), sd, max_relative = 0.12);
    }
}

#[test]
fn costs_are_those_of_the_table_s_weights_however_the_fit_is_weighted() {
    let (mut case, parameters) = case::<3, Longitudinal>(&truth(Axis::Longitudinal), &[]);
    measure(&mut case, &parameters, &mut Noise(7), 0.0);
    let [table, estimated] =
        [Weights::Table, Weights::Estimated].map(|weights| fit(&case, parameters.clone(), weights));
    assert_eq!(estimated.initial_cost, table.initial_cost);
    // The table's own minimum is the least, and the other fit is near it.
    let ratio = estimated.final_cost.unwrap() / table.final_cost.unwrap();
    assert!((1.0..1.01).contains(&ratio), "{ratio}");
}

#[test]
fn with_estimated_weights_the_bound_is_that_of_cramer_and_rao() {
    let (mut case, parameters) = case::<3, Longitudinal>(&truth(Axis::Longitudinal), &[]);
    measure(&mut case, &parameters, &mut Noise(7), 0.0);
    let fit = fit(&case, parameters, Weights::Estimated);
    let sums = super::cost::sums(&fit.response, &fit.weights);
    let inverse = sums.information.try_inverse().unwrap();
    let covariance = fit.covariance.unwrap();
    for j in 0..case.parameters() {
        assert_relative_eq!(covariance[(j, j)], inverse[(j, j)], max_relative = 5e-3);
    }
}

#[test]
fn flagged_samples_do_not_count() {
    let (mut case, parameters) = case::<3, Longitudinal>(&truth(Axis::Longitudinal), &[]);
    measure(&mut case, &parameters, &mut Noise(3), 0.0);
    for k in 100..110 {
        case.measurements.used[k] = [false; OUTPUTS];
    }
    let without = fit(&case, parameters.clone(), Weights::Table);
    for k in 100..110 {
        case.measurements.values[k] = [1e6; OUTPUTS];
    }
    assert_eq!(
        fit(&case, parameters, Weights::Table).values,
        without.values
    );
}

#[test]
fn inseparable_derivatives_are_named_and_have_no_bound() {
    let mut truth = truth(Axis::Longitudinal);
    truth.push((
        derivative("Cm_twin", Coefficient::Cm, surface("de_deg")),
        0.0,
    ));
    let (mut case, parameters) = case::<3, Longitudinal>(&truth, &[]);
    measure(&mut case, &parameters, &mut Noise(3), 0.0);
    let fit = fit(&case, parameters, Weights::Table);
    assert_eq!(fit.outcome, Outcome::Unidentifiable);
    assert!(
        fit.reason.contains("Cm_de") && fit.reason.contains("Cm_twin"),
        "{}",
        fit.reason
    );
    assert!(fit.covariance.is_none() && fit.covariance_corrected.is_none());
}

#[test]
fn a_surface_that_never_moves_is_named() {
    let mut truth = truth(Axis::Lateral);
    truth.push((
        derivative("Cn_ghost", Coefficient::Cn, surface("ghost_deg")),
        0.0,
    ));
    let model = Model {
        free: truth.iter().map(|(d, _)| d).collect(),
        ..Model::default()
    };
    let mut record = record();
    let still = Series {
        values: vec![0.0; SAMPLES],
        marks: vec![Mark::Measured; SAMPLES],
    };
    record.signals.insert("ghost_deg".into(), still);
    let surfaces = ["dr_deg", "da_deg", "dyv_deg", "ghost_deg"];
    let signals = ManeuverSignals::cut(
        &aircraft(),
        &record,
        0..SAMPLES,
        surfaces,
        MassProperties::Recorded,
    )
    .unwrap();
    let case = Case::<4, Lateral>::new(&aircraft(), &signals, nothing_measured(), &model);
    let fit = fit(&case, case.starting_values(|_| 0.0), Weights::Table);
    assert_eq!(fit.outcome, Outcome::Unidentifiable);
    assert!(fit.reason.contains("Cn_ghost"), "{}", fit.reason);
}

#[test]
fn a_diverging_integration_is_an_outcome_with_its_time() {
    let (mut case, parameters) = case::<3, Longitudinal>(&truth(Axis::Longitudinal), &[]);
    measure(&mut case, &parameters, &mut Noise(3), 0.0);
    let at = case.names.iter().position(|n| n == "Cm_alpha").unwrap();
    let mut unstable = parameters;
    unstable[at] = 10.0;
    let fit = fit(&case, unstable, Weights::Table);
    assert_eq!(fit.outcome, Outcome::NotConverged);
    assert!(
        fit.reason.contains("diverges") && fit.reason.contains(" s into"),
        "{}",
        fit.reason
    );
}

#[test]
fn the_consider_covariance_is_the_effect_of_a_held_value_s_error() {
    let truth = truth(Axis::Longitudinal);
    let (mut full, parameters) = case::<3, Longitudinal>(&truth, &[]);
    let mut response = full.response();
    full.respond(&parameters, &mut response).unwrap();
    full.measurements.values.clone_from(&response.outputs);
    let error = 1e-4;
    let held = |value: f64| Model {
        free: truth
            .iter()
            .map(|(d, _)| d)
            .filter(|d| d.name != "Cm_de")
            .collect(),
        held: truth
            .iter()
            .filter(|(d, _)| d.name == "Cm_de")
            .map(|(d, _)| (d, value))
            .collect(),
        ..Model::default()
    };
    let values: BTreeMap<&str, f64> = full
        .names
        .iter()
        .map(String::as_str)
        .zip(parameters.iter().copied())
        .collect();
    let estimated = |value: f64| {
        let case = Case::<3, Longitudinal>::new(
            &aircraft(),
            &signals(),
            full.measurements.clone(),
            &held(value),
        );
        let start = case.names.iter().map(|n| values[n.as_str()]).collect();
        let settings = Settings {
            tolerance: 1e-13,
            ..Settings::default()
        };
        let fit = estimate(
            &case,
            start,
            TABLE,
            Weights::Table,
            [1e-6; OUTPUTS],
            &settings,
        );
        (case, fit)
    };
    let (case, mut right) = estimated(-0.012);
    let (_, wrong) = estimated(-0.012 + error);
    right.covariance = right.covariance.map(|m| m * 0.0);
    consider::consider(
        &case,
        &full,
        &values,
        &[("Cm_de", error)].into(),
        &mut right,
    );
    let considered = right.covariance_held.unwrap();
    for j in 0..case.names.len() {
        let shift = (wrong.values[j] - right.values[j]).abs();
        assert_relative_eq!(
            considered[(j, j)].sqrt(),
            shift,
            max_relative = 0.1,
            epsilon = 1e-3 * error,
        );
    }
    assert!(considered.diagonal().max() > 0.0);
}
