//! Result of a test card: exact record, maneuver and true derivatives.

use super::instruments::Instruments;
use crate::flight::Record;
use crate::maneuver::Maneuver;

/// True value of a derivative in a maneuver.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueDerivative {
    pub derivative: String,
    pub unit: &'static str,
    pub value: f64,
}

/// A simulated maneuver.
#[derive(Clone, Debug, PartialEq)]
pub struct FlownManeuver {
    /// Record of perfect instruments at their positions.
    pub record: Record,
    pub maneuver: Maneuver,
    /// Derivatives at the card's α and Mach number; if the tables vary in the maneuver, at its
    /// means.
    pub truth: Vec<TrueDerivative>,
}

impl FlownManeuver {
    /// Record of real instruments, without integrating the motion again.
    #[must_use]
    pub fn recorded(&self, instruments: &Instruments, seed: u64) -> Record {
        instruments.record(&self.record, seed)
    }
}
