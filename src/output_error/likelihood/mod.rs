//! The likelihood of the measured outputs, and the iteration to its maximum.

pub mod cost;
pub mod data;
pub mod equation_error;
pub(crate) mod information;
pub mod joint;
pub mod mean;
pub mod newton_raphson;
pub mod outcome;
pub mod theil;
