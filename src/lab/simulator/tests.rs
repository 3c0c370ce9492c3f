//! The simulator against the estimator: the same physics, written down twice, must agree.

use std::fs;
use std::path::Path;

use approx::assert_abs_diff_eq;
use nalgebra::{SVector, Vector3};

use super::air_data::AirData;
use super::body::{Euler, State};
use super::noise::Noise;
use super::plant::{Given, Instant};
use super::{Flown, Instrument, Instruments, Program, sensors};
use crate::dynamics::{Equations, Lateral, Longitudinal, Motion};
use crate::earth::gravity_ft_s2;
use crate::estimate::{self, Basis, Estimated};
use crate::flight::signal;
use crate::lab::campaign::SimulatedCampaign;
use crate::tables::Outcome;
use crate::units::DEG;

fn simulation() -> SimulatedCampaign {
    SimulatedCampaign::load(Path::new("pipelines/harv/cards.yaml")).unwrap()
}

/// The aircraft at a random state with random deflections, some rotation and sideslip.
fn anywhere(noise: &mut Noise, surfaces: usize) -> (State, Given) {
    let mut within = |low: f64, high: f64| low + (high - low) * noise.uniform();
    let speed = within(220.0, 600.0);
    let (alpha, beta) = (within(0.05, 1.05), within(-0.2, 0.2));
    let attitude = Euler {
        phi: within(-1.0, 1.0),
        theta: within(-0.8, 0.9),
        psi: within(-3.0, 3.0),
    }
    .attitude();
    let state = State {
        velocity: AirData::velocity(speed, alpha, beta),
        rates: Vector3::new(within(-0.9, 0.9), within(-0.5, 0.5), within(-0.5, 0.5)),
        attitude,
        position: Vector3::new(0.0, 0.0, within(18_000.0, 30_000.0)),
    };
    let given = Given {
        surfaces: (0..surfaces).map(|_| within(-10.0, 10.0)).collect(),
        thrust_lbf: within(2000.0, 14_000.0),
        rpm: within(20_000.0, 26_000.0),
        gust: Vector3::zeros(),
        mass_slug: within(985.0, 1065.0),
    };
    (state, given)
}

/// The instant as the estimator would have measured it without any error.
fn measured(
    simulation: &SimulatedCampaign,
    state: &State,
    given: &Given,
    instant: &Instant,
) -> Motion {
    let (aircraft, loading, angles) =
        (&simulation.config.aircraft, &instant.loading, state.euler());
    Motion {
        alpha: instant.air.alpha,
        beta: instant.air.beta,
        velocity: instant.air.velocity_ft_s,
        rates: state.rates.into(),
        accelerations: instant.slope.rates.into(),
        theta: angles.theta,
        phi: angles.phi,
        force_x: instant.specific_force.x,
        force_y: instant.specific_force.y,
        force_z: instant.specific_force.z,
        gravity: gravity_ft_s2(aircraft.latitude_deg, state.position.z),
        qbar: instant.air.qbar_psf,
        mass: loading.mass_slug,
        thrust: given.thrust_lbf,
        ix: loading.ix_slug_ft2,
        iy: loading.iy_slug_ft2,
        iz: loading.iz_slug_ft2,
        ixz: loading.ixz_slug_ft2,
        engine_momentum: aircraft.engine_inertia_slug_ft2 * given.rpm * 2.0 * std::f64::consts::PI
            / 60.0,
        cg: loading.cg(),
    }
}

