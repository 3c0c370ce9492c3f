//! The equations against closed forms and finite differences, and the fit against flights whose
//! errors are known.

use std::ops::Range;

use approx::{assert_abs_diff_eq, assert_relative_eq};
use nalgebra::{Matrix3, Vector3};

use super::equations::{
    self, Inputs, MeasuredTerms, STATES, State, rate_slopes, rates, reading_slopes, readings,
};
use super::joint_state::JointState;
use super::measured_terms::rotation_terms;
use super::parameters::{
    INPUTS, INSTRUMENTS, Kind, OUTPUTS, PARAMETERS, SIGNALS, input_factor, is_observable, output,
    place,
};
use super::reconstruction::{
    DRIVING, LOCAL, LocalParameters, ROW, reconstruct, sensitivities, shared_place,
};
use super::window::{Window, margin};
use super::window_choice::choose_windows;
use super::window_fit::{FitContext, WindowFit};
use super::window_sums::{Comparison, LinearisedWindow, place_among_all};
use super::*;
use crate::aircraft::{Position, Sensors, Vane, VaneModel};
use crate::flight::record::Series;
use crate::flight::{Mark, StandIn, signal as s};
use crate::numerics::statistics::random::RandomStream;
use crate::tables::InstrumentVerdict;
use crate::units::{DEG, G0_FT_S2};

const STEP_S: f64 = 0.025;
const CG: Position = Position {
    x_ft: 38.3,
    y_ft: 0.1,
    z_ft: 8.7,
};

fn aircraft() -> Aircraft {
    let at = |x_ft, y_ft, z_ft| Position { x_ft, y_ft, z_ft };
    Aircraft {
        name: "any".to_owned(),
        wing_area_ft2: 400.0,
        span_ft: 37.4,
        chord_ft: 11.5,
        engine_inertia_slug_ft2: 3.0,
        thrust_line: None,
        latitude_deg: 35.0,
        sensors: Sensors {
            an: at(31.3, -0.25, 6.9),
            ax: at(31.4, -0.1, 6.95),
            ay: at(31.45, 0.1, 6.85),
            alpha_vane: Vane {
                x_ft: 35.4,
                y_ft: 19.2,
                z_ft: 7.9,
                factor: 1.02,
            },
            beta_vane: Vane {
                x_ft: 35.4,
                y_ft: -19.2,
                z_ft: 7.9,
                factor: 0.98,
            },
            vane_model: VaneModel::Exact,
            thrust_in_ax: true,
        },
    }
}

fn measured_terms() -> MeasuredTerms {
    let sensors = aircraft().sensors;
    MeasuredTerms {
        gravity: 32.1,
        arms: [sensors.ax.arm(CG), sensors.ay.arm(CG), sensors.an.arm(CG)],
        cg: CG,
        earth: Vector3::new(4e-5, -2e-5, 5e-5),
        horizon: Vector3::new(6e-5, -4e-5, 3e-5),
        to_body: Matrix3::identity(),
        temperature_ratio: 1.08,
    }
}

const INPUT: Inputs = [0.4, -0.15, 0.2, 5.0, -2.0, -30.0];

fn state() -> State {
    State::from([420.0, 25.0, 160.0, 0.4, 0.3, 2.0, 24_000.0])
}

#[test]
fn slopes_of_the_rates_are_those_of_finite_differences() {
    let at = rate_slopes(&state(), &INPUT, &measured_terms());
    for j in 0..STATES {
        let h = 1e-5 * state()[j].abs().max(1.0);
        let (mut up, mut down) = (state(), state());
        up[j] += h;
        down[j] -= h;
        let numeric = (rates(&up, &INPUT, &measured_terms())
            - rates(&down, &INPUT, &measured_terms()))
            / (2.0 * h);
        (0..STATES)
            .for_each(|i| assert_abs_diff_eq!(at.by_state[(i, j)], numeric[i], epsilon = 1e-6));
    }
    for j in 0..INPUTS {
        let (mut up, mut down) = (INPUT, INPUT);
        up[j] += 1e-5;
        down[j] -= 1e-5;
        let numeric = (rates(&state(), &up, &measured_terms())
            - rates(&state(), &down, &measured_terms()))
            / 2e-5;
        (0..STATES)
            .for_each(|i| assert_abs_diff_eq!(at.by_input[(i, j)], numeric[i], epsilon = 1e-6));
    }
}

#[test]
fn slopes_of_the_readings_are_those_of_finite_differences() {
    let read = |x: &State, u: &Inputs| readings(&aircraft(), x, u, &measured_terms());
    let at = reading_slopes(&aircraft(), &state(), &INPUT, &measured_terms());
    for j in 0..STATES {
        let h = 1e-5 * state()[j].abs().max(1.0);
        let (mut up, mut down) = (state(), state());
        up[j] += h;
        down[j] -= h;
        let (up, down) = (read(&up, &INPUT), read(&down, &INPUT));
        (0..OUTPUTS).for_each(|o| {
            assert_abs_diff_eq!(
                at.by_state[(o, j)],
                (up[o] - down[o]) / (2.0 * h),
                epsilon = 1e-5
            );
        });
    }
    for j in 0..3 {
        let (mut up, mut down) = (INPUT, INPUT);
        up[j] += 1e-6;
        down[j] -= 1e-6;
        let (up, down) = (read(&state(), &up), read(&state(), &down));
        (0..OUTPUTS).for_each(|o| {
            assert_abs_diff_eq!(
                at.by_rates[(o, j)],
                (up[o] - down[o]) / 2e-6,
                epsilon = 1e-5
            );
        });
    }
}

#[test]
fn the_patterns_name_every_slope_that_is_not_zero() {
    let (at, read) = (
        rate_slopes(&state(), &INPUT, &measured_terms()),
        reading_slopes(&aircraft(), &state(), &INPUT, &measured_terms()),
    );
    let nonzero = |row: &dyn Fn(usize) -> f64, count: usize| {
        (0..count).filter(|j| row(*j) != 0.0).collect::<Vec<_>>()
    };
    for i in 0..STATES {
        assert_eq!(
            nonzero(&|j| at.by_state[(i, j)], STATES),
            equations::RATES_BY_STATE[i],
            "state {i}"
        );
        assert_eq!(
            nonzero(&|j| at.by_input[(i, j)], INPUTS),
            equations::RATES_BY_INPUT[i],
            "state {i}"
        );
    }
    for o in 0..OUTPUTS {
        assert_eq!(
            nonzero(&|j| read.by_state[(o, j)], STATES),
            equations::READINGS_BY_STATE[o],
            "output {o}"
        );
        assert_eq!(
            nonzero(&|j| read.by_rates[(o, j)], 3),
            equations::READINGS_BY_RATES[o],
            "output {o}"
        );
    }
}

