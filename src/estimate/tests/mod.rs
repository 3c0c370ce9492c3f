//! Joint estimates and predictions on simulated maneuvers of known derivatives.

mod absent_outputs;
mod absent_surfaces;
mod alpha_slopes;
mod calibration;
mod doubt;
mod evidence;
mod gusts;
mod resting_surfaces;

use std::collections::BTreeMap;

use approx::assert_relative_eq;

use super::estimated::rejected_fit;
use super::joint::{self, bins};
use super::prediction::{self, predicting_maneuvers};
use super::*;
use crate::aero::{AeroModel, Axis, Bias, Derivative, Output, WindTunnel};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::{ManeuverSignals, MassProperties};
use crate::dynamics::tests::aircraft;
use crate::dynamics::{Longitudinal, OUTPUTS};
use crate::flight::record::Series;
use crate::flight::{Mark, Record, signal};
use crate::maneuver::{Class, Maneuver, Recognition, Status};
use crate::output_error::tests::{NOISE, Noise, SAMPLES, TABLE, nothing_measured, record, truth};
use crate::output_error::{Case, InitialState, Model};
use crate::tables::{EstimateRow, FitRow, Outcome, Participation, PredictionStatus};

/// The aircraft, model, class and settings of the tests.
struct Bench {
    aircraft: Aircraft,
    aero_model: AeroModel,
    tunnel: WindTunnel,
    settings: Settings,
    class: Class,
}

fn bench() -> Bench {
    let axis = Axis::Longitudinal;
    let derivatives: Vec<Derivative> = truth(axis).into_iter().map(|(d, _)| d).collect();
    let biases = vec![Bias {
        name: "an_bias".into(),
        output: Output::An,
    }];
    let names = derivatives
        .iter()
        .map(|d| d.name.clone())
        .chain(["an_bias".to_owned()]);
    let class = Class {
        name: "steps".into(),
        title: String::new(),
        axis,
        recognition: Recognition::default(),
        statuses: names.map(|n| (n, Status::Estimated)).collect(),
        weights: axis.outputs().into_iter().zip(TABLE).collect(),
        overrides: vec![],
    };
    Bench {
        aircraft: aircraft(),
        aero_model: AeroModel {
            derivatives,
            biases,
            combined: vec![],
        },
        tunnel: WindTunnel::default(),
        settings: Settings::default(),
        class,
    }
}

impl Bench {
    fn context(&self) -> Context<'_> {
        let Bench {
            aircraft,
            aero_model,
            tunnel,
            settings,
            ..
        } = self;
        Context::new(aircraft, aero_model, tunnel, settings)
    }

    /// Case of a record in which the true derivatives are free, with their values.
    fn true_case(&self, record: &Record) -> (Case<3, Longitudinal>, BTreeMap<String, f64>) {
        let truth = truth(self.class.axis);
        let model = Model {
            free: truth.iter().map(|(d, _)| d).collect(),
            ..Model::default()
        };
        let surfaces = ["de_deg", "dpv_deg"];
        let recorded = MassProperties::Recorded;
        let signals =
            ManeuverSignals::cut(&self.aircraft, record, 0..SAMPLES, surfaces, recorded).unwrap();
        let case = Case::new(&self.aircraft, &signals, nothing_measured(), &model);
        let values = truth.iter().map(|(d, value)| (d.name.clone(), *value));
        (case, values.collect())
    }

    /// A record whose outputs are the response to the true derivatives times `factor`, with noise
    /// and a bias of an.
    fn flown(&self, seed: u64, factor: f64, an_bias_g: f64) -> Record {
        self.flown_with_colour(seed, factor, an_bias_g, 0.0)
    }

    /// Record as of [`Bench::flown`], with noise whose neighbouring samples have this correlation.
    fn flown_with_colour(
        &self,
        seed: u64,
        factor: f64,
        an_bias_g: f64,
        correlation: f64,
    ) -> Record {
        let mut record = record();
        let (case, values) = self.true_case(&record);
        let mut response = case.response();
        case.respond(
            &case.starting_values(|n| values[n] * if n == "Cm_de" { factor } else { 1.0 }),
            &mut response,
        )
        .unwrap();
        let mut noise = Noise(seed);
        for (o, output) in self.class.axis.outputs().into_iter().enumerate() {
            let bias = if output == Output::An { an_bias_g } else { 0.0 };
            let mut error = noise.gaussian();
            let mut reading = |y: &[f64; OUTPUTS]| {
                let reading = y[o] + bias + NOISE[o] * error;
                let change = (1.0 - correlation * correlation).sqrt() * noise.gaussian();
                error = correlation * error + change;
                reading
            };
            let values = response.outputs.iter().map(&mut reading).collect();
            record.signals.insert(
                output.signal().into(),
                Series {
                    values,
                    marks: vec![Mark::Measured; SAMPLES],
                },
            );
        }
        record
    }

    fn estimate(&self, record: &Record, maneuver: &Maneuver) -> Estimated {
        super::maneuver(record, maneuver, &self.class, &self.context())
    }
}

