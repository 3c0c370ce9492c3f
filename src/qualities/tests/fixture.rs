//! A fighter in steady flight, with a posterior of its derivatives.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::aero::{AeroModel, Axis, Coefficient, Combined, Condition, Derivative, Regressor};
use crate::aircraft::{Aircraft, Position, Sensors, Vane, VaneModel};
use crate::model::{LocalKind, LocalPosterior, LocalValue};
use crate::qualities::linear::{Controls, LinearModel, SteadyFlight};
use crate::qualities::specification::Specification;
use crate::qualities::trim::Trim;

/// Derivatives of the axes with their values in the units of the tables.
const LONGITUDINAL: [(&str, Coefficient, f64); 14] = [
    ("CN_0", Coefficient::CN, 0.8),
    ("CN_alpha", Coefficient::CN, 0.055),
    ("CN_q", Coefficient::CN, 4.0),
    ("CN_de", Coefficient::CN, 0.011),
    ("CN_dpv", Coefficient::CN, 30.0),
    ("Cm_0", Coefficient::Cm, 0.0),
    ("Cm_alpha", Coefficient::Cm, -0.006),
    ("Cm_q", Coefficient::Cm, -5.0),
    ("Cm_de", Coefficient::Cm, -0.012),
    ("Cm_dpv", Coefficient::Cm, -600.0),
    ("CA_0", Coefficient::CA, 0.03),
    ("CA_alpha", Coefficient::CA, -0.002),
    ("CA_q", Coefficient::CA, 0.3),
    ("CA_de", Coefficient::CA, 0.001),
];

const LATERAL: [(&str, Coefficient, f64); 11] = [
    ("CY_beta", Coefficient::CY, -0.013),
    ("CY_p", Coefficient::CY, 0.1),
    ("CY_r", Coefficient::CY, 0.4),
    ("Cl_beta", Coefficient::Cl, -0.0017),
    ("Cl_p", Coefficient::Cl, -0.35),
    ("Cl_r", Coefficient::Cl, 0.12),
    ("Cl_da", Coefficient::Cl, 0.0012),
    ("Cn_beta", Coefficient::Cn, 0.0018),
    ("Cn_p", Coefficient::Cn, -0.03),
    ("Cn_r", Coefficient::Cn, -0.25),
    ("Cn_dr", Coefficient::Cn, -0.0011),
];

fn regressor(name: &str) -> Regressor {
    match name.split_once('_').map_or("", |(_, regressor)| regressor) {
        "0" => Regressor::Constant,
        "alpha" => Regressor::Alpha,
        "beta" => Regressor::Beta,
        "p" => Regressor::RollRate,
        "q" => Regressor::PitchRate,
        "r" => Regressor::YawRate,
        "dpv" => Regressor::Vane("dpv_deg".into()),
        surface => Regressor::Surface(format!("{surface}_deg")),
    }
}

fn derivatives(axis: Axis) -> Vec<(&'static str, Coefficient, f64)> {
    match axis {
        Axis::Longitudinal => LONGITUDINAL.to_vec(),
        Axis::Lateral => LATERAL.to_vec(),
    }
}

pub fn aero_model() -> AeroModel {
    let all = [Axis::Longitudinal, Axis::Lateral].map(derivatives);
    AeroModel {
        derivatives: all
            .into_iter()
            .flatten()
            .map(|(name, coefficient, _)| Derivative {
                name: name.into(),
                coefficient,
                regressor: regressor(name),
            })
            .collect(),
        biases: vec![],
        combined: vec![Combined {
            name: "CN_ba".into(),
            constant: "CN_0".into(),
            slope: "CN_alpha".into(),
        }],
    }
}

pub fn aircraft() -> Aircraft {
    let origin = Position::default();
    let vane = Vane {
        x_ft: 0.0,
        y_ft: 0.0,
        z_ft: 0.0,
        factor: 1.0,
    };
    Aircraft {
        name: "fighter".into(),
        wing_area_ft2: 400.0,
        span_ft: 37.42,
        chord_ft: 11.52,
        engine_inertia_slug_ft2: 3.0,
        thrust_line: None,
        latitude_deg: 34.9,
        sensors: Sensors {
            an: origin,
            ax: origin,
            ay: origin,
            alpha_vane: vane,
            beta_vane: vane,
            vane_model: VaneModel::Exact,
            thrust_in_ax: true,
        },
    }
}

/// Steady descent at 15 deg of α.
pub fn trim() -> Trim {
    let (alpha_deg, path_deg): (f64, f64) = (15.0, -6.0);
    Trim {
        condition: Condition {
            alpha_deg,
            mach: 0.35,
            third: None,
        },
        alpha: alpha_deg.to_radians(),
        theta: (alpha_deg + path_deg).to_radians(),
        velocity: 360.0,
        qbar: 70.0,
        mass: 1040.0,
        gravity: 32.1,
        ix: 22_400.0,
        iy: 173_000.0,
        iz: 188_000.0,
        ixz: -2_080.0,
        cg: Position {
            x_ft: 38.2,
            y_ft: 0.0,
            z_ft: 2.0,
        },
        surfaces_deg: BTreeMap::from([("de_deg".into(), -4.0), ("dpv_deg".into(), 3.0)]),
    }
}

/// Posterior of an axis with standard deviations of a share of each value, without correlations.
pub fn posterior(axis: Axis, share: f64) -> LocalPosterior {
    let derivatives = derivatives(axis);
    let value = |(name, coefficient, _): &(&str, Coefficient, f64)| LocalValue {
        coefficient: *coefficient,
        derivative: (*name).into(),
        // The tunnel tabulates the sums of the forces and the moment at α.
        kind: if regressor(name) == Regressor::Constant {
            LocalKind::Sum
        } else {
            LocalKind::Derivative
        },
        is_mach_slope: false,
    };
    let mean = DVector::from_iterator(derivatives.len(), derivatives.iter().map(|d| d.2));
    let variances = mean.map(|v| share * share * v * v);
    LocalPosterior {
        values: derivatives.iter().map(value).collect(),
        mean,
        covariance: DMatrix::from_diagonal(&variances),
    }
}

/// Linear equations of the fighter.
pub fn linear(axis: Axis, posterior: &LocalPosterior) -> LinearModel {
    linear_of(&aircraft(), axis, posterior, &BTreeMap::new())
}

/// As [`linear`], with feedback.
pub fn linear_with(
    axis: Axis,
    posterior: &LocalPosterior,
    feedback: &BTreeMap<String, BTreeMap<String, f64>>,
) -> LinearModel {
    linear_of(&aircraft(), axis, posterior, feedback)
}

/// Linear equations of an aircraft at the fighter's trim.
pub fn linear_of(
    aircraft: &Aircraft,
    axis: Axis,
    posterior: &LocalPosterior,
    feedback: &BTreeMap<String, BTreeMap<String, f64>>,
) -> LinearModel {
    let (aero_model, trim) = (aero_model(), trim());
    let pitch = BTreeMap::from([("de_deg".to_owned(), 1.0)]);
    let flight = SteadyFlight {
        aircraft,
        aero_model: &aero_model,
        trim: &trim,
        controls: Controls {
            feedback,
            pitch: &pitch,
        },
    };
    match axis {
        Axis::Longitudinal => flight.longitudinal(posterior),
        Axis::Lateral => flight.lateral(posterior),
    }
}

/// Specification of the repository's pipeline.
pub fn specification() -> Specification {
    let text = include_str!("../../../pipelines/harv/qualities.yaml");
    serde_yaml::from_str(text).unwrap()
}
