//! The kernel's pass against the plain one.

use approx::assert_abs_diff_eq;

use super::{light, prepared, values_by_name};
use crate::aero::{Axis, Derivative};
use crate::dynamics::tests::aircraft;
use crate::dynamics::{InGusts, LateralInGusts, LongitudinalInGusts, OUTPUTS};
use crate::filter_error::filter::{Filter, without_own};
use crate::filter_error::reference::PlainFilter;
use crate::output_error::kernel::reference::Reference;
use crate::output_error::kernel::reference::tests::assert_sums_match;
use crate::output_error::likelihood::cost::Sums;
use crate::output_error::tests::{Noise as Draws, SAMPLES, biases, signals, truth, with_products};
use crate::output_error::{InitialState, Model};

/// Compares kernel and plain pass away from the true parameters, with samples that do not count, one
/// held derivative, and free biases and initial states.
fn assert_kernel_matches_plain_pass<const NX: usize, E: InGusts<NX>>(truth: &[(Derivative, f64)]) {
    let given = biases(E::AXIS);
    let mut simulated = prepared::<NX, E>(truth, &given);
    simulated.fly(&light(), &mut Draws(20_261_127));
    let mut measurements = simulated.filter.case.measurements.clone();
    for k in (0..SAMPLES).filter(|k| k % 7 == 3) {
        measurements.used[k][k % OUTPUTS] = false;
    }
    let ((held, value), free) = truth.split_last().unwrap();
    let model = Model {
        free: free.iter().map(|(d, _)| d).collect(),
        held: vec![(held, *value)],
        biases: given.iter().collect(),
        initial_state: InitialState::Estimated,
    };
    let known = vec![Some(0.05); given.len()];
    let (aircraft, signals) = (aircraft(), signals());
    let filter = Filter::<NX, E>::new(&aircraft, &signals, measurements, &model, &known);
    let values = values_by_name(free);
    let mut own = filter.case.starting_values(|name| values[name]);
    own.extend(given.iter().map(|_| 0.01));
    own.extend(filter.case.start.iter().take(E::states_in_still_air()));
    let mut parameters = filter.with_noise(&own, &light());
    for (j, value) in parameters.iter_mut().enumerate() {
        *value *= 1.0 + 0.01 * (j % 5) as f64;
    }
    let kernel = filter.respond(&parameters).unwrap();
    let own_model = without_own(&model);
    let plain = PlainFilter {
        filter: &filter,
        equations: Reference::new(&aircraft, &signals, &own_model, &filter.case),
    };
    let gains = filter.gains_with_slopes(&parameters).unwrap();
    let plain = plain.run(&parameters, &gains);
    for (kernel, plain) in kernel.predicted.iter().zip(&plain.outputs) {
        assert_abs_diff_eq!(kernel[..], plain[..], epsilon = 1e-10);
    }
    let weights = [1.0; OUTPUTS];
    let sums = Sums {
        weighted_square: kernel.whitened.iter().flatten().map(|u| u * u).sum(),
        gradient: kernel.sums.gradient(&weights),
        information: kernel.sums.information(&weights),
        count: 0,
    };
    assert_sums_match(&sums, &plain);
}

#[test]
fn the_kernel_matches_the_plain_pass_on_the_longitudinal_axis() {
    let axis = Axis::Longitudinal;
    assert_kernel_matches_plain_pass::<4, LongitudinalInGusts>(&truth(axis));
    assert_kernel_matches_plain_pass::<4, LongitudinalInGusts>(&with_products(axis));
}

#[test]
fn the_kernel_matches_the_plain_pass_on_the_lateral_axis() {
    let axis = Axis::Lateral;
    assert_kernel_matches_plain_pass::<6, LateralInGusts>(&truth(axis));
    assert_kernel_matches_plain_pass::<6, LateralInGusts>(&with_products(axis));
}
