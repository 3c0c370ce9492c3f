//! Factors of the derivatives in a build-up, and the flow that they follow.

use crate::aero::{Coefficient, Regressor};
use crate::aircraft::Aircraft;
use crate::rigid_body::AirData;
use crate::units::DEG;

/// Inputs of the aerodynamics: flow at the c.g. and rotation, in deg, rad/s, ft/s, lbf/ft².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AeroInputs {
    pub alpha_deg: f64,
    pub beta_deg: f64,
    pub velocity: f64,
    pub mach: f64,
    pub rates: [f64; 3],
    pub alpha_rate: f64,
    pub qbar: f64,
}

impl AeroInputs {
    /// Inputs from the air data at the c.g., rates in rad/s.
    #[must_use]
    pub fn new(air: &AirData, rates: [f64; 3], alpha_rate: f64) -> AeroInputs {
        AeroInputs {
            alpha_deg: DEG * air.alpha,
            beta_deg: DEG * air.beta,
            velocity: air.velocity_ft_s,
            mach: air.mach,
            rates,
            alpha_rate,
            qbar: air.qbar_psf,
        }
    }

    /// Indices of the flow's quantities among the slopes.
    pub const ALPHA: usize = 0;
    pub const BETA: usize = 1;
    pub const VELOCITY: usize = 2;
    pub const MACH: usize = 3;
    pub const RATES: usize = 4;
    pub const ALPHA_RATE: usize = 7;
    pub const QBAR: usize = 8;
}

/// Number of the quantities of a flow, in their order, along which coefficients have slopes.
pub const FLOW: usize = 9;

/// Slopes along the quantities of a flow.
pub type FlowSlopes = [f64; FLOW];

/// Factor of a derivative, with the constants that it needs.
#[derive(Clone, Debug, PartialEq)]
pub enum Factor {
    Constant,
    Alpha,
    Beta,
    Velocity,
    Mach,
    /// Angular rate about an axis, times half a reference length over the airspeed.
    Rate {
        axis: usize,
        half_length: f64,
    },
    /// Rate of the angle of attack, times half a reference length over the airspeed.
    AlphaRate {
        half_length: f64,
    },
    /// Recorded signal with this index.
    Recorded(usize),
    /// Recorded deflection of a vane, over dynamic pressure times an area (force) or a volume
    /// (moment).
    Vane {
        place: usize,
        size: f64,
    },
    Magnitude(Box<Factor>),
    Product(Box<[Factor; 2]>),
}

/// Aircraft, recorded signals and coefficient from which factors follow.
pub struct Factors<'a> {
    pub aircraft: &'a Aircraft,
    pub recorded: &'a [&'a str],
    pub coefficient: Coefficient,
}

impl Factors<'_> {
    /// Factor of a derivative with this regressor.
    pub fn factor_of(&self, regressor: &Regressor) -> Factor {
        let rate = |axis: usize, length: f64| Factor::Rate {
            axis,
            half_length: 0.5 * length,
        };
        match regressor {
            Regressor::Constant => Factor::Constant,
            Regressor::Alpha => Factor::Alpha,
            Regressor::Beta => Factor::Beta,
            Regressor::RollRate => rate(0, self.aircraft.span_ft),
            Regressor::PitchRate => rate(1, self.aircraft.chord_ft),
            Regressor::YawRate => rate(2, self.aircraft.span_ft),
            Regressor::AlphaRate => Factor::AlphaRate {
                half_length: 0.5 * self.aircraft.chord_ft,
            },
            Regressor::Surface(_) if regressor.is_velocity() => Factor::Velocity,
            Regressor::Surface(_) if regressor.is_mach() => Factor::Mach,
            Regressor::Surface(name) => Factor::Recorded(self.signal_index(name)),
            Regressor::Vane(name) => Factor::Vane {
                place: self.signal_index(name),
                size: self.aircraft.wing_area_ft2
                    * self.coefficient.reference_length(self.aircraft),
            },
            Regressor::Magnitude(of) => Factor::Magnitude(Box::new(self.factor_of(of))),
            Regressor::Product(both) => Factor::Product(Box::new([
                self.factor_of(&both[0]),
                self.factor_of(&both[1]),
            ])),
        }
    }

    fn signal_index(&self, name: &str) -> usize {
        let place = self.recorded.iter().position(|own| *own == name);
        place.unwrap_or(usize::MAX)
    }
}

impl Factor {
    /// Value in a flow, with the recorded signals.
    #[inline]
    pub fn value(&self, flow: &AeroInputs, recorded: &[f64]) -> f64 {
        let at = |place: &usize| recorded.get(*place).copied().unwrap_or(0.0);
        match self {
            Factor::Constant => 1.0,
            Factor::Alpha => flow.alpha_deg,
            Factor::Beta => flow.beta_deg,
            Factor::Velocity => flow.velocity,
            Factor::Mach => flow.mach,
            Factor::Rate { axis, half_length } => flow.rates[*axis] * half_length / flow.velocity,
            Factor::AlphaRate { half_length } => flow.alpha_rate * half_length / flow.velocity,
            Factor::Recorded(place) => at(place),
            Factor::Vane { place, size } => at(place) / (flow.qbar * size),
            Factor::Magnitude(of) => of.value(flow, recorded).abs(),
            Factor::Product(both) => both[0].value(flow, recorded) * both[1].value(flow, recorded),
        }
    }

    /// `false` if the factor has only recorded signals, and thus no slope along the flow.
    pub fn follows_flow(&self) -> bool {
        match self {
            Factor::Constant | Factor::Recorded(_) => false,
            Factor::Magnitude(of) => of.follows_flow(),
            Factor::Product(both) => both.iter().any(Factor::follows_flow),
            _ => true,
        }
    }

    /// Slopes along the flow.
    pub fn slopes(&self, flow: &AeroInputs, recorded: &[f64]) -> FlowSlopes {
        let mut slopes = [0.0; FLOW];
        match self {
            Factor::Constant | Factor::Recorded(_) => {}
            Factor::Alpha => slopes[AeroInputs::ALPHA] = 1.0,
            Factor::Beta => slopes[AeroInputs::BETA] = 1.0,
            Factor::Velocity => slopes[AeroInputs::VELOCITY] = 1.0,
            Factor::Mach => slopes[AeroInputs::MACH] = 1.0,
            Factor::Rate { axis, half_length } => {
                slopes[AeroInputs::RATES + axis] = half_length / flow.velocity;
                slopes[AeroInputs::VELOCITY] = -self.value(flow, recorded) / flow.velocity;
            }
            Factor::AlphaRate { half_length } => {
                slopes[AeroInputs::ALPHA_RATE] = half_length / flow.velocity;
                slopes[AeroInputs::VELOCITY] = -self.value(flow, recorded) / flow.velocity;
            }
            Factor::Vane { .. } => {
                slopes[AeroInputs::QBAR] = -self.value(flow, recorded) / flow.qbar;
            }
            Factor::Magnitude(of) => {
                let sign = of.value(flow, recorded).signum();
                slopes = of.slopes(flow, recorded).map(|slope| sign * slope);
            }
            Factor::Product(both) => {
                let [a, b] = [&both[0], &both[1]];
                let values = [a.value(flow, recorded), b.value(flow, recorded)];
                let (by_a, by_b) = (a.slopes(flow, recorded), b.slopes(flow, recorded));
                slopes = std::array::from_fn(|i| by_a[i] * values[1] + values[0] * by_b[i]);
            }
        }
        slopes
    }
}
