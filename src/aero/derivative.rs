//! A derivative: one coefficient's slope along one regressor, e.g. `CN_alpha`.

use serde::{Deserialize, Serialize};

use super::derivative_unit::DerivativeUnit;
use super::regressor::Regressor;
use crate::aircraft::Aircraft;
use crate::flight::signal;
use crate::schema::words;

words! {
    /// Set of equations: chapter 2 or chapter 3 of the paper.
    pub enum Axis {
        /// Chapter 2: pitch, normal and axial force.
        Longitudinal = "longitudinal",
        /// Chapter 3: roll, yaw and side force.
        Lateral = "lateral",
    }
}

impl Axis {
    /// Coefficients that act in this axis, in the order of the equations.
    #[must_use]
    pub fn coefficients(self) -> [Coefficient; 3] {
        match self {
            Axis::Longitudinal => [Coefficient::CN, Coefficient::Cm, Coefficient::CA],
            Axis::Lateral => [Coefficient::CY, Coefficient::Cl, Coefficient::Cn],
        }
    }

    /// Outputs that are matched, in the order of Tables 2 and 4.
    #[must_use]
    pub fn outputs(self) -> [Output; 5] {
        match self {
            Axis::Longitudinal => [
                Output::Alpha,
                Output::Q,
                Output::Theta,
                Output::An,
                Output::Ax,
            ],
            Axis::Lateral => [Output::Beta, Output::P, Output::R, Output::Phi, Output::Ay],
        }
    }
}

/// Force or moment coefficient: normal and axial force, side force, and the three moments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Coefficient {
    CN,
    Cm,
    CA,
    CY,
    Cl,
    Cn,
}

impl Coefficient {
    #[must_use]
    pub fn axis(self) -> Axis {
        match self {
            Coefficient::CN | Coefficient::Cm | Coefficient::CA => Axis::Longitudinal,
            Coefficient::CY | Coefficient::Cl | Coefficient::Cn => Axis::Lateral,
        }
    }

    /// Index among the coefficients of its axis.
    #[must_use]
    pub fn index(self) -> usize {
        self.axis()
            .coefficients()
            .iter()
            .position(|c| *c == self)
            .unwrap_or(0)
    }

    /// Reference length by which a moment coefficient is made dimensionless, ft; 1 for a force.
    #[must_use]
    pub fn reference_length(self, aircraft: &Aircraft) -> f64 {
        match self {
            Coefficient::CN | Coefficient::CA | Coefficient::CY => 1.0,
            Coefficient::Cm => aircraft.chord_ft,
            Coefficient::Cl | Coefficient::Cn => aircraft.span_ft,
        }
    }

    #[must_use]
    pub fn is_moment(self) -> bool {
        matches!(self, Coefficient::Cm | Coefficient::Cl | Coefficient::Cn)
    }

    /// Output of the accelerometer that measures a force; `None` for a moment.
    #[must_use]
    pub fn accelerometer(self) -> Option<Output> {
        match self {
            Coefficient::CN => Some(Output::An),
            Coefficient::CA => Some(Output::Ax),
            Coefficient::CY => Some(Output::Ay),
            Coefficient::Cm | Coefficient::Cl | Coefficient::Cn => None,
        }
    }
}

words! {
    /// Measured response that the estimation matches.
    pub enum Output {
        /// Angle of attack at the vane.
        Alpha = "alpha",
        /// Pitch rate.
        Q = "q",
        /// Pitch attitude.
        Theta = "theta",
        /// Normal acceleration.
        An = "an",
        /// Longitudinal acceleration.
        Ax = "ax",
        /// Sideslip at the vane.
        Beta = "beta",
        /// Roll rate.
        P = "p",
        /// Yaw rate.
        R = "r",
        /// Roll attitude.
        Phi = "phi",
        /// Lateral acceleration.
        Ay = "ay",
    }
}

impl Output {
    /// Signal that measures it.
    #[must_use]
    pub fn signal(self) -> &'static str {
        match self {
            Output::Alpha => signal::ALPHA_VANE,
            Output::Q => signal::Q,
            Output::Theta => signal::THETA,
            Output::An => signal::AN,
            Output::Ax => signal::AX,
            Output::Beta => signal::BETA_VANE,
            Output::P => signal::P,
            Output::R => signal::R,
            Output::Phi => signal::PHI,
            Output::Ay => signal::AY,
        }
    }

    /// `true` for a measured state. Without one its axis is not estimated; an acceleration that is
    /// not recorded is only left out of the likelihood.
    #[must_use]
    pub fn is_state(self) -> bool {
        !matches!(self, Output::An | Output::Ax | Output::Ay)
    }

    /// `true` for an attitude, the integral of the rates.
    #[must_use]
    pub fn is_attitude(self) -> bool {
        matches!(self, Output::Theta | Output::Phi)
    }

    #[must_use]
    pub fn axis(self) -> Axis {
        if Axis::Longitudinal.outputs().contains(&self) {
            Axis::Longitudinal
        } else {
            Axis::Lateral
        }
    }
}

/// One term of the build-up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Derivative {
    pub name: String,
    pub coefficient: Coefficient,
    pub regressor: Regressor,
}

impl Derivative {
    /// Factor from a derivative times its regressor to the coefficient, at a dynamic pressure in
    /// lbf/ft²: 1 for a derivative of a coefficient. A vane's derivative is a force or moment, so
    /// its factor is 1/(q̄S) or 1/(q̄S × reference length).
    #[must_use]
    pub fn coefficient_factor(&self, aircraft: &Aircraft, qbar: f64) -> f64 {
        if !matches!(self.regressor, Regressor::Vane(_)) {
            return 1.0;
        }
        1.0 / (qbar * aircraft.wing_area_ft2 * self.coefficient.reference_length(aircraft))
    }

    #[must_use]
    pub fn unit(&self) -> DerivativeUnit {
        match self.regressor {
            Regressor::Vane(_) if self.coefficient.is_moment() => DerivativeUnit::FtLbfPerDeg,
            Regressor::Vane(_) => DerivativeUnit::LbfPerDeg,
            // The model file has no regressor without a unit.
            _ => self.regressor.unit().unwrap_or(DerivativeUnit::Number),
        }
    }
}
