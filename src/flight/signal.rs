//! The signals that the equations of motion name. Surfaces and pilot controls have whatever names
//! the analyst gives them.
//!
//! Signs (the paper's, and design of every formula here): rates and attitudes as usual in body
//! axes, normal acceleration positive up, axial forward, lateral right; c.g. positions positive
//! aft, right and above of the reference point.

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
/// True heading; only checked against r, and only where recorded.
pub const PSI: &str = "psi_deg";
pub const AN: &str = "an_g";
pub const AX: &str = "ax_g";
pub const AY: &str = "ay_g";
pub const QBAR: &str = "qbar_psf";
pub const THRUST: &str = "thrust_lbf";
/// Sum of the engines' speeds is what the gyroscopic moment needs: one signal per engine, left and
/// right.
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

/// Every signal without which the equations cannot be written down: each must be a channel or a
/// constant.
pub const REQUIRED: &[&str] = &[
    ALPHA_VANE, BETA_VANE, VELOCITY, MACH, ALTITUDE, P, Q, R, THETA, PHI, AN, AX, AY, QBAR, THRUST,
    RPM_LEFT, RPM_RIGHT, MASS, X_CG, Y_CG, Z_CG, IX, IY, IZ, IXZ,
];