#[test]
fn a_level_turn_on_a_flat_earth_turns_at_g_tan_phi_over_v_and_nothing_else_changes() {
    let (phi, speed): (f64, f64) = (0.6, 500.0);
    let terms = MeasuredTerms {
        earth: Vector3::zeros(),
        horizon: Vector3::zeros(),
        arms: [[0.0; 3]; 3],
        ..measured_terms()
    };
    let turn = terms.gravity * phi.tan() / speed;
    let lift = terms.gravity / phi.cos();
    let input = [0.0, turn * phi.sin(), turn * phi.cos(), 0.0, 0.0, -lift];
    let at = rates(
        &State::from([speed, 0.0, 0.0, phi, 0.0, 0.0, 0.0]),
        &input,
        &terms,
    );
    for (i, expected) in [0.0, 0.0, 0.0, 0.0, 0.0, turn, 0.0].into_iter().enumerate() {
        assert_abs_diff_eq!(at[i], expected, epsilon = 1e-12);
    }
}

#[test]
fn an_aircraft_parked_on_the_turning_earth_stays_where_it_is() {
    let horizon = Vector3::new(6e-5, 0.0, -4e-5);
    let terms = MeasuredTerms {
        earth: horizon,
        horizon,
        ..measured_terms()
    };
    let at = rates(
        &State::zeros(),
        &[6e-5, 0.0, -4e-5, 0.0, 0.0, -terms.gravity],
        &terms,
    );
    // The c.g. goes around the sensors, by a hundred-thousandth of a foot per second.
    assert!(at.norm() < 1e-4, "{at}");
}

#[test]
fn an_accelerometer_off_the_cg_needs_no_differentiated_rate() {
    // Spinning up about the vertical with the c.g. at rest: the sensor at arm x goes right with r
    // x.
    let terms = MeasuredTerms {
        gravity: 0.0,
        earth: Vector3::zeros(),
        horizon: Vector3::zeros(),
        arms: [[0.0; 3], [7.0, 0.0, 0.0], [0.0; 3]],
        ..measured_terms()
    };
    let (r, r_dot) = (0.3, 0.2);
    let at = rates(
        &State::from([0.0, 7.0 * r, 0.0, 0.0, 0.0, 0.0, 0.0]),
        &[0.0, 0.0, r, 0.0, 7.0 * r_dot, 0.0],
        &terms,
    );
    assert_abs_diff_eq!(at[1], 7.0 * r_dot, epsilon = 1e-12);
    assert_abs_diff_eq!(at[6], 0.0, epsilon = 1e-12);
}

/// A flight in which everything moves, from the equations themselves with a step a tenth of the
/// recorder's: what perfect instruments record of rates and forces that are sums of sines.
fn flight(seconds: f64) -> Record {
    const PARTS: usize = 10;
    let samples = window_samples(seconds);
    let aircraft = aircraft();
    // φ, θ and the velocity are steered back to their initial values, so that the flight lasts
    // long.
    let mut x = State::from([450.0, 0.0, 90.0, 0.0, 0.2, 1.0, 24_000.0]);
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); INSTRUMENTS];
    let sensors = &aircraft.sensors;
    let arms = [sensors.ax.arm(CG), sensors.ay.arm(CG), sensors.an.arm(CG)];
    let at = |t: f64, x: &State| {
        let terms = terms_at(&aircraft, x, arms);
        let input = pilot_inputs(t, x, &terms);
        (terms, input)
    };
    for k in 0..samples * PARTS {
        let h = STEP_S / PARTS as f64;
        let t = k as f64 * h;
        if k % PARTS == 0 {
            let (terms, input) = at(t, &x);
            for i in 0..INPUTS {
                columns[i].push(input[i] / input_factor(i));
            }
            for (o, value) in readings(&aircraft, &x, &input, &terms)
                .into_iter()
                .enumerate()
            {
                columns[INPUTS + o].push(value);
            }
        }
        let slope = |t: f64, x: &State| {
            let (terms, input) = at(t, x);
            rates(x, &input, &terms)
        };
        let k1 = slope(t, &x);
        let k2 = slope(t + h / 2.0, &(x + k1 * (h / 2.0)));
        let k3 = slope(t + h / 2.0, &(x + k2 * (h / 2.0)));
        let k4 = slope(t + h, &(x + k3 * h));
        x += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
    }
    let constants = [(s::X_CG, CG.x_ft), (s::Y_CG, CG.y_ft), (s::Z_CG, CG.z_ft)];
    let series = |values: Vec<f64>| Series {
        marks: vec![Mark::Measured; values.len()],
        values,
    };
    let mut signals: BTreeMap<String, Series> = SIGNALS
        .iter()
        .zip(columns)
        .map(|(name, values)| ((*name).to_owned(), series(values)))
        .collect();
    signals.extend(constants.map(|(name, value)| (name.to_owned(), series(vec![value; samples]))));
    Record {
        flight_id: "sines".to_owned(),
        start_s: 0.0,
        step_s: STEP_S,
        samples,
        signals,
        remaining_errors: BTreeMap::new(),
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a positive number of samples"
)]
fn window_samples(seconds: f64) -> usize {
    (seconds / STEP_S) as usize
}

/// Terms of the equations at a state, from exact signals.
fn terms_at(aircraft: &Aircraft, x: &State, arms: [[f64; 3]; 3]) -> MeasuredTerms {
    let along = Vector3::new(x[0], x[1], x[2]);
    MeasuredTerms {
        gravity: crate::earth::gravity_ft_s2(aircraft.latitude_deg, x[6]),
        arms,
        cg: CG,
        ..rotation_terms(aircraft, [x[3], x[4], x[5]], along, true)
    }
}

/// Rates and forces that keep the aircraft flying while everything moves.
fn pilot_inputs(t: f64, x: &State, terms: &MeasuredTerms) -> Inputs {
    let sine = |period: f64, phase: f64| (2.0 * std::f64::consts::PI * t / period + phase).sin();
    let (phi, theta) = (x[3], x[4]);
    let p = 0.35 * sine(4.1, 0.0) + 0.1 * sine(2.3, 1.0) - 0.3 * (phi - 0.5 * sine(61.0, 0.0));
    let q = 0.08 * sine(5.3, 0.5) + 0.05 * sine(3.1, 0.0)
        - 0.3 * (theta - 0.25 - 0.1 * sine(47.0, 2.0));
    let r = 0.06 * sine(6.7, 0.3) + 0.03 * sine(2.9, 0.0);
    // Forces that make the velocity follow u 450, v 0, w 90 with swings, from the equations without
    // force.
    let free = rates(x, &[p, q, r, 0.0, 0.0, 0.0], terms);
    let wanted = [
        450.0 + 60.0 * sine(53.0, 0.0),
        12.0 * sine(7.3, 0.0),
        90.0 + 25.0 * sine(6.1, 1.0),
    ];
    let force =
        |i: usize| 0.5 * (wanted[i] - x[i]) - free[i] + 3.0 * sine(3.7 + i as f64, i as f64);
    [p, q, r, force(0), force(1), force(2)]
}

