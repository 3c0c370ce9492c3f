//! Error parameters of the instruments: y(t) = (1 + scale) x(t − delay) + bias.
//!
//! Rate gyros and accelerometers drive the kinematic equations (inputs). Vanes, airspeed,
//! attitudes, altitude and the pressures are compared with the reconstructed ones (outputs).

use crate::flight::signal as s;
use crate::units::{DEG, G0_FT_S2};

/// Places of the inputs: body rates, then specific forces forward, right, down.
pub mod input {
    pub const P: usize = 0;
    pub const Q: usize = 1;
    pub const R: usize = 2;
    pub const FORWARD: usize = 3;
    pub const RIGHT: usize = 4;
    pub const DOWN: usize = 5;
}

/// Places of the outputs.
pub mod output {
    pub const ALPHA: usize = 0;
    pub const BETA: usize = 1;
    pub const AIRSPEED: usize = 2;
    pub const THETA: usize = 3;
    pub const PHI: usize = 4;
    pub const PSI: usize = 5;
    pub const ALTITUDE: usize = 6;
    pub const QBAR: usize = 7;
    pub const MACH: usize = 8;
}

pub const INPUTS: usize = 6;
pub const OUTPUTS: usize = 9;
pub const INSTRUMENTS: usize = INPUTS + OUTPUTS;
/// Number of error parameters of an instrument.
pub const KINDS: usize = 3;
pub const PARAMETERS: usize = INSTRUMENTS * KINDS;

/// Kind of an instrument's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Bias,
    Scale,
    Delay,
}

/// A value for each parameter.
pub type Parameters = [f64; PARAMETERS];

pub const ALL_KINDS: [Kind; KINDS] = [Kind::Bias, Kind::Scale, Kind::Delay];

/// Signals of the instruments, inputs first: p, q, r, then the accelerometers forward, right, up.
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

/// Outputs that depend on the velocity in the plane of symmetry: β on its size, and on its parts by roll
/// and yaw.
const OF_VELOCITY: &[&str] = &[
    s::ALPHA_VANE,
    s::BETA_VANE,
    s::ALTITUDE,
    s::VELOCITY,
    s::QBAR,
    s::MACH,
];

/// Outputs that depend on the motion along each input. Without the input their equations lack a
/// term, and they are not compared. Forward and downward velocity turn into each other with the pitch
/// rate, so each needs both accelerations and the pitch attitude.
const DECIDED_BY: [(&str, &[&[&str]]); INPUTS] = [
    (s::P, &[&[s::PHI]]),
    (s::Q, &[&[s::THETA], OF_VELOCITY]),
    (s::R, &[&[s::PSI, s::BETA_VANE]]),
    (s::AX, &[OF_VELOCITY]),
    (s::AY, &[&[s::BETA_VANE]]),
    (s::AN, &[OF_VELOCITY]),
];

/// `true` for an output that depends on an input that is not recorded.
pub fn lacks_input(output: usize, is_recorded: impl Fn(&str) -> bool) -> bool {
    let mut lacking = DECIDED_BY.iter().filter(|(input, _)| !is_recorded(input));
    let signal = &SIGNALS[INPUTS + output];
    lacking.any(|(_, decided)| decided.iter().any(|signals| signals.contains(signal)))
}

/// Index of a parameter among all.
pub fn place(instrument: usize, kind: Kind) -> usize {
    instrument * KINDS + kind as usize
}

/// `true` if the kinematic equations determine a parameter. They contain changes of altitude and
/// heading only, and the heading's scale is that of a full turn.
pub fn is_observable(instrument: usize, kind: Kind) -> bool {
    !matches!(
        (SIGNALS[instrument], kind),
        (s::PSI, Kind::Bias | Kind::Scale) | (s::ALTITUDE, Kind::Bias)
    )
}

/// Factor from an input's unit to rad/s or ft/s², in the sense of the equations (down positive).
pub fn input_factor(input: usize) -> f64 {
    match SIGNALS[input] {
        s::AX | s::AY => G0_FT_S2,
        s::AN => -G0_FT_S2,
        _ => 1.0 / DEG,
    }
}
