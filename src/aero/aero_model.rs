//! Aerodynamic model: build-up of the six coefficients from derivatives, sensor biases estimated with
//! them, and sums that the wind tunnel tabulates instead of their parts.

use serde::{Deserialize, Serialize};

use super::derivative::{Axis, Derivative, Output};
use super::derivative_unit::DerivativeUnit;

/// A constant error of one measured output, estimated with the derivatives: `an_bias` in g,
/// `q_bias` in deg/s.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bias {
    pub name: String,
    pub output: Output,
}

impl Bias {
    #[must_use]
    pub fn unit(&self) -> DerivativeUnit {
        match self.output {
            Output::An | Output::Ax | Output::Ay => DerivativeUnit::G,
            Output::P | Output::Q | Output::R => DerivativeUnit::DegPerS,
            Output::Alpha | Output::Theta | Output::Beta | Output::Phi => DerivativeUnit::Deg,
        }
    }
}

/// A sum that the tunnel tabulates: `CN_ba = CN_0 + CN_alpha α` (eqs. 2.14, 2.15).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Combined {
    pub name: String,
    /// Derivative taken once.
    pub constant: String,
    /// Derivative taken times the maneuver's mean α in deg.
    pub slope: String,
}

/// Aerodynamic model of one aircraft, as in `model.yaml`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AeroModel {
    pub derivatives: Vec<Derivative>,
    pub biases: Vec<Bias>,
    pub combined: Vec<Combined>,
}

impl AeroModel {
    #[must_use]
    pub fn derivative(&self, name: &str) -> Option<&Derivative> {
        self.derivatives.iter().find(|d| d.name == name)
    }

    /// The derivatives of one axis, in the order of the model file.
    pub fn derivatives_of(&self, axis: Axis) -> impl Iterator<Item = &Derivative> {
        self.derivatives
            .iter()
            .filter(move |d| d.coefficient.axis() == axis)
    }

    /// Derivatives along the rate of the angle of attack.
    pub fn along_alpha_rate(&self) -> impl Iterator<Item = &Derivative> {
        let derivatives = self.derivatives.iter();
        derivatives.filter(|d| d.regressor.has_alpha_rate())
    }

    /// Sentence on what a derivative along `alpha_dot` can mean; `None` without one.
    #[must_use]
    pub fn lag_warning(&self) -> Option<String> {
        let names: Vec<&str> = self.along_alpha_rate().map(|d| d.name.as_str()).collect();
        (!names.is_empty()).then(|| {
            format!(
                "{}: a constant along `alpha_dot` stands for a lag of the flow and is right for slow motion alone; flight shows the sum \
                 with the derivative along q, so what is held is as right as the tunnel",
                names.join(", ")
            )
        })
    }

    /// The biases of one axis's outputs, in the order of the model file.
    pub fn biases_of(&self, axis: Axis) -> impl Iterator<Item = &Bias> {
        self.biases.iter().filter(move |b| b.output.axis() == axis)
    }

    /// The unit of a derivative, bias or combined sum.
    #[must_use]
    pub fn unit_of(&self, name: &str) -> Option<DerivativeUnit> {
        let combined = || {
            self.combined
                .iter()
                .find(|c| c.name == name)
                .map(|_| DerivativeUnit::Number)
        };
        let bias = || self.biases.iter().find(|b| b.name == name).map(Bias::unit);
        self.derivative(name)
            .map(Derivative::unit)
            .or_else(bias)
            .or_else(combined)
    }
}