fn settings() -> Compatibility {
    Compatibility {
        windows: 4,
        window_s: 14.0,
        ..Compatibility::default()
    }
}

fn windows(record: &Record) -> Vec<Window> {
    let settings = settings();
    choose_windows(record, settings.windows, &settings)
        .into_iter()
        .map(|w| Window::of(record, w, &aircraft(), &settings))
        .collect()
}

/// A window with parameters at which nothing is zero.
fn disturbed_window() -> (Window, LocalParameters, [f64; PARAMETERS]) {
    let record = flight(12.0);
    let short = Compatibility {
        window_s: 6.0,
        ..settings()
    };
    let range = choose_windows(&record, short.windows, &short).remove(0);
    let window = Window::of(&record, range, &aircraft(), &short);
    let mut noise = RandomStream::new(3, "errors");
    let shared = std::array::from_fn(|_| 0.01 * noise.normal());
    let mut local = [0.0; LOCAL];
    local[..STATES].copy_from_slice(window.start.as_slice());
    local[STATES..].copy_from_slice(&[0.05, -0.1, 0.08]);
    (window, local, shared)
}

/// Parameters of an output's row after a change of one of them.
fn changed(
    (local, shared): (&LocalParameters, &[f64; PARAMETERS]),
    (column, output): (usize, usize),
    change: f64,
) -> (LocalParameters, [f64; PARAMETERS]) {
    let (mut local, mut shared) = (*local, *shared);
    if column < LOCAL {
        local[column] += change;
    } else {
        shared[shared_place(column, output)] += change;
    }
    (local, shared)
}

/// Largest error of a reading that the steps of the integration may cause, in standard deviations of
/// the instrument's noise.
const STEP_ERROR: f64 = 0.02;

#[test]
fn the_trajectory_is_that_of_steps_twenty_times_as_short() {
    let record = flight(24.0);
    let window = windows(&record).remove(0);
    let mut local = [0.0; LOCAL];
    local[..STATES].copy_from_slice(window.start.as_slice());
    let shared = [0.0; PARAMETERS];
    let trajectory = reconstruct(&window, &aircraft(), &local, &shared).unwrap();
    let samples = window.margin..window.samples - window.margin;
    let comparison = Comparison::of(&window, &trajectory, &shared, &samples);
    for o in 0..OUTPUTS {
        let allowed = STEP_ERROR * NOISE[INPUTS + o];
        let measured = window.outputs[o].iter().step_by(window.samples_per_point);
        for (point, (reading, exact)) in trajectory.readings[o].iter().zip(measured).enumerate() {
            let error = (reading - exact).abs();
            assert!(
                error < allowed,
                "output {o}, point {point}: {error} of {allowed}"
            );
        }
        for k in samples.clone() {
            let error = comparison.residuals[o][k].abs();
            assert!(
                error < 2.0 * allowed,
                "output {o}, sample {k}: {error} of {allowed}"
            );
        }
    }
}

/// Inertial acceleration of [`nodding_window`], ft/s².
const PULL: f64 = 40.0;

/// Pitch angle of [`nodding_window`] at a time, rad: 10° at 1 Hz.
fn nod(t: f64) -> f64 {
    0.175 * (2.0 * std::f64::consts::PI * t).sin()
}

/// Window without gravity in which a body nods while the same acceleration pulls in one direction.
fn nodding_window(samples: usize) -> Window {
    let margin = 15;
    let at = |f: &dyn Fn(f64) -> f64, k: usize| f((k as f64 - margin as f64) * STEP_S);
    let rate = |t: f64| 0.175 * 2.0 * std::f64::consts::PI * (2.0 * std::f64::consts::PI * t).cos();
    let column = |input: usize, f: &dyn Fn(f64) -> f64| {
        let values = (0..samples + 2 * margin).map(|k| at(f, k) / input_factor(input));
        values.collect::<Vec<f64>>()
    };
    let terms = MeasuredTerms {
        gravity: 0.0,
        earth: Vector3::zeros(),
        horizon: Vector3::zeros(),
        arms: [[0.0; 3]; 3],
        ..measured_terms()
    };
    Window {
        step_s: STEP_S,
        samples,
        samples_per_point: 2,
        margin,
        terms: vec![terms; samples.div_ceil(2)],
        inputs: [
            column(0, &|_| 0.0),
            column(1, &rate),
            column(2, &|_| 0.0),
            column(3, &|t| PULL * nod(t).cos()),
            column(4, &|_| 0.0),
            column(5, &|t| PULL * nod(t).sin()),
        ],
        is_recorded: [true; INPUTS],
        input_variances: [0.0; INPUTS],
        outputs: std::array::from_fn(|_| vec![f64::NAN; samples]),
        start: State::from([300.0, 0.0, 0.0, 0.0, 0.0, 0.0, 10_000.0]),
    }
}

#[test]
fn nodding_at_one_hertz_neither_turns_nor_accelerates() {
    // In the plane of symmetry u + i w = exp(i θ) (u0 + a t) for a specific force a exp(i θ): the body
    // nods about a velocity that grows at a steady rate.
    let window = nodding_window(800);
    let mut local = [0.0; LOCAL];
    local[..STATES].copy_from_slice(window.start.as_slice());
    let trajectory = reconstruct(&window, &aircraft(), &local, &[0.0; PARAMETERS]).unwrap();
    for point in 0..window.points() {
        let t = point as f64 * window.point_step_s();
        assert_relative_eq!(
            trajectory.readings[2][point],
            300.0 + PULL * t,
            max_relative = 1e-4
        );
        assert_abs_diff_eq!(trajectory.readings[3][point], DEG * nod(t), epsilon = 0.002);
    }
}

/// Largest difference of a sensitivity from a finite difference, as a share of its largest size in the
/// window, and at least of the instrument's noise: the linearised equations are integrated in steps of
/// four samples.
const SENSITIVITY_TOLERANCE: f64 = 0.01;

