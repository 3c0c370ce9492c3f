//! The instruments that are looked at, and what can be wrong with each: y(t) = (1 + scale) x(t −
//! delay) + bias.
//!
//! Rate gyros and accelerometers drive the kinematic equations (inputs); vanes, airspeed,
//! attitudes, altitude and the pressures are compared with what the equations make of them
//! (outputs).

use super::settings::{Compatibility, Error, Errors};
use crate::flight::signal as s;

pub const INPUTS: usize = 6;
pub const OUTPUTS: usize = 9;
pub const INSTRUMENTS: usize = INPUTS + OUTPUTS;
/// Bias, scale and delay of each.
pub const KINDS: usize = 3;
pub const PARAMETERS: usize = INSTRUMENTS * KINDS;

/// What can be wrong with an instrument.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Bias,
    Scale,
    Delay,
}

pub const ALL_KINDS: [Kind; KINDS] = [Kind::Bias, Kind::Scale, Kind::Delay];

/// The signals, inputs first: p, q, r, then the accelerometers forward, right, up.
pub const SIGNALS: [&str; INSTRUMENTS] = [
    s::P,
    s::Q,
    s::R,
    s::AX,
    s::AY,
    s::AN,
    s::ALPHA_VANE,
    s::BETA_VANE,
    s::VELOCITY,
    s::THETA,
    s::PHI,
    s::PSI,
    s::ALTITUDE,
    s::QBAR,
    s::MACH,
];

/// The place of a parameter among all.
pub fn place(instrument: usize, kind: Kind) -> usize {
    instrument * KINDS + kind as usize
}

/// What the settings say of an instrument's kind.
pub fn error_of(errors: &Errors, instrument: usize) -> Error {
    match SIGNALS[instrument] {
        s::P | s::Q | s::R => errors.rate_deg_s,
        s::AX | s::AY | s::AN => errors.accelerometer_g,
        s::ALPHA_VANE | s::BETA_VANE => errors.vane_deg,
        s::VELOCITY => errors.velocity_ft_s,
        s::ALTITUDE => errors.altitude_ft,
        s::QBAR => errors.qbar_psf,
        s::MACH => errors.mach,
        _ => errors.attitude_deg,
    }
}

/// The size of a parameter that the settings give it.
pub fn size(errors: &Errors, instrument: usize, kind: Kind) -> f64 {
    let error = error_of(errors, instrument);
    match kind {
        Kind::Bias => error.bias,
        Kind::Scale => error.scale,
        Kind::Delay => errors.delay_s,
    }
}

/// Whether the kinematic equations say anything of a parameter at all: they know changes of
/// altitude and heading only, and the heading's scale is that of a full turn.
pub fn observable(instrument: usize, kind: Kind) -> bool {
    !matches!(
        (SIGNALS[instrument], kind),
        (s::PSI, Kind::Bias | Kind::Scale) | (s::ALTITUDE, Kind::Bias)
    )
}

/// Number of standard errors from which an error counts as a fault. A channel ahead of the others
/// needs twice as many: instruments and recorders delay, so all others would have to be late alike.
pub fn fault_standard_errors(settings: &Compatibility, kind: Kind, value: f64) -> f64 {
    let is_ahead = kind == Kind::Delay && value < 0.0;
    if is_ahead {
        2.0 * settings.fault_standard_errors
    } else {
        settings.fault_standard_errors
    }
}
