//! The equations of motion (2.1-2.3, 3.1-3.4) and of the sensors (2.7-2.9, 3.7, 3.8) with their
//! exact slopes, and their integration with sensitivities.
//!
//! Each axis integrates its own states and takes everything else as measured. What the estimation
//! needs of an axis is [`Equations`]: the rates of the states and the outputs as functions of the
//! states x and the axis's three coefficients c, with the slopes along both. How c follows from x
//! and the derivatives is the build-up's business.
//!
//! Units inside: rad, rad/s, ft, slug, lbf, s. Outputs are in the units of the signals: deg, deg/s,
//! g.

mod lateral;
mod lever;
mod longitudinal;
pub mod motion;

pub use lateral::Lateral;
pub(crate) use lever::lever;
pub use longitudinal::Longitudinal;
pub use motion::Motion;

use nalgebra::{SMatrix, SVector};

use crate::aero::{Axis, Regressor};
use crate::aircraft::Aircraft;

/// Number of outputs that are matched in each axis, and of coefficients that act in it.
pub const OUTPUTS: usize = 5;
pub const COEFFICIENTS: usize = 3;

/// Rates of the states, 1/s, and their slopes along states and coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates<const NX: usize> {
    pub rates: SVector<f64, NX>,
    pub by_state: SMatrix<f64, NX, NX>,
    pub by_coefficient: SMatrix<f64, NX, COEFFICIENTS>,
}

/// Outputs as the sensors read them (deg, deg/s, g), and their slopes along states and
/// coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs<const NX: usize> {
    pub outputs: SVector<f64, OUTPUTS>,
    pub by_state: SMatrix<f64, OUTPUTS, NX>,
    pub by_coefficient: SMatrix<f64, OUTPUTS, COEFFICIENTS>,
}

/// The equations of one axis with `NX` states.
pub trait Equations<const NX: usize> {
    /// What the rates need to know at one instant, prepared for the inner loop.
    type Known: Clone + std::fmt::Debug + Send + Sync;
    /// What the outputs need to know besides.
    type Sensed: Clone + std::fmt::Debug + Send + Sync;

    const AXIS: Axis;
    /// Names of the states with the unit in which they are reported, deg.
    const STATES: [&'static str; NX];

    /// The states that regressors can be proportional to.
    const FOLLOWED: &'static [usize];
    /// Where the slopes of the rates along states can be other than zero, also through
    /// coefficients: (rate, state).
    const RATES_BY_STATE: &'static [(usize, usize)];
    /// Where those along coefficients can be: (rate, coefficient).
    const RATES_BY_COEFFICIENT: &'static [(usize, usize)];
    /// The same of the outputs: (output, state) and (output, coefficient).
    const OUTPUTS_BY_STATE: &'static [(usize, usize)];
    const OUTPUTS_BY_COEFFICIENT: &'static [(usize, usize)];

    /// Prepares what is known at one instant.
    fn known(aircraft: &Aircraft, motion: &Motion) -> Self::Known;

    /// Prepares what is known besides at one sample.
    fn sensed(aircraft: &Aircraft, motion: &Motion) -> Self::Sensed;

    /// The state as measured, from which an integration may start.
    fn measured_state(motion: &Motion) -> SVector<f64, NX>;

    /// The state that a regressor is proportional to, or none when it is not a state of this axis.
    fn state_of(regressor: &Regressor) -> Option<usize>;

    /// That state and the factor of proportion at a velocity, ft/s.
    fn state_regressor(
        aircraft: &Aircraft,
        velocity: f64,
        regressor: &Regressor,
    ) -> Option<(usize, f64)>;

    /// The coefficients that the measured motion implies: its accelerations put into the equations.
    fn coefficients(
        aircraft: &Aircraft,
        motion: &Motion,
        known: &Self::Known,
    ) -> [f64; COEFFICIENTS];

    fn rates(known: &Self::Known, x: &SVector<f64, NX>, c: &[f64; COEFFICIENTS]) -> Rates<NX>;

    fn outputs(
        known: &Self::Known,
        sensed: &Self::Sensed,
        x: &SVector<f64, NX>,
        c: &[f64; COEFFICIENTS],
    ) -> Outputs<NX>;
}

#[cfg(test)]
pub(crate) mod tests;