#[test]
fn sensitivities_of_the_readings_are_those_of_finite_differences() {
    let (window, local, shared) = disturbed_window();
    let aircraft = aircraft();
    assert_eq!(window.samples_per_node(), 4);
    let readings = |local: &LocalParameters, shared: &[f64; PARAMETERS]| {
        reconstruct(&window, &aircraft, local, shared)
            .unwrap()
            .readings
    };
    let trajectory = reconstruct(&window, &aircraft, &local, &shared).unwrap();
    let at = sensitivities(&window, &aircraft, &shared, &trajectory);
    for column in 0..DRIVING {
        let h = 1e-6 * local.get(column).map_or(1.0, |l| l.abs().max(1.0));
        let moved = |change| {
            let (local, shared) = changed((&local, &shared), (column, 0), change);
            readings(&local, &shared)
        };
        let (up, down) = (moved(h), moved(-h));
        for o in 0..OUTPUTS {
            let gain = 1.0 + shared[place(INPUTS + o, Kind::Scale)];
            let both = at.rows.iter().enumerate().map(|(node, rows)| {
                let numeric = gain * (up[o][2 * node] - down[o][2 * node]) / (2.0 * h);
                (rows[o][column], numeric)
            });
            let largest = both
                .clone()
                .map(|(_, n)| n.abs())
                .fold(NOISE[INPUTS + o], f64::max);
            for (node, (slope, numeric)) in both.enumerate() {
                assert!(
                    (slope - numeric).abs() < SENSITIVITY_TOLERANCE * largest,
                    "output {o}, column {column}, node {node}: {slope} not {numeric}"
                );
            }
        }
    }
}

#[test]
fn the_gradient_of_each_output_is_that_of_finite_differences_of_its_squares() {
    let (window, local, shared) = disturbed_window();
    let aircraft = aircraft();
    let samples = window.margin..window.samples - window.margin;
    let compared = |local: &LocalParameters, shared: &[f64; PARAMETERS]| {
        let trajectory = reconstruct(&window, &aircraft, local, shared).unwrap();
        Comparison::of(&window, &trajectory, shared, &samples)
    };
    let at = compared(&local, &shared);
    let trajectory = reconstruct(&window, &aircraft, &local, &shared).unwrap();
    let slopes = sensitivities(&window, &aircraft, &shared, &trajectory);
    let gradients = at.gradients(&slopes);
    let linearised = LinearisedWindow::of(slopes, &at);
    for o in 0..OUTPUTS {
        let alone = std::array::from_fn(|own| f64::from(u8::from(own == o)));
        let information = linearised.information(&alone);
        for (column, gradient) in gradients[o].iter().enumerate().take(ROW) {
            let h = 1e-5 * local.get(column).map_or(1.0, |l| l.abs().max(1.0));
            let squares = |change| {
                let (local, shared) = changed((&local, &shared), (column, o), change);
                compared(&local, &shared).squares[o]
            };
            let numeric = -(squares(h) - squares(-h)) / (4.0 * h);
            let least = samples.len() as f64 * NOISE[INPUTS + o].powi(2);
            let place = place_among_all(column, o);
            let information = information[(place, place)].max(least);
            let size = (information * at.squares[o]).sqrt();
            assert!(
                (gradient - numeric).abs() <= SENSITIVITY_TOLERANCE * size,
                "output {o}, column {column}: {gradient} not {numeric} of {size}"
            );
        }
    }
}

#[test]
fn perfect_instruments_of_a_perfect_flight_have_no_errors() {
    let errors = joint_fit::fit(&windows(&flight(65.0)), &aircraft(), &settings()).unwrap();
    for i in 0..INSTRUMENTS {
        assert_abs_diff_eq!(errors.values[place(i, Kind::Delay)], 0.0, epsilon = 5e-4);
        assert_abs_diff_eq!(errors.values[place(i, Kind::Scale)], 0.0, epsilon = 1e-3);
    }
    for i in 0..3 {
        assert_abs_diff_eq!(errors.values[place(i, Kind::Bias)], 0.0, epsilon = 2e-3);
    }
}

/// White noise of each instrument, in its unit.
const NOISE: [f64; INSTRUMENTS] = [
    0.1, 0.05, 0.05, 0.003, 0.005, 0.01, 0.1, 0.1, 0.6, 0.05, 0.05, 0.05, 4.0, 0.15, 0.0008,
];

/// Record of an exact flight by instruments with these errors (bias, scale, delay). A delay is a
/// whole number of samples.
fn recorded(exact: &Record, errors: &[f64; PARAMETERS], seed: u64) -> Record {
    let mut record = exact.clone();
    for (i, name) in SIGNALS.iter().enumerate() {
        let mut noise = RandomStream::new(seed, name);
        let values = &mut record.signals.get_mut(*name).unwrap().values;
        let before = values.clone();
        let [bias, scale, delay] =
            [Kind::Bias, Kind::Scale, Kind::Delay].map(|kind| errors[place(i, kind)]);
        for (k, value) in values.iter_mut().enumerate() {
            let late = k.saturating_sub(window_samples(delay + 1e-9));
            *value = (1.0 + scale) * before[late] + bias + NOISE[i] * noise.normal();
        }
    }
    record
}

fn channels() -> (BTreeMap<String, Channel>, Vec<String>) {
    let channel = |name: &str| Channel::plain(name, crate::units::Unit::of_signal(name).name);
    let channels = SIGNALS
        .iter()
        .map(|name| ((*name).to_owned(), channel(name)))
        .collect();
    (
        channels,
        SIGNALS.iter().map(|name| (*name).to_owned()).collect(),
    )
}

fn examined(record: &Record, settings: &Compatibility) -> Findings {
    let (channels, names) = channels();
    examine(
        (1, |_| Some(record.clone())),
        &channels,
        &names,
        &aircraft(),
        settings,
    )
}

/// The faults of a flight: signal and words.
fn faults(findings: &Findings) -> Vec<(&'static str, String)> {
    SIGNALS
        .into_iter()
        .filter_map(|name| Some((name, findings.verdict(name)?)))
        .collect()
}

/// Ordinary errors of every instrument, drawn.
fn ordinary(seed: u64) -> [f64; PARAMETERS] {
    let mut noise = RandomStream::new(seed, "ordinary errors");
    let errors = settings().ordinary;
    std::array::from_fn(|j| {
        let (i, kind) = (j / 3, parameters::ALL_KINDS[j % 3]);
        let drawn = noise.normal() * errors.of(i, kind);
        if kind == Kind::Delay || !is_observable(i, kind) {
            0.0
        } else {
            0.5 * drawn
        }
    })
}

