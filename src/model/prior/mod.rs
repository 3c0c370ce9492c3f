//! Prior of the differences between flight and tunnel: its grid, size, length and terms.

pub mod grid;
pub mod scale_prior;
pub mod prior_covariance;
pub mod derivative_prior;
pub mod term;
pub mod angle_noise;
