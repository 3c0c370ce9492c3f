//! Aerodynamic model as data: the build-up of the coefficients from derivatives (eqs. 2.10-2.12,
//! 3.9-3.11), and the wind-tunnel database. Derivatives start at the database's values, are held at
//! them, and are compared with them.

pub mod aero_model;
pub mod derivative;
mod derivative_unit;
pub mod interpolation;
mod regressor;
pub mod wind_tunnel;

pub use aero_model::{AeroModel, Bias, Combined};
pub use derivative::{Axis, Coefficient, Derivative, Output};
pub use derivative_unit::DerivativeUnit;
pub use interpolation::Interpolation;
pub use regressor::Regressor;
pub use wind_tunnel::{Condition, WindTunnel};