#[test]
fn bounds_contain_the_truth_as_often_as_normal_ones() {
    let exact = flight(65.0);
    let (mut within, mut count, mut faulty, mut squares) = (0_u32, 0_u32, 0, 0.0);
    for seed in 0..6 {
        let truth = ordinary(seed);
        let findings = examined(&recorded(&exact, &truth, seed), &settings());
        faulty += faults(&findings).len();
        for (i, name) in SIGNALS.into_iter().enumerate() {
            let finding = findings.0.iter().find(|f| f.signal == name).unwrap();
            for (kind, estimate) in finding.estimates.iter().enumerate() {
                if let Some(e) = estimate {
                    count += 1;
                    let error = (e.value - truth[i * 3 + kind]) / e.bound;
                    within += u32::from(error.abs() < 1.96);
                    squares += error.powi(2);
                }
            }
        }
    }
    assert_eq!(faulty, 0);
    assert!(count > 150, "{count} estimates");
    let coverage = f64::from(within) / f64::from(count);
    let size = (squares / f64::from(count)).sqrt();
    assert!(coverage > 0.92, "{coverage}");
    // A bound may be too wide by half, and hardly too narrow.
    assert!((0.5..1.1).contains(&size), "errors of {size} bounds, rms");
}

#[test]
fn a_delay_of_a_channel_is_named_and_no_other() {
    let exact = flight(65.0);
    for name in [
        s::P,
        s::AN,
        s::ALPHA_VANE,
        s::THETA,
        s::VELOCITY,
        s::ALTITUDE,
    ] {
        let i = SIGNALS.iter().position(|n| *n == name).unwrap();
        let mut errors = ordinary(40 + i as u64);
        errors[place(i, Kind::Delay)] = 0.1;
        let record = recorded(&exact, &errors, 7);
        let findings = examined(&record, &settings());
        let found = faults(&findings);
        assert!(
            found.len() == 1 && found[0].0 == SIGNALS[i],
            "{}: {found:?}",
            SIGNALS[i]
        );
        let delay = findings.0[i].estimates[Kind::Delay as usize].unwrap();
        assert_abs_diff_eq!(delay.value, 0.1, epsilon = 0.01);
    }
}

#[test]
fn a_vane_at_another_place_is_named_and_not_the_instruments_that_it_contradicts() {
    let record = recorded(&flight(65.0), &ordinary(3), 7);
    let (channels, names) = channels();
    for (signal, blamed, ahead_ft) in [(s::ALPHA_VANE, s::Q, 30.0), (s::BETA_VANE, s::R, -25.0)] {
        let mut stated = aircraft();
        let vane = if signal == s::ALPHA_VANE {
            &mut stated.sensors.alpha_vane
        } else {
            &mut stated.sensors.beta_vane
        };
        vane.x_ft += ahead_ft;
        let windows: Vec<Window> = choose_windows(&record, 20, &settings())
            .into_iter()
            .map(|range| Window::of(&record, range, &stated, &settings()))
            .collect();
        let mut found = joint_fit::fit(&windows, &stated, &settings()).unwrap();
        let late = place(
            SIGNALS.iter().position(|s| *s == blamed).unwrap(),
            Kind::Delay,
        );
        (found.values[late], found.bounds[late]) = (0.1, 0.001);
        let explained = vane_positions::explained(&found, &windows, &stated, &settings());
        let (errors, positions) = explained.unwrap();
        assert!(
            positions.len() == 1 && positions[0].signal == signal,
            "{positions:?}"
        );
        assert_abs_diff_eq!(positions[0].ahead_ft, ahead_ft, epsilon = 5.0);
        let findings = Findings::of(Some(&errors), &channels, &names, &settings());
        let found = faults(&findings.with_positions(&positions));
        assert!(found.len() == 1 && found[0].0 == signal, "{found:?}");
    }
}

#[test]
fn a_late_instrument_is_explained_by_no_position_of_a_vane() {
    let mut errors = ordinary(4);
    errors[place(1, Kind::Delay)] = 0.1;
    let record = recorded(&flight(65.0), &errors, 7);
    assert_eq!(faults(&examined(&record, &settings()))[0].0, s::Q);
}

/// Record in gusts at the sideslip vane. The aircraft turns into them after a while, so half of them goes with
/// the rate of its own sideslip.
fn in_side_gusts(exact: &Record, seed: u64) -> Record {
    let own = exact.values(s::BETA_VANE).unwrap();
    let rate: Vec<f64> = (0..own.len())
        .map(|k| own[(k + 1).min(own.len() - 1)] - own[k.saturating_sub(1)])
        .collect();
    let mut noise = RandomStream::new(seed, "gusts");
    let decay = (-exact.step_s / GUST_TIME_S).exp();
    let mut gust = 0.0;
    let drawn: Vec<f64> = own
        .iter()
        .map(|_| {
            gust = decay * gust + (1.0 - decay * decay).sqrt() * noise.normal();
            gust
        })
        .collect();
    let rms = |v: &[f64]| (v.iter().map(|v| v * v).sum::<f64>() / v.len() as f64).sqrt();
    let (answered, free) = (0.5 / rms(&rate), 0.75_f64.sqrt() / rms(&drawn));
    let mut record = recorded(exact, &ordinary(seed), seed);
    let values = &mut record.signals.get_mut(s::BETA_VANE).unwrap().values;
    let size = 0.2 * rms(own);
    for (k, value) in values.iter_mut().enumerate() {
        *value += size * (free * drawn[k] - answered * rate[k]);
    }
    record
}

/// Time in which gusts lose their correlation, s.
const GUST_TIME_S: f64 = 1.5;

#[test]
fn a_vane_in_gusts_that_the_aircraft_turns_into_is_not_called_late() {
    let exact = flight(65.0);
    for seed in 0..3 {
        let findings = examined(&in_side_gusts(&exact, seed), &settings());
        assert_eq!(faults(&findings), [], "seed {seed}");
    }
}

#[test]
fn a_scale_error_beyond_the_ordinary_is_named_and_corrected() {
    let exact = flight(65.0);
    for (name, scale) in [(s::ALPHA_VANE, 0.2), (s::Q, -0.1)] {
        let i = SIGNALS.iter().position(|n| *n == name).unwrap();
        let mut errors = ordinary(60);
        errors[place(i, Kind::Scale)] = scale;
        let mut record = recorded(&exact, &errors, 9);
        let findings = examined(&record, &settings());
        let found: Vec<&str> = faults(&findings).into_iter().map(|f| f.0).collect();
        assert_eq!(found, [name]);
        findings
            .corrections(&settings())
            .iter()
            .for_each(|c| c.apply(&mut record));
        let (values, truth) = (record.values(name).unwrap(), exact.values(name).unwrap());
        let swing = truth.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let mean = values
            .iter()
            .zip(truth)
            .map(|(a, b)| (a - b).abs())
            .sum::<f64>()
            / values.len() as f64;
        assert!(
            mean < 0.02 * swing + 2.0 * NOISE[i],
            "{name}: {mean} of {swing}"
        );
    }
}

