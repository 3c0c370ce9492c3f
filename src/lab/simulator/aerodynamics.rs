//! Aerodynamic force and moment: the build-up 2.10-2.13, 3.9-3.13 with the true derivatives.
//!
//! X = −q̄S CA, Y = q̄S CY, Z = −q̄S CN; L = q̄Sb Cl, M = q̄Sc̄ Cm, N = q̄Sb Cn, about the c.g. The
//! derivative of a thrust-vectoring vane is dimensional: a force or moment per degree.

use nalgebra::Vector3;

use crate::aero::{AeroModel, Coefficient, Combined, Derivative, Regressor, WindTunnel};
use crate::aircraft::Aircraft;
use crate::flight::signal;
use crate::numerics::cubic_curve::CubicCurve;
use crate::rigid_body::AirData;
use crate::units::DEG;

/// The build-up with the tables of the true derivatives.
#[derive(Clone, Debug)]
pub struct Aerodynamics {
    aero_model: AeroModel,
    /// Names of the simulated surfaces.
    surfaces: Vec<String>,
    truth: WindTunnel,
    sums: Vec<TabulatedSum>,
}

/// Sum of constant and slope times α: places of both among the derivatives, and angles of attack of the slope's
/// table, deg.
#[derive(Clone, Debug)]
struct TabulatedSum {
    constant: usize,
    slope: usize,
    alphas_deg: Vec<f64>,
}

impl Aerodynamics {
    /// Pairs a build-up with its true tables.
    ///
    /// # Errors
    /// A derivative has no true value, or its surface is not simulated.
    pub fn new(
        aero_model: &AeroModel,
        truth: WindTunnel,
        surfaces: &[String],
    ) -> Result<Aerodynamics, String> {
        for derivative in &aero_model.derivatives {
            if !truth.has(&derivative.name) {
                return Err(format!("the truth has no value of {}", derivative.name));
            }
            let is_known = |name: &str| {
                signal::OF_THE_FLOW.contains(&name) || surfaces.iter().any(|s| s == name)
            };
            if let Some(name) = derivative.regressor.signals().find(|name| !is_known(name)) {
                return Err(format!("{}: `surfaces` has no `{name}`", derivative.name));
            }
        }
        let place = |name: &str| aero_model.derivatives.iter().position(|d| d.name == name);
        let sum = |sum: &Combined| {
            Some(TabulatedSum {
                constant: place(&sum.constant)?,
                slope: place(&sum.slope)?,
                alphas_deg: truth.alphas_deg(&sum.slope),
            })
        };
        Ok(Aerodynamics {
            aero_model: aero_model.clone(),
            surfaces: surfaces.to_vec(),
            sums: aero_model.combined.iter().filter_map(sum).collect(),
            truth,
        })
    }

    /// Derivatives in the order of [`Aerodynamics::values`].
    #[must_use]
    pub fn derivatives(&self) -> &[Derivative] {
        &self.aero_model.derivatives
    }

    /// Values of the derivatives at an angle of attack, deg, and a Mach number.
    ///
    /// Between the points of its table a derivative is linear. A sum of constant and slope times α
    /// is the cubic through its points with the tabulated slopes. The slope is thus the
    /// coefficient's derivative along α.
    #[must_use]
    pub fn values(&self, alpha_deg: f64, mach: f64) -> Vec<f64> {
        let places = 0..self.aero_model.derivatives.len();
        let mut values: Vec<f64> = places.map(|i| self.tabulated(i, alpha_deg, mach)).collect();
        for sum in &self.sums {
            let (at, along) = self.sum(sum, alpha_deg, mach);
            (values[sum.constant], values[sum.slope]) = (at - along * alpha_deg, along);
        }
        values
    }

    /// Sum of constant and slope times α, and its derivative along α.
    fn sum(&self, sum: &TabulatedSum, alpha_deg: f64, mach: f64) -> (f64, f64) {
        let points = &sum.alphas_deg;
        let above = points.partition_point(|point| *point <= alpha_deg);
        let around = above.saturating_sub(1)..(above + 1).min(points.len());
        let knot = |alpha: &f64| {
            let slope = self.tabulated(sum.slope, *alpha, mach);
            let constant = self.tabulated(sum.constant, *alpha, mach);
            (*alpha, constant + slope * alpha, slope)
        };
        let curve = CubicCurve::through(points[around].iter().map(knot).collect());
        curve.map_or((0.0, 0.0), |curve| curve.at(alpha_deg))
    }

    /// Value of a derivative by its place.
    fn tabulated(&self, derivative: usize, alpha_deg: f64, mach: f64) -> f64 {
        let name = &self.aero_model.derivatives[derivative].name;
        let value = self.truth.value(name, alpha_deg, mach);
        value.map_or(0.0, |v| v.value)
    }

    /// `true` if the loads depend on the rate of the angle of attack.
    #[must_use]
    pub fn have_lag(&self) -> bool {
        self.aero_model.along_alpha_rate().next().is_some()
    }

    /// Force, lbf, and moment about the c.g., ft lbf, in body axes. The rates are relative to the
    /// air; that of the angle of attack is in rad/s.
    #[must_use]
    pub fn loads(
        &self,
        aircraft: &Aircraft,
        values: &[f64],
        air: &AirData,
        (rates, alpha_rate): (&Vector3<f64>, f64),
        surfaces: &[f64],
    ) -> (Vector3<f64>, Vector3<f64>) {
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        let area = air.qbar_psf * aircraft.wing_area_ft2;
        let (span, chord) = (aircraft.span_ft, aircraft.chord_ft);
        let signal = |name: &str| match name {
            signal::VELOCITY => air.velocity_ft_s,
            signal::MACH => air.mach,
            _ => {
                let index = self.surfaces.iter().position(|s| s == name);
                index.and_then(|i| surfaces.get(i)).copied().unwrap_or(0.0)
            }
        };
        let per_speed = 0.5 / air.velocity_ft_s;
        let part = |part: &Regressor| match part {
            Regressor::Alpha => air.alpha * DEG,
            Regressor::Beta => air.beta * DEG,
            Regressor::RollRate => rates.x * span * per_speed,
            Regressor::PitchRate => rates.y * chord * per_speed,
            Regressor::YawRate => rates.z * span * per_speed,
            Regressor::AlphaRate => alpha_rate * chord * per_speed,
            Regressor::Surface(name) | Regressor::Vane(name) => signal(name),
            _ => 1.0,
        };
        for (derivative, value) in self.aero_model.derivatives.iter().zip(values) {
            let vane = matches!(derivative.regressor, Regressor::Vane(_));
            let regressor = derivative.regressor.value(&part);
            let term = value * regressor * if vane { 1.0 } else { area };
            let arm = |length: f64| term * if vane { 1.0 } else { length };
            match derivative.coefficient {
                Coefficient::CA => force.x -= term,
                Coefficient::CY => force.y += term,
                Coefficient::CN => force.z -= term,
                Coefficient::Cl => moment.x += arm(span),
                Coefficient::Cm => moment.y += arm(chord),
                Coefficient::Cn => moment.z += arm(span),
            }
        }
        (force, moment)
    }
}
