//! Free run against closed forms, and with the truth as model.

use approx::{assert_abs_diff_eq, assert_relative_eq};
use nalgebra::{Matrix2, Vector3};

use super::fixture::{flown, noisy, recording, shipped, simulation, truth, verdict};
use crate::aero::WindTunnel;
use crate::flight::signal;
use crate::lab::simulator::FlownManeuver;
use crate::proof_of_match::free_run::Start;
use crate::proof_of_match::start;
use crate::tables::MatchVerdict;
use crate::units::{DEG, RAD};

/// Places of outputs.
const ALPHA: usize = 0;
const P: usize = 3;
const Q: usize = 4;
const R: usize = 5;

#[test]
fn without_aerodynamics_and_engines_the_body_tumbles_with_its_energy_and_momentum() {
    let flown = flown("PYRS", 20.0);
    let mut aircraft = shipped().config.aircraft.clone();
    aircraft.engine_inertia_slug_ft2 = 0.0;
    let mut record = flown.record.clone();
    // Fuel that burns would change the inertias.
    for name in [
        signal::MASS,
        signal::IX,
        signal::IY,
        signal::IZ,
        signal::IXZ,
    ] {
        let values = &mut record.signals.get_mut(name).unwrap().values;
        let first = values[0];
        values.fill(first);
    }
    let recording = recording(&flown, &record, &aircraft);
    let nothing = WindTunnel::default();
    let simulation = simulation(&flown, &aircraft, &recording, &nothing);
    let mut start: Start = start::matched(&simulation).start;
    start.trim.coefficients = [0.0; 6];
    start.state[3..6].copy_from_slice(&[0.9, 0.05, -0.1]);
    let run = simulation.fly(&start, 120, 1);
    assert_eq!(run.outputs.len(), 120);
    let inertia = recording.inputs(0).loading.inertia();
    let rates = |k: usize| Vector3::from([P, Q, R].map(|i| RAD * run.outputs[k][i]));
    let energy = |k: usize| rates(k).dot(&(inertia * rates(k)));
    let momentum = |k: usize| (inertia * rates(k)).norm();
    for k in [40, 80, 119] {
        assert!((rates(k) - rates(0)).norm() > 0.05, "it tumbles");
        assert_relative_eq!(energy(k), energy(0), max_relative = 1e-7);
        assert_relative_eq!(momentum(k), momentum(0), max_relative = 1e-7);
    }
}

/// Values of true derivatives by name.
fn value(flown: &FlownManeuver, name: &str) -> f64 {
    let own = flown.truth.iter().find(|d| d.derivative == name);
    own.unwrap().value
}

#[test]
fn a_small_disturbance_decays_as_the_short_period_of_the_linear_equations() {
    // With a pitch rate of 2 deg/s more the difference from the undisturbed run obeys
    // (α, q)' = A (α, q) with the two derivatives of force and moment; its solution is exp(A t).
    let flown = flown("PPSS", 10.0);
    let aircraft = &shipped().config.aircraft;
    let recording = recording(&flown, &flown.record, aircraft);
    let truth = truth(&flown, "", 1.0);
    let simulation = simulation(&flown, aircraft, &recording, &truth);
    let start = start::matched(&simulation).start;
    let disturbed = start.with_change(4, 2.0 * RAD);
    let (base, moved) = (
        simulation.fly(&start, 60, 1),
        simulation.fly(&disturbed, 60, 1),
    );
    let loading = recording.inputs(0).loading;
    let motion = recording.motions[0];
    let (speed, qbar) = (motion.velocity, motion.qbar);
    let force = qbar * aircraft.wing_area_ft2 / loading.mass_slug / speed;
    let moment = qbar * aircraft.wing_area_ft2 * aircraft.chord_ft / loading.iy_slug_ft2;
    let per_rate = 0.5 * aircraft.chord_ft / speed;
    let cos = motion.alpha.cos();
    let lift_slope = DEG * value(&flown, "CN_alpha") * cos;
    let a = Matrix2::new(
        -force * lift_slope,
        1.0 - force * cos * value(&flown, "CN_q") * per_rate,
        moment * DEG * value(&flown, "Cm_alpha"),
        moment * value(&flown, "Cm_q") * per_rate,
    );
    let (mut largest, mut last): (f64, f64) = (0.0, 0.0);
    for k in 0..60 {
        let t = k as f64 * recording.step_s;
        let exact = (a * t).exp() * nalgebra::Vector2::new(0.0, 2.0);
        let difference = moved.outputs[k][Q] - base.outputs[k][Q];
        largest = largest.max(exact.y.abs());
        last = exact.y.abs();
        // Airspeed, path and axial force take part a little.
        assert_abs_diff_eq!(difference, exact.y, epsilon = 0.05);
    }
    assert!(last < 0.8 * largest, "it decays to {last}");
}

#[test]
fn halving_the_step_changes_nothing_that_a_tolerance_sees() {
    let flown = flown("PYRS", 20.0);
    let aircraft = &shipped().config.aircraft;
    let recording = recording(&flown, &flown.record, aircraft);
    let truth = truth(&flown, "", 1.0);
    let simulation = simulation(&flown, aircraft, &recording, &truth);
    let start = start::matched(&simulation).start;
    let (fine, coarse) = (
        simulation.fly(&start, recording.samples, 1),
        simulation.fly(&start, recording.samples, 2),
    );
    for (k, coarse) in coarse.outputs.iter().enumerate() {
        for i in [ALPHA, P, Q, R] {
            assert_abs_diff_eq!(fine.outputs[2 * k][i], coarse[i], epsilon = 0.1);
        }
    }
}

#[test]
fn the_truth_as_model_passes_every_maneuver_with_sensor_noise_alone() {
    let mut failed = Vec::new();
    let mut flown_count = 0;
    for class in shipped().cards.programs.keys() {
        for alpha_deg in [10.0, 20.0, 30.0, 40.0] {
            let flown = flown(class, alpha_deg);
            for seed in 0..3 {
                let record = noisy(&flown, seed);
                let row = verdict(&flown, &record, truth(&flown, "", 1.0));
                flown_count += 1;
                if row.verdict != MatchVerdict::Inside {
                    failed.push((
                        class,
                        alpha_deg,
                        seed,
                        row.margin,
                        row.decided_by,
                        row.reason,
                    ));
                }
            }
        }
    }
    assert!(
        failed.is_empty(),
        "{} of {flown_count}: {failed:#?}",
        failed.len()
    );
}

#[test]
fn without_noise_the_truth_as_model_reproduces_the_maneuver() {
    for class in ["PPSS", "PYRSTV", "SSIMD_LON", "OLAT"] {
        let flown = flown(class, 20.0);
        let row = verdict(&flown, &flown.record, truth(&flown, "", 1.0));
        assert!(row.margin.unwrap() > 0.8, "{row:?}");
    }
}
