//! The likelihood of the measured outputs. It has the cost (1.2) with its gradients ([`cost`]), the
//! iteration to the minimum ([`newton_raphson`], 1.3), start values ([`equation_error`]), and
//! several maneuvers as one ([`joint`]).

pub mod cost;
pub mod definition;
pub mod equation_error;
pub mod error_effect;
pub(crate) mod information;
pub mod joint;
pub mod mean;
pub mod newton_raphson;
pub mod outcome;
pub mod sharing;
pub mod theil;
mod whittle;
