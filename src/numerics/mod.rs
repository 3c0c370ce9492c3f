//! Numerical methods that several rooms share.

pub(crate) mod matrix;
pub(crate) mod row_products;
pub mod runge_kutta;
pub(crate) mod simd;
pub mod symmetric;
pub mod trig;
