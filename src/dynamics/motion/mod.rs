//! Measured motion: all inputs of an axis's equations, at the samples and halfway between them.
//!
//! A fourth-order Runge-Kutta step needs signals at its ends and its middle. Point 2k is sample k.
//! Point 2k+1 lies halfway to sample k+1, on a cubic through the neighbouring samples.

mod half_samples;
mod instant;
mod local_slope;
mod vane_inversion;
mod measured_motion;
mod maneuver_signals;

pub use instant::Motion;
pub use local_slope::slope_reach;
pub use maneuver_signals::{ManeuverSignals, MassProperties, slope_name};
pub use measured_motion::MeasuredMotion;
