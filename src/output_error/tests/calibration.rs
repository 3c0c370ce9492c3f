//! Predicted effects of calibration errors against estimates from records that have the errors.

use approx::assert_relative_eq;
use nalgebra::DVector;

use super::super::calibration_errors::{Calibration, FittedManeuver, SignalError};
use super::super::cost;
use super::super::likelihood::information::Identification;
use super::*;
use crate::numerics::linear_algebra::symmetric;

fn model(truth: &[(Derivative, f64)]) -> Model<'_> {
    Model {
        free: truth.iter().map(|(d, _)| d).collect(),
        ..Model::default()
    }
}

/// Maneuver without noise at its true parameters, with its signals.
struct Exact<const NX: usize, E: Equations<NX>> {
    truth: Vec<(Derivative, f64)>,
    signals: ManeuverSignals,
    case: Case<NX, E>,
    parameters: Vec<f64>,
    response: crate::output_error::Response,
}

impl<const NX: usize, E: Equations<NX>> Exact<NX, E> {
    fn new() -> Self {
        let truth = truth(E::AXIS);
        let (mut case, parameters) = case::<NX, E>(&truth, &[]);
        let mut response = case.response();
        case.respond(&parameters, &mut response).unwrap();
        case.measurements.values.clone_from(&response.outputs);
        Exact {
            truth,
            signals: signals(),
            case,
            parameters,
            response,
        }
    }

    /// Predicted change of the estimates.
    fn predicted(&self, error: &SignalError) -> DVector<f64> {
        let model = model(&self.truth);
        let fitted = FittedManeuver {
            aircraft: &aircraft(),
            signals: &self.signals,
            model: &model,
            case: &self.case,
            values: &self.parameters,
            weights: &TABLE,
        };
        let shifts = fitted.gradient_shifts(std::slice::from_ref(error)).unwrap();
        let sums = cost::sums(&self.response, &TABLE);
        let Identification::Determined { inverse, .. } =
            Identification::identify(&sums.information, 1e12)
        else {
            panic!()
        };
        inverse * &shifts[0]
    }

    /// Change of the estimates when the record has the error.
    fn moved(&self, error: &SignalError) -> DVector<f64> {
        let mut measurements = self.case.measurements.clone();
        for (o, output) in E::AXIS
            .outputs()
            .into_iter()
            .enumerate()
            .filter(|(_, o)| o.signal() == error.signal)
        {
            assert_eq!(output.signal(), error.signal);
            measurements
                .values
                .iter_mut()
                .for_each(|z| z[o] += error.scale * z[o] + error.bias);
        }
        let signals = error.apply_to(&self.signals);
        let case = Case::<NX, E>::new(&aircraft(), &signals, measurements, &model(&self.truth));
        let settings = Settings {
            tolerance: 1e-13,
            ..Settings::default()
        };
        let fit = estimate(
            &case,
            self.parameters.clone(),
            TABLE,
            Weights::Table,
            [1e-6; OUTPUTS],
            &settings,
        );
        DVector::from_vec(fit.values) - DVector::from_vec(self.parameters.clone())
    }

    fn assert_predictions_hold(&self, signals: &[(&str, f64)]) {
        for (signal, bias) in signals {
            for error in [
                SignalError {
                    signal,
                    scale: 1e-3,
                    bias: 0.0,
                    delay_s: 0.0,
                },
                SignalError {
                    signal,
                    scale: 0.0,
                    bias: *bias,
                    delay_s: 0.0,
                },
            ] {
                self.assert_prediction_holds(&error);
            }
        }
    }

    /// Compares predicted and actual changes, in units of each parameter's bound.
    fn assert_prediction_holds(&self, error: &SignalError) {
        let sums = cost::sums(&self.response, &TABLE);
        let scale = symmetric::scale(&sums.information);
        let (predicted, moved) = (self.predicted(error), self.moved(error));
        let off =
            (&predicted - &moved).component_div(&scale).norm() / moved.component_div(&scale).norm();
        assert!(
            moved.norm() > 0.0 && off < 0.05,
            "{error:?}: prediction and change differ by {off:.3}"
        );
    }
}

#[test]
fn predicted_effects_of_input_and_output_errors_match_the_estimates() {
    let outputs = [
        (signal::ALPHA_VANE, 0.02),
        (signal::THETA, 0.02),
        (signal::AN, 0.001),
        (signal::AX, 0.001),
    ];
    let inputs = [
        (signal::VELOCITY, 0.3),
        (signal::QBAR, 0.05),
        (signal::MASS, 1.0),
        ("de_deg", 0.01),
    ];
    Exact::<3, Longitudinal>::new().assert_predictions_hold(&[outputs, inputs].concat());
    let outputs = [
        (signal::P, 0.01),
        (signal::R, 0.01),
        (signal::PHI, 0.02),
        (signal::AY, 0.001),
    ];
    let inputs = [
        (signal::ALPHA_VANE, 0.02),
        (signal::IZ, 100.0),
        ("dr_deg", 0.01),
        ("dyv_deg", 0.01),
    ];
    Exact::<4, Lateral>::new().assert_predictions_hold(&[outputs, inputs].concat());
}

#[test]
fn predicted_effects_of_late_surfaces_match_the_estimates() {
    let longitudinal = Exact::<3, Longitudinal>::new();
    longitudinal.assert_prediction_holds(&SignalError::delay("de_deg", 5e-5));
    longitudinal.assert_prediction_holds(&SignalError::delay("dpv_deg", -5e-5));
    let lateral = Exact::<4, Lateral>::new();
    lateral.assert_prediction_holds(&SignalError::delay("da_deg", 5e-5));
    lateral.assert_prediction_holds(&SignalError::delay("dyv_deg", 5e-5));
}

#[test]
fn a_scale_error_of_a_surface_changes_its_own_derivatives_only() {
    let exact = Exact::<3, Longitudinal>::new();
    let shift = exact.predicted(&SignalError {
        signal: "de_deg",
        scale: 1e-4,
        bias: 0.0,
        delay_s: 0.0,
    });
    for ((name, shift), value) in exact
        .case
        .names
        .iter()
        .zip(shift.iter())
        .zip(&exact.parameters)
    {
        let of_de = name.ends_with("_de");
        let expected = if of_de { -1e-4 * value } else { 0.0 };
        assert_relative_eq!(
            *shift,
            expected,
            epsilon = 1e-7 * value.abs(),
            max_relative = 1e-3
        );
    }
}

#[test]
fn exact_calibration_has_no_errors() {
    assert_eq!(Calibration::default().signal_errors("q_deg_s").count(), 0);
    let both = Calibration {
        bias: 0.1,
        scale_pct: 2.0,
    };
    let errors: Vec<SignalError> = both.signal_errors("q_deg_s").collect();
    assert_eq!(
        errors[0],
        SignalError {
            signal: "q_deg_s",
            scale: 0.02,
            bias: 0.0,
            delay_s: 0.0
        }
    );
    assert_eq!(
        errors[1],
        SignalError {
            signal: "q_deg_s",
            scale: 0.0,
            bias: 0.1,
            delay_s: 0.0
        }
    );
}
