//! Equations of motion (2.1-2.3, 3.1-3.4) and of the sensors (2.7-2.9, 3.7, 3.8) with their exact
//! slopes.
//!
//! Each axis integrates its own states and takes everything else as measured. The estimation uses
//! an axis through [`Equations`]: rates of the states, and outputs, as functions of the states x
//! and the axis's three coefficients c. Both have exact slopes along x and c. The build-up of c
//! from x and the derivatives belongs to the method.
//!
//! Units inside: rad, rad/s, ft, slug, lbf, s. Outputs are in the units of the signals: deg, deg/s,
//! g.

mod equations;
mod gusts;
mod lateral;
mod lever;
mod longitudinal;
pub mod motion;

pub use equations::{COEFFICIENTS, Equations, OUTPUTS, Outputs, Rates};
pub use gusts::{InGusts, LateralInGusts, LongitudinalInGusts};
pub use lateral::Lateral;
pub(crate) use lever::lever;
pub use longitudinal::Longitudinal;
pub use motion::Motion;

#[cfg(test)]
pub(crate) mod tests;
