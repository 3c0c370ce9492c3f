//! Small campaigns of one coefficient with three derivatives.

use nalgebra::{DMatrix, DVector};

use crate::aero::wind_tunnel::TunnelPoint;
use crate::aero::{AeroModel, Coefficient, Combined, Derivative, Regressor, WindTunnel};
use crate::estimate::Covariance;
use crate::maneuver::{Maneuver, Status};
use crate::model::{ManeuverResults, Model, Settings, model};
use crate::output_error::error_effect::{ErrorEffect, SharedError};
use crate::tables::EstimateRow;

/// Derivatives of the model, in order: a constant whose sum with the slope is tabulated, the slope, and
/// a damping derivative.
pub const NAMES: [&str; 3] = ["CN_0", "CN_alpha", "CN_q"];

/// One maneuver with its estimates of some of the derivatives.
#[derive(Clone, Debug)]
pub struct Flown {
    pub maneuver: Maneuver,
    pub estimates: Vec<EstimateRow>,
    pub combined: Vec<EstimateRow>,
    pub covariance: Covariance,
}

pub fn aero_model() -> AeroModel {
    let regressors = [Regressor::Constant, Regressor::Alpha, Regressor::PitchRate];
    let derivative = |(name, regressor): (&str, Regressor)| Derivative {
        name: name.into(),
        coefficient: Coefficient::CN,
        regressor,
    };
    AeroModel {
        derivatives: NAMES.into_iter().zip(regressors).map(derivative).collect(),
        biases: vec![],
        combined: vec![Combined {
            name: "CN_ba".into(),
            constant: "CN_0".into(),
            slope: "CN_alpha".into(),
        }],
    }
}

/// Tunnel from 0 to 40 deg by 10 deg: sum, slope and damping.
pub fn tunnel(uncertainty: Option<f64>) -> WindTunnel {
    let mut tunnel = WindTunnel::default();
    for i in 0..5_i32 {
        let alpha_deg = 10.0 * f64::from(i);
        let values = [
            ("CN_ba", 0.2 + 0.03 * alpha_deg),
            ("CN_alpha", 0.05 - 0.0005 * alpha_deg),
            ("CN_q", 4.0 + 0.05 * alpha_deg),
        ];
        for (name, value) in values {
            let point = TunnelPoint {
                uncertainty,
                ..TunnelPoint::new(alpha_deg, value)
            };
            tunnel.insert(name, point);
        }
    }
    tunnel
}

fn row(own: &Maneuver, derivative: &str, status: Status, value: f64, tunnel: f64) -> EstimateRow {
    EstimateRow {
        value: Some(value),
        wind_tunnel: Some(tunnel),
        ..EstimateRow::without_results(own, derivative, "-", status)
    }
}

impl Flown {
    /// Maneuver of a flight that estimates these derivatives with this covariance; the others are held
    /// at the tunnel's values and have no effect.
    pub fn new(
        id: &str,
        flight: &str,
        alpha_deg: f64,
        estimates: &[(&str, f64)],
        covariance: &DMatrix<f64>,
    ) -> Flown {
        let own = maneuver(id, flight, alpha_deg);
        let tunnel = tunnel(None);
        let known = |name: &str| tunnel.value(name, alpha_deg, 0.3).map_or(0.0, |v| v.value);
        let rows = NAMES.iter().map(|name| {
            match estimates.iter().find(|(estimated, _)| estimated == name) {
                Some((_, value)) => row(&own, name, Status::Estimated, *value, known(name)),
                None => row(&own, name, Status::Held, known(name), known(name)),
            }
        });
        Flown {
            estimates: rows.collect(),
            combined: vec![],
            covariance: Covariance {
                names: estimates.iter().map(|(name, _)| (*name).into()).collect(),
                white: vec![],
                corrected: covariance.transpose().as_slice().to_vec(),
                shared_errors: vec![],
            },
            maneuver: own,
        }
    }

    /// Adds an error's effect by one standard deviation; it is part of the covariance.
    pub fn with(mut self, error: SharedError, deviation: f64, change: &[f64]) -> Flown {
        let change = DVector::from_column_slice(change);
        let n = change.len();
        let own = DMatrix::from_row_slice(n, n, &self.covariance.corrected);
        let whole = own + &change * change.transpose();
        self.covariance.corrected = whole.transpose().as_slice().to_vec();
        let effect = ErrorEffect::new(error, deviation, &change);
        self.covariance.shared_errors.push(effect);
        self
    }

    pub fn evidence(&self) -> ManeuverResults<'_> {
        ManeuverResults {
            maneuver: &self.maneuver,
            estimates: &self.estimates,
            combined: &self.combined,
            covariance: &self.covariance,
        }
    }
}

pub fn maneuver(id: &str, flight: &str, alpha_deg: f64) -> Maneuver {
    Maneuver {
        flight_id: flight.into(),
        ..Maneuver::example(id, alpha_deg)
    }
}

/// Settings without an error of the classes, and with Gaussian errors.
pub fn exact() -> Settings {
    Settings {
        class_error: 0.0,
        degrees_of_freedom: 1e12,
        ..Settings::default()
    }
}

pub fn posterior(flown: &[Flown], tunnel: &WindTunnel, settings: &Settings) -> Model {
    let evidence: Vec<ManeuverResults> = flown.iter().map(Flown::evidence).collect();
    model(&evidence, &aero_model(), tunnel, settings)
}

/// Value and standard deviation of a derivative at an angle of attack.
pub fn at(model: &Model, derivative: &str, alpha_deg: f64) -> (f64, f64) {
    let there = |row: &&crate::tables::PosteriorRow| {
        row.derivative == derivative && (row.alpha_deg - alpha_deg).abs() < 1e-9
    };
    let row = model.rows.posterior.iter().find(there).unwrap();
    (row.value, row.standard_deviation)
}

pub fn diagonal<const N: usize>(deviations: [f64; N]) -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVector::from_iterator(N, deviations.map(|d| d * d)))
}