#[test]
fn the_scatter_of_a_bias_is_that_of_its_drift() {
    const DRIFT_DEG_S: f64 = 0.12;
    let exact = flight(185.0);
    let scatter_of_roll_rate = |drift: f64| {
        let mut record = recorded(&exact, &ordinary(61), 12);
        let middle = 0.5 * record.samples as f64;
        let series = record.signals.get_mut(s::P).unwrap();
        for (k, value) in series.values.iter_mut().enumerate() {
            *value += drift * (k as f64 / middle - 1.0);
        }
        let settings = Compatibility {
            windows: 12,
            ..settings()
        };
        let findings = examined(&record, &settings).0.into_iter();
        let mut estimates = findings
            .filter(|finding| finding.signal == s::P)
            .filter_map(|finding| finding.estimates[Kind::Bias as usize]);
        estimates.next().unwrap().scatter
    };
    let (steady, drifting) = (scatter_of_roll_rate(0.0), scatter_of_roll_rate(DRIFT_DEG_S));
    // A line from −a to a has the root mean square a/√3. The noise of the outputs is that of the
    // residuals, which contain a part of the drift, so the scatter is a little small.
    let expected = DRIFT_DEG_S / 3.0_f64.sqrt();
    assert!(steady < 0.15 * expected, "{steady}");
    assert!(
        (0.5 * expected..=1.2 * expected).contains(&drifting),
        "{drifting}, {expected} expected"
    );
}

#[test]
fn an_error_as_large_as_a_fault_but_not_as_sure_is_not_corrected() {
    let exact = flight(65.0);
    let (vane, j) = (INPUTS, place(INPUTS, Kind::Scale));
    let mut errors = ordinary(60);
    errors[j] = 0.2;
    let record = recorded(&exact, &errors, 9);
    let sure_of_nothing = Compatibility {
        fault_standard_errors: 1e6,
        ..settings()
    };
    let fitted = joint_fit::fit(&windows(&record), &aircraft(), &sure_of_nothing).unwrap();
    assert_abs_diff_eq!(
        fitted.prior[j],
        sure_of_nothing.ordinary.of(vane, Kind::Scale)
    );
    assert!(
        joint_fit::fit(&windows(&record), &aircraft(), &settings())
            .unwrap()
            .prior[j]
            > 0.1
    );

    let findings = examined(&record, &sure_of_nothing);
    let scale = findings.0[vane].estimates[Kind::Scale as usize].unwrap();
    assert!(
        scale.value > 0.1 && scale.doubtful && !scale.fault && !scale.applied,
        "{scale:?}"
    );
}

#[test]
fn a_flight_too_short_for_windows_has_no_estimates() {
    // A quarter of a window and both margins are 4.3 s.
    let findings = examined(&flight(4.0), &settings());
    assert!(findings.0.iter().all(|f| f.estimates == [None; 3]));
    assert!(
        findings
            .rows("f")
            .iter()
            .all(|r| r.verdict == InstrumentVerdict::NotExamined && r.applied.is_empty())
    );
}

/// Puts a stand-in in the place of a recorded signal; a constant for α, and nothing for ψ.
fn assume(record: &mut Record, lacking: &str) {
    record.signals.remove(lacking);
    if lacking == s::ALPHA_VANE {
        let constant = Series::assumed(vec![11.3; record.samples]);
        record.signals.insert(lacking.to_owned(), constant);
    } else if let Some(stand_in) = StandIn::of(lacking, |other| other != lacking) {
        stand_in.fill(lacking, record);
    }
}

/// Share of the estimates within 1.96 bounds of the truth, over flights with other ordinary errors,
/// and the number of estimates a flight.
fn coverage(exact: &Record, seeds: u64, lacking: &[&str]) -> (f64, f64) {
    let (mut within, mut count) = (0_u32, 0_u32);
    for seed in 0..seeds {
        let truth = ordinary(seed);
        let mut record = recorded(exact, &truth, seed);
        for name in lacking {
            assume(&mut record, name);
        }
        let findings = examined(&record, &settings());
        assert_eq!(faults(&findings), [], "seed {seed} without {lacking:?}");
        for finding in findings.0 {
            let i = SIGNALS.iter().position(|s| *s == finding.signal).unwrap();
            for (kind, e) in finding.estimates.iter().enumerate() {
                let Some(e) = e else { continue };
                count += 1;
                within += u32::from((e.value - truth[i * 3 + kind]).abs() < 1.96 * e.bound);
            }
        }
    }
    (
        f64::from(within) / f64::from(count),
        f64::from(count) / seeds as f64,
    )
}

#[test]
fn without_one_redundant_channel_the_others_are_found_with_bounds_that_hold() {
    let exact = flight(65.0);
    let (_, with_all) = coverage(&exact, 2, &[]);
    for lacking in [
        s::PSI,
        s::ALTITUDE,
        s::QBAR,
        s::MACH,
        s::THETA,
        s::PHI,
        s::BETA_VANE,
        s::ALPHA_VANE,
        s::VELOCITY,
    ] {
        let (within, count) = coverage(&exact, 2, &[lacking]);
        assert!(
            within > 0.9,
            "without {lacking}: {within:.3} of {count} hold"
        );
        // Those of the channel itself, and few more, are not found.
        assert!(
            count > with_all - 9.0,
            "without {lacking}: {count} of {with_all}"
        );
    }
}

#[test]
fn without_a_heading_the_gyros_have_the_earth_s_rotation_in_their_bounds() {
    let exact = flight(65.0);
    let bias_bounds = |lacking: &[&str]| {
        let mut record = recorded(&exact, &[0.0; PARAMETERS], 1);
        for name in lacking {
            assume(&mut record, name);
        }
        let findings = examined(&record, &settings());
        [s::P, s::Q].map(|signal| {
            let finding = findings.0.iter().find(|f| f.signal == signal).unwrap();
            finding.estimates[Kind::Bias as usize].unwrap().bound
        })
    };
    // cos 35° of 15 degrees an hour, in any direction.
    let horizontal = 15.0 / 3600.0 * (35.0 / DEG).cos() * 0.5_f64.sqrt();
    for (with, without) in bias_bounds(&[]).into_iter().zip(bias_bounds(&[s::PSI])) {
        let grown = (without * without - with * with).sqrt();
        assert!(grown > 0.8 * horizontal, "{with} and {without}");
    }
}

#[test]
fn one_window_has_bounds_that_hold() {
    for seconds in [8.0, 15.0] {
        let (within, count) = coverage(&flight(seconds), 12, &[]);
        assert!(within > 0.9, "{seconds} s: {within:.3} of {count} hold");
        assert!(count > 25.0, "{seconds} s: {count} found");
    }
}

