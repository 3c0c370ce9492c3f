//! Coefficients of a simulation against the sum over the derivatives of the model file.

use approx::assert_relative_eq;

use super::fixture::shipped;
use crate::aero::{AeroModel, Condition, Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::proof_of_match::aerodynamics::{
    Aerodynamics, COEFFICIENTS, SimulationTrim, TrimmedAerodynamics, recorded_signals,
};
use crate::proof_of_match::factor::AeroInputs;

/// Nodes of the table, between which it interpolates.
const TRIM_DEG: f64 = 12.0;
const FLOWN_DEG: f64 = 15.0;

fn flow(alpha_deg: f64) -> AeroInputs {
    let away = alpha_deg - TRIM_DEG;
    AeroInputs {
        alpha_deg,
        beta_deg: 0.5 - 0.7 * away,
        velocity: 400.0 - 9.0 * away,
        mach: 0.4,
        rates: [0.1, 0.02, -0.03].map(|rate| rate * (1.0 + away)),
        alpha_rate: 0.0,
        qbar: 150.0 - 4.0 * away,
    }
}

/// Regressor of a derivative by its definition.
fn regressor(
    (aircraft, derivative): (&Aircraft, &Derivative),
    of: &Regressor,
    flow: &AeroInputs,
    recorded: &dyn Fn(&str) -> f64,
) -> f64 {
    let [p, q, r] = flow.rates;
    let per_half_speed = 0.5 / flow.velocity;
    match of {
        Regressor::Constant => 1.0,
        Regressor::Alpha => flow.alpha_deg,
        Regressor::Beta => flow.beta_deg,
        Regressor::RollRate => p * aircraft.span_ft * per_half_speed,
        Regressor::PitchRate => q * aircraft.chord_ft * per_half_speed,
        Regressor::YawRate => r * aircraft.span_ft * per_half_speed,
        Regressor::AlphaRate => flow.alpha_rate * aircraft.chord_ft * per_half_speed,
        Regressor::Surface(name) => recorded(name),
        Regressor::Vane(name) => {
            let length = derivative.coefficient.reference_length(aircraft);
            recorded(name) / (flow.qbar * aircraft.wing_area_ft2 * length)
        }
        Regressor::Magnitude(of) => regressor((aircraft, derivative), of, flow, recorded).abs(),
        Regressor::Product(both) => {
            let at = |of| regressor((aircraft, derivative), of, flow, recorded);
            at(&both[0]) * at(&both[1])
        }
    }
}

#[test]
fn the_change_from_the_trim_is_the_sum_over_the_derivatives() {
    compare(&shipped().config.aero_model);
}

#[test]
fn a_second_derivative_of_a_coefficient_along_the_same_factor_counts_as_well() {
    let mut aero_model = shipped().config.aero_model.clone();
    for (copied, name) in [("Cm_q", "CN_q"), ("CN_alpha", "Cm_alpha")] {
        let derivative = aero_model.derivative(copied).unwrap().clone();
        aero_model.derivatives.push(Derivative {
            name: name.to_owned(),
            ..derivative
        });
    }
    compare(&aero_model);
}

fn compare(aero_model: &AeroModel) {
    let config = &shipped().config;
    let (aircraft, tunnel) = (&config.aircraft, &config.tunnel);
    let at = |alpha_deg: f64| Condition {
        alpha_deg,
        mach: 0.4,
        third: None,
    };
    let aerodynamics = Aerodynamics::new((aircraft, aero_model), (tunnel, tunnel), &at(TRIM_DEG));
    let signals = recorded_signals(aero_model);
    let recorded =
        |share: f64| -> Vec<f64> { (1..=signals.len()).map(|i| share * i as f64).collect() };
    let (before, after) = (recorded(0.3), recorded(-0.5));
    let trim = SimulationTrim {
        coefficients: [0.0; COEFFICIENTS],
        factors: aerodynamics.factors(&flow(TRIM_DEG), &before).collect(),
    };
    let mut trimmed = TrimmedAerodynamics::new(&aerodynamics, &trim);
    let change = trimmed.change(&flow(FLOWN_DEG), &after);

    let mut expected = [0.0; COEFFICIENTS];
    for (derivative, place) in aero_model
        .derivatives
        .iter()
        .zip(&aerodynamics.table.places)
    {
        let reader = tunnel.reader(&derivative.name).unwrap();
        let value = |alpha_deg: f64| reader.at(&at(alpha_deg)).unwrap().value;
        let moved = |alpha_deg: f64, signal: &[f64]| {
            let of_name = |name: &str| signal[signals.iter().position(|own| *own == name).unwrap()];
            let own = (aircraft, derivative);
            regressor(own, &derivative.regressor, &flow(alpha_deg), &of_name)
        };
        expected[place.coefficient] += if derivative.regressor == Regressor::Alpha {
            let [a, b, c, d] = [0.0, 1.0, 2.0, 3.0].map(|away| value(TRIM_DEG + away));
            0.5 * (a + d) + b + c
        } else {
            value(FLOWN_DEG) * (moved(FLOWN_DEG, &after) - moved(TRIM_DEG, &before))
        };
    }
    for (own, expected) in change.into_iter().zip(expected) {
        assert!(expected.abs() > 1e-4, "{expected}");
        assert_relative_eq!(own, expected, max_relative = 1e-10);
    }
    let unchanged = trimmed.change(&flow(TRIM_DEG), &before);
    assert!(unchanged.iter().all(|own| *own == 0.0), "{unchanged:?}");
}
