//! Gravity and the standard atmosphere.

mod atmosphere;
mod gravity;

pub use atmosphere::{Air, air, air_gradients};
pub use gravity::{gravity_at, gravity_ft_s2};
