//! Sizes of instrument errors: those of healthy instruments, and those from which an instrument is
//! faulty.

use serde::Serialize;

use super::parameters::{ALL_KINDS, INSTRUMENTS, KINDS, Kind, SIGNALS};
use crate::flight::signal as s;

/// Sizes of the errors of one instrument.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorSize {
    /// In the signal's unit.
    pub bias: f64,
    /// Relative.
    pub scale: f64,
    /// Against the other channels, s.
    pub delay_s: f64,
}

/// Sizes of the errors of all instruments.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorSizes([ErrorSize; INSTRUMENTS]);

impl ErrorSizes {
    /// Standard deviations of the errors of healthy instruments, as flight-test instrumentation
    /// usually has them.
    pub(super) fn ordinary() -> ErrorSizes {
        ErrorSizes(SIGNALS.map(|signal| {
            let (bias, scale) = match signal {
                s::P | s::Q | s::R => (0.1, 0.005),
                s::AX | s::AY | s::AN => (0.01, 0.003),
                s::ALPHA_VANE | s::BETA_VANE => (0.3, 0.02),
                s::VELOCITY => (3.0, 0.01),
                s::ALTITUDE => (100.0, 0.01),
                s::QBAR => (1.0, 0.03),
                s::MACH => (0.005, 0.02),
                _ => (0.2, 0.005),
            };
            let delay_s = 0.01;
            ErrorSize {
                bias,
                scale,
                delay_s,
            }
        }))
    }

    /// Sizes from which an error is a fault: several times the ordinary ones.
    pub(super) fn faulty() -> ErrorSizes {
        ErrorSizes(SIGNALS.map(|signal| {
            let (bias, scale) = match signal {
                s::P | s::Q | s::R => (0.5, 0.05),
                s::AX | s::AY | s::AN => (0.05, 0.05),
                s::ALPHA_VANE | s::BETA_VANE => (2.0, 0.1),
                s::VELOCITY => (20.0, 0.05),
                s::ALTITUDE => (1000.0, 0.05),
                s::QBAR => (10.0, 0.15),
                s::MACH => (0.05, 0.1),
                _ => (1.0, 0.05),
            };
            let delay_s = 0.03;
            ErrorSize {
                bias,
                scale,
                delay_s,
            }
        }))
    }

    /// Size of one error of an instrument.
    pub(super) fn of(&self, instrument: usize, kind: Kind) -> f64 {
        let size = &self.0[instrument];
        match kind {
            Kind::Bias => size.bias,
            Kind::Scale => size.scale,
            Kind::Delay => size.delay_s,
        }
    }

    /// Size of a parameter.
    pub(super) fn of_parameter(&self, parameter: usize) -> f64 {
        self.of(parameter / KINDS, ALL_KINDS[parameter % KINDS])
    }

    /// Sizes of the instrument of a signal; `None` for a signal that no kinematic equation has.
    pub fn of_signal(&mut self, signal: &str) -> Option<&mut ErrorSize> {
        let instrument = SIGNALS.iter().position(|s| *s == signal)?;
        self.0.get_mut(instrument)
    }
}