fn maneuver(id: &str, alpha_deg: f64) -> Maneuver {
    Maneuver {
        class: "steps".into(),
        end_s: 100.0,
        mass_slug: 1040.0,
        x_cg_ft: 38.2,
        samples: SAMPLES,
        ..Maneuver::example(id, alpha_deg)
    }
}

fn row<'a>(estimated: &'a Estimated, name: &str) -> &'a EstimateRow {
    estimated
        .estimates
        .iter()
        .find(|r| r.derivative == name)
        .unwrap()
}

#[test]
fn maneuvers_are_parted_at_the_gaps_between_test_points() {
    let at = |alphas: &[f64]| {
        alphas
            .iter()
            .map(|a| maneuver(&format!("m{a}"), *a))
            .collect::<Vec<_>>()
    };
    let of = |maneuvers: &[Maneuver], settings: &JointSettings| {
        bins(maneuvers, settings)
            .into_iter()
            .map(|b| (b.joint_id, b.members))
            .collect::<Vec<_>>()
    };
    let flown = at(&[20.3, 10.0, 19.8, 30.0, 10.4, 20.0]);
    let expected = [
        ("joint/steps/10.20".to_owned(), vec![1, 4]),
        ("joint/steps/20.03".to_owned(), vec![0, 2, 5]),
    ];
    assert_eq!(of(&flown, &JointSettings::default()), expected);
    let centres = JointSettings {
        alpha_bin_deg: 1.0,
        centres_deg: vec![20.0],
        ..JointSettings::default()
    };
    assert_eq!(
        of(&flown, &centres),
        [("joint/steps/20.03".to_owned(), vec![0, 2, 5])]
    );
    let mut other = flown;
    other[1].class = "other".into();
    assert_eq!(of(&other, &JointSettings::default()).len(), 1);
}

#[test]
fn maneuvers_joined_have_smaller_bounds_and_no_biases_and_a_spoiled_one_is_left_out_and_named() {
    let bench = bench();
    let (a, b) = (bench.flown(1, 1.0, 0.0), bench.flown(2, 1.0, 0.05));
    let mut spoiled = bench.flown(3, 1.0, 0.0);
    for name in [signal::AN, signal::AX] {
        spoiled
            .signals
            .get_mut(name)
            .unwrap()
            .marks
            .fill(Mark::Bridged);
    }
    let maneuvers = [
        maneuver("a", 20.0),
        maneuver("b", 20.4),
        maneuver("c", 20.2),
    ];
    let members = [
        (&a, &maneuvers[0]),
        (&b, &maneuvers[1]),
        (&spoiled, &maneuvers[2]),
    ];
    let joined = joint::estimate(
        "joint/steps/20.20",
        &members,
        &[],
        &bench.class,
        &bench.context(),
    );
    let fit = &joined.estimated.fit;
    assert_eq!(fit.outcome, Outcome::Converged, "{}", fit.reason);
    assert!(
        fit.reason
            .contains("left out: c (40% of its output samples are marked)"),
        "{}",
        fit.reason
    );
    let alone = bench.estimate(&a, &maneuvers[0]);
    let (single, both) = (row(&alone, "Cm_de"), row(&joined.estimated, "Cm_de"));
    assert_eq!(both.maneuver_id, "joint/steps/20.20");
    assert_relative_eq!(
        both.bound.unwrap() / single.bound.unwrap(),
        0.5f64.sqrt(),
        max_relative = 0.1
    );
    assert!((both.value.unwrap() + 0.012).abs() < 4.0 * both.bound.unwrap());
    assert!(
        joined
            .estimated
            .estimates
            .iter()
            .all(|r| r.derivative != "an_bias")
    );
    assert_relative_eq!(both.alpha_deg, 20.2, max_relative = 1e-9);
    assert_eq!(joined.members.len(), 3);
    assert_eq!(
        joined
            .members
            .iter()
            .filter(|m| m.part == Participation::Joined)
            .count(),
        2
    );
    assert!(joined.members.iter().all(|m| m.maneuvers == 2));
}

