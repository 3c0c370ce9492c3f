//! Bounds of the estimates (1.6, 1.7), corrected for coloured residuals ([`coloured`]), noise of the
//! measured surfaces, errors of calibration ([`calibration_errors`]) and of held values
//! ([`consider`]).

mod autoregression;
pub(crate) mod block_series;
pub mod bounded;
pub mod calibration_errors;
pub mod coloured;
pub mod consider;
pub mod cramer_rao;
mod degrees_of_freedom;
mod input_noise;
mod residual_means;
