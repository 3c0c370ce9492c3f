//! A maneuver class: its recognition in a record, the status of each derivative, and the weights.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::aero::{Axis, Output};
use crate::schema::words;

words! {
    /// Status of a derivative or bias in the estimation of a maneuver (Tables 1 and 3).
    pub enum Status {
        /// Free (✓).
        Estimated = "estimated",
        /// Held at the wind tunnel's value (W/T).
        Held = "held",
        /// The class does not use its surface (N/A).
        Inactive = "inactive",
    }
}

/// Number of fast steps of one signal in a maneuver of the class. A signal that may step as often
/// as a doublet but has no smallest number of steps is an input only where it is excited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepCount {
    #[serde(default)]
    pub at_least: usize,
    #[serde(default = "any_number")]
    pub at_most: usize,
}

fn any_number() -> usize {
    usize::MAX
}

/// Pulses of one signal to one side and the other, whose lengths stand in a proportion: 3-2-1-1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pulses {
    /// The length of each pulse, in units.
    pub widths: Vec<f64>,
    /// The shortest and the longest unit, s. Default: any.
    #[serde(default = "any_unit")]
    pub unit_s: (f64, f64),
    /// Largest difference of a pulse from its length, in units. Default 0.5: a pulse is nearer to its
    /// own number of units than to the next.
    #[serde(default = "half_a_unit")]
    pub tolerance: f64,
}

fn any_unit() -> (f64, f64) {
    (0.0, f64::INFINITY)
}
fn half_a_unit() -> f64 {
    0.5
}

/// An oscillation of one signal whose frequency rises: a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// The fewest swings from one side to the other.
    pub at_least: usize,
    /// Least ratio of the frequency in the last third of the swings to that in the first third.
    /// Default 2.
    #[serde(default = "an_octave")]
    pub ratio: f64,
}

fn an_octave() -> f64 {
    2.0
}

/// Recognition of a class. All conditions on its inputs must hold. Flags are evidence only: they may
/// be missing, stuck or late.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recognition {
    /// Flag signal → true if it is up for most of the maneuver. Flags raise or lower the
    /// confidence. They decide only between classes that differ in nothing else that is recorded.
    #[serde(default)]
    pub flags: BTreeMap<String, bool>,
    /// Signal → number of its steps. A signal without an entry may step any number of times.
    #[serde(default)]
    pub steps: BTreeMap<String, StepCount>,
    /// Signal → `true` if it moves during a maneuver of the class, `false` if it rests (a
    /// thrust-vectoring vane). A signal that is not recorded neither excludes nor confirms the class.
    #[serde(default)]
    pub moves: BTreeMap<String, bool>,
    /// Signal → its pulses.
    #[serde(default)]
    pub pulses: BTreeMap<String, Pulses>,
    /// Signal → its sweep.
    #[serde(default)]
    pub sweep: BTreeMap<String, Sweep>,
    /// Surfaces whose derivatives the class estimates. In a record without the pilot's controls their
    /// steps stand for the controls'. The configuration fills them in.
    #[serde(skip_deserializing)]
    pub surfaces: Vec<String>,
    /// Time from the maneuver's start to the first input, s: trimmed flight.
    pub lead_in_s: f64,
    /// Time from the last input to the maneuver's end, s: the response's decay.
    pub decay_s: f64,
}

impl Recognition {
    /// The signals that make the maneuver: those that must step, pulse or sweep.
    #[must_use]
    pub fn inputs(&self) -> BTreeSet<&str> {
        let stepping = self
            .steps
            .iter()
            .filter(|(_, count)| count.at_least > 0)
            .map(|(signal, _)| signal);
        stepping
            .chain(self.pulses.keys())
            .chain(self.sweep.keys())
            .map(String::as_str)
            .collect()
    }

    /// Signals in its conditions and flags.
    pub fn signals(&self) -> impl Iterator<Item = &str> {
        self.counted().chain(self.flags.keys()).map(String::as_str)
    }

    /// Signals for which a smallest step must be configured: those of all conditions.
    pub fn counted(&self) -> impl Iterator<Item = &String> {
        self.steps
            .keys()
            .chain(self.moves.keys())
            .chain(self.pulses.keys())
            .chain(self.sweep.keys())
    }
}

/// Weights and statuses that replace the class's own in part of the α range.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClassOverrides {
    /// For maneuvers whose mean α is above this.
    pub above_alpha_deg: f64,
    pub weights: BTreeMap<Output, f64>,
    pub statuses: BTreeMap<String, Status>,
}

