//! How well the data separate the parameters, and the parameters to hold.

pub mod collinearity;
pub mod holding;

pub use collinearity::{Collinearity, Group, Limits, collinearity, correlation, excitation};
