//! Linear equations against differences of the nonlinear ones, and exact slopes against differences.

use std::collections::BTreeMap;

use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector};

use super::fixture::{aircraft, linear, linear_of, linear_with, posterior, trim};
use crate::aero::{AeroModel, Axis, Coefficient, Derivative, Regressor};
use crate::aircraft::{Aircraft, ThrustLine};
use crate::model::{LocalKind, LocalPosterior, LocalValue};
use crate::qualities::linear::{
    AlphaRateTerm, AxisStates, Controls, Differentiation, Effect, LinearModel, Matrix,
    SteadyFlight, Vector,
};
use crate::tables::FlyingQuality;
use crate::units::DEG;

/// Rates of velocity, α, q, θ from forces and moment in flight without sideslip, at constant density
/// and thrust. Independent of the equations of the program.
struct Pitching {
    values: BTreeMap<&'static str, f64>,
    mach_slope: f64,
    /// Forward and down, and its moment.
    thrust: [f64; 3],
    /// Constants of CN and Cm that make the trim steady.
    offset: [f64; 2],
}

impl Pitching {
    /// CN, Cm, CA.
    fn coefficients(&self, x: &Vector) -> [f64; 3] {
        let (aircraft, trim) = (aircraft(), trim());
        let [velocity, alpha, q, _]: [f64; 4] = (*x).into();
        let qbar = trim.qbar * (velocity / trim.velocity).powi(2);
        let force = qbar * aircraft.wing_area_ft2;
        let alpha_deg = DEG * (alpha - trim.alpha);
        let rate = q * aircraft.chord_ft / (2.0 * velocity);
        let mach = trim.condition.mach * (velocity / trim.velocity - 1.0);
        let (de, dpv) = (-4.0, 3.0);
        let v = |name: &str| self.values[name];
        let plain = |c: &str| {
            let value = |d: &str| {
                let name = self.values.keys().find(|k| **k == format!("{c}_{d}"));
                name.map_or(0.0, |name| self.values[name])
            };
            value("0") + value("alpha") * alpha_deg + value("q") * rate + value("de") * de
        };
        [
            plain("CN") + v("CN_dpv") * dpv / force + self.mach_slope * mach + self.offset[0],
            plain("Cm") + v("Cm_dpv") * dpv / (force * aircraft.chord_ft) + self.offset[1],
            plain("CA"),
        ]
    }

    fn rates(&self, x: &Vector) -> Vector {
        let (aircraft, trim) = (aircraft(), trim());
        let [velocity, alpha, q, theta]: [f64; 4] = (*x).into();
        let qbar = trim.qbar * (velocity / trim.velocity).powi(2);
        let force = qbar * aircraft.wing_area_ft2;
        let [cn, cm, ca] = self.coefficients(x);
        let lift = force * (cn * alpha.cos() - ca * alpha.sin());
        let drag = force * (ca * alpha.cos() + cn * alpha.sin());
        let path = theta - alpha;
        let (weight, mass) = (trim.mass * trim.gravity, trim.mass);
        let [forward, down, pitch] = self.thrust;
        let along = forward * alpha.cos() + down * alpha.sin() - drag - weight * path.sin();
        let across = lift + forward * alpha.sin() - down * alpha.cos() - weight * path.cos();
        Vector::from([
            along / mass,
            q - across / (mass * velocity),
            (force * aircraft.chord_ft * cm + pitch) / trim.iy,
            q,
        ])
    }
}

fn matrix(linear: &LinearModel, posterior: &LocalPosterior) -> Matrix {
    let solved = linear.solved(&posterior.mean, Differentiation::ValuesAlone);
    solved.matrix
}

/// The fighter's posterior with a slope of CN along Mach number.
fn with_mach_slope() -> (LocalPosterior, f64) {
    let mut posterior = posterior(Axis::Longitudinal, 0.1);
    let slope = 0.4;
    posterior.values.push(LocalValue {
        coefficient: Coefficient::CN,
        derivative: "CN_0".into(),
        kind: LocalKind::Sum,
        is_mach_slope: true,
    });
    let n = posterior.mean.len();
    posterior.mean = posterior.mean.insert_row(n, slope);
    posterior.covariance = posterior
        .covariance
        .insert_row(n, 0.0)
        .insert_column(n, 0.0);
    (posterior, slope)
}

