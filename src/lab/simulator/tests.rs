//! The simulator against the estimator: two independent implementations of the same physics must
//! agree.

use std::fs;
use std::path::Path;

use approx::{assert_abs_diff_eq, assert_relative_eq};
use nalgebra::{SVector, Vector3};

use super::gust::Gust;
use super::plant::{PlantInputs, PlantOutputs};
use super::trim::{self, Trim, TrimPoint};
use super::{
    Card, FlownManeuver, Instrument, Instruments, Program, Simulator, Turbulence, TurbulenceModel,
    sensors,
};
use crate::aero::wind_tunnel::TunnelPoint;
use crate::aero::{Coefficient, Derivative, Regressor};
use crate::aircraft::ThrustLine;
use crate::dynamics::{Equations, Lateral, Longitudinal, Motion};
use crate::earth::gravity_ft_s2;
use crate::estimate::{self, Context, Estimated, Method};
use crate::flight::{Record, signal};
use crate::lab::campaign::SimulatedCampaign;
use crate::maneuver::{Maneuver, Status};
use crate::numerics::statistics::random::RandomStream;
use crate::rigid_body::{AirData, BodyState, Euler};
use crate::surfaces::{self, AircraftModel};
use crate::tables::Outcome;
use crate::units::DEG;

pub(crate) fn shipped_campaign() -> SimulatedCampaign {
    SimulatedCampaign::load(Path::new("pipelines/harv/cards.yaml")).unwrap()
}

fn trimmed(simulator: &Simulator, card: &Card) -> Trim {
    trim::trim(&simulator.plant, &simulator.settings, TrimPoint::of(card)).unwrap()
}

/// Random state and inputs, with rotation and sideslip.
fn random_instant(random: &mut RandomStream, surfaces: usize) -> (BodyState, PlantInputs) {
    let mut within = |low: f64, high: f64| low + (high - low) * random.uniform();
    let speed = within(220.0, 600.0);
    let (alpha, beta) = (within(0.05, 1.05), within(-0.2, 0.2));
    let attitude = Euler {
        phi: within(-1.0, 1.0),
        theta: within(-0.8, 0.9),
        psi: within(-3.0, 3.0),
    }
    .attitude();
    let state = BodyState {
        velocity: AirData::velocity(speed, alpha, beta),
        rates: Vector3::new(within(-0.9, 0.9), within(-0.5, 0.5), within(-0.5, 0.5)),
        attitude,
        position: Vector3::new(0.0, 0.0, within(18_000.0, 30_000.0)),
    };
    let inputs = PlantInputs {
        surfaces: (0..surfaces).map(|_| within(-10.0, 10.0)).collect(),
        thrust_lbf: within(2000.0, 14_000.0),
        rpm: within(20_000.0, 26_000.0),
        gust: Gust::default(),
        mass_slug: within(985.0, 1065.0),
    };
    (state, inputs)
}

/// Motion of the estimator from error-free measurements of an instant.
fn measured_motion(
    campaign: &SimulatedCampaign,
    state: &BodyState,
    inputs: &PlantInputs,
    outputs: &PlantOutputs,
) -> Motion {
    let (aircraft, loading, angles) = (&campaign.config.aircraft, &outputs.loading, state.euler());
    Motion {
        alpha: outputs.air.alpha,
        beta: outputs.air.beta,
        velocity: outputs.air.velocity_ft_s,
        rates: state.rates.into(),
        accelerations: outputs.rate.rates.into(),
        theta: angles.theta,
        phi: angles.phi,
        force_x: outputs.specific_force.x,
        force_y: outputs.specific_force.y,
        force_z: outputs.specific_force.z,
        gravity: gravity_ft_s2(aircraft.latitude_deg, state.position.z),
        qbar: outputs.air.qbar_psf,
        mass: loading.mass_slug,
        thrust: aircraft.thrust(inputs.thrust_lbf, loading.cg()),
        ix: loading.ix_slug_ft2,
        iy: loading.iy_slug_ft2,
        iz: loading.iz_slug_ft2,
        ixz: loading.ixz_slug_ft2,
        engine_momentum: aircraft.engine_inertia_slug_ft2 * inputs.rpm * 2.0 * std::f64::consts::PI
            / 60.0,
        cg: loading.cg(),
    }
}

