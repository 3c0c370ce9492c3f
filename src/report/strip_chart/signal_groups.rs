//! Signals that the analyst named, by their use.

use std::collections::BTreeMap;

/// Names of surfaces, pilot controls and flags.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SignalGroups {
    pub surfaces: Vec<String>,
    /// Controls of the pilot.
    pub controls: Vec<String>,
    pub flags: Vec<String>,
    /// Smallest change that counts as a step, in the signal's unit, where one is set.
    pub steps: BTreeMap<String, f64>,
}