/// One maneuver class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Class {
    pub name: String,
    pub title: String,
    pub axis: Axis,
    pub recognition: Recognition,
    /// Every derivative and bias of the axis → its status.
    pub statuses: BTreeMap<String, Status>,
    /// The diagonal of W₁ (Tables 2 and 4), on residuals in deg, deg/s and g.
    pub weights: BTreeMap<Output, f64>,
    pub overrides: Vec<ClassOverrides>,
}

impl Class {
    /// Status of a derivative at a mean angle of attack.
    #[must_use]
    pub fn status(&self, name: &str, alpha_deg: f64) -> Option<Status> {
        self.overrides_at(alpha_deg)
            .filter_map(|o| o.statuses.get(name))
            .last()
            .or_else(|| self.statuses.get(name))
            .copied()
    }

    /// The weight of an output at a mean angle of attack.
    #[must_use]
    pub fn weight(&self, output: Output, alpha_deg: f64) -> Option<f64> {
        self.overrides_at(alpha_deg)
            .filter_map(|o| o.weights.get(&output))
            .last()
            .or_else(|| self.weights.get(&output))
            .copied()
    }

    /// The class with the overrides at a mean angle of attack applied, for maneuvers that are
    /// estimated together.
    #[must_use]
    pub fn at(&self, alpha_deg: f64) -> Class {
        let mut class = self.clone();
        for over in self.overrides_at(alpha_deg) {
            class.statuses.extend(over.statuses.clone());
            class.weights.extend(over.weights.clone());
        }
        class.overrides.clear();
        class
    }

    /// The class with these derivatives and biases of one status at all angles of attack.
    #[must_use]
    pub fn with_status(&self, names: &BTreeSet<String>, own: Status) -> Class {
        let mut class = self.clone();
        let overrides = class.overrides.iter_mut().map(|o| &mut o.statuses);
        for statuses in std::iter::once(&mut class.statuses).chain(overrides) {
            let named = statuses
                .iter_mut()
                .filter(|(name, _)| names.contains(*name));
            named.for_each(|(_, status)| *status = own);
        }
        class
    }

    /// Removes the status `held` from all derivatives: without a wind tunnel there is no value at
    /// which to hold them. Returns the number of removed statuses.
    pub fn hold_nothing(&mut self) -> usize {
        let overrides = self.overrides.iter_mut().map(|o| &mut o.statuses);
        let statuses = std::iter::once(&mut self.statuses).chain(overrides);
        let held = statuses
            .flat_map(BTreeMap::values_mut)
            .filter(|status| **status == Status::Held);
        held.map(|status| *status = Status::Inactive).count()
    }

    fn overrides_at(&self, alpha_deg: f64) -> impl Iterator<Item = &ClassOverrides> {
        self.overrides
            .iter()
            .filter(move |o| alpha_deg > o.above_alpha_deg)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_override_holds_above_its_angle_only() {
        let class = Class {
            name: "PYRS".into(),
            title: String::new(),
            axis: Axis::Lateral,
            recognition: Recognition::default(),
            statuses: [("CY_da".to_owned(), Status::Held)].into(),
            weights: [(Output::P, 3.0)].into(),
            overrides: vec![ClassOverrides {
                above_alpha_deg: 22.5,
                weights: [(Output::P, 6.0)].into(),
                statuses: [("CY_da".to_owned(), Status::Estimated)].into(),
            }],
        };
        assert_eq!(class.status("CY_da", 20.1), Some(Status::Held));
        assert_eq!(class.status("CY_da", 25.0), Some(Status::Estimated));
        assert_eq!(class.weight(Output::P, 22.5), Some(3.0));
        assert_eq!(class.weight(Output::P, 22.6), Some(6.0));
        let above = class.at(25.0);
        assert_eq!(
            (above.status("CY_da", 10.0), above.weight(Output::P, 10.0)),
            (Some(Status::Estimated), Some(6.0))
        );
        assert_eq!(class.at(20.0).status("CY_da", 25.0), Some(Status::Held));
        let mut without_tunnel = class;
        assert_eq!(without_tunnel.hold_nothing(), 1);
        assert_eq!(without_tunnel.status("CY_da", 20.0), Some(Status::Inactive));
        assert_eq!(
            without_tunnel.status("CY_da", 25.0),
            Some(Status::Estimated)
        );
    }
}
