//! The instruments that are looked at, and what can be wrong with each: y(t) = (1 + scale) x(t −
//! delay) + bias.
//!
//! Rate gyros and accelerometers drive the kinematic equations (inputs); vanes, airspeed,
//! attitudes, altitude and the pressures are compared with what the equations make of them
//! (outputs).

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

/// Whether the kinematic equations say anything of a parameter at all: they know changes of
/// altitude and heading only, and the heading's scale is that of a full turn.
pub fn observable(instrument: usize, kind: Kind) -> bool {
    !matches!(
        (SIGNALS[instrument], kind),
        (s::PSI, Kind::Bias | Kind::Scale) | (s::ALTITUDE, Kind::Bias)
    )
}