/// The disagreement of states' rates (rad/s, rad/s²) and of outputs (deg, deg/s, g) at one random
/// instant.
fn disagreement(simulation: &SimulatedCampaign, noise: &mut Noise) -> (f64, f64) {
    let (plant, aircraft) = (&simulation.simulator.plant, &simulation.config.aircraft);
    let (state, given) = anywhere(noise, simulation.simulator.settings().surface_names.len());
    let instant = plant.instant(&state, &given, None);
    let values = plant
        .aerodynamics
        .values(instant.air.alpha * DEG, instant.air.mach);
    let (force, moment) = plant.aerodynamics.loads(
        aircraft,
        &values,
        &instant.air,
        &state.rates,
        &given.surfaces,
    );
    let area = instant.air.qbar_psf * aircraft.wing_area_ft2;
    let (chord, span) = (area * aircraft.chord_ft, area * aircraft.span_ft);
    let motion = measured(simulation, &state, &given, &instant);

    let known = Longitudinal::known(aircraft, &motion);
    let x = Longitudinal::measured_state(&motion);
    let c = [-force.z / area, moment.y / chord, -force.x / area];
    let pitch = Longitudinal::rates(&known, &x, &c).rates;
    let pitch_outputs =
        Longitudinal::outputs(&known, &Longitudinal::sensed(aircraft, &motion), &x, &c).outputs;
    let known = Lateral::known(aircraft, &motion);
    let x = Lateral::measured_state(&motion);
    let c = [force.y / area, moment.x / span, moment.z / span];
    let lateral = Lateral::rates(&known, &x, &c).rates;
    let lateral_outputs =
        Lateral::outputs(&known, &Lateral::sensed(aircraft, &motion), &x, &c).outputs;

    let (v, v_dot, w_dot) = (state.velocity, instant.slope.velocity, instant.slope.rates);
    let speed = v.norm();
    let across = v.x.hypot(v.z);
    let alpha_dot = (v.x * v_dot.z - v.z * v_dot.x) / across.powi(2);
    let beta_dot = (v_dot.y * speed - v.y * v.dot(&v_dot) / speed) / (speed * across);
    let (phi_dot, theta_dot) = state.euler_rates(&instant.slope);
    let rates = [
        pitch - SVector::from([alpha_dot, w_dot.y, theta_dot]),
        SVector::from([
            lateral[0] - beta_dot,
            lateral[1] - w_dot.x,
            lateral[2] - w_dot.z,
        ]),
        SVector::from([lateral[3] - phi_dot, 0.0, 0.0]),
    ];
    let read = sensors::read(aircraft, &state, &given, &instant);
    let signal = |name: &str| read.iter().find(|(n, _)| *n == name).unwrap().1;
    let pitch_read = [
        signal::ALPHA_VANE,
        signal::Q,
        signal::THETA,
        signal::AN,
        signal::AX,
    ]
    .map(signal);
    let lateral_read = [
        signal::BETA_VANE,
        signal::P,
        signal::R,
        signal::PHI,
        signal::AY,
    ]
    .map(signal);
    let outputs = [
        pitch_outputs - SVector::from(pitch_read),
        lateral_outputs - SVector::from(lateral_read),
    ]
    .map(|d| d.abs().sum());
    // Sums, so that what is no number does not pass.
    (
        rates.iter().map(|d| d.abs().sum()).sum(),
        outputs.iter().sum(),
    )
}

#[test]
fn the_simulator_s_equations_and_the_estimator_s_agree_to_twelve_digits() {
    // 2e-15 where this was written. No approximation is left between the two: sideslip, rotation
    // about all axes, engines' momentum, I_xz and the arms of the sensors are all in both.
    let simulation = simulation();
    let mut noise = Noise::new(5, "agreement");
    for _ in 0..500 {
        let (r, o) = disagreement(&simulation, &mut noise);
        assert!(r < 1e-12 && o < 1e-12, "rates {r:.1e}, outputs {o:.1e}");
    }
}

#[test]
fn every_surface_turns_the_aircraft_as_its_sign_says() {
    let simulation = simulation();
    let settings = simulation.simulator.settings();
    let trim = simulation
        .simulator
        .trim(&simulation.card("OLAT", 10.0).unwrap())
        .unwrap();
    let at =
        |state: &State, given: &Given| simulation.simulator.plant.instant(state, given, None).slope;
    let still = at(&trim.state, &trim.given);
    let moved = |name: &str| {
        let mut given = trim.given.clone();
        given.surfaces[settings.place(name).unwrap()] += 5.0;
        at(&trim.state, &given).rates - still.rates
    };
    assert!(
        moved("de_deg").y < 0.0,
        "stabilator trailing edge down pitches down"
    );
    assert!(moved("dpv_deg").y < 0.0, "plume down pitches down");
    assert!(moved("da_deg").x > 0.0, "ailerons roll right");
    assert!(
        moved("ddht_deg").x > 0.0,
        "the differential tail rolls right"
    );
    assert!(
        moved("dr_deg").z < 0.0,
        "rudder trailing edge left yaws left"
    );
    assert!(moved("dyv_deg").z > 0.0, "plume right yaws right");

    let wind_from_the_right = State {
        velocity: AirData::velocity(400.0, 10.0 / DEG, 0.1),
        ..trim.state
    };
    let turned = at(&wind_from_the_right, &trim.given);
    assert!(
        turned.rates.z > 0.0 && turned.rates.x < 0.0,
        "it weathercocks into the wind and rolls away from it"
    );
    let faster = at(
        &trim.state,
        &Given {
            thrust_lbf: trim.given.thrust_lbf + 1000.0,
            ..trim.given.clone()
        },
    );
    assert!(
        faster.velocity.x > still.velocity.x,
        "thrust pushes forward"
    );
    let nose_up = State {
        rates: Vector3::new(0.0, 0.1, 0.0),
        ..trim.state
    };
    assert!(
        at(&nose_up, &trim.given).rates.y < still.rates.y,
        "pitching is damped"
    );
}

#[test]
fn a_trimmed_aircraft_stays_where_it_is() {
    let simulation = simulation();
    // In a descent (3000 ft in these 22 s at 60°) the air grows a tenth denser, and the thrust with
    // it.
    for (alpha, drift_deg) in [(5.0, 0.02), (10.0, 0.02), (30.0, 0.3), (60.0, 1.0)] {
        let mut card = simulation.card("OLAT", alpha).unwrap();
        card.program.inputs.clear();
        let trim = simulation.simulator.trim(&card).unwrap();
        let slope = simulation
            .simulator
            .plant
            .instant(&trim.state, &trim.given, None)
            .slope;
        assert!(
            slope.velocity.norm() < 1e-8 && slope.rates.norm() < 1e-9,
            "{alpha}: {slope:?}"
        );
        let flown = simulation.simulator.fly(&card).unwrap();
        let theta = flown.record.values(signal::THETA).unwrap();
        let moved = theta
            .iter()
            .map(|t| (t - theta[0]).abs())
            .fold(0.0, f64::max);
        assert!(moved < drift_deg, "at {alpha}° it moves by {moved}°");
        // An accelerometer at rest feels gravity: an = cos θ cos φ nearly, in g of 32.174 ft/s².
        let an = flown.record.values(signal::AN).unwrap()[0];
        let phi = flown.record.values(signal::PHI).unwrap()[0];
        assert_abs_diff_eq!(
            an,
            (theta[0] / DEG).cos() * (phi / DEG).cos() * 0.9969,
            epsilon = 2e-3
        );
    }
}

