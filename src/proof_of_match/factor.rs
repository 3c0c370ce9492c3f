//! Factors of the derivatives in a build-up, and the flow that they follow.
#![expect(
    clippy::inline_always,
    reason = "compiled into the loop over all factors"
)]

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
    #[inline(always)]
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
            Factor::Magnitude(of) => of.inner_value(flow, recorded).abs(),
            Factor::Product(both) => {
                let [a, b] = both.as_ref();
                a.inner_value(flow, recorded) * b.inner_value(flow, recorded)
            }
        }
    }

    /// Value of a factor within another one. [`Factor::value`] is inlined, as it does not call itself.
    fn inner_value(&self, flow: &AeroInputs, recorded: &[f64]) -> f64 {
        self.value(flow, recorded)
    }

    /// Hands each slope along a quantity of the flow, times a multiple, to `take`; recorded signals have
    /// none.
    pub fn slopes(
        &self,
        (flow, recorded): (&AeroInputs, &[f64]),
        multiple: f64,
        take: &mut impl FnMut(usize, f64),
    ) {
        let at = (flow, recorded);
        let along = match self {
            Factor::Constant | Factor::Recorded(_) => return,
            Factor::Alpha => (AeroInputs::ALPHA, 1.0),
            Factor::Beta => (AeroInputs::BETA, 1.0),
            Factor::Velocity => (AeroInputs::VELOCITY, 1.0),
            Factor::Mach => (AeroInputs::MACH, 1.0),
            Factor::Rate { axis, half_length } => {
                let value = self.value(flow, recorded);
                take(AeroInputs::VELOCITY, -multiple * value / flow.velocity);
                (AeroInputs::RATES + axis, half_length / flow.velocity)
            }
            Factor::AlphaRate { half_length } => {
                let value = self.value(flow, recorded);
                take(AeroInputs::VELOCITY, -multiple * value / flow.velocity);
                (AeroInputs::ALPHA_RATE, half_length / flow.velocity)
            }
            Factor::Vane { .. } => (AeroInputs::QBAR, -self.value(flow, recorded) / flow.qbar),
            Factor::Magnitude(of) => {
                let sign = of.value(flow, recorded).signum();
                return of.slopes(at, sign * multiple, take);
            }
            Factor::Product(both) => {
                let [a, b] = both.as_ref();
                a.slopes(at, b.value(flow, recorded) * multiple, take);
                return b.slopes(at, a.value(flow, recorded) * multiple, take);
            }
        };
        take(along.0, multiple * along.1);
    }
}
