//! Interface of the equations of one axis: rates, outputs and their slopes.

use nalgebra::{SMatrix, SVector};

use super::motion::Motion;
use crate::aero::{Axis, Regressor};
use crate::aircraft::Aircraft;

/// Number of outputs that are matched on each axis, and of its coefficients.
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

/// Equations of one axis with `NX` states.
pub trait Equations<const NX: usize> {
    /// Inputs of the state equations at one instant, prepared for the inner loop.
    type RateInputs: Clone + std::fmt::Debug + Send + Sync;
    /// Further inputs of the sensor equations at one sample.
    type SensorInputs: Clone + std::fmt::Debug + Send + Sync;

    const AXIS: Axis;
    /// Names of the states; they are reported in deg and deg/s.
    const STATES: [&'static str; NX];

    /// Signals of the measured motion on which neither rates nor outputs depend.
    const SIGNALS_NOT_READ: &'static [&'static str];

    /// States that regressors can be proportional to.
    const REGRESSOR_STATES: &'static [usize];
    /// Entries (rate, state) of the slopes that can differ from zero, also through coefficients.
    const RATES_BY_STATE: &'static [(usize, usize)];
    /// Entries (rate, coefficient) of the slopes that can differ from zero.
    const RATES_BY_COEFFICIENT: &'static [(usize, usize)];
    /// `true` at these entries: known to the compiler where a list would be read from memory.
    const HAS_SLOPE_BY_STATE: [[bool; NX]; NX] = marked(Self::RATES_BY_STATE);
    const HAS_SLOPE_BY_COEFFICIENT: [[bool; COEFFICIENTS]; NX] = marked(Self::RATES_BY_COEFFICIENT);
    /// Entries (output, state) and (output, coefficient) of the slopes that can differ from zero.
    const OUTPUTS_BY_STATE: &'static [(usize, usize)];
    const OUTPUTS_BY_COEFFICIENT: &'static [(usize, usize)];

    /// Prepares the inputs of the state equations.
    fn rate_inputs(aircraft: &Aircraft, motion: &Motion) -> Self::RateInputs;

    /// Prepares the further inputs of the sensor equations.
    fn sensor_inputs(aircraft: &Aircraft, motion: &Motion) -> Self::SensorInputs;

    /// State as measured, from which an integration may start.
    fn measured_state(motion: &Motion) -> SVector<f64, NX>;

    /// State that a regressor is proportional to; `None` if it is no state of this axis.
    fn state_of(regressor: &Regressor) -> Option<usize>;

    /// State that a regressor is proportional to, and the factor of proportion at a velocity, ft/s.
    fn state_regressor(
        aircraft: &Aircraft,
        velocity: f64,
        regressor: &Regressor,
    ) -> Option<(usize, f64)>;

    /// Coefficients that the measured motion implies: its accelerations inserted into the
    /// equations.
    fn implied_coefficients(
        aircraft: &Aircraft,
        motion: &Motion,
        inputs: &Self::RateInputs,
    ) -> [f64; COEFFICIENTS];

    fn rates(inputs: &Self::RateInputs, x: &SVector<f64, NX>, c: &[f64; COEFFICIENTS])
    -> Rates<NX>;

    fn outputs(
        inputs: &Self::RateInputs,
        sensors: &Self::SensorInputs,
        x: &SVector<f64, NX>,
        c: &[f64; COEFFICIENTS],
    ) -> Outputs<NX>;
}

/// Matrix that is `true` at the entries of a list, (row, column).
const fn marked<const ROWS: usize, const COLUMNS: usize>(
    entries: &[(usize, usize)],
) -> [[bool; COLUMNS]; ROWS] {
    let (mut marked, mut rest) = ([[false; COLUMNS]; ROWS], entries);
    while let [(row, column), others @ ..] = rest {
        marked[*row][*column] = true;
        rest = others;
    }
    marked
}