#[test]
fn the_longitudinal_matrix_is_that_of_differences_of_forces_and_moment() {
    // Engines 3 ft below the c.g., inclined by 5 deg.
    let line = ThrustLine {
        x_ft: 38.2,
        z_ft: -1.0,
        inclination_deg: 5.0,
    };
    assert_matrix_is_that_of_differences(&aircraft());
    assert_matrix_is_that_of_differences(&Aircraft {
        thrust_line: Some(line),
        ..aircraft()
    });
}

fn assert_matrix_is_that_of_differences(aircraft: &Aircraft) {
    let (posterior, mach_slope) = with_mach_slope();
    let names = [
        "CN_0", "CN_alpha", "CN_q", "CN_de", "CN_dpv", "Cm_0", "Cm_alpha", "Cm_q", "Cm_de",
        "Cm_dpv", "CA_0", "CA_alpha", "CA_q", "CA_de",
    ];
    let trim = trim();
    let start = Vector::from([trim.velocity, trim.alpha, 0.0, trim.theta]);
    let mut pitching = Pitching {
        values: names
            .into_iter()
            .zip(posterior.mean.iter().copied())
            .collect(),
        mach_slope,
        thrust: [0.0; 3],
        offset: [0.0; 2],
    };
    let force = trim.qbar * aircraft.wing_area_ft2;
    let [cn, cm, ca] = pitching.coefficients(&start);
    let weight = trim.mass * trim.gravity;
    let forward = weight * trim.theta.sin() + force * ca;
    let line = aircraft.thrust_line;
    let (slope, arm) = line.map_or((0.0, 0.0), |l| {
        (l.inclination_deg.to_radians().tan(), 2.0 - l.z_ft)
    });
    let (down, pitch) = (-forward * slope, forward * arm);
    pitching.thrust = [forward, down, pitch];
    let normal = (weight * trim.theta.cos() + down) / force;
    pitching.offset = [normal - cn, -pitch / (force * aircraft.chord_ft) - cm];
    assert!(pitching.rates(&start).norm() < 1e-12);
    let differences = Matrix::from_fn(|i, j| {
        let h = 1e-4 * if j == 0 { trim.velocity } else { 1.0 };
        let step = Vector::ith(j, h);
        (pitching.rates(&(start + step))[i] - pitching.rates(&(start - step))[i]) / (2.0 * h)
    });
    let none = BTreeMap::new();
    let found = matrix(
        &linear_of(aircraft, Axis::Longitudinal, &posterior, &none),
        &posterior,
    );
    assert_relative_eq!(found, differences, epsilon = 1e-7, max_relative = 1e-6);
    // Each entry that the equations have is exercised.
    assert!((0..4).all(|i| found[(0, i)].abs() > 1e-4 || i == 2));
    assert!(found[(2, 0)].abs() > 1e-7 && found[(1, 3)].abs() > 1e-4);
}

/// Effect of a derivative of CN along a regressor, with velocity, α and q as states.
fn effect(regressor: &str) -> Effect {
    let (aircraft, trim) = (aircraft(), trim());
    let aero_model = AeroModel {
        derivatives: vec![Derivative {
            name: "own".into(),
            coefficient: Coefficient::CN,
            regressor: Regressor::parse(regressor).unwrap(),
        }],
        ..AeroModel::default()
    };
    let posterior = LocalPosterior {
        values: vec![LocalValue {
            coefficient: Coefficient::CN,
            derivative: "own".into(),
            kind: LocalKind::Derivative,
            is_mach_slope: false,
        }],
        mean: DVector::zeros(1),
        covariance: DMatrix::zeros(1, 1),
    };
    let of_regressor = |part: &Regressor| match part {
        Regressor::Alpha => Some((1, DEG)),
        Regressor::PitchRate => Some((2, 0.016)),
        _ => None,
    };
    let states = AxisStates {
        of_regressor: &of_regressor,
        velocity: Some(0),
        feedback: &[],
    };
    let pitch = BTreeMap::from([("de_deg".to_owned(), 1.0)]);
    let flight = SteadyFlight {
        aircraft: &aircraft,
        aero_model: &aero_model,
        trim: &trim,
        controls: Controls {
            feedback: &BTreeMap::new(),
            pitch: &pitch,
        },
    };
    flight.effects(&posterior, &states)[0]
}

