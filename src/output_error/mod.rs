//! Output error: maximum likelihood by matching the outputs of the integrated equations to the
//! measured ones (eqs. 1.1-1.7).
//!
//! A [`Case`] is one maneuver made ready: what is known, what is held, what is free; a [`Joint`] is
//! several that share their derivatives. Both are [`Likelihood`]: [`newton_raphson::estimate`]
//! finds the free parameters of either, [`cramer_rao`] says how well the data determine them.
//! [`theil`] says how well a response predicts what was measured.

mod autoregression;
pub mod calibration;
mod case;
pub mod coloured;
pub mod cost;
mod course;
pub mod cramer_rao;
pub mod equation_error;
pub mod freedom;
mod likelihood;
pub mod holding;
pub mod identifiability;
pub mod input_noise;
mod joint;
mod kernel;
mod lanes;
pub mod mean;
pub mod newton_raphson;
mod normal;
mod outcome;
mod padded;
mod propagators;
mod response;
pub mod theil;

pub use case::{Case, InitialState, Measurements, Model};
pub use joint::Joint;
pub(crate) use kernel::{load, store};
pub(crate) use lanes::{Aligned, VECTOR};
pub use likelihood::Likelihood;
pub(crate) use normal::Rows;
pub use outcome::{Fit, Outcome};
pub use response::{Detail, Diverged, Response, Sensitivities};

#[cfg(test)]
pub(crate) mod tests;