#[test]
fn with_one_sound_maneuver_there_is_nothing_to_join_and_the_row_says_so() {
    let bench = bench();
    let a = bench.flown(1, 1.0, 0.0);
    let mut spoiled = bench.flown(3, 1.0, 0.0);
    spoiled.signals.remove(signal::AN);
    let maneuvers = [maneuver("a", 20.0), maneuver("c", 20.2)];
    let members = [(&a, &maneuvers[0]), (&spoiled, &maneuvers[1])];
    let joined = joint::estimate(
        "joint/steps/20.10",
        &members,
        &[],
        &bench.class,
        &bench.context(),
    );
    assert_eq!(joined.estimated.fit.outcome, Outcome::Rejected);
    assert!(
        joined
            .estimated
            .fit
            .reason
            .contains("left out: c (the record has no signal"),
        "{:?}",
        joined.estimated.fit
    );
}

#[test]
fn a_maneuver_of_which_nothing_is_free_is_rejected_and_no_panic() {
    let mut bench = bench();
    bench
        .class
        .statuses
        .values_mut()
        .for_each(|status| *status = Status::Inactive);
    bench.settings.initial_state = InitialState::Measured;
    let record = bench.flown(1, 1.0, 0.0);
    for hold in [Hold::Table, Hold::Evidence] {
        bench.settings.hold = hold;
        let fit = bench.estimate(&record, &maneuver("a", 20.0)).fit;
        assert_eq!(
            (fit.outcome, fit.reason.as_str()),
            (Outcome::Rejected, "nothing is free to be estimated")
        );
    }
}

/// Prediction of a maneuver whose `Cm_de` is `factor` times the true one from two with the true
/// one.
fn predicted(factor: f64) -> prediction::Predicted {
    let bench = bench();
    let near = [bench.flown(1, 1.0, 0.0), bench.flown(2, 1.0, 0.05)]
        .map(|r| bench.estimate(&r, &maneuver("o", 20.0)));
    let record = bench.flown(3, factor, -0.1);
    let maneuver = maneuver("p", 20.0);
    prediction::maneuver(
        &record,
        &maneuver,
        &bench.class,
        &bench.context(),
        &bench.estimate(&record, &maneuver),
        &[&near[0], &near[1]],
    )
}

#[test]
fn maneuvers_with_the_same_derivatives_predict_each_other_to_the_noise() {
    let predicted = predicted(1.0);
    let summary = &predicted.summary;
    assert_eq!(
        (summary.prediction.as_ref(), summary.predicted_from),
        (Some(&PredictionStatus::Predicted), Some(2))
    );
    assert_eq!(predicted.outputs.len(), OUTPUTS);
    for (row, noise) in predicted.outputs.iter().zip(NOISE) {
        assert_relative_eq!(row.root_mean_square, noise, max_relative = 0.15);
    }
    let sum = summary.theil_bias.unwrap()
        + summary.theil_variance.unwrap()
        + summary.theil_covariance.unwrap();
    assert_relative_eq!(sum, 1.0, max_relative = 1e-9);
    assert!(
        summary.r_squared_of[&Output::Q] > 0.99,
        "{:?}",
        summary.r_squared_of
    );
    // Noise widens what is measured and not what is predicted: a little of it counts as variance.
    assert!(
        summary.theil_covariance.unwrap() > 0.8 && summary.theil_bias.unwrap() < 0.01,
        "{summary:?}"
    );
}

#[test]
fn a_maneuver_with_another_derivative_is_caught() {
    let (same, other) = (predicted(1.0), predicted(1.3));
    let pitch_rate = |p: &prediction::Predicted| p.summary.theil_of[&Output::Q];
    assert!(
        pitch_rate(&other) > 3.0 * pitch_rate(&same),
        "{} {}",
        pitch_rate(&other),
        pitch_rate(&same)
    );
    assert!(other.summary.predicted_cost.unwrap() > 5.0 * same.summary.predicted_cost.unwrap());
}

#[test]
fn others_are_those_of_the_class_that_are_near_and_converged() {
    let bench = bench();
    let mut maneuvers: Vec<Maneuver> = [20.0, 22.4, 22.6, 20.1]
        .iter()
        .enumerate()
        .map(|(i, a)| maneuver(&format!("m{i}"), *a))
        .collect();
    maneuvers[3].class = "other".into();
    let mut fits: Vec<FitRow> = maneuvers
        .iter()
        .map(|m| rejected_fit(m, String::new()))
        .collect();
    for fit in &mut fits[..2] {
        fit.outcome = Outcome::Converged;
    }
    let settings = bench.settings.prediction.unwrap();
    assert_eq!(
        predicting_maneuvers(&maneuvers, &fits, &settings),
        [Some(vec![1]), Some(vec![0]), None, None]
    );
}