#[test]
fn products_and_magnitudes_have_the_slopes_of_their_factors_at_trim() {
    // Trim: α 15°, δe −4°, 360 ft/s.
    let expect = |regressor: &str, at_trim: f64, by_state: [f64; 3], by_control: f64| {
        let found = effect(regressor);
        assert_relative_eq!(found.at_trim, at_trim, max_relative = 1e-12);
        assert_relative_eq!(found.by_state[..3], by_state[..], max_relative = 1e-12);
        assert_relative_eq!(found.by_control, by_control, max_relative = 1e-12);
    };
    expect("alpha * alpha", 225.0, [0.0, 30.0 * DEG, 0.0], 0.0);
    expect("alpha * q", 0.0, [0.0, 0.0, 15.0 * 0.016], 0.0);
    expect("alpha * de_deg", -60.0, [0.0, -4.0 * DEG, 0.0], 15.0 * DEG);
    expect("abs(de_deg)", 4.0, [0.0; 3], -DEG);
    expect("abs(beta)", 0.0, [0.0; 3], 0.0);
    expect("velocity_ft_s", 360.0, [1.0, 0.0, 0.0], 0.0);
    expect("mach * alpha", 5.25, [5.25 / 360.0, 0.35 * DEG, 0.0], 0.0);
}

#[test]
fn a_lag_acts_over_the_chord_and_its_product_with_the_factor_at_trim() {
    let reduced = aircraft().chord_ft / (2.0 * 360.0);
    for (regressor, expected) in [
        ("alpha_dot", reduced),
        ("alpha_dot * alpha", 15.0 * reduced),
        ("q", 0.0),
    ] {
        let found = effect(regressor);
        assert_relative_eq!(found.by_alpha_rate, expected, max_relative = 1e-12);
    }
    assert_relative_eq!(effect("alpha_dot").at_trim, 0.0);
}

#[test]
fn equations_with_a_lag_are_solved_with_their_slopes() {
    let posterior = posterior(Axis::Longitudinal, 0.1);
    let explicit = linear(Axis::Longitudinal, &posterior);
    let values = &posterior.mean;
    // Effects of every size and sign on every rate.
    let effect = |i: usize| {
        let size = if values[i] == 0.0 {
            0.03
        } else {
            0.03 / values[i]
        };
        Vector::from_fn(|state, _| size * (1.0 + i as f64 + 3.0 * state as f64).sin())
    };
    let alpha = 1;
    let with_lag = LinearModel {
        alpha_rate: Some(AlphaRateTerm {
            alpha,
            slopes: (0..values.len()).map(effect).collect(),
        }),
        ..explicit.clone()
    };
    let found = with_lag.solved(values, Differentiation::Slopes);
    let plain = explicit.solved(values, Differentiation::ValuesAlone);
    let lag = (0..values.len()).fold(Vector::zeros(), |sum, i| sum + effect(i) * values[i]);
    let implied = plain.matrix + lag * found.matrix.row(alpha);
    assert_relative_eq!(found.matrix, implied, max_relative = 1e-12, epsilon = 1e-12);
    let implied = plain.control + lag * found.control[alpha];
    assert_relative_eq!(found.control, implied, max_relative = 1e-12);
    for i in 0..values.len() {
        let step = 1e-5 * values[i].abs().max(1e-3);
        let at = |by: f64| {
            let mut moved = values.clone();
            moved[i] += by;
            with_lag.solved(&moved, Differentiation::ValuesAlone)
        };
        let (up, down) = (at(step), at(-step));
        let slope = (up.matrix - down.matrix) / (2.0 * step);
        assert_relative_eq!(found.slopes[i], slope, max_relative = 1e-6, epsilon = 1e-6);
        let slope = (up.control - down.control) / (2.0 * step);
        assert_relative_eq!(
            found.control_slopes[i],
            slope,
            max_relative = 1e-6,
            epsilon = 1e-6
        );
    }
}