/// The disagreement of states' rates (rad/s, rad/s²) and of outputs (deg, deg/s, g) at one random
/// instant.
fn disagreement(campaign: &SimulatedCampaign, random: &mut RandomStream) -> (f64, f64) {
    let (plant, aircraft) = (&campaign.simulator.plant, &campaign.config.aircraft);
    let surfaces = campaign.simulator.settings().surface_names.len();
    let (state, inputs) = random_instant(random, surfaces);
    let outputs = plant.evaluate(&state, &inputs, None);
    let values = plant
        .aerodynamics
        .values(outputs.air.alpha * DEG, outputs.air.mach);
    let alpha_rate = AirData::alpha_rate(&state.velocity, &outputs.rate.velocity);
    let (force, moment) = plant.aerodynamics.loads(
        aircraft,
        &values,
        &outputs.air,
        (&state.rates, alpha_rate),
        &inputs.surfaces,
    );
    let area = outputs.air.qbar_psf * aircraft.wing_area_ft2;
    let (chord, span) = (area * aircraft.chord_ft, area * aircraft.span_ft);
    let motion = measured_motion(campaign, &state, &inputs, &outputs);

    let known = Longitudinal::rate_inputs(aircraft, &motion);
    let x = Longitudinal::measured_state(&motion);
    let c = [-force.z / area, moment.y / chord, -force.x / area];
    let pitch = Longitudinal::rates(&known, &x, &c).rates;
    let pitch_outputs = Longitudinal::outputs(
        &known,
        &Longitudinal::sensor_inputs(aircraft, &motion),
        &x,
        &c,
    )
    .outputs;
    let known = Lateral::rate_inputs(aircraft, &motion);
    let x = Lateral::measured_state(&motion);
    let c = [force.y / area, moment.x / span, moment.z / span];
    let lateral = Lateral::rates(&known, &x, &c).rates;
    let lateral_outputs =
        Lateral::outputs(&known, &Lateral::sensor_inputs(aircraft, &motion), &x, &c).outputs;

    let (v, v_dot, w_dot) = (state.velocity, outputs.rate.velocity, outputs.rate.rates);
    let speed = v.norm();
    let across = v.x.hypot(v.z);
    let alpha_dot = (v.x * v_dot.z - v.z * v_dot.x) / across.powi(2);
    let implied = Longitudinal::alpha_rate(aircraft, &motion);
    let beta_dot = (v_dot.y * speed - v.y * v.dot(&v_dot) / speed) / (speed * across);
    let (phi_dot, theta_dot) = state.euler_rates(&outputs.rate);
    let rates = [
        pitch - SVector::from([alpha_dot, w_dot.y, theta_dot]),
        SVector::from([
            lateral[0] - beta_dot,
            lateral[1] - w_dot.x,
            lateral[2] - w_dot.z,
        ]),
        SVector::from([lateral[3] - phi_dot, implied - alpha_dot, 0.0]),
    ];
    let readings = sensors::readings(aircraft, &state, &inputs, &outputs);
    let signal = |name: &str| readings.iter().find(|(n, _)| *n == name).unwrap().1;
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
fn the_equations_of_simulator_and_estimator_agree_to_twelve_digits() {
    // Typically 2e-15: both include sideslip, rotation about all axes, the engines' angular momentum, the
    // thrust's line, I_xz and the sensors' arms without approximation.
    let mut random = RandomStream::new(5, "agreement");
    let inclined = ThrustLine {
        x_ft: 55.0,
        z_ft: 4.0,
        inclination_deg: 6.0,
    };
    for (line, mut campaign) in [
        (None, shipped_campaign()),
        (Some(inclined), shipped_campaign()),
        (Some(inclined), with_lag(shipped_campaign())),
    ] {
        campaign.config.aircraft.thrust_line = line;
        campaign.simulator.plant.aircraft.thrust_line = line;
        for _ in 0..500 {
            let (r, o) = disagreement(&campaign, &mut random);
            assert!(r < 1e-12 && o < 1e-12, "rates {r:.1e}, outputs {o:.1e}");
        }
    }
}

#[test]
fn the_true_slopes_over_alpha_are_the_derivatives_of_the_coefficients() {
    let campaign = shipped_campaign();
    let aerodynamics = &campaign.simulator.plant.aerodynamics;
    let sums = &campaign.config.aero_model.combined;
    assert!(!sums.is_empty());
    let value = |name: &str, alpha_deg: f64| {
        let mut derivatives = aerodynamics.derivatives().iter();
        let place = derivatives.position(|d| d.name == name).unwrap();
        aerodynamics.values(alpha_deg, 0.4)[place]
    };
    for sum in sums {
        let total = |alpha: f64| value(&sum.constant, alpha) + value(&sum.slope, alpha) * alpha;
        // At a point of the table, between two, and beyond both ends.
        for alpha_deg in [20.0, 21.7, 33.1, 3.0, 63.0] {
            let difference = (total(alpha_deg + 1e-4) - total(alpha_deg - 1e-4)) / 2e-4;
            assert_relative_eq!(difference, value(&sum.slope, alpha_deg), epsilon = 1e-6);
        }
    }
}

#[test]
fn every_surface_turns_the_aircraft_in_the_direction_of_its_sign() {
    let campaign = shipped_campaign();
    let settings = campaign.simulator.settings();
    let trim = trimmed(&campaign.simulator, &campaign.card("OLAT", 10.0).unwrap());
    let rate = |state: &BodyState, inputs: &PlantInputs| {
        campaign.simulator.plant.evaluate(state, inputs, None).rate
    };
    let unperturbed = rate(&trim.state, &trim.inputs);
    let moved = |name: &str| {
        let mut inputs = trim.inputs.clone();
        inputs.surfaces[settings.surface_index(name).unwrap()] += 5.0;
        rate(&trim.state, &inputs).rates - unperturbed.rates
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

    let wind_from_the_right = BodyState {
        velocity: AirData::velocity(400.0, 10.0 / DEG, 0.1),
        ..trim.state
    };
    let turned = rate(&wind_from_the_right, &trim.inputs);
    assert!(
        turned.rates.z > 0.0 && turned.rates.x < 0.0,
        "it weathercocks into the wind and rolls away from it"
    );
    let faster = rate(
        &trim.state,
        &PlantInputs {
            thrust_lbf: trim.inputs.thrust_lbf + 1000.0,
            ..trim.inputs.clone()
        },
    );
    assert!(
        faster.velocity.x > unperturbed.velocity.x,
        "thrust pushes forward"
    );
    let nose_up = BodyState {
        rates: Vector3::new(0.0, 0.1, 0.0),
        ..trim.state
    };
    assert!(
        rate(&nose_up, &trim.inputs).rates.y < unperturbed.rates.y,
        "pitching is damped"
    );
}

#[test]
fn a_trimmed_aircraft_stays_trimmed() {
    let campaign = shipped_campaign();
    // At 60° the aircraft descends 3000 ft in 22 s: density and thrust grow by a tenth.
    for (alpha, drift_deg) in [(5.0, 0.02), (10.0, 0.02), (30.0, 0.3), (60.0, 1.0)] {
        let mut card = campaign.card("OLAT", alpha).unwrap();
        card.program.inputs.clear();
        let trim = trimmed(&campaign.simulator, &card);
        let rate = campaign
            .simulator
            .plant
            .evaluate(&trim.state, &trim.inputs, None)
            .rate;
        assert!(
            rate.velocity.norm() < 1e-8 && rate.rates.norm() < 1e-9,
            "{alpha}: {rate:?}"
        );
        let flown = campaign.simulator.fly(&card).unwrap();
        let theta = flown.record.values(signal::THETA).unwrap();
        let moved = theta
            .iter()
            .map(|t| (t - theta[0]).abs())
            .fold(0.0, f64::max);
        assert!(moved < drift_deg, "at {alpha}° it moves by {moved}°");
        // In trim the accelerometer reads gravity: an ≈ cos θ cos φ, in g of 32.174 ft/s².
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
    let campaign = shipped_campaign();
    for (class, stick, rate) in [
        ("PPSS", "stick_pitch_in", signal::Q),
        ("PYRS", "stick_lat_in", signal::P),
        ("PYRS", "pedal_in", signal::R),
    ] {
        let mut card = campaign.card(class, 15.0).unwrap();
        card.program.inputs.retain(|i| i.signal == stick);
        card.program.inputs[0].start_s = 1.0;
        let record = campaign.simulator.fly(&card).unwrap().record;
        assert!(
            record.values(rate).unwrap()[record.sample_at(1.4)] > 0.5,
            "{stick}"
        );
    }
}

/// Reading of a signal.
fn reading(
    campaign: &SimulatedCampaign,
    state: &BodyState,
    inputs: &PlantInputs,
    name: &str,
) -> f64 {
    let outputs = campaign.simulator.plant.evaluate(state, inputs, None);
    let aircraft = &campaign.config.aircraft;
    let readings = sensors::readings(aircraft, state, inputs, &outputs);
    readings.iter().find(|(n, _)| *n == name).unwrap().1
}

#[test]
fn air_that_turns_with_the_aircraft_damps_nothing_and_gyros_do_not_feel_it() {
    let campaign = shipped_campaign();
    let trim = trimmed(&campaign.simulator, &campaign.card("OLAT", 20.0).unwrap());
    let rates = Vector3::new(0.3, 0.1, -0.2);
    let turning = BodyState {
        rates,
        ..trim.state
    };
    let mut inputs = trim.inputs.clone();
    inputs.gust.rates = rates;
    let plant = &campaign.simulator.plant;
    let still = plant.evaluate(&trim.state, &trim.inputs, None);
    let carried = plant.evaluate(&turning, &inputs, None);
    let damped = plant.evaluate(&turning, &trim.inputs, None);
    assert_abs_diff_eq!(
        carried.specific_force,
        still.specific_force,
        epsilon = 1e-12
    );
    assert!((damped.specific_force - still.specific_force).norm() > 1e-3);
    // Only roll damping distinguishes the two in ṗ: gyroscopic terms are in both.
    let relative = carried.rate.rates - damped.rate.rates;
    assert!(relative.x > 0.0 && relative.y > 0.0, "{relative}");
    for (name, rate) in [
        (signal::P, rates.x),
        (signal::Q, rates.y),
        (signal::R, rates.z),
    ] {
        assert_abs_diff_eq!(
            reading(&campaign, &turning, &inputs, name),
            DEG * rate,
            epsilon = 1e-12
        );
    }
    // The vanes stand ahead of the c.g.; turning with the air they read the flow of the c.g.
    for name in [signal::ALPHA_VANE, signal::BETA_VANE] {
        let expected = reading(&campaign, &trim.state, &trim.inputs, name);
        assert_abs_diff_eq!(
            reading(&campaign, &turning, &inputs, name),
            expected,
            epsilon = 1e-12
        );
        let alone = reading(&campaign, &turning, &trim.inputs, name);
        assert!((alone - expected).abs() > 0.1);
    }
}

#[test]
fn an_updraught_raises_the_vane_s_angle_and_the_normal_acceleration_before_the_aircraft_moves() {
    let campaign = shipped_campaign();
    let trim = trimmed(&campaign.simulator, &campaign.card("OLON", 10.0).unwrap());
    let mut inputs = trim.inputs.clone();
    inputs.gust.velocity.z = -10.0;
    let change = |name: &str| {
        reading(&campaign, &trim.state, &inputs, name)
            - reading(&campaign, &trim.state, &trim.inputs, name)
    };
    let expected = DEG * 10.0 / trim.air.velocity_ft_s * trim.air.alpha.cos();
    assert_abs_diff_eq!(
        change(signal::ALPHA_VANE),
        expected,
        epsilon = 0.02 * expected
    );
    assert!(change(signal::AN) > 0.02);
    for name in [signal::Q, signal::THETA, signal::ALTITUDE] {
        assert_abs_diff_eq!(change(name), 0.0);
    }
    // A gust to the left, as a wind from the right, is sideslip to the right.
    inputs.gust.velocity = Vector3::new(0.0, -10.0, 0.0);
    assert!(reading(&campaign, &trim.state, &inputs, signal::BETA_VANE) > 1.0);
}

#[test]
fn late_surfaces_are_those_of_one_delay_before_and_nothing_else_changes() {
    let campaign = shipped_campaign();
    let mut card = campaign.card("3211", 20.0).unwrap();
    card.program.duration_s = 6.0;
    card.program.maneuver_s = (0.0, 5.0);
    let exact = campaign.simulator.fly(&card).unwrap().record;
    let surfaces = &campaign.simulator.settings().surface_names;
    let late = Instruments::default()
        .late(surfaces, exact.step_s)
        .record(&exact, 1);
    for (name, series) in &late.signals {
        let expected = exact.values(name).unwrap();
        if surfaces.contains(name) {
            let mut pairs = series.values[2..].iter().zip(&expected[1..]);
            assert!(pairs.all(|(late, exact)| (late - exact).abs() < 1e-9));
        } else {
            assert_eq!(series.values, expected, "{name}");
        }
    }
}

#[test]
fn turbulence_of_one_seed_is_flown_again_and_of_another_is_not() {
    let campaign = shipped_campaign();
    let mut card = campaign.card("PPSS", 20.0).unwrap();
    card.program.duration_s = 4.0;
    card.program.maneuver_s = (0.0, 4.0);
    card.program.inputs.clear();
    card.condition.turbulence = Some(Turbulence {
        model: TurbulenceModel::VonKarman,
        sigma_ft_s: 3.0,
        length_ft: None,
    });
    let fly = |seed: u64| {
        let card = Card {
            seed,
            ..card.clone()
        };
        campaign.simulator.fly(&card).unwrap().record
    };
    let first = fly(1);
    assert_eq!(first, fly(1));
    assert_ne!(first, fly(2));
    // 3 ft/s at some 330 ft/s move the vane by half a degree rms: by one to four of them at most.
    let alpha = first.values(signal::ALPHA_VANE).unwrap();
    let spread = alpha
        .iter()
        .fold(0.0_f64, |most, a| most.max((a - alpha[0]).abs()));
    assert!((0.5..2.0).contains(&spread), "{spread}");
}

fn estimated(campaign: &SimulatedCampaign, flown: &FlownManeuver) -> Estimated {
    let config = &campaign.config;
    // The simulated air is still, and the records are without noise.
    let settings = estimate::Settings {
        method: Method::OutputError,
        ..config.estimate.clone()
    };
    let context = Context::new(
        &config.aircraft,
        &config.aero_model,
        &config.tunnel,
        &settings,
    );
    estimate::maneuver(
        &flown.record,
        &flown.maneuver,
        config.class(&flown.maneuver.class).unwrap(),
        &context,
    )
}

/// A campaign recorded so densely that what surfaces do between samples hardly counts.
fn with_dense_samples() -> SimulatedCampaign {
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards.yaml");
    let mut text = fs::read_to_string("pipelines/harv/cards.yaml").unwrap();
    for (shipped, dense) in [
        ("rate_hz: 40", "rate_hz: 160"),
        ("control_hz: 80", "control_hz: 160"),
    ] {
        assert!(text.contains(shipped));
        text = text.replace(shipped, dense);
    }
    fs::write(&cards, text).unwrap();
    SimulatedCampaign::load(&cards).unwrap()
}

#[test]
fn without_noise_the_estimates_are_the_derivatives_that_were_flown() {
    let campaign = with_dense_samples();
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
        let flown = campaign
            .simulator
            .fly(&campaign.card(class, alpha).unwrap())
            .unwrap();
        let estimated = estimated(&campaign, &flown);
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
                off.abs() < 5e-4,
                "{class} at {alpha}°: {name} is off by {:.3}%",
                100.0 * off
            );
            let off = row.equation_error.unwrap() / truth - 1.0;
            assert!(
                off.abs() < 5e-2,
                "{class} at {alpha}°: {name} by equation error is off by {:.3}%",
                100.0 * off
            );
        }
    }
}

