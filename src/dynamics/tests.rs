//! Slopes against finite differences, and the sign of every term by a physical statement.

use approx::assert_abs_diff_eq;
use nalgebra::SVector;

use super::{
    COEFFICIENTS, Equations, InGusts, Lateral, LateralInGusts, Longitudinal, LongitudinalInGusts,
    Motion, OUTPUTS,
};
use crate::aero::Regressor;
use crate::aircraft::{Aircraft, Position, Sensors, Thrust, Vane, VaneModel};
use crate::units::{DEG, G0_FT_S2};

/// Aircraft of the campaign's size, with its sensors well away from the c.g.
pub(crate) fn aircraft() -> Aircraft {
    Aircraft {
        name: "test".into(),
        wing_area_ft2: 400.0,
        span_ft: 37.42,
        chord_ft: 11.52,
        engine_inertia_slug_ft2: 3.0,
        thrust_line: None,
        latitude_deg: 34.9,
        sensors: Sensors {
            an: Position {
                x_ft: 31.3,
                y_ft: -0.25,
                z_ft: 6.9,
            },
            ax: Position {
                x_ft: 31.4,
                y_ft: -0.1,
                z_ft: 6.95,
            },
            ay: Position {
                x_ft: 31.45,
                y_ft: 0.1,
                z_ft: 6.85,
            },
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

/// Steady flight at rest in rotation, nothing lateral.
pub(crate) fn steady() -> Motion {
    Motion {
        alpha: 0.35,
        beta: 0.0,
        velocity: 320.0,
        rates: [0.0; 3],
        accelerations: [0.0; 3],
        theta: 0.4,
        phi: 0.0,
        force_x: 10.0,
        force_y: 0.0,
        force_z: -30.0,
        gravity: 32.07,
        qbar: 52.0,
        mass: 1040.0,
        thrust: Thrust::forward(9000.0),
        ix: 22_360.0,
        iy: 173_300.0,
        iz: 187_300.0,
        ixz: -2080.0,
        engine_momentum: 7540.0,
        cg: Position {
            x_ft: 38.2,
            y_ft: 0.05,
            z_ft: 8.7,
        },
    }
}

/// Motion in which no term of the equations vanishes.
fn general_motion() -> Motion {
    Motion {
        beta: 0.08,
        rates: [0.3, 0.1, -0.12],
        accelerations: [0.5, -0.3, 0.2],
        phi: 0.3,
        ..steady()
    }
}

const C: [f64; COEFFICIENTS] = [1.4, -0.05, 0.1];

fn slopes_match<const NX: usize, E: Equations<NX>>() {
    let (inputs, sensors) = (
        E::rate_inputs(&aircraft(), &general_motion()),
        E::sensor_inputs(&aircraft(), &general_motion()),
    );
    let x = E::measured_state(&general_motion());
    let (rates, outputs) = (
        E::rates(&inputs, &x, &C),
        E::outputs(&inputs, &sensors, &x, &C),
    );
    let h = 1e-6;
    for j in 0..NX {
        let (mut up, mut down) = (x, x);
        up[j] += h;
        down[j] -= h;
        let rate =
            (E::rates(&inputs, &up, &C).rates - E::rates(&inputs, &down, &C).rates) / (2.0 * h);
        let output = (E::outputs(&inputs, &sensors, &up, &C).outputs
            - E::outputs(&inputs, &sensors, &down, &C).outputs)
            / (2.0 * h);
        assert_abs_diff_eq!(rates.by_state.column(j).into_owned(), rate, epsilon = 1e-7);
        assert_abs_diff_eq!(
            outputs.by_state.column(j).into_owned(),
            output,
            epsilon = 1e-6
        );
    }
    for j in 0..COEFFICIENTS {
        let (mut up, mut down) = (C, C);
        up[j] += h;
        down[j] -= h;
        let rate =
            (E::rates(&inputs, &x, &up).rates - E::rates(&inputs, &x, &down).rates) / (2.0 * h);
        let output = (E::outputs(&inputs, &sensors, &x, &up).outputs
            - E::outputs(&inputs, &sensors, &x, &down).outputs)
            / (2.0 * h);
        assert_abs_diff_eq!(
            rates.by_coefficient.column(j).into_owned(),
            rate,
            epsilon = 1e-7
        );
        assert_abs_diff_eq!(
            outputs.by_coefficient.column(j).into_owned(),
            output,
            epsilon = 1e-6
        );
    }
}

#[test]
fn longitudinal_slopes_are_those_of_finite_differences() {
    slopes_match::<3, Longitudinal>();
}

#[test]
fn lateral_slopes_are_those_of_finite_differences() {
    slopes_match::<4, Lateral>();
}

#[test]
fn slopes_in_gusts_are_those_of_finite_differences() {
    slopes_match::<4, LongitudinalInGusts>();
    slopes_match::<6, LateralInGusts>();
}

/// Checks that slopes differ from zero only at the declared entries, those through coefficients
/// included.
fn assert_slopes_at_declared_entries<const NX: usize, E: Equations<NX>>() {
    let (inputs, sensors) = (
        E::rate_inputs(&aircraft(), &general_motion()),
        E::sensor_inputs(&aircraft(), &general_motion()),
    );
    let x = E::measured_state(&general_motion());
    let (rates, outputs) = (
        E::rates(&inputs, &x, &C),
        E::outputs(&inputs, &sensors, &x, &C),
    );
    let regressors = [
        Regressor::Alpha,
        Regressor::Beta,
        Regressor::RollRate,
        Regressor::PitchRate,
        Regressor::YawRate,
    ];
    let along = regressors
        .iter()
        .filter_map(|r| E::state_regressor(&aircraft(), general_motion().velocity, r));
    let mut c_by_state = nalgebra::SMatrix::<f64, COEFFICIENTS, NX>::zeros();
    for (state, factor) in along {
        assert!(E::REGRESSOR_STATES.contains(&state));
        c_by_state.column_mut(state).fill(factor);
    }
    let nonzero = |rows: usize, columns: usize, at: &dyn Fn(usize, usize) -> f64| {
        let all = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
        all.filter(|&(i, j)| at(i, j) != 0.0)
            .collect::<std::collections::BTreeSet<_>>()
    };
    let declared = |list: &[(usize, usize)]| {
        list.iter()
            .copied()
            .collect::<std::collections::BTreeSet<_>>()
    };
    let (a, c) = (
        rates.by_state + rates.by_coefficient * c_by_state,
        outputs.by_state + outputs.by_coefficient * c_by_state,
    );
    assert!(nonzero(NX, NX, &|i, j| a[(i, j)]).is_subset(&declared(E::RATES_BY_STATE)));
    assert!(
        nonzero(NX, COEFFICIENTS, &|i, j| rates.by_coefficient[(i, j)])
            .is_subset(&declared(E::RATES_BY_COEFFICIENT))
    );
    assert!(nonzero(OUTPUTS, NX, &|i, j| c[(i, j)]).is_subset(&declared(E::OUTPUTS_BY_STATE)));
    let by_coefficient = nonzero(OUTPUTS, COEFFICIENTS, &|i, j| {
        outputs.by_coefficient[(i, j)]
    });
    assert!(by_coefficient.is_subset(&declared(E::OUTPUTS_BY_COEFFICIENT)));
}

#[test]
fn slopes_differ_from_zero_only_at_declared_entries() {
    assert_slopes_at_declared_entries::<3, Longitudinal>();
    assert_slopes_at_declared_entries::<4, Lateral>();
    assert_slopes_at_declared_entries::<4, LongitudinalInGusts>();
    assert_slopes_at_declared_entries::<6, LateralInGusts>();
}

/// Checks that rates and outputs with a rate relative to the air equal to the gyro's are those of still air, and
/// that the regressors of rates follow the rates relative to the air.
fn assert_still_air<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>() {
    let motion = general_motion();
    let (inputs, sensors) = (
        E::rate_inputs(&aircraft(), &motion),
        E::sensor_inputs(&aircraft(), &motion),
    );
    let still = E::rates(&inputs, &E::measured_state(&motion), &C).rates;
    let read = E::outputs(&inputs, &sensors, &E::measured_state(&motion), &C).outputs;
    let (inputs, sensors) = (
        G::rate_inputs(&aircraft(), &motion),
        G::sensor_inputs(&aircraft(), &motion),
    );
    let x = G::measured_state(&motion);
    let rates = G::rates(&inputs, &x, &C).rates;
    assert_eq!(G::states_in_still_air(), NX);
    assert_eq!(rates.rows(0, NX), still.rows(0, NX));
    assert_eq!(G::outputs(&inputs, &sensors, &x, &C).outputs, read);
    let mut gust = x;
    for &(rate, relative) in G::AIR_RELATIVE_RATES {
        assert_eq!((x[relative], rates[relative]), (x[rate], rates[rate]));
        gust[relative] += 0.1;
        assert_abs_diff_eq!(
            G::decayed(gust, 0.75)[relative] - x[rate],
            0.075,
            epsilon = 1e-15
        );
    }
    for regressor in [
        Regressor::RollRate,
        Regressor::PitchRate,
        Regressor::YawRate,
    ] {
        let relative = |state| {
            G::AIR_RELATIVE_RATES
                .iter()
                .find(|(rate, _)| *rate == state)
        };
        let expected = E::state_of(&regressor).map(|state| relative(state).unwrap().1);
        assert_eq!(G::state_of(&regressor), expected);
    }
}

#[test]
fn without_a_gust_the_equations_in_gusts_are_those_of_still_air() {
    assert_still_air::<3, Longitudinal, 4, LongitudinalInGusts>();
    assert_still_air::<4, Lateral, 6, LateralInGusts>();
}

fn longitudinal(motion: &Motion, c: [f64; 3]) -> (SVector<f64, 3>, SVector<f64, 5>) {
    let (inputs, sensors) = (
        Longitudinal::rate_inputs(&aircraft(), motion),
        Longitudinal::sensor_inputs(&aircraft(), motion),
    );
    let x = Longitudinal::measured_state(motion);
    (
        Longitudinal::rates(&inputs, &x, &c).rates,
        Longitudinal::outputs(&inputs, &sensors, &x, &c).outputs,
    )
}

fn lateral(motion: &Motion, c: [f64; 3]) -> (SVector<f64, 4>, SVector<f64, 5>) {
    let (inputs, sensors) = (
        Lateral::rate_inputs(&aircraft(), motion),
        Lateral::sensor_inputs(&aircraft(), motion),
    );
    let x = Lateral::measured_state(motion);
    (
        Lateral::rates(&inputs, &x, &c).rates,
        Lateral::outputs(&inputs, &sensors, &x, &c).outputs,
    )
}

/// Change of one number when a coefficient or a part of the motion changes.
macro_rules! change {
    ($axis:ident . $part:tt [$i:expr], $motion:expr => $other:expr) => {
        $axis(&$other, [0.0; 3]).$part[$i] - $axis(&$motion, [0.0; 3]).$part[$i]
    };
    ($axis:ident . $part:tt [$i:expr], $c:expr) => {
        $axis(&steady(), $c).$part[$i] - $axis(&steady(), [0.0; 3]).$part[$i]
    };
}

#[test]
fn lift_curves_the_path_up_and_so_alpha_falls() {
    assert!(change!(longitudinal.0[0], [1.0, 0.0, 0.0]) < 0.0);
}

#[test]
fn a_nose_up_moment_raises_the_nose() {
    let expected = 52.0 * 400.0 * 11.52 / 173_300.0;
    assert_abs_diff_eq!(
        change!(longitudinal.0[1], [0.0, 1.0, 0.0]),
        expected,
        epsilon = 1e-12
    );
}

#[test]
fn axial_force_points_aft_so_it_raises_alpha_where_alpha_is_positive() {
    // Aft force has a component against the lift: −f_x sin α.
    assert!(change!(longitudinal.0[0], [0.0, 0.0, 1.0]) > 0.0);
}

#[test]
fn thrust_carries_part_of_the_weight_and_lowers_alpha() {
    assert!(
        change!(longitudinal.0[0], steady() => Motion { thrust: Thrust::forward(12_000.0), ..steady() })
            < 0.0
    );
}

#[test]
fn gravity_pulls_the_path_down_and_raises_alpha() {
    assert!(change!(longitudinal.0[0], steady() => Motion { gravity: 33.0, ..steady() }) > 0.0);
}

#[test]
fn pitching_raises_alpha_and_theta_at_its_own_rate() {
    let nose_up = Motion {
        rates: [0.0, 0.1, 0.0],
        ..steady()
    };
    assert_abs_diff_eq!(
        change!(longitudinal.0[0], steady() => nose_up),
        0.1,
        epsilon = 1e-12
    );
    assert_abs_diff_eq!(
        change!(longitudinal.0[2], steady() => nose_up),
        0.1,
        epsilon = 1e-12
    );
}

#[test]
fn rolling_right_with_the_wind_from_the_right_trades_alpha_for_beta() {
    let slipping = Motion {
        beta: 0.1,
        ..steady()
    };
    assert!(
        change!(longitudinal.0[0], slipping => Motion { rates: [0.3, 0.0, 0.0], ..slipping }) < 0.0
    );
}

#[test]
fn in_a_right_bank_a_right_yaw_lowers_the_nose() {
    let banked = Motion {
        phi: 0.5,
        ..steady()
    };
    assert!(
        change!(longitudinal.0[2], banked => Motion { rates: [0.0, 0.0, 0.1], ..banked }) < 0.0
    );
}

#[test]
fn the_engines_turning_clockwise_pitch_the_nose_down_in_a_right_yaw() {
    let yawing = Motion {
        rates: [0.0, 0.0, 0.2],
        ixz: 0.0,
        ..steady()
    };
    let q_dot = change!(longitudinal.0[1], steady() => yawing);
    assert_abs_diff_eq!(q_dot, -0.2 * 7540.0 / 173_300.0, epsilon = 1e-12);
}

#[test]
fn rolling_and_yawing_together_pitch_the_nose_up_when_the_mass_lies_fore_and_aft() {
    // Centrifugal forces pull nose and tail away from the axis of rotation: p r (I_z − I_x) > 0.
    let coning = Motion {
        rates: [0.3, 0.0, 0.2],
        engine_momentum: 0.0,
        ixz: 0.0,
        ..steady()
    };
    let q_dot =
        change!(longitudinal.0[1], Motion { engine_momentum: 0.0, ixz: 0.0, ..steady() } => coning);
    assert_abs_diff_eq!(
        q_dot,
        0.3 * 0.2 * (187_300.0 - 22_360.0) / 173_300.0,
        epsilon = 1e-12
    );
}

#[test]
fn accelerometers_read_force_up_forward_and_right_in_g() {
    let force = 52.0 * 400.0 / 1040.0 / G0_FT_S2;
    assert_abs_diff_eq!(
        change!(longitudinal.1[3], [1.0, 0.0, 0.0]),
        force,
        epsilon = 1e-12
    );
    assert_abs_diff_eq!(
        change!(longitudinal.1[4], [0.0, 0.0, 1.0]),
        -force,
        epsilon = 1e-12
    );
    assert_abs_diff_eq!(
        change!(lateral.1[4], [1.0, 0.0, 0.0]),
        force,
        epsilon = 1e-12
    );
}

#[test]
fn the_axial_accelerometer_senses_thrust() {
    let thrust = Thrust::forward(10_040.0);
    let more = change!(longitudinal.1[4], steady() => Motion { thrust, ..steady() });
    assert_abs_diff_eq!(more, 1.0 / G0_FT_S2, epsilon = 1e-12);
}

#[test]
fn a_normal_accelerometer_ahead_of_the_cg_is_thrown_up_when_the_nose_comes_up() {
    // Its arm ahead is 38.2 − 31.3 = 6.9 ft; Cm of 1 gives 1.3827 rad/s².
    let q_dot = 52.0 * 400.0 * 11.52 / 173_300.0;
    assert_abs_diff_eq!(
        change!(longitudinal.1[3], [0.0, 1.0, 0.0]),
        6.9 * q_dot / G0_FT_S2,
        epsilon = 1e-12
    );
}

#[test]
fn a_lateral_accelerometer_ahead_of_the_cg_is_thrown_right_when_the_nose_goes_right() {
    assert!(change!(lateral.1[4], [0.0, 0.0, 1.0]) > 0.0);
}

#[test]
fn outputs_are_in_degrees() {
    let (_, y) = longitudinal(&steady(), [0.0; 3]);
    assert_abs_diff_eq!(y[0], 1.02 * 0.35 * DEG, epsilon = 1e-9);
    assert_abs_diff_eq!(y[2], 0.4 * DEG, epsilon = 1e-12);
}

#[test]
fn side_force_to_the_right_carries_the_aircraft_right_so_beta_rises() {
    assert_abs_diff_eq!(
        change!(lateral.0[0], [1.0, 0.0, 0.0]),
        52.0 * 400.0 / (1040.0 * 320.0),
        epsilon = 1e-12
    );
}

#[test]
fn rolling_about_the_body_axis_turns_alpha_into_beta() {
    let rolling = Motion {
        rates: [0.1, 0.0, 0.0],
        ..steady()
    };
    assert_abs_diff_eq!(
        change!(lateral.0[0], steady() => rolling),
        0.1 * 0.35_f64.sin(),
        epsilon = 1e-12
    );
}

#[test]
fn yawing_right_takes_beta_away() {
    let yawing = Motion {
        rates: [0.0, 0.0, 0.1],
        ..steady()
    };
    assert_abs_diff_eq!(
        change!(lateral.0[0], steady() => yawing),
        -0.1 * 0.35_f64.cos(),
        epsilon = 1e-12
    );
}

#[test]
fn a_right_bank_lets_gravity_pull_the_aircraft_into_the_wind_from_the_right() {
    assert!(change!(lateral.0[0], steady() => Motion { phi: 0.2, ..steady() }) > 0.0);
}

#[test]
fn thrust_speeds_the_aircraft_along_its_nose_and_takes_beta_away() {
    let slipping = Motion {
        beta: 0.2,
        ..steady()
    };
    let faster = Motion {
        force_x: 15.0,
        ..slipping
    };
    let expected = -5.0 * 0.35_f64.cos() * 0.2_f64.sin() / 320.0;
    assert_abs_diff_eq!(
        change!(lateral.0[0], slipping => faster),
        expected,
        epsilon = 1e-12
    );
}

#[test]
fn rolling_and_yawing_moments_turn_the_aircraft_right() {
    assert!(change!(lateral.0[1], [0.0, 1.0, 0.0]) > 0.0);
    assert!(change!(lateral.0[2], [0.0, 0.0, 1.0]) > 0.0);
}

#[test]
fn moments_meet_the_inertias_that_the_paper_writes() {
    // I_x ṗ − I_xz ṙ = L and I_z ṙ − I_xz ṗ = N.
    let (x, m) = (lateral(&steady(), [0.0, 0.02, -0.01]).0, steady());
    let pressure = 52.0 * 400.0 * 37.42;
    assert_abs_diff_eq!(m.ix * x[1] - m.ixz * x[2], 0.02 * pressure, epsilon = 1e-8);
    assert_abs_diff_eq!(m.iz * x[2] - m.ixz * x[1], -0.01 * pressure, epsilon = 1e-8);
}

#[test]
fn the_engines_turning_clockwise_yaw_the_nose_right_when_it_comes_up() {
    let pitching = Motion {
        rates: [0.0, 0.2, 0.0],
        ixz: 0.0,
        ..steady()
    };
    let r_dot = lateral(&pitching, [0.0; 3]).0[2];
    assert_abs_diff_eq!(r_dot, 0.2 * 7540.0 / 187_300.0, epsilon = 1e-12);
}

#[test]
fn a_spinning_body_keeps_energy_and_momentum() {
    // Without moments and without engines: I ω·ω̇ = 0 and (I ω)·(I ω̇) = 0 for the three axes
    // together.
    let m = Motion {
        rates: [0.5, 0.3, -0.4],
        engine_momentum: 0.0,
        ..steady()
    };
    let q_dot = longitudinal(&m, [0.0; 3]).0[1];
    let lat = lateral(&m, [0.0; 3]).0;
    let times = |w: [f64; 3]| {
        [
            m.ix * w[0] - m.ixz * w[2],
            m.iy * w[1],
            m.iz * w[2] - m.ixz * w[0],
        ]
    };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let momentum_rate = times([lat[1], q_dot, lat[2]]);
    assert_abs_diff_eq!(dot(m.rates, momentum_rate), 0.0, epsilon = 1e-9);
    assert_abs_diff_eq!(
        dot(times(m.rates), momentum_rate) / m.iz,
        0.0,
        epsilon = 1e-9
    );
}

#[test]
fn a_nose_up_attitude_turns_a_yaw_rate_into_a_roll_rate_of_the_horizon() {
    let yawing = Motion {
        rates: [0.0, 0.0, 0.1],
        ..steady()
    };
    assert_abs_diff_eq!(
        lateral(&yawing, [0.0; 3]).0[3],
        0.1 * 0.4_f64.tan(),
        epsilon = 1e-12
    );
}

#[test]
fn rate_regressors_are_in_radians_over_the_reference_length() {
    let (a, m) = (aircraft(), steady());
    assert_eq!(
        Longitudinal::state_regressor(&a, m.velocity, &Regressor::PitchRate),
        Some((1, 11.52 / 640.0))
    );
    assert_eq!(
        Lateral::state_regressor(&a, m.velocity, &Regressor::RollRate),
        Some((1, 37.42 / 640.0))
    );
    assert_eq!(
        Lateral::state_regressor(&a, m.velocity, &Regressor::YawRate),
        Some((2, 37.42 / 640.0))
    );
    assert_eq!(
        Longitudinal::state_regressor(&a, m.velocity, &Regressor::Alpha),
        Some((0, DEG))
    );
    assert_eq!(
        Lateral::state_regressor(&a, m.velocity, &Regressor::Alpha),
        None
    );
}

/// Motion that the equations produce with coefficients `C`, with matching accelerations and forces.
fn produced<const NX: usize, E: Equations<NX>>(
    forces: [f64; 3],
    accelerations: impl Fn(&SVector<f64, NX>) -> [f64; 3],
) -> Motion {
    let m = general_motion();
    let rates = E::rates(&E::rate_inputs(&aircraft(), &m), &E::measured_state(&m), &C).rates;
    let [force_x, force_y, force_z] = forces;
    Motion {
        accelerations: accelerations(&rates),
        force_x,
        force_y,
        force_z,
        ..m
    }
}

fn implied<const NX: usize, E: Equations<NX>>(m: &Motion) -> [f64; COEFFICIENTS] {
    E::implied_coefficients(&aircraft(), m, &E::rate_inputs(&aircraft(), m))
}

#[test]
fn coefficients_come_back_from_the_motion_that_they_produce() {
    let (m, force) = (general_motion(), 52.0 * 400.0 / 1040.0);
    let [_, q_dot, _] = m.accelerations;
    let forces = [
        m.thrust.forward_lbf / m.mass - force * C[2],
        0.0,
        m.thrust.down_lbf / m.mass - force * C[0],
    ];
    let longitudinal =
        produced::<3, Longitudinal>(forces, |x| [m.accelerations[0], x[1], m.accelerations[2]]);
    let lateral = produced::<4, Lateral>([m.force_x, force * C[0], m.force_z], |x| {
        [x[1], q_dot, x[2]]
    });
    for (back, c) in implied::<3, Longitudinal>(&longitudinal).iter().zip(C) {
        assert_abs_diff_eq!(*back, c, epsilon = 1e-12);
    }
    for (back, c) in implied::<4, Lateral>(&lateral).iter().zip(C) {
        assert_abs_diff_eq!(*back, c, epsilon = 1e-12);
    }
}
