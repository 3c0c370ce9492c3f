//! Signals in the equations of motion. The analyst names surfaces and pilot controls.
//!
//! Signs, as in the paper and in every formula of the program:
//!
//! - rates and attitudes as usual in body axes;
//! - normal acceleration positive up, axial forward, lateral right;
//! - c.g. positions positive aft, right and above of the reference point.

/// The recorder's clock.
pub const TIME: &str = "time_s";
pub const ALPHA_VANE: &str = "alpha_vane_deg";
pub const BETA_VANE: &str = "beta_vane_deg";
pub const VELOCITY: &str = "velocity_ft_s";
pub const MACH: &str = "mach";
pub const ALTITUDE: &str = "altitude_ft";
pub const P: &str = "p_deg_s";
pub const Q: &str = "q_deg_s";
pub const R: &str = "r_deg_s";
pub const THETA: &str = "theta_deg";
pub const PHI: &str = "phi_deg";
/// True heading; optional. The checks of units and signs compare it with r, and flight-path
/// reconstruction uses it.
pub const PSI: &str = "psi_deg";
/// Static temperature of the air; optional. Without it the air has the temperature of the standard
/// atmosphere at its altitude.
pub const AIR_TEMPERATURE: &str = "air_kelvin";
pub const AN: &str = "an_g";
pub const AX: &str = "ax_g";
pub const AY: &str = "ay_g";
pub const QBAR: &str = "qbar_psf";
pub const THRUST: &str = "thrust_lbf";
/// Speeds of the left and the right engine; the gyroscopic moment needs their sum.
pub const RPM_LEFT: &str = "left_rpm";
pub const RPM_RIGHT: &str = "right_rpm";
pub const MASS: &str = "mass_slug";
pub const X_CG: &str = "x_cg_ft";
pub const Y_CG: &str = "y_cg_ft";
pub const Z_CG: &str = "z_cg_ft";
pub const IX: &str = "ix_slug_ft2";
pub const IY: &str = "iy_slug_ft2";
pub const IZ: &str = "iz_slug_ft2";
/// +∫ x z dm in body axes.
pub const IXZ: &str = "ixz_slug_ft2";

/// Signals that harvest uses where a recorder has them.
pub const OPTIONAL: [&str; 2] = [PSI, AIR_TEMPERATURE];

/// `true` for a signal of harvest's own, required or optional, other than time: no name of the
/// analyst's.
#[must_use]
pub fn is_own(signal: &str) -> bool {
    REQUIRED.contains(&signal) || OPTIONAL.contains(&signal)
}

/// Value of a flag, 0 or 1, above which it is up.
pub const FLAG_UP: f64 = 0.5;

/// Required signals that are greater than zero in flight.
pub const POSITIVE: &[&str] = &[VELOCITY, QBAR, MASS, IX, IY, IZ];

/// Required signals whose stand-in costs no derivative of either axis.
const REPLACEABLE: [&str; 5] = [MACH, ALTITUDE, THRUST, RPM_LEFT, RPM_RIGHT];

/// `true` for a signal whose fault refuses a flight. Any other faulty signal is left out, and a
/// stand-in replaces it at little cost.
#[must_use]
pub fn is_indispensable(signal: &str) -> bool {
    REQUIRED.contains(&signal) && !REPLACEABLE.contains(&signal)
}

/// Signals that the equations of motion need: each is a channel, a constant or a stand-in.
pub const REQUIRED: &[&str] = &[
    ALPHA_VANE, BETA_VANE, VELOCITY, MACH, ALTITUDE, P, Q, R, THETA, PHI, AN, AX, AY, QBAR, THRUST,
    RPM_LEFT, RPM_RIGHT, MASS, X_CG, Y_CG, Z_CG, IX, IY, IZ, IXZ,
];

/// Signals of the flow that regressors may be; a simulation computes them.
pub const OF_THE_FLOW: [&str; 2] = [VELOCITY, MACH];