/// Derivatives along α̇ of a campaign with lag.
const LAG: [(&str, Coefficient, f64); 2] = [
    ("CN_alpha_dot", Coefficient::CN, 4.0),
    ("Cm_alpha_dot", Coefficient::Cm, -6.0),
];

/// A campaign whose aircraft has derivatives along α̇, held in every class.
pub(crate) fn with_lag(mut campaign: SimulatedCampaign) -> SimulatedCampaign {
    let config = &mut campaign.config;
    for (name, coefficient, value) in LAG {
        config.aero_model.derivatives.push(Derivative {
            name: name.into(),
            coefficient,
            regressor: Regressor::AlphaRate,
        });
        for alpha_deg in [0.0, 70.0] {
            let point = TunnelPoint::new(alpha_deg, value);
            config.tunnel.insert(name, point);
        }
        for class in &mut config.classes {
            class.statuses.insert(name.into(), Status::Held);
        }
    }
    let settings = campaign.simulator.settings().clone();
    let truth = config.tunnel.clamped();
    campaign.simulator =
        Simulator::new(&config.aircraft, &config.aero_model, truth, settings).unwrap();
    campaign
}

#[test]
fn a_held_lag_is_no_part_of_the_damping_in_pitch() {
    let mut campaign = with_lag(with_dense_samples());
    let card = campaign.card("SSIMD_LON", 20.0).unwrap();
    let flown = campaign.simulator.fly(&card).unwrap();
    let damping = |campaign: &SimulatedCampaign| {
        let estimated = estimated(campaign, &flown);
        assert_eq!(estimated.fit.outcome, Outcome::Converged);
        let mut rows = estimated.estimates.iter();
        rows.find(|e| e.derivative == "Cm_q")
            .unwrap()
            .value
            .unwrap()
    };
    let value = |name: &str| {
        let mut truths = flown.truth.iter();
        truths.find(|t| t.derivative == name).unwrap().value
    };
    assert_relative_eq!(damping(&campaign), value("Cm_q"), max_relative = 0.01);
    // Without the lag in its model, the damping has most of it.
    campaign
        .config
        .aero_model
        .derivatives
        .retain(|d| d.regressor != Regressor::AlphaRate);
    let both = value("Cm_q") + value("Cm_alpha_dot");
    assert_relative_eq!(damping(&campaign), both, max_relative = 0.15);
}