#[test]
fn feedback_is_gain_times_the_surface_s_effect() {
    let gains = BTreeMap::from([
        (
            "de_deg".to_owned(),
            BTreeMap::from([("q_deg_s".to_owned(), 0.3)]),
        ),
        (
            "da_deg".to_owned(),
            BTreeMap::from([("p_deg_s".to_owned(), -0.2)]),
        ),
    ]);
    let (aircraft, trim) = (aircraft(), trim());
    let pressure = trim.qbar * aircraft.wing_area_ft2;
    let change = |axis| {
        let posterior = posterior(axis, 0.1);
        matrix(&linear_with(axis, &posterior, &gains), &posterior)
            - matrix(&linear(axis, &posterior), &posterior)
    };
    // deg per deg/s, and a moment per deg: 0.3 · (−0.012 · 57.3) · q̄Sc̄/I_y.
    let expected = 0.3 * -0.012 * DEG * pressure * aircraft.chord_ft / trim.iy;
    assert_relative_eq!(
        change(Axis::Longitudinal)[(2, 2)],
        expected,
        max_relative = 1e-12
    );
    let determinant = trim.ix * trim.iz - trim.ixz * trim.ixz;
    let per_moment = trim.iz / determinant * pressure * aircraft.span_ft;
    let expected = -0.2 * 0.0012 * DEG * per_moment;
    assert_relative_eq!(
        change(Axis::Lateral)[(1, 1)],
        expected,
        max_relative = 1e-12
    );
}

#[test]
fn slopes_of_every_quantity_are_those_of_differences() {
    for axis in [Axis::Longitudinal, Axis::Lateral] {
        let posterior = posterior(axis, 0.1);
        let linear = linear(axis, &posterior);
        let at = |values: &DVector<f64>| {
            let found = linear.quantities(axis, values, Differentiation::ValuesAlone);
            found.unwrap().quantities
        };
        let found = linear.quantities(axis, &posterior.mean, Differentiation::Slopes);
        for (i, (quantity, dual)) in found.unwrap().quantities.iter().enumerate() {
            if !dual.value.is_finite() {
                continue;
            }
            for j in 0..posterior.mean.len() {
                let h = 1e-5 * posterior.mean[j].abs().max(1e-3);
                let mut step = DVector::zeros(posterior.mean.len());
                step[j] = h;
                let above = at(&(&posterior.mean + &step))[i].1.value;
                let below = at(&(&posterior.mean - &step))[i].1.value;
                let difference = (above - below) / (2.0 * h);
                let size = dual.value.abs() / posterior.mean[j].abs().max(1e-3);
                assert!(
                    (dual.slopes[j] - difference).abs() < 1e-5 * size + 1e-6 * difference.abs(),
                    "{quantity} along {}: {} for {difference}",
                    posterior.values[j].derivative,
                    dual.slopes[j]
                );
            }
        }
    }
}

#[test]
fn the_fighter_has_every_mode() {
    let quantities = |axis| {
        let posterior = posterior(axis, 0.1);
        let linear = linear(axis, &posterior);
        let found = linear.quantities(axis, &posterior.mean, Differentiation::ValuesAlone);
        found.unwrap().values()
    };
    let all: BTreeMap<FlyingQuality, f64> = [Axis::Longitudinal, Axis::Lateral]
        .into_iter()
        .flat_map(quantities)
        .collect();
    let near = |quantity, range: std::ops::Range<f64>| {
        assert!(
            range.contains(&all[&quantity]),
            "{quantity}: {}",
            all[&quantity]
        );
    };
    near(FlyingQuality::ShortPeriodFrequency, 0.5..2.0);
    near(FlyingQuality::PhugoidFrequency, 0.05..0.2);
    near(FlyingQuality::DutchRollFrequency, 0.8..2.5);
    near(FlyingQuality::RollTimeConstant, 0.2..3.0);
    near(FlyingQuality::PhiBeta, 0.5..8.0);
    // V/g times the lift slope: 360/32.1 · q̄S CN_α/(m V) times 57.3.
    let lift = 70.0 * 400.0 * 0.055 * DEG * 15f64.to_radians().cos() / (1040.0 * 360.0);
    assert_relative_eq!(
        all[&FlyingQuality::LoadFactorPerAlpha],
        360.0 / 32.1 * lift,
        max_relative = 0.15
    );
}
