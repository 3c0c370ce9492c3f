//! Derivatives that change over the angles of attack of a maneuver.

use super::*;
use crate::aero::Combined;
use crate::aero::wind_tunnel::TunnelPoint;
use crate::filter_error::tests::{plain_outputs, plain_step};
use crate::units::DEG;

/// Deflection of the stabilator about which it moves, deg.
const TRIM_DEG: f64 = -8.0;

/// Change of `Cm_de` per degree of angle of attack, as a share of its value at 20°.
const CHANGE_PER_DEG: f64 = -0.03;

/// True `Cm_alpha`, per degree.
const STATIC_STABILITY: f64 = -0.006;

/// Factor on the inputs of the other tests, so that the angle of attack sweeps some 6°.
const LARGER: f64 = 3.0;

fn pitch_effectiveness(alpha_deg: f64) -> f64 {
    -0.012 * (1.0 + CHANGE_PER_DEG * (alpha_deg - 20.0))
}

/// Bench whose tunnel tabulates `Cm_de` times a factor.
fn bench_with_tunnel(factor: f64) -> Bench {
    let mut bench = bench();
    bench.settings.method = Method::FilterError;
    for alpha_deg in [0.0, 20.0, 40.0] {
        let value = factor * pitch_effectiveness(alpha_deg);
        bench
            .tunnel
            .insert("Cm_de", TunnelPoint::new(alpha_deg, value));
    }
    bench
}

/// Record of a flight whose `Cm_de` changes with the angle of attack, at a trimmed stabilator.
fn flown_with_changing_derivative(bench: &Bench, seed: u64, vane_noise_deg: f64) -> Record {
    let mut record = record();
    for value in &mut record.signals.get_mut("de_deg").unwrap().values {
        *value = TRIM_DEG + LARGER * *value;
    }
    let (case, values) = bench.true_case(&record);
    let mut own = case.starting_values(|name| match name {
        "CN_0" | "Cm_0" => values[name] - TRIM_DEG * values[name.replace('0', "de").as_str()],
        _ => values[name],
    });
    let changing = case.names.iter().position(|name| name == "Cm_de").unwrap();
    let mut noise = Noise(seed);
    let mut x = case.start;
    for k in 0..SAMPLES {
        own[changing] = pitch_effectiveness(DEG * x[0]);
        let y = plain_outputs(&case, &own, k, &x);
        for (o, output) in bench.class.axis.outputs().into_iter().enumerate() {
            let size = match output {
                Output::Alpha => vane_noise_deg,
                _ => NOISE[o],
            };
            let series = record.signals.get_mut(output.signal()).unwrap();
            series.values[k] = y[o] + size * noise.gaussian();
        }
        x = plain_step(&case, &own, k, &x);
    }
    record
}

/// Table of a tunnel from which the sum of constant and slope follows.
#[derive(Clone, Copy)]
enum SumTable {
    Sum,
    Constant,
}

/// Bench whose tunnel tabulates the slope of `Cm` along α without an error, and the sum of constant and
/// slope with an error at one point.
fn bench_with_contradicting_tables(table: SumTable, error: f64) -> Bench {
    let mut bench = bench_with_tunnel(1.0);
    bench.aero_model.combined.push(Combined {
        name: "Cm_ba".into(),
        constant: "Cm_0".into(),
        slope: "Cm_alpha".into(),
    });
    for alpha_deg in [15.0, 20.0, 25.0] {
        let constant = if alpha_deg > 20.0 { error } else { 0.0 };
        let mut insert = |name, value| {
            let point = TunnelPoint::new(alpha_deg, value);
            bench.tunnel.insert(name, point);
        };
        insert("Cm_alpha", STATIC_STABILITY);
        match table {
            SumTable::Sum => insert("Cm_ba", STATIC_STABILITY * alpha_deg + constant),
            SumTable::Constant => insert("Cm_0", constant),
        }
    }
    bench
}

/// Errors of `Cm_alpha` over some flights, and their mean square in bounds.
fn errors_of_static_stability(bench: &Bench, vane_noise_deg: f64) -> (f64, f64) {
    let errors = (1..=6).map(|seed| {
        let record = flown_with_changing_derivative(bench, seed, vane_noise_deg);
        let estimated = bench.estimate(&record, &maneuver("a", 20.0));
        let mut rows = estimated.estimates.iter();
        let row = rows.find(|row| row.derivative == "Cm_alpha").unwrap();
        let error = row.value.unwrap() - STATIC_STABILITY;
        (error, (error / row.bound_corrected.unwrap()).powi(2))
    });
    let errors: Vec<(f64, f64)> = errors.collect();
    let mean = |of: fn(&(f64, f64)) -> f64| errors.iter().map(of).sum::<f64>() / 6.0;
    (mean(|e| e.0), mean(|e| e.1))
}

#[test]
fn the_change_of_a_trimmed_surface_s_derivative_is_not_charged_to_static_stability() {
    let by_change = (TRIM_DEG * CHANGE_PER_DEG * 0.012).abs();
    for (factor, vane_noise_deg) in [(1.0, 0.08), (0.8, 0.08), (1.25, 0.08), (1.0, 0.3)] {
        let bench = bench_with_tunnel(factor);
        let (error, square) = errors_of_static_stability(&bench, vane_noise_deg);
        let case = format!("{factor}, {vane_noise_deg} deg: {error} of {by_change}, {square}");
        assert!(error.abs() < 0.1 * by_change, "{case}");
        assert!(square < 4.0, "{case}");
    }
}

#[test]
fn a_sum_that_contradicts_the_table_of_its_slope_is_not_believed() {
    for error in [-0.02, 0.02, 0.03] {
        let bench = bench_with_contradicting_tables(SumTable::Sum, error);
        let (mean, square) = errors_of_static_stability(&bench, 0.08);
        assert!(square < 2.0, "{error}: {mean}, {square}");
    }
}

#[test]
fn a_sum_without_a_table_follows_from_constant_and_slope() {
    let [sum, constant] = [SumTable::Sum, SumTable::Constant].map(|table| {
        errors_of_static_stability(&bench_with_contradicting_tables(table, 0.03), 0.08)
    });
    assert_relative_eq!(sum.0, constant.0, epsilon = 1e-6);
    assert_relative_eq!(sum.1, constant.1, max_relative = 1e-2);
    let (without, _) = errors_of_static_stability(&bench_with_tunnel(1.0), 0.08);
    assert!((without - sum.0).abs() > 1e-5, "{without} {}", sum.0);
}
