//! The bounds of the estimates.

mod autoregression;
pub mod calibration_errors;
pub mod coloured;
pub mod consider;
pub mod cramer_rao;
pub mod data;
pub mod freedom;
mod input_noise;
