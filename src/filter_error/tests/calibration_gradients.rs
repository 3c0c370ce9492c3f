//! Changes of the gradient by errors of the instruments, against passes on records with the errors.

use nalgebra::DVector;

use super::*;
use crate::filter_error::response::FilterResponse;
use crate::filter_error::row_sinks::RecordedPass;
use crate::filter_error::signal_slopes::Recorded;
use crate::flight::signal;
use crate::output_error::calibration_errors::SignalError;
use crate::output_error::kernel::normal_equations::NormalSums;

/// Errors so small that the direct change is linear in them.
fn errors(surface: &str) -> Vec<SignalError<'_>> {
    let scale = |signal, scale| SignalError {
        signal,
        scale,
        bias: 0.0,
        delay_s: 0.0,
    };
    let bias = |signal, bias| SignalError {
        signal,
        scale: 0.0,
        bias,
        delay_s: 0.0,
    };
    vec![
        scale(signal::P, 1e-3),
        scale(signal::Q, 1e-3),
        scale(signal::QBAR, 1e-3),
        bias(signal::VELOCITY, 1.0),
        bias(signal::ALPHA_VANE, 0.01),
        bias(signal::BETA_VANE, 0.01),
        bias(signal::THETA, 0.1),
        bias(signal::PHI, 0.1),
        bias(signal::AN, 0.01),
        bias(signal::AX, 0.001),
        bias(signal::AY, 0.001),
        scale(surface, 1e-3),
        SignalError::delay(surface, 1e-3),
    ]
}

/// Change of the gradient by a pass on the record that an instrument in error would have made.
fn shift_by_pass<const NX: usize, E: InGusts<NX>>(
    filter: &Filter<NX, E>,
    at: &[f64],
    model: &Model,
    error: &SignalError,
) -> DVector<f64> {
    let gains = filter.gains_with_slopes(at).unwrap();
    let mut pass = RecordedPass::new(filter.samples(), filter.lanes());
    let mut exact = FilterResponse::empty(filter.samples(), filter.parameters());
    filter.run(at, &gains, &mut exact, Some(&mut pass)).unwrap();
    let mut measured = filter.case.measurements.clone();
    let outputs = E::AXIS.outputs();
    if let Some(o) = outputs.iter().position(|o| o.signal() == error.signal) {
        for values in &mut measured.values {
            values[o] += error.scale * values[o] + error.bias;
        }
    }
    let (without_error, in_error) = (signals(), error.apply_to(&signals()));
    let held_start = Model {
        initial_state: InitialState::Measured,
        ..model.clone()
    };
    let windows = [&without_error, &in_error];
    let case = filter
        .case
        .as_recorded(&aircraft(), windows, measured, &held_start);
    let mut moved = FilterResponse::empty(filter.samples(), filter.parameters());
    let updates = filter.measurement_updates(at, &gains);
    filter
        .run_on(&case, at, &updates, &mut moved, None::<&mut NormalSums>)
        .unwrap();
    let mut shift = DVector::zeros(filter.first_noise());
    let whitened = moved.whitened.iter().zip(&exact.whitened);
    let changes = whitened.flat_map(|(moved, exact)| (0..OUTPUTS).map(|o| moved[o] - exact[o]));
    for (change, row) in changes.zip(pass.rows.rows()) {
        for j in 0..filter.first_noise() {
            shift[j] += change * row[filter.lane(j)];
        }
    }
    shift
}

fn assert_shifts_are_those_of_passes<const NX: usize, E: InGusts<NX>>(surface: &str) {
    let truth = truth(E::AXIS);
    let mut simulated = prepared::<NX, E>(&truth, &[]);
    simulated.fly(&light(), &mut Draws(20_261_126));
    let mut measurements = simulated.filter.case.measurements.clone();
    for k in (0..SAMPLES).filter(|k| k % 7 == 3) {
        measurements.used[k][k % OUTPUTS] = false;
    }
    let model = Model {
        free: truth.iter().map(|(d, _)| d).collect(),
        ..Model::default()
    };
    let filter = Filter::<NX, E>::new(&aircraft(), &signals(), measurements, &model, &[]);
    let at = filter.with_noise(&simulated.own, &light());
    let recorded = Recorded {
        aircraft: &aircraft(),
        signals: &signals(),
        model: &model,
    };
    let errors = errors(surface);
    let shifts = filter.gradient_shifts(&at, &recorded, &errors).unwrap();
    let information = filter.respond(&at).unwrap().information();
    for (error, shift) in errors.iter().zip(&shifts) {
        let direct = shift_by_pass(&filter, &at, &model, error);
        let unit = |j: usize| 1.0 / information[(j, j)].sqrt();
        let largest = (0..shift.len()).map(|j| (direct[j] * unit(j)).abs());
        let largest = largest.fold(0.0, f64::max);
        for j in 0..shift.len() {
            // In units of each parameter's own bound.
            assert_abs_diff_eq!(
                shift[j] * unit(j),
                direct[j] * unit(j),
                epsilon = 0.03 * largest
            );
        }
    }
}

#[test]
fn the_gradient_changes_as_by_passes_on_misread_records() {
    assert_shifts_are_those_of_passes::<4, LongitudinalInGusts>("de_deg");
    assert_shifts_are_those_of_passes::<6, LateralInGusts>("dr_deg");
}
