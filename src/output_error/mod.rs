//! Output error: maximum likelihood by matching the outputs of the integrated equations to the measured ones (eqs. 1.1-1.7).
//!
//! A [`Case`] is one maneuver made ready: what is known, what is held, what is free. [`newton_raphson::estimate`] finds the
//! free parameters; [`cramer_rao`] says how well the data determine them.

mod autoregression;
mod case;
pub mod coloured;
pub mod cost;
pub mod cramer_rao;
pub mod equation_error;
mod gradient_noise;
pub mod holding;
pub mod identifiability;
pub mod newton_raphson;
mod outcome;
mod response;

pub use case::{Case, InitialState, Measurements, Model};
pub use outcome::{Fit, Outcome};
pub use response::{Diverged, Response};

#[cfg(test)]
pub(crate) mod tests;