#[test]
fn a_window_is_never_cut_across_a_gap_or_a_jump() {
    let exact = flight(65.0);
    let is_apart = |record: &Record, left_out: Range<usize>| {
        let chosen = choose_windows(record, 50, &settings());
        assert!(chosen.len() >= 3, "{chosen:?}");
        let mut chosen = chosen.iter();
        chosen.all(|w| w.end <= left_out.start || w.start >= left_out.end)
    };
    let moved = |name: &str, samples: Range<usize>, by: f64| {
        let mut record = exact.clone();
        let values = &mut record.signals.get_mut(name).unwrap().values;
        values[samples].iter_mut().for_each(|v| *v += by);
        record
    };
    assert!(is_apart(&moved(s::Q, 800..810, f64::NAN), 800..810));
    assert!(is_apart(&moved(s::PSI, 1700..1701, 360.0), 1700..1701));
    let jumps = [
        (s::PSI, 360.0),
        (s::THETA, 6.0),
        (s::VELOCITY, 30.0),
        (s::ALTITUDE, -300.0),
    ];
    for (name, by) in jumps {
        let jumping = moved(name, 1700..exact.samples, by);
        assert!(is_apart(&jumping, 1700..1700), "{name}");
    }
    let mut in_two = moved(s::ALTITUDE, 1700..exact.samples, -600.0);
    in_two.signals.get_mut(s::ALTITUDE).unwrap().values[1700] += 300.0;
    assert!(is_apart(&in_two, 1700..1701));
    assert!(!is_apart(&exact, 1700..1700), "no jump, no cut");
    let mut rolling = exact.clone();
    let roll = &mut rolling.signals.get_mut(s::PHI).unwrap().values[1680..];
    let by = (0..40)
        .chain(std::iter::repeat(40))
        .map(|k| 6.0 * f64::from(k));
    roll.iter_mut().zip(by).for_each(|(phi, by)| *phi += by);
    assert!(!is_apart(&rolling, 1700..1700), "a roll at 240 deg/s");
}

#[test]
fn marks_move_with_an_applied_correction() {
    let values: Vec<f64> = (0..8).map(f64::from).collect();
    let mut marks = vec![Mark::Measured; 8];
    marks[5] = Mark::Bridged;
    let mut signals = BTreeMap::new();
    signals.insert(s::THETA.to_owned(), Series { values, marks });
    let mut record = Record {
        flight_id: "f".into(),
        start_s: 0.0,
        step_s: STEP_S,
        samples: 8,
        signals,
        remaining_errors: BTreeMap::new(),
    };
    let fault = |value| {
        Some(ErrorEstimate {
            value,
            bound: 0.0,
            scatter: 0.0,
            fault: true,
            doubtful: false,
            at_limit: false,
            applied: true,
        })
    };
    let findings = Findings(vec![InstrumentFinding {
        ahead_ft: None,
        signal: s::THETA,
        channel: "theta".into(),
        examined: true,
        estimates: [fault(1.0), fault(1.0), fault(2.0 * STEP_S)],
        speed_ft_s: None,
        evidence: vec![],
        air_temperature: None,
    }]);
    findings
        .corrections(&settings())
        .iter()
        .for_each(|c| c.apply(&mut record));
    let series = &record.signals[s::THETA];
    assert_relative_eq!(series.values[1], (3.0 - 1.0) / 2.0);
    assert_eq!(
        (series.marks[3], series.marks[5]),
        (Mark::Bridged, Mark::Measured)
    );
}

#[test]
fn units_of_inputs_are_those_of_the_equations() {
    assert_abs_diff_eq!(input_factor(0) * DEG, 1.0);
    assert_abs_diff_eq!(input_factor(5), -G0_FT_S2);
    assert_eq!(equations::STATES, 7);
}

#[test]
fn one_window_names_no_fault() {
    let (vane, j) = (INPUTS, place(INPUTS, Kind::Scale));
    let mut errors = ordinary(60);
    errors[j] = 0.3;
    let findings = examined(&recorded(&flight(15.0), &errors, 9), &settings());
    assert_eq!(faults(&findings), []);
    let scale = findings.0[vane].estimates[Kind::Scale as usize].unwrap();
    assert!(
        scale.value > 0.1 && scale.doubtful && !scale.applied,
        "{scale:?}"
    );
}

#[test]
fn bounds_grow_without_a_redundant_channel() {
    let exact = flight(65.0);
    let record = recorded(&exact, &ordinary(3), 3);
    let mut without_heading = record.clone();
    assume(&mut without_heading, s::PSI);
    let bound = |record: &Record, signal: &str, kind: Kind| {
        let findings = examined(record, &settings()).0;
        let own = findings.into_iter().find(|f| f.signal == signal).unwrap();
        own.estimates[kind as usize].unwrap().bound
    };
    // The heading determines the yaw rate's bias more closely than anything else.
    let [with, without] = [&record, &without_heading].map(|record| bound(record, s::R, Kind::Bias));
    assert!(without > 1.2 * with, "{without} with {with}");
}

/// Joint fit with ordinary priors.
fn fitted(windows: &[Window]) -> JointState<'_> {
    let settings = Box::leak(Box::new(settings()));
    let context = FitContext {
        aircraft: Box::leak(Box::new(aircraft())),
        settings,
        margin: margin(settings, windows[0].step_s),
    };
    let none = [0.0; PARAMETERS];
    let begin = |window| WindowFit::begin(window, &context, &none).unwrap();
    let estimated = |j: usize| is_observable(j / 3, parameters::ALL_KINDS[j % 3]);
    let mut state = JointState {
        windows: windows.iter().map(begin).collect(),
        estimated: std::array::from_fn(estimated),
        shared: none,
        prior: std::array::from_fn(|j| settings.ordinary.of_parameter(j)),
        context,
    };
    for _ in 0..5 {
        state.settle().unwrap();
    }
    state
}

