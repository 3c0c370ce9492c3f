//! Errors of calibration against estimation from records that have them.

use approx::assert_relative_eq;
use nalgebra::DVector;

use super::super::calibration_errors::{Calibration, Fitted, Misreading};
use super::super::cost;
use super::super::likelihood::information::Identification;
use super::*;
use crate::numerics::symmetric;

fn model(truth: &[(Derivative, f64)]) -> Model<'_> {
    Model {
        free: truth.iter().map(|(d, _)| d).collect(),
        ..Model::default()
    }
}

/// A maneuver without noise at its true parameters, with the window that it was flown in.
struct Exact<const NX: usize, E: Equations<NX>> {
    truth: Vec<(Derivative, f64)>,
    window: Window,
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
            window: window(),
            case,
            parameters,
            response,
        }
    }

    /// How the estimates move, as said.
    fn said(&self, error: &Misreading) -> DVector<f64> {
        let model = model(&self.truth);
        let fitted = Fitted {
            aircraft: &aircraft(),
            window: &self.window,
            model: &model,
            case: &self.case,
            values: &self.parameters,
            weights: &TABLE,
        };
        let shifts = fitted.gradient_shifts(std::slice::from_ref(error)).unwrap();
        let sums = cost::sums(&self.response, &TABLE);
        let Identification::Determined { inverse, .. } =
            Identification::of(&sums.information, 1e12)
        else {
            panic!()
        };
        inverse * &shifts[0]
    }

    /// How the estimates move when the record has the error.
    fn moved(&self, error: &Misreading) -> DVector<f64> {
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
        let window = self.window.misread(error.signal, error.scale, error.bias);
        let case = Case::<NX, E>::new(&aircraft(), &window, measurements, &model(&self.truth));
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

    /// The estimates move as is said, parameter by parameter, in units of how well noise lets them
    /// be known.
    fn moves_as_said(&self, signals: &[(&str, f64)]) {
        let sums = cost::sums(&self.response, &TABLE);
        let scale = symmetric::scale(&sums.information);
        for (signal, bias) in signals {
            for error in [
                Misreading {
                    signal,
                    scale: 1e-3,
                    bias: 0.0,
                },
                Misreading {
                    signal,
                    scale: 0.0,
                    bias: *bias,
                },
            ] {
                let (said, moved) = (self.said(&error), self.moved(&error));
                let off = (&said - &moved).component_div(&scale).norm()
                    / moved.component_div(&scale).norm();
                assert!(
                    moved.norm() > 0.0 && off < 0.05,
                    "{error:?}: said and moved differ by {off:.3}"
                );
            }
        }
    }
}

#[test]
fn estimates_move_with_errors_of_inputs_and_outputs_as_said() {
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
    Exact::<3, Longitudinal>::new().moves_as_said(&[outputs, inputs].concat());
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
    Exact::<4, Lateral>::new().moves_as_said(&[outputs, inputs].concat());
}

#[test]
fn a_scale_error_of_a_surface_goes_into_its_own_derivatives_and_no_other() {
    let exact = Exact::<3, Longitudinal>::new();
    let shift = exact.said(&Misreading {
        signal: "de_deg",
        scale: 1e-4,
        bias: 0.0,
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
fn what_is_calibrated_exactly_has_no_errors() {
    assert_eq!(Calibration::default().misreadings("q_deg_s").count(), 0);
    let both = Calibration {
        bias: 0.1,
        scale_pct: 2.0,
    };
    let errors: Vec<Misreading> = both.misreadings("q_deg_s").collect();
    assert_eq!(
        errors[0],
        Misreading {
            signal: "q_deg_s",
            scale: 0.02,
            bias: 0.0
        }
    );
    assert_eq!(
        errors[1],
        Misreading {
            signal: "q_deg_s",
            scale: 0.0,
            bias: 0.1
        }
    );
}