#[test]
fn aft_stick_raises_the_nose_and_right_controls_turn_right() {
    let simulation = simulation();
    for (class, stick, rate) in [
        ("PPSS", "stick_pitch_in", signal::Q),
        ("PYRS", "stick_lat_in", signal::P),
        ("PYRS", "pedal_in", signal::R),
    ] {
        let mut card = simulation.card(class, 15.0).unwrap();
        card.program.inputs.retain(|i| i.signal == stick);
        card.program.inputs[0].start_s = 1.0;
        let record = simulation.simulator.fly(&card).unwrap().record;
        assert!(
            record.values(rate).unwrap()[record.sample_at(1.4)] > 0.5,
            "{stick}"
        );
    }
}

fn estimated(simulation: &SimulatedCampaign, flown: &Flown) -> Estimated {
    let config = &simulation.config;
    let basis = Basis::new(
        &config.aircraft,
        &config.buildup,
        &config.tunnel,
        &config.estimate,
    );
    estimate::maneuver(
        &flown.record,
        &flown.maneuver,
        config.class(&flown.maneuver.class).unwrap(),
        &basis,
    )
}

#[test]
fn without_noise_the_estimates_are_the_derivatives_that_were_flown() {
    // With surfaces that are linear between the recorder's samples, as the estimator takes them,
    // all come back to 0.1%. At 80 control steps a second their motion between samples leaves 0.1%
    // in the median and 1% at worst of these.
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards.yaml");
    let text = fs::read_to_string("pipelines/harv/cards.yaml").unwrap();
    assert!(text.contains("control_hz: 80"));
    fs::write(&cards, text.replace("control_hz: 80", "control_hz: 40")).unwrap();
    let simulation = SimulatedCampaign::load(&cards).unwrap();
    for (class, alpha, derivatives) in [
        (
            "SSIMD_LON",
            10.0,
            &[
                "CN_alpha", "CN_de", "Cm_alpha", "Cm_q", "Cm_de", "Cm_dsa", "Cm_dpv",
            ][..],
        ),
        (
            "3211",
            40.0,
            &["CN_q", "CN_de", "Cm_alpha", "Cm_q", "Cm_de"],
        ),
        (
            "SSIMD_LAT",
            30.0,
            &[
                "CY_beta", "Cl_beta", "Cl_p", "Cl_da", "Cl_ddht", "Cn_r", "Cn_dr", "Cn_dyv",
            ],
        ),
        (
            "OLAT",
            20.0,
            &["CY_beta", "Cl_beta", "Cl_p", "Cl_da", "Cn_beta", "Cn_dr"],
        ),
    ] {
        let flown = simulation
            .simulator
            .fly(&simulation.card(class, alpha).unwrap())
            .unwrap();
        let estimated = estimated(&simulation, &flown);
        assert_eq!(estimated.fit.outcome, Outcome::Converged);
        for name in derivatives {
            let truth = flown
                .truth
                .iter()
                .find(|t| t.derivative == *name)
                .unwrap()
                .value;
            let row = estimated
                .estimates
                .iter()
                .find(|e| e.derivative == *name)
                .unwrap();
            let off = row.value.unwrap() / truth - 1.0;
            assert!(
                off.abs() < 1e-3,
                "{class} at {alpha}°: {name} is off by {:.3}%",
                100.0 * off
            );
        }
    }
}

#[test]
fn instruments_change_a_record_and_not_the_flight() {
    let simulation = simulation();
    let mut card = simulation.card("3211", 20.0).unwrap();
    card.program = Program {
        duration_s: 6.0,
        maneuver_s: (0.0, 5.0),
        ..card.program
    };
    let flown = simulation.simulator.fly(&card).unwrap();
    let instruments = Instruments(
        [(
            signal::Q.to_owned(),
            Instrument {
                bias: 0.5,
                ..Instrument::default()
            },
        )]
        .into(),
    );
    let record = flown.recorded(&instruments, 1);
    let (exact, read) = (
        flown.record.values(signal::Q).unwrap(),
        record.values(signal::Q).unwrap(),
    );
    assert!(
        exact
            .iter()
            .zip(read)
            .all(|(x, y)| (y - x - 0.5).abs() < 1e-12)
    );
    assert_eq!(record.values(signal::P), flown.record.values(signal::P));
    assert_eq!(flown, simulation.simulator.fly(&card).unwrap());
}