#[test]
fn an_error_of_one_output_moves_the_estimates_as_its_share_of_the_bounds_states() {
    let exact = flight(65.0);
    let record = recorded(&exact, &[0.0; PARAMETERS], 1);
    let error = 0.02;
    let mut scaled = record.clone();
    let beta = &mut scaled.signals.get_mut(s::BETA_VANE).unwrap().values;
    for value in beta.iter_mut() {
        *value *= 1.0 + error;
    }
    let [before, after] = [&record, &scaled].map(windows);
    let [before, after] = [&before, &after].map(|windows| {
        let mut state = fitted(windows);
        state.count_input_noise();
        state
    });
    let values = [&before, &after].map(|state| state.posterior().unwrap().values);
    let inverse = before.inverse(&before.evidence_information()).unwrap();
    let moves = before.moves_by_errors(&inverse);
    let source = place(INPUTS + output::BETA, Kind::Scale);
    for j in (0..PARAMETERS).filter(|j| before.estimated[*j]) {
        let bound = inverse[(j, j)].sqrt();
        let moved = (values[1][j] - values[0][j]) / bound;
        let stated = error * moves[(j, source)] / bound;
        assert!(
            (moved - stated).abs() < 0.1 + 0.1 * stated.abs(),
            "{} {}: {moved} of {stated}",
            SIGNALS[j / 3],
            j % 3
        );
    }
    let own = error * moves[(source, source)] / inverse[(source, source)].sqrt();
    assert!(own > 3.0, "{own}");
}

#[test]
fn a_stand_in_is_no_instrument() {
    let mut record = recorded(&flight(40.0), &ordinary(4), 4);
    for lateral in [s::P, s::R, s::AY, s::PHI, s::BETA_VANE] {
        let zeros = Series::assumed(vec![0.0; record.samples]);
        record.signals.insert(lateral.to_owned(), zeros);
    }
    let windows = windows(&record);
    assert!(!windows.is_empty());
    for window in &windows {
        assert_eq!(window.is_recorded, [false, true, false, true, false, true]);
        // Without p, r and ay neither φ, ψ nor β follow.
        let compared = window
            .outputs
            .iter()
            .map(|v| v.iter().any(|v| v.is_finite()));
        let expected = [true, false, true, true, false, false, true, true, true];
        assert_eq!(compared.collect::<Vec<_>>(), expected);
    }
}

#[test]
fn without_an_acceleration_no_other_instrument_is_blamed() {
    let exact = flight(65.0);
    for lacking in [s::AX, s::AN, s::AY] {
        let (within, count) = coverage(&exact, 2, &[lacking]);
        assert!(within > 0.9, "without {lacking}: {within:.3} of {count}");
    }
    let mut record = recorded(&exact, &ordinary(5), 5);
    assume(&mut record, s::AN);
    for window in windows(&record) {
        let compared = window
            .outputs
            .iter()
            .map(|v| v.iter().any(|v| v.is_finite()));
        let expected = [false, false, false, true, true, true, false, false, false];
        assert_eq!(compared.collect::<Vec<_>>(), expected);
    }
}

/// One window of an exact flight, in which everything moves.
fn exact_window() -> Window {
    windows(&flight(24.0)).remove(0)
}

#[test]
fn the_score_scatters_with_the_noise_of_the_inputs() {
    const TIMES: u32 = 250;
    let (settings, aircraft, exact) = (settings(), aircraft(), exact_window());
    let shared = [0.0; PARAMETERS];
    let context = FitContext {
        aircraft: &aircraft,
        settings: &settings,
        margin: margin(&settings, exact.step_s),
    };
    let score = |window: &Window| {
        WindowFit::begin(window, &context, &shared)
            .unwrap()
            .gradient
    };
    let without_noise = score(&exact);
    let mut scatter = nalgebra::DMatrix::zeros(PARAMETERS, PARAMETERS);
    let mut random = RandomStream::new(11, "inputs");
    for _ in 0..TIMES {
        let mut noisy = exact.clone();
        for (values, deviation) in noisy.inputs.iter_mut().zip(NOISE) {
            for value in values {
                *value += deviation * random.normal();
            }
        }
        let change = score(&noisy) - &without_noise;
        scatter += &change * change.transpose() / f64::from(TIMES);
    }
    let mut noisy = exact.clone();
    noisy.input_variances = std::array::from_fn(|i| NOISE[i] * NOISE[i]);
    let fit = WindowFit::begin(&noisy, &context, &shared).unwrap();
    let covariance = fit.input_noise_covariance().unwrap();
    for i in 0..INPUTS {
        for kind in [Kind::Bias, Kind::Scale] {
            let j = place(i, kind);
            assert_relative_eq!(covariance[(j, j)], scatter[(j, j)], max_relative = 0.3);
        }
    }
    // Of the signs: p and r share the roll of the flight path.
    let (p, r) = (place(0, Kind::Bias), place(2, Kind::Bias));
    let size = (scatter[(p, p)] * scatter[(r, r)]).sqrt();
    assert_abs_diff_eq!(
        covariance[(p, r)] / size,
        scatter[(p, r)] / size,
        epsilon = 0.2
    );
}

#[test]
fn the_noise_of_the_inputs_is_found_in_the_record() {
    let record = recorded(&flight(24.0), &[0.0; PARAMETERS], 5);
    let window = windows(&record).remove(0);
    for (variance, noise) in window.input_variances.iter().zip(NOISE) {
        assert_relative_eq!(variance.sqrt(), noise, max_relative = 0.25);
    }
}

/// Share of the inputs' biases inside their 95 % intervals, and the root mean square of their
/// distances in bounds, in flights of one window.
fn coverage_of_one_window(is_noise_counted: bool) -> (f64, f64) {
    const TIMES: u64 = 16;
    let (exact, aircraft, settings) = (flight(22.0), aircraft(), settings());
    let mut distances = Vec::new();
    for seed in 0..TIMES {
        let mut draw = RandomStream::new(seed, "biases");
        let mut truth = [0.0; PARAMETERS];
        for i in 0..INSTRUMENTS {
            let j = place(i, Kind::Bias);
            truth[j] = 0.5 * settings.ordinary.of_parameter(j) * draw.normal();
        }
        let mut windows = windows(&recorded(&exact, &truth, seed));
        windows.truncate(1);
        if !is_noise_counted {
            windows[0].input_variances = [0.0; INPUTS];
        }
        let errors = joint_fit::fit(&windows, &aircraft, &settings).unwrap();
        let biases = (0..INPUTS).map(|i| place(i, Kind::Bias));
        distances.extend(biases.map(|j| (errors.values[j] - truth[j]) / errors.bounds[j]));
    }
    let count = distances.len() as f64;
    let inside = distances.iter().filter(|d| d.abs() < 1.96).count();
    let squares: f64 = distances.iter().map(|d| d * d).sum();
    (inside as f64 / count, (squares / count).sqrt())
}

#[test]
fn bounds_of_one_short_window_hold_and_would_not_without_the_inputs_noise() {
    let (share, rms) = coverage_of_one_window(true);
    assert!(share > 0.88 && rms < 1.25, "{share} of 95 %, rms {rms}");
    let (share, rms) = coverage_of_one_window(false);
    assert!(share < 0.88 && rms > 1.25, "{share} of 95 %, rms {rms}");
}
