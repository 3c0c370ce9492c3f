//! Model of a maneuver: which derivatives, biases and initial states are estimated, and which are held.

use crate::aero::{Bias, Derivative};
use crate::dynamics::Equations;

/// Source of the initial states: estimated with the derivatives, or taken from the record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InitialState {
    #[default]
    Estimated,
    Measured,
}

/// Free and held parameters of a maneuver.
#[derive(Clone, Debug, Default)]
pub struct Model<'a> {
    pub free: Vec<&'a Derivative>,
    pub held: Vec<(&'a Derivative, f64)>,
    pub biases: Vec<&'a Bias>,
    pub initial_state: InitialState,
}

impl<'a> Model<'a> {
    /// Free derivatives in the order of the parameters: by coefficient.
    #[must_use]
    pub fn free_in_order(&self) -> Vec<&'a Derivative> {
        let mut free = self.free.clone();
        free.sort_by_key(|d| d.coefficient.index());
        free
    }

    /// Names of the parameters in order.
    pub(crate) fn parameter_names(&self, states: &[&str]) -> Vec<String> {
        let free = self.free_in_order();
        let mut names: Vec<String> = free.iter().map(|d| d.name.clone()).collect();
        names.extend(self.biases.iter().map(|b| b.name.clone()));
        if self.initial_state == InitialState::Estimated {
            names.extend(states.iter().map(|s| format!("initial {s}")));
        }
        names
    }

    /// Outputs that the biases shift.
    pub(crate) fn biased_outputs<const NX: usize, E: Equations<NX>>(&self) -> Vec<usize> {
        let outputs = E::AXIS.outputs();
        let place = |bias: &&Bias| outputs.iter().position(|o| *o == bias.output);
        self.biases.iter().filter_map(place).collect()
    }
}
