//! The aerodynamic model as data: which derivatives make up which coefficient (eqs. 2.10-2.12,
//! 3.9-3.11), and the wind-tunnel database they start from, are held at, and are compared with.

pub mod buildup;
pub mod derivative;
pub mod interpolation;
pub mod wind_tunnel;

pub use buildup::{Bias, Buildup, Combined};
pub use derivative::{Axis, Coefficient, Derivative, DerivativeUnit, Output, Regressor};
pub use interpolation::Interpolation;
pub use wind_tunnel::{Condition, WindTunnel};
