//! Maneuvers of a joint estimation whose flights record the same outputs. The maneuvers share the free
//! derivatives of one class, and an absent output changes those.

use std::collections::BTreeMap;

use crate::aero::Output;
use crate::estimate::context::Context;
use crate::estimate::holding::absent_outputs::class_of_recorded_outputs;
use crate::estimate::task::Task;
use crate::flight::Record;
use crate::maneuver::{Class, Maneuver};

/// A maneuver with its record.
type Flown<'r> = (&'r Record, &'r Maneuver);

/// Maneuvers with the same recorded outputs, and their class.
pub struct RecordedAlike<'r> {
    pub members: Vec<Flown<'r>>,
    /// Maneuvers with other recorded outputs, each with the reason.
    pub left_out: Vec<(&'r Maneuver, String)>,
    pub class: Class,
    /// Reason for each derivative and bias that the group does not estimate for want of an output.
    pub reasons: BTreeMap<String, String>,
}

impl<'r> RecordedAlike<'r> {
    /// Keeps the maneuvers that record as much as the one that records most.
    pub fn new(members: &[Flown<'r>], class: &Class, context: &Context) -> RecordedAlike<'r> {
        let absent = |(record, _): &Flown| absent_outputs(record, class);
        let Some(best) = members.iter().min_by_key(|member| absent(member).len()) else {
            return RecordedAlike {
                members: vec![],
                left_out: vec![],
                class: class.clone(),
                reasons: BTreeMap::new(),
            };
        };
        let task = Task {
            record: best.0,
            maneuver: best.1,
            class,
            context,
        };
        let of_best = absent(best);
        let (own, reasons) = class_of_recorded_outputs(&task);
        let (alike, others): (Vec<Flown>, Vec<Flown>) =
            members.iter().partition(|member| absent(member) == of_best);
        let left_out = others.iter().map(|other| {
            let lacking = absent(other).into_iter().filter(|o| !of_best.contains(o));
            let lacking: Vec<&str> = lacking.map(Output::signal).collect();
            (other.1, format!("{} is not recorded", lacking.join(", ")))
        });
        RecordedAlike {
            left_out: left_out.collect(),
            members: alike,
            class: own,
            reasons,
        }
    }
}

/// Outputs of the axis that have stand-ins in a record.
fn absent_outputs(record: &Record, class: &Class) -> Vec<Output> {
    let outputs = class.axis.outputs().into_iter();
    outputs
        .filter(|output| record.is_assumed(output.signal()))
        .collect()
}
