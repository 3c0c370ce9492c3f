//! The kernel: one pass over a maneuver.

pub(crate) mod chunk;
pub(crate) mod normal_equations;
pub(crate) mod pass;
pub(crate) mod propagators;
pub(crate) mod response;
pub(crate) mod trajectory;