#[test]
fn instruments_change_a_record_and_not_the_flight() {
    let campaign = shipped_campaign();
    let mut card = campaign.card("3211", 20.0).unwrap();
    card.program = Program {
        duration_s: 6.0,
        maneuver_s: (0.0, 5.0),
        ..card.program
    };
    let flown = campaign.simulator.fly(&card).unwrap();
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
    assert_eq!(flown, campaign.simulator.fly(&card).unwrap());
}

/// Instruments of the shipped campaign on a recorder that stores these surfaces late.
fn late(campaign: &SimulatedCampaign, delays_s: &[(&str, f64)]) -> Instruments {
    let mut instruments = campaign.cards.instruments.clone();
    for (surface, delay_s) in delays_s {
        let instrument = instruments.0.get_mut(*surface).unwrap();
        instrument.delay_s = *delay_s;
    }
    // Spikes and dropouts are ingest's to repair.
    for instrument in instruments.0.values_mut() {
        (instrument.spikes_per_s, instrument.dropouts_per_s) = (0.0, 0.0);
    }
    instruments
}

#[test]
fn delays_of_a_recorder_s_buses_are_found_within_their_bounds() {
    let campaign = shipped_campaign();
    let config = &campaign.config;
    let basis = AircraftModel {
        aircraft: &config.aircraft,
        aero_model: &config.aero_model,
        tunnel: &config.tunnel,
    };
    let fly = |(class, alpha_deg)| {
        let card = campaign.card(class, alpha_deg).unwrap();
        campaign.simulator.fly(&card).unwrap()
    };
    let cards = [
        ("3211", 20.0),
        ("SSIMD_LON", 30.0),
        ("PPSS", 15.0),
        ("OLAT", 20.0),
        ("SSIMD_LAT", 30.0),
        ("PYRS", 15.0),
    ];
    let flown: Vec<FlownManeuver> = cards.into_iter().map(fly).collect();
    let truth = [("de_deg", 0.006), ("da_deg", 0.006), ("dr_deg", 0.012)];
    let instruments = late(&campaign, &truth);
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..12 {
        let recorded = |f| FlownManeuver::recorded(f, &instruments, seed);
        let records: Vec<(Record, &Maneuver)> =
            flown.iter().map(|f| (recorded(f), &f.maneuver)).collect();
        let evidence = surfaces::flight_evidence("f", &records, basis);
        let delays = surfaces::of_campaign(&[evidence]);
        for (surface, delay_s) in truth {
            let found = delays.iter().find(|d| d.surface == surface).unwrap();
            let off_s = found.delay_s - delay_s;
            assert!(off_s.abs() < 3e-3 && found.bound_s < 3e-3, "{found:?}");
            squares += (off_s / found.bound_s).powi(2);
            count += 1.0;
        }
    }
    // The mean square of so many standard normals lies between 0.6 and 1.5; the bounds contain
    // an error of the equations besides, which is the same each time.
    let mean_square: f64 = squares / count;
    assert!((0.1..1.6).contains(&mean_square), "{mean_square}");
}
